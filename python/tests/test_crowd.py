"""A crowd played from Python, against a real deployment."""

from __future__ import annotations

import json
import math
import re
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import RUN_TIMEOUT, Up, hall, program

import curionav
from curionav import CrowdStep, Scenario

FIRST_LIVE_ID = 1_000_000

live = pytest.mark.live


def scenario(directory: Path, *standing: tuple[float, float]) -> Scenario:
    tables = hall(directory)
    tables["walkers"] = [{"route": [list(place)], "mode": "stand"} for place in standing]
    return Scenario.from_dict(tables, directory)


@live
def test_live_people_are_people_like_any_other(connected: curionav.Deployment, directory: Path) -> None:
    places = [(4.0, 2.0), (5.0, 3.6)]
    with connected.inject(scenario(directory, *places), seed=1003) as run:
        scripted = run.wait(RUN_TIMEOUT)
    ticks: list[int] = []

    def standing(step: CrowdStep) -> Any:
        ticks.append(step.tick)
        return zip(*places, strict=True)

    with connected.inject(scenario(directory), seed=1003, crowd=standing) as run:
        played = run.wait(RUN_TIMEOUT)
    assert played.decisions_sha256 == scripted.decisions_sha256
    assert ticks == list(range(played.trace["time_s"].size)), "each tick once, in order"
    assert played.people.id.tolist() == [FIRST_LIVE_ID, FIRST_LIVE_ID + 1]


@live
def test_the_crowd_sees_the_robot_and_the_planner_sees_the_crowd(
    connected: curionav.Deployment, directory: Path
) -> None:
    seen: list[tuple[float, float]] = []

    def followers(step: CrowdStep) -> Any:
        seen.append((step.robot.x, step.robot.y))
        # One walks beside the robot; one joins after a second.
        x, y = [step.robot.x], [step.robot.y + 1.5]
        if step.time >= 1.0:
            x, y = [*x, 10.0], [*y, 1.0]
        return x, y, [step.robot.v] * len(x), [0.0] * len(x), [7, 3][: len(x)]

    with connected.inject(scenario(directory), seed=1003, crowd=followers) as run:
        reports = list(run)
        result = run.wait(RUN_TIMEOUT)
    true = np.column_stack([result.trace["true_x"], result.trace["true_y"]])
    assert np.allclose(true, seen, atol=1e-6)
    assert reports[0].scene.people.id.tolist() == [FIRST_LIVE_ID + 7]
    assert set(reports[-1].scene.people.id.tolist()) == {FIRST_LIVE_ID + 7, FIRST_LIVE_ID + 3}


@live
def test_equal_crowds_give_equal_decisions(connected: curionav.Deployment, directory: Path) -> None:
    def walking(step: CrowdStep) -> Any:
        return [8.0 - 0.8 * step.time], [3.2], [-0.8], [0.0]

    digests = []
    for _ in range(2):
        with connected.inject(scenario(directory), seed=1004, crowd=walking) as run:
            digests.append(run.wait(RUN_TIMEOUT).decisions_sha256)
    assert digests[0] == digests[1]


@live
def test_what_the_crowd_raises_ends_the_run(connected: curionav.Deployment, directory: Path) -> None:
    def stumbling(step: CrowdStep) -> Any:
        if step.tick == 5:
            raise LookupError("the recording ends here")
        return [8.0], [1.0]

    with (
        pytest.raises(curionav.RunFailed, match="the recording ends here") as failure,
        connected.inject(scenario(directory), crowd=stumbling) as run,
    ):
        run.wait(RUN_TIMEOUT)
    assert isinstance(failure.value.__cause__, LookupError)
    assert run.status().state == "failed"


@live
@pytest.mark.parametrize(
    ("found", "reason"),
    [
        (([1.0, 2.0], [1.0]), "shape|elements"),
        (([float("nan")], [1.0]), "finite"),
        (([1.0], [1.0], [0.0], [0.0], [-3]), "ids"),
        (([1.0, 2.0], [1.0, 1.0], [0.0] * 2, [0.0] * 2, [4, 4]), "id 4 stands twice"),
        (([1.0], [1.0], [0.0], [0.0], [2**32 - 1]), "id 4294967295 exceeds"),
    ],
)
def test_people_that_cannot_be_are_an_error_with_the_reason(
    connected: curionav.Deployment, directory: Path, found: Any, reason: str
) -> None:
    with (
        pytest.raises(curionav.RunFailed, match=reason),
        connected.inject(scenario(directory), crowd=lambda step: found) as run,
    ):
        run.wait(RUN_TIMEOUT)


