"""What a run leaves behind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .array import F64
from .messages import Contact, Cycles, Measures, PeopleTrace, RunResult


@dataclass(frozen=True)
class Result:
    """How a run ended.

    Attributes:
        scenario: Name of the scenario.
        planner: Name of the planner profile.
        seed: Seed of everything random.
        outcome: At the goal, out of time, or believing to be where the robot is not.
        measures: The measures of the paper and a few more.
        contacts: The collisions one by one: when, with which person or a wall, and how fast both came together.
        social: The standard measures of social navigation by name, units in the names: ``spl``, ``personal_share``,
            ``time_to_collision_min_s`` and so on. What there was nothing to measure of is not in it.
        cycles: The planning cycles, in numbers.
        real_time_factor: Simulated seconds per second of wall time.
        decisions_sha256: Digest of scene stamps and chosen trajectories, 64 hexadecimal digits: equal for equal
            decisions.
        trace: What happened, one array of shape [rows] per column, one row per tick, of a long run per so many
            ticks: ``time_s``, ``true_x``, ``belief_x`` and so on; m, rad, s.
        people: Where the people were in these rows.
    """

    scenario: str
    planner: str
    seed: int
    outcome: Literal["reached", "timeout", "lost", "no_way"]
    measures: Measures
    contacts: list[Contact]
    social: dict[str, float]
    cycles: Cycles
    real_time_factor: float
    decisions_sha256: str
    trace: dict[str, F64]
    people: PeopleTrace

    @classmethod
    def of(cls, message: RunResult) -> Result:
        """The result a message carries."""
        trace = message.trace
        return cls(
            scenario=message.scenario,
            planner=message.planner,
            seed=message.seed,
            outcome=message.outcome,
            measures=message.measures,
            contacts=list(message.contacts or []),
            social=dict(message.social or {}),
            cycles=message.cycles,
            real_time_factor=message.real_time_factor,
            decisions_sha256=message.decisions_sha256,
            trace={
                name: trace.values[:, column] if trace.rows else trace.values.reshape(-1)
                for column, name in enumerate(trace.columns)
            },
            people=trace.people,
        )
