"""The lease that a base in Python grants: the same cases as in `crates/runtime/src/lease.rs`."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import pytest
import zenoh
from contract import golden

from curionav import BaseLease
from curionav.base import LEASE_S, Grants
from curionav.commands import command, pause
from curionav.errors import NoAnswer, Rejected
from curionav.messages import Cancel, Lease, LeaseRequest, Message, Mission, PauseReply, PauseRequest, Twist


def wish(driver: str, lease: int, what: Literal["hold", "take_over", "release"], paused: bool = False) -> LeaseRequest:
    return LeaseRequest(driver=driver, lease=lease, wish=what, paused=paused)


def held_by(holder: str) -> dict[str, str]:
    return {"code": "lease_held", "holder": holder}


def granted(grants: Grants, request: LeaseRequest, now: float) -> Lease:
    answer = grants.ask(request, now)
    assert isinstance(answer, Lease)
    return answer


def test_one_driver_has_it_and_another_is_told_who() -> None:
    grants = Grants(7)
    assert granted(grants, wish("a", 0, "hold"), 0.0).lease == 7
    for k in range(1, 50):
        assert granted(grants, wish("a", 7, "hold"), 0.2 * k).lease == 7
        assert grants.ask(wish("b", 0, "hold"), 0.2 * k) == held_by("a")
        assert grants.ask(wish("a", 0, "hold"), 0.2 * k) == held_by("a")


def test_a_driver_that_is_silent_loses_it_to_the_next_that_asks() -> None:
    grants = Grants(7)
    granted(grants, wish("a", 0, "hold"), 0.0)
    assert granted(grants, wish("a", 7, "hold"), 9 * LEASE_S).lease == 7
    assert granted(grants, wish("b", 0, "hold"), 10 * LEASE_S + 0.2).lease == 8
    assert grants.ask(wish("a", 7, "hold"), 10 * LEASE_S + 0.2) == held_by("b")


def test_a_take_over_waits_until_the_holder_has_gone() -> None:
    grants = Grants(7)
    granted(grants, wish("a", 0, "hold"), 0.0)
    assert grants.ask(wish("b", 0, "take_over"), 0.0) == held_by("a")
    assert granted(grants, wish("a", 7, "hold"), 0.2).wanted_by == "b"
    assert granted(grants, wish("a", 7, "release"), 0.2).lease == 0
    assert grants.ask(wish("c", 0, "hold"), 0.2) == held_by("b")
    assert granted(grants, wish("b", 0, "take_over"), 0.2).lease == 8


def test_a_base_that_was_restarted_learns_of_a_pause() -> None:
    grants = Grants(9)
    assert granted(grants, wish("a", 7, "hold", paused=True), 0.0).paused


@pytest.fixture
def session() -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def ask(session: zenoh.Session, key: str, question: Message) -> zenoh.Reply:
    return next(iter(session.get(key, payload=question.encode(), encoding=question.encoding())))


def test_a_base_grants_pauses_and_admits(session: zenoh.Session, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "curionav.base")
    lease = BaseLease(session, "r1")
    key = "curionav/@v1/robot/r1"
    reply = ask(session, f"{key}/lease/request/driver.r1.a", wish("a", 0, "hold"))
    assert reply.ok is not None
    number = Lease.decode(reply.ok.payload.to_bytes()).lease
    unnamed = ask(session, f"{key}/lease/request/*", wish("a", number, "release"))
    assert unnamed.err is not None and b"wrong_commander" in unnamed.err.payload.to_bytes()
    refused = ask(session, f"{key}/lease/request/driver.r1.b", wish("b", 0, "hold"))
    assert refused.ok is None and refused.err is not None
    twist = Twist.decode(golden("twist"))
    assert not lease.admits(twist) and lease.foreign == 1
    assert lease.admits(replace(twist, lease=number))
    # A driver that does not answer: the base obeys, and the client is told that this is not enough.
    with pytest.raises(NoAnswer, match="the driver that holds its lease"):
        pause(session, "r1", "operator", True, 0.5)
    assert lease.paused and "operator: pause" in caplog.text

    def obey(query: zenoh.Query) -> None:
        assert query.payload is not None
        paused = PauseRequest.decode(query.payload.to_bytes()).paused
        reply = PauseReply(role="driver", instance="a", lease=number, paused=paused)
        query.reply(query.key_expr, reply.encode(), encoding=reply.encoding())

    answered = session.declare_queryable(f"{key}/pause/*", obey)
    pause(session, "r1", "operator", False, 2.0)
    assert not lease.paused
    answered.undeclare()
    lease.close()
    session.close()


def test_a_command_counts_only_if_the_driver_that_holds_the_lease_obeys(session: zenoh.Session) -> None:
    lease = BaseLease(session, "r1")
    with pytest.raises(Rejected, match="not let this driver drive"):
        command(session, "r1", "operator", Cancel(), 1.0)
    ask(session, "curionav/@v1/robot/r1/lease/request/driver.r1.a", wish("a", 0, "hold"))
    mission = Mission.decode(golden("mission"))
    idle = session.declare_queryable(
        "curionav/@v1/robot/r1/mission/command/*",
        lambda query: query.reply(query.key_expr, mission.encode(), encoding=mission.encoding()),
    )
    began = time.monotonic()
    # That of another driver, which has the lease 17.
    with pytest.raises(NoAnswer):
        command(session, "r1", "operator", Cancel(), 1.0)
    assert time.monotonic() - began < 5.0
    idle.undeclare()
    lease.close()
    session.close()
