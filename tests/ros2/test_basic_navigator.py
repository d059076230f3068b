"""Nav2's own `BasicNavigator` (`nav2_simple_commander`) with the gateway in the place of Nav2.

The package is not among the wheels. CURIONAV_NAV2 names a checkout of `ros-navigation/navigation2`, branch kilted; the
file that these tests use imports neither Nav2's nodes nor its libraries. Types that it only names, such as those of
docking, are stood in for, since they are not generated here.
"""

from __future__ import annotations

import importlib.util
import math
import os
import sys
import types
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from lifecycle_msgs.srv import GetState
from nav2_msgs import action, msg
from nav_msgs.msg import Goals
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters

from conftest import need
from rig import MISSION_PATIENCE, PROGRAM, TOLERANCE, free_domain, gateway, goal_pose, planner, router, wait_for
from rmw_zenoh import RmwNode
from rmw_zenoh_robot import Driving, driving
from zenoh_relay import Relay

NAV2 = Path(os.environ.get("CURIONAV_NAV2", "no-checkout-of-navigation2"))
FILE = NAV2 / "nav2_simple_commander" / "nav2_simple_commander" / "robot_navigator.py"

need(PROGRAM, FILE)

ACTIONS = {
    "navigate_to_pose": action.NavigateToPose,
    "navigate_through_poses": action.NavigateThroughPoses,
    "follow_waypoints": action.FollowWaypoints,
    "follow_path": action.FollowPath,
    "compute_path_to_pose": action.ComputePathToPose,
    "compute_path_through_poses": action.ComputePathThroughPoses,
}


class SizedGoals(Goals):
    """As `goThroughPoses` of kilted takes them: it asks how many there are."""

    def __len__(self) -> int:
        return len(self.goals)


class _Named(types.ModuleType):
    """A module that has every name: each stands for a type that is not used."""

    def __init__(self, name: str, stand_in: type) -> None:
        super().__init__(name)
        self.__dict__["stand_in"] = stand_in

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self.stand_in


class _Actions(_Named):
    """The actions that are generated, and stand-ins for the others."""

    def __getattr__(self, name: str) -> Any:
        return getattr(action, name, None) or super().__getattr__(name)


