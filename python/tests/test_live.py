"""Against a real deployment: router and services as processes of the built program."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT, validator
from live import RUN_TIMEOUT, Up, deployment, hall, interrupted

import curionav
from curionav import Scenario

pytestmark = pytest.mark.live


def test_a_run_gives_every_cycle_and_a_result(connected: curionav.Deployment, scenario: Scenario) -> None:
    with connected.inject(scenario, seed=3) as run:
        reports = list(run)
        decisions = list(run.decisions())
        result = run.wait(RUN_TIMEOUT)
    assert result.outcome == "reached"
    assert (result.scenario, result.seed) == ("hall", 3)
    assert len(decisions) == result.cycles.count
    assert len(reports) == result.cycles.count
    assert (run.lost, run.refused) == (0, 0)
    assert reports[0].scene.tick == 0
    assert [(r.epoch, r.seq) for r in reports] == sorted({(r.epoch, r.seq) for r in reports})
    for report, decision in zip(reports, decisions, strict=True):
        assert report.decision == decision
        assert report.candidates.x.shape == (report.candidates.count, report.candidates.steps)
        assert report.total.shape == (report.candidates.count,)
        if report.chosen is not None:
            kept = [why is None for why in report.rejected]
            assert report.total[report.chosen] == report.total[kept].min()
            assert report.driven is None or report.driven.stamp <= report.scene.stamp
    assert decisions[-1].arrived
    rows = result.trace["time_s"].size
    assert {values.shape for values in result.trace.values()} == {(rows,)}
    assert np.allclose(np.diff(result.trace["time_s"]), 0.1)
    assert result.people.xy.shape == (rows, 1, 2)
    assert run.status().state == "finished"
    validator("run_status").validate_cbor(run.status().encode())
    validator("cycle_report").validate_cbor(reports[-1].encode())
    grid = connected.grid(reports[0].map)
    assert grid.cells.shape == (60, 120)


def test_progress_ends_with_the_run(connected: curionav.Deployment, scenario: Scenario) -> None:
    with connected.inject(scenario, seed=1003, clock="realtime", time_scale=4.0) as run:
        told = list(run.progress())
    assert len(told) > 3
    assert told[-1].state == "finished"
    assert [status.tick for status in told] == sorted(status.tick for status in told)
    assert told[-1].distance_to_goal < 0.6 < told[0].distance_to_goal or told[0].state == "preparing"


def test_equal_seeds_give_equal_decisions(connected: curionav.Deployment, scenario: Scenario) -> None:
    digests = []
    for seed in (1, 1, 2):
        with connected.inject(scenario, seed=seed) as run:
            digests.append(run.wait(RUN_TIMEOUT).decisions_sha256)
    assert digests[0] == digests[1] != digests[2]


def test_the_quickstart_scenario_reaches_its_goal(connected: curionav.Deployment) -> None:
    path = ROOT / "scenarios" / "quickstart.toml"
    if not path.is_file():
        pytest.skip(f"no {path}")
    with connected.inject(path) as run:
        cycles = sum(1 for _ in run)
        result = run.wait(RUN_TIMEOUT)
    assert result.outcome == "reached"
    assert cycles == result.cycles.count


def test_the_example_prints_the_measures(up: Up) -> None:
    path = ROOT / "scenarios" / "quickstart.toml"
    if not path.is_file():
        pytest.skip(f"no {path}")
    example = ROOT / "python" / "examples" / "inject_scenario.py"
    done = subprocess.run(
        [sys.executable, example, path, "--connect", up.endpoint],
        capture_output=True, text=True, timeout=RUN_TIMEOUT, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "reached" in done.stdout
    assert "rmse_m" in done.stdout


@pytest.mark.parametrize(
    ("change", "planner", "field", "reason"),
    [
        ({"robot": {"start": [2, 3, 0], "goal": [60, 3]}}, None, "robot.goal", "outside the map"),
        ({"walkers": [{"route": [[8, 1], [80, 5]]}]}, None, "walkers[0].route[0]", "touches a wall"),
        ({"wheels": 4}, None, "wheels", "unknown"),
        ({"profile": {"steps": 0}}, None, "profile.steps", "1 to"),
        ({}, {"dt": -1.0}, "profile.dt", "give 0.02 to 2 s"),
    ],
)
def test_a_bad_scenario_is_rejected_with_field_and_reason(
    connected: curionav.Deployment,
    directory: Path,
    change: dict[str, Any],
    planner: dict[str, Any] | None,
    field: str,
    reason: str,
) -> None:
    bad = Scenario.from_dict(hall(directory) | change, directory)
    for ask in (connected.inject, connected.validate):
        with pytest.raises(curionav.Rejected) as refusal:
            ask(bad, planner)
        assert refusal.value.field == field
        assert reason in refusal.value.reason
        assert refusal.value.code == "invalid"


def test_a_planner_that_is_not_there_is_told_before_anything_is_sent(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    for ask in (connected.inject, connected.validate):
        with pytest.raises(curionav.ScenarioError, match="use one of curiosity") as error:
            ask(scenario, "no-such-planner")
        assert error.value.field == "planner"


def test_a_profile_of_ones_own_is_driven_with(connected: curionav.Deployment, scenario: Scenario) -> None:
    own = {"name": "mine", "terms": {"distance": {"scale": 2}}}
    with connected.inject(scenario, own, seed=3) as run:
        report = next(iter(run))
        assert [term.term for term in report.terms] == ["distance"]
        profile = connected.mission().order.profile
    assert (profile["name"], profile["steps"]) == ("mine", 13)


def test_a_good_scenario_is_valid_and_checking_it_runs_nothing(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    with connected.inject(scenario, clock="realtime") as run:
        connected.validate(scenario.with_term("comfort").with_live_people())
        assert run.status().state in ("preparing", "running")


def test_a_world_that_is_not_simulated_is_not_waited_for(connected: curionav.Deployment, scenario: Scenario) -> None:
    started = time.monotonic()
    with pytest.raises(curionav.NoAnswer, match="nowhere"):
        connected.inject(scenario, world="nowhere")
    assert time.monotonic() - started < 5.0


def test_leaving_the_block_cancels_a_run_under_way(connected: curionav.Deployment, scenario: Scenario) -> None:
    with connected.inject(scenario, clock="realtime") as run:
        next(run.reports())
        with pytest.raises(curionav.Rejected, match="under way") as refusal:
            connected.inject(scenario)
        assert refusal.value.code == "busy"
        with pytest.raises(TimeoutError):
            run.wait(0.01)
    assert run.status().state == "failed"
    with pytest.raises(curionav.RunFailed, match="cancelled") as failed:
        run.wait(RUN_TIMEOUT)
    assert failed.value.end == {"code": "cancelled"}


def test_a_robot_pauses_goes_on_and_takes_another_goal(connected: curionav.Deployment, scenario: Scenario) -> None:
    with connected.inject(scenario, clock="realtime", time_scale=4.0) as run:
        next(run.reports())
        connected.pause()
        assert connected.lease().paused and connected.mission().state == "paused"
        connected.resume()
        assert not connected.lease().paused and connected.mission().state == "running"
        mission = connected.goal(5.0, 4.0)
        assert (mission.order.goal_x, mission.order.goal_y) == (5.0, 4.0)
        result = run.wait(RUN_TIMEOUT)
    assert result.outcome == "reached"
    # Within the tolerance of 0.5 m, as far as the robot knows where it is.
    assert np.hypot(result.trace["true_x"][-1] - 5.0, result.trace["true_y"][-1] - 4.0) < 0.8


def test_every_service_is_listed_once(up: Up, connected: curionav.Deployment) -> None:
    services = connected.status()
    assert len({(s.role, s.instance) for s in services}) == len(services) == len(up.pids) - 1
    assert {"arbiter", "cnc", "cpc", "driver", "generator", "localizer", "simulator"} <= {s.role for s in services}
    counts = {s.role: s.status for s in services}["cpc"]
    assert counts is not None
    assert counts.role == "cpc"


def test_closing_twice_is_harmless_and_nothing_works_afterwards(up: Up) -> None:
    connection = curionav.connect(up.endpoint)
    connection.close()
    connection.close()
    with pytest.raises(curionav.CurionavError, match="closed"):
        connection.mission()


def test_another_namespace_is_another_deployment(up: Up) -> None:
    with curionav.connect(up.endpoint, namespace="elsewhere") as connection:
        assert connection.status() == []


def test_a_configuration_file_says_where_to_connect(up: Up, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "client.json5"
    file.write_text(
        f'{{ mode: "client", connect: {{ endpoints: ["{up.endpoint}"] }}, '
        "scouting: { multicast: { enabled: false } } }"
    )
    with curionav.connect(config=file) as connection:
        assert connection.status()
    monkeypatch.setenv("ZENOH_CONFIG", str(file))
    with curionav.connect() as connection:
        assert connection.status()
    file.write_text("{ no_such_field: 1 }")
    with pytest.raises(curionav.ConnectionFailed, match="configuration"):
        curionav.connect()


def test_a_program_that_forgets_to_close_still_ends(up: Up) -> None:
    code = f"import curionav; c = curionav.connect({up.endpoint!r}); print(len(c.status()))"
    started = time.monotonic()
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, str(len(up.pids) - 1), "")
    assert time.monotonic() - started < 8.0, "it waited for callbacks that can no longer run"


def test_ctrl_c_ends_a_program_that_follows_a_run_and_cancels_the_run(
    up: Up, connected: curionav.Deployment, directory: Path
) -> None:
    code = """
