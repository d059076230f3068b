"""Bags of ROS 1 and ROS 2 become logs and maps that say the same."""

from __future__ import annotations

import contextlib
import json
import math
import os
import sqlite3
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from live import program

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")

from made_bags import BOTTOM, KINDS, LEFT, OLD_TF, RIGHT, START, TF, TOP, Maker, Sent, seen

from curionav.array import F64
from curionav.bags.__main__ import main
from curionav.bags.bag import BagError
from curionav.bags.grid import write_map
from curionav.bags.robot_log import write_log
from curionav.bags.topics import Choice

ROS2 = Maker("mcap")
DAMAGES = int(os.environ.get("DAMAGES", "20"))


@dataclass(frozen=True)
class Line:
    """A scan as it stands in a log."""

    stamp: float
    start: float
    step: float
    range_max: float
    ranges: F64
    laser: list[float]
    robot: list[float]

    def points(self) -> F64:
        """Where its beams end in the frame of the robot's pose, shape [beams, 2]."""
        x, y, heading = self.laser
        angles = heading + self.start + self.step * np.arange(len(self.ranges))
        return np.stack([x + self.ranges * np.cos(angles), y + self.ranges * np.sin(angles)], axis=1)


def lines(log: Path) -> list[Line]:
    """The scans of a log, as the Carmen toolkit describes the line."""
    found = []
    for text in log.read_text().splitlines():
        words = text.split()
        assert words[0] == "ROBOTLASER1"
        _, start, fov, step, range_max, _, _, count = map(float, words[1:9])
        ranges = np.array(words[9 : 9 + int(count)], float)
        rest = [float(word) for word in words[9 + int(count) :] if word != "bag"]
        assert fov == pytest.approx(step * (count - 1))
        assert len(rest) == 1 + 6 + 5 + 2
        assert rest[0] == 0.0, "no remissions"
        found.append(Line(rest[-1], start, step, range_max, ranges, rest[1:4], rest[4:7]))
    return found


def references(log: Path) -> list[tuple[float, list[float], list[float]]]:
    """(stamp, pose, pose beside it) of a log of references."""
    rows = [line.split() for line in log.read_text().splitlines()]
    assert {tuple(row[:4]) for row in rows} == {("FLASER", "2", "0", "0")}
    return [(float(row[-1]), [float(w) for w in row[4:7]], [float(w) for w in row[7:10]]) for row in rows]


def tour(make: Maker, *, mount: tuple[float, float, float] = (0.2, -0.1, 0.5)) -> list[Sent]:
    """Three seconds in the room, in a circle of 1 m; odometry comes at 50 Hz, scans at 10 Hz and between its times."""
    sent = [make.mounted(*mount)]
    angles = np.linspace(-2.0, 2.0, 81)
    for tick in range(151):
        sent.append(make.odometry(0.02 * tick, *where(0.02 * tick)))
        if tick % 5 == 2 and tick < 150:
            stamp = 0.02 * tick + 0.013
            x, y, heading = placed(where(stamp), mount)
            ranges = seen(x, y, heading + angles)
            sent.append(make.scan(stamp, ranges, angle_min=-2.0, angle_increment=0.05))
    return sent


def where(stamp: float) -> tuple[float, float, float]:
    """The robot at a time of the tour: its heading passes half a turn at 1.14 s."""
    turn = stamp
    return math.cos(turn), math.sin(turn), math.remainder(turn + 2.0, math.tau)


