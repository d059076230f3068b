"""Planners of one's own: in Python and in C, in a bench and in a deployment, and what goes wrong with them."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import Up, hall, program

import curionav
from curionav import Candidates, Drive, PlannerError, Scenario
from curionav.planner import read_situation, read_task
from curionav.planner_host import Host, load

POLICY = '''
import math
import curionav

def along(known):
    x, y = known.way[min(4, len(known.way) - 1)]
    turn = math.remainder(math.atan2(y - known.belief.y, x - known.belief.x) - known.belief.heading, math.tau)
    return 0.6 * max(math.cos(turn), 0.0), 2.0 * turn

good = curionav.planner("good", map=True, scan=True)(along)
unchecked = curionav.planner("unchecked", check="driver")(along)
several = curionav.planner("several", profile="curionav")(
    lambda known: curionav.Candidates([along(known), curionav.Drive(0.2, 0.5), [(known.belief.x, known.belief.y, 0)]])
)

def failing(name, fail):
    """Drives along the way, and fails from 2 s on."""
    def policy(known):
        return along(known) if known.time < 2.0 else fail()
    return curionav.planner(name, answer_within_s=0.5 if name == "sleeps" else 10)(policy)

def sleep():
    import time
    time.sleep(600)

def die():
    import os
    os._exit(7)

def raise_one():
    raise RuntimeError("no idea")

sleeps, raises = failing("sleeps", sleep), failing("raises", raise_one)
nan, dies = failing("nan", lambda: (math.nan, 0.0)), failing("dies", die)
not_a_planner = along
blind = curionav.planner("blind")(lambda known: (0.5, 0.0))
blind_unchecked = curionav.planner("blind-unchecked", check="driver")(lambda known: (0.5, 0.0))
'''

TASK = {
    "ask": "begin",
    "robot": "r",
    "seed": 3,
    "goal": [4.0, 1.0],
    "limits": {"v_max": 1.0, "v_reverse": 0.0, "a_max": 0.5, "omega_max": 1.0, "alpha_max": 2.0},
    "footprint": {"kind": "disc", "radius": 0.3},
    "steps": 13,
    "dt": 0.3,
    "map": {"sha256": "ab", "width": 3, "height": 2, "resolution": 0.5, "origin": [0, 0, 0], "cells": "..#?.."},
}
DECIDE = {
    "ask": "decide",
    "time": 1.5,
    "belief": {
        "x": 1.0,
        "y": 1.0,
        "heading": 0.0,
        "v": 0.5,
        "omega": 0.0,
        "covariance": [0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.001],
        "uncertain": False,
    },
    "goal": [4.0, 1.0],
    "to_go": 3.0,
    "way": [[1.0, 1.0], [1.25, 1.0], [1.5, 1.0]],
    "people": {"radius": 0.25, "id": [7], "x": [2.0], "y": [1.5], "vx": [-1.0], "vy": [0.0]},
    "obstacles": {"side": 0.1, "x": [], "y": []},
    "scan": {
        "time": 1.5,
        "angle_min": -0.5,
        "angle_increment": 0.5,
        "range_max": 5.0,
        "laser": [0, 0, 0],
        "ranges": [1.0, None, 5.0],
    },
}


def host(file: Path, name: str) -> Host:
    found = Host(load(file, name))
    assert found.answer(TASK) == {}
    return found


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    file = tmp_path / "mine.py"
    file.write_text(POLICY)
    return file


def test_a_planner_is_told_arrays_and_the_cells_of_a_map_once() -> None:
    known: dict[str, Any] = {}
    task = read_task(TASK, known)
    assert task.map.cells is not None
    assert task.map.cells.tolist() == [[0, 0, 100], [-1, 0, 0]]
    again = read_task({**TASK, "map": {k: v for k, v in TASK["map"].items() if k != "cells"}}, known)  # type: ignore[attr-defined]
    assert again.map.cells is task.map.cells
    situation = read_situation(DECIDE, task)
    assert situation.belief.covariance.shape == (3, 3)
    assert situation.people.xy.tolist() == [[2.0, 1.5]]
    assert situation.obstacles.shape == (0, 2)
    assert situation.scan is not None
    assert situation.scan.angles.tolist() == [-0.5, 0.0, 0.5]
    assert np.isnan(situation.scan.ranges[1])


def test_every_form_of_an_answer_becomes_a_line(tmp_path: Path) -> None:
    def answer(found: Any) -> dict[str, Any]:
        made = Host(curionav.planner("one")(lambda _: found))
        made.answer(TASK)
        return made.answer(DECIDE)

    assert answer((0.5, 0.1)) == {"v": 0.5, "omega": 0.1}
    assert answer(Drive(0.5, 0.1, 1.0)) == {"v": 0.5, "omega": 0.1, "seconds": 1.0}
    assert answer(np.zeros((2, 3))) == {"poses": [[0.0] * 3] * 2}
    assert answer(Candidates([(0, 1), np.ones((1, 3))])) == {
        "candidates": [{"v": 0.0, "omega": 1.0}, {"poses": [[1.0] * 3]}]
    }
    for wrong in (None, (1, 2, 3), "fast", np.zeros((0, 3))):
        assert "planner one: answered" in answer(wrong)["error"]


def test_a_class_is_reset_before_each_run_and_what_it_draws_is_seeded() -> None:
    @curionav.planner("draws")
    class Draws:
        def __init__(self) -> None:
            self.runs: list[int] = []

        def reset(self, task: curionav.Task) -> None:
            self.runs.append(task.seed)

        def __call__(self, situation: curionav.Situation) -> tuple[float, float]:
            return float(np.random.random()), float(len(self.runs))

    made = Host(Draws)  # type: ignore[arg-type]
    answers = []
    for _ in range(2):
        made.answer(TASK)
        answers.append(made.answer(DECIDE))
    assert answers[0]["v"] == answers[1]["v"]
    assert [answer["omega"] for answer in answers] == [1.0, 2.0]


def test_what_is_no_planner_is_said_with_what_mends_it(mine: Path, tmp_path: Path) -> None:
    with pytest.raises(PlannerError, match=r"there is no `polcy` in it; it has blind, blind_unchecked, dies"):
        load(mine, "polcy")
    with pytest.raises(PlannerError, match=r"`not_a_planner` is a function and no planner; decorate it"):
        load(mine, "not_a_planner")
    (tmp_path / "broken.py").write_text("import curionav\n1 / 0\n")
    with pytest.raises(PlannerError, match=r"raised ZeroDivisionError: .* \(line 2 of broken.py\)"):
        load(tmp_path / "broken.py", "policy")
    with pytest.raises(ValueError, match="must be 1 to 60"):
        curionav.planner("My planner")
    with pytest.raises(ValueError, match="give 'arbiter' or 'driver'"):
        curionav.planner("mine", check="none")  # type: ignore[arg-type]
    assert (
        host(mine, "raises").answer({**DECIDE, "time": 3.0})["error"].startswith("raised RuntimeError: no idea (line")
    )


# ---- with the program ----


def bench(planners: str, out: Path, scenario: Path, *more: str) -> subprocess.CompletedProcess[str]:
    command = [str(program()), "bench", "--scenarios", str(scenario), "--planners", planners]
    command += ["--repeats", "1", "--out", str(out), "--jobs", "2", *more]
    environment = {**os.environ, "CURIONAV_PYTHON": sys.executable}
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600, check=False)


def rows(out: Path) -> dict[str, dict[str, str]]:
    with (out / "results.csv").open(encoding="utf-8", newline="") as file:
        return {row["planner"]: row for row in csv.DictReader(file)}


def faults(out: Path) -> dict[str, str]:
    lines = (out / "journal.jsonl").read_text().splitlines()
    found = {row["planner"]: row.get("own_planner", {}) for row in map(json.loads, lines)}
    return {planner: own.get("first_fault", "") for planner, own in found.items()}


@pytest.fixture
def foyer(tmp_path: Path) -> Path:
    """The quick start with half a minute to arrive."""
    scenario = Scenario.load(ROOT / "scenarios" / "quickstart.toml")
    text = (ROOT / "scenarios" / "quickstart.toml").read_text()
    assert scenario.data["clock"]["time_limit_s"] > 30.0
    file = tmp_path / "foyer.toml"
    file.write_text(re.sub(r"time_limit_s = [\d.]+", "time_limit_s = 30.0", text))
    shutil.copytree(ROOT / "scenarios" / "maps", tmp_path / "maps")
    return file


@pytest.fixture
def empty_foyer(foyer: Path) -> Path:
    """The same without people."""
    text = foyer.read_text()
    file = foyer.with_name("empty.toml")
    file.write_text(text[: text.index("[[walkers]]")])
    return file


@pytest.mark.live
def test_planners_that_fail_cost_their_own_runs_alone(mine: Path, foyer: Path, tmp_path: Path) -> None:
    alone, beside = tmp_path / "alone", tmp_path / "beside"
    assert bench("hrvo-robot", alone, foyer).returncode == 0
    names = ["sleeps", "raises", "nan", "dies", "good", "unchecked", "several"]
    done = bench(",".join(["hrvo-robot", *(f"{mine}:{name}" for name in names)]), beside, foyer)
    assert done.returncode == 0, done.stderr
    found = rows(beside)
    assert found["hrvo-robot"] == rows(alone)["hrvo-robot"]
    counted = {name: [int(found[name][column]) for column in ("late", "errors", "refused", "deaths")] for name in names}
    assert counted["sleeps"] == [3, 0, 0, 1]
    assert counted["dies"] == [0, 0, 0, 1]
    late, errors, refused, deaths = counted["raises"]
    assert errors > 50
    assert (late, refused, deaths) == (0, 0, 0)
    late, errors, refused, deaths = counted["nan"]
    assert refused > 50
    assert (late, errors, deaths) == (0, 0, 0)
    for name in ("good", "unchecked", "several"):
        assert counted[name] == [0, 0, 0, 0], faults(beside)[name]
    for name in ("sleeps", "raises", "nan", "dies"):
        assert found[name]["outcome"] == "timeout"
        # It has driven for 2 s and then stopped.
        assert 0.3 < float(found[name]["length_m"]) < 3.0
    assert [found[name]["check"] for name in ("good", "unchecked", "hrvo-robot")] == ["arbiter", "driver", ""]
    why = faults(beside)
    assert why["sleeps"] == "no answer within 0.5 s"
    assert "no idea" in why["raises"]
    assert "not finite" in why["nan"]
    assert "exit status: 7" in why["dies"]
    page = (beside / "report.html").read_text()
    assert "Planners of one's own" in page
    assert "no answer within 0.5 s" in page


@pytest.mark.live
def test_the_arbiter_checks_what_is_proposed_unless_the_driver_alone_is_to(
    mine: Path, foyer: Path, tmp_path: Path
) -> None:
    assert bench(f"{mine}:blind,{mine}:blind_unchecked", tmp_path / "out", foyer).returncode == 0
    found = rows(tmp_path / "out")
    # Both drive straight on until a wall is ahead, which the arbiter sees first.
    refused = {name: int(found[name]["none_free"]) for name in ("blind", "blind-unchecked")}
    assert refused["blind"] > 10
    assert refused["blind-unchecked"] == 0
    assert [found[name]["check"] for name in ("blind", "blind-unchecked")] == ["arbiter", "driver"]


@pytest.mark.live
def test_a_planner_that_is_never_late_gives_the_same_run_again(mine: Path, foyer: Path, tmp_path: Path) -> None:
    digests = []
    for out in (tmp_path / "once", tmp_path / "again"):
        assert bench(f"{mine}:good,{mine}:several", out, foyer).returncode == 0
        found = rows(out)
        assert float(found["good"]["length_m"]) > 3.0
        digests.append([found[name]["decisions_sha256"] for name in ("good", "several")])
    assert digests[0] == digests[1]
    assert digests[0][0] != digests[0][1]


@pytest.mark.live
def test_what_cannot_be_a_planner_is_bad_input(mine: Path, foyer: Path, tmp_path: Path) -> None:
    for planner, said in [
        ("no.py:policy", "there is no file no.py"),
        (str(mine), "name the planner in it too"),
        (f"{mine}:polcy", "there is no `polcy` in it; it has blind"),
        (f"{mine}:not_a_planner", "is a function and no planner"),
        ("./no-program", "there is no program `./no-program`"),
        ("curionaf", "unknown planner `curionaf`"),
    ]:
        done = bench(planner, tmp_path / "out", foyer)
        assert done.returncode == 2, done.stderr
        assert said in done.stderr, done.stderr


def block(title: str) -> str:
    """The block of the page with this title."""
    page = (ROOT / "docs" / "own-planner.md").read_text()
    found = re.search(rf'^```\w+ title="{title}"\n(.*?)^```$', page, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.live
@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_the_planners_of_the_page_arrive_in_c_and_in_python(empty_foyer: Path, tmp_path: Path) -> None:
    (tmp_path / "planner.c").write_text(block("planner.c"))
    (tmp_path / "mine.py").write_text(block("mine.py"))
    compiled = ["gcc", "-O2", "-Wall", "-Werror", "-o", str(tmp_path / "planner"), str(tmp_path / "planner.c"), "-lm"]
    subprocess.run(compiled, check=True)
    done = bench(f"{tmp_path / 'planner'},{tmp_path / 'mine.py'}:policy", tmp_path / "out", empty_foyer)
    assert done.returncode == 0, done.stderr
    for name in ("in-c", "mine"):
        found = rows(tmp_path / "out")[name]
        assert found["outcome"] == "reached", found
        assert [found[column] for column in ("late", "errors", "refused", "deaths")] == ["0"] * 4


@pytest.mark.live
def test_orca_is_asked_in_every_cycle_and_never_fails(foyer: Path, tmp_path: Path) -> None:
    done = bench(f"{ROOT / 'python' / 'examples' / 'orca.py'}:planner", tmp_path / "out", foyer, "--first-seed", "2")
    assert done.returncode == 0, done.stderr
    found = rows(tmp_path / "out")["orca"]
    assert found["outcome"] == "reached", found
    assert [found[column] for column in ("late", "errors", "refused", "deaths")] == ["0"] * 4


@pytest.mark.live
def test_robots_of_a_deployment_are_planned_for_by_the_same_file(up: Up, mine: Path, directory: Path) -> None:
    scenario = directory / "hall.toml"
    scenario.write_text(_toml(hall(directory)))
    command = [str(program()), "run", str(scenario), "--planner", f"{mine}:good", "--json"]
    environment = {**os.environ, "CURIONAV_PYTHON": sys.executable}

    def run(*more: str) -> Any:
        done = subprocess.run(
            [*command, *more], capture_output=True, text=True, env=environment, timeout=120, check=False
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    with curionav.serve_planner(f"{mine}:good", up.endpoint, program=program()) as server:
        assert (server.role, server.instance) == ("own-good", "a")
        distributed = run("--connect", up.endpoint)
    assert not server.is_running()
    assert distributed["cycles"]["degraded"] == 0
    assert run()["decisions_sha256"] == distributed["decisions_sha256"]


@pytest.mark.live
def test_a_planner_that_cannot_be_served_says_why(mine: Path) -> None:
    with pytest.raises(PlannerError, match="there is no `polcy` in it"):
        curionav.serve_planner(f"{mine}:polcy", program=program())
    with pytest.raises(PlannerError, match=r"there is no file no\.py"):
        curionav.serve_planner("no.py:policy", program=program())


def _toml(tables: dict[str, Any]) -> str:
    """Tables as TOML, with tables inline."""
    return "".join(f"{key} = {_value(value)}\n" for key, value in tables.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_value(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and math.isfinite(value):
        return repr(value)
    return json.dumps(value)
