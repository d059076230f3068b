"""Joins nodes of rclpy on Fast DDS to the dialect of `rmw_zenoh`, whose own middleware is not among the wheels.

`Relay` offers actions and services of the gateway in a DDS domain of its own, and calls them as a node of
`rmw_zenoh_cpp` would: so a client is real rclpy code, and what the gateway reads has passed rclpy's own serialization.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, Self

import rclpy
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from rmw_zenoh import RmwNode

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE = {"send_goal": 10.0, "cancel_goal": 10.0, "get_result": 400.0}


class Relay:
    """What the gateway offers to `zenoh`, a node at the robot's router, is in a DDS domain as well."""

    def __init__(self, zenoh: RmwNode, domain: int) -> None:
        self.zenoh, self.context = zenoh, Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("relay", context=self.context)
        # A service whose reply is awaited must not hold up the others.
        self.executor = MultiThreadedExecutor(num_threads=16, context=self.context)
        self.executor.add_node(self.node)

    def topic(self, name: str, of: type, *, latched: bool = False) -> None:
        """From the gateway to nodes of DDS."""
        publisher = self.node.create_publisher(of, name, LATCHED if latched else 10)
        self.zenoh.subscribe(name, of, publisher.publish, latched)

    def wish(self, name: str, of: type) -> None:
        """From nodes of DDS to the gateway."""
        publish: Callable[[Any], None] = self.zenoh.publisher(name, of)
        self.node.create_subscription(of, name, publish, 10)

    def service(self, name: str, of: Any, patience: float = 10.0) -> None:
        def call(request: Any, response: Any) -> Any:
            reply = self.zenoh.call(name, request, type(response), patience)
            if reply is None:
                raise TimeoutError(f"no reply on {name}")
            return reply

        self.node.create_service(of, name, call, callback_group=ReentrantCallbackGroup())

    def actions(self, actions: Iterable[tuple[str, Any]]) -> None:
        for name, of in actions:
            for part, kind in {
                "send_goal": of.Impl.SendGoalService,
                "get_result": of.Impl.GetResultService,
                "cancel_goal": CancelGoal,
            }.items():
                self.service(f"{name}/_action/{part}", kind, PATIENCE[part])
            self.topic(f"{name}/_action/feedback", of.Impl.FeedbackMessage)
            self.topic(f"{name}/_action/status", GoalStatusArray, latched=True)

    def spin(self) -> None:
        with suppress(ExternalShutdownException):
            self.executor.spin()

    def __enter__(self) -> Self:
        threading.Thread(target=self.spin, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown(timeout_sec=1.0)
        rclpy.try_shutdown(context=self.context)
