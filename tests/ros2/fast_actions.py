"""Lets action clients of Fast DDS use an action of the dialect `ros2dds`.

Zenoh's plugin for DDS takes the other end of every service for a node of `rmw_cyclonedds_cpp`, which begins each
request and reply with 16 bytes that say whose it is. `rmw_fastrtps_cpp` says so outside of the message, so its services
never pass the plugin. `Passage` stands in for the plugin: a node that offers the action in a domain of its own, which
the plugin does not know, and puts what it hears on Zenoh as the plugin does (`route_service_cli.rs` of its source).
"""

from __future__ import annotations

import itertools
import struct
import threading
from contextlib import suppress
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

from rmw_zenoh import open_session

REQUEST_HEADER = bytes([0x72, 0x71, 0x68])
"""What the attachment of a request begins with."""
PATIENCE = {"send_goal": 5.0, "get_result": 300.0, "cancel_goal": 5.0}
"""How long the plugin waits for a reply, s. A result comes when the robot is there."""
TOPICS = {
    "feedback": (NavigateToPose.Impl.FeedbackMessage, QoSProfile(depth=10)),
    "status": (GoalStatusArray, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)),
}
SERVICES = {
    "send_goal": NavigateToPose.Impl.SendGoalService,
    "get_result": NavigateToPose.Impl.GetResultService,
    "cancel_goal": CancelGoal,
}


class Passage:
    """The action `name`, such as `/r1/navigate_to_pose`, of the router at `endpoint` is in a DDS domain as well."""

    def __init__(self, name: str, endpoint: str, domain: int) -> None:
        self.session, self.requests = open_session(endpoint), itertools.count(1)
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = node = Node("passage", context=self.context)
        # A service whose reply is awaited must not hold up the others.
        self.executor = MultiThreadedExecutor(num_threads=8, context=self.context)
        self.executor.add_node(node)
        self.kept = []
        for topic, (of, profile) in TOPICS.items():
            publisher = node.create_publisher(of, f"{name}/_action/{topic}", profile)
            self.kept.append(
                self.session.declare_subscriber(
                    f"{name[1:]}/_action/{topic}", lambda sample, to=publisher: to.publish(bytes(sample.payload))
                )
            )
        for service, kind in SERVICES.items():
            key, patience = f"{name[1:]}/_action/{service}", PATIENCE[service]
            node.create_service(
                kind, f"/{key}", lambda request, response, at=(key, patience): self.call(*at, request, type(response)),
                callback_group=ReentrantCallbackGroup(),
            )  # fmt: skip

    def call(self, key: str, patience: float, request: Any, response: type) -> Any:
        """What the gateway replies. Without a reply, the client of Fast DDS gets none either."""
        header = REQUEST_HEADER + struct.pack("<Qq?", 1, next(self.requests), True)
        replies = self.session.get(key, payload=serialize_message(request), attachment=header, timeout=patience)
        for reply in replies:
            if reply.ok is not None:
                return deserialize_message(bytes(reply.ok.payload), response)
        raise TimeoutError(f"no reply on {key}")

    def spin(self) -> None:
        with suppress(ExternalShutdownException):
            self.executor.spin()

    def __enter__(self) -> Self:
        threading.Thread(target=self.spin, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown(timeout_sec=1.0)
        rclpy.try_shutdown(context=self.context)
        self.session.close()
