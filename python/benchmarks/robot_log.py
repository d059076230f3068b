"""A log of a laser and odometry, made fit for a filter as `curionav localize` makes it.

The rules are those of `crates/lab/src/robot_log/mod.rs`. The harness compares the counts and lengths that it finds with
what the program prints, so that the two cannot part unnoticed.
"""

from __future__ import annotations

import statistics
from bisect import bisect_left
from dataclasses import dataclass, field, replace
from itertools import pairwise

from plane_pose import Pose

SET_BACK_S = 1.0
"""A clock that goes back this far was set, seconds; less is disorder."""
STEP_S = 1e-3
"""Seconds that pass while a clock is set back."""
FASTEST = 4.0
"""Faster than this no robot moves, m/s and rad/s: odometry was restarted."""
SLACK = 0.5
"""Metres, and radians, that odometry may be off between two readings besides."""
NOUGHT = 1.0
"""Odometry that was restarted counts from nought, but for this: metres and radians."""
NEAR_S = 0.05
"""References of another log belong to scans that are within this time, seconds."""


@dataclass(frozen=True)
class Laser:
    """A planar scanner: its first beam points along `mounted`, the next one `step` radians further."""

    mounted: Pose
    step: float
    range_max: float


@dataclass(frozen=True)
class Reading:
    """A scan, and where the robot was: by odometry, and by the log's reference if it has one."""

    stamp: float
    ranges: list[float]
    laser: Laser
    odometry: Pose
    reference: Pose | None = None


@dataclass
class Clock:
    """Makes stamps go on where the clock was set back."""

    last: float | None = None
    offset: float = 0.0

    def time(self, stamp: float) -> float:
        """The time of a line with this stamp, seconds."""
        last = stamp + self.offset if self.last is None else self.last
        if stamp + self.offset < last - SET_BACK_S:
            self.offset = last + STEP_S - stamp
        time = stamp + self.offset
        self.last = max(last, time)
        return time


@dataclass(frozen=True)
class Log:
    """Readings in the order of time, with odometry composed from its increments."""

    readings: list[Reading] = field(default_factory=list)

    @staticmethod
    def of(readings: list[Reading]) -> Log:
        """Leaves out scans that are no newer than the one before, and mends odometry that begins anew."""
        interval = _typical_interval(readings)
        kept: list[Reading] = []
        last: Reading | None = None
        for reading in readings:
            mended = reading
            if last is not None:
                if reading.stamp <= last.stamp:
                    continue
                moved = last.odometry.relative(reading.odometry)
                seconds = reading.stamp - last.stamp
                anew = _is_restart(moved, reading.odometry, seconds, interval)
                before = kept[-1].odometry
                mended = replace(reading, odometry=before if anew else before.compose(moved))
            kept.append(mended)
            last = reading
        return Log(kept)

    def length(self) -> float:
        """Metres driven by odometry."""
        return sum(a.odometry.distance(b.odometry) for a, b in pairwise(self.readings))

    def duration(self) -> float:
        """Seconds from the first scan to the last."""
        return self.readings[-1].stamp - self.readings[0].stamp

    def references(self) -> list[Pose]:
        """In the order of the scans that have one."""
        return [reading.reference for reading in self.readings if reading.reference is not None]

    def with_references_of(self, other: Log) -> Log:
        """The poses of another log of the same scans are the references: those nearest in time."""
        stamps = [reading.stamp for reading in other.readings]
        return Log([replace(one, reference=_reference_at(one.stamp, stamps, other)) for one in self.readings])


def _reference_at(stamp: float, stamps: list[float], other: Log) -> Pose | None:
    after = bisect_left(stamps, stamp)
    around = other.readings[max(after - 1, 0) : after + 1]
    nearest = min(around, key=lambda reading: abs(reading.stamp - stamp), default=None)
    if nearest is None or abs(nearest.stamp - stamp) > NEAR_S:
        return None
    return nearest.odometry if nearest.reference is None else nearest.reference


def _typical_interval(readings: list[Reading]) -> float:
    """The median time between scans, seconds."""
    seconds = [after.stamp - before.stamp for before, after in pairwise(readings)]
    return max(statistics.median_high(seconds), 0.0) if seconds else 0.0


def _is_restart(moved: Pose, raw: Pose, seconds: float, interval: float) -> bool:
    """Whether odometry that has `moved` so within `seconds`, to `raw`, has begun anew."""
    at_nought = raw.is_near(Pose(), NOUGHT)
    return not _can_be_driven(moved, max(seconds, interval)) or (at_nought and not _can_be_driven(moved, seconds))


def _can_be_driven(moved: Pose, seconds: float) -> bool:
    return moved.is_near(Pose(), SLACK + FASTEST * seconds)
