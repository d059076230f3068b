"""Prints what benchmarks found as the tables of docs/benchmark.md: a row for each planner, a table for each folder.

curionav bench rooms --planners curionav,scenarios/tuned --repeats 3 --out out/rooms
python python/benchmarks/suite_tables.py out/rooms
"""

from __future__ import annotations

import argparse
import csv
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

Run = Mapping[str, str]

HEADER = (
    "planner",
    "ended well",
    "collision",
    "timeout",
    "lost",
    "RMSE (m)",
    "TD (%)",
    "MD (m)",
    "Time (s)",
    "first (%)",
)


def table(runs: Sequence[Run]) -> str:
    """The table of one folder, in the order in which its planners ran."""
    planners = dict.fromkeys(run["planner"] for run in runs)
    lines = [_line(HEADER), _line(["---"] * len(HEADER))]
    lines += [_line(row(planner, [run for run in runs if run["planner"] == planner])) for planner in planners]
    return "\n".join(lines)


def row(planner: str, runs: Sequence[Run]) -> list[str]:
    """The figures of one planner. Time is that of the runs that reached the goal; all else is of all runs."""
    reached = [run for run in runs if run["outcome"] == "reached"]
    well = sum(run["success"] == "1" for run in runs)
    collided = sum(int(run["collisions"]) > 0 for run in runs)
    cycles = sum(_numbers(runs, "cycles"))
    first = sum(_numbers(runs, "first_choice"))
    mean_time = _figure(statistics.fmean, reached, "time_s", ".1f")
    median_time = _figure(statistics.median, reached, "time_s", ".1f")
    return [
        f"`{planner}`",
        f"{well} of {len(runs)}",
        str(collided),
        str(_ended(runs, "timeout")),
        str(_ended(runs, "lost")),
        f"{_mean(runs, 'rmse_m')} / {_figure(statistics.median, runs, 'rmse_m', '.2f')}",
        _figure(statistics.fmean, runs, "td", ".1f", 100.0),
        _mean(runs, "md_m"),
        f"{mean_time} / {median_time}",
        f"{100.0 * first / cycles:.0f}" if cycles else "",
    ]


def _ended(runs: Iterable[Run], outcome: str) -> int:
    return sum(run["outcome"] == outcome for run in runs)


def _numbers(runs: Iterable[Run], column: str) -> list[float]:
    return [float(run[column]) for run in runs if run[column]]


def _mean(runs: Sequence[Run], column: str) -> str:
    return _figure(statistics.fmean, runs, column, ".2f")


def _figure(
    of: Callable[[Sequence[float]], float], runs: Sequence[Run], column: str, form: str, scale: float = 1.0
) -> str:
    """A figure of the runs that have the measure; nothing where none has."""
    numbers = _numbers(runs, column)
    return format(scale * of(numbers), form) if numbers else ""


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Prints the tables of the folders that it is given."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR", help="what `curionav bench --out DIR` wrote")
    for folder in parser.parse_args().folders:
        with (folder / "results.csv").open(newline="") as file:
            print(f"{folder.name}\n\n{table(list(csv.DictReader(file)))}\n")


if __name__ == "__main__":
    main()
