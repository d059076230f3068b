"""Hostile bytes at the gateway, in the dialect of `rmw_zenoh`: `python fuzz.py --seconds 600 --seed 1`.

A legal robot drives meanwhile, a legal listener reads all that the gateway says, and an attacker with random payloads,
attachments, keys and tokens is at the same router. The gateway has to live, to count what it refuses, to say nothing
malformed, and to take a legal goal at the end as it did at the beginning.
"""

from __future__ import annotations

import argparse
import random
import struct
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import curionav
import zenoh
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav2_msgs.action import NavigateToPose
from rclpy.serialization import serialize_message

from random_messages import random_message, type_named
from rig import gateway, goal_pose, insist, planner, router, wait_for
from rmw_zenoh import RmwNode, name_of, open_session
from rmw_zenoh_robot import ACTION, IN, ListenerOfAll, driving
from robot_messages import Robot

CALLS: dict[str, type] = {
    f"{ACTION}/_action/send_goal": NavigateToPose.Impl.SendGoalService.Request,
    f"{ACTION}/_action/get_result": NavigateToPose.Impl.GetResultService.Request,
    f"{ACTION}/_action/cancel_goal": CancelGoal.Request,
}
ENDED_AS_IT_WAS = 130
"""Exit status of a program that had 1.5 s to end and did not."""
MUTATIONS = ("whole", "cut", "flip", "huge", "noise", "empty", "attachment", "foreign")


