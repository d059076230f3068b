"""What the classes of messages can do and what they check beyond single fields, by the name of the class."""

from __future__ import annotations

import hashlib
import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .array import F32, F64, I8, U8, U32
from .errors import DecodeError
from .field_types import MAX_MAGNITUDE, Fault, FieldType, Integer, Scope, at, expected, wrong
from .record import Record, field_type

if TYPE_CHECKING:
    from . import messages

NO_PARENT = 2**32 - 1
"""Parent of a root of a `Tree`."""


class Polygon(Record):
    """An outline."""

    x: F64

    def check(self) -> None:
        """Three vertices at least."""
        if len(self.x) < 3:
            raise Fault("too_few", "x", found=len(self.x), least=3)


MAX_LASER_DISTANCE = 5.0
"""Farthest that a laser may sit from the robot's centre, m."""


class Scan(Record):
    """A sweep of a laser."""

    angle_increment: float
    range_min: float | None
    range_max: float
    laser: messages.Pose
    ranges: F32

    def check(self) -> None:
        """It does not contradict itself."""
        beams, step = len(self.ranges), abs(self.angle_increment)
        if beams > 1 and not 0.0 < step <= math.tau / max(beams - 2.0, 1.0) + 1e-6:
            swept = f"{beams} beams that are {self.angle_increment:g} rad apart sweep {(beams - 1) * step:g} rad"
            detail = f"{swept}; a scan sweeps more than 0 and at most a turn and a step"
            raise Fault("invalid", "angle_increment", detail=detail)
        if self.range_min is not None and self.range_min >= self.range_max:
            raise Fault("out_of_range", "range_min", found=self.range_min, least=0.0, most=self.range_max)
        distance = math.hypot(self.laser.x, self.laser.y)
        if distance > MAX_LASER_DISTANCE:
            raise Fault("out_of_range", "laser.distance", found=distance, least=0.0, most=MAX_LASER_DISTANCE)

    def met(self) -> NDArray[np.bool_]:
        """By beam: whether it met something. A range of NaN or 0 says nothing; one of ``range_max`` met nothing."""
        greatest = min(self.range_max - 1e-6, float(np.float32(self.range_max)))
        return np.asarray((self.ranges > 0.0) & (self.ranges < greatest))


class People(Record):
    """People with what is known of their errors."""

    position_covariance: F64 | None
    velocity_covariance: F64 | None

    @classmethod
    def at(
        cls,
        x: ArrayLike,
        y: ArrayLike,
        vx: ArrayLike | None = None,
        vy: ArrayLike | None = None,
        *,
        id: ArrayLike | None = None,  # noqa: A002 - what it is
        radius: float = 0.25,
        stamp: float = 0.0,
    ) -> Self:
        """People whose places are known without error, for a planner of one's own world.

        Args:
            x: Of shape [people], m, map frame.
            y: As ``x``.
            vx: m/s; by default they stand.
            vy: As ``vx``.
            id: Steady over time; by default 0, 1, 2 and so on.
            radius: Of a person, m.
            stamp: s, robot clock.
        """
        places = np.asarray(x, np.float64)
        still = np.zeros(places.shape)
        columns = {"x": places, "y": y, "vx": still if vx is None else vx, "vy": still if vy is None else vy}
        fields: dict[str, Any] = {name: np.asarray(values, np.float64) for name, values in columns.items()}
        fields["id"] = np.asarray(np.arange(places.size) if id is None else id, np.uint32)
        return cls(**fields, **{"tick": 0, "stamp": stamp, "frame": "map", "radius": radius})

    def check(self) -> None:
        """No variance is negative."""
        for name in ("position_covariance", "velocity_covariance"):
            values = getattr(self, name)
            if values is None:
                continue
            flat = values.reshape(-1)
            wrong = [i for i in range(flat.size) if i % 3 != 1 and flat[i] < 0.0]
            if wrong:
                raise Fault("out_of_range", f"{name}[{wrong[0]}]", found=float(flat[wrong[0]]), least=0.0, most=1e12)