def commander() -> types.ModuleType:
    """The file of `nav2_simple_commander`, as Nav2 has it."""
    sys.modules["geographic_msgs"] = types.ModuleType("geographic_msgs")
    sys.modules["geographic_msgs.msg"] = _Named("geographic_msgs.msg", PoseStamped)
    sys.modules["nav2_msgs.srv"] = _Named("nav2_msgs.srv", GetState)
    sys.modules["nav2_msgs.action"] = _Actions("nav2_msgs.action", action.NavigateToPose)
    sys.modules["nav2_msgs.msg"] = _Named("nav2_msgs.msg", msg.WaypointStatus)
    spec = importlib.util.spec_from_file_location("robot_navigator", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Site:
    """A robot at rest behind the gateway, and a BasicNavigator."""

    def __init__(self, robot: Driving, module: types.ModuleType, navigator: Any) -> None:
        self.robot, self.module, self.navigator = robot, module, navigator

    def way_to(self, x: float, y: float) -> float:
        return math.dist(self.robot.robot.world.pose[:2], (x, y))

    def here(self) -> tuple[float, float]:
        x, y = self.robot.robot.world.pose[:2]
        return float(x), float(y)

    def end(self, task: Any) -> Any:
        """What has become of a task, once it is over."""
        assert task is not None
        wait_for("the end of the task", lambda: self.navigator.isTaskComplete(task), MISSION_PATIENCE)
        return self.navigator.getResult()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    with ExitStack() as stack:
        planning, of_robot = stack.enter_context(planner(tmp_path, "r1")), stack.enter_context(router())
        endpoint = of_robot.ready["endpoints"][0]
        mission = {"initial_pose": [1.0, 4.0, 0.0], "goal_tolerance": TOLERANCE}
        stack.enter_context(
            gateway(tmp_path, "r1", planning, endpoint, namespace="/r1", dialect="rmw_zenoh", mission=mission)
        )
        node = stack.enter_context(RmwNode(endpoint, "robot", "/r1"))
        domain = free_domain()
        relay = Relay(stack.enter_context(RmwNode(endpoint, "relay", "/r1")), domain)
        relay.actions((f"/r1/{name}", of) for name, of in ACTIONS.items())
        relay.service("/r1/amcl/get_state", GetState)
        relay.service("/r1/bt_navigator/get_state", GetState)
        for name, of in {
            "list_parameters": ListParameters,
            "get_parameters": GetParameters,
            "describe_parameters": DescribeParameters,
        }.items():
            relay.service(f"/r1/curionav_gateway/{name}", of)
        relay.topic("/r1/amcl_pose", PoseWithCovarianceStamped, latched=True)
        stack.enter_context(relay)
        robot = stack.enter_context(driving(node))
        rclpy.init(domain_id=domain)
        stack.callback(rclpy.try_shutdown)
        module = commander()
        navigator = module.BasicNavigator(namespace="r1")
        stack.callback(navigator.destroy_node)
        # It would say that the robot is at (0, 0), as to AMCL; the gateway knows better.
        wait_for("a pose", lambda: rclpy.spin_once(navigator, timeout_sec=0.1) or navigator.initial_pose_received)
        navigator.waitUntilNav2Active()
        yield Site(robot, module, navigator)


def test_what_scripts_for_nav2_do(site: Site) -> None:
    navigator, results = site.navigator, site.module.TaskResult
    x, y = site.here()

    path = navigator.getPath(PoseStamped(), goal_pose(x + 3.0, y))
    assert path is not None
    assert len(path.poses) > 30
    assert math.dist((path.poses[-1].pose.position.x, path.poses[-1].pose.position.y), (x + 3.0, y)) < 1e-6
    through = navigator.getPathThroughPoses(PoseStamped(), [goal_pose(x + 1.0, y), goal_pose(x + 2.0, y)])
    assert through is not None
    assert len(through.poses) > 20
    assert navigator.getPath(PoseStamped(), goal_pose(900.0, y)) is None
    assert navigator.getTaskError()[0] == action.ComputePathToPose.Result.GOAL_OUTSIDE_MAP

    task = navigator.goToPose(goal_pose(x + 1.5, y))
    assert site.end(task) == results.SUCCEEDED
    assert navigator.getFeedback() is not None
    assert site.way_to(x + 1.5, y) < TOLERANCE + 0.5

    x, y = site.here()
    task = navigator.followPath(navigator.getPath(PoseStamped(), goal_pose(x + 1.5, y)))
    assert site.end(task) == results.SUCCEEDED
    assert navigator.getFeedback().distance_to_goal < 1.5

    x, y = site.here()
    task = navigator.goThroughPoses(SizedGoals(goals=[goal_pose(x + 1.0, y), goal_pose(x + 2.0, y)]))
    assert site.end(task) == results.SUCCEEDED
    assert site.way_to(x + 2.0, y) < TOLERANCE + 0.5

    x, y = site.here()
    task = navigator.followWaypoints([goal_pose(x - 1.0, y), goal_pose(x - 2.0, y)])
    assert site.end(task) == results.SUCCEEDED
    assert navigator.getFeedback().current_waypoint == 1

    task = navigator.goToPose(goal_pose(11.0, 5.2))
    assert task is not None
    wait_for("motion", lambda: site.robot.robot.world.v > 0.2)
    navigator.cancelTask()
    assert site.end(task) == results.CANCELED
    wait_for("a stand", lambda: site.robot.robot.world.v == 0.0)


def test_parameters_are_seen_by_rclpy(site: Site) -> None:
    navigator = site.navigator

    def ask(service: str, of: Any, **fields: Any) -> Any:
        client = navigator.create_client(of, f"/r1/curionav_gateway/{service}")
        wait_for(service, client.service_is_ready)
        answer = client.call_async(of.Request(**fields))
        rclpy.spin_until_future_complete(navigator, answer, timeout_sec=30.0)
        return answer.result()

    names = ask("list_parameters", ListParameters).result.names
    assert "mission.goal_tolerance" in names
    value = ask("get_parameters", GetParameters, names=["mission.goal_tolerance"]).values[0]
    assert value.double_value == TOLERANCE
    meaning = ask("describe_parameters", DescribeParameters, names=["mission.goal_tolerance"]).descriptors[0]
    assert meaning.read_only
    assert meaning.floating_point_range[0].to_value == 5.0
