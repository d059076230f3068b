"""What a run leaves behind."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from . import clip, stored_result
from .array import F64
from .extras import library
from .messages import Contact, Cycles, Measures, MissionOrder, OccupancyGrid, PeopleTrace, RunResult
from .plot import draw

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


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
        order: The mission: goal, tolerance, robot and so on; ``None`` unless it comes from `run` or a recording.
        grid: The map; ``None`` unless it comes from `run` or a recording.
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
    order: MissionOrder | None = None
    grid: OccupancyGrid | None = None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Result:
        """The result of a run of the program.

        Args:
            path: A recording of ``curionav run --record`` (``.mcap``), which has everything; of several runs the last
                counts. The folder of ``--out`` has no people, no mission and no map. What ``--json`` prints has no
                trace either.

        Raises:
            FileError: There is no result, or it is damaged.
            MissingExtra: It is a recording, and the extra ``frames`` is not installed.
        """
        stored = stored_result.read(Path(path))
        return replace(cls.of(stored.message), order=stored.order, grid=stored.grid)

    def to_pandas(self) -> pd.DataFrame:
        """The trace as a frame of one row per tick; m, rad, s and m/s, as ``docs/measures.md`` says of each column.

        Raises:
            MissingExtra: pandas is not installed.
        """
        frame: pd.DataFrame = library("pandas").DataFrame(self.trace)
        return frame

    def people_to_pandas(self) -> pd.DataFrame:
        """Where the people were: columns ``time_s``, ``id``, ``x`` and ``y`` (m), a row per person present and tick.

        Without people, or where they were not stored, it has no rows.

        Raises:
            MissingExtra: pandas is not installed.
        """
        row, person = np.nonzero(self.people.present)
        columns = {
            "time_s": self.trace["time_s"][row] if row.size else np.empty(0),
            "id": self.people.id[person],
            "x": self.people.xy[row, person, 0].astype(np.float64),
            "y": self.people.xy[row, person, 1].astype(np.float64),
        }
        frame: pd.DataFrame = library("pandas").DataFrame(columns)
        return frame

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the run from above, in metres: true and believed way, people, contacts, and what is known of the map.

        Args:
            ax: Where to draw; ``None`` for a new figure of its own.

        Raises:
            IncompleteResult: The result has no trace.
            MissingExtra: matplotlib is not installed.
        """
        return draw(self, ax)

    def clip(self, file: str | os.PathLike[str], *, speed: float = 4.0, frames_per_second: float = 10.0) -> None:
        """Writes the run from above as a moving picture (``.gif``).

        Args:
            file: What to write.
            speed: Seconds of the run in a second of the clip.
            frames_per_second: Of the clip.

        Raises:
            IncompleteResult: The result has no trace.
            MissingExtra: matplotlib is not installed.
            ValueError: Speed or frames per second are not positive.
        """
        if not (speed > 0.0 and frames_per_second > 0.0):
            raise ValueError("speed and frames_per_second must be positive")
        clip.write(self, Path(file), speed, frames_per_second)

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
