"""What the viewer draws, from messages, recordings and a live deployment."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import RUN_TIMEOUT, deployment, hall

rr = pytest.importorskip("rerun", reason="no rerun-sdk; pip install './python[viewer]'")
pytest.importorskip("mcap", reason="no mcap; pip install './python[viewer]'")

import drive  # noqa: E402
from rerun.chunk import RrdReader  # noqa: E402

import curionav  # noqa: E402
from curionav import Scenario, recording  # noqa: E402
from curionav.messages import Belief, CycleReport, LaserModel, Message, OccupancyGrid, People, Pose  # noqa: E402
from curionav.words import UNSEEN  # noqa: E402
from curionav_view import colours, command, heat, output, result_replay, shapes, words  # noqa: E402
from curionav_view.live import Live, Source  # noqa: E402
from curionav_view.scene_logger import SceneLogger  # noqa: E402

TICKS = 20
PROGRAM = [sys.executable, "-m", "curionav_view"]


def drawn(path: Path) -> dict[str, list[Any]]:
    """The chunks of a file as record batches, by entity."""
    found: dict[str, list[Any]] = {}
    for chunk in RrdReader(path).stream().to_chunks():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return found


def values(batches: list[Any], component: str) -> list[Any]:
    """What was logged of a component, row by row."""
    return [v for batch in batches if component in batch.schema.names for v in batch.column(component).to_pylist()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """The made-up drive, drawn and read back."""
    path = tmp_path_factory.mktemp("view") / "drive.rrd"
    stream = rr.RecordingStream("curionav")
    stream.save(path)
    scene_logger = SceneLogger(stream)
    for _, message in drive.drive(TICKS):
        scene_logger.draw(message)
    stream.disconnect()
    return drawn(path)


def test_everything_that_a_cycle_holds_is_drawn(whole: dict[str, list[Any]]) -> None:
    expected = """
        /map/floor /map/information /map/density /robot /robot/body /robot/scan /robot/comfort /eye
        /belief/ellipse /belief/trail /robot/particles /truth/robot /truth/way /people/bodies /people/velocities
        /people/crowds /people/unseen /plan/beyond /plan/candidates /plan/rejected /plan/chosen /plan/goal /decision
        /events /modes/driving /modes/localisation /modes/services /plots/uncertainty/l /plots/uncertainty/threshold
        /plots/uncertainty/error /plots/person/nearest /plots/person/comfortable /plots/speed/driven
        /plots/speed/commanded /plots/cycle/total /plots/cycle/generate /plots/cycle/cnc
    """
    assert set(expected.split()) <= whole.keys()


def test_everything_moves_on_the_robots_clock_and_the_cycles(whole: dict[str, list[Any]]) -> None:
    for path in ("/robot", "/robot/scan", "/people/bodies", "/plan/candidates", "/truth/robot", "/plots/speed/driven"):
        timed = [batch for batch in whole[path] if "robot_time" in batch.schema.names]
        stamps = [t.total_seconds() for batch in timed for t in batch.column("robot_time").to_pylist()]
        cycles = [c for batch in timed for c in batch.column("cycle").to_pylist()]
        assert sorted(stamps) == pytest.approx([0.1 * tick for tick in range(TICKS)]), path
        # What came before its cycle's decision belongs to the cycle before.
        assert min(cycles) == 0, path
        assert max(cycles) in (TICKS - 2, TICKS - 1), path
    for path, batches in whole.items():
        assert not any({"log_time", "log_tick"} & set(batch.schema.names) for batch in batches), path


def test_candidates_are_coloured_by_cost_and_the_chosen_one_is_thick(whole: dict[str, list[Any]]) -> None:
    strips = values(whole["/plan/candidates"], "LineStrips3D:strips")
    shades = values(whole["/plan/candidates"], "LineStrips3D:colors")
    refused = values(whole["/plan/rejected"], "LineStrips3D:strips")
    assert {len(cycle) for cycle in refused} == {4}
    assert {len(cycle) for cycle in strips} == {len(cycle) for cycle in shades} == {20}
    # The cheapest is last, on top.
    assert all(shade[-1] == 0xFDE725FF for shade in shades)
    assert np.isfinite(np.array(strips)).all()
    chosen = values(whole["/plan/chosen"], "LineStrips3D:radii")
    assert min(r for row in chosen for r in row) > 2 * max(
        r for row in values(whole["/plan/candidates"], "LineStrips3D:radii") for r in row
    )


def test_plots_hold_the_numbers_of_the_messages(whole: dict[str, list[Any]]) -> None:
    traces = [v for row in values(whole["/plots/uncertainty/l"], "Scalars:scalars") for v in row]
    assert traces == pytest.approx([float(np.trace(drive.belief(tick).covariance)) for tick in range(TICKS)])
    nearest = [v for row in values(whole["/plots/person/nearest"], "Scalars:scalars") for v in row]
    first = drive.people(0)
    assert nearest[0] == pytest.approx(np.hypot(first.x - 1.0, first.y - 3.0).min())
    error = [v for row in values(whole["/plots/uncertainty/error"], "Scalars:scalars") for v in row]
    assert error == pytest.approx([0.1] * TICKS)
    assert {v for row in values(whole["/plots/cycle/total"], "Scalars:scalars") for v in row} == {9.0}
    assert {v for row in values(whole["/plots/uncertainty/threshold"], "Scalars:scalars") for v in row} == {0.1}


def test_lanes_and_events_say_what_changes_and_nothing_else(whole: dict[str, list[Any]]) -> None:
    lanes = {
        path: values(whole[f"/modes/{path}"], "StateChange:state") for path in ("driving", "localisation", "services")
    }
    assert lanes["driving"] == [["follow"]]
    assert lanes["localisation"] == [["curious"], ["sure"]]
    assert lanes["services"] == [["healthy"], ["degraded"], ["healthy"]]
    events = Counter(text for row in values(whole["/events"], "TextLog:text") for text in row)
    assert (
        events["Follow: least cost"]
        == events["degraded: `cnc` was evaluated by the arbiter"]
        == events["run finished: reached after 5.0 s"]
        == 1
    )
    assert events["mission finished: the robot reached the goal"] == 1
    assert events["driver: tracking"] == 2
    assert events["driver: braking: something is too close"] == 1


def test_the_words_share_out_the_whole_cost() -> None:
    for tick in (0, TICKS - 1):
        report, mission = drive.report(tick), drive.mission()
        shares = [term.cost for term in report.terms if term.active]
        assert np.sum(shares, axis=0) == pytest.approx(report.total)
        text = words.decision(report, mission, 2.5)
        rows = [line.split("|") for line in text.splitlines() if line.endswith(("| pool |", "| local |"))]
        assert report.chosen is not None
        assert len(rows) == len(shares)
        assert sum(float(row[4]) for row in rows) == pytest.approx(report.total[report.chosen], abs=0.002)
        assert "Follow: least cost" in text
        assert "nearest person 2.5 m" in text
        assert "- 4 run into walls" in text
        assert ("the driver commanded 1.00 m/s" in text) == (tick != 0)
        assert ("**uncertain**" in text) == (tick == 0)
        assert ("| cpc | 2 | not asked | | |" in text) == (tick != 0)


@pytest.mark.parametrize(
    ("margin", "said"),
    [(0.25, ", 0.25 better than the next;"), (-0.25, ", 0.25 worse than the next;"), (None, ";")],
)
def test_the_words_give_the_margin_as_the_arbiter_has_it(margin: float | None, said: str) -> None:
    import dataclasses  # noqa: PLC0415

    report = dataclasses.replace(drive.report(3), margin=margin)
    assert f"Cost {report.total[2]:.3f}{said} 20 of 24 candidates" in words.decision(report, None, None)


def test_the_words_say_that_the_driver_brakes_and_since_when() -> None:
    said = "Before it, the driver commanded 0.20 m/s and 0.00 rad/s (braking: something is too close, since 0.6 s)."
    assert said in words.decision(drive.report(7), None, None).splitlines()


def test_a_candidate_without_a_cost_is_drawn_with_the_rejected() -> None:
    import dataclasses  # noqa: PLC0415

    report = drive.report(3)
    total = np.array(report.total)
    total[[0, 1]] = np.nan
    some = dataclasses.replace(report, total=total, scored=np.arange(2, drive.COUNT, dtype=np.uint32))
    counts = []
    for drawn_ in (shapes.candidates(some), shapes.rejected(some)):
        assert drawn_.strips is not None
        counts.append(len(drawn_.strips.as_arrow_array()))
    assert counts == [18, 6]


def test_words_need_no_mission_and_no_choice() -> None:
    import dataclasses  # noqa: PLC0415

    report = dataclasses.replace(drive.report(3), chosen=None)
    assert "No candidate was taken; 20 of 24" in words.decision(report, None, None)


def test_colours_are_colours_whatever_the_number() -> None:
    numbers = np.array([-1e9, 0.0, 0.3, 1.0, 7.0, math.nan, math.inf, -math.inf])
    for ramp in (colours.cost, colours.density, colours.information):
        found = ramp(numbers)
        assert found.dtype == np.uint8
        assert found.shape == (8, 4)
        assert (found[0] == found[1]).all()
        assert (found[3] == found[4]).all()
    assert colours.density(0.0)[3] == colours.information(0.0)[3] == 0


def test_density_is_the_mixture_of_the_crowds() -> None:
    crowds = drive.report(0).crowds
    field = heat.density(crowds, 6.0, 4.0)
    for row, column in ((10, 20), (45, 41), (79, 79)):
        x, y = field.x + (column + 0.5) * field.cell, field.y + (row + 0.5) * field.cell
        expected = sum(
            c.weight / (2 * math.pi * c.sigma) * math.exp(-0.5 * ((x - c.x) ** 2 + (y - c.y) ** 2) / c.sigma)
            for c in crowds
        )
        assert field.values[row, column] == pytest.approx(expected)
    # As many people as there are, but for what lies outside.
    assert field.values.sum() * field.cell**2 == pytest.approx(5.0, rel=0.02)
    assert not heat.density([], 0.0, 0.0).values.any()


def information(cells: np.ndarray[Any, np.dtype[np.int8]], reach: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    grid = OccupancyGrid(
        width=cells.shape[1], height=cells.shape[0], resolution=0.1, origin=Pose(x=0.0, y=0.0, heading=0.0),
        cells=cells, map=bytes(32),
    )  # fmt: skip
    laser = LaserModel(
        robot_from_laser=Pose(x=0.0, y=0.0, heading=0.0), fov=math.tau, beams=181, range_max=reach, range_sigma=0.03
    )
    return heat.information(grid, laser, {"sigma": 0.2, "beams": 20, "correlation": 4.0}).values


def test_a_laser_tells_nothing_in_the_open_and_more_between_walls() -> None:
    cells = np.zeros((100, 100), np.int8)
    cells[:, 0] = 100
    one_wall = information(cells, 2.0)
    assert not one_wall[:, 25:].any()
    assert (one_wall[20:80, 5:15] > 0.0).all()
    cells[:, 30] = 100
    two_walls = information(cells, 2.0)
    assert (two_walls[20:80, 15] > one_wall[20:80, 15]).all()
    # 20 beams of 0.2 m, four of which tell as much as one, each with 1 / cos^2 of 1 at least.
    assert two_walls.max() >= 20 / (0.2**2 * 4.0) * 0.5
    assert not information(np.full((10, 10), 100, np.int8), 2.0).any()


def test_zones_are_drawn_where_the_floor_is_free() -> None:
    import dataclasses  # noqa: PLC0415

    from curionav_view import colours  # noqa: PLC0415

    plain = drive.grid()
    limits = np.full(plain.cells.shape, 100, np.uint8)
    limits[10:20, 10:20] = 0
    limits[10:20, 30:40] = 30
    limits[30:36, 50:56] = 0
    zoned = shapes._plan(dataclasses.replace(plain, limits=limits))
    assert tuple(zoned[15, 15]) == colours.KEEPOUT
    assert tuple(zoned[15, 25]) == colours.FLOOR
    assert tuple(zoned[32, 52]) == colours.WALL
    assert (zoned[15, 35, :3] > colours.FLOOR[:3]).any()
    assert (shapes._plan(plain)[zoned[..., 0] == colours.WALL[0]] == colours.WALL).all()


def test_the_ellipse_holds_what_the_covariance_says() -> None:
    belief = drive.belief(0)
    strips = shapes.ellipse(belief).strips
    assert strips is not None
    points = np.asarray(strips.as_arrow_array().to_pylist()[0])[:, :2] - (belief.x, belief.y)
    inverse = np.linalg.inv(np.asarray(belief.covariance)[:2, :2])
    # 95 % of a two-dimensional Gaussian lie within a Mahalanobis distance of sqrt(5.991).
    assert np.einsum("ij,jk,ik->i", points, inverse, points) == pytest.approx(np.full(len(points), 5.991), rel=1e-3)


def test_the_cloud_lies_around_the_belief_and_goes_along_with_it(whole: dict[str, list[Any]]) -> None:
    clouds = values(whole["/robot/particles"], "Points3D:positions")
    assert len(clouds) == TICKS / 5
    # Seen from the belief, whose first ellipse is half a metre wide.
    assert np.abs(np.median(np.array(clouds)[:, :, :2], axis=1)).max() < 0.15
    import dataclasses  # noqa: PLC0415

    turned = dataclasses.replace(drive.belief(0), x=2.0, y=1.0, heading=math.pi / 2)
    one_ = np.ones(1, np.float32)
    one = dataclasses.replace(drive.particles(0), x=2.0 * one_, y=3.0 * one_, heading=one_, weight=one_)
    positions = shapes.particles(one, turned).positions
    assert positions is not None
    assert positions.as_arrow_array().to_pylist()[0][:2] == pytest.approx([2.0, 0.0], abs=1e-6)


def test_no_more_particles_are_drawn_than_can_be_seen() -> None:
    import dataclasses  # noqa: PLC0415

    for count in (0, 1, 1000, 1001, 8192):
        same = np.ones(count, np.float32)
        many = dataclasses.replace(drive.particles(0), x=same, y=same, heading=same, weight=0.0 * same)
        positions = shapes.particles(many, drive.belief(0)).positions
        assert positions is not None
        assert min(count, 500) <= len(positions.as_arrow_array()) <= min(count, shapes.MAX_PARTICLES)


def test_people_seen_from_the_robot_are_put_on_the_map() -> None:
    import dataclasses  # noqa: PLC0415

    belief = dataclasses.replace(drive.belief(0), x=2.0, y=1.0, heading=math.pi / 2)
    seen = dataclasses.replace(drive.people(0, "robot"), x=np.ones(5), y=np.zeros(5), vx=np.ones(5), vy=np.zeros(5))
    x, y, vx, vy = shapes.in_map(seen, belief)
    assert (x[0], y[0], vx[0], vy[0]) == pytest.approx((2.0, 2.0, 0.0, 1.0))


def with_unseen(report: CycleReport, ahead: float) -> CycleReport:
    """The same with something ``ahead`` metres off that only the driver sees."""
    people, belief = report.scene.people, report.scene.belief
    seen = replace(
        people,
        id=np.append(people.id, np.uint32(UNSEEN)),
        x=np.append(people.x, belief.x + ahead),
        y=np.append(people.y, belief.y),
        vx=np.append(people.vx, 0.0),
        vy=np.append(people.vy, 0.0),
    )
    return replace(report, scene=replace(report.scene, people=seen, in_place_s=4.2, impatient=True))


def test_what_only_the_driver_sees_is_drawn_and_said_and_has_no_number() -> None:
    report = with_unseen(drive.report(0), 0.5)
    archetype = shapes.unseen(report)
    assert archetype.translations is not None and archetype.labels is not None
    assert len(archetype.translations.as_arrow_array()) == 1
    assert archetype.labels.as_arrow_array().to_pylist() == ["something unseen that the driver braked for"]
    empty = shapes.unseen(drive.report(0)).translations
    assert empty is not None and len(empty.as_arrow_array()) == 0
    said = words.decision(report, None, None)
    assert "something unseen that the driver braked for 0.5 m away" in said
    assert "in one place for 4 s" in said
    assert "**impatient**" in said
    assert str(UNSEEN) not in said


def test_things_that_are_on_no_map_are_drawn_until_there_are_none() -> None:
    golden = (ROOT / "schemas" / "golden" / "cycle_report.explained.cbor").read_bytes()
    report = CycleReport.decode(golden)
    assert report.obstacles is not None
    blocks = shapes.obstacles(report)
    assert isinstance(blocks, rr.Boxes3D) and blocks.centers is not None
    assert len(blocks.centers.as_arrow_array()) == len(report.obstacles.x)
    assert isinstance(shapes.obstacles(replace(report, obstacles=None)), rr.Clear)


def test_each_term_says_in_words_what_its_number_means() -> None:
    report = drive.report(0)
    said = words.decision(report, None, None)
    mean = float(report.terms[0].raw[2]) / report.candidates.steps
    assert f"- cnc: there are {mean:.3f} people per m2 where it goes" in said


def test_candidates_are_coloured_by_one_term_the_least_on_top() -> None:
    drawn = shapes.by_term(drive.report(0), "cnc")
    assert drawn.strips is not None and drawn.labels is not None
    assert len(drawn.strips.as_arrow_array()) == 24
    # The last candidate has the least density.
    least = float(drive.report(0).terms[0].raw.min()) / drive.report(0).candidates.steps
    assert drawn.labels.as_arrow_array().to_pylist()[-1] == f"{least:.2f}"
    nothing = shapes.by_term(drive.report(0), "information-to-go").strips
    assert nothing is not None and len(nothing.as_arrow_array()) == 0


def test_tracked_people_have_their_ellipses_on_the_map() -> None:
    import dataclasses  # noqa: PLC0415

    belief = dataclasses.replace(drive.belief(0), x=2.0, y=1.0, heading=math.pi / 2)
    ahead = dataclasses.replace(
        drive.people(0, "robot"),
        position_covariance=np.tile([0.04, 0.0, 0.01], (5, 1)),
        age=np.array([0.0, 0.5, 0.0, 0.0, 0.0], np.float32),
        x=np.ones(5),
        y=np.zeros(5),
    )
    strips = shapes.people_ellipses(ahead, belief).strips
    assert strips is not None
    first = np.array(strips.as_arrow_array()[0].as_py())
    # Turned with the robot: 0.2 m of deviation ahead of it is along y of the map.
    assert np.ptp(first[:, 1]) == pytest.approx(2 * shapes.SIGMAS * 0.2, rel=0.01)
    assert np.ptp(first[:, 0]) == pytest.approx(2 * shapes.SIGMAS * 0.1, rel=0.01)
    assert (first[:, 0].mean(), first[:, 1].mean()) == pytest.approx((2.0, 2.0), abs=0.02)


def test_a_large_batch_is_thinned_out_and_keeps_its_best() -> None:
    order = np.arange(2000)
    kept = shapes._drawn(order)
    assert len(kept) == shapes.MAX_DRAWN
    assert (kept[0], kept[-1]) == (0, 1999)


def test_a_run_that_was_over_before_is_drawn_from_its_result(tmp_path: Path) -> None:
    status = drive.status(TICKS)
    assert status.result is not None
    told = list(result_replay.messages(status.result))
    assert Counter(message.NAME for message in told) == {"odometry": TICKS, "belief": TICKS, "people": TICKS}
    for tick, (belief, people) in enumerate(zip(told[1::3], told[2::3], strict=True)):
        assert isinstance(belief, Belief)
        assert isinstance(people, People)
        assert np.asarray(belief.covariance) == pytest.approx(np.asarray(drive.belief(tick).covariance))
        assert len(people.x) == (5 if tick == 0 else 4)
        # 0.2 m/s southwards by their positions.
        assert people.vy == pytest.approx(np.full(len(people.x), -0.2 if tick else 0.0), abs=1e-4)
    stream = rr.RecordingStream("curionav")
    stream.save(tmp_path / "before.rrd")
    scene_logger = SceneLogger(stream)
    for message in (drive.mission("finished"), drive.grid()):
        scene_logger.draw(message)
    scene_logger.recall(status)
    scene_logger.recall(status)
    scene_logger.note(words.over(drive.mission("finished"), status.result, before=True), always=True)
    stream.disconnect()
    found = drawn(tmp_path / "before.rrd")
    expected = "/map/floor /map/information /robot/body /belief/trail /people/bodies /truth/way /plan/goal"
    assert set(expected.split()) <= found.keys()
    assert len(values(found["/people/bodies"], "Capsules3D:translations")) == TICKS
    (said,) = values(found["/decision"], "TextDocument:text")
    assert "Nothing is running: the mission is finished: the robot reached the goal" in said[0]
    assert "reached after 5.0 s" in said[0]


def test_what_there_is_to_wait_for_is_said_with_the_command_that_starts_it() -> None:
    said = words.waiting("robot `r2` has had nothing to do yet; waiting for a run", "tcp/10.0.0.5:7447")
    assert "Nothing is running" in said
    assert "Robot `r2` has had nothing to do yet" in said
    assert "--connect tcp/10.0.0.5:7447" in said
    assert "--connect" not in words.waiting("no robot answers", None)


# ---- recordings ----


def show(*arguments: object) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run(
        [*PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False, env=environment
    )


def test_a_recording_becomes_what_was_live(tmp_path: Path, whole: dict[str, list[Any]]) -> None:
    file = drive.record(tmp_path / "out.mcap", drive.drive(TICKS))
    done = show(file, "--save", tmp_path / "out.rrd")
    assert done.returncode == 0, done.stderr
    assert "148 messages" in done.stderr
    again = drawn(tmp_path / "out.rrd")
    assert again.keys() - {"/__properties"} == whole.keys() - {"/__properties"}
    for path, component in (("/plots/uncertainty/l", "Scalars:scalars"), ("/plan/chosen", "LineStrips3D:strips")):
        assert values(again[path], component) == values(whole[path], component)


def test_a_recording_that_was_cut_short_is_shown_as_far_as_it_goes(tmp_path: Path) -> None:
    file = drive.record(tmp_path / "out.mcap", drive.drive(60))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    count = sum(1 for _ in recording.messages(file))
    assert 50 < count < 420


def test_a_recording_of_two_robots_asks_which(tmp_path: Path) -> None:
    sent = drive.drive(2)
    other = [(key.replace("/robot/robot/", "/robot/r2/"), message) for key, message in sent]
    file = drive.record(tmp_path / "two.mcap", sent + other)
    assert recording.robots(file) == ["r2", "robot"]
    with pytest.raises(recording.BadRecording, match="--robot: r2, robot"):
        next(recording.messages(file))
    with pytest.raises(recording.BadRecording, match="no robot `r3`"):
        next(recording.messages(file, "r3"))
    assert Counter(m.NAME for m in recording.messages(file, "r2"))["scan"] == 2


def test_the_scan_of_a_further_sensor_is_not_taken_for_the_scanners(tmp_path: Path) -> None:
    sent = drive.drive(2)
    camera = [(f"{key}/camera", message) for key, message in sent if key.endswith("/scan")]
    file = drive.record(tmp_path / "camera.mcap", sent + camera)
    assert len(camera) == 2
    assert Counter(m.NAME for m in recording.messages(file))["scan"] == 2


def test_a_message_that_is_not_understood_costs_only_itself(tmp_path: Path) -> None:
    class Broken(Message):
        NAME = "scan"

        def encode(self) -> bytes:
            return b"\x00"

    sent = drive.drive(3)
    sent.insert(5, (sent[2][0], Broken()))
    file = drive.record(tmp_path / "broken.mcap", sent)
    assert Counter(m.NAME for m in recording.messages(file))["scan"] == 3


@pytest.mark.parametrize(
    ("arguments", "code", "mend"),
    [
        (["missing.mcap"], 1, "cannot read missing.mcap"),
        ([__file__], 1, "no MCAP recording"),
        (["--connect", "tcp/127.0.0.1:1"], 1, "curionav up"),
        (["--save", "no/such/directory/x.rrd"], 2, "no directory"),
        (["--robot", "R 2"], 2, "a name is"),
        (["--web", "--spawn"], 2, "choose one"),
        (["--port", "70000"], 2, "no port"),
    ],
)
def test_errors_say_what_is_missing(tmp_path: Path, arguments: list[str], code: int, mend: str) -> None:
    save = [] if {"--save", "--web"} & set(arguments) else ["--save", str(tmp_path / "x.rrd")]
    done = show(*arguments, *save)
    assert done.returncode == code, done.stderr
    assert mend in done.stderr
    assert "Traceback" not in done.stderr


def test_without_a_screen_the_ways_around_it_are_named() -> None:
    if sys.platform in ("darwin", "win32"):
        pytest.skip("there is always a screen here")
    done = show()
    assert done.returncode == 2
    assert "--web" in done.stderr
    assert "--save" in done.stderr


FAKE_VIEWER = """
import json, os, pathlib, socket, sys
arguments = sys.argv[1:]
if "fail" in os.environ.get("DISPLAY", ""):
    sys.exit("Error: no such display")
