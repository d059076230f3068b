"""Made-up runs of a bench, for the tests of `curionav.report`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from curionav.report.comparison import Comparison
from curionav.report.measures import Row
from curionav.report.summary import Bench


def row(scenario: str, planner: str, seed: int, td: float = 0.1) -> Row:
    """A run that reached the goal without a collision."""
    return {
        "key": f"{scenario}-{planner}-{seed}",
        "program": "abc",
        "scenario": scenario,
        "planner": planner,
        "seed": seed,
        "outcome": "reached",
        "measures": {
            "rmse_m": 0.12,
            "tcm": 0.05,
            "nm": 1,
            "tce_s": 2.0,
            "td": td,
            "md_m": 1.8,
            "nt": 2,
            "vel_mps": 0.8,
            "length_m": 20.0,
            "time_s": 25.0,
            "collisions": 0,
            "clearance_min_m": 0.4,
        },
        "contacts": [],
        "social": {"shortest_m": 18.0, "frozen_s": 0.0},
        "cycles": {"count": 83, "first_choice": 70, "other_choice": {"least_cost_free": 13}, "degraded": 0},
        "real_time_factor": 20.0,
        "wall_s": 2.0,
        "way": [[0.0, 0.0], [1.0, 0.5]],
    }


def rows(scenario: str, planners: list[str], td: Callable[[int, int], float]) -> list[Row]:
    """Ten seeds of each planner, TD as given by (planner, seed)."""
    return [row(scenario, name, seed, td(p, seed)) for p, name in enumerate(planners) for seed in range(1, 11)]


def scenario(name: str, place: int) -> dict[str, Any]:
    """A scenario as bench.json has it."""
    return {
        "name": name,
        "description": "A hall.",
        "place": place,
        "people": 5,
        "motion": "HRVO",
        "people_per_m2": 0.1,
        "cell_m": 0.05,
        "known_cells": 60000,
        "landmark_cells": 4000,
        "laser_range_m": 5.0,
        "start": [0.0, 0.0],
        "goal": [8.0, 4.0],
        "goal_tolerance_m": 0.5,
        "robot_radius_m": 0.3,
        "person_radius_m": 0.25,
        "threshold": 0.1,
        "time_limit_s": 90.0,
        "paper": None,
        "picture": {"cell_m": 1.0, "origin": [-1.0, -1.0, 0.0], "rows": ["##########", "#..---...#", "#########?"]},
    }


def bench(runs: list[Row], planners: list[str], places: dict[str, int]) -> Bench:
    """The runs as a bench of these planners in scenarios with their places."""
    made = {
        "version": "0.1.0",
        "programs": ["abc"],
        "planners": [{"name": name, "source": name} for name in planners],
        "scenarios": [scenario(name, place) for name, place in places.items()],
        "first_seed": 1,
        "repeats": 10,
        "perception": "tracked",
        "workers": 2,
        "clock_s": 90.0,
        "claims": [],
        "missing": [],
    }
    return Bench(Path("nowhere"), made, Comparison(planners, list(places), list(places.values()), runs))
