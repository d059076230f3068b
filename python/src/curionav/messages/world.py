"""Maps, and the simulated world: inject a scenario, watch the run (``schemas/world.cddl``)."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from ..array import F32, F64, I8, U8, U32, Array
from ..field_types import (
    Bytes,
    Fault,
    Fraction,
    Integer,
    MapId,
    Name,
    NonNegative,
    Number,
    Params,
    Positive,
    Text,
    Uint,
    Uint32,
)
from ..record import Message, Record
from .mission import Clock, MissionEnd
from .robot import Pose


@dataclass(frozen=True, eq=False, kw_only=True)
class OccupancyGrid(Message):
    """A map of cells of ``resolution`` m; ``origin`` is the outer corner of cell (0, 0) in the map frame.

    ``cells`` has shape [height, width], the row of least y first: -1 unknown, else per cent occupied. ``map`` is the
    hash of the rest.
    """

    NAME: ClassVar[str] = "occupancy_grid"
    MAX_BYTES: ClassVar[int] = 15629 << 10

    width: Annotated[int, Integer(1, 16_000_000)]
    height: Annotated[int, Integer(1, 16_000_000)]
    resolution: Positive
    origin: Pose
    cells: Annotated[I8, Array("i8", "height", "width", low=-1, high=100)]
    map: MapId

    def identity(self) -> bytes:
        """SHA-256 of the content, 32 bytes: what ``map`` must be."""
        origin = self.origin
        head = struct.pack("<QQ4d", self.width, self.height, self.resolution, origin.x, origin.y, origin.heading)
        return hashlib.sha256(head + np.ascontiguousarray(self.cells, "i1").tobytes()).digest()


@dataclass(frozen=True, eq=False, kw_only=True)
class InjectRequest(Message):
    """Run this scenario, with the ``files`` it names and a whole planner ``profile``.

    ``seed`` is the scenario's own if it is ``None``.
    """

    NAME: ClassVar[str] = "inject_request"
    MAX_BYTES: ClassVar[int] = 65536 << 10

    scenario: Params
    files: Annotated[dict[str, Annotated[bytes, Bytes()]], {"limit": 32, "free_keys": True}]
    profile: Params
    seed: Uint | None = None
    clock: Clock
    time_scale: Positive


@dataclass(frozen=True, eq=False, kw_only=True)
class Measures(Record):
    """The measures of the paper and a few more.

    ``rmse_m`` localisation error; ``tcm`` (0..1) share of the run before localisation converged (1: never), ``nm``
    times it lost convergence after that (``None`` if it never converged); ``tce_s`` time until the error stayed below
    0.3 m for 2 s (``None`` if it never did); ``td`` (0..1) share of the time closer to people than comfortable,
    ``md_m`` least distance to a person, between centres (``None`` if there were no people), ``nt`` times it came
    closer than comfortable; ``vel_mps`` mean speed; ``length_m`` driven; ``time_s`` duration;
    ``collisions`` contacts while driving; ``clearance_min_m`` to people and walls, negative in contact.
    """

    rmse_m: NonNegative
    tcm: Fraction
    nm: Uint32 | None = None
    tce_s: NonNegative | None = None
    td: Fraction
    md_m: Number | None = None
    nt: Uint32
    vel_mps: NonNegative
    length_m: NonNegative
    time_s: NonNegative
    collisions: Uint32
    clearance_min_m: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class Cycles(Record):
    """The planning cycles of a run: how many, how many degraded and by what code, wall times in ms.

    ``skipped`` counts the ticks that a cycle was due in and that had none, ``late`` the cycles decided only after the
    next one was due, ``first_choice`` those in which the candidate that the planner wanted most was followed, and
    ``other_choice`` the others by the code of the decision's reason.
    """

    count: Uint
    skipped: Uint | None = None
    late: Uint | None = None
    first_choice: Uint | None = None
    other_choice: dict[str, Uint] | None = None
    degraded: Uint
    degraded_by: dict[str, Uint] | None = None
    p50_ms: NonNegative
    p99_ms: NonNegative
    max_ms: NonNegative


@dataclass(frozen=True, eq=False, kw_only=True)
class PeopleTrace(Record):
    """Where the people were: ``xy`` [rows, people, 2] m, map frame; ``present`` [rows, people] 1 where they were there.

    ``id`` has shape [people]; ``rows`` is the trace's, or 0 if people were not recorded.
    """

    rows: Annotated[int, Integer(0, 360_000)]
    id: Annotated[U32, Array("u32", "people", high=2**32 - 1, limit=1024)]
    xy: Annotated[F32, Array("f32", "rows", "people", 2)]
    present: Annotated[U8, Array("u8", "rows", "people", high=1)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace(Record):
    """What happened, tick by tick, of a long run at evenly spaced ticks: ``values`` has shape [rows, columns]."""

    rows: Annotated[int, Integer(0, 360_000)]
    columns: list[Name]
    values: Annotated[F64, Array("f64", "rows", "*")]
    people: PeopleTrace

    def check(self) -> None:
        """One value per column, and people in every row or none."""
        if self.rows and self.values.shape[1] != len(self.columns):
            expected = self.rows * len(self.columns)
            raise Fault("wrong_length", "values", found=self.values.size, expected=expected)
        if self.people.rows not in (0, self.rows):
            raise Fault("wrong_length", "people.rows", found=self.people.rows, expected=self.rows)


@dataclass(frozen=True, eq=False, kw_only=True)
class Contact(Record):
    """A collision: ``time_s`` since the start, with ``person`` or with a wall (``None``).

    ``robot_mps`` is how fast the robot came towards the person or hit the wall, ``person_mps`` how fast the person came
    towards the robot (0 for a wall); negative speeds go away.
    """

    time_s: NonNegative
    person: Uint32 | None = None
    robot_mps: Number
    person_mps: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class RunResult(Message):
    """A run that came to an end; ``decisions_sha256`` covers scene stamps and chosen trajectories.

    ``social`` holds the standard measures of social navigation by name, units in the names; yes and no are 1 and 0,
    and what there was nothing to measure of is not in it. ``contacts`` are the collisions one by one.
    """

    NAME: ClassVar[str] = "run_result"
    MAX_BYTES: ClassVar[int] = 31744 << 10

    scenario: str
    planner: str
    seed: Uint
    outcome: Literal["reached", "timeout", "lost"]
    measures: Measures
    contacts: Annotated[list[Contact] | None, {"limit": 256}] = None
    social: dict[str, Number] | None = None
    cycles: Cycles
    real_time_factor: NonNegative
    decisions_sha256: Annotated[str, Text(is_hash=True)]
    trace: Trace


@dataclass(frozen=True, eq=False, kw_only=True)
class RunStatus(Message):
    """How a world's run goes: simulated ``tick`` and ``time_s`` (s), true ``distance_to_goal`` (m).

    ``error`` says why it failed.
    """

    NAME: ClassVar[str] = "run_status"
    MAX_BYTES: ClassVar[int] = 32764 << 10

    run: Uint
    world: Name
    state: Literal["idle", "preparing", "running", "finished", "failed"]
    tick: Uint
    time_s: NonNegative
    distance_to_goal: NonNegative
    error: MissionEnd | None = None
    result: RunResult | None = None
