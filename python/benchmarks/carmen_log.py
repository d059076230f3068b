"""Reads logs of the Carmen toolkit by the rules of `crates/lab/src/robot_log/carmen.rs`.

Lines `ODOM`, `FLASER`, `ROBOTLASER1`, `NEFF` and `PARAM robot_frontlaser_offset` are read. Others, and lines that
cannot be read, are left out.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from plane_pose import Pose
from robot_log import Clock, Laser, Log, Reading

DIFFERS = 0.3
"""A pose of a log differs from odometry if it is anywhere this far off, metres and radians."""
CLOCK_SHARE = 0.9
"""A log whose scans are newer than the one before less often than this has no clock."""
MOST_READINGS = 8192


@dataclass(frozen=True)
class Scanner:
    """What a log does not say: the greatest range, and where the laser sits if not as the log says."""

    range_max: float = 30.0
    mounted: Pose | None = None


@dataclass(frozen=True)
class TimedPose:
    """A line of odometry."""

    stamp: float
    pose: Pose


@dataclass(frozen=True)
class ScanLine:
    """A line with a scan. `driven_to` is the last odometry between it and the scan before."""

    stamp: float
    ranges: list[float]
    mounted: Pose
    first: float
    step: float
    range_max: float
    pose: Pose
    odometry: Pose | None
    driven_to: Pose | None = None

    def reading(self, odometry: Pose, stamp: float) -> Reading:
        """The scan with the odometry and the time that it turned out to have."""
        laser = Laser(self.mounted.compose(Pose(0.0, 0.0, self.first)), self.step, self.range_max)
        return Reading(stamp, self.ranges, laser, odometry, self.pose)


@dataclass
class Words:
    """The words of a line, taken one by one; a word that is missing or wrong raises `ValueError`."""

    words: list[str]
    at: int = 0

    def take(self, count: int) -> list[str]:
        """The next words."""
        taken = self.words[self.at : self.at + count]
        if len(taken) < count:
            raise ValueError("the line is too short")
        self.at += count
        return taken

    def numbers(self, count: int) -> list[float]:
        """The next words as finite numbers."""
        numbers = [float(word) for word in self.take(count)]
        if not all(map(math.isfinite, numbers)):
            raise ValueError("a number is not finite")
        return numbers

    def pose(self) -> Pose:
        """The next three numbers."""
        return Pose(*self.numbers(3))

    def count(self) -> int:
        """The next word as a number of readings."""
        number = self.numbers(1)[0]
        if number != int(number) or not 0 <= number <= MOST_READINGS:
            raise ValueError("no number of readings")
        return int(number)

    def ranges(self) -> list[float]:
        """A number of ranges, and these; one that is not positive says nothing."""
        count = self.count()
        if count < 2:
            raise ValueError("a scan of one reading has no spacing")
        return [_range(word) for word in self.take(count)]


@dataclass
class Lines:
    """What a log says, in the order of its lines."""

    odometry: list[TimedPose] = field(default_factory=list)
    scans: list[ScanLine] = field(default_factory=list)
    is_of_gmapping: bool = False
    offset: float = 0.0
    clock: Clock = field(default_factory=Clock)
    driven_to: Pose | None = None

    def take(self, line: str, scanner: Scanner) -> None:
        """Reads a line."""
        words = Words(line.split())
        match words.words[:2]:
            case ["ODOM", *_]:
                words.at = 1
                pose = words.pose()
                stamp = words.numbers(4)[3]
                self._odometry(pose, stamp)
            case ["FLASER", *_]:
                words.at = 1
                self._scan(_front_laser(words, scanner), scanner)
            case ["ROBOTLASER1", *_]:
                words.at = 1
                self._scan(_robot_laser(words, scanner), scanner)
            case ["PARAM", "robot_frontlaser_offset" | "robot_front_laser_offset"]:
                words.at = 2
                self.offset = words.numbers(1)[0]
            case ["NEFF", *_]:
                self.is_of_gmapping = True

    def _odometry(self, pose: Pose, stamp: float) -> None:
        # GMapping repeats a scan's pose as odometry, without a time.
        if self.scans and self.scans[-1].pose == pose:
            return
        self.driven_to = pose
        self.odometry.append(TimedPose(self.clock.time(stamp), pose))

    def _scan(self, scan: ScanLine, scanner: Scanner) -> None:
        mounted = scan.mounted
        if scanner.mounted is None and mounted.x == 0.0:
            mounted = replace(mounted, x=self.offset)
        stamp = self.clock.time(scan.stamp)
        self.scans.append(replace(scan, stamp=stamp, mounted=mounted, driven_to=self.driven_to))
        self.driven_to = None

    def of_carmen(self) -> list[Reading]:
        """The poses of scans are references, unless they move as odometry does all along."""
        odometry = sorted(self.odometry, key=lambda line: line.stamp)
        readings = []
        for scan in self.scans:
            own = scan.odometry or _between(odometry, scan.stamp) or scan.pose
            readings.append(scan.reading(own, scan.stamp))
        start = readings[0]
        at = start.reference or Pose()
        for reading in readings:
            moved = at.relative(reading.reference or Pose())
            if not start.odometry.relative(reading.odometry).is_near(moved, DIFFERS):
                return readings
        return [replace(reading, reference=None) for reading in readings]

    def of_gmapping(self) -> list[Reading]:
        """Odometry is what lies between a scan's pose and the last line of odometry before the next scan."""
        newer = sum(after.stamp > before.stamp for before, after in pairwise(self.scans))
        without_clock = newer < CLOCK_SHARE * (len(self.scans) - 1)
        readings = []
        odometry = Pose()
        last: Pose | None = None
        for number, scan in enumerate(self.scans):
            if last is not None and scan.driven_to is not None:
                odometry = odometry.compose(last.relative(scan.driven_to))
            last = scan.pose
            readings.append(scan.reading(odometry, float(number) if without_clock else scan.stamp))
        return readings