class Belief(Record):
    """A mean with its covariance."""

    covariance: F64

    @classmethod
    def at(
        cls,
        x: float,
        y: float,
        heading: float,
        *,
        covariance: F64 | None = None,
        v: float = 0.0,
        omega: float = 0.0,
        stamp: float = 0.0,
    ) -> Self:
        """What a robot believes that has no doubt of its place, for a planner of one's own world.

        Args:
            x: m, map frame.
            y: m.
            heading: rad.
            covariance: Of shape [3, 3]; by default 0.05 m and 0.02 rad.
            v: How fast it drives, m/s.
            omega: How fast it turns, rad/s.
            stamp: s, robot clock.
        """
        from .messages import Health  # noqa: PLC0415 - the module of the messages imports this one

        known = np.diag([0.0025, 0.0025, 0.0004]) if covariance is None else np.asarray(covariance, np.float64)
        fields: dict[str, Any] = {"x": x, "y": y, "heading": heading, "v": v, "omega": omega, "covariance": known}
        fields["health"] = Health(outside_weight=0.0, scan_fit=1.0, particles=1, confidence="sure")
        return cls(**fields, **{"tick": 0, "stamp": stamp})

    def check(self) -> None:
        """No variance is negative."""
        _check_variances("covariance", self.covariance)


class MissionOrder(Record):
    """A start with its covariance."""

    initial_covariance: F64

    def check(self) -> None:
        """No variance is negative."""
        _check_variances("initial_covariance", self.initial_covariance)


def _check_variances(field: str, covariance: F64) -> None:
    """Refuses a negative variance on the diagonal."""
    least = float(np.asarray(covariance).diagonal().min())
    if least < 0.0:
        raise Fault("out_of_range", field, found=least, least=0.0, most=MAX_MAGNITUDE)


class Scene(Record):
    """A belief and people."""

    people: messages.People

    def check(self) -> None:
        """The people are in the map frame."""
        if self.people.frame != "map":
            raise Fault("wrong_frame", "people.frame")


class CandidateShard(Record):
    """Some candidates."""

    @classmethod
    def of(cls, candidates: messages.CandidateSet) -> Self:
        """All of ``candidates``."""
        return cls(**vars(candidates))


class EvaluateRequest(Record):
    """Candidates to be scored."""

    candidates: messages.CandidateShard

    def all_columns(self, term: str) -> messages.CandidateSet:
        """The candidates for a term that reads every column.

        Raises:
            DecodeError: A column is absent.
        """
        from .messages import CandidateSet  # noqa: PLC0415 - the module of the messages imports this one

        for name in ("heading", "v", "omega"):
            if getattr(self.candidates, name) is None:
                detail = f"is missing, and the term `{term}` reads it"
                raise DecodeError(
                    "evaluate_request", f"candidates.{name}", {"code": "wrong_structure", "detail": detail}
                )
        return CandidateSet(**vars(self.candidates))


class Tree(Record):
    """Nodes with their parents."""

    parent: U32

    def check(self) -> None:
        """Every node leads to a root."""
        nodes = len(self.parent)
        parent = np.asarray(self.parent, np.int64)
        missing = parent[(parent >= nodes) & (parent != NO_PARENT)]
        if len(missing):
            raise Fault("no_such_index", "parent", found=int(missing[0]))
        # Jumping twice as far each time: after log2(nodes) jumps everything stands at the root's parent.
        above = np.append(np.where(parent == NO_PARENT, nodes, parent), nodes)
        for _ in range(nodes.bit_length()):
            above = above[above]
        if (above != nodes).any():
            raise Fault("cyclic_parents", "parent")


class Decision(Record):
    """What is to be done, with a trajectory."""

    action: str
    x: F64

    def check(self) -> None:
        """Only ``stop`` comes without a trajectory."""
        if len(self.x) == 0 and self.action != "stop":
            raise Fault("too_few", "x", found=0, least=1)


