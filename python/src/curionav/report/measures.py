"""What a run is judged by, and how many runs ended how."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

Row = dict[str, Any]
"""A finished run, a line of the journal."""


@dataclass(frozen=True)
class Measure:
    """A measure: its key in files, its label for people, its value in a run (none where it has none)."""

    key: str
    label: str
    of: Callable[[Row], float | None]
    is_more_better: bool = False
    per_unit: float = 1.0
    decimals: int = 2

    def prefers(self, a: float, b: float) -> bool:
        """Whether `a` is better than `b`."""
        return a > b if self.is_more_better else a < b

    def show(self, value: float) -> str:
        """A stored value as it is shown, without its unit; there is no -0.00."""
        text = f"{value * self.per_unit:.{self.decimals}f}"
        is_zero = all(letter in "-0." for letter in text)
        return text.lstrip("-") if is_zero else text.replace("-", "\u2212")

    def show_with_unit(self, value: float) -> str:
        """The same with its unit."""
        unit = self.label.partition("(")[2].rstrip(")")
        return f"{self.show(value)} {unit}".rstrip()

    def interval(self, low: float, high: float) -> str:
        """Two bounds as they are shown."""
        return f"[{self.show(low)}, {self.show(high)}]"


def is_reached(row: Row) -> bool:
    """Whether the robot is at the goal."""
    return bool(row["outcome"] == "reached")


def is_success(row: Row) -> bool:
    """Whether it is there without a collision."""
    return is_reached(row) and row["measures"]["collisions"] == 0


def _direct(key: str) -> Callable[[Row], float | None]:
    def value(row: Row) -> float | None:
        found = row["measures"].get(key)
        return None if found is None else float(found)

    return value


def _of_arrived(key: str) -> Callable[[Row], float | None]:
    def value(row: Row) -> float | None:
        return float(row["measures"][key]) if is_reached(row) else None

    return value


def _success(row: Row) -> float:
    return float(is_success(row))


def _seconds_near_people(row: Row) -> float:
    return float(row["measures"]["td"] * row["measures"]["time_s"])


def _detour(row: Row) -> float | None:
    shortest = row.get("social", {}).get("shortest_m", 0.0)
    return row["measures"]["length_m"] / shortest if shortest > 0.0 and is_reached(row) else None


def _social(key: str) -> Callable[[Row], float | None]:
    def value(row: Row) -> float | None:
        found = row.get("social", {}).get(key)
        return None if found is None else float(found)

    return value


def _frozen(row: Row) -> float | None:
    found = row.get("social", {}).get("frozen_s")
    return None if found is None else float(found)


SUCCESS = Measure("success", "success (%)", _success, is_more_better=True, per_unit=100.0)
RMSE = Measure("rmse_m", "RMSE (m)", _direct("rmse_m"))
TCM = Measure("tcm", "TCM (%)", _direct("tcm"), per_unit=100.0)
NM = Measure("nm", "NM", _direct("nm"), decimals=1)
TCE = Measure("tce_s", "TCE (s)", _direct("tce_s"))
TD = Measure("td", "TD (%)", _direct("td"), per_unit=100.0)
TD_SECONDS = Measure("td_s", "TD (s)", _seconds_near_people)
MD = Measure("md_m", "MD (m)", _direct("md_m"), is_more_better=True)
NT = Measure("nt", "NT", _direct("nt"), decimals=1)
VEL = Measure("vel_mps", "Vel (m/s)", _direct("vel_mps"), is_more_better=True)
LENGTH = Measure("length_m", "Length (m)", _of_arrived("length_m"))
DETOUR = Measure("detour", "Length / shortest", _detour)
TIME = Measure("time_s", "Time (s)", _of_arrived("time_s"))
FROZEN = Measure("frozen_s", "frozen (s)", _frozen)
COLLISIONS = Measure("collisions", "collisions", _direct("collisions"))
CLEARANCE = Measure("clearance_min_m", "clearance (m)", _direct("clearance_min_m"), is_more_better=True)
TD_IN_VIEW = Measure("td_in_view", "TD in view (%)", _direct("td_in_view"), per_unit=100.0)
MD_IN_VIEW = Measure("md_in_view_m", "MD in view (m)", _direct("md_in_view_m"), is_more_better=True)

MEASURES = (
    SUCCESS, RMSE, TCM, NM, TCE, TD, TD_SECONDS, MD, NT, VEL, LENGTH, DETOUR, TIME, FROZEN, COLLISIONS, CLEARANCE,
)  # fmt: skip
"""All, after the first in the order of the run's JSON."""
PAPER = (RMSE, TCM, NM, TD, MD, NT, VEL, LENGTH, TIME)
"""Those of Tables III, IV and V, three a table."""
IN_VIEW = (TD_IN_VIEW, TD, MD_IN_VIEW, MD)
"""Of people that no wall hides from the robot, each with that of all people, which is the paper's, behind it. Runs of
older builds do not have them, so no test and no claim is about them."""
SOCIAL = (
    Measure("intimate_share", "intimate zone (%)", _social("intimate_share"), per_unit=100.0),
    Measure("personal_share", "personal zone (%)", _social("personal_share"), per_unit=100.0),
    Measure("social_share", "social zone (%)", _social("social_share"), per_unit=100.0),
    Measure("group_intrusions", "group intrusions", _social("group_intrusions")),
    Measure("time_to_collision_min_s", "least time to contact (s)", _social("time_to_collision_min_s")),
    Measure("jerk_avg_mps3", "jerk (m/s\u00b3)", _social("jerk_avg_mps3")),
    Measure("path_irregularity_radpm", "path irregularity (rad/m)", _social("path_irregularity_radpm")),
    Measure("people_delay_near_s", "people's delay (s)", _social("people_delay_near_s"), decimals=1),
)
"""Social measures that the report shows; `social.csv` has all. No test and no claim is about them."""
BY_KEY = {measure.key: measure for measure in MEASURES}

