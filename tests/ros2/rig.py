"""Processes and a ROS node for tests of the gateway: bridge, planner, gateway and simulated robot, started and ended.

Every wait is for a condition. `PATIENCE` is how long one may take on a slow machine; nothing is slept for.
"""

from __future__ import annotations

import json
import math
import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from conftest import HERE, ROOT, TARGET
from robot_messages import quaternion

PATIENCE = 120.0
STOP_PATIENCE = 20.0
MISSION_PATIENCE = 400.0
"""The quickstart takes half a minute where the machine keeps up."""
GOAL = (11.0, 5.2)
TOLERANCE = 0.5
QUICKSTART = ROOT / "scenarios" / "quickstart.toml"
CYCLONE = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface address='127.0.0.1'/></Interfaces></General>"
    "</Domain></CycloneDDS>"
)
LIMITS = "[limits]\nv_max = 1.0\nomega_max = 1.0\na_max = 0.5\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1\n"
PROGRAM = Path(os.environ.get("CURIONAV_BIN", TARGET / "release" / "curionav"))
BRIDGE = Path(os.environ.get("CURIONAV_ROS2", TARGET / "ros2")) / "bridge" / "release" / "curionav-ros2-bridge"


def free_domain(*but: int) -> int:
    """A DDS domain whose first port nothing on this machine has; nodes find each other by fixed ports."""
    first = os.getpid() % 90
    for domain in [*range(first, 100), *range(1, first)]:
        if domain in but:
            continue
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", 7410 + 250 * domain))
            except OSError:
                continue
            return domain
    raise AssertionError("no free DDS domain")


def wait_for(what: str, condition: Callable[[], Any], patience: float = PATIENCE) -> Any:
    """The first value of `condition` that is true."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.01)
    raise AssertionError(f"in {patience:.0f} s this did not come true: {what}")


def insist(what: str, say: Callable[[], None], condition: Callable[[], Any]) -> None:
    """Says something each second until `condition` is true."""
    said = -math.inf

    def met() -> bool:
        nonlocal said
        if condition():
            return True
        if time.monotonic() - said > 1.0:
            said = time.monotonic()
            say()
        return False

    wait_for(what, met)


class Program:
    """A process that says on standard output, in lines of JSON, that it is ready and what became of it."""

    def __init__(self, name: str, *command: object, **variables: str) -> None:
        self.name = name
        self.process = subprocess.Popen(
            [str(part) for part in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, **variables}, start_new_session=True,
        )  # fmt: skip
        self.lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()
        self.ready = self.line(PATIENCE)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            # The bridge's log goes there too.
            (self.lines.put if line.startswith("{") else sys.stderr.write)(line)
        self.lines.put("")

    def line(self, patience: float = STOP_PATIENCE) -> dict[str, Any]:
        """What it says next."""
        try:
            said = self.lines.get(timeout=patience)
        except queue.Empty:
            said = ""
        if not said:
            self.kill()
        assert said, f"{self.name} said nothing, or ended"
        value: dict[str, Any] = json.loads(said)
        return value

    def send(self, number: int) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def _ends(self) -> bool:
        """Ends it as Ctrl-C does, or else by force; says whether it ended by itself."""
        if self.process.poll() is None:
            self.send(signal.SIGCONT)
            self.send(signal.SIGINT)
            try:
                self.process.wait(STOP_PATIENCE)
            except subprocess.TimeoutExpired:
                self.kill()
                return False
        return True

    def stop(self) -> int:
        """Ends it as Ctrl-C does; gives its exit status."""
        assert self._ends(), f"{self.name} did not end"
        return self.process.returncode

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._ends()


def bridge(directory: Path, domain: int, endpoint: str = "tcp/127.0.0.1:0") -> Program:
    """The router with Zenoh's plugin for DDS; it ends with its standard input, hence with the tests."""
    file = directory / "bridge.json5"
    file.write_text(
        json.dumps(
            {
                "mode": "router",
                "listen": {"endpoints": [endpoint]},
                "scouting": {"multicast": {"enabled": False}},
                "plugins": {"ros2dds": {"domain": domain, "ros_automatic_discovery_range": "LOCALHOST"}},
            }
        )
    )
    return Program("the bridge", BRIDGE, file, CYCLONEDDS_URI=CYCLONE, ROS_DISTRO="kilted")


def router() -> Program:
    """A plain router of Zenoh, which will do for a robot's `rmw_zenohd`."""
    return Program("the router", PROGRAM, "router", "--listen", "tcp/127.0.0.1:0")


def simulated_robot(domain: int, namespace: str, *options: str, scenario: Path = QUICKSTART) -> Program:
    arguments = (HERE / "simulated_robot.py", scenario, "--namespace", namespace, *options)
    return Program(f"the robot {namespace}", sys.executable, *arguments, ROS_DOMAIN_ID=str(domain))


def planner(directory: Path, robot: str, *, tracker: bool = False, port: int = 0) -> Program:
    """`curionav up` for a robot that is not simulated by it."""
    (directory / f"{robot}-driver.toml").write_text(LIMITS)
    file = directory / f"{robot}-deployment.toml"
    file.write_text(
        f'robot = "{robot}"\nport = {port}\ndriver_config = "{robot}-driver.toml"\n'
        f"[replicas]\nsimulator = 0\ntracker = {int(tracker)}\n"
    )
    return Program(f"the planner of {robot}", PROGRAM, "up", file)


