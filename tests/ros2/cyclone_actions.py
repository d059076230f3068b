"""Lets action clients of Fast DDS use an action that Zenoh's plugin for DDS offers.

The plugin takes the other end of every service for a node of `rmw_cyclonedds_cpp`, which begins each request and reply
with 16 bytes that say whose it is. `rmw_fastrtps_cpp` says so outside of the message, so its services never pass the
plugin. `Passage` is a node on the plugin's side that speaks as Cyclone does, and a node that offers the same action to
clients of Fast DDS in another domain. Nothing but those 16 bytes is added or taken away.
"""

from __future__ import annotations

import contextlib
import itertools
import queue
import struct
import threading
from typing import Any, Self

import rclpy
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from nav2_msgs.action import NavigateToPose
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

CLIENT = 0x0C0FFEE
PATIENCE = 300.0
"""A result comes when the robot is there."""
TOPICS = {
    "feedback": (NavigateToPose.Impl.FeedbackMessage, QoSProfile(depth=10)),
    "status": (GoalStatusArray, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)),
}
SERVICES = {
    "send_goal": NavigateToPose.Impl.SendGoalService,
    "get_result": NavigateToPose.Impl.GetResultService,
    "cancel_goal": CancelGoal,
}


class Side:
    """A node in a domain, spun until the end."""

    def __init__(self, name: str, domain: int) -> None:
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node(name, context=self.context)
        # A service whose reply is awaited must not hold up the others.
        self.executor = MultiThreadedExecutor(num_threads=8, context=self.context)
        self.executor.add_node(self.node)

    def spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self.executor.spin()


class CycloneClient:
    """A client of a service as `rmw_cyclonedds_cpp` has it, on raw topics."""

    def __init__(self, node: Node, service: str, of: Any) -> None:
        plain = QoSProfile(depth=10, avoid_ros_namespace_conventions=True)
        self.reply_type = of.Response
        self.numbers = itertools.count(1)
        self.waiting: dict[int, queue.SimpleQueue[bytes]] = {}
        self.requests = node.create_publisher(of.Request, f"rq{service}Request", plain)
        node.create_subscription(of.Response, f"rr{service}Reply", self._reply, plain, raw=True)

    def _reply(self, payload: bytes) -> None:
        client, number = struct.unpack_from("<Qq", payload, 4)
        if client == CLIENT and (waiting := self.waiting.pop(number, None)):
            waiting.put(payload[:4] + payload[20:])

    def call(self, request: Any) -> Any:
        number, written = next(self.numbers), serialize_message(request)
        reply: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self.waiting[number] = reply
        self.requests.publish(written[:4] + struct.pack("<Qq", CLIENT, number) + written[4:])
        return deserialize_message(reply.get(timeout=PATIENCE), self.reply_type)


class Passage:
    """The action `name`, such as `/r1/navigate_to_pose`, of the domain `inside`, is in the domain `outside` as well."""

    def __init__(self, name: str, inside: int, outside: int) -> None:
        self.sides = Side("passage_inside", inside), Side("passage_outside", outside)
        there, here = (side.node for side in self.sides)
        for topic, (of, profile) in TOPICS.items():
            publisher = here.create_publisher(of, f"{name}/_action/{topic}", profile)
            there.create_subscription(of, f"{name}/_action/{topic}", publisher.publish, profile, raw=True)
        for service, kind in SERVICES.items():
            client = CycloneClient(there, f"{name}/_action/{service}", kind)
            here.create_service(
                kind, f"{name}/_action/{service}", lambda request, _, client=client: client.call(request),
                callback_group=ReentrantCallbackGroup(),
            )  # fmt: skip

    def __enter__(self) -> Self:
        self.threads = [threading.Thread(target=side.spin, daemon=True) for side in self.sides]
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        for side in self.sides:
            side.executor.shutdown(timeout_sec=1.0)
            rclpy.try_shutdown(context=side.context)
