"""What a simulated world is asked to play: a scenario with its files, a planner, and a seed."""

from __future__ import annotations

import os
from typing import Any

from .messages import Clock, InjectRequest
from .profiles import Planner
from .scenario import Scenario

Playable = Scenario | str | os.PathLike[str] | dict[str, Any]
"""A scenario, a scenario file (``.toml``), its tables, or the name of a built-in one such as ``quickstart``."""


def scenario_of(given: Playable) -> Scenario:
    """The scenario that was meant.

    Raises:
        ScenarioError: The file cannot be read, or there is no scenario of this name.
    """
    if isinstance(given, Scenario):
        return given
    return Scenario.from_dict(given) if isinstance(given, dict) else Scenario.load(given)


def injection(
    scenario: Scenario, planner: Planner | None, seed: int, clock: Clock = "lockstep", time_scale: float = 1.0
) -> InjectRequest:
    """The message that asks for a run.

    Raises:
        ScenarioError: A file that the scenario names is missing, or there is no such planner.
    """
    tables, files = scenario.packed()
    profile = scenario.profile(planner)
    return InjectRequest(scenario=tables, files=files, profile=profile, seed=seed, clock=clock, time_scale=time_scale)