def gateway(
    directory: Path, robot: str, planner: Program, router: str, *, namespace: str, **settings: object
) -> Program:
    """`curionav ros2-gateway` between a planner and a router of ROS; `settings` are fields of `[ros2]`.

    A setting that is a dict is a table of its own.
    """
    tables = {"": {"endpoint": router, "namespace": namespace, "people": "topic", **settings}}
    for name in [name for name, value in tables[""].items() if isinstance(value, dict)]:
        tables[f".{name}"] = tables[""].pop(name)  # type: ignore[assignment]
    text = f'robot = "{robot}"\nconnect = {json.dumps(planner.ready["endpoints"])}\n{LIMITS}'
    for name, table in tables.items():
        text += f"[ros2{name}]\n" + "".join(f"{field} = {json.dumps(value)}\n" for field, value in table.items())
    file = directory / f"{robot}-gateway.toml"
    file.write_text(text)
    return Program(f"the gateway of {robot}", PROGRAM, "ros2-gateway", "--config", file)


class Listener(Node):
    """A ROS node of the test, spun on a thread of its own, that keeps what it hears."""

    def __init__(self, name: str, context: Context) -> None:
        super().__init__(name, context=context)
        self.heard: dict[str, list[tuple[float, Any]]] = {}

    def listen(self, topic: str, of: Any, profile: Any = 10) -> None:
        """Keeps every message of a topic with the time at which it was heard, s of a steady clock."""
        self.heard[topic] = []
        heard = self.heard[topic]
        self.create_subscription(of, topic, lambda message: heard.append((time.monotonic(), message)), profile)

    def newest(self, topic: str) -> Any:
        """The newest message of a topic, or nothing."""
        heard = self.heard[topic]
        return heard[-1][1] if heard else None

    def since(self, topic: str, begin: float) -> list[tuple[float, Any]]:
        return [entry for entry in self.heard[topic] if entry[0] >= begin]


@contextmanager
def listening(domain: int, name: str = "listener") -> Iterator[Listener]:
    """A node of the test in a domain."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node, executor = Listener(name, context), SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield node
    finally:
        executor.shutdown()
        thread.join(STOP_PATIENCE)
        node.destroy_node()
        rclpy.try_shutdown(context=context)


@dataclass
class Rig:
    """A robot `/r1` of ROS 2 on Fast DDS, the bridge, a planner and the gateway between, in the quickstart's world."""

    stack: ExitStack
    directory: Path
    domain: int
    node: Listener
    planner: Program
    bridge: Program
    gateway: Program
    robot: Program
    goals: Any = None
    poses: Any = None

    @classmethod
    def start(cls, stack: ExitStack, directory: Path, *options: str) -> Self:
        """Starts everything; `options` are those of the robot."""
        domain = free_domain()
        node = stack.enter_context(listening(domain))
        node.listen("/r1/cmd_vel", TwistStamped)
        node.listen("/r1/truth", Odometry)
        node.listen("/r1/amcl_pose", PoseWithCovarianceStamped)
        planning = stack.enter_context(planner(directory, "r1"))
        router = stack.enter_context(bridge(directory, domain))
        gate = stack.enter_context(gateway_of(directory, "r1", planning, router))
        robot = stack.enter_context(simulated_robot(domain, "/r1", "--stamped", *options))
        wait_for("the robot", lambda: node.newest("/r1/truth"))
        rig = cls(stack, directory, domain, node, planning, router, gate, robot)
        rig.goals = node.create_publisher(PoseStamped, "/r1/goal_pose", 10)
        rig.poses = node.create_publisher(PoseWithCovarianceStamped, "/r1/initialpose", 10)
        wait_for("the gateway to take poses", lambda: rig.poses.get_subscription_count() > 0)
        wait_for("the gateway to take goals", lambda: rig.goals.get_subscription_count() > 0)
        return rig

    def position(self, robot: str = "/r1") -> tuple[float, float]:
        at = self.node.newest(f"{robot}/truth").pose.pose.position
        return at.x, at.y

    def way_to(self, goal: tuple[float, float], robot: str = "/r1") -> float:
        return math.dist(self.position(robot), goal)

    def speed(self, robot: str = "/r1") -> float:
        return float(self.node.newest(f"{robot}/truth").twist.twist.linear.x)

    def say_pose(self) -> None:
        """Says where the robot is, as a person does in rviz."""
        truth = self.node.newest("/r1/truth")
        said = PoseWithCovarianceStamped(header=truth.header)
        said.pose.pose = truth.pose.pose
        said.pose.covariance[0] = said.pose.covariance[7] = said.pose.covariance[35] = 0.05
        self.poses.publish(said)

    def go(self, goal: tuple[float, float] = GOAL) -> None:
        """Waits until the robot drives to a goal, which is said each second: until its place is known it is refused."""
        insist("motion", lambda: self.goals.publish(goal_pose(*goal)), lambda: self.speed() > 0.2)


def gateway_of(directory: Path, robot: str, planning: Program, router: Program) -> Program:
    """The gateway of a robot that starts where the quickstart's does."""
    mission = {"initial_pose": [1.0, 4.0, 0.0], "goal_tolerance": TOLERANCE}
    endpoint = router.ready["listening"][0]
    return gateway(directory, robot, planning, endpoint, namespace=f"/{robot}", dialect="ros2dds", mission=mission)


def goal_pose(x: float, y: float, frame: str = "map") -> PoseStamped:
    goal = PoseStamped()
    goal.header.frame_id = frame
    goal.pose.position.x, goal.pose.position.y, goal.pose.orientation = x, y, quaternion(0.0)
    return goal
