"""Hostile bytes at the gateway, in the dialect of `rmw_zenoh`: `python fuzz.py --seconds 600 --seed 1`.

A legal robot drives meanwhile, a legal listener reads all that the gateway says, and an attacker with random payloads,
attachments, keys and tokens is at the same router. The gateway has to live, to count what it refuses, to say nothing
malformed, and to take a legal goal at the end as it did at the beginning.
"""

from __future__ import annotations

import argparse
import math
import random
import struct
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import zenoh
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as RosPath
from people_msgs.msg import People
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from random_messages import random_message, type_named
from rig import PROGRAM, QUICKSTART, Program, gateway, goal_pose, planner, wait_for
from rmw_zenoh import RmwNode, name_of, open_session
from robot_messages import Robot
from world import World

ACTION = "/r1/navigate_to_pose"
GOAL_ID = bytes(range(16))
IN: dict[str, type] = {
    "/r1/scan": LaserScan,
    "/r1/odom": Odometry,
    "/r1/tf": TFMessage,
    "/r1/tf_static": TFMessage,
    "/r1/map": OccupancyGrid,
    "/r1/people": People,
    "/r1/goal_pose": PoseStamped,
    "/r1/initialpose": PoseWithCovarianceStamped,
}
CALLS: dict[str, type] = {
    f"{ACTION}/_action/send_goal": NavigateToPose.Impl.SendGoalService.Request,
    f"{ACTION}/_action/get_result": NavigateToPose.Impl.GetResultService.Request,
    f"{ACTION}/_action/cancel_goal": CancelGoal.Request,
}
OUT: dict[str, tuple[type, bool]] = {
    "/r1/cmd_vel": (TwistStamped, False),
    "/r1/amcl_pose": (PoseWithCovarianceStamped, False),
    "/r1/plan": (RosPath, True),
    "/r1/tf": (TFMessage, False),
    "/r1/curionav/candidates": (MarkerArray, False),
    "/r1/curionav/crowd": (MarkerArray, False),
    "/diagnostics": (DiagnosticArray, False),
    f"{ACTION}/_action/feedback": (NavigateToPose.Impl.FeedbackMessage, False),
    f"{ACTION}/_action/status": (GoalStatusArray, True),
}
MUTATIONS = ("whole", "cut", "flip", "huge", "noise", "empty", "attachment", "foreign")


class ListenerOfAll:
    """Reads all that the gateway says as a real node would, which a malformed message would end."""

    def __init__(self, node: RmwNode, reader: Callable[[str, bytes], None]) -> None:
        self.heard: Counter[str] = Counter()
        self.malformed: list[str] = []
        self.newest: dict[str, Any] = {}
        self.numbers: dict[str, int] = {}
        self.zid = ""
        for topic, (of, latched) in OUT.items():
            name = name_of(of)
            node.subscribe_raw(topic, name, self._reads(topic, of, name, reader), latched)

    def _reads(self, topic: str, of: type, name: str, reader: Callable[[str, bytes], None]) -> Callable[[Any], None]:
        def read(sample: zenoh.Sample) -> None:
            try:
                attached = bytes(sample.attachment) if sample.attachment is not None else b""
                if attached[17:] in HOSTILE:
                    return
                assert len(attached) == 33, f"an attachment of {len(attached)} bytes"
                number, _, size = struct.unpack_from("<qqB", attached)
                assert size == 16 and number > 0, attached.hex()
                assert number > self.numbers.get(topic, 0), "a number that does not rise"
                self.numbers[topic] = number
                payload = bytes(sample.payload)
                # rosbags raises where rclpy may end the process.
                reader(name, payload)
                message = deserialize_message(payload, of)
                if isinstance(message, TwistStamped):
                    v, omega = message.twist.linear.x, message.twist.angular.z
                    assert math.isfinite(v) and math.isfinite(omega), f"{v} {omega}"
                    assert 0.0 <= v <= 1.0 + 1e-9 and abs(omega) <= 1.0 + 1e-9, f"{v} {omega}"
                self.newest[topic] = message
                self.heard[topic] += 1
            except Exception as error:
                self.malformed.append(f"{topic}: {error!r}: {bytes(sample.payload)[:60].hex()}")

        return read


