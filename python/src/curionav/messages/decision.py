"""What the arbiter decides, what the driver makes of it, and the account of a cycle (``schemas/decision.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np

from ..array import F64, U32, Array, Indices, ScoredOnly
from ..field_types import (
    Coded,
    Fault,
    FieldType,
    Float,
    Integer,
    MapId,
    Name,
    NonNegative,
    Number,
    OneOf,
    Positive,
    Scope,
    Text,
    Uint,
    Uint32,
    at,
    expected,
    wrong,
)
from ..record import Message, Record
from .planning import CandidateSet, Tree
from .sensing import Scene
from .service import MissionState

Evaluated = Literal["pool", "local", "none"]
"""What has evaluated a term: replicas, the arbiter itself, nothing."""

_UINT32, _FLOAT, _NAME = Integer(high=2**32 - 1), Float(), Text(identifier=True)
_HITS_PERSON: dict[str, FieldType] = {"person": _UINT32, "after_s": _FLOAT}
_PREVIOUS = Coded(
    {
        "held": {},
        "absent": {},
        "expired": {},
        "strayed": {"distance_m": _FLOAT},
        "hits_wall": {"after_s": _FLOAT},
        "hits_person": _HITS_PERSON,
    }
)
_REJECTION = Coded(
    {
        "not_scored": {"term": _NAME},
        "unreachable": {"step": _UINT32},
        "hits_wall": {"after_s": _FLOAT},
        "hits_person": _HITS_PERSON,
        "slow": {},
    }
)

Reason = Annotated[
    dict[str, Any],
    Coded(
        {
            "arrived": {},
            "least_cost": {},
            "last_to_collide": {},
            "least_cost_free": {},
            "only_slow_free": {},
            "no_candidates": {"previous": _PREVIOUS},
            "not_scored": {"term": _NAME, "previous": _PREVIOUS},
            "none_free": {"previous": _PREVIOUS},
            "mission_not_running": {"state": OneOf(get_args(MissionState))},
            "not_prepared": {},
            "people_unknown": {},
            "cycle_failed": {},
        }
    ),
]
"""Why a cycle was decided as it was: a ``code`` and its parameters."""

Degradation = Annotated[
    dict[str, Any],
    Coded(
        {
            "evaluated_locally": {"term": _NAME},
            "partly_evaluated": {"term": _NAME},
            "not_evaluated": {"term": _NAME},
            "generated_locally": {},
            "partly_generated": {},
            "not_generated": {},
            "cut_short": {},
            "not_prepared": {},
            "people_unknown": {},
            "cycle_failed": {},
        }
    ),
]
"""What was not as it should be: a ``code`` and its parameters."""

CommandReason = Literal[
    "tracking",
    "too_close",
    "arrived",
    "told_to_stop",
    "mission_not_running",
    "no_odometry",
    "no_decision",
    "decision_expired",
    "decision_of_another_run",
    "decision_invalid",
    "decision_belief_unknown",
    "no_belief",
    "belief_too_old",
    "belief_of_another_run",
    "no_scan",
    "scan_too_old",
    "scan_of_another_run",
]
"""What the driver does: ``tracking`` and ``too_close`` follow the decision, all others stop."""


@dataclass(frozen=True)
class Rejections(FieldType):
    """Why candidates were rejected: here one entry per candidate, ``None`` for one that was not.

    On the wire it is a list of those that were, by ascending index. ``count`` names the number of all candidates.
    """

    count: str

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
            index = at(f"{here}.candidate", _UINT32.take, entry["candidate"], scope)
            if index <= before:
                raise Fault("not_ascending", f"{here}.candidate")
            _exists(index, len(result), f"{here}.candidate")
            result[index] = at(f"{here}.why", _REJECTION.take, entry["why"], scope)
            before = index
        return result

    def give(self, value: Any, scope: Scope) -> list[dict[str, Any]]:
        """The candidates that were rejected."""
        if not isinstance(value, list | tuple):
            raise expected("a list", value)
        count = scope.length(self.count) or 0
        if len(value) != count:
            raise Fault("wrong_length", found=len(value), expected=count)
        return [
            {"candidate": index, "why": _REJECTION.give(why, scope)}
            for index, why in enumerate(value)
            if why is not None
        ]


@dataclass(frozen=True, eq=False, kw_only=True)
class Decision(Message):
    """The end of every planning cycle.

    ``follow`` a candidate that every active term has scored, ``hold`` the tail of the previous decision, or
    ``stop``. The trajectory ``x, y`` (m), ``heading`` (rad), ``v`` (m/s), ``omega`` (rad/s) has shape [K], map frame;
    state k (from 0) is due at ``stamp + (k + 1) * dt``; K is 0 for ``stop`` only. It may be followed for
    ``valid_for_s`` after the scene's ``stamp`` (s, robot clock). ``uncertainty`` is the trace of the belief's position
    covariance, m^2. ``degraded`` says what was not as it should be; empty in a healthy cycle.
    """

    NAME: ClassVar[str] = "decision"
    MAX_BYTES: ClassVar[int] = 128 << 10

    epoch: Uint
    seq: Uint
    tick: Uint
    stamp: Number
    valid_for_s: NonNegative
    action: Literal["follow", "hold", "stop"]
    reason: Reason
    arrived: bool
    candidate: Uint32 | None = None
    dt: Positive
    x: Annotated[F64, Array("f64", "K", limit=256)]
    y: Annotated[F64, Array("f64", "K")]
    heading: Annotated[F64, Array("f64", "K")]
    v: Annotated[F64, Array("f64", "K")]
    omega: Annotated[F64, Array("f64", "K")]
    uncertainty: Number
    uncertain: bool
    evaluated: dict[str, Evaluated]
    degraded: list[Degradation]
    elapsed_us: Uint

    def check(self) -> None:
        """Only ``stop`` comes without a trajectory."""
        if len(self.x) == 0 and self.action != "stop":
            raise Fault("too_few", "x", found=0, least=1)


@dataclass(frozen=True, eq=False, kw_only=True)
class Twist(Message):
    """What the base is to do now: ``v`` m/s forward, ``omega`` rad/s.

    ``epoch`` and ``seq`` are those of the newest decision that the driver has taken, 0 before the first. ``reason``
    says what becomes of it, and has been the same ``since`` then (s, robot clock).
    """

    NAME: ClassVar[str] = "twist"
    MAX_BYTES: ClassVar[int] = 2 << 10

    epoch: Uint
    seq: Uint
    tick: Uint
    stamp: Number
    v: Number
    omega: Number
    reason: CommandReason
    since: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class TermReport(Record):
    """One term of the cost.

    ``raw`` is in the term's unit, ``cost`` is weighted: what the term adds to the total. Both have shape [count], with
    NaN for a candidate that the term has not scored; ``scored`` are the indices of those that it has. The rest says
    which candidate (an index) would have been followed, all else being equal: by this term ``alone``, ``without`` it,
    with its weight ``doubled`` or ``halved``; ``None`` if none.
    """

    term: Name
    weight: Number
    scale: Positive
    active: bool
    evaluated: Evaluated
    scored: Annotated[U32, Indices("candidates.count")]
    raw: Annotated[F64, ScoredOnly("candidates.count")]
    cost: Annotated[F64, ScoredOnly("candidates.count")]
    alone: Uint32 | None = None
    without: Uint32 | None = None
    doubled: Uint32 | None = None
    halved: Uint32 | None = None

    @classmethod
    def of(cls, raw: Any, cost: Any, **rest: Any) -> TermReport:
        """A report whose ``scored`` are the candidates with a raw cost, that is those where ``raw`` is not NaN."""
        return cls(raw=raw, cost=cost, scored=np.flatnonzero(~np.isnan(raw)).astype(np.uint32), **rest)


@dataclass(frozen=True, eq=False, kw_only=True)
class TermTime(Record):
    """Microseconds that one term took, from asking to the last answer; terms overlap."""

    term: Name
    us: Uint


@dataclass(frozen=True, eq=False, kw_only=True)
class Timings(Record):
    """Where a cycle's time went, microseconds."""

    generate_us: Uint
    evaluate_us: Annotated[list[TermTime], {"limit": 32}]
    arbitrate_us: Uint
    total_us: Uint


