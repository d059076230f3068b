"""Reading a bag of ROS 1 or ROS 2, whatever its storage."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from ..errors import CurionavError

SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
"""Now, and before tf2."""
GRID = "nav_msgs/msg/OccupancyGrid"
PERSON = "leg_tracker/msg/Person"
"""An annotation of leg_tracker_benchmarks (Leigh and others, 2015): a pose without a stamp, and an id."""
POSE = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"


class BagError(CurionavError):
    """A bag cannot be read, or lacks what was asked of it."""


@dataclass(frozen=True)
class Entry:
    """One message of a bag."""

    topic: str
    stamp: float
    """s: its header's or, without a header, when it was recorded"""
    message: Any


class Bag:
    """A bag that is open: ``with Bag(path) as bag``.

    The path is a directory of rosbag2, one of its files (``.mcap``, ``.db3``), or a ``.bag`` of ROS 1.

    Raises:
        BagError: There is no bag at this path, or it is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        # For bags that were written before they described their own types. Those that are read here never changed.
        described = get_typestore(Stores.ROS2_HUMBLE)
        try:
            self._reader = AnyReader([path], default_typestore=described)
            self._reader.open()
        except FileNotFoundError:
            raise BagError(f"{path}: there is no bag; give a directory with metadata.yaml, or a file") from None
        except Exception as error:
            raise BagError(f"{path}: it cannot be read as a bag: {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._reader.close()

    def topics(self, *types: str) -> list[str]:
        """The topics with messages of one of these types, in alphabetical order."""
        found = {c.topic for c in self._reader.connections if c.msgtype in types and c.msgcount}
        return sorted(found)

    def has(self, topic: str, *types: str) -> str:
        """The topic, once it is sure that the bag has it with one of these types.

        Raises:
            BagError: It has not; the error lists what it has.
        """
        if topic not in self.topics(*types):
            wanted = " or ".join(kind.replace("/msg/", "/") for kind in types)
            raise BagError(f"{self.path}: there is no topic `{topic}` of {wanted}; {self.contents()}")
        return topic

    def contents(self) -> str:
        """What the bag has, in words."""
        listed = {f"{c.topic} ({c.msgtype.replace('/msg/', '/')})" for c in self._reader.connections if c.msgcount}
        return f"the bag has {', '.join(sorted(listed))}" if listed else "the bag has no messages"

    def entries(self, topics: Collection[str]) -> Iterator[Entry]:
        """The messages of these topics as they were recorded.

        Raises:
            BagError: A message cannot be read.
        """
        connections = [c for c in self._reader.connections if c.topic in topics]
        # Without any connection, rosbags would give the messages of all of them.
        if not connections:
            return
        try:
            for connection, recorded, data in self._reader.messages(connections):
                message: Any = self._reader.deserialize(data, connection.msgtype)
                header = getattr(message, "header", None)
                stamp = seconds(header.stamp) if header is not None else 1e-9 * recorded
                yield Entry(connection.topic, stamp, message)
        # Damaged bytes raise what they happen to break: rosbags has no one error for them.
        except Exception as error:
            raise BagError(f"{self.path}: it is damaged: {error}") from error

    def first(self, topic: str) -> Any:
        """The first message of a topic.

        Raises:
            BagError: There is none, or it cannot be read.
        """
        for entry in self.entries([topic]):
            return entry.message
        raise self.without(topic)

    def without(self, topic: str) -> BagError:
        """The error of a topic that is listed and has no message: a list can be wrong, or the messages be damaged."""
        return BagError(f"{self.path}: no message on `{topic}` can be read")

    def timed(self, topic: str) -> Iterator[Entry]:
        """The messages of a topic whose headers say when they are of.

        Raises:
            BagError: A message cannot be read, or the stamps are 0.
        """
        unset = 0
        for entry in self.entries([topic]):
            unset += entry.stamp == 0.0
            # A simulated clock may begin at 0.
            if unset > 1:
                raise BagError(f"{self.path}: the messages on `{topic}` have no time in their headers")
            yield entry


def seconds(stamp: Any) -> float:
    """A time of ROS in seconds."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)
