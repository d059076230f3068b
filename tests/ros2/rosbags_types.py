"""The messages of ROS 2 as rosbags knows them: a codec in pure Python, independent of both ROS and curionav."""

from __future__ import annotations

from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from conftest import HERE


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
    action = HERE / "messages" / "nav2_msgs" / "action" / "NavigateToPose.action"
    for part, text in zip(("Goal", "Result", "Feedback"), action.read_text().split("---\n"), strict=True):
        add(f"nav2_msgs/msg/NavigateToPose_{part}", text)
    goal_id = "unique_identifier_msgs/UUID goal_id\n"
    for part, text in {
        "SendGoal_Request": f"{goal_id}nav2_msgs/NavigateToPose_Goal goal",
        "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
        "GetResult_Request": goal_id,
        "GetResult_Response": "int8 status\nnav2_msgs/NavigateToPose_Result result",
        "FeedbackMessage": f"{goal_id}nav2_msgs/NavigateToPose_Feedback feedback",
    }.items():
        add(f"nav2_msgs/msg/NavigateToPose_{part}", text)
    add("action_msgs/msg/CancelGoal_Request", "action_msgs/GoalInfo goal_info")
    add("action_msgs/msg/CancelGoal_Response", "int8 return_code\naction_msgs/GoalInfo[] goals_canceling")
    known.register(added)
    return known


STORE = store()


def in_rosbags(name: str) -> str:
    package, _, message = name.split("/")
    return f"{package}/msg/{message}"
