"""Ctrl-C anywhere ends a program soon, with its run cancelled and nothing left behind."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from live import Up, deployment

import curionav

pytestmark = pytest.mark.live

PREAMBLE = """
import sys, threading, time
sys.path.insert(0, sys.argv[3])
import curionav
from live import hall
from pathlib import Path
directory = Path(sys.argv[2])
scenario = curionav.Scenario.from_dict(hall(directory), directory)
deployment = curionav.connect(sys.argv[1])
def here(*ignored): print("here", flush=True)
def hang(*ignored):
    here()
    while True: time.sleep(1.0)
def watch(run):
    next(run.reports())
    here()
    return run
slowly = dict(clock="realtime", time_scale=0.2)
"""

# What a program does when it is interrupted, once it has said "here".
PLACES = {
    "waiting for a run": "with deployment.inject(scenario, **slowly) as run: watch(run).wait()",
    "following decisions": "with deployment.inject(scenario, **slowly) as run: list(watch(run).decisions())",
    "waiting for ticks of a world": "with deployment.crowd() as crowd:\n    here()\n    for step in crowd: pass",
    "while its crowd hangs": "with deployment.inject(scenario, crowd=hang) as run: run.wait()",
    "serving": "with deployment.serve(curionav.Evaluator('idle', lambda s, c: c.v.sum(axis=1))) as server:\n"
    "    here()\n    server.wait()",
    "while its evaluator hangs": "with deployment.serve(curionav.Evaluator('hung', lambda s, c: hang())):\n"
    "    with deployment.inject(scenario.with_term('hung')) as run: run.wait()",
    "without closing anything": "run = deployment.inject(scenario, **slowly)\nwatch(run)\ntime.sleep(60)",
}


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("interrupts")


@pytest.fixture(scope="module")
def up(directory: Path) -> Iterator[Up]:
    with deployment(directory) as running:
        yield running


@pytest.mark.parametrize("place", PLACES)
def test_ctrl_c_ends_a_program(up: Up, directory: Path, place: str) -> None:
    arguments = [
        sys.executable,
        "-c",
        PREAMBLE + PLACES[place],
        up.endpoint,
        str(directory),
        str(Path(__file__).parent),
    ]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "here\n"
            started = time.monotonic()
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=20)
        finally:
            process.kill()
    assert time.monotonic() - started < 10.0
    assert "KeyboardInterrupt" in errors
    assert process.returncode != 0
    with curionav.connect(up.endpoint) as connection:
        assert not {s.role for s in connection.status()} & {"idle", "hung"}, "its replicas are gone"
        if "inject" in PLACES[place]:
            if place == "without closing anything":
                connection.cancel()
            assert connection.mission().state in ("cancelled", "finished")