def _range(word: str) -> float:
    try:
        number = float(word)
    except ValueError:
        return math.nan
    return number if number > 0.0 else math.nan


def _front_laser(words: Words, scanner: Scanner) -> ScanLine:
    ranges = words.ranges()
    pose = words.pose()
    odometry = words.pose()
    stamp = words.numbers(1)[0]
    # Half a turn: 180 readings are the first 180 of 181.
    gaps = len(ranges) - len(ranges) % 2
    mounted = scanner.mounted or Pose()
    return ScanLine(stamp, ranges, mounted, -math.pi / 2.0, math.pi / gaps, scanner.range_max, pose, odometry)


def _robot_laser(words: Words, scanner: Scanner) -> ScanLine:
    _, first, _, step, most, _, _ = words.numbers(7)
    ranges = words.ranges()
    words.take(words.count())
    on_map = words.pose()
    pose = words.pose()
    stamp = words.numbers(6)[5]
    mounted = scanner.mounted or pose.relative(on_map)
    range_max = min(scanner.range_max, max(most, 0.1))
    return ScanLine(stamp, ranges, mounted, first, step, range_max, pose, None)


def _between(odometry: list[TimedPose], stamp: float) -> Pose | None:
    """Odometry at `stamp`, between the lines around it."""
    after = bisect_left(odometry, stamp, key=lambda line: line.stamp)
    if not odometry:
        return None
    if 0 < after < len(odometry):
        a = odometry[after - 1]
        b = odometry[after]
        # Across a restart there is nothing in between.
        if b.stamp > a.stamp and a.pose.is_near(b.pose, 1.0):
            return a.pose.toward(b.pose, (stamp - a.stamp) / (b.stamp - a.stamp))
    return odometry[max(after - 1, 0)].pose


def parse(text: str, scanner: Scanner) -> Log:
    """The log of these lines; raises `ValueError` if it has no scan."""
    lines = Lines()
    for line in text.split("\n"):
        try:
            lines.take(line, scanner)
        except ValueError:
            continue
    if not lines.scans:
        raise ValueError("no line begins with FLASER or ROBOTLASER1")
    return Log.of(lines.of_gmapping() if lines.is_of_gmapping else lines.of_carmen())


def read(path: Path, reference: Path | None, scanner: Scanner) -> Log:
    """The log of a file, with the poses of `reference`, if given, as references."""
    log = parse(path.read_text(errors="replace"), scanner)
    if reference is None:
        return log
    return log.with_references_of(parse(reference.read_text(errors="replace"), scanner))
