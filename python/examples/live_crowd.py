"""A live crowd: people walk as they were recorded (UCY zara01), played into the world tick by tick from here.

Start a deployment first: ``curionav up deploy/local.toml``. Then: ``python python/examples/live_crowd.py``
``python -m curionav.datasets peds_eth_ucy`` downloads the recording.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

import curionav
from curionav.datasets import locate

STREET = Path(__file__).parents[2] / "scenarios" / "real" / "zara01.toml"
FRAMES_PER_SECOND = 25.0


class Recording:
    """People of a recording: columns frame, id, x, z, y, vx, vz, vy; m and m/s."""

    def __init__(self, file: Path, start_s: float) -> None:
        rows = np.loadtxt(file)
        self.start_s = start_s
        self.tracks = {int(person): rows[rows[:, 1] == person][:, [0, 2, 4, 5, 7]] for person in np.unique(rows[:, 1])}

    def __call__(self, step: curionav.CrowdStep) -> tuple[list[float], ...]:
        """The people who are there at this step: x, y, vx, vy and id of each."""
        frame = (self.start_s + step.time) * FRAMES_PER_SECOND
        here = {p: track for p, track in self.tracks.items() if track[0, 0] <= frame <= track[-1, 0]}
        columns = [[float(np.interp(frame, t[:, 0], t[:, k])) for t in here.values()] for k in range(1, 5)]
        return (*columns, list(here))


def main() -> int:
    """Runs the street scenario with the recording as its crowd."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router of the deployment")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scenario = curionav.Scenario.load(STREET)
    recorded = scenario.data.pop("recorded")[0]
    crowd = Recording(locate(recorded["file"]), recorded["start_s"])
    with curionav.connect(options.connect) as c, c.inject(scenario, seed=options.seed, crowd=crowd) as run:
        for report in run:
            print(f"{report.scene.stamp:5.1f} s  {len(report.scene.people.id)} people near, {report.decision.action}")
        result = run.wait()
    print(f"{result.outcome}: {result.people.id.size} people, the nearest came to {result.measures.md_m:.2f} m")
    return 0


if __name__ == "__main__":
    sys.exit(main())
