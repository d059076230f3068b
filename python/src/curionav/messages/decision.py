"""What the arbiter decides, what the driver makes of it, and the account of a cycle (``schemas/decision.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from ..array import F64, U32, Array
from ..kinds import Fault, MapId, Name, NonNegative, Number, Positive, Uint, Uint32
from ..record import Message, Record
from .planning import CandidateSet, Tree
from .sensing import Scene

Evaluated = Literal["pool", "local", "none"]
"""Who scored a metric: replicas, the arbiter itself, nobody."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Decision(Message):
    """The end of every planning cycle.

    ``follow`` a candidate that every required metric has scored, ``hold`` the tail of the previous decision, or
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
    reason: str
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
    degraded: list[str]
    elapsed_us: Uint

    def check(self) -> None:
        """Only ``stop`` comes without a trajectory."""
        if len(self.x) == 0 and self.action != "stop":
            raise Fault("only `stop` may come without a trajectory", "x")


@dataclass(frozen=True, eq=False, kw_only=True)
class Twist(Message):
    """What the base is to do now: ``v`` m/s forward, ``omega`` rad/s; ``reason`` is empty if it is the decision's."""

    NAME: ClassVar[str] = "twist"
    MAX_BYTES: ClassVar[int] = 2 << 10

    epoch: Uint
    seq: Uint
    tick: Uint
    stamp: Number
    v: Number
    omega: Number
    reason: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TermReport(Record):
    """One term of the cost; ``raw`` has shape [count], the metric's unit, or is empty if it was not evaluated.

    ``cost`` has the shape of ``raw``: what the term adds to each candidate's total, weighted. ``missing`` are indices
    of candidates it has not scored, whose ``raw`` and ``cost`` are 0. The rest says which candidate (an index) would
    have been followed, all else being equal: by this term ``alone``, ``without`` it, with its weight ``doubled`` or
    ``halved``; ``None`` if none. An arbiter of an older version leaves all of this out.
    """

    metric: Name
    weight: Number
    scale: Positive
    active: bool
    raw: Annotated[F64, Array("f64", "*")]
    evaluated: Evaluated
    cost: Annotated[F64, Array("f64", "*")] | None = None
    missing: Annotated[U32, Array("u32", "*", high=2**32 - 1)] | None = None
    alone: Uint32 | None = None
    without: Uint32 | None = None
    doubled: Uint32 | None = None
    halved: Uint32 | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class MetricTime(Record):
    """Microseconds one metric took, from asking to the last answer; metrics overlap."""

    metric: Name
    us: Uint


@dataclass(frozen=True, eq=False, kw_only=True)
class Timings(Record):
    """Where a cycle's time went, microseconds."""

    generate_us: Uint
    evaluate_us: Annotated[list[MetricTime], {"limit": 32}]
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

    ``total`` has shape [count]: the cost of each candidate, 0 for one that a term has not scored; ``rejected`` says
    why it was, empty if it was not. ``chosen`` is an index into the candidates, ``runner_up`` that of the one that
    would have been followed without it, ``margin`` what it costs more (negative if cost alone did not decide).
    ``gap`` counts the reports lost since the previous one sent.
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
    total: Annotated[F64, Array("f64", "candidates.count")]
    rejected: Annotated[list[str], {"limit": "candidates.count"}]
    chosen: Uint32 | None = None
    runner_up: Uint32 | None = None
    margin: Number | None = None
    decision: Decision
    timings: Timings
    crowds: Annotated[list[Crowd], {"limit": 1024}]
    gap: Uint

    def check(self) -> None:
        """Terms are as long as the batch, and what was chosen exists."""
        count = self.candidates.count
        for index, term in enumerate(self.terms):
            for name, array in (("raw", term.raw), ("cost", term.cost)):
                if array is not None and len(array) not in (0, count):
                    raise Fault(f"holds {len(array)} elements, must hold {count} or none", f"terms[{index}].{name}")
            indices = {name: getattr(term, name) for name in ("alone", "without", "doubled", "halved")}
            if term.missing is not None and len(term.missing):
                indices["missing"] = int(term.missing.max())
            for name, found in indices.items():
                _exists(found, count, f"terms[{index}].{name}")
        _exists(self.chosen, count, "chosen")
        _exists(self.runner_up, count, "runner_up")


def _exists(index: int | None, count: int, path: str) -> None:
    if index is not None and index >= count:
        raise Fault("there is no such candidate", path)


@dataclass(frozen=True, eq=False, kw_only=True)
class Previous(Record):
    """A trajectory that an earlier cycle has chosen; arrays as those of a `Decision`, shape [K]."""

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
class Memory(Message):
    """What the arbiter carried into cycle ``seq``: with mission and scene it decides the cycle.

    ``uncertain`` and ``members`` (ids of people) are those of the scene before, ``previous`` the trajectory being
    driven, ``trees`` those of the generators, one without nodes if it is not yet grown. Published only while somebody
    listens.
    """

    NAME: ClassVar[str] = "memory"
    MAX_BYTES: ClassVar[int] = 25600 << 10

    robot: Name
    epoch: Uint
    seq: Uint
    run: Uint
    revision: Uint
    version: str
    uncertain: bool
    members: Annotated[U32, Array("u32", "*", high=2**32 - 1, limit=1024)]
    previous: Previous | None = None
    trees: Annotated[list[Tree], {"limit": 8}]