def placed(outer: tuple[float, float, float], inner: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, h = outer
    c, s = math.cos(h), math.sin(h)
    return x + c * inner[0] - s * inner[1], y + s * inner[0] + c * inner[1], h + inner[2]


def off_the_walls(points: F64) -> float:
    """The greatest distance of points from the walls of the room, m."""
    x, y = points.T
    away = np.min([abs(x - LEFT), abs(x - RIGHT), abs(y - BOTTOM), abs(y - TOP)], axis=0)
    return float(away.max())


def converted(tmp_path: Path, sent: list[Sent], choice: Choice | None = None) -> list[Line]:
    bag = ROS2.write(tmp_path / "bag", sent)
    return lines(write_log(bag, tmp_path / "out.log", choice).log)


# ---- scans and odometry ----


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_of_every_kind_gives_the_same_log(kind: str, tmp_path: Path) -> None:
    make = Maker(kind)
    written = write_log(make.write(tmp_path / "bag", tour(make)), tmp_path / "out.log")
    assert (written.scans, written.scans_left_out, written.references) == (30, 0, 0)
    other = write_log(ROS2.write(tmp_path / "other", tour(ROS2)), tmp_path / "other.log")
    assert written.log.read_bytes() == other.log.read_bytes()
    for line in lines(written.log):
        # Odometry is drawn straight between two poses that are 20 ms apart: (1 rad/s * 0.02 s)^2 / 8 m of 1 m.
        assert line.robot == pytest.approx(where(line.stamp - START), abs=6e-5)
        assert off_the_walls(line.points()) < 3e-4
        assert line.range_max == 12.0


def test_a_file_of_a_bag_is_a_bag(tmp_path: Path) -> None:
    for kind, suffix in (("mcap", ".mcap"), ("sqlite3", ".db3")):
        make = Maker(kind)
        bag = make.write(tmp_path / kind, tour(make))
        (file,) = bag.glob(f"*{suffix}")
        assert write_log(file, tmp_path / f"{kind}.log").scans == 30


def test_a_bag_that_does_not_describe_its_types_is_read(tmp_path: Path) -> None:
    make = Maker("sqlite3")
    bag = make.write(tmp_path / "bag", tour(make))
    (file,) = bag.glob("*.db3")
    # As rosbag2 wrote them until Humble.
    with contextlib.closing(sqlite3.connect(file)) as database, database:
        assert database.execute("DELETE FROM message_definitions").rowcount > 0
    assert write_log(bag, tmp_path / "out.log").scans == 30


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("roll", [0.0, math.pi])
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_a_scan_meets_the_walls_however_its_scanner_hangs(
    clockwise: bool, roll: float, yaw: float, tmp_path: Path
) -> None:
    # On a mast on the robot. Yaw after roll: the quaternion product of both.
    c, s = math.cos(yaw / 2), math.sin(yaw / 2)
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    rotation = ROS2.quaternion(x=c * sr, y=s * sr, z=s * cr, w=c * cr)
    angles = np.linspace(-1.2, 2.0, 41)[:: -1 if clockwise else 1]
    x, y, heading = placed(placed((1.0, 0.5, 0.3), (0.1, 0.0, 0.2)), (0.3, -0.2, yaw))
    ranges = seen(x, y, heading + (-angles if roll else angles))
    sent = [
        ROS2.transform(0.0, "base_link", "mast", 0.1, 0.0, ROS2.turned(0.2), topic="/tf_static"),
        # As ROS 1 says what does not move: again and again, and ahead of time.
        *(ROS2.transform(k + 0.5, "mast", "laser", 0.3, -0.2, rotation) for k in range(2)),
        ROS2.odometry(0.0, 1.0, 0.5, 0.3),
        ROS2.scan(0.0, ranges, angle_min=angles[0], angle_increment=angles[1] - angles[0]),
    ]
    (line,) = converted(tmp_path, sent)
    assert line.step == pytest.approx(3.2 / 40, abs=1e-6)
    assert line.laser[:2] == pytest.approx([x, y], abs=1e-6)
    assert off_the_walls(line.points()) < 1e-5
    # The nearest wall differs from beam to beam: a mirrored scan would not meet them.
    mirrored = Line(0.0, line.start, line.step, 0.0, line.ranges[::-1], line.laser, line.robot)
    assert off_the_walls(mirrored.points()) > 0.5


def test_ranges_mean_what_they_mean_everywhere(tmp_path: Path) -> None:
    nan, inf = math.nan, math.inf
    ranges = [nan, 0.0, -inf, 0.05, 0.1, 3.25, 11.99, 12.0, 60.0, inf]
    (line,) = converted(tmp_path, [ROS2.mounted(0, 0, 0), ROS2.odometry(0, 0, 0, 0), ROS2.scan(0, ranges)])
    told = [0.0, 0.0, 0.1, 0.1, 0.1, 3.25, 11.99, 12.0, 12.0, 12.0]
    assert list(line.ranges) == pytest.approx(told, abs=1e-6)
    # So that a reader who compares with the greatest range finds that nothing was met.
    assert list(line.ranges[7:]) == [line.range_max] * 3


def test_beams_beyond_a_turn_and_beyond_what_is_read_are_left_out(tmp_path: Path) -> None:
    degree, fine = math.radians(1.0), math.tau / 20_000
    sent = [
        ROS2.mounted(0, 0, 0),
        ROS2.odometry(0, 0, 0, 0),
        ROS2.scan(0.0, np.full(361, 2.0), angle_min=-math.pi, angle_increment=degree),
        ROS2.scan(0.1, 1.0 + 1e-4 * np.arange(20_000), angle_min=-math.pi, angle_increment=fine),
    ]
    turn, many = converted(tmp_path, sent)
    assert len(turn.ranges) == 360
    # Every third of 20,000.
    assert len(many.ranges) == 6667
    assert many.step == pytest.approx(3 * fine)
    assert list(many.ranges[:3]) == pytest.approx([1.0, 1.0003, 1.0006], abs=1e-6)


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"angle_increment": 0.0}, "no sweep"),
        ({"angle_increment": math.nan}, "no scanner"),
        ({"range_max": 0.05}, "no scanner"),
    ],
)
def test_a_scan_that_is_none_is_refused_and_leaves_no_log(fields: dict[str, Any], why: str, tmp_path: Path) -> None:
    good = [ROS2.mounted(0, 0, 0), ROS2.odometry(0, 0, 0, 0), ROS2.scan(0, [1.0, 2.0])]
    with pytest.raises(BagError, match=rf"1700000000\.100.*{why}"):
        converted(tmp_path, [*good, ROS2.scan(0.1, [1.0, 2.0], **fields)])
    assert not list(tmp_path.glob("*.log*"))


