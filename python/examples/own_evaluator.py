"""An evaluator of one's own: people are passed on the right. Prints how the way changes.

Start a deployment first: ``curionav up deploy/local.toml``. Then: ``python python/examples/own_evaluator.py``
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import curionav

FOYER = Path(__file__).parents[2] / "scenarios" / "quickstart.toml"


@curionav.evaluator("keep-right")
def keep_right(scene: curionav.Scene, candidates: curionav.CandidateSet) -> NDArray[np.float64]:
    """Metres short of 4 m to people on the robot's right, summed over states; people walk on as they do."""
    cost = np.zeros(candidates.count)
    ahead = candidates.dt * np.arange(1, candidates.steps + 1)
    people = scene.people
    for x, y, vx, vy in zip(people.x, people.y, people.vx, people.vy, strict=True):
        east, north = x + vx * ahead - candidates.x, y + vy * ahead - candidates.y
        is_right = np.sin(candidates.heading) * east > np.cos(candidates.heading) * north
        cost += np.where(is_right, np.maximum(4.0 - np.hypot(east, north), 0.0), 0.0).sum(axis=1)
    return cost


def main() -> int:
    """The same scenario without and with the term."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router of the deployment")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scenario = curionav.Scenario.load(FOYER)
    scenario.data["walkers"] = [{"route": [[9.5, 4.1], [1.5, 4.1]], "speed": 0.6, "mode": "once"}]
    scenario.data["robot"].update(goal=[10.5, 4.4], initial_sigma=[0.1, 0.1, 0.05])
    with curionav.connect(options.connect) as deployment, deployment.serve(keep_right) as server:
        ways = []
        for name, asked in [("without", scenario), ("with", scenario.with_term("keep-right", weight=2.0))]:
            with deployment.inject(asked, seed=options.seed) as run:
                result = run.wait()
            way = np.column_stack([result.trace["true_x"], result.trace["true_y"]])
            person = result.people.xy[:, 0]
            meeting = np.argmin(np.hypot(*(way - person).T))
            side = way[meeting, 1] - person[meeting, 1]
            print(f"{name:7} the term: {result.outcome}, passes {abs(side):.2f} m {'left' if side > 0 else 'right'}")
            ways.append(way)
    shorter = min(map(len, ways))
    apart = np.hypot(*(ways[0][:shorter] - ways[1][:shorter]).T).max()
    print(f"the ways are up to {apart:.2f} m apart; {server.answered} questions answered in Python")
    return 0


if __name__ == "__main__":
    sys.exit(main())
