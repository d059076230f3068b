"""The drives that localisers are compared on: logs, maps and starts, as `curionav localize` takes them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from plane_pose import Pose
from tracking import End


@dataclass(frozen=True)
class Drive:
    """A log with its map. Without a start it begins at the first reference."""

    name: str
    log: Path
    map: Path
    reference: Path | None = None
    start: Pose | None = None
    laser: Pose | None = None
    range_max: float = 30.0
    odometry_noise: float = 1.0
    end: End | None = None

    def missing(self) -> list[Path]:
        """Files that are not there."""
        return [path for path in (self.log, self.map, self.reference) if path is not None and not path.is_file()]

    def arguments(self, anywhere: bool) -> list[str]:
        """What `curionav localize` is told."""
        arguments = [str(self.log), "--map", str(self.map), "--range-max", f"{self.range_max!r}"]
        arguments += ["--odometry-noise", f"{self.odometry_noise!r}"]
        if self.reference is not None:
            arguments += ["--reference", str(self.reference)]
        if self.laser is not None:
            arguments += ["--laser", _numbers(self.laser)]
        if anywhere:
            arguments += ["--global"]
        elif self.start is not None:
            arguments += ["--start", _numbers(self.start)]
        return arguments


def pose(text: str) -> Pose:
    """`x,y,heading` as the program takes it; raises `ValueError` for anything else."""
    numbers = [float(word) for word in text.split(",")]
    if len(numbers) != 3:
        raise ValueError("give three numbers with commas between them, such as 1.5,-2,0")
    return Pose(*numbers)


def read_drives(path: Path, folder: Path | None) -> list[Drive]:
    """The tables `[[drive]]` of a file, whose paths start from `folder`, or from where the file is."""
    base = path.parent if folder is None else folder
    return [_drive(table, base) for table in tomllib.loads(path.read_text())["drive"]]


def _drive(table: dict[str, Any], base: Path) -> Drive:
    unknown = table.keys() - {one.name for one in fields(Drive)}
    if unknown:
        raise ValueError(f"a drive has no {', '.join(sorted(unknown))}")
    given: dict[str, Any] = dict(table)
    for name in ("log", "map", "reference"):
        if name in given:
            given[name] = base / given[name]
    for name in ("start", "laser"):
        if name in given:
            given[name] = Pose(*given[name])
    if "end" in given:
        given["end"] = End(*given["end"])
    return Drive(**given)


def _numbers(of: Pose) -> str:
    return f"{of.x!r},{of.y!r},{of.heading!r}"
