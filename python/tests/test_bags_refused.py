"""What is wrong with a bag is said by name, with what to do about it."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")

from made_bags import KINDS, START, Maker, Sent, tour

from curionav.bags.__main__ import main
from curionav.bags.bag import BagError
from curionav.bags.robot_log import write_log

ROS2 = Maker("mcap")
DAMAGES = int(os.environ.get("DAMAGES", "20"))


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