@dataclass(frozen=True, eq=False, kw_only=True)
class Crowd(Record):
    """One component of the crowd density model: mean ``x, y`` (m), variance ``sigma`` along each axis (m^2), weight."""

    x: Number
    y: Number
    sigma: NonNegative
    weight: NonNegative
    members: Uint32


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleReport(Message):
    """Everything that went into a decision.

    ``total`` has shape [count]: the cost of each candidate, NaN for one that an active term has not scored; ``scored``
    are the indices of those that have a cost. ``rejected`` has one entry per candidate: why it was rejected (a ``code``
    and its parameters, in words ``say("rejection", why)``), ``None`` if it was not. ``chosen`` is an index into the
    candidates, ``runner_up`` that of the one that would have been followed without it, ``margin`` what it costs more
    (negative if cost alone did not decide). ``driven`` is the driver's last command before this cycle, ``None`` until
    one is heard. ``gap`` counts the planning ticks since the previous cycle that had none.
    """

    NAME: ClassVar[str] = "cycle_report"
    MAX_BYTES: ClassVar[int] = 20480 << 10

    robot: Name
    epoch: Uint
    seq: Uint
    map: MapId
    scene: Scene
    candidates: CandidateSet
    terms: Annotated[list[TermReport], {"limit": 32}]
    scored: Annotated[U32, Indices("candidates.count")]
    total: Annotated[F64, ScoredOnly("candidates.count")]
    rejected: Annotated[list[dict[str, Any] | None], Rejections("candidates.count")]
    chosen: Uint32 | None = None
    runner_up: Uint32 | None = None
    margin: Number | None = None
    decision: Decision
    timings: Timings
    crowds: Annotated[list[Crowd], {"limit": 1024}]
    driven: Twist | None = None
    gap: Uint

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


