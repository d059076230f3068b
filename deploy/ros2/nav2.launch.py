"""Nav2 without its controller_server, whose place `curionav ros2-gateway` takes (docs/nav2.md).

It starts planner, behaviours and bt_navigator. Map and localisation (map_server and amcl, or slam_toolbox) are yours.
`ros2 launch nav2.launch.py use_sim_time:=true` for a simulation.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

HERE = Path(__file__).resolve().parent


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` starts."""
    sim_time = {"use_sim_time": LaunchConfiguration("use_sim_time")}
    parameters = [LaunchConfiguration("params_file"), sim_time]
    tree = {"default_nav_to_pose_bt_xml": str(HERE / "navigate_to_pose.xml")}
    return LaunchDescription(
        [
            DeclareLaunchArgument("params_file", default_value=str(HERE / "nav2.yaml")),
            DeclareLaunchArgument("use_sim_time", default_value="false"),
            Node(package="nav2_planner", executable="planner_server", output="screen", parameters=parameters),
            Node(package="nav2_behaviors", executable="behavior_server", output="screen", parameters=parameters),
            Node(
                package="nav2_bt_navigator",
                executable="bt_navigator",
                output="screen",
                parameters=[*parameters, tree],
            ),
            Node(
                package="nav2_lifecycle_manager",
                executable="lifecycle_manager",
                name="lifecycle_manager_navigation",
                output="screen",
                parameters=parameters,
            ),
        ]
    )
