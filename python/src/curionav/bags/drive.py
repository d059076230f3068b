"""What a bag says of a drive: scans, odometry, and where the robot was on the map."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from .bag import TRANSFORMS, Bag, BagError
from .frames import FrameTree, Mount, name, planar
from .planar import SET_BACK_S, Pose2, Track
from .sweep import Sweep, sweep
from .topics import TF, Choice, odometry_topic, reference_topics, scan_topic

ODOMETRY_GAP_S = 1.0
"""Between poses of odometry that are farther apart, no scan has one."""
REFERENCE_GAP_S = 2.0
"""How long odometry carries a reference on: in this time it errs by little."""
_BASES = ("base_footprint", "base_link", "base")
"""Usual names of the robot's frame."""


@dataclass
class Drive:
    """A drive of a robot with a planar scanner."""

    scan_topic: str
    mount: Mount
    odometry: Track
    """the robot in the frame of odometry"""
    odometry_from: str
    """in words"""
    reference: Track = field(default_factory=Track)
    """the robot on the map; empty if nothing says that"""
    reference_from: str = ""
    """in words"""
    notes: list[str] = field(default_factory=list)
    """what was left out, for a person"""

    def sweeps(self, bag: Bag) -> Iterator[Sweep]:
        """The scans, until the clock is set back."""
        last = float("-inf")
        for entry in bag.timed(self.scan_topic):
            if entry.stamp < last - SET_BACK_S:
                self.notes.append(f"scans after {last:.3f} s, when the clock was set back")
                return
            last = max(last, entry.stamp)
            yield sweep(entry.message, entry.stamp, self.mount.is_upside_down)

    def odometry_at(self, stamp: float) -> Pose2 | None:
        """The robot's pose by odometry, if odometry was told around this time."""
        return self.odometry.at(stamp, ODOMETRY_GAP_S)

    def reference_at(self, stamp: float) -> Pose2 | None:
        """The robot's pose on the map: the nearest reference in time, carried on by odometry."""
        nearest = self.reference.nearest(stamp)
        if nearest is None or abs(self.reference.stamps[nearest] - stamp) > REFERENCE_GAP_S:
            return None
        then, now = self.odometry_at(self.reference.stamps[nearest]), self.odometry_at(stamp)
        if then is None or now is None:
            return None
        return self.reference.poses[nearest].compose(then.inverse().compose(now))


@dataclass(frozen=True)
class _Frames:
    """Names of the frames that a robot drives in."""

    map: str
    odometry: str
    base: str
    """the robot's own"""


def read(bag: Bag, choice: Choice) -> Drive:
    """Reads a drive but for its scans, which may be many.

    Raises:
        BagError: Scans or odometry are missing, several topics have them, or nothing says where the scanner is.
    """
    scan = scan_topic(bag, choice)
    odometry = odometry_topic(bag, choice)
    scanner = name(bag.first(scan).header.frame_id)
    told = None if odometry == TF else bag.first(odometry)
    frame = choice.odometry_frame or (name(told.header.frame_id) if told is not None else "") or "odom"
    tree = _tree(bag, {choice.map_frame, frame})
    if told is None:
        base = choice.base_frame or _driven(bag, tree, frame)
        if base not in tree.children(frame):
            raise BagError(f"{bag.path}: no transforms say where `{base}` is in `{frame}`; {tree.listed()}")
        driven, said = tree.edges[base].track, f"transforms from `{frame}` to `{base}`"
    else:
        base = choice.base_frame or name(told.child_frame_id) or _usual_base(tree, scanner)
        driven, said = _topic(bag, odometry), f"`{odometry}`"
    mount = Mount(choice.laser) if choice.laser is not None else tree.mount(scanner, base)
    drive = Drive(scan, mount, driven, said)
    if driven.was_set_back:
        drive.notes.append("odometry from when its clock was set back")
    frames = _Frames(choice.map_frame, frame, base)
    for source in reference_topics(bag, choice):
        if source == TF:
            _refer_to_transforms(drive, tree, frames)
        else:
            drive.reference, drive.reference_from = _topic(bag, source), f"`{source}`"
        if drive.reference.stamps:
            break
    if choice.reference == TF and not drive.reference.stamps:
        raise BagError(f"{bag.path}: no transforms say where the robot is in `{frames.map}`; {tree.listed()}")
    return drive


def _tree(bag: Bag, followed: set[str]) -> FrameTree:
    tree = FrameTree(followed)
    for entry in bag.entries(bag.topics(*TRANSFORMS)):
        for transform in entry.message.transforms:
            tree.add(transform)
    return tree


def _driven(bag: Bag, tree: FrameTree, frame: str) -> str:
    """The one frame that odometry places."""
    children = tree.children(frame)
    if len(children) != 1:
        found = f"several frames are in `{frame}`" if children else f"no frame is in `{frame}`"
        raise BagError(f"{bag.path}: {found}; give --odom-frame and --base-frame; {tree.listed()}")
    return children[0]


def _usual_base(tree: FrameTree, scanner: str) -> str:
    """The robot's frame where odometry does not name it; the scanner's, if no frame has a usual name."""
    known = {*tree.edges, *(edge.parent for edge in tree.edges.values())}
    return next((base for base in _BASES if base in known), scanner)


def _topic(bag: Bag, topic: str) -> Track:
    """The poses of a topic, whatever their type."""
    track = Track()
    for entry in bag.timed(topic):
        pose = entry.message.pose
        # With a covariance, the pose lies one level deeper.
        pose = getattr(pose, "pose", pose)
        track.add(entry.stamp, planar(pose.position, pose.orientation))
    return track


def _refer_to_transforms(drive: Drive, tree: FrameTree, frames: _Frames) -> None:
    """Takes the robot in the map frame for references or, as most localisers say it, odometry in the map frame."""
    placed = tree.children(frames.map)
    if frames.base in placed:
        drive.reference = tree.edges[frames.base].track
        drive.reference_from = f"transforms from `{frames.map}` to `{frames.base}`"
    elif frames.odometry in placed:
        drive.reference_from = f"transforms from `{frames.map}` to `{frames.odometry}`"
        track = tree.edges[frames.odometry].track
        for stamp, map_from_odometry in zip(track.stamps, track.poses, strict=True):
            driven = drive.odometry_at(stamp)
            if driven is not None:
                drive.reference.add(stamp, map_from_odometry.compose(driven))
