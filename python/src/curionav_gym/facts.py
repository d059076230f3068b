"""What really is at a tick, as the extension module gives it: one column of numbers by name, one row by world."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from curionav.array import F64

PERSON, WALL = 1, 2
"""What the robot may touch; added, if it touches both."""


@dataclass(frozen=True)
class Facts:
    """Of shape [worlds] each; s, m, rad.

    Attributes:
        time: Since the start.
        x: Where the robot really is, map frame.
        y: As ``x``.
        heading: Of the robot.
        v: Its true speed.
        omega: Its true turn rate.
        to_go: Length of the shortest way to the goal; infinite where none leads there.
        person_clearance: From the robot's edge to that of the nearest person; infinite without people.
        wall_clearance: From its edge to the nearest wall.
        touches: 0, `PERSON`, `WALL` or both.
        reached: 1 within the goal's tolerance.
        late: 1 at the scenario's time limit.
    """

    time: F64
    x: F64
    y: F64
    heading: F64
    v: F64
    omega: F64
    to_go: F64
    person_clearance: F64
    wall_clearance: F64
    touches: F64
    reached: F64
    late: F64

    @classmethod
    def of(cls, table: F64) -> Facts:
        """The columns of a table of shape [worlds, columns]."""
        names = [field.name for field in fields(cls)]
        return cls(**dict(zip(names, table.T, strict=True)))

    def with_rows(self, chosen: NDArray[np.bool_], rows: Facts) -> Facts:
        """With the rows of ``rows``, in order, where chosen."""
        columns = {field.name: getattr(self, field.name).copy() for field in fields(self)}
        for name, column in columns.items():
            column[chosen] = getattr(rows, name)
        return Facts(**columns)
