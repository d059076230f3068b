"""Writing a drive as a log of the Carmen toolkit, which `curionav localize` and `curionav map build` read."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import numpy as np

from . import drive as drives
from .bag import Bag, BagError
from .planar import Pose2
from .sweep import Sweep
from .topics import Choice

DIFFERS = 0.3
"""m and rad: where a log's two poses differ by more, `curionav` takes the first one for a reference."""
USUAL_RANGE = 30.0
"""Ranges from here on count as nothing met, unless `curionav localize` is told otherwise, m."""


@dataclass(frozen=True)
class Referred:
    """Where the robot was at one scan."""

    stamp: float
    """s"""
    reference: Pose2
    """map frame"""
    odometry: Pose2


@dataclass
class Written:
    """What became of a bag."""

    log: Path
    scans: int = 0
    scans_left_out: int = 0
    """those without odometry around them"""
    range_max: float = 0.0
    """m, the greatest of the scans"""
    scan_topic: str = ""
    odometry_from: str = ""
    mount: Pose2 = field(default_factory=Pose2)
    reference_log: Path | None = None
    references: int = 0
    reference_from: str = ""
    notes: list[str] = field(default_factory=list)


def write_log(bag_path: Path, log: Path, choice: Choice | None = None) -> Written:
    """Writes a bag's drive into ``log``, and its references into another log beside that.

    Each scan stands with odometry of its own time. References stand with the stamps of the scans, in a log that
    ``--reference`` of `curionav localize` and `curionav map build` takes.

    Raises:
        BagError: The bag cannot be read, lacks scans or odometry, or does not say where the scanner is.
    """
    reference_log = log.with_suffix(".reference.log")
    log.parent.mkdir(parents=True, exist_ok=True)
    # Those of an earlier attempt would be taken for this one's.
    log.unlink(missing_ok=True)
    reference_log.unlink(missing_ok=True)
    with Bag(bag_path) as bag:
        drive = drives.read(bag, choice or Choice())
        written = Written(log, scan_topic=drive.scan_topic, odometry_from=drive.odometry_from, mount=drive.mount.pose)
        part = log.with_name(f"{log.name}.part")
        try:
            with part.open("w", encoding="ascii") as file:
                references = _write_scans(file, bag, drive, written)
            if not written.scans:
                raise BagError(f"{bag_path}: none of {written.scans_left_out} scans has odometry within a second")
            part.replace(log)
        finally:
            part.unlink(missing_ok=True)
    written.notes = drive.notes
    if references:
        reference_log.write_text(_reference_lines(references), "ascii")
        written.reference_log = reference_log
        written.references = len(references)
        written.reference_from = drive.reference_from
    return written


def _write_scans(file: TextIO, bag: Bag, drive: drives.Drive, written: Written) -> list[Referred]:
    """Writes the scans that have odometry, counts them, and gives the references."""
    references = []
    for sweep in drive.sweeps(bag):
        odometry = drive.odometry_at(sweep.stamp)
        if odometry is None:
            written.scans_left_out += 1
            continue
        file.write(_scan_line(sweep, odometry, drive.mount.pose))
        written.scans += 1
        written.range_max = max(written.range_max, sweep.range_max)
        reference = drive.reference_at(sweep.stamp)
        if reference is not None:
            references.append(Referred(sweep.stamp, reference, odometry))
    return references


def _scan_line(sweep: Sweep, robot: Pose2, mount: Pose2) -> str:
    """A scan in the toolkit's newer form, which says how its beams lie and where the laser sits on the robot."""
    beams = len(sweep.ranges)
    # As few digits as give the same number again.
    ranges = " ".join(np.asarray(sweep.ranges, np.float32).astype(np.str_))
    fov = sweep.step * (beams - 1)
    scanner = f"0 {sweep.start!r} {fov!r} {sweep.step!r} {sweep.range_max!r} 0.01 0"
    poses = f"{_words(robot.compose(mount))} {_words(robot)}"
    return f"ROBOTLASER1 {scanner} {beams} {ranges} 0 {poses} 0 0 0 0 0 {_end(sweep.stamp)}"


def _reference_lines(references: list[Referred]) -> str:
    """Scans of two beams that say nothing, for the sake of their poses.

    If references stay as close to odometry as if they were odometry, a reader takes the second pose. Then that is the
    reference as well.
    """
    start = references[0]
    back, home = start.reference.inverse(), start.odometry.inverse()
    differs = any(not back.compose(one.reference).is_near(home.compose(one.odometry), DIFFERS) for one in references)
    lines = []
    for one in references:
        beside = one.odometry if differs else one.reference
        lines.append(f"FLASER 2 0 0 {_words(one.reference)} {_words(beside)} {_end(one.stamp)}")
    return "".join(lines)


def _words(pose: Pose2) -> str:
    return f"{pose.x:.9f} {pose.y:.9f} {pose.heading:.9f}"


def _end(stamp: float) -> str:
    return f"{stamp:.6f} bag {stamp:.6f}\n"
