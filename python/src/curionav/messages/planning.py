"""Asking generators for candidates and evaluators for costs (``schemas/planning.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from ..array import F64, U32, Array
from ..errors import DecodeError
from ..field_types import Fault, Integer, MapId, Name, Number, Params, Positive, Uint, Uint32
from ..record import Message, Record
from .robot import LaserModel, OdometryNoise, RobotModel
from .sensing import Scene

NO_PARENT = 2**32 - 1
"""Parent of a root of a `Tree`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CandidateSet(Message):
    """Candidate trajectories; state k (from 0) is ``(k + 1) * dt`` s after the scene's stamp.

    ``id`` has shape [count]; ``x, y`` (m), ``heading`` (rad), ``v`` (m/s) and ``omega`` (rad/s), the speed and turn
    rate that led to the state, have shape [count, steps]; map frame.
    """

    NAME: ClassVar[str] = "candidate_set"
    MAX_BYTES: ClassVar[int] = 12288 << 10

    count: Annotated[int, Integer(0, 4096)]
    steps: Annotated[int, Integer(1, 256)]
    dt: Positive
    id: Annotated[U32, Array("u32", "count", high=2**32 - 1)]
    x: Annotated[F64, Array("f64", "count", "steps")]
    y: Annotated[F64, Array("f64", "count", "steps")]
    heading: Annotated[F64, Array("f64", "count", "steps")]
    v: Annotated[F64, Array("f64", "count", "steps")]
    omega: Annotated[F64, Array("f64", "count", "steps")]


@dataclass(frozen=True, eq=False, kw_only=True)
class CandidateShard(Record):
    """Candidates to be scored: a `CandidateSet`, of which columns are ``None`` that the term does not read."""

    count: Annotated[int, Integer(0, 4096)]
    steps: Annotated[int, Integer(1, 256)]
    dt: Positive
    id: Annotated[U32, Array("u32", "count", high=2**32 - 1)]
    x: Annotated[F64, Array("f64", "count", "steps")]
    y: Annotated[F64, Array("f64", "count", "steps")]
    heading: Annotated[F64, Array("f64", "count", "steps")] | None = None
    v: Annotated[F64, Array("f64", "count", "steps")] | None = None
    omega: Annotated[F64, Array("f64", "count", "steps")] | None = None

    @classmethod
    def of(cls, candidates: CandidateSet) -> CandidateShard:
        """All of ``candidates``."""
        return cls(**vars(candidates))


@dataclass(frozen=True, eq=False, kw_only=True)
class Tree(Message):
    """A generator's search tree, or whatever else it goes on with; it travels with the requests.

    ``parent`` has shape [nodes], with `NO_PARENT` for a root; the names of ``columns`` are the generator's own.
    """

    NAME: ClassVar[str] = "tree"
    MAX_BYTES: ClassVar[int] = 3072 << 10

    parent: Annotated[U32, Array("u32", "nodes", high=2**32 - 1, limit=16384)]
    columns: Annotated[dict[str, Annotated[F64, Array("f64", "*", limit=32768)]], {"limit": 8}]

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


@dataclass(frozen=True, eq=False, kw_only=True)
class GenerateRequest(Message):
    """Asks a generator for candidates within ``budget_ms``; ``iterations`` of 0 only warms it up for the map.

    The last chunk of the key it is asked on is the robot's name.
    """

    NAME: ClassVar[str] = "generate_request"
    MAX_BYTES: ClassVar[int] = 4096 << 10

    epoch: Uint
    seq: Uint
    budget_ms: Annotated[int, Integer(0, 10_000)]
    map: MapId
    goal_x: Number
    goal_y: Number
    scene: Scene
    tree: Tree | None = None
    seed: Uint
    iterations: Uint32
    generator: Name
    robot_model: RobotModel
    laser: LaserModel
    params: Params


@dataclass(frozen=True, eq=False, kw_only=True)
class GenerateReply(Message):
    """Candidates, and the tree to hand back with the next request; ``cut`` if the budget ended its growth."""

    NAME: ClassVar[str] = "generate_reply"
    MAX_BYTES: ClassVar[int] = 15360 << 10

    epoch: Uint
    seq: Uint
    instance: Name
    candidates: CandidateSet
    tree: Tree
    elapsed_us: Uint
    cut: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class EvaluateRequest(Message):
    """Asks an evaluator for the costs of a shard of the batch; without candidates it only warms it up for the map.

    The last chunk of the key it is asked on is the robot's name.
    """

    NAME: ClassVar[str] = "evaluate_request"
    MAX_BYTES: ClassVar[int] = 13312 << 10

    epoch: Uint
    seq: Uint
    shard: Uint32
    budget_ms: Annotated[int, Integer(0, 10_000)]
    map: MapId
    goal_x: Number
    goal_y: Number
    laser: LaserModel
    robot_model: RobotModel
    odometry_noise: OdometryNoise
    scene: Scene
    candidates: CandidateShard
    params: Params

    def all_columns(self, term: str) -> CandidateSet:
        """The candidates for a term that reads every column.

        Raises:
            DecodeError: A column is absent.
        """
        for name in ("heading", "v", "omega"):
            if getattr(self.candidates, name) is None:
                detail = f"is missing, and the term `{term}` reads it"
                raise DecodeError(self.NAME, f"candidates.{name}", {"code": "wrong_structure", "detail": detail})
        return CandidateSet(**vars(self.candidates))


@dataclass(frozen=True, eq=False, kw_only=True)
class Scores(Message):
    """Costs of a shard's candidates in their order, shape [candidates], in the term's unit; lower is better.

    ``slots`` is the number of shards that the replica computes at once.
    """

    NAME: ClassVar[str] = "scores"
    MAX_BYTES: ClassVar[int] = 64 << 10

    epoch: Uint
    seq: Uint
    shard: Uint32
    term: Name
    instance: Name
    cost: Annotated[F64, Array("f64", "candidates", limit=4096)]
    elapsed_us: Uint
    slots: Uint32
