"""The simulated robot as nodes of `rmw_zenoh_cpp` have it, and a listener that reads what the gateway says to it."""

from __future__ import annotations

import math
import struct
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh
from action_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as RosPath
from people_msgs.msg import People
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from rig import QUICKSTART
from rmw_zenoh import RmwNode, name_of
from robot_messages import Robot
from rosbags_types import STORE, in_rosbags
from world import World

ACTION = "/r1/navigate_to_pose"
IN: dict[str, type] = {
    "/r1/scan": LaserScan,
    "/r1/odom": Odometry,
    "/r1/tf": TFMessage,
    "/r1/tf_static": TFMessage,
    "/r1/map": OccupancyGrid,
    "/r1/people": People,
    "/r1/goal_pose": PoseStamped,
    "/r1/initialpose": PoseWithCovarianceStamped,
}
"""What the gateway hears."""
OUT: dict[str, tuple[type, bool]] = {
    "/r1/cmd_vel": (TwistStamped, False),
    "/r1/amcl_pose": (PoseWithCovarianceStamped, False),
    "/r1/plan": (RosPath, True),
    "/r1/curionav/candidates": (MarkerArray, False),
    "/r1/curionav/crowd": (MarkerArray, False),
    "/diagnostics": (DiagnosticArray, False),
    f"{ACTION}/_action/feedback": (NavigateToPose.Impl.FeedbackMessage, False),
    f"{ACTION}/_action/status": (GoalStatusArray, True),
}
"""What it says, and whether late subscribers get it, too."""


class Driving:
    """A legal robot in the quickstart's world, played by a thread of its own; `repeat` says again what is said once."""

    def __init__(self, node: RmwNode) -> None:
        self.robot = robot = Robot(World(QUICKSTART, 1))
        self.over = threading.Event()
        self.says = [
            (node.publisher(topic, IN[topic]), of)
            for topic, of in {
                "/r1/tf": robot.tf, "/r1/odom": robot.odometry, "/r1/scan": robot.scan, "/r1/people": robot.people,
            }.items()
        ]  # fmt: skip
        self.latched = [
            (node.publisher(topic, IN[topic], latched=True), of)
            for topic, of in {"/r1/tf_static": robot.tf_static, "/r1/map": robot.map}.items()
        ]
        node.subscribe("/r1/cmd_vel", TwistStamped, lambda m: robot.obey(m.twist.linear.x, m.twist.angular.z))
        self.repeat()

    def repeat(self) -> None:
        for publish, of in self.latched:
            publish(of())

    def play(self) -> None:
        while not self.over.wait(0.1):
            self.robot.play()
            for publish, of in self.says:
                publish(of())


@contextmanager
def driving(node: RmwNode) -> Iterator[Driving]:
    """The robot while the block runs."""
    robot = Driving(node)
    thread = threading.Thread(target=robot.play, daemon=True)
    thread.start()
    try:
        yield robot
    finally:
        robot.over.set()
        thread.join()


class ListenerOfAll:
    """Reads all that the gateway says. A malformed message would end a real node; here it is noted in `malformed`."""

    def __init__(self, node: RmwNode) -> None:
        self.heard: Counter[str] = Counter()
        self.malformed: list[str] = []
        self.newest: dict[str, Any] = {}
        self.numbers: dict[str, int] = {}
        for topic, (of, latched) in OUT.items():
            name = name_of(of)
            node.subscribe_raw(topic, name, self._reads(topic, of, name), latched)

    def _reads(self, topic: str, of: type, name: str) -> Callable[[Any], None]:
        def read(sample: zenoh.Sample) -> None:
            try:
                attached = bytes(sample.attachment) if sample.attachment is not None else b""
                assert len(attached) == 33, f"an attachment of {len(attached)} bytes"
                number, _, size = struct.unpack_from("<qqB", attached)
                assert size == 16 and number > 0, attached.hex()
                assert number > self.numbers.get(topic, 0), "a number that does not rise"
                self.numbers[topic] = number
                payload = bytes(sample.payload)
                # rosbags raises where rclpy may end the process.
                whole = bytes(STORE.serialize_cdr(STORE.deserialize_cdr(payload, in_rosbags(name)), in_rosbags(name)))
                assert len(whole) == len(payload), f"{len(payload) - len(whole)} bytes too many"
                message = deserialize_message(payload, of)
                if isinstance(message, TwistStamped):
                    v, omega = message.twist.linear.x, message.twist.angular.z
                    assert math.isfinite(v) and math.isfinite(omega), f"{v} {omega}"
                    assert 0.0 <= v <= 1.0 + 1e-9 and abs(omega) <= 1.0 + 1e-9, f"{v} {omega}"
                self.newest[topic] = message
                self.heard[topic] += 1
            except Exception as error:
                self.malformed.append(f"{topic}: {error!r}: {bytes(sample.payload)[:60].hex()}")

        return read
