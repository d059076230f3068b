"""The simulated robot behaves as a base does: it moves as it is told, sees walls, and stops without commands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from rig import QUICKSTART, free_domain, listening, simulated_robot, wait_for
from simulated_robot import LATCHED
from world import World


def test_it_obeys_and_brakes_when_nothing_commands_it() -> None:
    domain = free_domain()
    with listening(domain) as node, simulated_robot(domain, "/r1", "--seed", "3") as robot:
        node.listen("/r1/truth", Odometry)
        node.listen("/r1/odom", Odometry)
        node.listen("/r1/scan", LaserScan, qos_profile_sensor_data)
        node.listen("/r1/map", OccupancyGrid, LATCHED)
        commands = node.create_publisher(Twist, "/r1/cmd_vel", 10)
        go = Twist()
        go.linear.x = 0.4
        wait_for("the map", lambda: node.newest("/r1/map"))
        timer = node.create_timer(0.1, lambda: commands.publish(go))
        wait_for("half a metre", lambda: (at := node.newest("/r1/truth")) and at.pose.pose.position.x > 1.5)
        node.destroy_timer(timer)
        wait_for("a stand", lambda: node.newest("/r1/truth").twist.twist.linear.x == 0.0)
        assert node.newest("/r1/odom").pose.pose.position.x == pytest.approx(0.5, abs=0.4)
        assert len(node.newest("/r1/scan").ranges) == 181
        assert robot.stop() == 0
        assert robot.line()["way"] > 0.5


def test_the_laser_measures_the_walls_of_the_map() -> None:
    world = World(QUICKSTART, 1, mount=(0.1, 0.0, 0.2))
    world.walkers.clear()
    world.laser["range_sigma"] = 0.0
    ranges = world.scan()
    assert 10 < sum(math.isfinite(one) for one in ranges) < len(ranges)
    for number, measured in enumerate(ranges):
        angle = 0.2 + math.pi * (number / 180 - 0.5)
        if math.isfinite(measured):
            x, y = 1.1 + measured * math.cos(angle), 4.0 + measured * math.sin(angle)
            assert world.grid.is_wall(np.array(x), np.array(y)), number
