"""Frames of ROS: which stands where in which, as a bag's transforms say."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..array import F64
from .bag import BagError, seconds
from .planar import Pose2, Track

UPRIGHT = math.cos(math.radians(8.0))
"""Cosine of how far a frame may lean and still count as upright or hanging."""
_STILL = 0.005
"""A transform that changes by less, m and rotation matrix, does not move."""


@dataclass(frozen=True)
class Mount:
    """How a scanner is mounted on the robot."""

    pose: Pose2
    """in the robot's frame; its heading is where the beam of angle 0 points"""
    is_upside_down: bool = False


@dataclass
class Edge:
    """A frame in its parent frame."""

    parent: str
    pose: F64
    """[4, 4], as it was first"""
    moves: bool = False
    track: Track = field(default_factory=Track)
    """in the plane; only of a frame in one of those that are followed"""


def name(frame: str) -> str:
    """A frame's name; ROS 1 allowed a slash before it."""
    return frame.removeprefix("/")


def planar(position: Any, orientation: Any) -> Pose2:
    """A pose of ROS seen from above."""
    q = orientation
    heading = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return Pose2(float(position.x), float(position.y), heading)


class FrameTree:
    """The transforms of a bag, by the frame that each places.

    Args:
        followed: Frames in which the robot drives. What is placed in them is kept over time.
    """

    def __init__(self, followed: Collection[str]) -> None:
        self.edges: dict[str, Edge] = {}
        self._followed = followed

    def add(self, transform: Any) -> None:
        """Takes a ``geometry_msgs/TransformStamped``."""
        parent, child = name(transform.header.frame_id), name(transform.child_frame_id)
        t, q = transform.transform.translation, transform.transform.rotation
        edge = self.edges.get(child)
        if edge is None or edge.parent != parent:
            edge = self.edges[child] = Edge(parent, _matrix(t, q))
        elif not edge.moves:
            edge.moves = bool(np.abs(_matrix(t, q) - edge.pose).max() > _STILL)
        if parent in self._followed:
            edge.track.add(seconds(transform.header.stamp), planar(t, q))

    def children(self, parent: str) -> list[str]:
        """The frames that are placed in ``parent``."""
        return [child for child, edge in self.edges.items() if edge.parent == parent]

    def listed(self) -> str:
        """All transforms, in words."""
        known = ", ".join(f"{edge.parent} -> {child}" for child, edge in sorted(self.edges.items()))
        return f"transforms: {known or 'none'}"

    def mount(self, scanner: str, base: str) -> Mount:
        """How the frame ``scanner`` is mounted on the frame ``base``.

        Raises:
            BagError: No transforms join them, the scanner moves on the robot, or it leans.
        """
        option = "; give --laser X,Y,HEADING"
        up, down = self._ancestors(scanner), self._ancestors(base)
        joint = next((frame for frame in up if frame in down), None)
        if joint is None:
            raise BagError(f"no transforms join the scanner `{scanner}` to the robot `{base}`{option}; {self.listed()}")
        way = up[: up.index(joint)] + down[: down.index(joint)]
        moving = [frame for frame in way if self.edges[frame].moves]
        if moving:
            raise BagError(f"the scanner `{scanner}` moves on the robot, with the frame `{moving[0]}`{option}")
        pose = np.linalg.inv(self._pose(down, joint)) @ self._pose(up, joint)
        if not (np.isfinite(pose).all() and abs(pose[2, 2]) >= UPRIGHT):
            raise BagError(f"the scanner `{scanner}` leans: it does not see a plane above the floor{option}")
        heading = math.atan2(pose[1, 0], pose[0, 0])
        return Mount(Pose2(float(pose[0, 3]), float(pose[1, 3]), heading), is_upside_down=bool(pose[2, 2] < 0.0))

    def _ancestors(self, frame: str) -> list[str]:
        """The frame, the frame that it is placed in, and so on."""
        found = [frame]
        while (edge := self.edges.get(found[-1])) is not None and edge.parent not in found:
            found.append(edge.parent)
        return found

    def _pose(self, way: list[str], joint: str) -> F64:
        """The pose of a way's first frame in ``joint``, [4, 4]."""
        pose = np.eye(4)
        for frame in way[: way.index(joint)]:
            pose = self.edges[frame].pose @ pose
        return pose


def _matrix(t: Any, q: Any) -> F64:
    """A transform as a matrix, [4, 4]."""
    x, y, z, w = np.array([q.x, q.y, q.z, q.w]) / (math.sqrt(q.x**2 + q.y**2 + q.z**2 + q.w**2) or 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t.x],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t.y],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t.z],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
