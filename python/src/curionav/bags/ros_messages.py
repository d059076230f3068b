"""Messages of curionav as messages of ROS 2."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from ..array import F64
from ..messages import Belief, Decision, OccupancyGrid, Odometry, People, Scan, Twist
from .planar import Pose2

STORE = get_typestore(Stores.ROS2_JAZZY)
"""The types that are written. Those used here are the same in every distribution from Humble on."""
MAP, ODOM, BASE, LASER = "map", "odom", "base_link", "laser"
"""Names of frames."""

_CYLINDER, _ARROW, _DELETE_ALL = 3, 0, 3
_PERSON_HEIGHT = 1.7
_SLOW = 0.05
"""m/s; who is slower stands, and has no arrow."""


def _new(kind: str, **fields: Any) -> Any:
    """A message such as ``geometry_msgs/Pose``."""
    return STORE.types[kind.replace("/", "/msg/")](**fields)


def _header(stamp_ns: int, frame: str) -> Any:
    stamp = _new("builtin_interfaces/Time", sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)
    return _new("std_msgs/Header", stamp=stamp, frame_id=frame)


def _vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return _new("geometry_msgs/Vector3", x=float(x), y=float(y), z=float(z))


def _point(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
    return _new("geometry_msgs/Point", x=float(x), y=float(y), z=float(z))


def _turned(heading: float) -> Any:
    half = 0.5 * float(heading)
    return _new("geometry_msgs/Quaternion", x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))


def _pose(x: float, y: float, heading: float, z: float = 0.0) -> Any:
    return _new("geometry_msgs/Pose", position=_point(x, y, z), orientation=_turned(heading))


def _covariance(planar: F64) -> F64:
    """That of x, y and heading in one of x, y, z, roll, pitch and yaw, row by row."""
    whole = np.zeros((6, 6))
    whole[np.ix_([0, 1, 5], [0, 1, 5])] = planar
    return whole.reshape(-1)


def laser_scan(scan: Scan, stamp_ns: int) -> Any:
    """``sensor_msgs/LaserScan`` with ranges as REP 117 has them: NaN says nothing, infinity that nothing was met."""
    ranges = np.where((scan.ranges > 0.0) & ~scan.met(), np.inf, scan.ranges)
    ranges = np.where(scan.ranges == 0.0, np.nan, ranges).astype(np.float32)
    return _new(
        "sensor_msgs/LaserScan",
        header=_header(stamp_ns, LASER),
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + scan.angle_increment * (len(ranges) - 1),
        angle_increment=scan.angle_increment,
        time_increment=0.0,
        scan_time=0.0,
        range_min=scan.range_min or 0.0,
        range_max=scan.range_max,
        ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )


def odometry(told: Odometry, stamp_ns: int) -> Any:
    """``nav_msgs/Odometry``; its covariances are not known, and 0."""
    pose = _pose(told.x, told.y, told.heading)
    unknown = np.zeros(36)
    return _new(
        "nav_msgs/Odometry",
        header=_header(stamp_ns, ODOM),
        child_frame_id=BASE,
        pose=_new("geometry_msgs/PoseWithCovariance", pose=pose, covariance=unknown),
        twist=_new("geometry_msgs/TwistWithCovariance", twist=twist(told), covariance=unknown),
    )


def twist(moving: Odometry | Twist) -> Any:
    """``geometry_msgs/Twist``."""
    return _new("geometry_msgs/Twist", linear=_vector(moving.v), angular=_vector(z=moving.omega))


def transform(parent: str, child: str, pose: Pose2, stamp_ns: int) -> Any:
    """``tf2_msgs/TFMessage`` with one transform."""
    moved = _new("geometry_msgs/Transform", translation=_vector(pose.x, pose.y), rotation=_turned(pose.heading))
    header = _header(stamp_ns, parent)
    stamped = _new("geometry_msgs/TransformStamped", header=header, child_frame_id=child, transform=moved)
    return _new("tf2_msgs/TFMessage", transforms=[stamped])


def believed(belief: Belief, stamp_ns: int) -> Any:
    """``geometry_msgs/PoseWithCovarianceStamped``."""
    pose = _pose(belief.x, belief.y, belief.heading)
    covariance = _covariance(np.asarray(belief.covariance))
    placed = _new("geometry_msgs/PoseWithCovariance", pose=pose, covariance=covariance)
    return _new("geometry_msgs/PoseWithCovarianceStamped", header=_header(stamp_ns, MAP), pose=placed)


def pose_stamped(pose: Pose2, stamp_ns: int) -> Any:
    """``geometry_msgs/PoseStamped`` in the map frame."""
    placed = _pose(pose.x, pose.y, pose.heading)
    return _new("geometry_msgs/PoseStamped", header=_header(stamp_ns, MAP), pose=placed)


def path(decision: Decision, stamp_ns: int) -> Any:
    """``nav_msgs/Path``; empty if the robot stops. Each pose has the time at which it is due."""
    states = zip(decision.x, decision.y, decision.heading, strict=True)
    due = [stamp_ns + round(1e9 * (k + 1) * decision.dt) for k in range(len(decision.x))]
    poses = [pose_stamped(Pose2(float(x), float(y), float(h)), at) for at, (x, y, h) in zip(due, states, strict=True)]
    return _new("nav_msgs/Path", header=_header(stamp_ns, MAP), poses=poses)


def occupancy_grid(grid: OccupancyGrid, stamp_ns: int) -> Any:
    """``nav_msgs/OccupancyGrid``."""
    header = _header(stamp_ns, MAP)
    info = _new(
        "nav_msgs/MapMetaData",
        map_load_time=header.stamp,
        resolution=grid.resolution,
        width=grid.width,
        height=grid.height,
        origin=_pose(grid.origin.x, grid.origin.y, grid.origin.heading),
    )
    cells = np.ascontiguousarray(grid.cells, np.int8).reshape(-1)
    return _new("nav_msgs/OccupancyGrid", header=header, info=info, data=cells)


def markers(people: People, stamp_ns: int) -> Any:
    """``visualization_msgs/MarkerArray``: a cylinder per person, and an arrow as long as it walks in a second."""
    header = _header(stamp_ns, MAP if people.frame == "map" else BASE)
    nowhere = _pose(0.0, 0.0, 0.0)
    # Those who were there before go.
    drawn = [_marker(header, "", 0, nowhere, _vector(), action=_DELETE_ALL)]
    wide = 2.0 * people.radius
    for person, x, y, vx, vy in zip(people.id, people.x, people.y, people.vx, people.vy, strict=True):
        number = int(np.int32(np.uint32(person)))
        body = _pose(x, y, 0.0, z=0.5 * _PERSON_HEIGHT)
        size = _vector(wide, wide, _PERSON_HEIGHT)
        drawn.append(_marker(header, "people", number, body, size, kind=_CYLINDER))
        if math.hypot(vx, vy) > _SLOW:
            points = [_point(x, y, 1.0), _point(x + vx, y + vy, 1.0)]
            size = _vector(0.06, 0.15, 0.2)
            drawn.append(_marker(header, "velocities", number, nowhere, size, kind=_ARROW, points=points))
    return _new("visualization_msgs/MarkerArray", markers=drawn)


def _marker(
    header: Any,
    ns: str,
    number: int,
    pose: Any,
    scale: Any,
    *,
    kind: int = 0,
    action: int = 0,
    points: Sequence[Any] = (),
) -> Any:
    texture = _new("sensor_msgs/CompressedImage", header=header, format="", data=np.zeros(0, np.uint8))
    return _new(
        "visualization_msgs/Marker",
        header=header,
        ns=ns,
        id=number,
        type=kind,
        action=action,
        pose=pose,
        scale=scale,
        color=_new("std_msgs/ColorRGBA", r=0.9, g=0.5, b=0.1, a=0.8),
        # Should people no longer be told, their markers vanish.
        lifetime=_new("builtin_interfaces/Duration", sec=1, nanosec=0),
        frame_locked=False,
        points=list(points),
        colors=[],
        texture_resource="",
        texture=texture,
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=_new("visualization_msgs/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )
