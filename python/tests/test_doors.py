"""What people give is taken or refused as the program does it, before anything hangs."""

from __future__ import annotations

import multiprocessing
import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live import RUN_TIMEOUT, Up, hall

import curionav
from curionav import ConnectionFailed, CurionavError, Rejected, Scenario
from curionav.crowd import CrowdStep, _people_of
from curionav.endpoint import check_endpoint, check_namespace
from curionav.errors import EncodeError
from curionav.messages import Odometry

live = pytest.mark.live

TABLE = tomllib.loads((Path(__file__).parent / "data" / "endpoints.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("endpoint", TABLE["connect"])
def test_what_is_an_endpoint_is_taken(endpoint: str) -> None:
    check_endpoint(endpoint)


@pytest.mark.parametrize("row", TABLE["refused"], ids=lambda row: row["text"])
def test_what_is_none_is_refused_with_the_right_form(row: dict[str, str]) -> None:
    with pytest.raises(ConnectionFailed) as error:
        curionav.connect(row["text"])
    assert row["says"] in str(error.value)
    check_endpoint(str(error.value).rpartition("; give ")[2])


def test_namespaces_are_taken_or_refused() -> None:
    for namespace in TABLE["namespaces"]["allowed"]:
        check_namespace(namespace)
    for row in TABLE["namespaces"]["refused"]:
        with pytest.raises(ConnectionFailed) as error:
            curionav.connect(namespace=row["text"])
        assert str(error.value).endswith(row["says"])


def step() -> CrowdStep:
    return CrowdStep(0, 0.0, Odometry(tick=0, stamp=0.0, x=0.0, y=0.0, heading=0.0, v=0.0, omega=0.0))


ROWS = np.array([[6.0, 2.0], [7.0, 2.0], [8.0, 2.0]])


@pytest.mark.parametrize(
    ("crowd", "words"),
    [
        (ROWS, r"array of the shape \(3, 2\)"),
        (ROWS[:2], r"array of the shape \(2, 2\)"),
        (ROWS.T, r"array of the shape \(2, 3\)"),
        ([(1.0, 2.0), (3.0, 4.0), (5.0, 6.0)], "list of 3 tuples"),
        ([(1.0, 2.0), (3.0, 4.0)], "list of 2 tuples"),
        (((1.0, 2.0), (3.0, 4.0), (5.0, 6.0)), "3 columns"),
        ((ROWS, ROWS), "one dimension"),
        ((), "0 columns"),
    ],
)
def test_rows_are_not_taken_for_columns(crowd: Any, words: str) -> None:
    with pytest.raises(EncodeError, match=words):
        _people_of(step(), crowd)


@pytest.mark.parametrize(
    "crowd",
    [
        (ROWS[:, 0], ROWS[:, 1]),
        ([6.0, 7.0, 8.0], [2.0, 2.0, 2.0], [0.0] * 3, [0.0] * 3, [4, 5, 6]),
        zip((6.0, 2.0), (7.0, 2.0), (8.0, 2.0), strict=True),
    ],
)
def test_columns_are_people(crowd: Any) -> None:
    people = _people_of(step(), crowd)
    assert people.x.tolist() == [6.0, 7.0, 8.0]
    assert people.y.tolist() == [2.0, 2.0, 2.0]


@live
@pytest.mark.parametrize(
    ("table", "field", "value", "named", "reason"),
    [
        ("laser", "beams", 181.0, "laser.beams", "floating point `181.0`, expected u32"),
        ("laser", "beams", "181", "laser.beams", 'string "181", expected u32'),
        ("robot", "goal", ["10", "4"], "robot.goal[0]", 'string "10", expected f64'),
        ("robot", "goal", [10.0, 4.0, 0.0], "robot.goal", "invalid length 3"),
        ("robot", "strat", [1, 2, 0], "robot.strat", "unknown field `strat`"),
        ("clock", "time_limit_s", True, "clock.time_limit_s", "boolean `true`, expected f64"),
    ],
)
def test_what_is_wrong_is_named_as_the_program_names_it(
    connected: curionav.Deployment, tmp_path: Path, table: str, field: str, value: Any, named: str, reason: str
) -> None:
    data = hall(tmp_path)
    data.setdefault(table, {})[field] = value
    with pytest.raises(Rejected) as error:
        connected.validate(Scenario.from_dict(data, tmp_path))
    assert error.value.field == named
    assert reason in error.value.reason


@live
def test_numbers_are_taken_as_files_have_them(connected: curionav.Deployment, tmp_path: Path) -> None:
    data = hall(tmp_path)
    data["clock"] = {"time_limit_s": 30}
    data["laser"] = {"fov": 6.2832, "beams": 360, "range_max": 6}
    data["crowds"] = [{"count": 2, "places": 3, "group": [1, 1], "stretch_m": [1, 5]}]
    connected.validate(Scenario.from_dict(data, tmp_path))


@live
def test_a_goal_that_cannot_be_raises(connected: curionav.Deployment, tmp_path: Path) -> None:
    with connected.inject(Scenario.from_dict(hall(tmp_path), tmp_path)) as run:
        run.wait(RUN_TIMEOUT)
    for x, y in [(100.0, 100.0), (-50.0, 1.0), (1.0, 1e6)]:
        with pytest.raises(Rejected, match="cannot be reached") as error:
            connected.goal(x, y)
        assert error.value.code == "unreachable_goal"
    with pytest.raises(Rejected, match="90"):
        connected.goal(2.0, 2.0, heading=90.0)


def _connect_again(endpoint: str) -> str:
    try:
        curionav.connect(endpoint, timeout=5.0).close()
    except CurionavError as error:
        return str(error)
    return "connected"


def _in_fork(endpoint: str, inherited: curionav.Deployment) -> str:
    """What a forked process says of connecting, and of what it has inherited."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        said = _connect_again(endpoint)
        try:
            inherited.status()
        except CurionavError as error:
            said += f"\n{error}"
        inherited.close()
        os.write(write, said.encode())
        os._exit(0)
    os.close(write)
    os.waitpid(child, 0)
    with os.fdopen(read) as told:
        return told.read()


@live
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_is_told_and_a_fresh_one_connects(up: Up, connected: curionav.Deployment) -> None:
    said = _in_fork(up.endpoint, connected).splitlines()
    assert len(said) == 2
    assert all("forked from one with a connection" in line and "spawn" in line for line in said)
    assert connected.status(), "the connection of the first process still works"
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(_connect_again, (up.endpoint,)) == "connected"
