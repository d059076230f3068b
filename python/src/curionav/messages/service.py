"""What services say about themselves and about requests they refuse (``schemas/service.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from ..kinds import Float, MapOf, Name, NonNegative, Number, Uint
from ..record import Message


@dataclass(frozen=True, eq=False, kw_only=True)
class ServiceStatus(Message):
    """Counts since the start.

    ``load`` is requests waiting or computed for each it can compute at once, ``warmed`` what it is prepared for,
    ``time_s`` seconds since 1970 by its own clock, ``metrics`` every sample of its metrics endpoint by name and labels.
    """

    NAME: ClassVar[str] = "service_status"
    MAX_BYTES: ClassVar[int] = 256 << 10

    role: Name
    instance: Name
    robot: Name | None = None
    version: str
    uptime_s: NonNegative
    time_s: Number | None = None
    load: NonNegative
    requests: Uint
    rejected: Uint
    p50_ms: NonNegative
    p99_ms: NonNegative
    warmed: list[str]
    metrics: Annotated[dict[str, float], MapOf(Float(), limit=512, free_keys=True)] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Reject(Message):
    """Why a request was refused; a ``code`` this version does not know means ``unknown``."""

    NAME: ClassVar[str] = "reject"
    MAX_BYTES: ClassVar[int] = 4 << 10

    reason: str
    field: str | None = None
    code: str
