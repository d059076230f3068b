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
import signal
import sys
import threading
from pathlib import Path

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from people_msgs.msg import People
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from robot_messages import Robot
from world import World

TICK = 0.1
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class SimulatedRobot(Node):
    """The robot as a node."""

    def __init__(self, options: argparse.Namespace) -> None:
        super().__init__("simulated_robot", namespace=options.namespace)
        self.robot = Robot(World(options.scenario, options.seed, tuple(options.mount)))
        self.scans = self.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.truth = self.create_publisher(Odometry, "truth", 10)
        self.transforms = self.create_publisher(TFMessage, "tf", 100)
        self.people = self.create_publisher(People, "people", 10) if options.people else None
        self.mounted = self.create_publisher(TFMessage, "tf_static", LATCHED)
        self.mounted.publish(self.robot.tf_static())
        if options.map:
            self.maps = self.create_publisher(OccupancyGrid, "map", LATCHED)
            self.maps.publish(self.robot.map())
        if options.stamped:
            self.create_subscription(TwistStamped, "cmd_vel", lambda message: self.obey(message.twist), 10)
        else:
            self.create_subscription(Twist, "cmd_vel", self.obey, 10)
        self.create_timer(TICK, self.tick)

    def obey(self, command: Twist) -> None:
        self.robot.obey(command.linear.x, command.angular.z)

    def tick(self) -> None:
        self.robot.play()
        self.transforms.publish(self.robot.tf())
        self.odometry.publish(self.robot.odometry())
        self.scans.publish(self.robot.scan())
        self.truth.publish(self.robot.truth())
        if self.people is not None:
            self.people.publish(self.robot.people())

    def set_back(self) -> None:
        self.robot.clock_offset -= 10 * 10**9


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
    over = threading.Event()
    rclpy.init(signal_handler_options=rclpy.SignalHandlerOptions.NO)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: over.set())
    robot = SimulatedRobot(options)
    world = robot.robot.world
    signal.signal(signal.SIGUSR1, lambda *_: robot.set_back())
    say(ready="simulated_robot", start=world.start.tolist(), goal=world.goal.tolist())
    while not over.is_set():
        rclpy.spin_once(robot, timeout_sec=TICK)
    say(**dataclasses.asdict(world.measures), pose=world.pose.tolist())


def say(**fields: object) -> None:
    json.dump(fields, sys.stdout)
    print(flush=True)


if __name__ == "__main__":
    main()
