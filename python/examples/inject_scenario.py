"""Injects a scenario into a running deployment, follows it and prints its measures.

Start the deployment first: ``curionav up deploy/local.toml``. Then:
``python python/examples/inject_scenario.py scenarios/quickstart.toml``
"""

from __future__ import annotations

import argparse
import dataclasses
import sys

import numpy as np

import curionav


def main() -> int:
    """Exit status: 0 reached without collision, 1 ran but failed, 2 bad input, 3 lost the deployment, 130 Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", help="scenario file (TOML)")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router of the deployment")
    parser.add_argument("--namespace", help="key prefix of the deployment")
    parser.add_argument("--planner", help="built-in profile or profile file (.toml); default: the scenario's")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--realtime", action="store_true", help="at the pace of the clock instead of in lockstep")
    options = parser.parse_args()
    try:
        with curionav.connect(options.connect, options.namespace) as deployment:
            return follow(deployment, options)
    except curionav.Rejected as refusal:
        print(f"{options.scenario}: {refusal}", file=sys.stderr)
        return 2
    except curionav.CurionavError as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        return 130


def follow(deployment: curionav.Deployment, options: argparse.Namespace) -> int:
    """Prints one line per planning cycle, then the measures."""
    clock: curionav.Clock = "realtime" if options.realtime else "lockstep"
    with deployment.inject(options.scenario, options.planner, options.seed, clock) as run:
        for report in run:
            decision, kept = report.decision, np.flatnonzero([why is None for why in report.rejected])
            cheapest = report.total[kept].min() if kept.size else float("nan")
            print(
                f"{decision.stamp:6.1f} s  {decision.action:6}  {len(kept):4d} candidates, cheapest {cheapest:6.3f}, "
                f"{decision.elapsed_us / 1e3:5.1f} ms  {curionav.say('reason', decision.reason)}"
            )
        result = run.wait()
    print(f"\n{result.scenario} with {result.planner}, seed {result.seed}: {result.outcome}")
    for name, value in dataclasses.asdict(result.measures).items():
        print(f"  {name:16} {value}")
    return 0 if result.outcome == "reached" and result.measures.collisions == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
