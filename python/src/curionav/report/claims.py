"""Claims that were written down before the runs, judged by the runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .comparison import Comparison, Paired, corrected
from .measures import BY_KEY, SUCCESS, TD, TD_SECONDS, Measure, count, plain, tally
from .statistics import least_p

Found = tuple[bool, str] | None
"""Whether a claim holds in a scenario, and the figures; none without a value."""


@dataclass(frozen=True)
class Judged:
    """A claim in words, the label of its measure, and what decided; `too_few`: no test of so few units could hold."""

    claim: str
    found: str
    holds: bool = False
    too_few: bool = False
    about: str = SUCCESS.label

    @property
    def is_beyond_reach(self) -> bool:
        """Whether it does not hold and could not."""
        return self.too_few and not self.holds

    @property
    def verdict(self) -> str:
        """In words."""
        if self.holds:
            return "holds"
        return "cannot be shown" if self.too_few else "does not hold"


def judge(claims: list[dict[str, Any]], comparison: Comparison, repeats: int) -> list[Judged]:
    """Every claim of a file in turn; each planner should have `repeats` runs in each scenario."""
    court = _Judge(comparison, repeats * len(comparison.scenarios))
    found = {index: court.test(claim) for index, claim in enumerate(claims) if claim["kind"] == "better"}
    tests = {index: test for index, test in found.items() if test is not None}
    tests = dict(zip(tests, corrected(list(tests.values())), strict=True))
    return [court.judge(claim, tests.get(index)) for index, claim in enumerate(claims)]


@dataclass(frozen=True)
class _Judge:
    comparison: Comparison
    runs: int

    def judge(self, claim: dict[str, Any], test: Paired | None) -> Judged:
        judges: dict[str, Callable[[dict[str, Any]], Judged]] = {
            "success": self._success,
            "as-often": self._as_often,
            "bound": self._bound,
            "best": self._best,
        }
        if claim["kind"] == "better":
            return self._better(claim, test)
        return judges[claim["kind"]](claim)

    def test(self, claim: dict[str, Any]) -> Paired | None:
        return self._paired(BY_KEY[claim["measure"]], claim)

    def _paired(self, measure: Measure, claim: dict[str, Any]) -> Paired | None:
        a, b = (self.comparison.planners.index(claim[name]) for name in ("planner", "than"))
        return self.comparison.paired(measure, a, b)

    def _tally(self, planner: str) -> dict[str, int]:
        return tally(self.comparison.all_runs(self.comparison.planners.index(planner)))

    def _success(self, claim: dict[str, Any]) -> Judged:
        own = self._tally(claim["planner"])
        share = f"{100.0 * claim['at_least']:.1f} % of the runs"
        return Judged(
            claim=f"`{claim['planner']}` reaches the goal without a collision in at least {share}",
            # A run that did not take place is none that succeeded.
            holds=self.runs > 0 and own["success"] >= claim["at_least"] * self.runs,
            found=f"{own['success']} of {self.runs}, {own['runs']} took place, {own['contacts']} collisions",
        )

    def _as_often(self, claim: dict[str, Any]) -> Judged:
        planner = claim["planner"]
        than = claim.get("than")
        others = [than] if than else [name for name in self.comparison.planners if name != planner]
        of = f"`{than}`" if than else "any other planner"
        says = f"`{planner}` reaches the goal without a collision as often as {of}"
        tallies = [self._tally(name) for name in [planner, *others]]
        if not others or self.runs == 0 or any(one["runs"] != self.runs for one in tallies):
            return Judged(says, "runs are missing")
        most = 0
        against = "none"
        for name, one in zip(others, tallies[1:], strict=True):
            if one["success"] > most:
                most = one["success"]
                against = f"{most} of `{name}`"
        own = tallies[0]
        found = f"{own['success']} of {own['runs']} runs, against {against}"
        return Judged(says, found, holds=own["success"] >= most)

    def _bound(self, claim: dict[str, Any]) -> Judged:
        measure = BY_KEY[claim["measure"]]
        of_best = claim.get("of_best", False)
        low = claim.get("at_least")
        high = claim.get("at_most")

        def shown(value: float) -> str:
            return f"{value:.2f} times the best planner's" if of_best else measure.show_with_unit(value)

        def holds(scenario: int, own: int) -> Found:
            value = self.comparison.mean(measure, scenario, own)
            if value is None:
                return None
            if of_best:
                value /= _best(measure, [*self._others(measure, scenario, own), value])
            return (low is None or low <= value) and (high is None or value <= high), shown(value)

        bounds = [] if low is None else [f"at least {shown(low)}"]
        bounds += [] if high is None else [f"at most {shown(high)}"]
        says = f"{measure.label} of `{claim['planner']}` is {' and '.join(bounds)}"
        return self._in_scenarios(claim, says, holds)

    def _best(self, claim: dict[str, Any]) -> Judged:
        measure = BY_KEY[claim["measure"]]
        best = self._best_by(measure, claim, measure.label)
        if measure is not TD:
            return best
        seconds = self._best_by(TD_SECONDS, claim, measure.label)
        return Judged(best.claim, f"{best.found}; by the seconds {seconds.found}", best.holds, about=best.about)

    def _best_by(self, measure: Measure, claim: dict[str, Any], label: str) -> Judged:
        or_tied = claim.get("or_tied", False)
        tied = " or as good as the best" if or_tied else ""

        def holds(scenario: int, own: int) -> Found:
            value = self.comparison.mean(measure, scenario, own)
            others = self._others(measure, scenario, own)
            if value is None or not others:
                return None
            best = _best(measure, others)
            names = self.comparison.planners
            rivals = [p for p in range(len(names)) if p != own and self.comparison.mean(measure, scenario, p) == best]
            of = ", ".join(f"`{names[p]}`" for p in rivals)
            tie = ", a tie" if value == best else ""
            found = f"{measure.show_with_unit(value)} against {measure.show_with_unit(best)} of {of}{tie}"
            return measure.prefers(value, best) or (or_tied and value == best), found

        says = f"{label} of `{claim['planner']}` is better than every other planner's{tied}"
        return self._in_scenarios(claim, says, holds)

    def _others(self, measure: Measure, scenario: int, own: int) -> list[float]:
        others = (self.comparison.mean(measure, scenario, p) for p in range(len(self.comparison.planners)) if p != own)
        return [value for value in others if value is not None]

    def _in_scenarios(self, claim: dict[str, Any], says: str, holds: Callable[[int, int], Found]) -> Judged:
        """Judges each scenario; one without runs, or without a value, does not hold."""
        names = self.comparison.scenarios
        wanted = claim.get("scenarios", len(names))
        own = self.comparison.planners.index(claim["planner"])
        missed = []
        for scenario, name in enumerate(names):
            found = holds(scenario, own)
            if found is None:
                missed.append(f"{name}: no value")
            elif not found[0]:
                missed.append(f"{name}: {found[1]}")
        good = len(names) - len(missed)
        but = f"; not {'; '.join(missed)}" if missed else ""
        return Judged(
            claim=f"{says}, in at least {wanted} of {count(len(names), 'scenario')}",
            found=f"in {good}{but}",
            holds=0 < wanted <= good,
            about=BY_KEY[claim["measure"]].label,
        )

    def _better(self, claim: dict[str, Any], test: Paired | None) -> Judged:
        measure = BY_KEY[claim["measure"]]
        p = claim.get("p", 0.01)
        label = measure.label
        says = f"{label} of `{claim['planner']}` is better than that of `{claim['than']}`, p < {plain(p)}"
        if test is None:
            return Judged(says, "no pair of runs", about=label)
        of_seconds = self._paired(TD_SECONDS, claim) if measure is TD else None
        seconds = f"; in seconds {', '.join(_difference(TD_SECONDS, of_seconds))}" if of_seconds else ""
        missing = max(self.runs - test.pairs, 0)
        without = f", {missing} pairs without a value" if missing else ""
        least = least_p(test.units)
        too_few = "" if least < p else f", which can give no p below {plain(least)}"
        difference, bounds = _difference(measure, test)
        agree = f"so in {test.agree} of {count(test.differ, 'scenario')} that differ"
        units = f"{shown_p(test.p)} by Holm of {count(test.units, test.unit)}{too_few}"
        of_runs = f"{shown_p(test.p_of_runs)} of the runs in these{without}"
        return Judged(
            claim=says,
            found=f"{difference} on average, {bounds}; {agree}; {units}; {of_runs}{seconds}",
            holds=measure.prefers(test.difference, 0.0) and test.p < p,
            too_few=least >= p,
            about=label,
        )


def _best(measure: Measure, values: list[float]) -> float:
    return max(values) if measure.is_more_better else min(values)


def _difference(measure: Measure, paired: Paired) -> tuple[str, str]:
    """A difference with its sign and unit, and its interval."""
    sign = "+" if paired.difference > 0.0 else ""
    bounds = f"{measure.show(paired.low)} to {measure.show(paired.high)}"
    return sign + measure.show_with_unit(paired.difference), bounds


def shown_p(p: float) -> str:
    """A p to four digits."""
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"
