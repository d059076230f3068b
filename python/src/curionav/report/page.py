"""What report.html shows; `report.html.jinja` is how it looks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import PurePath
from typing import Any

import jinja2
import numpy as np

from . import figures
from .charts import Chart, Curve, Scale
from .claims import Judged, shown_p
from .comparison import Comparison, Order, Paired, corrected, published
from .density import Densities
from .measures import (
    DETOUR,
    FROZEN,
    IN_VIEW,
    MEASURES,
    NM,
    NOT_FIRST,
    NT,
    PAPER,
    RMSE,
    SOCIAL,
    TCE,
    TD_IN_VIEW,
    TD_SECONDS,
    TIME,
    Measure,
    blame,
    count,
    overlaps,
    plain,
    tally,
)
from .short import SIGNIFICANT, sentences
from .statistics import least_p, mean, median, share_interval
from .summary import Bench
from .words import KINDS, PLANNERS, SLIPS
from .words import MEASURES as MEANINGS

OWN_PLANNER = ("asked", "late", "errors", "refused", "deaths")
"""What is counted of a planner of one's own."""
MEDIANS = (RMSE, TCE, TD_SECONDS, TIME)
"""Measures whose means a few lost or stuck runs rule."""
LONG_WAY = 2.0
"""A way is a long one beyond so many times the shortest."""
KINDS_ABREAST = 10
"""Kinds of scenes that fit the page beside each other."""
PLANNERS_ABREAST = 6
"""Planners that do so in a table with several measures of each."""
FIGURES_BYTES = 1_700_000
"""All pictures together have about so many at most."""
FIGURE_BYTES = 40_000
TABLES = (
    (
        "Table III: localisation",
        "TCM is a share of the run: one that ends only with its time has a small share before convergence.",
    ),
    (
        "Table IV: human awareness",
        "TD is a share of the run: at the same seconds near people a slower planner has the smaller one. The paper's "
        "text calls its CNC worse than its CPC; for TD that holds in 9 of its 13 scenarios.",
    ),
    ("Table V: efficiency", "Length and Time here: of the runs that reached the goal."),
)
"""The paper's tables, three measures each, and what to know when reading."""


