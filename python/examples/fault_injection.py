"""Injects faults: an evaluator that raises, then is late, then gives no numbers. Prints what the robot does about it.

Start a deployment first: ``curionav up deploy/local.toml``. Then: ``python python/examples/fault_injection.py``
"""

from __future__ import annotations

import argparse
import logging
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import curionav

FOYER = Path(__file__).parents[2] / "scenarios" / "quickstart.toml"
FAULTS = [(3.0, 4.0, "raises"), (7.0, 8.0, "late"), (11.0, 12.0, "nan")]  # from, until (s of the scene), what


@curionav.evaluator("smooth")
def smooth(scene: curionav.Scene, candidates: curionav.CandidateSet) -> NDArray[np.float64]:
    """Turning, in rad/s over all states; at times it fails."""
    fault = next((what for since, until, what in FAULTS if since <= scene.stamp < until), None)
    if fault == "raises":
        raise RuntimeError("injected")
    if fault == "late":
        time.sleep(0.2)
    cost = np.abs(candidates.omega).sum(axis=1)
    return np.full_like(cost, np.nan) if fault == "nan" else cost


def main() -> int:
    """Exit status 0 if the robot stopped or held whenever it had to, and still arrived."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router of the deployment")
    parser.add_argument("--speed", type=float, default=1.0, help="simulated seconds per second")
    options = parser.parse_args()
    logging.getLogger("curionav").setLevel(logging.CRITICAL)  # the faults are ours
    scenario = curionav.Scenario.load(FOYER).with_term("smooth", weight=0.2)
    with curionav.connect(options.connect) as deployment, deployment.serve(smooth) as server:
        with deployment.inject(scenario, clock="realtime", time_scale=options.speed) as run:
            before = ""
            for decision in run.decisions():
                now = f"{decision.action:6} {curionav.say_all('degradation', decision.degraded) or 'nominal'}"
                if now != before:
                    print(f"{decision.stamp:5.1f} s  {now}")
                before = now
            result = run.wait()
        print(f"{result.outcome}; refused: {dict(server.refused)}; {result.cycles.degraded} cycles degraded")
    return 0 if result.outcome == "reached" and result.cycles.degraded else 1


if __name__ == "__main__":
    sys.exit(main())
