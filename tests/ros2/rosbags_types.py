"""The messages of ROS 2 as rosbags knows them: a codec in pure Python, independent of both ROS and curionav."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from conftest import HERE


def services() -> list[Path]:
    """Definitions of the services that ROS itself has and that the gateway serves, as the wheels have them."""
    prefixes = [Path(prefix, "share") for prefix in os.environ["AMENT_PREFIX_PATH"].split(":")]
    wanted = ("lifecycle_msgs/srv/GetState.srv", "rcl_interfaces/srv/*Parameter*.srv")
    return [file for prefix in prefixes for pattern in wanted for file in prefix.glob(pattern)]


def store() -> Any:
    """The types of rosbags, with those that it does not know from the files that rclpy's were generated from.

    Parts of an action are messages to it.
    """
    known, added = get_typestore(Stores.ROS2_KILTED), {}

    def add(name: str, text: str) -> None:
        added.update(get_types_from_msg(text, name))

    people = HERE / "messages" / "people_msgs" / "msg"
    for message in ("Person", "People"):
        add(f"people_msgs/msg/{message}", (people / f"{message}.msg").read_text())
    nav2 = HERE / "messages" / "nav2_msgs"
    for message in (nav2 / "msg").glob("*.msg"):
        add(f"nav2_msgs/msg/{message.stem}", message.read_text())
    goal_id = "unique_identifier_msgs/UUID goal_id\n"
    for action in (nav2 / "action").glob("*.action"):
        name, parts = action.stem, action.read_text().split("---\n")
        for part, text in zip(("Goal", "Result", "Feedback"), parts, strict=True):
            add(f"nav2_msgs/msg/{name}_{part}", text)
        for part, text in {
            "SendGoal_Request": f"{goal_id}nav2_msgs/{name}_Goal goal",
            "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
            "GetResult_Request": goal_id,
            "GetResult_Response": f"int8 status\nnav2_msgs/{name}_Result result",
            "FeedbackMessage": f"{goal_id}nav2_msgs/{name}_Feedback feedback",
        }.items():
            add(f"nav2_msgs/msg/{name}_{part}", text)
    for service in services():
        package, name = service.parents[1].name, service.stem
        for part, text in zip(("Request", "Response"), service.read_text().split("---\n"), strict=True):
            add(f"{package}/msg/{name}_{part}", text)
    add("action_msgs/msg/CancelGoal_Request", "action_msgs/GoalInfo goal_info")
    add("action_msgs/msg/CancelGoal_Response", "int8 return_code\naction_msgs/GoalInfo[] goals_canceling")
    known.register(added)
    return known


STORE = store()


def in_rosbags(name: str) -> str:
    package, _, message = name.split("/")
    return f"{package}/msg/{message}"
