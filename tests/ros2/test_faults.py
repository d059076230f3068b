"""Whatever is killed or hangs: what is left tells the robot to stand within half a second, or its base stops it."""

from __future__ import annotations

import itertools
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from geometry_msgs.msg import TwistStamped

from conftest import need
from rig import BRIDGE, PROGRAM, Rig, bridge, gateway_of, wait_for

need(BRIDGE, PROGRAM)

STOP_WITHIN = 0.5
"""s, from the fault to the first zero."""
CALM = 30
"""Commands before the fault by which the machine's own delays are known."""
PERIOD = 0.1
"""s between two commands."""


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    with ExitStack() as stack:
        rig = Rig.start(stack, tmp_path)
        rig.go()
        wait_for("some seconds of driving", lambda: len(rig.node.heard["/r1/cmd_vel"]) > CALM and rig.speed() > 0.2)
        yield rig


def is_zero(command: TwistStamped) -> bool:
    return bool(command.twist.linear.x == 0.0 and command.twist.angular.z == 0.0)


def delay(rig: Rig) -> float:
    """By how much this machine was late with a command lately, s."""
    times = [at for at, _ in rig.node.heard["/r1/cmd_vel"][-CALM:]]
    return max(0.0, max(b - a for a, b in itertools.pairwise(times)) - PERIOD)


def stops_after(rig: Rig, what: str, fault: Callable[[], None]) -> None:
    """The first zero comes within half a second of the fault and what the machine is late, and only zeros follow."""
    late, begin = delay(rig), time.monotonic()
    fault()
    zeros = lambda: [at for at, command in rig.node.since("/r1/cmd_vel", begin) if is_zero(command)]  # noqa: E731
    wait_for(f"zeros after {what}", lambda: len(zeros()) >= 5)
    first = zeros()[0]
    print(f"{what}: zero after {first - begin:.3f} s; the machine was late by {late:.3f} s")
    assert first - begin < STOP_WITHIN + late, what
    assert all(is_zero(command) for _, command in rig.node.since("/r1/cmd_vel", first)), what


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_robot_s_nodes(rig: Rig, number: int) -> None:
    stops_after(rig, f"{number!r} of the robot's nodes", lambda: rig.robot.send(number))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_driver(rig: Rig, number: int) -> None:
    driver = next(entry["pid"] for entry in rig.planner.ready["processes"] if entry["name"].startswith("driver"))
    stops_after(rig, f"{number!r} of the driver", lambda: os.kill(driver, number))
    wait_for("a stand", lambda: rig.speed() == 0.0)


def test_the_whole_planner(rig: Rig) -> None:
    stops_after(rig, "the end of the planner", rig.planner.kill)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_gateway(rig: Rig, number: int) -> None:
    rig.gateway.send(number)
    # Nothing is left that could send a zero: the base stops by itself.
    wait_for("a stand", lambda: rig.speed() == 0.0)
    if number == signal.SIGSTOP:
        begin = time.monotonic()
        rig.gateway.send(signal.SIGCONT)
        wait_for("commands", lambda: len(rig.node.since("/r1/cmd_vel", begin)) > 0)


def test_a_gateway_that_is_ended_says_zero_first(rig: Rig) -> None:
    begin = time.monotonic()
    assert rig.gateway.stop() == 0
    wait_for("a zero", lambda: any(is_zero(command) for _, command in rig.node.since("/r1/cmd_vel", begin)))
    assert is_zero(rig.node.newest("/r1/cmd_vel"))
    wait_for("a stand", lambda: rig.speed() == 0.0)
    # Another one takes over, but knows no better than its file where the robot is.
    rig.gateway = rig.stack.enter_context(gateway_of(rig.directory, "r1", rig.planner, rig.bridge))
    wait_for("the new gateway to take poses", lambda: rig.poses.get_subscription_count() > 0)
    rig.say_pose()
    rig.go()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_router_of_the_robot(rig: Rig, number: int) -> None:
    rig.bridge.send(number)
    wait_for("a stand", lambda: rig.speed() == 0.0)
    begin = time.monotonic()
    if number == signal.SIGSTOP:
        rig.bridge.send(signal.SIGCONT)
    else:
        endpoint = rig.bridge.ready["listening"][0]
        rig.bridge = rig.stack.enter_context(bridge(rig.directory, rig.domain, endpoint))
    wait_for("commands", lambda: len(rig.node.since("/r1/cmd_vel", begin)) > 0)
    rig.go()


def test_a_clock_that_is_set_back(rig: Rig) -> None:
    begin = time.monotonic()
    rig.robot.send(signal.SIGUSR1)
    # The run that the old clock belongs to has ended.
    wait_for("zeros", lambda: [1 for _, command in rig.node.since("/r1/cmd_vel", begin) if is_zero(command)][4:])
    wait_for("a stand", lambda: rig.speed() == 0.0)
    rig.say_pose()
    rig.go()
