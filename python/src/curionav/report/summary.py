"""The results of a bench, and every figure of them: summary.json."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..messages import RunResult
from .claims import Judged
from .comparison import Comparison, published
from .measures import MEASURES, PAPER, Row, tally
from .statistics import mean


@dataclass(frozen=True)
class Bench:
    """A finished bench.

    Attributes:
        folder: What `curionav bench --out` wrote.
        made: `bench.json` in it: planners, scenarios, seeds and so on.
        comparison: The runs that `results.csv` has; the journal may have older ones.
    """

    folder: Path
    made: dict[str, Any]
    comparison: Comparison

    @classmethod
    def read(cls, folder: Path) -> Bench:
        """Reads bench.json, results.csv and the journal."""
        made = json.loads((folder / "bench.json").read_text(encoding="utf-8"))
        with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
            wanted = {_identity(row) for row in csv.DictReader(file)}
        lines = (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()
        journal: list[Row] = [json.loads(line) for line in lines if line]
        rows = [row for row in journal if _identity(row) in wanted and row["program"] in made["programs"]]
        planners = [planner["name"] for planner in made["planners"]]
        scenarios = [scenario["name"] for scenario in made["scenarios"]]
        places = [scenario["place"] for scenario in made["scenarios"]]
        return cls(folder, made, Comparison(planners, scenarios, places, rows))

    @cached_property
    def seeds(self) -> range:
        """Those of every planner in every scenario."""
        first = self.made["first_seed"]
        return range(first, first + self.made["repeats"])

    def trace(self, scenario: int, planner: int) -> RunResult | None:
        """The kept run with the first seed; none if it did not take place."""
        for row in self.comparison.runs(scenario, planner):
            file = self.folder / "traces" / f"{row['key']}.cbor"
            if row["seed"] == self.seeds[0] and file.is_file():
                return RunResult.decode(file.read_bytes())
        return None

    def real_time_factor(self, planner: int) -> float | None:
        """Simulated over clock seconds of a run, on the mean."""
        return mean([row["real_time_factor"] for row in self.comparison.all_runs(planner)])

    def figures(self, claims: Sequence[Judged] = ()) -> dict[str, Any]:
        """Cells, tests, the paper's order, what has become of the claims, and what was run."""
        names = self.comparison.planners
        factors = {name: self.real_time_factor(p) for p, name in enumerate(names)}
        return {
            "planners": names,
            "scenarios": self.comparison.scenarios,
            "places": self.comparison.places,
            **{key: self.made[key] for key in ["first_seed", "perception", "repeats", "programs", "missing"]},
            "claims": [asdict(judged) for judged in claims],
            "cells": self._cells(),
            "tests": self._tests(),
            "order": self._orders(),
            "timing": {
                "clock_s": self.made["clock_s"],
                "workers": self.made["workers"],
                "real_time_factor": {name: factor for name, factor in factors.items() if factor is not None},
            },
        }

    def _cells(self) -> list[dict[str, Any]]:
        cells = []
        for s, scenario in enumerate(self.comparison.scenarios):
            for p, planner in enumerate(self.comparison.planners):
                measures = {}
                for measure in MEASURES:
                    spread = self.comparison.spread(measure, s, p)
                    if spread is None:
                        continue
                    value: dict[str, Any] = asdict(spread)
                    theirs = published(measure, planner, scenario)
                    if theirs is not None:
                        value["paper"] = {"mean": theirs.mean, "sd": theirs.sd}
                    value["best"] = self.comparison.is_best(measure, s, p)
                    measures[measure.key] = value
                runs = tally(self.comparison.runs(s, p))
                cells.append({"scenario": scenario, "planner": planner, "runs": runs, "measures": measures})
        return cells

    def _tests(self) -> list[dict[str, Any]]:
        """Every two planners, over all scenarios and in each."""
        names = self.comparison.planners
        scenes: list[int | None] = [None, *range(len(self.comparison.scenarios))]
        tests = []
        for measure in MEASURES:
            for a in range(len(names)):
                for b in range(a + 1, len(names)):
                    for s in scenes:
                        paired = self.comparison.paired(measure, a, b, s)
                        if paired is not None:
                            scenario = None if s is None else self.comparison.scenarios[s]
                            test = {"measure": measure.key, "scenario": scenario, "a": names[a], "b": names[b]}
                            tests.append({**test, "a_minus_b": asdict(paired)})
        return tests

    def _orders(self) -> list[dict[str, Any]]:
        orders = []
        for measure in PAPER:
            for s, scenario in enumerate(self.comparison.scenarios):
                order = self.comparison.order(measure, s)
                if order.pairs > 0:
                    orders.append({"measure": measure.key, "scenario": scenario, "as_in_the_paper": asdict(order)})
        return orders


def _identity(row: dict[str, Any]) -> tuple[str, str, int, str]:
    return row["scenario"], row["planner"], int(row["seed"]), row["decisions_sha256"]
