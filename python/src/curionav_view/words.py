"""A cycle in words."""

from __future__ import annotations

from collections import Counter

import numpy as np
from numpy.typing import NDArray

from curionav.array import F64
from curionav.messages import CycleReport, Decision, Mission, TermReport

_DONE = {"follow": "Follow", "hold": "Hold", "stop": "Stop"}


def decision(report: CycleReport, mission: Mission | None, nearest: float | None) -> str:
    """What was decided and what it was weighed by, as Markdown."""
    made = report.decision
    lines = [
        f"### {_DONE[made.action]}: {made.reason}",
        "",
        _place(report, mission, nearest),
        "",
        *_costs(report, mission),
    ]
    if made.degraded:
        lines += ["", "**Not as it should be:** " + "; ".join(made.degraded)]
    refusals = Counter(why for why in report.rejected if why)
    if refusals:
        lines += ["", "**Rejected**", ""]
        lines += [f"- {count} x {why}" for why, count in refusals.most_common(4)]
    return "\n".join(lines)


def _place(report: CycleReport, mission: Mission | None, nearest: float | None) -> str:
    made, belief = report.decision, report.scene.belief
    parts = [f"{report.scene.stamp:.1f} s, cycle {report.seq}"]
    if mission is not None:
        parts.append(f"goal in {np.hypot(mission.goal_x - belief.x, mission.goal_y - belief.y):.1f} m")
    if nearest is not None:
        parts.append(f"nearest person {nearest:.1f} m")
    sure = "**uncertain**, so curious" if made.uncertain else "sure of the place"
    limit = threshold(mission)
    parts.append(f"{sure} (l = {made.uncertainty:.3f}" + (f", Thr' = {limit:g})" if limit else ")"))
    return " · ".join(parts)


def _costs(report: CycleReport, mission: Mission | None) -> list[str]:
    """The chosen candidate's cost, term by term, and by how much it is the best."""
    kept = np.array([not why for why in report.rejected], bool)
    count = report.candidates.count
    if report.chosen is None:
        return [f"No candidate was taken; {int(kept.sum())} of {count} could be driven."]
    costs = np.sort(report.total[kept])
    margin = f", {costs[1] - costs[0]:.3g} better than the next" if len(costs) > 1 else ""
    lines = [
        f"Cost {report.total[report.chosen]:.3f}{margin}; {int(kept.sum())} of {count} candidates could be driven.",
        "",
        "| term | weight | raw | cost | scored by |",
        "|---|---|---|---|---|",
    ]
    for term in report.terms:
        if len(term.raw) == 0:
            lines.append(f"| {term.metric} | {term.weight:g} | not asked | | |")
            continue
        raw = float(term.raw[report.chosen])
        share = f"{weighted(report, term, mission, kept)[report.chosen]:.3f}" if term.active else "(off)"
        lines.append(f"| {term.metric} | {term.weight:g} | {raw:.3g} | {share} | {term.evaluated} |")
    return lines


def weighted(report: CycleReport, term: TermReport, mission: Mission | None, kept: NDArray[np.bool_]) -> F64:
    """What a term adds to the cost of each candidate: per state of a fixed scale, or by the span of those kept."""
    raw = np.asarray(term.raw)
    if mission is not None and mission.profile.get("normalisation") == "min-max" and kept.any():
        low, span = raw[kept].min(), np.ptp(raw[kept])
        scaled = (raw - low) / (span or 1.0)
    else:
        scaled = raw / (term.scale * report.candidates.steps)
    return np.asarray(term.weight * scaled)


def threshold(mission: Mission | None) -> float | None:
    """Thr' of eq. 5, from the planner's profile: above it the robot is curious."""
    return number(mission, "uncertainty", "threshold")


def number(mission: Mission | None, table: str, key: str) -> float | None:
    """A number of the planner's profile; ``None`` if it has none there."""
    inner = mission.profile.get(table) if mission is not None else None
    value = inner.get(key) if isinstance(inner, dict) else None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def event(previous: Decision | None, made: Decision) -> tuple[str, str] | None:
    """(text, level) if something has changed for the worse or back; ``None`` if all is as before."""
    if previous is None or previous.action != made.action:
        level = "INFO" if made.action == "follow" else "WARN"
        return f"{_DONE[made.action]}: {made.reason}", level
    if previous.uncertain != made.uncertain:
        return ("uncertain where it is: curious" if made.uncertain else "sure of the place again"), "INFO"
    if set(previous.degraded) != set(made.degraded):
        return ("degraded: " + "; ".join(made.degraded) if made.degraded else "all is as it should be again"), "WARN"
    return None
