"""Whole missions with a robot of ROS 2 on Fast DDS, through Zenoh's own plugin for DDS and the gateway."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid
from nav_msgs.msg import Path as RosPath
from rclpy.action import ActionClient

from conftest import need
from fast_actions import Passage
from rig import (
    BRIDGE,
    GOAL,
    MISSION_PATIENCE,
    PROGRAM,
    QUICKSTART,
    TOLERANCE,
    Listener,
    Rig,
    free_domain,
    goal_pose,
    listening,
    wait_for,
)
from robot_messages import Robot
from simulated_robot import LATCHED
from world import World

need(BRIDGE, PROGRAM)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with ExitStack() as stack:
        yield Rig.start(stack, tmp_path)


def test_from_goal_pose_to_arrival_with_a_late_map_and_a_late_plan(tmp_path: Path) -> None:
    with ExitStack() as stack:
        rig = Rig.start(stack, tmp_path, "--no-map")
        maps = rig.node.create_publisher(OccupancyGrid, "/r1/map", LATCHED)
        # The map comes when everything else is there and the robot has driven nowhere.
        maps.publish(Robot(World(QUICKSTART, 1)).map())
        wait_for("the map to be wanted", lambda: maps.get_subscription_count() > 0)
        wait_for("a pose", lambda: rig.node.newest("/r1/amcl_pose"))
        rig.goals.publish(goal_pose(*GOAL))
        wait_for("the first metre", lambda: rig.position()[0] > 2.0, MISSION_PATIENCE)
        # A subscriber that comes now gets the plan that was published before it came, or the next one.
        rig.node.listen("/r1/plan", RosPath, LATCHED)
        plan = wait_for("a plan", lambda: rig.node.newest("/r1/plan"))
        assert plan.header.frame_id == "map"
        wait_for("a plan of several poses", lambda: len(rig.node.newest("/r1/plan").poses) > 1)
        wait_for("arrival", lambda: rig.way_to(GOAL) < TOLERANCE + 0.3, MISSION_PATIENCE)
        wait_for("a stand", lambda: rig.speed() == 0.0)
        assert rig.way_to(GOAL) < TOLERANCE + 0.5
        believed = rig.node.newest("/r1/amcl_pose")
        assert believed.header.frame_id == "map"
        assert math.dist((believed.pose.pose.position.x, believed.pose.pose.position.y), rig.position()) < 0.5
        for _, command in rig.node.heard["/r1/cmd_vel"]:
            assert 0.0 <= command.twist.linear.x <= 1.0 + 1e-9
            assert abs(command.twist.angular.z) <= 1.0 + 1e-9
        rig.robot.stop()
        measures = rig.robot.line()
        assert measures["touched_walls"] == 0
        assert measures["touched_people"] == 0


class Client:
    """A client of navigate_to_pose, real rclpy on Fast DDS, in a domain of its own."""

    def __init__(self, rig: Rig, node: Listener) -> None:
        self.rig = rig
        self.feedback: list[Any] = []
        self.client = ActionClient(node, NavigateToPose, "/r1/navigate_to_pose")
        wait_for("the action's server", self.client.server_is_ready)
        # Until its place is known every goal is refused.
        wait_for("a pose", lambda: rig.node.newest("/r1/amcl_pose"))

    def send(self, pose: PoseStamped) -> Any:
        """The handle of a goal, accepted or not."""
        sent = self.client.send_goal_async(NavigateToPose.Goal(pose=pose), feedback_callback=self.feedback.append)
        wait_for("an answer", sent.done)
        return sent.result()

    def status(self, handle: Any) -> int:
        """How the goal ended."""
        result = handle.get_result_async()
        wait_for("a result", result.done, MISSION_PATIENCE)
        return int(result.result().status)


@pytest.fixture
def client(rig: Rig) -> Iterator[Client]:
    outside = free_domain(rig.domain)
    rig.stack.enter_context(Passage("/r1/navigate_to_pose", rig.bridge.ready["listening"][0], outside))
    with listening(outside, "client") as node:
        yield Client(rig, node)


def test_an_action_client_is_accepted_told_and_succeeds(rig: Rig, client: Client) -> None:
    near = (3.0, 4.0)
    handle = client.send(goal_pose(*near))
    assert handle.accepted
    assert client.status(handle) == GoalStatus.STATUS_SUCCEEDED
    assert rig.way_to(near) < TOLERANCE + 0.5
    told = [message.feedback.distance_remaining for message in client.feedback]
    assert len(told) > 3
    assert told[-1] < told[0]


def test_a_goal_in_a_frame_that_is_not_known_is_refused(rig: Rig, client: Client) -> None:
    assert not client.send(goal_pose(3.0, 4.0, "no_such_frame")).accepted
    assert rig.speed() == 0.0


def test_a_goal_is_cancelled_and_the_robot_stands(rig: Rig, client: Client) -> None:
    handle = client.send(goal_pose(*GOAL))
    assert handle.accepted
    wait_for("motion", lambda: rig.speed() > 0.2)
    cancelled = handle.cancel_goal_async()
    wait_for("an answer", cancelled.done)
    assert len(cancelled.result().goals_canceling) == 1
    assert client.status(handle) == GoalStatus.STATUS_CANCELED
    wait_for("a stand", lambda: rig.speed() == 0.0)
    assert rig.way_to(GOAL) > 2.0


def test_a_newer_goal_takes_the_place_of_the_one_before(rig: Rig, client: Client) -> None:
    first = client.send(goal_pose(*GOAL))
    assert first.accepted
    wait_for("motion", lambda: rig.speed() > 0.2)
    near = (4.0, 4.0)
    second = client.send(goal_pose(*near))
    assert second.accepted
    assert client.status(first) in (GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED)
    assert client.status(second) == GoalStatus.STATUS_SUCCEEDED
    assert rig.way_to(near) < TOLERANCE + 0.5