def test_a_scan_without_odometry_of_its_time_is_left_out_and_counted(tmp_path: Path) -> None:
    poses = [ROS2.odometry(0.0, 0, 0, 0), ROS2.odometry(0.8, 0.8, 0, 0), ROS2.odometry(5.0, 2.0, 0, 0)]
    scans = [ROS2.scan(stamp, [1.0, 2.0]) for stamp in (-2.0, -0.5, 0.4, 2.0, 5.5, 7.0)]
    written = write_log(ROS2.write(tmp_path / "bag", [ROS2.mounted(0, 0, 0), *poses, *scans]), tmp_path / "out.log")
    assert (written.scans, written.scans_left_out) == (3, 3)
    assert [line.robot[0] for line in lines(written.log)] == pytest.approx([0.0, 0.4, 2.0])


def test_what_comes_after_the_clock_was_set_back_is_left_out(tmp_path: Path) -> None:
    # The first odometry after the end of the tour is of the second drive, and elsewhere.
    elsewhere = [ROS2.odometry(0.5 * k, 50.0, 0.0, 0.0) for k in range(8)]
    sent = [*tour(ROS2), ROS2.scan(3.2, [1.0, 2.0]), *elsewhere, ROS2.scan(0.5, [1.0, 2.0])]
    written = write_log(ROS2.write(tmp_path / "bag", sent), tmp_path / "out.log")
    assert written.scans == 31
    assert lines(written.log)[-1].robot == pytest.approx(where(3.0), abs=1e-8)
    assert written.notes == [
        "odometry from when its clock was set back",
        "scans after 1700000003.200 s, when the clock was set back",
    ]


def test_transforms_of_the_time_before_tf2_are_read(tmp_path: Path) -> None:
    make = Maker("ros1")
    old = [replace(one, kind=OLD_TF) if one.kind == TF else one for one in tour(make)]
    (line, *_) = lines(write_log(make.write(tmp_path / "old", old), tmp_path / "out.log").log)
    assert line.laser[:2] == pytest.approx(placed(where(line.stamp - START), (0.2, -0.1, 0.5))[:2], abs=6e-5)


