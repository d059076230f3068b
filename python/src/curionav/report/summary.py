"""The results of a bench, and every figure of them under the keys of summary.json."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .claims import judge
from .comparison import Comparison, published
from .measures import MEASURES, PAPER, Row, tally


@dataclass(frozen=True)
class Bench:
    """A finished bench: its runs, compared, and how many runs each planner should have in each scenario."""

    comparison: Comparison
    repeats: int

    @classmethod
    def read(cls, folder: Path) -> Bench:
        """The results that `curionav bench --out` wrote; the journal may have older runs, which are left out."""
        head = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
            wanted = {_identity(row) for row in csv.DictReader(file)}
        lines = (folder / "journal.jsonl").read_text(encoding="utf-8").splitlines()
        journal: list[Row] = [json.loads(line) for line in lines if line]
        rows = [row for row in journal if _identity(row) in wanted and row["program"] in head["programs"]]
        return cls(Comparison(head["planners"], head["scenarios"], head["places"], rows), head["repeats"])

    def figures(self, claims: Sequence[Path] = ()) -> dict[str, Any]:
        """Cells, tests, the paper's order, and what has become of the claims in these files."""
        return {
            "cells": self._cells(),
            "tests": self._tests(),
            "order": self._orders(),
            "claims": [asdict(judged) for file in claims for judged in judge(file, self.comparison, self.repeats)],
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
