"""Evaluators in Python as replicas of a real deployment."""

from __future__ import annotations

import dataclasses
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live import RUN_TIMEOUT, Up, program

import curionav
from curionav import CandidateSet, Decision, Scenario, Scene
from curionav.evaluation import Evaluator

pytestmark = pytest.mark.live


def left_of_centre(scene: Scene, candidates: CandidateSet) -> Any:
    """Metres above the hall's centre line, over all states."""
    return np.maximum(candidates.y - 3.0, 0.0).sum(axis=1)


KEEP = Evaluator("keep-right", left_of_centre)
NOT_EVALUATED = {"code": "not_evaluated", "term": "keep-right"}


def driven(
    connected: curionav.Deployment, scenario: Scenario, seed: int = 1001
) -> tuple[curionav.Result, list[Decision]]:
    with connected.inject(scenario, seed=seed) as run:
        decisions = list(run.decisions())
        return run.wait(RUN_TIMEOUT), decisions


def test_one_line_of_the_profile_takes_it_in_and_the_way_changes(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    plain, _ = driven(connected, scenario)
    with connected.serve(KEEP) as server:
        assert {(s.role, s.instance) for s in connected.status()} >= {("keep-right", server.instance)}
        with connected.inject(scenario.with_term("keep-right", weight=3.0, scale=0.2), seed=1001) as run:
            reports = list(run)
            kept = run.wait(RUN_TIMEOUT)
        assert (server.answered, sum(server.refused.values())) == (kept.cycles.count + 1, 0)
    assert kept.cycles.degraded == 0
    for report in reports:
        term = next(t for t in report.terms if t.term == "keep-right")
        assert term.evaluated == "pool"
        assert np.allclose(term.raw, left_of_centre(report.scene, report.candidates))
    assert kept.decisions_sha256 != plain.decisions_sha256
    assert kept.trace["true_y"].mean() < plain.trace["true_y"].mean()
    # Its token is gone with it.
    assert "keep-right" not in {s.role for s in connected.status()}


def test_replicas_change_no_decision(up: Up, connected: curionav.Deployment, scenario: Scenario) -> None:
    term = scenario.with_term("keep-right", weight=3.0, scale=0.2)
    with connected.serve(KEEP):
        one, _ = driven(connected, term)
    with curionav.connect(up.endpoint) as other, connected.serve(KEEP, slots=2) as a, other.serve(KEEP) as b:
        two, _ = driven(connected, term)
        assert a.answered > 1
        assert b.answered > 1
    assert one.decisions_sha256 == two.decisions_sha256


class Flaky:
    """Right until a scene at or after ``since``, in seconds, then as ``wrong`` has it; until ``mended``."""

    def __init__(self, wrong: Callable[[CandidateSet], Any], since: float = 1.0, until: float = 1e9) -> None:
        self.wrong, self.since, self.until = wrong, since, until
        self.failed = 0

    def __call__(self, scene: Scene, candidates: CandidateSet) -> Any:
        if self.since <= scene.stamp < self.until:
            self.failed += 1
            return self.wrong(candidates)
        return left_of_centre(scene, candidates)


def raising(candidates: CandidateSet) -> Any:
    raise RuntimeError("out of comfort")


FAULTS = {
    "raises": raising,
    "shape": lambda candidates: np.zeros(candidates.count + 1),
    "nan": lambda candidates: np.full(candidates.count, np.nan),
    "negative": lambda candidates: np.full(candidates.count, -1.0),
    "nothing": lambda candidates: None,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_function_that_fails_is_handled_as_any_failing_replica(
    connected: curionav.Deployment, scenario: Scenario, fault: str
) -> None:
    flaky = Flaky(FAULTS[fault], since=0.9, until=1.3)
    with connected.serve(Evaluator("keep-right", flaky)) as server:
        result, decisions = driven(connected, scenario.with_term("keep-right"))
        assert flaky.failed >= 1
        assert server.refused["failed"] == flaky.failed
        assert server.last_failure
    degraded = [d for d in decisions if d.degraded]
    assert degraded, "it is told"
    assert all(0.8 < d.stamp < 1.6 for d in degraded)
    assert all(d.degraded == [NOT_EVALUATED] and d.action != "follow" for d in degraded)
    assert result.outcome == "reached", "and the robot goes on once it is well again"


def test_another_replica_takes_over_from_one_that_fails(
    up: Up, connected: curionav.Deployment, scenario: Scenario
) -> None:
    term = scenario.with_term("keep-right", weight=3.0, scale=0.2)
    with connected.serve(KEEP):
        alone, _ = driven(connected, term)
    flaky = Flaky(raising, since=0.3)

    def slow(scene: Scene, candidates: CandidateSet) -> Any:
        time.sleep(0.02)  # a robot prefers the other, as long as that works
        return KEEP(scene, candidates)

    with (
        curionav.connect(up.endpoint) as other,
        connected.serve(Evaluator("keep-right", slow)),
        other.serve(Evaluator("keep-right", flaky)) as broken,
    ):
        result, decisions = driven(connected, term)
        assert broken.refused["failed"] >= 1
    assert not any(d.degraded for d in decisions)
    assert result.decisions_sha256 == alone.decisions_sha256


def test_one_that_is_late_in_real_time_is_handled_as_any_failing_replica(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    def slow(candidates: CandidateSet) -> Any:
        time.sleep(0.3)
        return np.zeros(candidates.count)

    flaky = Flaky(slow, since=1.0, until=2.0)
    with (
        connected.serve(Evaluator("keep-right", flaky)) as server,
        connected.inject(scenario.with_term("keep-right"), seed=1001, clock="realtime") as run,
    ):
        decisions = list(run.decisions())
        run.wait(RUN_TIMEOUT)
        assert server.refused["stopped"] >= 1
        assert "budget" in (server.last_failure or "")
    late = [d for d in decisions if 1.0 <= d.stamp < 2.0]
    assert late
    assert any(NOT_EVALUATED in d.degraded for d in late)
    # The function takes 300 ms, a cycle's evaluation at most 40: no cycle waits for it, even on a busy machine.
    assert min(d.elapsed_us for d in late if d.degraded) < 250_000
    assert any(d.arrived for d in decisions)


def test_one_that_never_works_refuses_the_mission_with_the_reason(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    ranked = Evaluator("keep-right", lambda scene, candidates: candidates.v.sum(axis=1) / (1.0 + candidates.v.max()))
    with (
        connected.serve(ranked) as server,
        pytest.raises(curionav.RunFailed, match=r"no replica of `keep-right` became ready: .* neighbours") as failed,
        connected.inject(scenario.with_term("keep-right")) as run,
    ):
        run.wait(RUN_TIMEOUT)
    assert refused_for_want_of_a_replica(failed.value)
    assert server.answered == 0


def refused_for_want_of_a_replica(failed: curionav.RunFailed) -> bool:
    assert failed.end is not None
    why = failed.end["reject"].why
    return (failed.end["code"], why["code"], why["term"]) == ("unprepared", "no_replica", "keep-right")


def test_a_term_that_no_replica_computes_refuses_the_mission_with_the_reason(
    connected: curionav.Deployment, scenario: Scenario
) -> None:
    with (
        pytest.raises(curionav.RunFailed, match=r"no replica of `keep-right` became ready: none is alive") as failed,
        connected.inject(scenario.with_term("keep-right")) as run,
    ):
        run.wait(RUN_TIMEOUT)
    assert refused_for_want_of_a_replica(failed.value)


def test_a_full_queue_refuses_at_once_and_closing_answers_what_waits(up: Up, scenario: Scenario) -> None:
    from test_evaluation import request, warm_up  # noqa: PLC0415

    from curionav import keys  # noqa: PLC0415
    from curionav.messages import Scores  # noqa: PLC0415
    from curionav.session import ask  # noqa: PLC0415

    go = threading.Event()
    # None is late, however long it is held.
    asked = dataclasses.replace(request(), budget_ms=10_000)

    def held(scene: Scene, candidates: CandidateSet) -> Any:
        if scene.stamp == asked.scene.stamp and candidates.count == asked.candidates.count:
            go.wait(10.0)
        return np.zeros(candidates.count)

    with curionav.connect(up.endpoint) as serving, curionav.connect(up.endpoint) as asking:
        server = serving.serve(Evaluator("held", held), "one", slots=1, queue=2)
        key = keys.question("held", "one", "r1")
        wait_for(lambda: any(s.instance == "one" for s in asking.status()))
        with pytest.raises(curionav.Rejected) as cold:
            ask(asking._session, key, Scores, asked, 5.0)
        assert cold.value.code == "cold"
        go.set()
        ask(asking._session, key, Scores, warm_up(), 5.0)
        go.clear()
        outcomes: list[str] = []

        def one() -> None:
            try:
                scores = ask(asking._session, key, Scores, asked, 8.0)
                outcomes.append(f"scored {scores.cost.size}")
            except curionav.Rejected as refusal:
                outcomes.append(refusal.code)

        threads = [threading.Thread(target=one) for _ in range(6)]
        for thread in threads:
            thread.start()
        wait_for(lambda: len(outcomes) >= 3, 5.0)
        # One is computed, two wait, three found no room and were told so while the others still wait.
        assert outcomes == ["overloaded"] * 3
        assert server.status().load == 3.0
        go.set()
        server.close()
        for thread in threads:
            thread.join()
        assert len(outcomes) == 6
        assert set(outcomes[3:]) <= {f"scored {asked.candidates.count}", "stopped"}
        server.close()


def test_a_question_names_its_robot_by_the_last_chunk_of_its_key(up: Up) -> None:
    from test_evaluation import warm_up  # noqa: PLC0415

    from curionav import keys  # noqa: PLC0415
    from curionav.messages import Scores  # noqa: PLC0415
    from curionav.session import ask  # noqa: PLC0415

    with curionav.connect(up.endpoint) as serving, curionav.connect(up.endpoint) as asking:
        server = serving.serve(KEEP, "one")
        wait_for(lambda: any(s.instance == "one" for s in asking.status()))
        scores = ask(asking._session, keys.question("keep-right", "one", "r1"), Scores, warm_up(), 5.0)
        assert (scores.term, scores.instance, scores.slots) == ("keep-right", "one", 1)
        for robot in ("*", "R1"):
            key = keys.questions("keep-right", "one").replace("*", robot)
            with pytest.raises(curionav.Rejected) as refusal:
                ask(asking._session, key, Scores, warm_up(), 5.0)
            assert refusal.value.code == "wrong_robot"
        assert server.refused["wrong_robot"] == 2


def test_what_is_no_question_is_refused_with_what_is_wrong(up: Up) -> None:
    from test_evaluation import request  # noqa: PLC0415

    from curionav import keys  # noqa: PLC0415
    from curionav.messages import Scores  # noqa: PLC0415
    from curionav.session import ask  # noqa: PLC0415

    with curionav.connect(up.endpoint) as serving, curionav.connect(up.endpoint) as asking:
        serving.serve(KEEP, "one")
        wait_for(lambda: any(s.instance == "one" for s in asking.status()))
        key = keys.question("keep-right", "one", "r1")
        for asked, code in [(None, "malformed"), (request().scene, "wrong_encoding"), (request(), "cold")]:
            with pytest.raises(curionav.Rejected) as refusal:
                ask(asking._session, key, Scores, asked, 5.0)
            assert refusal.value.code == code


def test_closing_the_connection_ends_what_was_served_and_played(up: Up) -> None:
    before = set(threading.enumerate())
    connection = curionav.connect(up.endpoint)
    server, crowd = connection.serve(KEEP, slots=3), connection.crowd()
    connection.close()
    assert server.wait(0.0)
    assert list(crowd) == []
    assert set(threading.enumerate()) <= before
    server.close()
    crowd.close()


def test_a_replica_comes_back_with_its_router() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"

    def router() -> subprocess.Popen[bytes]:
        return subprocess.Popen([program(), "router", "--listen", endpoint], stdout=subprocess.DEVNULL)

    def seen() -> bool:
        try:
            with curionav.connect(endpoint, timeout=1.0) as other:
                return replicas(other) == 1
        except curionav.ConnectionFailed:
            return False

    process = router()
    try:
        with curionav.connect(endpoint, timeout=20.0) as connection, connection.serve(KEEP):
            wait_for(seen)
            process.kill()
            process.wait()
            assert not seen()
            process = router()
            wait_for(seen)
    finally:
        process.kill()
        process.wait()


FILE = """
import curionav, numpy as np, os

@curionav.evaluator("keep-right")
def keep_right(scene, candidates):
    if os.path.exists({crash!r}) and scene.stamp > 0.5:
        os.remove({crash!r})
        os._exit(1)
    return np.maximum(candidates.y - 3.0, 0.0).sum(axis=1)
"""


def replicas(connected: curionav.Deployment) -> int:
    return sum(1 for s in connected.status() if s.role == "keep-right")


def wait_for(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come to pass"
        time.sleep(0.05)


def start(up: Up, file: Path, *arguments: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "curionav.serve", str(file), "--connect", up.endpoint, *arguments]
    return subprocess.Popen(command, start_new_session=True)


def test_replicas_are_processes_that_are_started_again_and_end_together(
    up: Up, connected: curionav.Deployment, scenario: Scenario, tmp_path: Path
) -> None:
    crash = tmp_path / "crash"
    file = tmp_path / "comfort.py"
    file.write_text(FILE.format(crash=str(crash)))
    process = start(up, file, "--replicas", "2")
    try:
        wait_for(lambda: replicas(connected) == 2)
        crash.touch()
        result, decisions = driven(connected, scenario.with_term("keep-right", weight=3.0, scale=0.2))
        assert result.outcome == "reached"
        assert not crash.exists(), "one has ended in mid-question"
        assert not any(d.degraded for d in decisions), "the other one took over"
        wait_for(lambda: replicas(connected) == 2)
        process.send_signal(signal.SIGINT)
        assert process.wait(10.0) == 0
        wait_for(lambda: replicas(connected) == 0, 5.0)
    finally:
        process.kill()
        process.wait()
    # Killed without a chance to say so: the replicas notice.
    process = start(up, file, "--replicas", "2")
    wait_for(lambda: replicas(connected) == 2)
    process.kill()
    process.wait()
    wait_for(lambda: replicas(connected) == 0, 5.0)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_a_replica_even_while_it_computes(
    up: Up, connected: curionav.Deployment, tmp_path: Path, number: signal.Signals
) -> None:
    file = tmp_path / "endless.py"
    file.write_text(
        "import curionav, time\n@curionav.evaluator('keep-right')\n"
        "def endless(scene, candidates):\n    while True: time.sleep(0.01)\n"
    )
    process = start(up, file)
    try:
        wait_for(lambda: replicas(connected) == 1)
        process.send_signal(number)
        assert process.wait(10.0) == 0
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize(
    ("text", "status", "reason"),
    [("x = 1\n", 2, "no function in it"), ("1 / 0\n", 2, "ZeroDivisionError"), (None, 2, "FileNotFound")],
)
def test_a_file_without_evaluators_is_bad_input(
    up: Up, tmp_path: Path, text: str | None, status: int, reason: str
) -> None:
    file = tmp_path / "empty.py"
    if text is not None:
        file.write_text(text)
    command = [sys.executable, "-m", "curionav.serve", str(file), "--connect", up.endpoint]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == status
    assert reason in done.stderr
    assert "Traceback" not in done.stderr
    assert os.path.basename(file) in done.stderr  # noqa: PTH119
