"""What the rows mean: spreads, paired differences, who is best, whose order is the paper's."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import Literal

from . import statistics
from .measures import MEASURES, NM, PAPER, TCE, Measure, Row, settled

Unit = Literal["place", "scenario", "run"]


@dataclass(frozen=True)
class Spread:
    """A measure over the runs of one planner in one scenario that have a value."""

    runs: int
    mean: float
    median: float
    sd: float
    low: float
    high: float


@dataclass(frozen=True)
class Paired:
    """One planner against another in the same scenarios with the same seeds.

    Attributes:
        pairs: Runs of both.
        units: How many units the test takes for independent.
        nonzero: How many of these differ.
        unit: Places, the scenarios of the only place, or the runs of the only scenario.
        differ: Scenarios in which the two differ on average.
        agree: How many of these differ in the direction of `difference`.
        difference: Mean over places of the mean over their scenarios of the first minus the second.
        low: Lower end of its 95 % bootstrap interval.
        high: Upper end.
        p: Of the two-sided signed-rank test of the units.
        p_of_runs: Of the same test of the runs, which says nothing of other places.
    """

    pairs: int
    units: int
    nonzero: int
    unit: Unit
    differ: int
    agree: int
    difference: float
    low: float
    high: float
    p: float
    p_of_runs: float


@dataclass(frozen=True)
class Order:
    """Pairs of planners that the paper tells apart; of these, those in its order and those equal here."""

    agree: int = 0
    tied: int = 0
    pairs: int = 0

    @property
    def apart(self) -> int:
        """Pairs whose means differ in the paper and here."""
        return self.pairs - self.tied

    def __add__(self, other: Order) -> Order:
        return Order(self.agree + other.agree, self.tied + other.tied, self.pairs + other.pairs)


@dataclass(frozen=True)
class Published:
    """What the paper prints, with the mark of a slip."""

    mean: float
    sd: float | None
    slip: str


def corrected(tests: list[Paired]) -> list[Paired]:
    """The tests with both p corrected for their number."""
    of_units = statistics.holm([test.p for test in tests])
    of_runs = statistics.holm([test.p_of_runs for test in tests])
    return [
        replace(test, p=p, p_of_runs=p_of_runs) for test, p, p_of_runs in zip(tests, of_units, of_runs, strict=True)
    ]


@cache
def _tables() -> dict[tuple[str, str], dict[str, str]]:
    text = (files(__package__) / "published.csv").read_text(encoding="utf-8")
    return {(line["scenario"], line["planner"]): line for line in csv.DictReader(text.splitlines())}


def published(measure: Measure, planner: str, scenario: str) -> Published | None:
    """What the paper prints, in the unit of the journal; none for what it does not have."""
    if measure not in PAPER:
        return None
    cell = (_tables().get((scenario, planner)) or {}).get(measure.label)
    if not cell:
        return None
    slip = cell[-1] if cell[-1].islower() else ""
    mean, _, sd = cell.removesuffix(slip).partition("\u00b1")
    return Published(float(mean) / measure.per_unit, float(sd) / measure.per_unit if sd else None, slip)


class Comparison:
    """All rows by scenario and planner; both are named by their place in the lists."""

    def __init__(self, planners: list[str], scenarios: list[str], places: list[int], rows: Iterable[Row]) -> None:
        self.planners = planners
        self.scenarios = scenarios
        self.places = places
        self._rows: dict[tuple[int, int], dict[int, Row]] = {
            (s, p): {} for s in range(len(scenarios)) for p in range(len(planners))
        }
        for row in rows:
            if row["scenario"] in scenarios and row["planner"] in planners:
                cell = scenarios.index(row["scenario"]), planners.index(row["planner"])
                self._rows[cell][row["seed"]] = row
        self._rows = {cell: dict(sorted(by_seed.items())) for cell, by_seed in self._rows.items()}
        self._spreads = {
            (measure.key, s, p): spread
            for measure in MEASURES
            for s, p in self._rows
            if (spread := self._measured(measure, s, p)) is not None
        }

    @property
    def place_count(self) -> int:
        """How many places the scenarios are in."""
        return max(self.places, default=-1) + 1

    def runs(self, scenario: int, planner: int) -> list[Row]:
        """The runs of one planner in one scenario, by seed."""
        return list(self._rows[scenario, planner].values())

    def all_runs(self, planner: int) -> list[Row]:
        """Those in all scenarios."""
        return [row for scenario in range(len(self.scenarios)) for row in self.runs(scenario, planner)]

    def spread(self, measure: Measure, scenario: int, planner: int) -> Spread | None:
        """None where no run has a value."""
        return self._spreads.get((measure.key, scenario, planner))

    def mean(self, measure: Measure, scenario: int, planner: int) -> float | None:
        """The mean of the runs that have a value."""
        spread = self.spread(measure, scenario, planner)
        return None if spread is None else spread.mean

    def _measured(self, measure: Measure, scenario: int, planner: int) -> Spread | None:
        found = (measure.of(row) for row in self.runs(scenario, planner))
        values = [value for value in found if value is not None]
        mean = statistics.mean(values)
        median = statistics.median(values)
        sd = statistics.standard_deviation(values)
        seed = _seed(measure.key, self.scenarios[scenario], self.planners[planner])
        interval = statistics.mean_interval(values, seed)
        if mean is None or median is None or sd is None or interval is None:
            return None
        return Spread(len(values), mean, median, sd, *interval)

    def paired(self, measure: Measure, a: int, b: int, scenario: int | None = None) -> Paired | None:
        """Planner `a` minus planner `b`, in one scenario or over all; none without a pair.

        Over several places these are the unit: runs in one place have its walls in common.
        """
        if self.planners[a] > self.planners[b]:
            # The same resamples, whichever of the two is named first.
            other = self.paired(measure, b, a, scenario)
            if other is None:
                return None
            return replace(other, difference=-other.difference, low=-other.high, high=-other.low)
        wanted = range(len(self.scenarios)) if scenario is None else [scenario]
        differences = [self._differences(measure, a, b, s) for s in wanted]
        by_place: list[list[list[float]]] = [[] for _ in range(self.place_count)]
        for s, of_scene in zip(wanted, differences, strict=True):
            by_place[self.places[s]].append(of_scene)
        runs = [value for of_scene in differences for value in of_scene]
        scenes = _averages(differences)
        means = _averages([_averages(of_place) for of_place in by_place])
        unit: Unit = "place" if len(means) > 1 else "scenario" if len(scenes) > 1 else "run"
        units = {"place": means, "scenario": scenes, "run": runs}[unit]
        difference = statistics.mean(means)
        p = statistics.signed_rank(units)
        p_of_runs = statistics.signed_rank(runs)
        name = "" if scenario is None else self.scenarios[scenario]
        seed = _seed(measure.key, name, self.planners[a], self.planners[b])
        interval = statistics.cluster_interval(by_place, seed)
        if difference is None or p is None or p_of_runs is None or interval is None:
            return None
        return Paired(
            pairs=len(runs),
            units=len(units),
            nonzero=sum(value != 0.0 for value in units),
            unit=unit,
            differ=sum(value != 0.0 for value in scenes),
            agree=sum(value * difference > 0.0 for value in scenes),
            difference=difference,
            low=interval[0],
            high=interval[1],
            p=p,
            p_of_runs=p_of_runs,
        )

    def _differences(self, measure: Measure, a: int, b: int, scenario: int) -> list[float]:
        others = self._rows[scenario, b]
        differences = []
        for seed, row in self._rows[scenario, a].items():
            first = measure.of(row)
            second = measure.of(others[seed]) if seed in others else None
            if first is not None and second is not None:
                differences.append(settled(first - second))
        return differences

    def is_best(self, measure: Measure, scenario: int, planner: int) -> bool:
        """Whether no other mean is better; several may share it.

        A planner that was not once sure of its place was not unsure again the least: no best NM or TCE for it.
        """
        means = [self._comparable(measure, scenario, p) for p in range(len(self.planners))]
        own = means[planner]
        return own is not None and not any(other is not None and measure.prefers(other, own) for other in means)

    def _comparable(self, measure: Measure, scenario: int, planner: int) -> float | None:
        spread = self.spread(measure, scenario, planner)
        if spread is None:
            return None
        is_whole = spread.runs == len(self._rows[scenario, planner])
        return spread.mean if is_whole or measure not in (NM, TCE) else None

    def order(self, measure: Measure, scenario: int) -> Order:
        """Of the pairs of planners that the paper tells apart in this scenario, how many are in its order here."""
        both = []
        for p, planner in enumerate(self.planners):
            theirs = published(measure, planner, self.scenarios[scenario])
            ours = self.mean(measure, scenario, p)
            if theirs is not None and ours is not None:
                both.append((theirs.mean, ours))
        order = Order()
        for i, (theirs_a, ours_a) in enumerate(both):
            for theirs_b, ours_b in both[i + 1 :]:
                if theirs_a != theirs_b:
                    gap = settled(ours_a - ours_b)
                    order += Order(int(gap * (theirs_a - theirs_b) > 0.0), int(gap == 0.0), 1)
        return order


def _averages(groups: Iterable[list[float]]) -> list[float]:
    """The settled means of the groups that are not empty."""
    means = (statistics.mean(group) for group in groups)
    return [settled(mean) for mean in means if mean is not None]


def _seed(*words: str) -> int:
    """The seed of a bootstrap: its own for each question, the same in every report."""
    return int.from_bytes(hashlib.sha256("\n".join(words).encode()).digest()[:8], "big")
