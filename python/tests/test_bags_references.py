"""Where the robot of a bag was on the map stands in a log of its own."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import pytest
from live import program

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")

from bag_logs import lines, references
from made_bags import START, Maker, Sent, placed, tour, where

from curionav.bags.robot_log import write_log
from curionav.bags.topics import Choice

ROS2 = Maker("mcap")


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
