"""A recording becomes a bag of ROS 2 that other readers understand, and that says the same."""

from __future__ import annotations

import json
import math
import subprocess
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import program

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")
mcap_ros2 = pytest.importorskip("mcap_ros2.reader", reason="no mcap-ros2-support; pip install './python[test]'")

import drive  # noqa: E402
from rosbags.highlevel import AnyReader  # noqa: E402

from curionav import keys  # noqa: E402
from curionav.bags.__main__ import main  # noqa: E402
from curionav.messages import Belief, Decision, Message, Odometry, Pose, RunStatus, Scan  # noqa: E402

TICKS = 12
START_NS = 1_700_000_000_000_000_000
BEGAN = (2.0, -1.0, 0.4)
"""Where odometry of the made-up drive begins on the map."""
TYPES = {
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/cmd_vel": "geometry_msgs/msg/Twist",
    "/ground_truth": "geometry_msgs/msg/PoseStamped",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/odom": "nav_msgs/msg/Odometry",
    "/people": "visualization_msgs/msg/MarkerArray",
    "/plan": "nav_msgs/msg/Path",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}


def sent() -> list[tuple[str, Message]]:
    """The made-up drive with odometry and belief in frames of their own, and with all that a beam can say."""
    told: list[tuple[str, Message]] = []
    for key, message in drive.drive(TICKS):
        changed = message
        if isinstance(message, Odometry):
            changed = replace(message, x=0.1 * message.tick, y=0.5, heading=-0.3, omega=0.2)
        elif isinstance(message, Belief):
            x, y, heading = composed(BEGAN, (0.1 * message.tick, 0.5, -0.3))
            changed = replace(message, x=x, y=y, heading=heading)
        elif isinstance(message, Scan):
            ranges = np.array([np.nan, 0.0, 4.5, 5.0], np.float32)
            laser = Pose(x=0.1, y=-0.2, heading=0.5)
            changed = replace(message, ranges=ranges, angle_min=-0.3, angle_increment=0.25, range_min=0.05, laser=laser)
        elif isinstance(message, RunStatus):
            assert message.result is not None
            trace = message.result.trace
            columns = [*trace.columns, "true_heading"]
            values = np.hstack([trace.values, np.full((TICKS, 1), 0.25)])
            trace = replace(trace, columns=columns, values=values)
            changed = replace(message, result=replace(message.result, trace=trace))
        told.append((key, changed))
    return told


def composed(a: tuple[float, float, float], b: tuple[float, float, float]) -> tuple[float, float, float]:
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]


@dataclass(frozen=True)
class Written:
    """A bag as rosbags reads it: (ns, message) by topic."""

    path: Path
    types: dict[str, str]
    messages: dict[str, list[tuple[int, Any]]]

    def only(self, topic: str) -> list[Any]:
        return [message for _, message in self.messages[topic]]


def read(path: Path) -> Written:
    messages: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    with AnyReader([path]) as reader:
        types = {connection.topic: connection.msgtype for connection in reader.connections}
        for connection, stamp, data in reader.messages():
            messages[connection.topic].append((stamp, reader.deserialize(data, connection.msgtype)))
    return Written(path, types, messages)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Written:
    directory = tmp_path_factory.mktemp("bags")
    recording = drive.record(directory / "drive.mcap", sent(), START_NS)
    assert main(["from-recording", str(recording), str(directory / "bag")]) == 0
    return read(directory / "bag")


def of(kind: type[Message]) -> list[Any]:
    return [message for _, message in sent() if isinstance(message, kind)]


def planar(pose: Any) -> tuple[float, float, float]:
    """x, y and heading of a pose or of a transform."""
    position = getattr(pose, "position", None) or pose.translation
    q = getattr(pose, "orientation", None) or pose.rotation
    assert (position.z, q.x, q.y) == (0.0, 0.0, 0.0)
    assert math.hypot(q.z, q.w) == pytest.approx(1.0)
    return position.x, position.y, 2.0 * math.atan2(q.z, q.w)


def test_the_bag_has_the_types_that_the_documentation_names(bag: Written) -> None:
    assert bag.types == TYPES
    counts = {topic: len(found) for topic, found in bag.messages.items()}
    per_tick = dict.fromkeys(TYPES, TICKS) | {"/map": 1, "/tf_static": 1, "/tf": 2 * TICKS}
    assert counts == per_tick
    page = (ROOT / "docs" / "recording.md").read_text()
    for topic, kind in TYPES.items():
        assert f"| `{topic}` | `{kind.replace('/msg/', '/')}` |" in page