@dataclass(frozen=True, eq=False, kw_only=True)
class Previous(Record):
    """A trajectory that an earlier cycle has chosen.

    Arrays as those of a `Decision`, but the first number in each belongs to ``stamp``: where the robot was.
    """

    candidate: Uint32 | None = None
    stamp: Number
    valid_for_s: NonNegative
    dt: Positive
    x: Annotated[F64, Array("f64", "K", limit=256)]
    y: Annotated[F64, Array("f64", "K")]
    heading: Annotated[F64, Array("f64", "K")]
    v: Annotated[F64, Array("f64", "K")]
    omega: Annotated[F64, Array("f64", "K")]


@dataclass(frozen=True, eq=False, kw_only=True)
class Place(Record):
    """Somewhere that the robot came to, ``since`` when by its clock."""

    x: Number
    y: Number
    since: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class Memory(Message):
    """What the arbiter carried into cycle ``seq``: with mission and scene it decides the cycle.

    ``uncertain`` and ``members`` (ids of people) are those of the scene before, ``place`` what the robot has not left,
    ``region`` the wider place that it has not left while it was patient, ``unseen`` what only the driver sees,
    ``previous`` the trajectory being driven, ``driven`` the driver's newest command, ``trees`` those of the generators,
    an empty one if there is nothing to go on with. Published only while something listens.
    """

    NAME: ClassVar[str] = "memory"
    MAX_BYTES: ClassVar[int] = 20480 << 10

    robot: Name
    epoch: Uint
    seq: Uint
    run: Uint
    revision: Uint
    version: str
    uncertain: bool
    members: Annotated[U32, Array("u32", "*", high=2**32 - 1, limit=1024)]
    place: Place | None = None
    region: Place | None = None
    impatient_since: Number | None = None
    unseen: Place | None = None
    previous: Previous | None = None
    driven: Twist | None = None
    trees: Annotated[list[Tree], {"limit": 8}]
