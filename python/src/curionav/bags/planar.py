"""Poses in the plane, and poses along time."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, field

SET_BACK_S = 1.0
"""A clock that goes back this far was set anew; less is disorder."""


@dataclass(frozen=True)
class Pose2:
    """Where a frame stands in another one: metres, and radians counter-clockwise."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0

    def compose(self, inner: Pose2) -> Pose2:
        """The pose of ``inner``, which is given in this frame, in the frame that this pose is given in."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        x = self.x + c * inner.x - s * inner.y
        y = self.y + s * inner.x + c * inner.y
        return Pose2(x, y, math.remainder(self.heading + inner.heading, math.tau))

    def inverse(self) -> Pose2:
        """The pose of the outer frame in this one."""
        c, s = math.cos(self.heading), math.sin(self.heading)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, -self.heading)

    def is_near(self, other: Pose2, apart: float) -> bool:
        """Whether the two differ by at most ``apart`` metres, and radians."""
        turned = abs(math.remainder(self.heading - other.heading, math.tau))
        return math.hypot(self.x - other.x, self.y - other.y) <= apart and turned <= apart


def between(a: Pose2, b: Pose2, share: float) -> Pose2:
    """The pose ``share`` of the way from ``a`` to ``b``; it turns the shorter way."""
    turn = math.remainder(b.heading - a.heading, math.tau)
    x = a.x + share * (b.x - a.x)
    y = a.y + share * (b.y - a.y)
    return Pose2(x, y, math.remainder(a.heading + share * turn, math.tau))


@dataclass
class Track:
    """Poses by time, in seconds, each newer than the one before."""

    stamps: list[float] = field(default_factory=list)
    poses: list[Pose2] = field(default_factory=list)
    was_set_back: bool = False
    """The clock went back. What came later is left out."""

    def add(self, stamp: float, pose: Pose2) -> None:
        """Takes a pose, unless it is no newer than the last one, or none at all."""
        if not math.isfinite(pose.x + pose.y + pose.heading):
            return
        if self.stamps and stamp <= self.stamps[-1]:
            self.was_set_back |= stamp < self.stamps[-1] - SET_BACK_S
        elif not self.was_set_back:
            self.stamps.append(stamp)
            self.poses.append(pose)

    def at(self, stamp: float, slack: float) -> Pose2 | None:
        """The pose at ``stamp``, between those around it; None if one of these is more than ``slack`` seconds away.

        Before the first and after the last pose, that pose counts for ``slack`` seconds.
        """
        if not self.stamps:
            return None
        later = bisect_left(self.stamps, stamp)
        after = min(later, len(self.stamps) - 1)
        before = max(later - 1, 0) if later < len(self.stamps) else after
        if stamp == self.stamps[after]:
            return self.poses[after]
        if max(abs(stamp - self.stamps[before]), abs(self.stamps[after] - stamp)) > slack:
            return None
        if before == after:
            return self.poses[after]
        share = (stamp - self.stamps[before]) / (self.stamps[after] - self.stamps[before])
        return between(self.poses[before], self.poses[after], share)

    def nearest(self, stamp: float) -> int | None:
        """Index of the pose that is nearest in time."""
        if not self.stamps:
            return None
        later = bisect_left(self.stamps, stamp)
        around = range(max(later - 1, 0), min(later + 1, len(self.stamps)))
        return min(around, key=lambda index: abs(self.stamps[index] - stamp))
