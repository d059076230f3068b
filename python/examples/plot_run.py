"""Runs a scenario with the program, and draws the run from above.

Needs the extra ``frames``: ``pip install './python[frames]'``. Then, in a checkout:
``python python/examples/plot_run.py scenarios/quickstart.toml run.png``
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import curionav

PROGRAM = os.environ.get("CURIONAV_BIN", "curionav")


def main() -> int:
    """Exit status: 0 there is a picture, 2 there was no run or it could not be drawn."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", help="scenario file (TOML), or `quickstart`")
    parser.add_argument("picture", help="file to write: .png, .svg or .pdf")
    parser.add_argument("--planner", default=None, help="built-in profile or profile file; default: the scenario's")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "run.mcap"
        command = [PROGRAM, "run", options.scenario, "--seed", str(options.seed), "--json", "--record", recording]
        command += ["--planner", options.planner] if options.planner else []
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        if not done.stdout:  # no run; the program has said why
            return 2
        try:
            result = curionav.Result.load(recording)
            result.plot()
        except curionav.CurionavError as error:
            print(error, file=sys.stderr)
            return 2
    plt.savefig(options.picture, dpi=150)
    people = result.people_to_pandas()
    print(f"{json.loads(done.stdout)['outcome']}: {len(result.to_pandas())} ticks, {people['id'].nunique()} people")
    return 0


if __name__ == "__main__":
    sys.exit(main())
