"""The first lines of the report: what a reader must take home who reads nothing else."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from .comparison import Order
from .measures import PAPER, SUCCESS, TD, TD_SECONDS, TIME, count
from .statistics import least_p, mean

if TYPE_CHECKING:
    from .page import Page

SIGNIFICANT = 0.01
"""A difference counts below this p."""
MOST = 0.5
"""A kind of scenes is named if it has more than this share of the failures."""
SOME = 5
"""And if there are so many failures at least."""


def sentences(page: Page) -> list[str]:
    """Sentences about the first planner against the others, and about how far they reach."""
    said = [_success(page), _failures(page), _time(page), _people(page), _claims(page), _order(page), _places(page)]
    return [sentence for sentence in said if sentence]


def _extreme(
    planners: list[int], value: Callable[[int], float | None], is_greatest: bool = False
) -> tuple[int, float] | None:
    """The first planner with the least or the greatest value, if any has one."""
    values = [(p, found) for p in planners if (found := value(p)) is not None]
    if not values:
        return None
    sign = -1.0 if is_greatest else 1.0
    return min(values, key=lambda pair: sign * pair[1])


def _success(page: Page) -> str:
    own = page.tallies[0]
    says = (
        f"{page.quoted(0)} reached the goal without a collision in {own['success']} of {count(own['runs'], 'run')} "
        f"(95 %, if runs were independent: {page.success_interval(own)})."
    )
    successes = [runs["success"] for runs in page.tallies]
    best = _extreme(page.others, lambda p: successes[p], is_greatest=True)
    if best is None:
        return says
    tests = [page.tests[SUCCESS.key, p] for p in page.others if (SUCCESS.key, p) in page.tests]
    shown = sum(paired.p < SIGNIFICANT for paired in tests)
    # What Holm makes of the least p of so many places that differ.
    could = any(least_p(paired.nonzero) * len(page.tests) < SIGNIFICANT for paired in tests)
    hopeless = "" if could else ", and with so few places that differ no result could be"
    return says + (
        f" Of the other {count(len(page.others), 'planner')}, {sum(one > successes[0] for one in successes[1:])} did "
        f"so more often and {successes[1:].count(successes[0])} as often; the most is {best[1]} of "
        f"{page.quoted(best[0])}. By the paired tests below, with p < {SIGNIFICANT}, it can be told from chance for "
        f"{shown} of them{hopeless}."
    )


def _failed(runs: dict[str, int]) -> int:
    return runs["runs"] - runs["success"]


def _failures(page: Page) -> str | None:
    """Where most of the first planner's failures are, how the others fared there, and what is left without these."""
    kinds = page.kinds
    if not kinds:
        return None
    # Of kinds with equally many the last one.
    kind = max(reversed(kinds), key=lambda name: _failed(kinds[name][0]))
    there = kinds[kind]
    own = page.tallies[0]
    if _failed(own) < SOME or _failed(there[0]) <= MOST * _failed(own):
        return None
    says = (
        f"Of its {_failed(own)} failures, {_failed(there[0])} are in scenes of the kind {kind}, where it has "
        f"{there[0]['success']} of {count(there[0]['runs'], 'run')}"
    )
    worst = _extreme(page.others, lambda p: there[p]["success"])
    best = _extreme(page.others, lambda p: there[p]["success"], is_greatest=True)
    if worst and best:
        without = [page.tallies[p]["success"] - there[p]["success"] for p in page.planners]
        more = sum(rest > without[0] for rest in without)
        says += (
            f" and the others {worst[1]} ({page.quoted(worst[0])}) to {best[1]} ({page.quoted(best[0])}). Without "
            f"these, its worst, it has {without[0]} of {own['runs'] - there[0]['runs']}, and {more} of the others "
            "have more"
        )
    return says + "."


def _time(page: Page) -> str | None:
    """In the pairs of runs in which both arrived."""
    tests = [(p, page.tests[TIME.key, p]) for p in page.others if (TIME.key, p) in page.tests]
    if not tests:
        return None
    sooner = [paired for _, paired in tests if paired.difference < 0.0]
    shown = sum(paired.p < SIGNIFICANT for paired in sooner)
    fastest, most = min(tests, key=lambda test: test[1].difference)
    least = most.difference
    by = f"{-least:.1f} s sooner" if least < 0.0 else f"{least:.1f} s later"
    return (
        f"In pairs of runs in which both arrived, {len(sooner)} of the others took less time than it on the mean "
        f"({shown} with p < {SIGNIFICANT}); {page.quoted(fastest)} arrived {by} ({count(most.pairs, 'pair')}, mean "
        f"over {count(most.units, most.unit)})."
    )


def _people(page: Page) -> str | None:
    near = [mean(page.values(TD_SECONDS, p)) for p in page.planners]
    own = near[0]
    if own is None:
        return None
    says = f"It was nearer than 1.5 m to people for {own:.1f} s per run (mean of all runs, also of those that failed)"
    best = _extreme(page.others, lambda p: near[p])
    if best:
        less = sum(time is not None and time < own for time in near)
        says += (
            f"; {less} of the others for less, and the least of the others is {best[1]:.1f} s ({page.quoted(best[0])})"
        )
    return says + "."


def _claims(page: Page) -> str | None:
    """How many claims hold, measure by measure."""
    if not page.claims:
        return None
    each = []
    for what in dict.fromkeys(judged.about for judged in page.claims):
        those = [judged for judged in page.claims if judged.about == what]
        few = sum(judged.is_beyond_reach for judged in those)
        beyond = f" ({few} beyond what so few places can show)" if few else ""
        share = " of the run" if what == TD.label else ""
        each.append(f"{sum(judged.holds for judged in those)} of {len(those)} about {what}{share}{beyond}")
    hold = sum(judged.holds for judged in page.claims)
    return f"Of {count(len(page.claims), 'claim')} written down before, {hold} hold: {'; '.join(each)}."


def _order(page: Page) -> str | None:
    """How many pairs of planners are in the paper's order, measure by measure."""
    whole = sum(page.totals, Order())
    if whole.pairs == 0:
        return None
    each = [
        f"{measure.label.split(' (')[0]} {order.agree} of {order.apart}"
        for measure, order in zip(PAPER, page.totals, strict=True)
        if order.pairs > 0
    ]
    return (
        f"Of {whole.pairs} pairs of planners and measures that the paper's tables tell apart, {whole.tied} have equal "
        f"means here, and {whole.agree} of the other {whole.apart} are in the paper's order; half of them would be so "
        f"by chance. {', '.join(each)}."
    )


def _places(page: Page) -> str:
    places = count(page.comparison.place_count, "place")
    if least_p(page.comparison.place_count) > SIGNIFICANT:
        return (
            f"All scenes are in {places}. That is too few to show anything for other places, however many runs there "
            "are: all of this holds for these places."
        )
    return f"The scenes are in {places}, which the tests take for units."