class TermReport(Record):
    """The costs of one term."""

    @classmethod
    def of(cls, raw: Any, cost: Any, **rest: Any) -> Self:
        """A report whose ``scored`` are the candidates with a raw cost, that is those where ``raw`` is not NaN."""
        scored = np.flatnonzero(~np.isnan(raw)).astype(np.uint32)
        fields: dict[str, Any] = {"raw": raw, "cost": cost, "scored": scored, **rest}
        return cls(**fields)


class CycleReport(Record):
    """A choice among candidates."""

    candidates: messages.CandidateSet
    terms: list[messages.TermReport]
    chosen: int | None
    runner_up: int | None

    def check(self) -> None:
        """What was chosen exists."""
        count = self.candidates.count
        for place, term in enumerate(self.terms):
            for name in ("alone", "without", "doubled", "halved"):
                _exists(getattr(term, name), count, f"terms[{place}].{name}")
        _exists(self.chosen, count, "chosen")
        _exists(self.runner_up, count, "runner_up")


def _exists(index: int | None, count: int, path: str) -> None:
    if index is not None and index >= count:
        raise Fault("no_such_index", path, found=index)


@dataclass(frozen=True)
class Rejections(FieldType):
    """Why candidates were rejected: here one entry per candidate, ``None`` for one that was not.

    On the wire it is a list of those that were, by ascending index. ``count`` names the number of all candidates,
    ``why`` is the type of a reason.
    """

    count: str
    why: Any

    def take(self, value: object, scope: Scope) -> list[dict[str, Any] | None]:
        """One entry per candidate."""
        if not isinstance(value, list):
            raise expected("a list", value)
        result: list[dict[str, Any] | None] = [None] * (scope.length(self.count) or 0)
        before = -1
        for place, entry in enumerate(value):
            here = f"[{place}]"
            if not isinstance(entry, dict) or not {"candidate", "why"} <= entry.keys():
                raise wrong("must be a map with `candidate` and `why`", here)
            index = at(f"{here}.candidate", Integer(high=2**32 - 1).take, entry["candidate"], scope)
            if index <= before:
                raise Fault("not_ascending", f"{here}.candidate")
            _exists(index, len(result), f"{here}.candidate")
            result[index] = at(f"{here}.why", field_type(self.why).take, entry["why"], scope)
            before = index
        return result

    def give(self, value: Any, scope: Scope) -> list[dict[str, Any]]:
        """The candidates that were rejected."""
        if not isinstance(value, list | tuple):
            raise expected("a list", value)
        count = scope.length(self.count) or 0
        if len(value) != count:
            raise Fault("wrong_length", found=len(value), expected=count)
        why = field_type(self.why)
        return [
            {"candidate": index, "why": why.give(entry, scope)}
            for index, entry in enumerate(value)
            if entry is not None
        ]


class OccupancyGrid(Record):
    """A map of cells."""

    width: int
    height: int
    resolution: float
    origin: messages.Pose
    cells: I8
    limits: U8 | None

    def identity(self) -> bytes:
        """SHA-256 of the content, 32 bytes: what ``map`` must be."""
        origin = self.origin
        head = struct.pack("<QQ4d", self.width, self.height, self.resolution, origin.x, origin.y, origin.heading)
        limits = b"" if self.limits is None else np.ascontiguousarray(self.limits, "u1").tobytes()
        return hashlib.sha256(head + np.ascontiguousarray(self.cells, "i1").tobytes() + limits).digest()


class Trace(Record):
    """Rows of what happened."""

    rows: int
    columns: list[str]
    values: F64
    people: messages.PeopleTrace

    def check(self) -> None:
        """One value per column, and people in every row or none."""
        if self.rows and self.values.shape[1] != len(self.columns):
            expected = self.rows * len(self.columns)
            raise Fault("wrong_length", "values", found=self.values.size, expected=expected)
        if self.people.rows not in (0, self.rows):
            raise Fault("wrong_length", "people.rows", found=self.people.rows, expected=self.rows)
