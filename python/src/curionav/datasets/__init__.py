"""Finds and downloads the datasets that scenarios and tests read; as a command ``python -m curionav.datasets --help``.

A scenario names a file of a dataset ``dataset:NAME/FILE``. It is the file ``NAME/FILE`` in the folder that the
environment variable ``CURIONAV_DATA`` names, by default ``curionav`` in the user's cache directory.
"""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from ..errors import DatasetError
from .catalogue import Dataset

_PREFIX = "dataset:"


def folder() -> Path:
    """The folder of datasets: what ``CURIONAV_DATA`` names, by default ``curionav`` in the user's cache directory."""
    if named := os.environ.get("CURIONAV_DATA"):
        return Path(named)
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "curionav"
    # The XDG specification has relative paths ignored.
    cache = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (cache if cache.is_absolute() else Path.home() / ".cache") / "curionav"


def locate(file: str, base: Path = Path()) -> Path:
    """The path of a file that a scenario names.

    Args:
        file: ``dataset:NAME/FILE``, a file of a dataset, which must exist; or a path.
        base: The directory that a relative path starts from.

    Raises:
        DatasetError: The file of the dataset is not there, or the reference has another form.
    """
    if not file.startswith(_PREFIX):
        return base / file
    parts = file[len(_PREFIX) :].split("/")
    if len(parts) < 2 or any(part in {"", ".", ".."} or "\\" in part for part in parts):
        raise DatasetError(f"`{file}` names no file of a dataset; write `dataset:NAME/FILE`, without `..`")
    path = folder().joinpath(*parts)
    if not path.is_file():
        raise DatasetError(
            f"there is no file {path}; `python -m curionav.datasets {parts[0]}` downloads it, "
            "and CURIONAV_DATA names the folder of datasets"
        )
    return path


def faults(dataset: Dataset, directory: Path) -> dict[str, str]:
    """What is wrong with each file of a dataset in a folder of datasets: ``missing``, or ``another content``.

    Raises:
        DatasetError: A file cannot be read.
    """
    found = {}
    for file in dataset.files:
        path = directory / dataset.name / file.path
        try:
            if hashlib.sha256(path.read_bytes()).hexdigest() != file.sha256:
                found[file.path] = "another content"
        except (FileNotFoundError, NotADirectoryError):
            found[file.path] = "missing"
        except OSError as error:
            raise DatasetError(f"cannot read {path}: {error.strerror}") from error
    return found


def download(dataset: Dataset, directory: Path) -> list[str]:
    """Downloads the files of a dataset that a folder of datasets lacks or has with another content.

    A file appears under its name when it is whole and its checksum is right. Files that are right stay as they are.

    Returns:
        The files that were downloaded.

    Raises:
        DatasetError: A file cannot be downloaded or written, or its checksum is wrong; or pooch is not installed.
    """
    wanted = faults(dataset, directory)
    if not wanted:
        return []
    try:
        import pooch  # noqa: PLC0415 - an extra
        from requests import RequestException  # noqa: PLC0415 - comes with pooch
    except ImportError:
        raise DatasetError("downloading needs the package pooch: pip install 'pooch >= 1.8, < 2'") from None
    pooch.get_logger().setLevel("WARNING")
    for file in dataset.files:
        if file.path not in wanted:
            continue
        target = directory / dataset.name / file.path
        try:
            pooch.retrieve(file.url, file.sha256, target.name, target.parent, downloader=pooch.HTTPDownloader())
            # pooch keeps the mode of its temporary file, which only its owner may read.
            target.chmod(0o644)
        except RequestException as error:
            raise DatasetError(f"cannot download {file.url}: {error}") from error
        except OSError as error:
            raise DatasetError(
                f"cannot write {target}: {error.strerror or error}; name another folder with CURIONAV_DATA or --to"
            ) from error
        except ValueError as error:
            raise DatasetError(f"{file.url} has another content than expected: {error}") from error
    return list(wanted)