def render(bench: Bench, claims: Sequence[Judged]) -> str:
    """The report: one file that needs nothing else, on screen and on paper."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, "."),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
    )
    page = Page(bench, claims)
    return environment.get_template("report.html.jinja").render(
        page=page,
        in_short=sentences(page),
        measures=MEASURES,
        paper=PAPER,
        medians=MEDIANS,
        in_view=IN_VIEW,
        social=SOCIAL,
        meanings=MEANINGS,
        kinds=KINDS,
        significant=SIGNIFICANT,
    )


@dataclass(frozen=True)
class Page:
    """What the template and the first lines of the report ask for; planners and scenarios are named by their places."""

    bench: Bench
    claims: Sequence[Judged]

    @property
    def comparison(self) -> Comparison:
        """All runs."""
        return self.bench.comparison

    @property
    def made(self) -> dict[str, Any]:
        """What was run."""
        return self.bench.made

    @property
    def planners(self) -> range:
        """All of them."""
        return range(len(self.comparison.planners))

    @property
    def others(self) -> list[int]:
        """All but the first."""
        return list(self.planners)[1:]

    @property
    def title(self) -> str:
        """How much was run."""
        planners = count(len(self.planners), "planner")
        scenarios = count(len(self.comparison.scenarios), "scenario")
        places = count(self.comparison.place_count, "place")
        return f"{planners} in {scenarios} in {places}: {sum(runs['runs'] for runs in self.tallies)} runs"

    @property
    def seeds(self) -> str:
        """In words."""
        seeds = self.bench.seeds
        return f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"

    @cached_property
    def tallies(self) -> list[dict[str, int]]:
        """How the runs of each planner ended."""
        return [tally(self.comparison.all_runs(p)) for p in self.planners]

    @cached_property
    def tests(self) -> dict[tuple[str, int], Paired]:
        """Each planner but the first against the first, over all scenarios, with Holm's p over all of these."""
        found = {}
        for measure in MEASURES:
            for p in self.others:
                paired = self.comparison.paired(measure, p, 0)
                if paired is not None:
                    found[measure.key, p] = paired
        return dict(zip(found, corrected(list(found.values())), strict=True))

    def quoted(self, planner: int) -> str:
        """Its name as code."""
        return f"`{self.comparison.planners[planner]}`"

    def colour(self, planner: int) -> str:
        """That of a planner."""
        return figures.colour(self.comparison.planners[planner], planner)

    @property
    def abreast(self) -> list[list[int]]:
        """Several planners at a time, for wide tables."""
        starts = range(0, len(self.planners), PLANNERS_ABREAST)
        return [list(self.planners[start : start + PLANNERS_ABREAST]) for start in starts]

    @property
    def caveats(self) -> list[tuple[int, str]]:
        """The planners that something must be said of."""
        return [(p, PLANNERS[name]) for p, name in enumerate(self.comparison.planners) if name in PLANNERS]

    @property
    def settings(self) -> list[tuple[str, str]]:
        """Where settings come from, and whose they are."""
        planners: dict[str, list[str]] = {}
        for planner in self.made["planners"]:
            is_builtin = planner["source"] == planner["name"]
            origin = "built in" if is_builtin else f"from files in {PurePath(planner['source']).parent}"
            planners.setdefault(origin, []).append(planner["name"])
        return [(origin, ", ".join(names)) for origin, names in sorted(planners.items())]

    @property
    def time_limits(self) -> str:
        """After how many seconds runs are over: one number, or the least and the greatest."""
        limits = {scenario["time_limit_s"] for scenario in self.made["scenarios"]} or {0.0}
        return " to ".join(plain(limit) for limit in sorted({min(limits), max(limits)}))

    def values(self, measure: Measure, planner: int) -> list[float]:
        """The values of all runs of a planner that have one."""
        found = (measure.of(row) for row in self.comparison.all_runs(planner))
        return [value for value in found if value is not None]

    def success_interval(self, runs: dict[str, int]) -> str:
        """The 95 % interval of the share of runs that reached the goal without collision, per cent."""
        interval = share_interval(runs["success"], runs["runs"])
        return "" if interval is None else f"{100.0 * interval[0]:.0f} to {100.0 * interval[1]:.0f} %"

    def median(self, measure: Measure, planner: int) -> str:
        """The median over all runs; what never came in a run came later than in any other."""
        values = self.values(measure, planner)
        if measure is TCE:
            values += [np.inf] * (self.tallies[planner]["runs"] - len(values))
        middle = median(values)
        return "never" if middle == np.inf else _shown(measure, middle)

    @property
    def tells_in_view(self) -> bool:
        """Whether any run measures people in view apart."""
        return any(self.values(TD_IN_VIEW, p) for p in self.planners)

    def mean_of(self, measure: Measure, planner: int) -> str:
        """The mean over all runs that have a value."""
        return _shown(measure, mean(self.values(measure, planner)))

    def choices(self, planner: int) -> tuple[str, str]:
        """How often the first choice was driven and, if every run tells, how often not and why; per cent of cycles."""
        runs = self.tallies[planner]

        def share(part: int) -> str:
            return f"{100.0 * part / max(runs['cycles'], 1):.0f}"

        split = "" if runs["untold"] else ", ".join(share(runs[name]) for name in NOT_FIRST)
        return share(runs["first_choices"]), split

    @property
    def own_planners(self) -> list[dict[str, Any]]:
        """What became of the questions to each planner of one's own, over all of its runs."""
        found = []
        for planner in self.planners:
            told = [row for row in self.comparison.all_runs(planner) if row.get("own_planner")]
            if told:
                counts = {key: sum(row["own_planner"][key] for row in told) for key in OWN_PLANNER}
                faulty = [row for row in told if row["own_planner"].get("first_fault")]
                first = faulty[0] if faulty else None
                found.append(
                    {
                        "planner": planner,
                        "check": told[0]["own_planner"]["check"],
                        "counts": counts,
                        "faulty": len(faulty),
                        "first": first and f"{first['scenario']}: {first['own_planner']['first_fault']}",
                    }
                )
        return found

    def real_time_factor(self, planner: int) -> str:
        """Simulated over clock seconds of a run, on the mean."""
        factor = self.bench.real_time_factor(planner)
        return "" if factor is None else f"{factor:.1f}"

    @property
    def workers(self) -> str:
        """How many runs there were at a time."""
        return count(self.made["workers"], "run")

    @property
    def beyond_reach(self) -> int:
        """How many claims do not hold and could not."""
        return sum(judged.is_beyond_reach for judged in self.claims)

    def blame(self, planner: int) -> dict[str, int]:
        """The collisions by who came towards whom."""
        return blame(self.comparison.all_runs(planner))

    def overlaps(self, planner: int) -> dict[str, int]:
        """All overlaps of bodies."""
        return overlaps(self.comparison.all_runs(planner))

    def troubles(self, planner: int) -> tuple[int, int, str]:
        """Long ways, of how many that reached the goal, and the mean time that the robot stood frozen, seconds."""
        detours = self.values(DETOUR, planner)
        frozen = _shown(FROZEN, mean(self.values(FROZEN, planner)))
        return sum(detour > LONG_WAY for detour in detours), len(detours), frozen

    @cached_property
    def kinds(self) -> dict[str, list[dict[str, int]]]:
        """How each planner fared in the scenarios whose names begin alike, up to the first `-`.

        Nothing where that would be one kind, or more than fit the page.
        """
        kinds: dict[str, list[int]] = {}
        for s, name in enumerate(self.comparison.scenarios):
            kinds.setdefault(name.split("-")[0], []).append(s)
        if not 2 <= len(kinds) <= KINDS_ABREAST:
            return {}
        return {
            kind: [tally(row for s in kinds[kind] for row in self.comparison.runs(s, p)) for p in self.planners]
            for kind in sorted(kinds)
        }

    @cached_property
    def densities(self) -> Densities | None:
        """Success over density, where several scenes have each density."""
        return Densities.of(self.comparison, [scenario["people_per_m2"] for scenario in self.made["scenarios"]])

    def density_curves(self, densities: Densities) -> str:
        """Success over density as a picture."""
        curves = [Curve(p, np.column_stack([densities.levels, densities.shares(p)])) for p in self.planners]
        title = "Share of runs that reached the goal without collision, over people per m²"
        chart = Chart(title, Scale(0.0, 1.04), densities.levels[-1], curves, levels={0.5: "half"})
        drawn = chart.draw(760, 330, 0.0)
        return f'<svg class="comparison density" viewBox="0 0 772 330">{drawn}</svg>'

    def level(self, value: float) -> str:
        """A number as it is written, such as a density."""
        return plain(value)

    @property
    def least_p(self) -> float:
        """The least p that a test of the places can have."""
        return least_p(self.comparison.place_count)

    @property
    def scenes(self) -> list[list[str]]:
        """Rows of Table II: what a scene has, the number of its place, and what the paper prints of it."""
        rows = []
        for scenario in self.made["scenarios"]:
            paper = scenario["paper"]
            half_disc = 0.5 * np.pi * scenario["laser_range_m"] * scenario["laser_range_m"]
            rate = 100.0 * half_disc / (scenario["known_cells"] * scenario["cell_m"] * scenario["cell_m"])
            counts = [f"{scenario[key]}" for key in ("people", "known_cells", "landmark_cells")]
            paper_rate = ""
            if paper:
                theirs = (paper[key] for key in ("people", "known_cells", "landmark_cells"))
                counts = [f"{ours} ({their})" for ours, their in zip(counts, theirs, strict=True)]
                paper_rate = f" ({100.0 * paper['laser_rate']:.2f})"
            rows.append([
                scenario["name"],
                str(scenario["place"] + 1),
                counts[0],
                scenario["motion"],
                f"{scenario['people_per_m2']:.3f}",
                *counts[1:],
                f"{scenario['laser_range_m']:.1f} m",
                f"{rate:.2f}{paper_rate}",
            ])  # fmt: skip
        return rows

    @property
    def tables(self) -> list[tuple[str, tuple[Measure, ...], str]]:
        """The paper's tables: title, measures, and what to know when reading."""
        return [(title, PAPER[3 * i : 3 * i + 3], remark) for i, (title, remark) in enumerate(TABLES)]

    def own(self, measure: Measure, scenario: int, planner: int) -> tuple[str, str] | None:
        """Mean and deviation, and of how many runs if some have no value."""
        own = self.comparison.spread(measure, scenario, planner)
        if own is None:
            return None
        deviation = f"\u00b1{measure.show(own.sd)}" if own.runs > 1 else ""
        return measure.show(own.mean), deviation + self._runs_behind(own.runs, scenario, planner)

    def mean(self, measure: Measure, scenario: int, planner: int) -> tuple[str, str] | None:
        """Mean and interval, and of how many runs if some have no value."""
        own = self.comparison.spread(measure, scenario, planner)
        if own is None:
            return None
        bounds = measure.interval(own.low, own.high)
        return measure.show(own.mean), bounds + self._runs_behind(own.runs, scenario, planner)

    def _runs_behind(self, runs: int, scenario: int, planner: int) -> str:
        return f" of {runs}" if runs < len(self.comparison.runs(scenario, planner)) else ""

    @property
    def coverage(self) -> str | None:
        """How much of a 95 % interval of so few seeds can be: it lies between the least and the greatest of them."""
        covered = 1.0 - least_p(self.made["repeats"])
        return f"{100.0 * covered:.1f} %" if covered < 0.95 else None

    def theirs(self, measure: Measure, scenario: int, planner: int) -> tuple[str, str] | None:
        """What the paper prints, and the mark of a slip."""
        names = self.comparison
        theirs = published(measure, names.planners[planner], names.scenarios[scenario])
        if theirs is None:
            return None
        middle = plain(theirs.mean) if measure in (NM, NT) else measure.show(theirs.mean)
        deviation = "" if theirs.sd is None else f"\u00b1{measure.show(theirs.sd)}"
        return middle + deviation, theirs.slip

    def slips(self, measures: Sequence[Measure], planners: Sequence[int]) -> list[tuple[str, str]]:
        """The marks in a table, and what they mean."""
        cells = [(m, s, p) for m in measures for s in range(len(self.comparison.scenarios)) for p in planners]
        marks = {theirs[1] for cell in cells if (theirs := self.theirs(*cell)) is not None}
        return [(mark, words) for mark, words in SLIPS.items() if mark in marks]

    def paired(self, measure: Measure, planner: int) -> dict[str, str] | None:
        """A planner against the first one: class of the cell, difference, its interval, and two lines of the test."""
        test = self.tests.get((measure.key, planner))
        if test is None:
            return None
        verdict = "pass" if measure.prefers(0.0, test.difference) else "miss"
        if test.p >= SIGNIFICANT:
            verdict = f"here {verdict}" if test.p_of_runs < SIGNIFICANT else ""
        agree = f"n = {test.nonzero} of {test.units}; {test.agree} of {test.differ}"
        return {
            "verdict": verdict,
            "difference": measure.show(test.difference),
            "interval": measure.interval(test.low, test.high),
            "of_units": f"{shown_p(test.p)}, {agree}",
            "of_runs": f"{shown_p(test.p_of_runs)} of the runs",
        }

    def order(self, measure: Measure, scenario: int) -> Order:
        """How many pairs are in the paper's order."""
        return self.comparison.order(measure, scenario)

    @cached_property
    def totals(self) -> list[Order]:
        """The same over all scenarios, measure by measure."""
        scenarios = range(len(self.comparison.scenarios))
        return [sum((self.order(measure, s) for s in scenarios), Order()) for measure in PAPER]

    @property
    def has_order(self) -> bool:
        """Whether the paper has numbers of any of these scenes."""
        return any(order.pairs > 0 for order in self.totals)

    def figure(self, scenario: int) -> str:
        """The ways of all planners in a scenario, and their uncertainty and speed."""
        courses = []
        for p in self.planners:
            runs = self.comparison.runs(scenario, p)
            first = [np.array(row["way"]) for row in runs if row["seed"] == self.bench.seeds[0]]
            courses.append(
                figures.Course(
                    [np.array(row["way"]) for row in runs if row["way"]],
                    first[0] if first else None,
                    getattr(self.bench.trace(scenario, p), "trace", None),
                )
            )
        budget = min(FIGURES_BYTES // len(self.comparison.scenarios), FIGURE_BYTES)
        return figures.draw(self.made["scenarios"][scenario], courses, budget)


def _shown(measure: Measure, value: float | None) -> str:
    """The value, or a dash where there is none."""
    return "\u2013" if value is None else measure.show(value)
