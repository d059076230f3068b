"""What services say about themselves and about requests they refuse (``schemas/service.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, get_args

from ..field_types import (
    Boolean,
    Bytes,
    Coded,
    Float,
    Integer,
    ListOf,
    MapOf,
    Name,
    NonNegative,
    Number,
    OneOf,
    Text,
    Uint,
)
from ..record import Message, Part

MissionState = Literal["preparing", "running", "paused", "cancelled", "finished"]
"""Where a mission stands."""

_UINT, _FLOAT, _TEXT, _NAME = Integer(), Float(), Text(), Text(identifier=True)
_FAULT = OneOf(
    (
        "trailing_bytes",
        "too_many_items",
        "too_deep",
        "cut_short",
        "indefinite_length",
        "reserved_information",
        "unassigned_simple",
    )
)
_STATE = OneOf(get_args(MissionState))

Refusal = Annotated[
    dict[str, Any],
    Coded(
        {
            "oversize": {"found": _UINT, "most": _UINT},
            "wrong_encoding": {"found": _TEXT, "expected": _TEXT},
            "malformed": {"offset": _UINT, "fault": _FAULT},
            "wrong_structure": {"detail": _TEXT},
            "not_finite": {},
            "out_of_range": {"found": _FLOAT, "least": _FLOAT, "most": _FLOAT},
            "not_positive": {"found": _FLOAT},
            "wrong_length": {"found": _UINT, "expected": _UINT},
            "too_many": {"found": _UINT, "most": _UINT},
            "too_few": {"found": _UINT, "least": _UINT},
            "not_a_name": {"found": _TEXT},
            "unknown_name": {"found": _TEXT, "known": ListOf(_TEXT)},
            "no_such_index": {"found": _UINT},
            "cyclic_parents": {},
            "not_ascending": {},
            "wrong_frame": {},
            "not_a_map": {},
            "unsafe_path": {"found": _TEXT},
            "not_a_hash": {},
            "unexpected_payload": {},
            "wrong_robot": {},
            "unreachable_goal": {"x": _FLOAT, "y": _FLOAT},
            "wrong_map": {},
            "invalid": {"detail": _TEXT},
            "beyond_robot": {"found": _FLOAT, "least": _FLOAT, "most": _FLOAT},
            "realtime_only": {},
            "epoch_out_of_reach": {},
            "no_mission": {},
            "no_decision": {},
            "wrong_state": {"found": _STATE, "needed": _STATE},
            "already_finished": {},
            "stale_revision": {"found": _UINT, "current": _UINT},
            "pose_lost": {},
            "busy": {},
            "overloaded": {},
            "stopped": {},
            "cold": {"detail": _TEXT},
            "no_map": {"detail": _TEXT},
            "no_replica": {"term": _NAME, "may_come": Boolean(), "detail": _TEXT},
            "failed": {"detail": _TEXT},
            "unknown": {},
        },
        otherwise="unknown",
    ),
]
"""Why a request is refused: a ``code`` and its parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Reject(Message):
    """Why a request was refused, and the path of the ``field`` that it is about, if it is about one."""

    NAME: ClassVar[str] = "reject"
    MAX_BYTES: ClassVar[int] = 4 << 10

    field: str | None = None
    why: Refusal


_MAP = Bytes(32)

Prepared = Annotated[
    dict[str, Any],
    Coded(
        {
            "map": {"map": _MAP},
            "goal": {"map": _MAP, "x": _FLOAT, "y": _FLOAT},
            "sensor": {"map": _MAP, "beams": Integer(high=2**32 - 1), "fov": _FLOAT, "range_max": _FLOAT},
            "revision": {"revision": _UINT},
            "waiting": {"revision": _UINT, "reject": Part(Reject)},
        }
    ),
]
"""Something that a service is prepared for, or waits for: a ``code`` and its parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ServiceStatus(Message):
    """Counts since the start.

    ``load`` is the number of requests that wait or are computed, per request that it can compute at once. ``time_s``
    is in seconds since 1970 by its own clock, ``prepared`` what it is prepared for, ``metrics`` every sample of its
    metrics endpoint by name and labels.
    """

    NAME: ClassVar[str] = "service_status"
    MAX_BYTES: ClassVar[int] = 256 << 10

    role: Name
    instance: Name
    robot: Name | None = None
    version: str
    uptime_s: NonNegative
    time_s: Number
    load: NonNegative
    requests: Uint
    rejected: Uint
    p50_ms: NonNegative
    p99_ms: NonNegative
    prepared: list[Prepared]
    metrics: Annotated[dict[str, float], MapOf(Float(), limit=512, free_keys=True)] | None = None
