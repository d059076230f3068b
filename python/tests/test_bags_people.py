"""People who are annotated in a bag become a table that `curionav track` reads."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("rosbags", reason="no rosbags; pip install './python[test]'")

from made_bags import KINDS, START, STORES, Maker, Sent
from rosbags.typesys import get_types_from_msg

from curionav.bags.__main__ import main
from curionav.bags.annotations import write_people
from curionav.bags.bag import PERSON, BagError

TOPIC = "/ground_truth_people_tracks"
for _store in STORES.values():
    _store.register(get_types_from_msg("geometry_msgs/Pose pose\nuint32 id", PERSON))


def person(make: Maker, stamp: float, x: float, y: float, number: int) -> Sent:
    """An annotation in the frame of the scanner, which is recorded at this time."""
    return Sent(TOPIC, PERSON, stamp, make.new(PERSON, pose=make.pose(x, y, 0.0), id=number))


def annotated(make: Maker, mount: Sent) -> list[Sent]:
    """Three scans. One person is annotated too early, two after the first scan and one after the last."""
    odometry = [make.odometry(0.1 * k, 0.0, 0.0, 0.0) for k in range(4)]
    scans = [make.scan(0.1 * k, [1.0, 2.0]) for k in range(3)]
    people = [person(make, 0.0, 9.0, 9.0, 1)]
    people += [person(make, 0.02, 1.0, 2.0, 1), person(make, 0.03, 3.0, 0.5, 4), person(make, 0.22, -1.0, 0.0, 4)]
    return [mount, *odometry, people[0], scans[0], *people[1:3], *scans[1:], people[3]]


@pytest.mark.parametrize("kind", KINDS)
def test_an_annotation_is_of_the_scan_before_it_and_stands_in_the_frame_of_the_robot(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make = Maker(kind)
    # The scanner looks to the left, 0.5 m ahead of the robot: (x, y) of it is (0.5 - y, x) of the robot.
    bag = make.write(tmp_path / "bag", annotated(make, make.mounted(0.5, 0.0, 1.5707963267948966)))
    table = tmp_path / "new" / "people.csv"
    assert main(["people", str(bag), str(table)]) == 0
    assert table.read_text("ascii").splitlines() == [
        "stamp_s,x,y,id",
        f"{START:.6f},-1.5000,1.0000,1",
        f"{START:.6f},0.0000,3.0000,4",
        f"{START + 0.2:.6f},0.5000,-1.0000,4",
    ]
    told = capsys.readouterr().out
    assert "3 people in 2 scans" in told
    assert "left out: 1 annotations before the first scan" in told


def test_what_a_hanging_scanner_sees_to_its_left_is_to_the_robots_right(tmp_path: Path) -> None:
    make = Maker("mcap")
    hanging = make.transform(0.0, "base_link", "laser", 0.0, 0.0, make.quaternion(x=1.0, w=0.0), topic="/tf_static")
    bag = make.write(tmp_path / "bag", annotated(make, hanging))
    table = tmp_path / "people.csv"
    assert main(["people", str(bag), str(table)]) == 0
    assert table.read_text("ascii").splitlines()[1] == f"{START:.6f},1.0000,-2.0000,1"


def test_a_bag_without_annotations_is_told_with_what_it_has(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    make = Maker("mcap")
    bag = make.write(tmp_path / "bag", [one for one in annotated(make, make.mounted(0, 0, 0)) if one.kind != PERSON])
    table = tmp_path / "people.csv"
    assert main(["people", str(bag), str(table)]) == 2
    error = capsys.readouterr().err
    assert "no topic has annotated people (leg_tracker/Person); the bag has /odom (nav_msgs/Odometry)" in error
    assert not table.exists()
    early = make.write(tmp_path / "early", annotated(make, make.mounted(0, 0, 0))[:7])
    with pytest.raises(BagError, match="comes after a scan"):
        write_people(early, table)
