"""Writing a recording of curionav as a bag of ROS 2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError

from .. import recording
from ..messages import Belief, Decision, OccupancyGrid, Odometry, People, RunStatus, Scan, Twist
from . import ros_messages as ros
from .bag import BagError
from .planar import Pose2

SECOND = 1_000_000_000
_LATCHED = ("/map", "/tf_static")
"""Topics whose last message comes also to those who listen later."""


@dataclass(frozen=True)
class Said:
    """A message of ROS 2 that belongs into the bag."""

    stamp_ns: int
    topic: str
    message: Any


@dataclass
class WrittenBag:
    """A bag that was written."""

    path: Path
    counts: dict[str, int] = field(default_factory=dict)
    """messages by topic"""


def write_bag(recorded: Path, bag: Path, robot: str | None = None) -> WrittenBag:
    """Writes a recording as a directory of rosbag2 with storage MCAP, which must not exist yet.

    Raises:
        BadRecording: The recording cannot be read, or tells of several robots and none was named.
        BagError: There is already something at ``bag``, it cannot be written, or there is nothing to write.
    """
    said = merge(_truth(recorded, robot), _drive(recorded, robot), key=lambda one: one.stamp_ns)
    # Before anything is written, so that a bad recording leaves nothing behind.
    first = next(said, None)
    if first is None:
        raise BagError(f"{recorded}: it has nothing that a bag of ROS 2 could hold")
    counts: Counter[str] = Counter()
    connections: dict[str, Connection] = {}
    try:
        with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for one in chain([first], said):
                kind = one.message.__msgtype__
                if one.topic not in connections:
                    qos = [_qos(one.topic)]
                    connections[one.topic] = writer.add_connection(
                        one.topic, kind, typestore=ros.STORE, offered_qos_profiles=qos
                    )
                writer.write(connections[one.topic], one.stamp_ns, ros.STORE.serialize_cdr(one.message, kind))
                counts[one.topic] += 1
    except (WriterError, OSError) as error:
        raise BagError(f"{bag}: it cannot be written: {error}") from error
    return WrittenBag(bag, dict(counts))


def _truth(recorded: Path, robot: str | None) -> Iterator[Said]:
    """Where a simulated robot truly was, which the last message of each run tells."""
    # Zero of the run's clock in the recording's time.
    zero = 0
    for entry in recording.entries(recorded, robot):
        if isinstance(entry.message, Scan):
            zero = entry.stamp_ns - round(SECOND * entry.message.stamp)
        elif isinstance(entry.message, RunStatus) and entry.message.result is not None:
            trace = entry.message.result.trace
            columns = ("time_s", "true_x", "true_y", "true_heading")
            if not set(columns) <= set(trace.columns):
                continue
            for row in trace.values[:, [trace.columns.index(column) for column in columns]]:
                stamp_ns = zero + round(SECOND * float(row[0]))
                pose = Pose2(float(row[1]), float(row[2]), float(row[3]))
                yield Said(stamp_ns, "/ground_truth", ros.pose_stamped(pose, stamp_ns))


def _drive(recorded: Path, robot: str | None) -> Iterator[Said]:
    """All else, in the order of the recording."""
    state = _State()
    for entry in recording.entries(recorded, robot):
        yield from state.said(entry.message, entry.stamp_ns)


@dataclass
class _State:
    """What later messages are made of, besides themselves."""

    odometry: Odometry | None = None
    laser: Pose2 | None = None

    def said(self, message: object, stamp_ns: int) -> Iterator[Said]:
        """What ROS is told by one message."""
        match message:
            case Scan():
                laser = Pose2(message.laser.x, message.laser.y, message.laser.heading)
                if laser != self.laser:
                    self.laser = laser
                    mounted = ros.transform(ros.BASE, ros.LASER, laser, stamp_ns)
                    yield Said(stamp_ns, "/tf_static", mounted)
                yield Said(stamp_ns, "/scan", ros.laser_scan(message, stamp_ns))
            case Odometry():
                self.odometry = message
                driven = Pose2(message.x, message.y, message.heading)
                yield Said(stamp_ns, "/odom", ros.odometry(message, stamp_ns))
                yield Said(stamp_ns, "/tf", ros.transform(ros.ODOM, ros.BASE, driven, stamp_ns))
            case Belief():
                yield Said(stamp_ns, "/amcl_pose", ros.believed(message, stamp_ns))
                # Beside odometry of another moment it would say where odometry never began.
                if self.odometry is not None and self.odometry.tick == message.tick:
                    driven = Pose2(self.odometry.x, self.odometry.y, self.odometry.heading)
                    began = Pose2(message.x, message.y, message.heading).compose(driven.inverse())
                    yield Said(stamp_ns, "/tf", ros.transform(ros.MAP, ros.ODOM, began, stamp_ns))
            case OccupancyGrid():
                yield Said(stamp_ns, "/map", ros.occupancy_grid(message, stamp_ns))
            case People():
                yield Said(stamp_ns, "/people", ros.markers(message, stamp_ns))
            case Decision():
                yield Said(stamp_ns, "/plan", ros.path(message, stamp_ns))
            case Twist():
                yield Said(stamp_ns, "/cmd_vel", ros.twist(message))


def _qos(topic: str) -> Qos:
    latched = topic in _LATCHED
    forever = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST,
        1 if latched else 10,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        forever,
        forever,
        QosLiveliness.AUTOMATIC,
        forever,
        avoid_ros_namespace_conventions=False,
    )
