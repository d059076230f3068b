"""Poses in the plane, composed and compared as `curionav localize` does it."""

from __future__ import annotations

import math
from dataclasses import dataclass


def wrap_angle(angle: float) -> float:
    """The same direction from -pi to pi."""
    return math.remainder(angle, 2.0 * math.pi)


@dataclass(frozen=True)
class Pose:
    """Metres and radians: the transform from a body's frame to that of its parent."""

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0

    def compose(self, child: Pose) -> Pose:
        """The pose of `child`, given in this body's frame, in the frame of the parent."""
        cos = math.cos(self.heading)
        sin = math.sin(self.heading)
        x = self.x + cos * child.x - sin * child.y
        y = self.y + sin * child.x + cos * child.y
        return Pose(x, y, wrap_angle(self.heading + child.heading))

    def relative(self, other: Pose) -> Pose:
        """Another pose of the same parent, in this body's frame."""
        cos = math.cos(self.heading)
        sin = math.sin(self.heading)
        dx = other.x - self.x
        dy = other.y - self.y
        return Pose(cos * dx + sin * dy, cos * dy - sin * dx, wrap_angle(other.heading - self.heading))

    def toward(self, other: Pose, share: float) -> Pose:
        """The pose that has gone `share` of the way to another."""
        x = self.x + share * (other.x - self.x)
        y = self.y + share * (other.y - self.y)
        return Pose(x, y, self.heading + share * wrap_angle(other.heading - self.heading))

    def distance(self, other: Pose) -> float:
        """Between the positions, metres."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def is_near(self, other: Pose, apart: float) -> bool:
        """Whether they differ by at most `apart` metres and `apart` radians."""
        return self.distance(other) <= apart and abs(wrap_angle(self.heading - other.heading)) <= apart
