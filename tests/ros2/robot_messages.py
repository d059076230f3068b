"""What a simulated robot says, as messages of ROS 2, whichever way they are sent."""

from __future__ import annotations

import math
import time

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Transform, TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Odometry
from people_msgs.msg import People, Person
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from world import Array, World

BASE_TIMEOUT = 0.5
"""A real base brakes when nothing has commanded it for so long, s."""


def quaternion(heading: float) -> Quaternion:
    return Quaternion(x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2))


def ros_pose(pose: Array) -> Pose:
    return Pose(position=Point(x=float(pose[0]), y=float(pose[1])), orientation=quaternion(float(pose[2])))


class Robot:
    """A robot in a world, and what it says. `clock_offset` is how far its clock is off, ns."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.command, self.commanded = (0.0, 0.0), -math.inf
        self.clock_offset = 0
        self.played = time.monotonic()

    def obey(self, v: float, omega: float) -> None:
        """A command has come."""
        self.command, self.commanded = (v, omega), time.monotonic()

    def play(self) -> None:
        """Plays the world up to now. What a stopped process has slept through has not happened."""
        now = time.monotonic()
        elapsed, self.played = min(now - self.played, BASE_TIMEOUT), now
        v, omega = self.command if now - self.commanded < BASE_TIMEOUT else (0.0, 0.0)
        self.world.step(elapsed, v, omega)

    def header(self, frame: str) -> Header:
        seconds, nanoseconds = divmod(time.time_ns() + self.clock_offset, 10**9)
        return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=frame)

    def transform(self, parent: str, child: str, pose: Array) -> TFMessage:
        at = Vector3(x=float(pose[0]), y=float(pose[1]))
        turned = Transform(translation=at, rotation=quaternion(float(pose[2])))
        stamped = TransformStamped(header=self.header(parent), child_frame_id=child, transform=turned)
        return TFMessage(transforms=[stamped])

    def tf(self) -> TFMessage:
        return self.transform("odom", "base_link", self.world.odometry)

    def tf_static(self) -> TFMessage:
        return self.transform("base_link", "laser", self.world.mount)

    def odometry(self) -> Odometry:
        return self.moving("odom", self.world.odometry)

    def truth(self) -> Odometry:
        """Where the robot really is in the map."""
        return self.moving("map", self.world.pose)

    def moving(self, frame: str, pose: Array) -> Odometry:
        message = Odometry(header=self.header(frame), child_frame_id="base_link")
        message.pose = PoseWithCovariance(pose=ros_pose(pose))
        message.twist.twist.linear.x, message.twist.twist.angular.z = self.world.v, self.world.omega
        return message

    def scan(self) -> LaserScan:
        laser, message = self.world.laser, LaserScan(header=self.header("laser"))
        message.angle_min, message.angle_max = -laser["fov"] / 2, laser["fov"] / 2
        message.angle_increment = laser["fov"] / (laser["beams"] - 1)
        message.range_min, message.range_max = 0.02, laser["range_max"]
        message.ranges = self.world.scan().astype(np.float32).tolist()
        return message

    def people(self) -> People:
        message = People(header=self.header("map"))
        for number, walker in enumerate(self.world.walkers):
            at, by = walker.position(), walker.velocity
            message.people.append(
                Person(
                    name=str(number),
                    position=Point(x=float(at[0]), y=float(at[1])),
                    velocity=Point(x=float(by[0]), y=float(by[1])),
                    reliability=1.0,
                )
            )
        return message

    def map(self) -> OccupancyGrid:
        grid, message = self.world.grid, OccupancyGrid(header=self.header("map"))
        message.info.resolution = float(grid.resolution)
        message.info.height, message.info.width = (int(size) for size in grid.cells.shape)
        message.info.origin.position.x, message.info.origin.position.y = (float(part) for part in grid.origin)
        message.info.origin.orientation.w = 1.0
        message.data = grid.cells.reshape(-1).tolist()
        return message