NOT_FIRST = {
    "other_free": "least_cost_free",
    "only_slow": "only_slow_free",
    "none_free": "none_free",
    "no_candidates": "no_candidates",
}
"""Why a cycle did not follow its first choice, and the reason code that says so."""


def tally(rows: Iterable[Row]) -> dict[str, int]:
    """Counts of runs, but for `contacts` and those of cycles; keys are those of summary.json."""
    names = ["runs", "success", "reached", "timeouts", "lost", "no_way", "collided", "touched", "contacts", "degraded"]
    counts = dict.fromkeys([*names, "cycles", "first_choices", *NOT_FIRST, "untold"], 0)
    for row in rows:
        measures = row["measures"]
        cycles = row["cycles"]
        others = cycles.get("other_choice") or {}
        counts["runs"] += 1
        counts["success"] += is_success(row)
        counts["reached"] += is_reached(row)
        counts["timeouts"] += row["outcome"] == "timeout"
        counts["lost"] += row["outcome"] == "lost"
        counts["no_way"] += row["outcome"] == "no_way"
        counts["collided"] += measures["collisions"] > 0
        counts["touched"] += measures["clearance_min_m"] <= 0.0
        counts["contacts"] += measures["collisions"]
        counts["degraded"] += cycles["degraded"] > 0
        counts["cycles"] += cycles["count"]
        counts["first_choices"] += cycles["first_choice"]
        for name, code in NOT_FIRST.items():
            counts[name] += others.get(code, 0)
        counts["untold"] += max(cycles["count"] - cycles["first_choice"] - sum(others.values()), 0)
    return counts


def blame(rows: Iterable[Row]) -> dict[str, int]:
    """Collisions, counted by which of robot and person came towards the other."""
    counts = dict.fromkeys(["robot", "person", "run_down", "walls"], 0)
    for row in rows:
        for contact in row.get("contacts") or []:
            if contact.get("person") is None:
                counts["walls"] += 1
            elif contact["robot_mps"] >= contact["person_mps"]:
                counts["robot"] += 1
            elif contact["robot_mps"] > 0.0:
                counts["person"] += 1
            else:
                counts["run_down"] += 1
    return counts


OVERLAPS = tuple(
    f"overlaps_{moved}_{where}" for moved in ("standing", "moving") for where in ("ahead", "beside", "behind")
)
"""All overlaps of bodies: whether the robot stood or moved, and where it had the person."""


def overlaps(rows: Iterable[Row]) -> dict[str, int]:
    """Overlaps of bodies over all runs, also those that count as no collision."""
    counts = dict.fromkeys(OVERLAPS, 0)
    for row in rows:
        for name in OVERLAPS:
            counts[name] += int(row.get("social", {}).get(name, 0.0))
    return counts


def settled(difference: float) -> float:
    """A difference without the rounding of its subtraction: what is equal is zero, and ties are ties."""
    scaled = difference * 1e9
    whole = math.trunc(scaled)
    if abs(scaled - whole) >= 0.5:
        whole += int(math.copysign(1, scaled))
    return math.copysign(abs(whole) / 1e9, scaled)


def plain(value: float) -> str:
    """The shortest digits that give the number, without an exponent and without a zero behind the point."""
    return np.format_float_positional(value, trim="-")


def count(number: int, what: str) -> str:
    """`1 run`, `2 runs`."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