def test_odometry_comes_from_transforms_where_no_topic_has_it(tmp_path: Path) -> None:
    topic = tour(ROS2)
    driven = []
    for one in topic:
        if one.topic == "/odom":
            x, y, heading = where(one.stamp)
            driven.append(ROS2.transform(one.stamp, "odom", "base_link", x, y, ROS2.turned(heading)))
    (tmp_path / "tf").mkdir()
    expected = converted(tmp_path, topic)
    found = converted(tmp_path / "tf", [one for one in topic if one.topic != "/odom"] + driven)
    assert len(found) == 30
    for a, b in zip(expected, found, strict=True):
        assert a.robot == pytest.approx(b.robot, abs=1e-8)
        assert a.laser == pytest.approx(b.laser, abs=1e-8)


def test_a_scanner_is_where_the_option_says_without_transforms(tmp_path: Path) -> None:
    sent = [ROS2.odometry(0, 1.0, 2.0, math.pi / 2), ROS2.scan(0, [1.0, 2.0])]
    bag, log = ROS2.write(tmp_path / "bag", sent), tmp_path / "out.log"
    assert main(["to-log", str(bag), str(log), "--laser", "0.5,0.25,0.1"]) == 0
    assert lines(log)[0].laser == pytest.approx([0.75, 2.5, math.pi / 2 + 0.1], abs=1e-8)


def test_odometry_that_is_no_number_is_passed_over(tmp_path: Path) -> None:
    poses = [ROS2.odometry(0.1 * k, math.nan if k == 1 else 0.1 * k, 0, 0) for k in range(3)]
    (line,) = converted(tmp_path, [ROS2.mounted(0, 0, 0), *poses, ROS2.scan(0.1, [1.0, 2.0])])
    assert line.robot == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)


# ---- references ----


def refer(tmp_path: Path, sent: list[Sent], choice: Choice | None = None) -> Any:
    written = write_log(ROS2.write(tmp_path / "bag", sent), tmp_path / "out.log", choice)
    assert written.reference_log is not None
    assert written.reference_log.name == "out.reference.log"
    found = references(written.reference_log)
    assert [stamp for stamp, _, _ in found] == [line.stamp for line in lines(written.log)]
    return written, found


def test_references_come_from_map_to_odometry(tmp_path: Path) -> None:
    # Odometry began at (3, 1), turned by half a right angle.
    began = (3.0, 1.0, math.pi / 4)
    corrections = [ROS2.transform(0.1 * k, "map", "odom", *began[:2], ROS2.turned(began[2])) for k in range(31)]
    written, found = refer(tmp_path, tour(ROS2) + corrections)
    assert written.reference_from == "transforms from `map` to `odom`"
    for stamp, pose, _ in found:
        x, y, heading = placed(began, where(stamp - START))
        # As near as odometry between its messages.
        assert pose[:2] == pytest.approx([x, y], abs=2e-4)
        assert math.remainder(pose[2] - heading, math.tau) == pytest.approx(0.0, abs=2e-4)


def test_ground_truth_goes_before_transforms_and_a_goal_is_no_reference(tmp_path: Path) -> None:
    others = [ROS2.transform(0.1 * k, "map", "odom", 9.0, 9.0, ROS2.turned(0.0)) for k in range(31)]
    others.append(ROS2.pose_stamped(0.5, 50.0, 50.0, 0.0, "/goal_pose"))
    truth = [ROS2.pose_stamped(0.1 * k, *placed((1.0, 0.0, 0.0), where(0.1 * k)), "/ground_truth") for k in range(31)]
    written, found = refer(tmp_path, tour(ROS2) + others + truth)
    assert written.reference_from == "`/ground_truth`"
    assert found[3][1][0] == pytest.approx(1.0 + where(found[3][0] - START)[0], abs=2e-4)


def test_odometry_carries_a_rare_reference_on_but_not_for_long(tmp_path: Path) -> None:
    poses = [ROS2.odometry(0.5 * k, 0.5 * k, 0.0, 0.0) for k in range(13)]
    scans = [ROS2.scan(0.5 * k, [1.0, 2.0]) for k in range(13)]
    believed = ROS2.believed(1.0, 7.0, 8.0, math.pi / 2)
    sent = [ROS2.mounted(0, 0, 0), *poses, *scans, believed]
    written = write_log(ROS2.write(tmp_path / "bag", sent), tmp_path / "out.log")
    assert written.reference_log is not None
    found = {round(stamp - START, 3): pose for stamp, pose, _ in references(written.reference_log)}
    assert written.reference_from == "`/amcl_pose`"
    # It drives ahead, which is along y on the map.
    assert sorted(found) == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    assert found[0.0] == pytest.approx([7.0, 7.0, math.pi / 2])
    assert found[3.0] == pytest.approx([7.0, 10.0, math.pi / 2])