HOSTILE: set[bytes] = set()
"""The gids with which the attacker publishes where the gateway does: what it says there is not the gateway's."""


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
        attached = self.attachment(how)
        if attached is not None:
            HOSTILE.add(attached[17:])
        self.session.put(self.key(topic, name_of(of)), self.mutated(of, how), attachment=attached)


def reader() -> Callable[[str, bytes], None]:
    """Raises at what is no message of a type, and at bytes behind it."""
    from test_cdr import STORE, in_rosbags  # noqa: PLC0415 - needs the codec, which only tests have

    def read(name: str, payload: bytes) -> None:
        again = bytes(STORE.serialize_cdr(STORE.deserialize_cdr(payload, in_rosbags(name)), in_rosbags(name)))
        assert len(again) == len(payload), f"{len(payload) - len(again)} bytes too many"

    return read


def refused(endpoint: str) -> int:
    """How much the gateway has refused so far, as the status of the services tells."""
    import curionav  # noqa: PLC0415

    with curionav.connect(endpoint) as deployment:
        return sum(service.rejected for service in deployment.status() if service.role == "ros2-gateway")


def fuzz(directory: Path, seconds: float, seed: int) -> Counter[str]:
    """Attacks for a while; says what was done and heard."""
    with ExitStack() as stack:
        planning = stack.enter_context(planner(directory, "r1"))
        # Any Zenoh router will do for a robot's `rmw_zenohd`.
        router = stack.enter_context(Program("the router", PROGRAM, "router", "--listen", "tcp/127.0.0.1:0"))
        endpoint = router.ready["endpoints"][0]
        gate = stack.enter_context(
            gateway(directory, "r1", planning, endpoint, namespace="/r1", dialect="rmw_zenoh",
                    mission={"initial_pose": [1.0, 4.0, 0.0]})
        )  # fmt: skip
        node = stack.enter_context(RmwNode(endpoint, "legal", "/r1"))
        listener = ListenerOfAll(node, reader())
        goals = node.publisher("/r1/goal_pose", PoseStamped)
        drive(stack, node)
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
        legal_goal(listener, goals, "after")
        counted = refused(planning.ready["endpoints"][0])
        assert counted > 0
        assert gate.stop() == 0
        assert not listener.malformed, f"seed {seed}: {listener.malformed[:3]}"
        return attacker.done + listener.heard + Counter({"refused by the gateway": counted})


def drive(stack: ExitStack, node: RmwNode) -> Robot:
    """A legal robot on a thread of its own."""
    robot, over = Robot(World(QUICKSTART, 1)), threading.Event()
    says = {
        topic: (node.publisher(topic, IN[topic]), of)
        for topic, of in {
            "/r1/tf": robot.tf, "/r1/odom": robot.odometry, "/r1/scan": robot.scan, "/r1/people": robot.people,
        }.items()
    }  # fmt: skip
    for topic, of in {"/r1/tf_static": robot.tf_static, "/r1/map": robot.map}.items():
        node.publisher(topic, IN[topic], latched=True)(of())
    node.subscribe("/r1/cmd_vel", TwistStamped, lambda m: robot.obey(m.twist.linear.x, m.twist.angular.z))

    def play() -> None:
        while not over.wait(0.1):
            robot.play()
            for publish, of in says.values():
                publish(of())

    thread = threading.Thread(target=play, daemon=True)
    thread.start()
    stack.callback(thread.join)
    stack.callback(over.set)
    return robot


def legal_goal(listener: ListenerOfAll, goals: Callable[[Any], None], when: str) -> None:
    """A legal goal makes the robot drive."""
    wait_for(f"a pose {when}", lambda: listener.newest.get("/r1/amcl_pose"))
    end = time.monotonic() + 60.0

    def drives() -> bool:
        goals(goal_pose(9.0 if when == "before" else 3.0, 4.5))
        return bool(listener.newest["/r1/cmd_vel"].twist.linear.x > 0.1) or time.monotonic() > end

    wait_for(f"motion {when}", drives)


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
