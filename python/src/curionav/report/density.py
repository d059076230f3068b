"""Success over density, where scenes of several kinds have the same densities of people."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from .comparison import Comparison
from .measures import tally

KINDS_LEAST = 2
"""Scenes that each density must have: one per density would show the scene and not the density."""


@dataclass(frozen=True)
class Densities:
    """The runs of every planner at every density: `tallies[planner][level]`; levels in people per m2, ascending."""

    levels: list[float]
    tallies: list[list[dict[str, int]]]

    @classmethod
    def of(cls, comparison: Comparison, people_per_m2: list[float]) -> Densities | None:
        """None unless there are several densities with several scenes each."""
        # To two digits: the number of people is whole, so scenes of one density differ a little.
        rounded = [float(f"{density:.1e}") for density in people_per_m2]
        levels = sorted(set(rounded))
        if len(levels) < 2 or any(rounded.count(level) < KINDS_LEAST for level in levels):
            return None
        by_level = [[s for s, density in enumerate(rounded) if density == level] for level in levels]
        tallies = [
            [tally(row for s in scenes for row in comparison.runs(s, p)) for scenes in by_level]
            for p in range(len(comparison.planners))
        ]
        return cls(levels, tallies)

    def shares(self, planner: int) -> list[float]:
        """The share of runs at the goal without a collision, level by level."""
        return [runs["success"] / max(runs["runs"], 1) for runs in self.tallies[planner]]

    def half(self, planner: int) -> str:
        """Where a planner's success falls to half, in words: a density, or on which side of all of them."""
        points = list(zip(self.levels, self.shares(planner), strict=True))
        if points[0][1] < 0.5:
            return f"below {points[0][0]:g}"
        for (less, above), (more, below) in pairwise(points):
            if below < 0.5:
                return f"{less + (more - less) * (above - 0.5) / (above - below):.2f}"
        return f"above {points[-1][0]:g}"