@live
def test_a_crowd_that_never_comes_is_not_waited_for_for_ever(connected: curionav.Deployment, directory: Path) -> None:
    started = time.monotonic()
    with (
        pytest.raises(curionav.RunFailed, match=r"no people for tick 0 on .*world/people within 1 s"),
        connected.inject(scenario(directory).with_live_people(patience_s=1.0)) as run,
    ):
        run.wait(RUN_TIMEOUT)
    assert time.monotonic() - started < 20.0


@live
def test_a_crowd_may_come_late_and_be_played_by_another_program(
    up: Up, connected: curionav.Deployment, directory: Path
) -> None:
    with connected.inject(scenario(directory).with_live_people(), seed=1003) as run:
        while run.status().state == "preparing" and not connected.mission().has_run:
            time.sleep(0.05)
        with curionav.connect(up.endpoint) as other, other.crowd() as crowd:
            for step in crowd.steps(timeout=3.0):
                crowd.publish(step, 8.0, 1.0)
                if run.status().state == "finished":
                    break
        assert run.wait(RUN_TIMEOUT).outcome == "reached"


@live
def test_in_real_time_a_silent_crowd_stops_the_robot_and_later_ends_the_run(
    connected: curionav.Deployment, directory: Path
) -> None:
    tables = scenario(directory).with_live_people(patience_s=4.0)
    with connected.inject(tables, seed=1003, clock="realtime") as run, connected.crowd() as crowd:
        for step in crowd:
            crowd.publish(step, 8.0, 1.0)
            if step.time > 2.0:
                break
        decisions = []
        with pytest.raises(curionav.RunFailed, match=r"no people on .*world/people for 4 s"):
            for decision in run.decisions():
                decisions.append(decision)
            run.wait(RUN_TIMEOUT)
    assert any(d.action == "follow" for d in decisions), "it drove while the crowd was there"
    assert decisions[-1].action == "stop"
    assert decisions[-1].degraded == [{"code": "people_unknown"}]


@live
def test_a_second_crowd_does_not_meddle_with_a_run_under_way(connected: curionav.Deployment, directory: Path) -> None:
    calls: list[int] = []

    def meddling(step: CrowdStep) -> Any:
        calls.append(step.tick)
        return [0.0], [0.0]

    with connected.inject(scenario(directory), seed=1003, crowd=lambda step: ([8.0], [1.0])) as run:
        with pytest.raises(curionav.Rejected, match="under way"):
            connected.inject(scenario(directory), crowd=meddling)
        run.wait(RUN_TIMEOUT)
    assert calls == []


def test_the_scenario_says_how_its_people_are_known(directory: Path) -> None:
    plain = scenario(directory)
    before = dict(plain.data.get("perception", {}))
    assert plain.with_perception("tracked").data["perception"]["source"] == "tracker"
    seen = plain.with_perception("tracked").with_perception("robot-frame").data["perception"]
    assert (seen["source"], seen["frame"]) == ("truth", "robot")
    assert plain.data.get("perception", {}) == before


@pytest.mark.parametrize(
    ("laser", "around"),
    [
        ({}, {"fov": math.tau, "beams": 360}),
        ({"fov": 2.0, "beams": 91}, {"fov": math.tau, "beams": 283}),
        ({"fov": math.tau}, {"fov": math.tau}),
        ({"fov": 0.0}, {"fov": 0.0}),
    ],
)
def test_a_laser_that_sees_all_around_keeps_its_spacing(
    directory: Path, laser: dict[str, Any], around: dict[str, Any]
) -> None:
    plain = scenario(directory)
    plain.data["laser"] = dict(laser)
    changed = plain.with_perception("tracked-all-round").data
    assert (changed["perception"]["source"], changed["laser"]) == ("tracker", around)
    assert plain.data["laser"] == laser


@live
@pytest.mark.parametrize("left_out", [r"$^", r"^(fov|beams) = .*\n"], ids=["as in the file", "default laser"])
def test_a_tracker_that_sees_all_around_decides_as_on_the_command_line(
    connected: curionav.Deployment, directory: Path, left_out: str
) -> None:
    text = (ROOT / "scenarios" / "quickstart.toml").read_text().replace('"maps/', f'"{ROOT}/scenarios/maps/')
    file = directory / "quickstart.toml"
    file.write_text(re.sub(left_out, "", text, flags=re.MULTILINE))
    command = [str(program()), "run", str(file), "--perception", "tracked-all-round", "--seed", "1003", "--json"]
    printed = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    with connected.inject(Scenario.load(file).with_perception("tracked-all-round"), seed=1003) as run:
        result = run.wait(RUN_TIMEOUT)
    assert result.decisions_sha256 == printed["decisions_sha256"]


def test_the_scenario_says_that_its_people_are_live(directory: Path) -> None:
    plain = scenario(directory)
    changed = plain.with_live_people(3)
    assert changed.data["people"] == {"kind": "live", "live_patience_s": 3.0}
    assert "people" not in plain.data