def test_another_reader_understands_every_message(bag: Written) -> None:
    """By mcap-ros2-support, which has code and definitions of its own."""
    (file,) = bag.path.glob("*.mcap")
    found: dict[str, list[Any]] = defaultdict(list)
    for one in mcap_ros2.read_ros2_messages(str(file)):
        found[one.channel.topic].append(one.ros_msg)
    assert {topic: len(messages) for topic, messages in found.items()} == {
        topic: len(messages) for topic, messages in bag.messages.items()
    }
    # The last field that is read, after texts and lists, is where an error of layout would show.
    assert found["/scan"][3].ranges[2] == 4.5
    assert list(found["/map"][0].data) == list(bag.only("/map")[0].data)
    for ours, theirs in zip(bag.only("/people")[3].markers, found["/people"][3].markers, strict=True):
        assert (ours.ns, ours.id, ours.lifetime.sec) == (theirs.ns, theirs.id, theirs.lifetime.sec)
        assert len(ours.points) == len(theirs.points)
    assert found["/plan"][3].poses[-1].pose.position.x == bag.only("/plan")[3].poses[-1].pose.position.x


def test_stamps_are_the_times_of_the_recording(bag: Written) -> None:
    for topic in ("/scan", "/odom", "/amcl_pose", "/plan", "/ground_truth"):
        for tick, (recorded, message) in enumerate(bag.messages[topic]):
            assert recorded == START_NS + tick * 100_000_000, topic
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == recorded, topic


def test_ranges_follow_rep_117(bag: Written) -> None:
    for scan in bag.only("/scan"):
        # A failed beam, one more, something at 4.5 m, and nothing as far as 5 m.
        assert np.array_equal(scan.ranges, np.array([np.nan, np.nan, 4.5, np.inf], np.float32), equal_nan=True)
        assert (scan.angle_min, scan.angle_max) == pytest.approx((-0.3, 0.45), abs=1e-6)
        assert (scan.range_min, scan.range_max) == pytest.approx((0.05, 5.0))


def test_frames_hang_together_as_the_belief_says(bag: Written) -> None:
    (mount,) = bag.only("/tf_static")[0].transforms
    assert (mount.header.frame_id, mount.child_frame_id) == ("base_link", bag.only("/scan")[0].header.frame_id)
    assert planar(mount.transform) == pytest.approx((0.1, -0.2, 0.5))
    by_edge: dict[tuple[str, str], list[Any]] = defaultdict(list)
    for message in bag.only("/tf"):
        (one,) = message.transforms
        by_edge[one.header.frame_id, one.child_frame_id].append(one.transform)
    assert by_edge.keys() == {("map", "odom"), ("odom", "base_link")}
    pairs = zip(by_edge["map", "odom"], by_edge["odom", "base_link"], of(Belief), strict=True)
    for began, driven, belief in pairs:
        assert planar(began) == pytest.approx(BEGAN)
        assert composed(planar(began), planar(driven)) == pytest.approx((belief.x, belief.y, belief.heading))
    for tick, odometry in enumerate(bag.only("/odom")):
        assert planar(odometry.pose.pose) == pytest.approx((0.1 * tick, 0.5, -0.3))
        assert (odometry.twist.twist.linear.x, odometry.twist.twist.angular.z) == (1.0, 0.2)
        assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")


def test_belief_plan_and_truth_are_those_of_the_recording(bag: Written) -> None:
    for told, belief in zip(bag.only("/amcl_pose"), of(Belief), strict=True):
        assert planar(told.pose.pose) == pytest.approx((belief.x, belief.y, belief.heading))
        whole = told.pose.covariance.reshape(6, 6)
        assert whole[np.ix_([0, 1, 5], [0, 1, 5])] == pytest.approx(belief.covariance)
        assert np.count_nonzero(whole) == np.count_nonzero(belief.covariance)
    for path, decision in zip(bag.only("/plan"), of(Decision), strict=True):
        assert [planar(one.pose) for one in path.poses] == [
            pytest.approx(state) for state in zip(decision.x, decision.y, decision.heading, strict=True)
        ]
        due = [one.header.stamp.sec * 10**9 + one.header.stamp.nanosec for one in path.poses]
        first = START_NS + round(1e9 * (decision.stamp + decision.dt))
        assert (due[0], due[1] - due[0]) == (first, round(1e9 * decision.dt))
    for tick, truth in enumerate(bag.only("/ground_truth")):
        # As `drive.status` has it: beside the belief that is not turned here.
        assert planar(truth.pose) == pytest.approx((1.0 + 0.1 * tick, 3.1, 0.25))
    assert [twist.linear.x for twist in bag.only("/cmd_vel")] == [0.2 if tick == 6 else 1.0 for tick in range(TICKS)]


