"""What services say about themselves and about requests they refuse (``schemas/service.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..kinds import Name, NonNegative, Uint
from ..record import Message


@dataclass(frozen=True, eq=False, kw_only=True)
class ServiceStatus(Message):
    """Counts since the start; ``load`` is the share of capacity in use, ``warmed`` the hashes of maps prepared for."""

    NAME: ClassVar[str] = "service_status"
    MAX_BYTES: ClassVar[int] = 128 << 10

    role: Name
    instance: Name
    version: str
    uptime_s: NonNegative
    load: NonNegative
    requests: Uint
    rejected: Uint
    p50_ms: NonNegative
    p99_ms: NonNegative
    warmed: list[str]


@dataclass(frozen=True, eq=False, kw_only=True)
class Reject(Message):
    """Why a request was refused; a ``code`` this version does not know means ``unknown``."""

    NAME: ClassVar[str] = "reject"
    MAX_BYTES: ClassVar[int] = 4 << 10

    reason: str
    field: str | None = None
    code: str
