"""Commands to a robot: they reach everything that claims to drive it, and succeed only if what does drive it obeys."""

from __future__ import annotations

import contextlib
import time

import zenoh

from . import keys
from .errors import NoAnswer, Rejected
from .messages import Lease, Mission, MissionCommand, PauseReply, PauseRequest
from .session import ask

UNPROVEN = "experimenter"
"""As what a program commands that shows no certificate."""
_DRIVER = "driver"
_AGAIN = 0.3
"""Between two attempts to pause, seconds."""


def lease_of(session: zenoh.Session, robot: str, timeout: float) -> Lease:
    """Which driver the base of ``robot`` obeys, as the base says."""
    return ask(session, keys.robot(robot, "lease"), Lease, None, timeout)


def command(session: zenoh.Session, robot: str, by: str, request: MissionCommand, timeout: float) -> Mission:
    """Gives a command of ``by`` to every driver of ``robot``; the mission of the driver that holds the lease.

    Raises:
        NoAnswer: No base of the robot answers, or the driver that holds its lease does not.
        Rejected: That driver refuses, or none holds the lease.
    """
    lease = lease_of(session, robot, timeout).lease
    if lease == 0:
        raise Rejected(None, {"code": "no_lease"})

    def is_of_holder(mission: Mission) -> bool:
        return mission.lease == lease

    return ask(session, keys.mission_command(robot, by), Mission, request, timeout, accept=is_of_holder)


def pause(session: zenoh.Session, robot: str, by: str, paused: bool, timeout: float) -> None:
    """Pauses ``robot`` for ``by``, or lets it go on, in whatever state its mission is.

    Raises:
        NoAnswer: Within ``timeout`` s its base has not obeyed, or the driver that holds its lease.
    """
    obeyed: dict[str, PauseReply] = {}

    def is_complete() -> bool:
        base = obeyed.get("base")
        return base is not None and (base.lease == 0 or str(base.lease) in obeyed)

    def note(reply: PauseReply) -> bool:
        if reply.paused == paused:
            obeyed["base" if reply.role != _DRIVER else str(reply.lease)] = reply
        return is_complete()

    key = keys.pause(robot, by)
    deadline = time.monotonic() + timeout
    while not is_complete():
        left = deadline - time.monotonic()
        if left <= 0.0:
            missing = "the driver that holds its lease" if "base" in obeyed else "a base"
            raise NoAnswer(f"robot {robot!r}: {missing} did not obey within {timeout:g} s")
        with contextlib.suppress(NoAnswer, Rejected):
            ask(session, key, PauseReply, PauseRequest(paused=paused), left, accept=note)
            continue
        time.sleep(min(_AGAIN, max(0.0, deadline - time.monotonic())))