with socket.create_server(("127.0.0.1", int(arguments[arguments.index("--port") + 1]))) as server:
    pathlib.Path(__file__).with_name("told.json").write_text(json.dumps([os.getpid(), *arguments]))
    while True:
        server.accept()
"""


@pytest.fixture
def fake_viewer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stands in for Rerun's own program; gives where it notes how it was started."""
    package = tmp_path / "rerun_cli"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text(FAKE_VIEWER)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("DISPLAY", ":77")
    return package / "told.json"


def test_a_window_is_a_program_of_its_own_that_ends_with_us(fake_viewer: Path) -> None:
    with output.Output(output.Wanted(spawn=True, port=0, memory="2GiB")) as out:
        assert out.alive()
        assert out.page is None
        while not fake_viewer.exists():
            time.sleep(0.02)
        pid, *arguments = json.loads(fake_viewer.read_text())
    gone(pid)
    options = dict(zip(arguments[::2], arguments[1::2], strict=False))
    assert options["--bind"] == "127.0.0.1"
    assert 0 < int(options["--port"]) < 65536
    assert arguments[-2:] == ["--memory-limit", "2GiB"]
    assert "--serve-web" not in arguments
    # The real one knows them all.
    real = [sys.executable, "-m", "rerun_cli", "--help"]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    text = subprocess.run(real, capture_output=True, text=True, timeout=60, check=True, env=environment).stdout
    assert [a for a in arguments if a.startswith("--") and a not in text] == []


