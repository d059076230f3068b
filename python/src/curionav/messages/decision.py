"""What the arbiter decides, what the driver makes of it, and the account of a cycle (``schemas/decision.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from ..array import F64, Array
from ..kinds import Fault, MapId, Name, NonNegative, Number, Positive, Uint, Uint32
from ..record import Message, Record
from .planning import CandidateSet
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

    A candidate's cost is the sum of ``weight * raw / scale`` over the active terms.
    """

    metric: Name
    weight: Number
    scale: Positive
    active: bool
    raw: Annotated[F64, Array("f64", "*")]
    evaluated: Evaluated


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

    ``total`` has shape [count]: the cost of each candidate, 0 for a rejected one; ``rejected`` says why, empty if it
    was not. ``chosen`` is an index into the candidates. ``gap`` counts the reports lost since the previous one sent.
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
    decision: Decision
    timings: Timings
    crowds: Annotated[list[Crowd], {"limit": 1024}]
    gap: Uint

    def check(self) -> None:
        """Terms are as long as the batch, and what was chosen exists."""
        count = self.candidates.count
        for index, term in enumerate(self.terms):
            if len(term.raw) not in (0, count):
                raise Fault(f"holds {len(term.raw)} elements, must hold {count} or none", f"terms[{index}].raw")
        if self.chosen is not None and self.chosen >= count:
            raise Fault("there is no such candidate", "chosen")
