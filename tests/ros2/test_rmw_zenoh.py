"""Missions in the dialect of `rmw_zenoh`, with nodes made of plain Zenoh sessions: no DDS, no bridge."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose
from unique_identifier_msgs.msg import UUID

from conftest import need
from rig import MISSION_PATIENCE, PROGRAM, TOLERANCE, Program, gateway, goal_pose, planner, router, wait_for
from rmw_zenoh import RmwNode
from rmw_zenoh_robot import ACTION, IN, OUT, Driving, ListenerOfAll, driving

need(PROGRAM)


@dataclass
class Rig:
    node: RmwNode
    listener: ListenerOfAll
    driving: Driving
    gateway: Program

    def way_to(self, goal: tuple[float, float]) -> float:
        return math.dist(self.driving.robot.world.pose[:2], goal)

    def speed(self) -> float:
        return self.driving.robot.world.v


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with ExitStack() as stack:
        planning, of_robot = stack.enter_context(planner(tmp_path, "r1")), stack.enter_context(router())
        endpoint = of_robot.ready["endpoints"][0]
        mission = {"initial_pose": [1.0, 4.0, 0.0], "goal_tolerance": TOLERANCE}
        gate = stack.enter_context(
            gateway(tmp_path, "r1", planning, endpoint, namespace="/r1", dialect="rmw_zenoh", mission=mission)
        )
        node = stack.enter_context(RmwNode(endpoint, "robot", "/r1"))
        listener = ListenerOfAll(node)
        rig = Rig(node, listener, stack.enter_context(driving(node)), gate)
        wait_for("a pose", lambda: listener.newest.get("/r1/amcl_pose"))
        yield rig
        assert not listener.malformed


def test_from_goal_pose_to_arrival(rig: Rig) -> None:
    near = (4.0, 4.0)
    rig.node.publisher("/r1/goal_pose", PoseStamped)(goal_pose(*near))
    wait_for("arrival", lambda: rig.way_to(near) < TOLERANCE + 0.3, MISSION_PATIENCE)
    wait_for("a stand", lambda: rig.speed() == 0.0)
    assert rig.driving.robot.world.measures.touched_walls == 0
    for topic in ("/r1/cmd_vel", "/r1/amcl_pose", "/r1/plan", "/r1/curionav/candidates", "/diagnostics"):
        assert rig.listener.heard[topic] > 0, topic


def test_every_topic_and_service_has_a_token_by_which_nodes_find_it(rig: Rig) -> None:
    tokens = [
        str(reply.ok.key_expr).split("/") for reply in rig.node.session.liveliness().get("@ros2_lv/**") if reply.ok
    ]
    ours = [token for token in tokens if token[8] == "curionav_gateway"]
    assert [token[5] for token in ours].count("NN") == 1
    said = {(token[5], token[9].replace("%", "/")) for token in ours if token[5] != "NN"}
    services = {("SS", f"{ACTION}/_action/{name}") for name in ("send_goal", "get_result", "cancel_goal")}
    assert {("MS", topic) for topic in IN} <= said
    assert {("MP", topic) for topic in OUT} | services <= said
    for token in ours:
        assert token[:2] == ["@ros2_lv", "0"]
        assert len(token) == (9 if token[5] == "NN" else 13)


class Client:
    """A client of navigate_to_pose."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.names = rig, iter(range(1, 100))

    def send(self, pose: PoseStamped) -> tuple[UUID, bool]:
        of = NavigateToPose.Impl.SendGoalService
        name = UUID(uuid=[next(self.names)] * 16)
        request = of.Request(goal_id=name, goal=NavigateToPose.Goal(pose=pose))
        reply = self.rig.node.call(f"{ACTION}/_action/send_goal", request, of.Response, 30.0)
        assert reply is not None
        return name, bool(reply.accepted)

    def status(self, name: UUID) -> int:
        of = NavigateToPose.Impl.GetResultService
        reply = self.rig.node.call(
            f"{ACTION}/_action/get_result", of.Request(goal_id=name), of.Response, MISSION_PATIENCE
        )
        assert reply is not None
        return int(reply.status)

    def cancel(self, name: UUID) -> Any:
        request = CancelGoal.Request(goal_info=GoalInfo(goal_id=name))
        return self.rig.node.call(f"{ACTION}/_action/cancel_goal", request, CancelGoal.Response, 30.0)


def test_goals_are_refused_preempted_cancelled_and_reached(rig: Rig) -> None:
    client = Client(rig)
    assert not client.send(goal_pose(3.0, 4.0, "no_such_frame"))[1]
    first, accepted = client.send(goal_pose(11.0, 5.2))
    assert accepted
    # The result is asked for before there is one, as rclpy does.
    ended: list[int] = []
    waiting = threading.Thread(target=lambda: ended.append(client.status(first)), daemon=True)
    waiting.start()
    wait_for("motion", lambda: rig.speed() > 0.2)
    second, accepted = client.send(goal_pose(9.0, 4.0))
    assert accepted
    wait_for("the end of the first", lambda: ended)
    assert ended[0] in (GoalStatus.STATUS_ABORTED, GoalStatus.STATUS_CANCELED)
    assert len(client.cancel(second).goals_canceling) == 1
    assert client.status(second) == GoalStatus.STATUS_CANCELED
    wait_for("a stand", lambda: rig.speed() == 0.0)
    at = rig.driving.robot.world.pose
    third, accepted = client.send(goal_pose(float(at[0]) + 1.5, float(at[1])))
    assert accepted
    assert client.status(third) == GoalStatus.STATUS_SUCCEEDED
    assert rig.listener.heard[f"{ACTION}/_action/feedback"] > 0