with curionav.connect(endpoint) as deployment, deployment.inject(scenario, **slowly) as run:
    for report in run: here()
"""
    interrupted(code, up, directory)
    assert connected.mission().state in ("cancelled", "finished")


def test_a_lost_simulator_ends_the_run_with_a_reason(tmp_path: Path) -> None:
    with deployment(tmp_path) as running, curionav.connect(running.endpoint) as connection:
        run = connection.inject(Scenario.from_dict(hall(tmp_path), tmp_path), clock="realtime")
        os.kill(running.pids["simulator-0"], signal.SIGKILL)
        with pytest.raises(curionav.RunFailed, match=r"gone|lost"):
            run.wait(30.0)


def test_an_interrupt_ends_the_deployment_and_all_its_processes(tmp_path: Path) -> None:
    with deployment(tmp_path, namespace="tenant") as running:
        with curionav.connect(running.endpoint, namespace="tenant") as connection:
            assert len(connection.status()) == len(running.pids) - 1
        assert running.stop() == 0
        for name, pid in running.pids.items():
            with pytest.raises(ProcessLookupError):
                os.kill(pid, 0)
                pytest.fail(f"{name} is still there")


@pytest.fixture
def dead_endpoint() -> Iterator[str]:
    """A port that is taken but not listened on."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"tcp/127.0.0.1:{taken.getsockname()[1]}"


def test_a_dead_port_is_an_error_within_the_timeout(dead_endpoint: str) -> None:
    started = time.monotonic()
    with pytest.raises(ConnectionError, match=dead_endpoint):
        curionav.connect(dead_endpoint, timeout=0.5)
    assert time.monotonic() - started < 3.0


def test_a_port_that_accepts_and_says_nothing_is_an_error_within_the_timeout() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        endpoint = f"tcp/127.0.0.1:{silent.getsockname()[1]}"
        started = time.monotonic()
        with pytest.raises(curionav.ConnectionFailed, match=endpoint):
            curionav.connect(endpoint, timeout=0.5)
        assert time.monotonic() - started < 3.0


def test_ctrl_c_ends_an_attempt_to_connect(dead_endpoint: str) -> None:
    started = time.monotonic()
    timer = threading.Timer(0.3, os.kill, [os.getpid(), signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        curionav.connect(dead_endpoint, timeout=10.0)
    timer.join()
    assert time.monotonic() - started < 5.0