class Attacker:
    """Random payloads, attachments, keys and tokens."""

    def __init__(self, endpoint: str, key: Callable[[str, str], str], seed: int) -> None:
        self.session, self.key, self.random = open_session(endpoint), key, random.Random(seed)
        self.done: Counter[str] = Counter()
        self.tokens: list[Any] = []

    def message(self, of: type) -> bytes:
        return bytes(serialize_message(random_message(type_named(name_of(of)), self.random)))

    def mutated(self, of: type, how: str) -> bytes:
        rng, payload = self.random, bytearray(self.message(of))
        match how:
            case "cut":
                return bytes(payload[: rng.randrange(len(payload))])
            case "flip":
                for _ in range(rng.randint(1, 8)):
                    payload[rng.randrange(len(payload))] ^= 1 << rng.randrange(8)
            case "huge":
                at = 4 * rng.randrange(1, max(2, len(payload) // 4))
                payload[at : at + 4] = struct.pack("<I", rng.choice((2**32 - 1, 2**31, 10**7)))
            case "noise":
                return rng.randbytes(rng.randint(1, 300))
            case "empty":
                return b""
            case "foreign":
                return self.message(rng.choice((*IN.values(), *CALLS.values())))
        return bytes(payload)

    def attachment(self, how: str) -> bytes | None:
        rng = self.random
        if how != "attachment":
            gid = rng.randbytes(16)
            return struct.pack("<qqB", rng.randint(1, 2**40), time.time_ns(), 16) + gid
        numbers = rng.choice((0, -1, -(2**63), 2**63 - 1)), rng.choice((0, -(2**63), 2**63 - 1))
        return rng.choice(
            (
                None,
                b"",
                rng.randbytes(rng.choice((10, 32, 34, 77, 5000))),
                struct.pack("<qqB", *numbers, rng.choice((0, 15, 255))) + bytes(16),
                struct.pack("<qqB", *numbers, 16) + bytes(16),
            )
        )

    def token(self) -> None:
        rng = self.random
        part = lambda: "".join(rng.choice("abc%_0é~{}") for _ in range(rng.randint(1, 12)))  # noqa: E731
        chunks = [part() for _ in range(rng.randint(1, 14))]
        if rng.random() < 0.7:
            kind = rng.choice(("NN", "MP", "MS", "SS", "SC", "XX"))
            chunks = ["0", part(), "0", str(rng.randint(-1, 2**70)), kind, "%", "%r1", part(), *chunks]
        if rng.random() < 0.3:
            topic, of = rng.choice(("cmd_vel", "odom", "scan")), rng.choice(("Twist_", "X" * 2000, "é"))
            chunks = ["0", "f" * 8, "0", "1", "MP", "%", "%r1", "evil", f"%r1%{topic}", of, "RIHS01_0", "::,:,:,:,,"]
        self.tokens.append(self.session.liveliness().declare_token("/".join(["@ros2_lv", *chunks])))
        if len(self.tokens) > 200:
            self.tokens.pop(rng.randrange(200)).undeclare()

    def attack(self) -> None:
        """One hostile act."""
        rng, how = self.random, self.random.choice(MUTATIONS)
        self.done[how] += 1
        if rng.random() < 0.1:
            self.done["token"] += 1
            try:
                self.token()
            except zenoh.ZError:
                self.done["token that Zenoh itself refuses"] += 1
            return
        if rng.random() < 0.3:
            topic, of = rng.choice(list(CALLS.items()))
            # Nothing waits for the answer.
            self.session.get(self.key(topic, name_of(of)), lambda _: None, payload=self.mutated(of, how),
                             attachment=self.attachment(how), timeout=2.0)  # fmt: skip
            return
        topic, of = rng.choice(list(IN.items()))
        self.session.put(self.key(topic, name_of(of)), self.mutated(of, how), attachment=self.attachment(how))


def refused(endpoint: str) -> int:
    """How many messages of ROS the gateway has refused so far, as its metrics say."""
    with curionav.connect(endpoint) as deployment:
        gateways = [service for service in deployment.status() if service.role == "ros2-gateway"]
    assert len(gateways) == 1
    assert gateways[0].status is not None
    metrics = gateways[0].status.metrics or {}
    return int(sum(count for name, count in metrics.items() if name.startswith("curionav_ros2_refused_total")))


def fuzz(directory: Path, seconds: float, seed: int) -> Counter[str]:
    """Attacks for a while; says what was done and heard."""
    with ExitStack() as stack:
        planning = stack.enter_context(planner(directory, "r1"))
        endpoint = stack.enter_context(router()).ready["endpoints"][0]
        gate = stack.enter_context(
            gateway(directory, "r1", planning, endpoint, namespace="/r1", dialect="rmw_zenoh",
                    mission={"initial_pose": [1.0, 4.0, 0.0]})
        )  # fmt: skip
        node = stack.enter_context(RmwNode(endpoint, "legal", "/r1"))
        listener = ListenerOfAll(node)
        goals = node.publisher("/r1/goal_pose", PoseStamped)
        robot = stack.enter_context(driving(node))
        legal_goal(listener, goals, "before")
        attacker = Attacker(endpoint, node.key, seed)
        stack.callback(attacker.session.close)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for _ in range(20):
                attacker.attack()
            assert gate.process.poll() is None, f"seed {seed}: the gateway has ended with {gate.process.returncode}"
            assert not listener.malformed, f"seed {seed}: {listener.malformed[:3]}"
            time.sleep(0.02)
        # What legal messages of the attacker have changed is put right, as a person would.
        robot.repeat()
        node.publisher("/r1/initialpose", PoseWithCovarianceStamped)(here(robot.robot))
        legal_goal(listener, goals, "after")
        counted = refused(planning.ready["endpoints"][0])
        assert counted > 0
        # After tens of thousands of tokens Zenoh takes seconds to close a session; the program ends within two.
        status = gate.stop()
        assert status in (0, ENDED_AS_IT_WAS), f"seed {seed}: the gateway ended with {status}"
        assert not listener.malformed, f"seed {seed}: {listener.malformed[:3]}"
        return attacker.done + listener.heard + Counter({"refused by the gateway": counted})


def here(robot: Robot) -> PoseWithCovarianceStamped:
    """Where the robot is, as a person says it."""
    message = PoseWithCovarianceStamped(header=robot.header("map"))
    message.pose.pose = robot.truth().pose.pose
    message.pose.covariance[0] = message.pose.covariance[7] = message.pose.covariance[35] = 0.05
    return message


def legal_goal(listener: ListenerOfAll, goals: Callable[[Any], None], when: str) -> None:
    """A legal goal, said each second, makes the robot drive."""
    wait_for(f"a pose {when}", lambda: listener.newest.get("/r1/amcl_pose"))
    listener.newest.pop("/r1/cmd_vel", None)
    goal = goal_pose(9.0 if when == "before" else 3.0, 4.5)

    def drives() -> bool:
        command = listener.newest.get("/r1/cmd_vel")
        return command is not None and command.twist.linear.x > 0.1

    insist(f"motion {when}", lambda: goals(goal), drives)


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--seconds", type=float, default=600.0)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        for what, count in fuzz(Path(directory), options.seconds, options.seed).items():
            print(f"{count:8d}  {what}")


if __name__ == "__main__":
    main()
