"""Two robots in two namespaces at one router: neither hears what is meant for the other."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry

from conftest import need
from rig import (
    BRIDGE,
    MISSION_PATIENCE,
    PROGRAM,
    TOLERANCE,
    Rig,
    gateway_of,
    goal_pose,
    planner,
    simulated_robot,
    wait_for,
)

need(BRIDGE, PROGRAM)


def test_each_robot_drives_to_its_own_goal_alone(tmp_path: Path) -> None:
    with ExitStack() as stack:
        rig = Rig.start(stack, tmp_path)
        node = rig.node
        node.listen("/r2/cmd_vel", TwistStamped)
        node.listen("/r2/truth", Odometry)
        node.listen("/r2/amcl_pose", PoseWithCovarianceStamped)
        planning = stack.enter_context(planner(tmp_path, "r2"))
        stack.enter_context(gateway_of(tmp_path, "r2", planning, rig.bridge))
        stack.enter_context(simulated_robot(rig.domain, "/r2", "--stamped", "--seed", "2"))
        goals = node.create_publisher(PoseStamped, "/r2/goal_pose", 10)
        wait_for("the second gateway to take goals", lambda: goals.get_subscription_count() > 0)
        wait_for("the second pose", lambda: node.newest("/r2/amcl_pose"))

        near, other = (3.0, 4.0), (3.0, 5.5)
        rig.go(near)
        wait_for("arrival of the first", lambda: rig.way_to(near) < TOLERANCE + 0.5, MISSION_PATIENCE)
        # Until then nothing was said that would move the second.
        assert rig.speed("/r2") == 0.0
        assert all(command.twist.linear.x == 0.0 for _, command in node.heard["/r2/cmd_vel"])
        wait_for("a stand of the first", lambda: rig.speed() == 0.0)
        stands = rig.position()

        goals.publish(goal_pose(*other))
        wait_for("arrival of the second", lambda: rig.way_to(other, "/r2") < TOLERANCE + 0.5, MISSION_PATIENCE)
        assert rig.position() == stands
        # The same name in ROS is not the same publisher: each namespace has one of its own.
        assert len(node.get_publishers_info_by_topic("/r1/cmd_vel")) == 1
        assert len(node.get_publishers_info_by_topic("/r2/cmd_vel")) == 1