def test_a_window_that_cannot_be_opened_is_said_with_the_ways_around_it(
    fake_viewer: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":fail")
    with pytest.raises(output.NoOutput, match=r"no such display.*--web.*--save"):
        output.Output(output.Wanted(spawn=True, port=0))
    assert not fake_viewer.exists()


def test_without_rerun_the_package_to_install_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert command.main(["--save", "x.rrd"]) == 3
    assert "not installed: rerun-sdk, mcap; `pip install rerun-sdk mcap` brings them" in capsys.readouterr().err


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main(["--help"])
    text = capsys.readouterr().out
    for word in ("examples:", "--web", "--save", "curionav up", "ssh -L", "status:"):
        assert word in text


# Ctrl-C in a terminal reaches `curionav demo` as well, which then ends its viewer: that may be told twice.
@pytest.mark.parametrize(
    "signals",
    [[signal.SIGINT], [signal.SIGINT, signal.SIGTERM], [signal.SIGTERM, signal.SIGTERM]],
    ids=lambda signals: "-".join(number.name for number in signals),
)
def test_the_page_and_its_server_end_with_the_program(tmp_path: Path, signals: list[signal.Signals]) -> None:
    file = drive.record(tmp_path / "out.mcap", drive.drive(5))
    process = subprocess.Popen(
        [*PROGRAM, str(file), "--web", "--no-browser", "--port", "0", "--web-port", "0"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        assert "open http://127.0.0.1:" in process.stderr.readline()
        assert "messages of" in process.stderr.readline()
        children = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True, check=False
        )
        started = [int(pid) for pid in children.stdout.split()]
        assert started
        for number in signals:
            process.send_signal(number)
            time.sleep(0.02)
        assert process.wait(20) == 0
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    for pid in started:
        gone(pid)


def gone(pid: int) -> None:
    deadline = time.monotonic() + 5.0
    while time.monotonic() < deadline:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail(f"{pid} is still there")


def test_a_further_run_gets_a_file_of_its_own(tmp_path: Path) -> None:
    with output.Output(output.Wanted(spawn=False, save=tmp_path / "x.rrd")) as out:
        for name in ("one", "two"):
            out.recording(name).log("/a", rr.Scalars(1.0))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x-2.rrd", "x.rrd"]
    assert all("/a" in drawn(p) for p in tmp_path.iterdir())


# ---- live ----


@pytest.mark.live
def test_a_live_run_is_drawn_from_its_start_to_its_end(tmp_path: Path) -> None:
    with deployment(tmp_path) as up, curionav.connect(up.endpoint) as connection:
        arguments = ["--connect", up.endpoint, "--save", str(tmp_path / "live.rrd"), "--once"]
        viewer = subprocess.Popen([*PROGRAM, *arguments], stderr=subprocess.PIPE, text=True)
        assert viewer.stderr is not None
        try:
            # It says so once it listens and finds nothing to do.
            assert "waiting for a run" in viewer.stderr.readline()
            scenario = Scenario.from_dict(hall(tmp_path), tmp_path)
            with connection.inject(scenario, seed=3) as run:
                result = run.wait(RUN_TIMEOUT)
            assert viewer.wait(60) == 0
        finally:
            viewer.kill()
            viewer.wait()
            viewer.stderr.close()
    found = drawn(tmp_path / "live.rrd")
    assert {"/map/floor", "/map/information", "/plan/candidates", "/people/bodies", "/truth/robot"} <= found.keys()
    uncertainties = values(found["/plots/uncertainty/l"], "Scalars:scalars")
    assert len(uncertainties) == result.cycles.count


class Drawer:
    """Gives stories that are drawn into files, and notes which."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.begun: list[str] = []
        self._streams: list[Any] = []

    def begin(self, kind: str) -> SceneLogger:
        self.begun.append(kind)
        stream = rr.RecordingStream("curionav")
        stream.save(self.directory / f"{len(self.begun)}.rrd")
        self._streams.append(stream)
        return SceneLogger(stream)

    def drawn(self, number: int) -> dict[str, list[Any]]:
        self._streams[number - 1].disconnect()
        return drawn(self.directory / f"{number}.rrd")


@pytest.mark.live
def test_who_comes_after_the_run_sees_it_and_then_the_next(tmp_path: Path) -> None:
    drawer, said = Drawer(tmp_path), list[str]()
    with deployment(tmp_path) as up, curionav.connect(up.endpoint) as connection:

        def joined() -> Live:
            return Live(
                Source(up.endpoint),
                lambda name: drawer.begin("run"),
                said.append,
                lambda name: drawer.begin("aside"),
            )

        live = joined()
        try:
            # Nothing yet: said also on the page.
            live.follow(lambda: False)
            assert drawer.begun == ["aside"]
            (words_,) = values(drawer.drawn(1)["/decision"], "TextDocument:text")
            assert "has had nothing to do yet" in words_[0]
            assert up.endpoint in words_[0]
        finally:
            live.close()
        scenario = Scenario.from_dict(hall(tmp_path), tmp_path)
        with connection.inject(scenario, seed=3) as run:
            first = run.wait(120.0)
        live = joined()
        try:
            live.follow(lambda: False)
            assert drawer.begun == ["aside", "aside"]
            assert "has nothing to do at the moment" in said[1]
            late = drawer.drawn(2)
            expected = "/map/floor /map/information /plan/goal /robot /belief/trail /people/bodies /truth/way /decision"
            assert set(expected.split()) <= late.keys()
            ((text,),) = values(late["/decision"], "TextDocument:text")[-1:]
            assert f"reached after {first.measures.time_s:.1f} s" in text
            with connection.inject(scenario, seed=4) as run:
                deadline = time.monotonic() + 120.0
                live.follow(lambda: time.monotonic() < deadline, once=True)
                second = run.wait(1.0)
        finally:
            live.close()
        assert drawer.begun[-1] == "run"
        found = drawer.drawn(len(drawer.begun))
        assert len(values(found["/plots/uncertainty/l"], "Scalars:scalars")) == second.cycles.count
        # Twice a second of the robot's clock; where the network is busy some are dropped.
        clouds = values(found["/robot/particles"], "Points3D:positions")
        assert second.measures.time_s <= len(clouds) <= 2.0 * second.measures.time_s + 2.0


@pytest.mark.live
def test_ctrl_c_ends_a_live_viewer_at_once_and_leaves_a_whole_file(tmp_path: Path) -> None:
    with deployment(tmp_path) as up:
        viewer = subprocess.Popen(
            [*PROGRAM, "--connect", up.endpoint, "--save", str(tmp_path / "x.rrd"), "--robot", "absent"],
            stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert viewer.stderr is not None
        try:
            assert "no robot `absent` answers yet; there is robot: choose with --robot" in viewer.stderr.readline()
            begin = time.monotonic()
            viewer.send_signal(signal.SIGINT)
            assert viewer.wait(10) == 0
            assert time.monotonic() - begin < 5.0
        finally:
            viewer.kill()
            viewer.wait()
            viewer.stderr.close()


def test_the_documentation_has_its_picture() -> None:
    picture = ROOT / "docs" / "images" / "viewer.png"
    if not (ROOT / "docs").is_dir():
        pytest.skip("no docs beside the package")
    assert 20_000 < picture.stat().st_size < 300_000
    assert (ROOT / "docs" / "viewer.md").read_text().count("\n") <= 60
