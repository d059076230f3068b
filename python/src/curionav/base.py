"""What the base of a robot has to say: which driver it obeys, and whether it is paused."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import zenoh

from . import keys
from .errors import CurionavError, DecodeError
from .messages import Lease, LeaseRequest, Message, PauseReply, PauseRequest, Refusal, Reject, Twist

LEASE_S = 1.0
"""A driver that has not repeated its wish for so long may lose the lease, seconds."""

_log = logging.getLogger(__name__)

Q = TypeVar("Q", bound=Message)


@dataclass(frozen=True)
class _Held:
    driver: str
    lease: int
    heard: float


class Grants:
    """The grants of one base; time is an argument, seconds of a clock that nothing sets."""

    def __init__(self, first: int) -> None:
        self._next = first
        self._held: _Held | None = None
        self._wanted_by: tuple[str, float] | None = None
        self.paused = False

    def ask(self, request: LeaseRequest, now: float) -> Lease | Refusal:
        """What becomes of a driver's wish: the lease as it is then, or why the wish is refused."""
        if self._wanted_by is not None and now - self._wanted_by[1] > LEASE_S:
            self._wanted_by = None
        held = self._held
        if held is not None and (held.driver, held.lease) == (request.driver, request.lease):
            self._held = None if request.wish == "release" else _Held(held.driver, held.lease, now)
            return self.state()
        if request.wish == "release":
            return {"code": "no_lease"}
        if held is not None and now - held.heard <= LEASE_S:
            if request.wish == "take_over":
                self._wanted_by = (request.driver, now)
            return {"code": "lease_held", "holder": held.driver}
        if self._wanted_by is not None and self._wanted_by[0] != request.driver:
            return {"code": "lease_held", "holder": self._wanted_by[0]}
        self._wanted_by = None
        self._held = _Held(request.driver, self._next, now)
        self._next += 1
        self.paused = self.paused or request.paused
        return self.state()

    def state(self) -> Lease:
        """How the lease stands."""
        held = self._held
        return Lease(
            lease=0 if held is None else held.lease,
            holder=None if held is None else held.driver,
            wanted_by=None if self._wanted_by is None else self._wanted_by[0],
            paused=self.paused,
        )


class BaseLease:
    """Serves the lease of one robot for a program that drives its motors.

    Who pauses the robot or takes it over is logged by ``curionav.base`` at the level ``INFO``. Where the router has
    access rules, the name is that of a certificate, and else what a program says it is.

    Obey a command only if `admits` says so, and brake while `paused`.

    Example:
        >>> lease = BaseLease(session, "r1")  # doctest: +SKIP
        >>> if lease.admits(command) and not lease.paused:  # doctest: +SKIP
        ...     drive(command.v, command.omega)
    """

    def __init__(self, session: zenoh.Session, robot: str, instance: str = "base") -> None:
        self._grants = Grants(time.time_ns() // 1_000_000)
        self._lock = threading.Lock()
        self._instance = instance
        self._foreign = 0
        served = {
            keys.robot(robot, "lease"): self._state,
            f"{keys.robot(robot, 'lease')}/request/*": self._serving(LeaseRequest, self._ask),
            f"{keys.robot(robot, 'pause')}/*": self._serving(PauseRequest, self._pause),
        }
        self._queryables = [session.declare_queryable(key, callback, complete=True) for key, callback in served.items()]

    @property
    def paused(self) -> bool:
        """Whether the robot has to stand."""
        with self._lock:
            return self._grants.paused

    @property
    def foreign(self) -> int:
        """Commands of drivers that do not hold the lease."""
        return self._foreign

    def lease(self) -> Lease:
        """How the lease stands."""
        with self._lock:
            return self._grants.state()

    def admits(self, command: Twist) -> bool:
        """Whether the base obeys this command: it is of the driver that holds the lease."""
        number = self.lease().lease
        admitted = number != 0 and command.lease == number
        self._foreign += not admitted
        return admitted

    def close(self) -> None:
        """Serves nothing any more."""
        while self._queryables:
            self._queryables.pop().undeclare()

    def _serving(self, question: type[Q], handler: Callable[[Q, str], Message]) -> Callable[[zenoh.Query], None]:
        def serve(query: zenoh.Query) -> None:
            by = keys.commander(str(query.key_expr))
            if by is None:
                _reply(query, Reject(why={"code": "wrong_commander"}))
                return
            payload = query.payload
            if payload is None or len(payload) > question.MAX_BYTES:
                _reply(query, Reject(why={"code": "wrong_structure", "detail": f"give a {question.NAME}"}))
                return
            try:
                asked = question.decode(payload.to_bytes())
            except DecodeError as error:
                _reply(query, Reject(why={"code": "wrong_structure", "detail": str(error)}))
                return
            _reply(query, handler(asked, by))

        return serve

    def _state(self, query: zenoh.Query) -> None:
        _reply(query, self.lease())

    def _ask(self, request: LeaseRequest, by: str) -> Message:
        if request.wish != "hold":
            _log.info("%s: driver %s: %s", by, request.driver, request.wish)
        with self._lock:
            granted = self._grants.ask(request, time.monotonic())
        return granted if isinstance(granted, Lease) else Reject(why=granted)

    def _pause(self, request: PauseRequest, by: str) -> Message:
        _log.info("%s: %s", by, "pause" if request.paused else "go on")
        with self._lock:
            self._grants.paused = request.paused
            lease = self._grants.state().lease
        return PauseReply(role="base", instance=self._instance, lease=lease, paused=request.paused)


def _reply(query: zenoh.Query, message: Message) -> None:
    try:
        if isinstance(message, Reject):
            query.reply_err(message.encode(), encoding=message.encoding())
        else:
            query.reply(query.key_expr, message.encode(), encoding=message.encoding())
    except (zenoh.ZError, CurionavError) as error:
        _log.debug("reply not sent: %s", error)
