"""The command ``python -m curionav.trajectories``."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ..errors import CurionavError, FileError
from ..result import Result
from . import (
    from_result,
    read_pedpy,
    read_socnav,
    read_trajnet,
    write_pedpy,
    write_recorded,
    write_socnav,
    write_trajnet,
)
from .tracks import Tracks

FORMATS = ("pedpy", "trajnet", "socnav", "recorded")
_EPILOG = """\
IN is a run: a recording of `curionav run --record` (.mcap), or the folder of `--out`, which has no people; or it is
a file of people: of PedPy (.txt), TrajNet++ (.ndjson) or SocNavData (.json).

`recorded` is what a scenario plays; the command prints the lines for the scenario. `socnav` needs a recording.

examples:
  curionav run quickstart --record run.mcap
  python -m curionav.trajectories run.mcap run.txt --format pedpy
  python -m curionav.trajectories crowd.ndjson crowd.txt --format recorded >> scenario.toml
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 the file is written, 2 bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m curionav.trajectories",
        description="Converts runs and recorded people into the files of other programs, and of scenarios.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", metavar="IN", type=Path, help="a run, or a file of people")
    parser.add_argument("target", metavar="OUT", type=Path, help="the file to write")
    parser.add_argument("--format", choices=FORMATS, required=True, help="the form of OUT")
    parser.add_argument("--frame-rate", type=float, metavar="HZ", help="frames per second of IN, if it does not say it")
    parser.add_argument("--unit", choices=("m", "cm"), help="unit of a .txt file, if it does not say it")
    options = parser.parse_args(arguments)
    try:
        if options.format == "socnav":
            write_socnav(_run(options.source), options.target)
            return 0
        tracks = _tracks(options.source, options.frame_rate, options.unit)
        if options.format == "pedpy":
            write_pedpy(tracks, options.target)
        elif options.format == "trajnet":
            write_trajnet(tracks, options.target)
        else:
            sys.stdout.write(write_recorded(tracks, options.target))
    except CurionavError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return 0


def _run(source: Path) -> Result:
    if source.suffix in (".txt", ".ndjson"):
        raise FileError(source, "holds people alone; give a recording of `curionav run --record` (.mcap)")
    return Result.load(source)


def _tracks(source: Path, frame_rate: float | None, unit: str | None) -> Tracks:
    if source.suffix == ".txt":
        return read_pedpy(source, frame_rate, unit)
    if source.suffix == ".ndjson":
        return read_trajnet(source, frame_rate)
    if source.suffix == ".json" and _is_socnav(source):
        return read_socnav(source, frame_rate)
    return from_result(Result.load(source))


def _is_socnav(source: Path) -> bool:
    try:
        data = json.loads(source.read_bytes())
    except (OSError, ValueError):
        return False  # the reader of results says what is wrong
    return isinstance(data, dict) and "sequence" in data


if __name__ == "__main__":
    sys.exit(main())
