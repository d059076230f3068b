"""A bag of ROS 1 or ROS 2 becomes a log and a map that say the same."""

from __future__ import annotations

import contextlib
import math
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")

from bag_logs import Line, lines
from made_bags import BOTTOM, KINDS, LEFT, OLD_TF, RIGHT, START, TF, TOP, Maker, Sent, placed, seen, tour, where

from curionav.array import F64
from curionav.bags.__main__ import main
from curionav.bags.bag import BagError
from curionav.bags.grid import write_map
from curionav.bags.robot_log import write_log
from curionav.bags.topics import Choice

ROS2 = Maker("mcap")


def off_the_walls(points: F64) -> float:
    """The greatest distance of points from the walls of the room, m."""
    x, y = points.T
    away = np.min([abs(x - LEFT), abs(x - RIGHT), abs(y - BOTTOM), abs(y - TOP)], axis=0)
    return float(away.max())


def converted(tmp_path: Path, sent: list[Sent], choice: Choice | None = None) -> list[Line]:
    bag = ROS2.write(tmp_path / "bag", sent)
    return lines(write_log(bag, tmp_path / "out.log", choice).log)


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
