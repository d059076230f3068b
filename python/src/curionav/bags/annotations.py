"""Writing where people are annotated in a bag, for ``--annotations`` of `curionav track`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from . import drive as drives
from .bag import Bag, BagError, seconds
from .frames import Mount
from .planar import Pose2
from .topics import Choice, people_topic

HEADER = "stamp_s,x,y,id"


@dataclass
class WrittenPeople:
    """What became of the annotations of a bag."""

    table: Path
    topic: str
    people: int = 0
    """lines of the table"""
    scans: int = 0
    """scans with at least one person"""
    before_scans: int = 0
    """annotations before the first scan, which are left out"""


def write_people(bag_path: Path, table: Path, choice: Choice | None = None, topic: str | None = None) -> WrittenPeople:
    """Writes the people who are annotated in a bag, with a line per person and scan.

    Annotations are ``leg_tracker/Person``, as the tool of leg_tracker_benchmarks writes them: in the frame of the
    scanner and without a stamp, after the scan that they are of. In the table they have the stamp of that scan, and
    stand in the frame of the robot.

    Raises:
        BagError: The bag cannot be read, has no annotations, or does not say where the scanner is.
    """
    choice = choice or Choice()
    lines = [HEADER]
    with Bag(bag_path) as bag:
        written = WrittenPeople(table, people_topic(bag, topic))
        drive = drives.read(bag, choice)
        stamp: float | None = None
        annotated: set[float] = set()
        for entry in bag.entries([drive.scan_topic, written.topic]):
            if entry.topic == drive.scan_topic:
                stamp = seconds(entry.message.header.stamp)
            elif stamp is None:
                written.before_scans += 1
            else:
                at = entry.message.pose.position
                if not (math.isfinite(at.x) and math.isfinite(at.y)):
                    raise BagError(f"{bag_path}: at {stamp:.3f} s a person of `{written.topic}` is at {at.x}, {at.y}")
                place = _on_robot(drive.mount, float(at.x), float(at.y))
                lines.append(f"{stamp:.6f},{place.x:.4f},{place.y:.4f},{int(entry.message.id)}")
                annotated.add(stamp)
    written.people = len(lines) - 1
    written.scans = len(annotated)
    if not written.people:
        raise BagError(f"{bag_path}: no message on `{written.topic}` comes after a scan")
    table.parent.mkdir(parents=True, exist_ok=True)
    table.write_text("\n".join(lines) + "\n", "ascii")
    return written


def _on_robot(mount: Mount, x: float, y: float) -> Pose2:
    """A place in the scanner's frame in that of the robot."""
    across = -y if mount.is_upside_down else y
    return mount.pose.compose(Pose2(x, across, 0.0))
