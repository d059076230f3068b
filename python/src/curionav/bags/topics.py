"""Which of a bag's topics are read, and those that are found where none is named."""

from __future__ import annotations

from dataclasses import dataclass

from .bag import GRID, ODOMETRY, PERSON, POSE, POSE_WITH_COVARIANCE, SCAN, TRANSFORMS, Bag, BagError
from .planar import Pose2

TF = "/tf"
"""Stands for transforms, where a topic of poses could stand."""
NOTHING = "none"
"""Stands for a reference that is not wanted."""
POSES = (POSE, POSE_WITH_COVARIANCE, ODOMETRY)
"""Types of messages that say where a robot is."""


@dataclass(frozen=True)
class Choice:
    """What of a bag is read. What is not given is found."""

    scan: str | None = None
    """topic of ``LaserScan``"""
    odometry: str | None = None
    """topic of ``Odometry``, or `TF`"""
    reference: str | None = None
    """topic of one of `POSES` in the map frame, `TF`, or `NOTHING`"""
    map_frame: str = "map"
    odometry_frame: str | None = None
    base_frame: str | None = None
    laser: Pose2 | None = None
    """where the scanner sits on the robot, in place of what transforms say"""


def scan_topic(bag: Bag, choice: Choice) -> str:
    """The topic of scans: the only one, or ``/scan``."""
    if choice.scan is not None:
        return bag.has(choice.scan, SCAN)
    return _only(bag, "scans", "--scan", bag.topics(SCAN), "/scan")


def odometry_topic(bag: Bag, choice: Choice) -> str:
    """The topic of odometry: the only one, or ``/odom``; transforms if there is none."""
    if choice.odometry == TF:
        return TF
    if choice.odometry is not None:
        return bag.has(choice.odometry, ODOMETRY)
    topics = [topic for topic in bag.topics(ODOMETRY) if not _is_truth(topic)]
    if not topics and bag.topics(*TRANSFORMS):
        return TF
    return _only(bag, "odometry", "--odom", topics, "/odom")


def reference_topics(bag: Bag, choice: Choice) -> list[str]:
    """Where the robot's pose on the map may be found, the best source first.

    That is ground truth, then transforms, then what AMCL says. A goal is a pose as well, so no other topic is guessed.
    """
    if choice.reference == NOTHING:
        return []
    if choice.reference == TF:
        return [TF]
    if choice.reference is not None:
        return [bag.has(choice.reference, *POSES)]
    poses = bag.topics(*POSES)
    truths = [topic for topic in poses if _is_truth(topic)]
    truth = [_only(bag, "ground truth", "--reference", truths, "/ground_truth")] if truths else []
    return [*truth, TF, *[topic for topic in poses if topic.endswith("amcl_pose")]]


def map_topic(bag: Bag, topic: str | None) -> str:
    """The topic of the map: the only one, or ``/map``."""
    if topic is not None:
        return bag.has(topic, GRID)
    return _only(bag, "a map", "--topic", bag.topics(GRID), "/map")


def people_topic(bag: Bag, topic: str | None) -> str:
    """The topic of annotated people: the only one, or that of the annotation tool."""
    if topic is not None:
        return bag.has(topic, PERSON)
    return _only(
        bag, "annotated people (leg_tracker/Person)", "--topic", bag.topics(PERSON), "/ground_truth_people_tracks"
    )


def _is_truth(topic: str) -> bool:
    return any(word in topic.lower() for word in ("ground_truth", "groundtruth"))


def _only(bag: Bag, what: str, option: str, topics: list[str], usual: str) -> str:
    """The one topic, or the one with the usual name."""
    if len(topics) == 1:
        return topics[0]
    if usual in topics:
        return usual
    if topics:
        raise BagError(f"{bag.path}: several topics have {what}; choose with {option}: {', '.join(topics)}")
    raise BagError(f"{bag.path}: no topic has {what}; {bag.contents()}")
