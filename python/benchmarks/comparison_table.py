"""Figures of several programs on several drives, as a table for people and as one for programs."""

from __future__ import annotations

import csv
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tracking import Figures

HEADER = (
    "log",
    "program",
    "right",
    "median, 95 % (m)",
    "NEES",
    "within 95 %",
    "wrongly converged (%)",
    "updates per s",
    "s per drive",
)

MOST_NEES = 1000
"""More says no more."""


@dataclass(frozen=True)
class Row:
    """One run."""

    drive: str
    program: str
    seed: int
    figures: Figures


def markdown(rows: Sequence[Row]) -> str:
    """A line for each drive and program.

    Errors, NEES and the share within the region are medians over the seeds, "wrongly converged" is the mean. Times are
    those of the fastest seed, which other work on the machine has disturbed least.
    """
    lines = [HEADER, ("---",) * len(HEADER)]
    for drive, program in dict.fromkeys((row.drive, row.program) for row in rows):
        of_both = [row.figures for row in rows if (row.drive, row.program) == (drive, program)]
        lines.append((drive, program, *_cells(of_both)))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cells(runs: Sequence[Figures]) -> tuple[str, ...]:
    judged = [run.right for run in runs if run.right is not None]
    right = f"{sum(judged)} of {len(judged)}" if judged else "-"
    errors = f"{_middle(runs, lambda run: run.median_m, 2)}, {_middle(runs, lambda run: run.p95_m, 2)}"
    within = _middle(runs, lambda run: run.share_within_95 and 100.0 * run.share_within_95, 0)
    wrong = [100.0 * run.wrongly_converged for run in runs if run.wrongly_converged is not None]
    fastest = min(run.seconds for run in runs)
    return (
        right,
        errors,
        _consistency(runs),
        within if within == "-" else f"{within} %",
        f"{statistics.fmean(wrong):.1f}" if wrong else "-",
        f"{max(run.updates_per_second() for run in runs):.0f}",
        f"{fastest:.1f}",
    )


def _consistency(runs: Iterable[Figures]) -> str:
    known = [run.nees for run in runs if run.nees is not None]
    if not known:
        return "-"
    middle = statistics.median(known)
    return f"{middle:.1f}" if middle <= MOST_NEES else f"over {MOST_NEES}"


def _middle(runs: Iterable[Figures], of: Callable[[Figures], float | None], digits: int) -> str:
    known = [value for run in runs if (value := of(run)) is not None]
    return f"{statistics.median(known):.{digits}f}" if known else "-"


def write_csv(path: Path, rows: Iterable[Row], start: str) -> None:
    """A line for each run."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        names = ["right", "median_m", "p95_m", "nees", "share_within_95", "wrongly_converged", "updates", "seconds"]
        writer.writerow(["drive", "program", "start", "seed", *names, "ends_at_x", "ends_at_y", "ends_at_heading"])
        for row in rows:
            figures = row.figures
            end = figures.ends_at
            values = [getattr(figures, name) for name in names]
            writer.writerow([row.drive, row.program, start, row.seed, *values, end.x, end.y, end.heading])
