"""The text files that PedPy reads: ``id frame x y``, with frame rate and unit in remarks.

As ``pedpy.load_trajectory`` (PedPy 1.5) understands them: blanks between the columns, further columns are ignored, a
remark with ``framerate`` holds the frames per second, and one with ``x/m`` or ``x/cm`` the unit.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from ..errors import FileError
from .rows import Rows, lines_of, number, write
from .tracks import Tracks

_RATE = re.compile(r"framerate\D*(\d+(?:\.\d+)?)")
_ROBOT = re.compile(r"robot: id (\d+)")
_METRES = {"m": 1.0, "cm": 0.01}


def write_pedpy(tracks: Tracks, file: str | os.PathLike[str]) -> None:
    """Writes all rows by frame; positions to a tenth of a millimetre. A remark names the robot, which PedPy ignores.

    Raises:
        FileError: The file cannot be written.
    """
    robot = [] if tracks.robot is None else [f"# robot: id {tracks.robot}"]
    head = [f"# framerate: {tracks.frame_rate:.10g} fps", *robot, "# id frame x/m y/m"]
    rows = tracks.by_time()
    columns = zip(rows.id.tolist(), rows.frame.tolist(), rows.x.tolist(), rows.y.tolist(), strict=True)
    write(Path(file), head + [f"{one} {frame} {x:.4f} {y:.4f}" for one, frame, x, y in columns])


def read_pedpy(file: str | os.PathLike[str], frame_rate: float | None = None, unit: str | None = None) -> Tracks:
    """Reads such a file.

    Args:
        file: The text.
        frame_rate: Frames per second, if the file does not say it.
        unit: ``m`` or ``cm``, if the file does not say it.

    Raises:
        FileError: It cannot be read, a line is wrong, or frame rate or unit are said nowhere or twice differently.
    """
    path, rows = Path(file), Rows(Path(file))
    said: dict[str, str] = {}
    for line, text in enumerate(lines_of(path), 1):
        if text.startswith("#"):
            said = {**_said(text), **said}
            continue
        words = text.split()
        if not words:
            continue
        if len(words) < 4:
            raise FileError(path, f"has {len(words)} columns; write id, frame, x and y with blanks between them", line)
        one, frame, x, y = (
            number(path, line, word, name) for word, name in zip(words[:4], ("id", "frame", "x", "y"), strict=True)
        )
        rows.add(line, one, frame, x, y)
    metres = _METRES[str(_agreed(path, "unit", said.get("unit"), unit, "# id frame x/m y/m"))]
    rate = _agreed(path, "frame_rate", said.get("frame_rate"), frame_rate, "# framerate: 25")
    robot = said.get("robot")
    tracks = rows.tracks(float(rate), None if robot is None else int(robot))
    return Tracks(tracks.frame_rate, tracks.id, tracks.frame, tracks.x * metres, tracks.y * metres, tracks.robot)


def _said(remark: str) -> dict[str, str]:
    """What a remark says of frame rate, unit and robot."""
    found = {}
    if rate := _RATE.search(remark):
        found["frame_rate"] = rate[1]
    if robot := _ROBOT.search(remark):
        found["robot"] = robot[1]
    lower = remark.lower()
    for unit in ("cm", "m"):
        if f"x/{unit}" in lower or re.search(rf"\bin {unit}\b", lower):
            found["unit"] = unit
            break
    return found


def _agreed(file: Path, name: str, said: str | None, given: float | str | None, remark: str) -> float | str:
    if name == "unit" and given is not None and given not in _METRES:
        raise FileError(file, f"the unit {given!r} is unknown; use m or cm")
    if said is None and given is None:
        option = "--" + name.replace("_", "-")
        raise FileError(file, f"does not say its {name}; give {name}= or {option}, or add a line such as `{remark}`")
    if said is None:
        assert given is not None
        return given
    if given is not None and (given if name == "unit" else float(given)) != (said if name == "unit" else float(said)):
        raise FileError(file, f"says that its {name} is {said}, but {given} was given; leave out one of them")
    return said
