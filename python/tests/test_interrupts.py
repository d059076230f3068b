"""Ctrl-C anywhere ends a program soon, with its run cancelled and nothing left behind."""

from __future__ import annotations

from pathlib import Path

import pytest
from live import Up, interrupted

import curionav

pytestmark = pytest.mark.live

PREAMBLE = """
deployment = curionav.connect(endpoint)
def hang(*ignored):
    here()
    while True: time.sleep(1.0)
def watch(run):
    next(run.reports())
    here()
    return run
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
    "while its injection is answered": "from curionav import injected_run as runs\n"
    "class Slow(runs.Asked):\n"
    "    def wait(self, timeout):\n"
    "        if timeout == runs.SCENARIO_TIMEOUT: here(); time.sleep(60)\n"
    "        time.sleep(1.0)  # the run's first status comes before the answer is read\n"
    "        return super().wait(timeout)\n"
    "runs.Asked = Slow\n"
    "deployment.inject(scenario, **slowly)",
    "without closing anything": "run = deployment.inject(scenario, **slowly)\nwatch(run)\ntime.sleep(60)",
}


@pytest.mark.parametrize("place", PLACES)
def test_ctrl_c_ends_a_program(up: Up, directory: Path, place: str) -> None:
    interrupted(PREAMBLE + PLACES[place], up, directory)
    with curionav.connect(up.endpoint) as connection:
        assert not {s.role for s in connection.status()} & {"idle", "hung"}, "its replicas are gone"
        if "inject" in PLACES[place]:
            if place == "without closing anything":
                connection.cancel()
            assert connection.mission().state in ("cancelled", "finished")
