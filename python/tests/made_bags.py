"""Bags of a made-up robot in a made-up room, as rosbags writes them for ROS 1 and ROS 2."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from curionav.array import F32, F64

KINDS = ("ros1", "mcap", "sqlite3")
STORES = {kind: get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_HUMBLE) for kind in KINDS}
SCAN, ODOMETRY, TF = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage"
POSE, BELIEVED = "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped"
GRID = "nav_msgs/msg/OccupancyGrid"
OLD_TF = "tf/msg/tfMessage"
"""As it was called before tf2."""
for _kind in (TF, OLD_TF):
    STORES["ros1"].register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", _kind))
START = 1_700_000_000.0
"""s, of the first message"""
LEFT, RIGHT, BOTTOM, TOP = -4.0, 6.0, -3.0, 5.0
"""Walls of the room in the frame of odometry, m."""


@dataclass(frozen=True)
class Sent:
    """A message for a bag."""

    topic: str
    kind: str
    stamp: float
    """s after `START`"""
    message: Any


class Maker:
    """Makes messages of one version of ROS."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.store = STORES[kind]

    def new(self, name: str, **fields: Any) -> Any:
        return self.store.types[name](**fields)

    def header(self, stamp: float, frame: str) -> Any:
        ns = round(1e9 * (START + stamp)) if stamp > -START else 0
        time = self.new("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        more = {"seq": 0} if self.kind == "ros1" else {}
        return self.new("std_msgs/msg/Header", stamp=time, frame_id=frame, **more)

    def quaternion(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, w: float = 1.0) -> Any:
        return self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def turned(self, heading: float) -> Any:
        return self.quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))

    def pose(self, x: float, y: float, heading: float) -> Any:
        position = self.new("geometry_msgs/msg/Point", x=x, y=y, z=0.0)
        return self.new("geometry_msgs/msg/Pose", position=position, orientation=self.turned(heading))

    def with_covariance(self, x: float, y: float, heading: float) -> Any:
        pose = self.pose(x, y, heading)
        return self.new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36))

    def odometry(
        self, stamp: float, x: float, y: float, heading: float, topic: str = "/odom", base: str = "base_link"
    ) -> Sent:
        still = self.new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self.new("geometry_msgs/msg/Twist", linear=still, angular=still)
        message = self.new(
            ODOMETRY,
            header=self.header(stamp, "odom"),
            child_frame_id=base,
            pose=self.with_covariance(x, y, heading),
            twist=self.new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
        )
        return Sent(topic, ODOMETRY, stamp, message)

    def pose_stamped(self, stamp: float, x: float, y: float, heading: float, topic: str) -> Sent:
        message = self.new(POSE, header=self.header(stamp, "map"), pose=self.pose(x, y, heading))
        return Sent(topic, POSE, stamp, message)

    def believed(self, stamp: float, x: float, y: float, heading: float, topic: str = "/amcl_pose") -> Sent:
        message = self.new(BELIEVED, header=self.header(stamp, "map"), pose=self.with_covariance(x, y, heading))
        return Sent(topic, BELIEVED, stamp, message)

    def transform(
        self, stamp: float, parent: str, child: str, x: float, y: float, rotation: Any, topic: str = "/tf"
    ) -> Sent:
        translation = self.new("geometry_msgs/msg/Vector3", x=x, y=y, z=0.3)
        moved = self.new("geometry_msgs/msg/Transform", translation=translation, rotation=rotation)
        header = self.header(stamp, parent)
        stamped = self.new("geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=moved)
        return Sent(topic, TF, stamp, self.new(TF, transforms=[stamped]))

    def mounted(self, x: float, y: float, heading: float, frame: str = "laser") -> Sent:
        return self.transform(0.0, "base_link", frame, x, y, self.turned(heading), topic="/tf_static")

    def scan(self, stamp: float, ranges: Any, topic: str = "/scan", frame: str = "laser", **fields: float) -> Sent:
        given = {"angle_min": -1.0, "angle_increment": 0.1, "range_min": 0.1, "range_max": 12.0} | fields
        readings: F32 = np.asarray(ranges, np.float32)
        message = self.new(
            SCAN,
            header=self.header(stamp, frame),
            angle_max=given["angle_min"] + given["angle_increment"] * (len(readings) - 1),
            time_increment=0.0,
            scan_time=0.1,
            ranges=readings,
            intensities=np.zeros(0, np.float32),
            **given,
        )
        return Sent(topic, SCAN, stamp, message)

    def grid(self, cells: Any, resolution: float, x: float, y: float, heading: float) -> Sent:
        header = self.header(0.0, "map")
        info = self.new(
            "nav_msgs/msg/MapMetaData",
            map_load_time=header.stamp,
            resolution=resolution,
            width=cells.shape[1],
            height=cells.shape[0],
            origin=self.pose(x, y, heading),
        )
        message = self.new(GRID, header=header, info=info, data=np.ascontiguousarray(cells, np.int8).reshape(-1))
        return Sent("/map", GRID, 0.0, message)

    def write(self, path: Path, sent: list[Sent]) -> Path:
        """Writes a bag of this kind in the order of the list; gives the path that readers take."""
        if self.kind == "ros1":
            path = path.with_suffix(".bag")
        plugin = StoragePlugin.SQLITE3 if self.kind == "sqlite3" else StoragePlugin.MCAP
        writer: Any = Writer1(path) if self.kind == "ros1" else Writer2(path, version=8, storage_plugin=plugin)
        connections: dict[str, Any] = {}
        arrived = 0
        with writer:
            for one in sent:
                if one.topic not in connections:
                    connections[one.topic] = writer.add_connection(one.topic, one.kind, typestore=self.store)
                serialize = self.store.serialize_ros1 if self.kind == "ros1" else self.store.serialize_cdr
                # Half a second late, and in the order of the list: stamps count, not these times.
                arrived = max(round(1e9 * (START + one.stamp + 0.5)), arrived + 1)
                writer.write(connections[one.topic], arrived, serialize(one.message, one.kind))
        return path


def seen(x: float, y: float, directions: F64) -> F64:
    """Ranges to the walls of the room from a point in it, m; directions are those of the beams, rad."""
    c, s = np.cos(directions), np.sin(directions)
    with np.errstate(divide="ignore"):
        across = np.where(c > 0, (RIGHT - x) / c, np.where(c < 0, (LEFT - x) / c, np.inf))
        along = np.where(s > 0, (TOP - y) / s, np.where(s < 0, (BOTTOM - y) / s, np.inf))
    return np.asarray(np.minimum(across, along))


def tour(make: Maker, *, mount: tuple[float, float, float] = (0.2, -0.1, 0.5)) -> list[Sent]:
    """Three seconds in the room, in a circle of 1 m; odometry comes at 50 Hz, scans at 10 Hz and between its times."""
    sent = [make.mounted(*mount)]
    angles = np.linspace(-2.0, 2.0, 81)
    for tick in range(151):
        sent.append(make.odometry(0.02 * tick, *where(0.02 * tick)))
        if tick % 5 == 2 and tick < 150:
            stamp = 0.02 * tick + 0.013
            x, y, heading = placed(where(stamp), mount)
            ranges = seen(x, y, heading + angles)
            sent.append(make.scan(stamp, ranges, angle_min=-2.0, angle_increment=0.05))
    return sent


def where(stamp: float) -> tuple[float, float, float]:
    """The robot at a time of the tour: its heading passes half a turn at 1.14 s."""
    turn = stamp
    return math.cos(turn), math.sin(turn), math.remainder(turn + 2.0, math.tau)


def placed(outer: tuple[float, float, float], inner: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, h = outer
    c, s = math.cos(h), math.sin(h)
    return x + c * inner[0] - s * inner[1], y + s * inner[0] + c * inner[1], h + inner[2]
