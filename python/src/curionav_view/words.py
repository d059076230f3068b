"""A cycle in words."""

from __future__ import annotations

from collections import Counter

import numpy as np

from curionav.explain import IN_PLACE, meaning, unseen_away
from curionav.messages import CycleReport, Decision, Mission, RunResult, TermReport
from curionav.words import say, say_all

NORMAL = frozenset({"tracking", "arrived"})
"""Reasons of the driver that are as they should be."""
_DONE = {"follow": "Follow", "hold": "Hold", "stop": "Stop"}


def decision(report: CycleReport, mission: Mission | None, nearest: float | None) -> str:
    """What was decided and what it was weighed by, as Markdown."""
    made = report.decision
    lines = [
        f"### {_DONE[made.action]}: {say('reason', made.reason)}",
        "",
        _place(report, mission, nearest),
        "",
        *_costs(report),
    ]
    if report.driven is not None:
        twist = report.driven
        reason = f"{say('command_reason', twist.reason)}, since {twist.since:.1f} s"
        lines += ["", f"Before it, the driver commanded {twist.v:.2f} m/s and {twist.omega:.2f} rad/s ({reason})."]
    if made.degraded:
        lines += ["", "**Not as it should be:** " + say_all("degradation", made.degraded)]
    codes = Counter(why["code"] for why in report.rejected if why is not None)
    if codes:
        lines += ["", "**Rejected**", ""]
        lines += [f"- {count} {say('rejections', code)}" for code, count in codes.most_common()]
    return "\n".join(lines)


def _place(report: CycleReport, mission: Mission | None, nearest: float | None) -> str:
    made, belief = report.decision, report.scene.belief
    parts = [f"{report.scene.stamp:.1f} s, cycle {report.seq}"]
    if mission is not None:
        parts.append(f"goal in {np.hypot(mission.order.goal_x - belief.x, mission.order.goal_y - belief.y):.1f} m")
    if nearest is not None:
        parts.append(f"nearest person {nearest:.1f} m")
    unseen = unseen_away(report)
    if unseen is not None:
        parts.append(f"{say('person', 'unseen')} {unseen:.1f} m away")
    if report.scene.in_place_s >= IN_PLACE:
        parts.append(f"in one place for {report.scene.in_place_s:.0f} s")
    if report.scene.impatient:
        parts.append("**impatient**")
    sure = "**uncertain**, so curious" if made.uncertain else "sure of the place"
    limit = threshold(mission)
    parts.append(f"{sure} (l = {made.uncertainty:.3f}" + (f", Thr' = {limit:g})" if limit else ")"))
    return " · ".join(parts)


def _costs(report: CycleReport) -> list[str]:
    """The chosen candidate's cost, term by term, and how much more the next would have cost."""
    kept = sum(why is None for why in report.rejected)
    count = report.candidates.count
    if report.chosen is None:
        return [f"No candidate was taken; {kept} of {count} could be driven."]
    lines = [
        f"Cost {report.total[report.chosen]:.3f}{_margin(report)}; {kept} of {count} candidates could be driven.",
        "",
        "| term | weight | raw | cost | scored by |",
        "|---|---|---|---|---|",
    ]
    for term in report.terms:
        raw = float(term.raw[report.chosen])
        if np.isnan(raw):
            lines.append(f"| {term.term} | {term.weight:g} | not asked | | |")
            continue
        share = _share(term, report.chosen)
        lines.append(f"| {term.term} | {term.weight:g} | {raw:.3g} | {share} | {term.evaluated} |")
    return [*lines, "", *_meanings(report)]


def _meanings(report: CycleReport) -> list[str]:
    """What the raw costs of the chosen candidate say, for the terms that there are words for."""
    facts = [meaning(report, term) for term in report.terms if term.active]
    return [f"- {fact['code']}: {say('term_meaning', fact)}" for fact in facts if fact is not None]


def _margin(report: CycleReport) -> str:
    """How much better it is than the next; worse if cost alone did not decide."""
    if report.margin is None:
        return ""
    return f", {abs(report.margin):.3g} {'better' if report.margin >= 0.0 else 'worse'} than the next"


def _share(term: TermReport, chosen: int) -> str:
    """What a term adds to the cost of the chosen candidate."""
    return f"{term.cost[chosen]:.3f}" if term.active else "(off)"


def threshold(mission: Mission | None) -> float | None:
    """Thr' of eq. 5, from the planner's profile: above it the robot is curious."""
    return number(mission, "uncertainty", "threshold")


def number(mission: Mission | None, table: str, key: str) -> float | None:
    """A number of the planner's profile; ``None`` if it has none there."""
    inner = mission.order.profile.get(table) if mission is not None else None
    value = inner.get(key) if isinstance(inner, dict) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def event(previous: Decision | None, made: Decision) -> tuple[str, str] | None:
    """(text, level) if something has changed for the worse or back; ``None`` if all is as before."""
    if previous is None or previous.action != made.action:
        level = "INFO" if made.action == "follow" else "WARN"
        return f"{_DONE[made.action]}: {say('reason', made.reason)}", level
    if previous.uncertain != made.uncertain:
        return ("uncertain where it is: curious" if made.uncertain else "sure of the place again"), "INFO"
    before, now = say_all("degradation", previous.degraded), say_all("degradation", made.degraded)
    if before != now:
        return (f"degraded: {now}" if now else "all is as it should be again"), "WARN"
    return None


def waiting(why: str, endpoint: str | None) -> str:
    """That there is nothing to see yet, and how to change that, as Markdown."""
    where = f" --connect {endpoint}" if endpoint is not None else ""
    return "\n".join(
        [
            "### Nothing is running",
            "",
            f"{why[:1].upper()}{why[1:]}.",
            "",
            "The next run is shown here by itself. To start one:",
            "",
            "```",
            f"curionav run scenarios/quickstart.toml --speed realtime{where}",
            "```",
        ]
    )


def standing(mission: Mission) -> str:
    """Where a mission stands, and why it ended."""
    return mission.state + (f": {say('end', mission.end)}" if mission.end else "")


def over(mission: Mission, result: RunResult | None, before: bool) -> str:
    """That a mission is over and how it ended, as Markdown; ``before``: it was over before the viewer started."""
    lines = [f"### Nothing is running: the mission is {standing(mission)}", ""]
    if result is not None:
        measured = result.measures
        parts = [
            f"{result.scenario}, {result.planner}, seed {result.seed}",
            f"{result.outcome} after {measured.time_s:.1f} s and {measured.length_m:.1f} m",
            f"localised to {measured.rmse_m:.2f} m (RMSE)",
            f"{measured.collisions} collision{'' if measured.collisions == 1 else 's'}",
        ]
        if measured.md_m is not None:
            parts.insert(3, f"nearest person {measured.md_m:.2f} m")
        lines += [" · ".join(parts), ""]
    if before and result is not None:
        lines.append(
            "Drawn from its result: where the robot and the people were, tick by tick. What it saw, considered"
        )
        lines.append("and decided was said before this viewer listened; a recording would have it.")
    elif before:
        lines.append("What it saw, considered and decided was said before this viewer listened.")
    else:
        lines.append("Drag the time line back to see why it drove as it did.")
    return "\n".join([*lines, "", "The next run is shown here by itself."])