def test_people_are_drawn_where_they_are_and_will_be(bag: Written) -> None:
    for tick, drawn in enumerate(bag.only("/people")):
        people = drive.people(tick)
        clear, *markers = drawn.markers
        assert clear.action == clear.DELETEALL
        bodies = [one for one in markers if one.type == one.CYLINDER]
        assert [one.id for one in bodies] == list(people.id)
        assert [(b.pose.position.x, b.pose.position.y) for b in bodies] == list(zip(people.x, people.y, strict=True))
        assert {(b.scale.x, b.scale.y, b.header.frame_id) for b in bodies} == {(0.5, 0.5, "map")}
        arrows = [one for one in markers if one.type == one.ARROW]
        assert len(arrows) == 5
        for arrow in arrows:
            a, b = arrow.points
            assert (b.x - a.x, b.y - a.y) == pytest.approx((0.1, -0.2))


def test_the_map_is_the_recordings(bag: Written) -> None:
    (grid,) = bag.only("/map")
    ours = drive.grid()
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (80, 50, pytest.approx(0.2))
    assert (grid.data.reshape(50, 80) == ours.cells).all()
    assert planar(grid.info.origin) == pytest.approx((-1.0, -2.0, 0.0))


def test_who_plays_the_bag_latches_map_and_static_transforms(bag: Written) -> None:
    with AnyReader([bag.path]) as reader:
        qos = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}  # type: ignore[union-attr]
    latched = {topic for topic, one in qos.items() if one.durability.name == "TRANSIENT_LOCAL"}
    assert latched == {"/map", "/tf_static"}


def test_what_cannot_become_a_bag_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def refused(*arguments: Any) -> str:
        assert main(["from-recording", *map(str, arguments)]) == 2
        return capsys.readouterr().err

    recording = drive.record(tmp_path / "drive.mcap", sent(), START_NS)
    other = [(key.replace("/robot/robot/", "/robot/r2/"), message) for key, message in sent()]
    two = drive.record(tmp_path / "two.mcap", sent() + other, START_NS)
    empty = drive.record(tmp_path / "empty.mcap", [(keys.robot("robot", "mission"), drive.mission())], START_NS)
    assert "cannot read" in refused(tmp_path / "none.mcap", tmp_path / "bag")
    assert "--robot: r2, robot" in refused(two, tmp_path / "bag")
    assert "nothing that a bag of ROS 2 could hold" in refused(empty, tmp_path / "bag")
    assert not (tmp_path / "bag").exists()
    (tmp_path / "bag").mkdir()
    assert "exists already" in refused(recording, tmp_path / "bag")


# ---- there and back ----


@pytest.mark.live
def test_a_run_that_went_to_a_bag_and_back_is_localised_as_it_was(tmp_path: Path) -> None:
    def run(*arguments: Any) -> str:
        command = [str(program()), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("run", ROOT / "scenarios" / "quickstart.toml", "--record", "drive.mcap")
    bag, log, grid = tmp_path / "bag", tmp_path / "drive.log", tmp_path / "drive.yaml"
    assert main(["from-recording", str(tmp_path / "drive.mcap"), str(bag)]) == 0
    assert main(["to-log", str(bag), str(log)]) == 0
    assert main(["map", str(bag), str(grid)]) == 0
    before = json.loads(run("localize", "drive.mcap", "--json"))
    after = json.loads(run("localize", log, "--map", grid, "--reference", tmp_path / "drive.reference.log", "--json"))
    same = ("scans", "references", "broken_lines", "gaps", "odometry_restarts", "updates")
    assert {name: after[name] for name in same} == {name: before[name] for name in same}
    assert after["length_m"] == pytest.approx(before["length_m"], abs=1e-6)
    # Nothing of this is left to chance.
    for name, error in before["odometry_alone"].items():
        assert after["odometry_alone"][name] == pytest.approx(error, abs=1e-5), name
    # The filter draws particles: a last digit that differs gives others. Seeds differ by as much.
    assert after["localizer"]["median_m"] == pytest.approx(before["localizer"]["median_m"], abs=0.03)
    assert after["localizer"]["greatest_m"] < 0.25
