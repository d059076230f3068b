"""Positions of a robot and people at evenly spaced times."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..array import F64
from ..errors import IncompleteResult
from ..result import Result

I64 = NDArray[np.int64]

MOVED_M = 0.05
"""A person looks where the last step of this length went: shorter ones say more of noise than of a direction."""


@dataclass(frozen=True, eq=False)
class Tracks:
    """One row per person and frame, in no particular order; the robot counts as a person with an id of its own.

    Attributes:
        frame_rate: Frames per second, above 0.
        id: Whose row it is, shape [rows], not negative.
        frame: When, shape [rows]; ``frame / frame_rate`` is the time in seconds.
        x: Shape [rows], m.
        y: Shape [rows], m.
        robot: The id of the robot; ``None`` if all are people.
    """

    frame_rate: float
    id: I64
    frame: I64
    x: F64
    y: F64
    robot: int | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.frame_rate < np.inf:
            raise ValueError(f"frame_rate {self.frame_rate} must be a number above 0")
        if not self.id.shape == self.frame.shape == self.x.shape == self.y.shape == (self.id.size,):
            raise ValueError("id, frame, x and y must have one entry per row each")
        if not (np.isfinite(self.x).all() and np.isfinite(self.y).all()):
            raise ValueError("x and y must be finite")
        if self.id.size and self.id.min() < 0:
            raise ValueError(f"id {self.id.min()} is negative")
        span = int(np.ptp(self.frame)) + 1 if self.frame.size else 1
        if np.unique(self.id * span + self.frame).size != self.id.size:
            raise ValueError("somebody is twice in one frame")

    @property
    def time_s(self) -> F64:
        """The time of each row, shape [rows], s."""
        return self.frame / self.frame_rate

    def only(self, rows: NDArray[np.bool_] | I64) -> Tracks:
        """These rows alone, in the order given."""
        return replace(self, id=self.id[rows], frame=self.frame[rows], x=self.x[rows], y=self.y[rows])

    def people(self) -> Tracks:
        """The same without the robot."""
        if self.robot is None:
            return self
        return replace(self.only(self.id != self.robot), robot=None)

    def by_time(self) -> Tracks:
        """The same rows by frame, and within a frame by id."""
        return self.only(np.lexsort((self.id, self.frame)))

    def headings(self) -> F64:
        """Which way each row's person went last, shape [rows], rad; 0 for those who never moved.

        Files of people hold no headings, so those of people who turn on the spot are not known.
        """
        found = np.zeros(self.id.size)
        for one in np.unique(self.id):
            rows = np.flatnonzero(self.id == one)
            rows = rows[np.argsort(self.frame[rows])]
            found[rows] = _headings(self.x[rows], self.y[rows])
        return found


def _headings(x: F64, y: F64) -> F64:
    """The headings of one person along a way, shape [rows]; before the first step that of the first step."""
    found = np.full(x.size, np.nan)
    anchor = 0
    for row in range(1, x.size):
        dx, dy = x[row] - x[anchor], y[row] - y[anchor]
        if np.hypot(dx, dy) >= MOVED_M:
            found[row] = np.arctan2(dy, dx)
            anchor = row
    known = np.flatnonzero(~np.isnan(found))
    if not known.size:
        return np.zeros(x.size)
    return found[known[np.maximum(np.searchsorted(known, np.arange(x.size), side="right") - 1, 0)]]


def from_result(result: Result) -> Tracks:
    """Where robot and people truly were in a run, a frame per row of its trace from 0 on.

    People keep their ids; the robot's is the one after the greatest of them.

    Raises:
        IncompleteResult: The result has no trace.
    """
    trace, people = result.trace, result.people
    if not {"time_s", "true_x", "true_y"} <= trace.keys() or len(trace["time_s"]) < 2:
        raise IncompleteResult(
            "the result has no trace of two ticks; load the folder of `--out` or a recording (.mcap)"
        )
    time_s, robot = trace["time_s"], int(people.id.max()) + 1 if people.id.size else 0
    row, person = np.nonzero(people.present)
    ticks = np.arange(len(time_s))
    return Tracks(
        # The rows of a trace are evenly spaced; the mean over all of them is free of the rounding of a single tick.
        frame_rate=round((len(time_s) - 1) / float(time_s[-1] - time_s[0]), 6),
        id=np.concatenate([np.full(ticks.size, robot), people.id[person]]).astype(np.int64),
        frame=np.concatenate([ticks, row]).astype(np.int64),
        x=np.concatenate([trace["true_x"], people.xy[row, person, 0]]).astype(np.float64),
        y=np.concatenate([trace["true_y"], people.xy[row, person, 1]]).astype(np.float64),
        robot=robot,
    )