@pytest.mark.parametrize(("drift", "beside"), [(0.29, 3.29), (0.31, 3.0)])
def test_a_reference_that_stays_with_odometry_stands_twice(drift: float, beside: float, tmp_path: Path) -> None:
    poses = [ROS2.odometry(stamp, stamp, 0.0, 0.0) for stamp in (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)]
    truth = [ROS2.pose_stamped(s, s + drift * s / 3.0, 0.0, 0.0, "/ground_truth") for s in (0.0, 1.5, 3.0)]
    scans = [ROS2.scan(stamp, [1.0, 2.0]) for stamp in (0.0, 1.5, 3.0)]
    _, found = refer(tmp_path, [ROS2.mounted(0, 0, 0), *poses, *truth, *scans])
    assert found[-1][1][0] == pytest.approx(3.0 + drift)
    assert found[-1][2][0] == pytest.approx(beside)


def test_an_earlier_reference_does_not_stay_beside_a_log_without_one(tmp_path: Path) -> None:
    bag = ROS2.write(tmp_path / "bag", [*tour(ROS2), ROS2.believed(1.0, 1.0, 0.0, 0.0)])
    assert write_log(bag, tmp_path / "out.log").reference_log is not None
    assert write_log(bag, tmp_path / "out.log", Choice(reference="none")).reference_log is None
    assert not (tmp_path / "out.reference.log").exists()


# ---- what is refused ----


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main([str(argument) for argument in arguments]) == 2
    return capsys.readouterr().err


