"""Tracks of robot and people in the files of other programs, and back."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT, golden
from live import program

import curionav.trajectories as tr
from curionav import IncompleteResult, Result
from curionav.array import F64
from curionav.messages import Mission, OccupancyGrid, PeopleTrace, Pose, RunResult
from curionav.trajectories import Tracks
from curionav.trajectories.__main__ import main
from curionav.trajectories.socnav import walls

TICKS = 101


def grid(cells: list[list[int]], origin: Pose) -> OccupancyGrid:
    values = np.array(cells, np.int8)
    height, width = values.shape
    return OccupancyGrid(width=width, height=height, resolution=0.5, origin=origin, cells=values, map=bytes(32))


@pytest.fixture
def result() -> Result:
    """Ten seconds at 10 Hz: the robot goes along x at 1 m/s, person 3 up along y at 0.5 m/s, person 8 stands and leaves
    after 2 s."""
    time_s: F64 = np.linspace(0.0, 10.0, TICKS)
    xy = np.zeros((TICKS, 2, 2), np.float32)
    xy[:, 0, 0], xy[:, 0, 1] = 5.0, 0.5 * time_s
    xy[:, 1] = (1.25, -2.0)
    present = np.ones((TICKS, 2), np.uint8)
    present[21:, 1] = 0
    zeros, ones = np.zeros(TICKS), np.ones(TICKS)
    trace = {"time_s": time_s, "true_x": time_s, "true_y": zeros, "true_heading": zeros, "v": ones, "omega": zeros}
    return dataclasses.replace(
        Result.of(RunResult.decode(golden("run_result"))),
        trace=trace,
        people=PeopleTrace(rows=TICKS, id=np.array([3, 8], np.uint32), xy=xy, present=present),
        order=Mission.decode(golden("mission")).order,
        grid=grid([[0, 100], [-1, 0]], Pose(x=1.0, y=2.0, heading=0.0)),
    )


def rows(tracks: Tracks) -> set[tuple[int, int, float, float]]:
    columns = (tracks.id, tracks.frame, tracks.x.round(3), tracks.y.round(3))
    return set(zip(*(column.tolist() for column in columns), strict=True))


def test_a_run_is_a_row_for_each_tick_of_the_robot_and_of_people_who_are_there(result: Result) -> None:
    tracks = tr.from_result(result)
    assert tracks.frame_rate == 10.0
    assert tracks.robot == 9
    assert [(tracks.id == one).sum() for one in (3, 8, 9)] == [101, 21, 101]
    assert {(9, 30, 3.0, 0.0), (3, 30, 5.0, 1.5), (8, 20, 1.25, -2.0)} <= rows(tracks)
    assert tracks.time_s.max() == pytest.approx(10.0)
    assert set(tracks.people().id.tolist()) == {3, 8}


def test_people_look_where_they_walk_and_the_standing_along_x(result: Result) -> None:
    tracks = tr.from_result(result)
    headings = tracks.headings()
    # Also at first, before the first step.
    assert headings[tracks.id == 3] == pytest.approx(np.pi / 2)
    assert (headings[tracks.id == 8] == 0.0).all()


ROUND_TRIPS: list[tuple[Callable[[Tracks, Path], Any], Callable[[Path], Tracks], str]] = [
    (tr.write_pedpy, tr.read_pedpy, "t.txt"),
    (lambda tracks, file: tr.write_trajnet(dataclasses.replace(tracks, frame_rate=2.5), file), tr.read_trajnet, "t.nd"),
]


@pytest.mark.parametrize(("write", "read", "name"), ROUND_TRIPS)
def test_what_is_written_is_read_again(
    result: Result, tmp_path: Path, write: Callable[..., Any], read: Callable[..., Tracks], name: str
) -> None:
    tracks = tr.from_result(result)
    write(tracks, tmp_path / name)
    assert rows(read(tmp_path / name)) == rows(tracks)


def test_pedpys_file_says_rate_unit_and_robot(result: Result, tmp_path: Path) -> None:
    tr.write_pedpy(tr.from_result(result), tmp_path / "t.txt")
    lines = (tmp_path / "t.txt").read_text().splitlines()
    assert lines[:5] == [
        "# framerate: 10 fps", "# robot: id 9", "# id frame x/m y/m", "3 0 5.0000 0.0000", "8 0 1.2500 -2.0000",
    ]  # fmt: skip
    assert tr.read_pedpy(tmp_path / "t.txt").robot == 9


def test_pedpy_itself_reads_what_is_written(result: Result, tmp_path: Path) -> None:
    pedpy = pytest.importorskip("pedpy", reason="PedPy is not installed: pip install pedpy")
    tr.write_pedpy(tr.from_result(result), tmp_path / "t.txt")
    data = pedpy.load_trajectory(trajectory_file=tmp_path / "t.txt")
    assert data.frame_rate == 10.0
    speed = pedpy.compute_individual_speed(
        traj_data=data, frame_step=5, speed_calculation=pedpy.SpeedCalculation.BORDER_SINGLE_SIDED
    )
    mean = speed.groupby("id")["speed"].mean()
    assert mean.to_dict() == pytest.approx({3: 0.5, 8: 0.0, 9: 1.0}, abs=1e-3)


def test_centimetres_and_a_rate_from_outside_are_read(tmp_path: Path) -> None:
    file = tmp_path / "t.txt"
    file.write_text("#framerate: 25.00\n# id frame x/cm y/cm z/cm\n1\t0 100 -250 170\n\n1 1 104 -250 170\n")
    assert rows(tr.read_pedpy(file)) == {(1, 0, 1.0, -2.5), (1, 1, 1.04, -2.5)}
    file.write_text("1 0 100 -250\n")
    assert tr.read_pedpy(file, 16.0, "cm").frame_rate == 16.0


def test_trajnets_rows_are_two_and_a_half_per_second(result: Result, tmp_path: Path) -> None:
    file = tmp_path / "t.ndjson"
    tr.write_trajnet(tr.from_result(result), file)
    entries = [json.loads(line) for line in file.read_text().splitlines()]
    scenes = [entry["scene"] for entry in entries if "scene" in entry]
    # 26 rows of the robot, every fourth tick: scenes of 21 rows begin with row 0 and row 3.
    assert scenes[0] == {"id": 0, "p": 9, "s": 0, "e": 80, "fps": 2.5, "tag": 0}
    assert [(scene["s"], scene["e"]) for scene in scenes] == [(0, 80), (12, 92)]
    assert {"track": {"f": 40, "p": 3, "x": 5.0, "y": 2.0}} in entries
    again = tr.read_trajnet(file)
    assert again.frame_rate == 10.0
    assert rows(again) == {row for row in rows(tr.from_result(result)) if row[1] % 4 == 0}


def test_no_scene_of_trajnet_spans_an_absence(tmp_path: Path) -> None:
    frame = np.array([*range(25), *range(40, 66)])
    tracks = Tracks(2.5, np.ones(51, np.int64), frame, np.zeros(51), np.zeros(51))
    tr.write_trajnet(tracks, tmp_path / "t.ndjson")
    entries = [json.loads(line) for line in (tmp_path / "t.ndjson").read_text().splitlines()]
    scenes = [(e["scene"]["s"], e["scene"]["e"]) for e in entries if "scene" in e]
    # Rows 0, 3, 27, 30 of 51 begin scenes without an absence, and row 24 + 1 is frame 40.
    assert scenes == [(0, 20), (3, 23), (42, 62), (45, 65)]


def test_predictions_of_trajnet_are_no_tracks(tmp_path: Path) -> None:
    file = tmp_path / "t.ndjson"
    track = {"f": 10, "p": 1, "x": 1.0, "y": 2.0}
    lines = [{"scene": {"id": 0, "p": 1, "s": 0, "e": 10, "fps": 2.5}}, {"track": {**track, "f": 0}}, {"track": track}]
    predicted = {"track": {**track, "prediction_number": 0, "scene_id": 0}}
    file.write_text("\n".join(map(json.dumps, [*lines, predicted])))
    tracks = tr.read_trajnet(file)
    # 2.5 rows per second, 10 frames from row to row.
    assert tracks.frame_rate == 25.0
    assert rows(tracks) == {(1, 0, 1.0, 2.0), (1, 10, 1.0, 2.0)}


def test_socnavs_file_has_poses_goal_map_and_walls(result: Result, tmp_path: Path) -> None:
    tr.write_socnav(result, tmp_path / "t.json", "A robot brings coffee.")
    data = json.loads((tmp_path / "t.json").read_text())
    assert data["metadata"] == "A robot brings coffee."
    assert len(data["sequence"]) == TICKS
    entry = data["sequence"][30]
    assert entry["timestamp"] == pytest.approx(3.0)
    assert entry["robot"]["x"] == pytest.approx(3.0)
    # The polygon of the golden mission is 0.6 m long and 0.4 m wide.
    assert entry["robot"]["shape"] == pytest.approx({"type": "rectangle", "width": 0.4, "length": 0.6})
    assert entry["people"] == [{"id": 3, "x": 5.0, "y": 1.5, "angle": 1.5708}]
    assert (entry["goal"]["x"], entry["goal"]["type"], entry["goal"]["human"]) == (8.0, "go-to", None)
    # The row of greatest y comes first.
    assert data["grid"]["data"] == [[-1, 0], [0, 1]]
    assert (data["grid"]["x_orig"], data["grid"]["cell_size"]) == (1.0, 0.5)
    assert len(data["walls"]) == 4
    again = tr.read_socnav(tmp_path / "t.json")
    assert again.robot == 9
    assert again.frame_rate == 10.0
    assert rows(again) == rows(tr.from_result(result))


@pytest.mark.parametrize("missing", [{"order": None}, {"grid": None}, {"trace": {}}])
def test_what_an_export_lacks_is_told(result: Result, tmp_path: Path, missing: dict[str, Any]) -> None:
    with pytest.raises(IncompleteResult, match="load"):
        tr.write_socnav(dataclasses.replace(result, **missing), tmp_path / "t.json")


def test_walls_are_the_edges_of_occupied_cells_in_one_piece_each() -> None:
    found = walls(grid([[0, 100, 100], [0, 0, -1]], Pose(x=1.0, y=2.0, heading=0.0)))
    expected = [[1.5, 2.0, 2.5, 2.0], [1.5, 2.5, 2.5, 2.5], [1.5, 2.0, 1.5, 2.5], [2.5, 2.0, 2.5, 2.5]]
    assert sorted(found.tolist()) == sorted(expected)
    # A quarter turn about the origin: what was right of it is above it now.
    turned = walls(grid([[0, 100]], Pose(x=1.0, y=2.0, heading=np.pi / 2)))
    assert [1.0, 2.5, 1.0, 3.0] in turned.round(9).tolist()
    # Two cells that touch at a corner have four edges each.
    assert len(walls(grid([[100, 0], [0, 100]], Pose(x=0.0, y=0.0, heading=0.0)))) == 8


def test_uneven_times_of_socnav_are_interpolated_but_not_over_an_absence(tmp_path: Path) -> None:
    times, xs = [10.0, 10.1, 10.25, 10.3, 10.4], [0.0, 0.1, 0.25, 0.3, 0.4]
    sequence = [
        {"timestamp": t, "robot": {"x": x, "y": 0.0}, "people": [] if t > 10.28 else [{"id": 2, "x": 2 * x, "y": 1.0}]}
        for t, x in zip(times, xs, strict=True)
    ]
    file = tmp_path / "t.json"
    file.write_text(json.dumps({"sequence": sequence}))
    tracks = tr.read_socnav(file)
    assert tracks.frame_rate == 10.0
    robot = {(3, frame, frame / 10, 0.0) for frame in range(5)}
    assert rows(tracks) == robot | {(2, 0, 0.0, 1.0), (2, 1, 0.2, 1.0), (2, 2, 0.4, 1.0)}


@pytest.mark.live
def test_people_of_a_run_are_played_again_from_every_format(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mcap", reason="pip install './python[frames]'")
    recording, quickstart = tmp_path / "run.mcap", ROOT / "scenarios" / "quickstart.toml"

    def run(*arguments: str | Path) -> None:
        subprocess.run([program(), "run", *arguments], capture_output=True, timeout=120, check=True)

    run(quickstart, "--record", recording)
    whole = tr.from_result(Result.load(recording))
    played = {}
    for form, name in (("pedpy", "a.txt"), ("trajnet", "a.ndjson"), ("socnav", "a.json")):
        assert main([str(recording), str(tmp_path / name), "--format", form]) == 0
        assert main([str(tmp_path / name), str(tmp_path / f"{form}.txt"), "--format", "recorded"]) == 0
        played[form] = capsys.readouterr().out
    assert played["pedpy"] == '[[recorded]]\nfile = "pedpy.txt"\nformat = "text"\nfps = 10\n'
    assert (tmp_path / "socnav.txt").read_text() == (tmp_path / "pedpy.txt").read_text()
    # Without the walkers, their recording in their place.
    head, *_ = quickstart.read_text().partition("[[walkers]]")
    head = head.replace('"maps/', f'"{ROOT.as_posix()}/scenarios/maps/')
    (tmp_path / "again.toml").write_text(head + played["pedpy"])
    run(tmp_path / "again.toml", "--record", tmp_path / "again.mcap")
    again = tr.from_result(Result.load(tmp_path / "again.mcap"))
    first, second = ({row[:2]: row[2:] for row in rows(tracks.people())} for tracks in (whole, again))
    both = first.keys() & second.keys()
    assert len(both) > 300
    assert max(np.hypot(*np.subtract(first[key], second[key])) for key in both) < 2e-3
