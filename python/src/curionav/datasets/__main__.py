"""The command ``python -m curionav.datasets``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ..errors import DatasetError
from . import download, faults, folder
from .catalogue import DATASETS, Dataset

_EPILOG = """\
The folder of datasets is the one that CURIONAV_DATA names, by default {folder}.
Every file is published at a fixed commit of a public repository, and is kept only if its SHA-256 checksum is right.
A scenario names such a file `dataset:NAME/FILE`.

examples:
  python -m curionav.datasets --list                  # what there is, under which licence
  python -m curionav.datasets maps_real_slam          # for scenarios/real/osnabrueck-floor3.toml
  python -m curionav.datasets all --to DIR            # all of them into DIR; then set CURIONAV_DATA=DIR
  python -m curionav.datasets --check                 # whether all files are there and right

Without a network, copy the files from another machine into the folder and run --check.
"""


def main(arguments: Sequence[str] | None = None, catalogue: Sequence[Dataset] = DATASETS) -> int:
    """Exit status: 0 all is there, 1 something is missing or could not be downloaded, 2 bad arguments."""
    parser = argparse.ArgumentParser(
        prog="python -m curionav.datasets",
        description="Downloads the maps and recordings that scenarios/real and the tests read.",
        epilog=_EPILOG.format(folder=folder()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", nargs="*", metavar="NAME", help="dataset to download or check, or `all`")
    parser.add_argument("--list", action="store_true", help="show the datasets with their licences; download nothing")
    parser.add_argument("--check", action="store_true", help="compare the files with their checksums; download nothing")
    parser.add_argument("--to", metavar="DIR", type=Path, help="folder to use in place of the folder of datasets")
    options = parser.parse_args(arguments)
    known = {dataset.name: dataset for dataset in catalogue}
    for name in options.name:
        if name not in known and name != "all":
            parser.error(f"there is no dataset `{name}`; there are {', '.join(known)}")
    if not options.name and not options.list and not options.check:
        parser.error("name a dataset, or give --list to see what there is")
    chosen = [known[name] for name in known if name in options.name or "all" in options.name or not options.name]
    directory = options.to or folder()
    try:
        if options.list:
            print("\n".join(map(_description, chosen)))
            return 0
        # All are looked at, and all that is wrong is told.
        return max([(_check if options.check else _download)(dataset, directory) for dataset in chosen])
    except DatasetError as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def _description(dataset: Dataset) -> str:
    megabytes = dataset.size / 1e6
    return (
        f"{dataset.name} ({megabytes:.1f} MB): {dataset.what}\n"
        f"  licence: {dataset.licence}\n"
        f"  source:  {dataset.source}"
    )


def _check(dataset: Dataset, directory: Path) -> int:
    found = faults(dataset, directory)
    for file, fault in found.items():
        print(f"{dataset.name}/{file}: {fault}")
    if found:
        print(f"`python -m curionav.datasets {dataset.name}` downloads what is wrong in {directory / dataset.name}")
        return 1
    print(f"{dataset.name}: complete in {directory / dataset.name}")
    return 0


def _download(dataset: Dataset, directory: Path) -> int:
    print(_description(dataset))
    for file in download(dataset, directory):
        print(f"  downloaded {file}")
    print(f"  complete in {directory / dataset.name}")
    if directory != folder():
        print(f"  set CURIONAV_DATA={directory.resolve()}, so that scenarios find it")
    return 0


if __name__ == "__main__":
    sys.exit(main())