def test_an_error_says_what_the_bag_has_and_what_to_write(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "out.log"

    def told(name: str, sent: list[Sent], *options: str) -> str:
        return refused(capsys, "to-log", ROS2.write(tmp_path / name, sent), log, *options)

    scan, pose, mount = ROS2.scan(0, [1.0, 2.0]), ROS2.odometry(0, 0, 0, 0), ROS2.mounted(0, 0, 0)
    assert "no topic has scans; the bag has /odom (nav_msgs/Odometry)" in told("a", [pose])
    assert "no topic has odometry; the bag has /scan (sensor_msgs/LaserScan)" in told("b", [scan])
    front, rear = (ROS2.scan(0, [1.0, 2.0], topic=topic) for topic in ("/front", "/rear"))
    assert "choose with --scan: /front, /rear" in told("c", [front, rear, pose, mount])
    assert "no topic `/sacn` of sensor_msgs/LaserScan; the bag has" in told("d", [scan, pose], "--scan", "/sacn")
    assert "join the scanner `laser` to the robot `base_link`; give --laser" in told("e", [scan, pose])
    assert "transforms: base_link -> laser" in told("f", [scan, mount], "--odom", "/tf")
    assert "where the robot is in `map`" in told("g", [scan, pose, mount], "--reference", "/tf")
    leans = ROS2.transform(0, "base_link", "laser", 0, 0, ROS2.quaternion(x=0.2, w=math.sqrt(0.96)))
    assert "leans" in told("h", [scan, pose, leans])
    turns = [ROS2.transform(k, "base_link", "laser", 0, 0, ROS2.turned(0.1 * k)) for k in range(2)]
    assert "moves on the robot" in told("i", [scan, pose, *turns])
    timeless = ROS2.scan(-START, [1.0, 2.0])
    assert "no time in their headers" in told("j", [timeless, timeless, pose, mount])
    assert "no topic has a map" in refused(capsys, "map", tmp_path / "a", tmp_path / "map.yaml")
    assert not log.exists()


def test_what_is_no_bag_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "out.log"
    assert "there is no bag" in refused(capsys, "to-log", tmp_path / "none", log)
    assert "there is no bag" in refused(capsys, "to-log", tmp_path, log)
    for name in ("text.bag", "text.mcap", "text.db3", "text.txt"):
        file = tmp_path / name
        file.write_text("no bag at all, but long enough to be looked at\n" * 20)
        assert f"{name}: it cannot be read as a bag" in refused(capsys, "to-log", file, log)
    make = Maker("ros1")
    bag = make.write(tmp_path / "cut", tour(make))
    bag.write_bytes(bag.read_bytes()[: bag.stat().st_size // 2])
    assert "cut.bag" in refused(capsys, "to-log", bag, log)


def test_without_its_packages_the_command_says_what_to_install() -> None:
    code = """
import runpy, sys
sys.modules["rosbags"] = None
sys.argv = ["bags", "map", "a.bag", "a.yaml"]
runpy.run_module("curionav.bags", run_name="__main__")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 3, done.stderr
    assert done.stderr == "not installed: rosbags; `pip install rosbags` brings them\n"


@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_bag_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    make = Maker(kind)
    bag = make.write(tmp_path / "bag", [one for one in tour(make) if one.stamp < 0.5])
    (file,) = [bag] if bag.is_file() else [one for one in bag.iterdir() if one.suffix in (".mcap", ".db3")]
    whole = file.read_bytes()
    outcomes = set()
    for seed in range(DAMAGES):
        print(f"seed {seed}")  # noqa: T201 - shown if it fails
        rng = np.random.default_rng(seed)
        damaged = bytearray(whole)
        for place in rng.integers(0, len(whole), 20):
            damaged[place] = rng.integers(256)
        file.write_bytes(damaged)
        try:
            outcomes.add(write_log(bag, tmp_path / "out.log").scans > 0)
        except BagError:
            outcomes.add(False)
    assert False in outcomes


# ---- maps ----


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_map_has_the_cells_of_the_bag(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make = Maker(kind)
    # The row of least y first; the image has it last.
    cells = np.array([[-1, 0, 25, 26], [64, 65, 100, -1]])
    bag = make.write(tmp_path / "bag", [make.grid(cells, 0.05, -1.5, 2.0, 0.3)])
    assert main(["map", str(bag), str(tmp_path / "maps" / "floor.yaml")]) == 0
    assert "4 x 2 cells of 0.05 m, from `/map`" in capsys.readouterr().out
    described = yaml.safe_load((tmp_path / "maps" / "floor.yaml").read_text())
    assert (described["resolution"], described["image"], described["negate"]) == (0.05, "floor.pgm", 0)
    assert described["origin"] == pytest.approx([-1.5, 2.0, 0.3])
    image = (tmp_path / "maps" / "floor.pgm").read_bytes()
    assert image == b"P5\n4 2\n255\n" + bytes([205, 0, 0, 205, 205, 254, 254, 205])


def test_a_map_of_too_few_cells_is_refused(tmp_path: Path) -> None:
    sent = ROS2.grid(np.zeros((2, 3)), 0.05, 0.0, 0.0, 0.0)
    sent.message.data = sent.message.data[:-1]
    with pytest.raises(BagError, match=r"3 x 2 cells of .* 5 values"):
        write_map(ROS2.write(tmp_path / "bag", [sent]), tmp_path / "map.yaml")


# ---- the program reads it ----


@pytest.mark.live
def test_the_localiser_finds_the_robot_of_a_bag_on_the_map_built_of_it(tmp_path: Path) -> None:
    truth = [ROS2.pose_stamped(0.1 * k, *placed((3.0, 1.0, 0.5), where(0.1 * k)), "/ground_truth") for k in range(31)]
    log = write_log(ROS2.write(tmp_path / "bag", tour(ROS2) + truth), tmp_path / "out.log")
    common = [log.log, "--reference", log.reference_log]

    def run(*arguments: Any) -> str:
        command = [str(program()), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run("map", "build", *common, "--out", "map.yaml")
    found = json.loads(run("localize", *common, "--map", "map.yaml", "--json"))
    assert (found["scans"], found["references"], found["broken_lines"]) == (30, 30, 0)
    # 3 s on a circle of 1 m, less the ends: 29 gaps of 0.1 s.
    assert found["length_m"] == pytest.approx(2.9, abs=0.01)
    assert found["odometry_alone"]["greatest_m"] < 1e-3
    assert found["localizer"]["greatest_m"] < 0.1
