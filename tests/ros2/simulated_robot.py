"""A robot as ROS 2 sees it, simulated: `python simulated_robot.py SCENARIO.toml --namespace r1`.

It publishes `scan`, `odom`, `tf` (odom to base_link), `tf_static` (base_link to laser), `map` (transient local),
`people`, and for tests `truth`, where it really is in the map. It obeys `cmd_vel` and brakes when that has been silent
for half a second, as a real base does. It needs rclpy; curionav is not involved.

One line of JSON on standard output says that it is ready, and one at its end what became of it. SIGINT and SIGTERM end
it; SIGUSR1 sets its clock back by ten seconds, as a wrong clock or a restarted recording would.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import signal
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from geometry_msgs.msg import Point, Pose, PoseWithCovariance, Quaternion, Transform, TransformStamped
from geometry_msgs.msg import Twist, TwistStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Odometry
from people_msgs.msg import People, Person
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from world import Array, World

TICK = 0.1
BASE_TIMEOUT = 0.5
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def quaternion(heading: float) -> Quaternion:
    return Quaternion(x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2))


def ros_pose(pose: Array) -> Pose:
    return Pose(position=Point(x=float(pose[0]), y=float(pose[1])), orientation=quaternion(float(pose[2])))


def occupancy_grid(world: World, header: Header) -> OccupancyGrid:
    """The world's map as a message."""
    grid, message = world.grid, OccupancyGrid(header=header)
    message.info.resolution = float(grid.resolution)
    message.info.height, message.info.width = (int(size) for size in grid.cells.shape)
    message.info.origin.position.x, message.info.origin.position.y = (float(part) for part in grid.origin)
    message.info.origin.orientation.w = 1.0
    message.data = grid.cells.reshape(-1).tolist()
    return message


class SimulatedRobot(Node):
    """The robot as a node."""

    def __init__(self, options: argparse.Namespace) -> None:
        super().__init__("simulated_robot", namespace=options.namespace)
        self.world = World(options.scenario, options.seed, tuple(options.mount))
        self.command, self.commanded = (0.0, 0.0), -math.inf
        self.clock_offset = 0
        self.played = time.monotonic()
        self.scans = self.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.truth = self.create_publisher(Odometry, "truth", 10)
        self.transforms = self.create_publisher(TFMessage, "tf", 100)
        self.mounted = self.create_publisher(TFMessage, "tf_static", LATCHED)
        self.people = self.create_publisher(People, "people", 10) if options.people else None
        if options.map:
            self.maps = self.create_publisher(OccupancyGrid, "map", LATCHED)
            self.maps.publish(occupancy_grid(self.world, self.header("map")))
        self.mounted.publish(TFMessage(transforms=[self.transform("base_link", "laser", self.world.mount)]))
        if options.stamped:
            self.create_subscription(TwistStamped, "cmd_vel", lambda message: self.obey(message.twist), 10)
        else:
            self.create_subscription(Twist, "cmd_vel", self.obey, 10)
        self.create_timer(TICK, self.tick)

    def header(self, frame: str) -> Header:
        stamp = self.get_clock().now() + Duration(nanoseconds=self.clock_offset)
        return Header(stamp=stamp.to_msg(), frame_id=frame)

    def transform(self, parent: str, child: str, pose: Array) -> TransformStamped:
        at = Vector3(x=float(pose[0]), y=float(pose[1]))
        turned = Transform(translation=at, rotation=quaternion(float(pose[2])))
        return TransformStamped(header=self.header(parent), child_frame_id=child, transform=turned)

    def obey(self, command: Twist) -> None:
        self.command, self.commanded = (command.linear.x, command.angular.z), time.monotonic()

    def tick(self) -> None:
        now = time.monotonic()
        # On a slow machine a tick is longer. What a stopped process has slept through has not happened.
        elapsed, self.played = min(now - self.played, BASE_TIMEOUT), now
        v, omega = self.command if now - self.commanded < BASE_TIMEOUT else (0.0, 0.0)
        world = self.world
        world.step(elapsed, v, omega)
        self.transforms.publish(TFMessage(transforms=[self.transform("odom", "base_link", world.odometry)]))
        self.odometry.publish(self.moving("odom", world.odometry))
        self.scans.publish(self.scan())
        self.truth.publish(self.moving("map", world.pose))
        if self.people is not None:
            self.people.publish(self.persons())

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

    def persons(self) -> People:
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

    def set_back(self) -> None:
        self.clock_offset -= 10 * 10**9


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("scenario", type=Path)
    arguments.add_argument("--namespace", default="", help="put before every topic")
    arguments.add_argument("--seed", type=int, default=1, help="of the noise of laser and odometry")
    arguments.add_argument("--stamped", action="store_true", help="cmd_vel is a TwistStamped")
    arguments.add_argument("--no-map", dest="map", action="store_false", help="another node publishes the map")
    arguments.add_argument("--no-people", dest="people", action="store_false", help="nothing detects the people")
    arguments.add_argument("--mount", type=float, nargs=3, default=[0.0, 0.0, 0.0], metavar=("X", "Y", "HEADING"),
                           help="where the laser is on the robot")  # fmt: skip
    options = arguments.parse_args()
    rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: rclpy.try_shutdown())
    robot = SimulatedRobot(options)
    signal.signal(signal.SIGUSR1, lambda *_: robot.set_back())
    say(ready="simulated_robot", start=robot.world.start.tolist(), goal=robot.world.goal.tolist())
    try:
        rclpy.spin(robot)
    except ExternalShutdownException:
        pass
    say(**dataclasses.asdict(robot.world.measures), pose=robot.world.pose.tolist())


def say(**fields: object) -> None:
    json.dump(fields, sys.stdout)
    print(flush=True)


if __name__ == "__main__":
    main()
