"""The extension module of the package: what `curionav.in_process` wraps. Messages cross as bytes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

class Refused(Exception):  # noqa: N818 - becomes an error of the package
    """Bytes of a `reject`."""

class Ended(Exception):  # noqa: N818
    """Bytes of the `run_status` of a run without a result."""

def run(request: bytes) -> tuple[bytes, bytes, bytes]: ...
def read_map(description: bytes, image: bytes) -> bytes: ...

class Observation:
    """What the sensors of a simulated robot say at one tick, and what really is.

    Attributes:
        tick: Ticks since the start.
        stamp: Robot's clock, s.
        ranges: Of shape [beams], m, in order of rising bearing; the greatest range where nothing was met, NaN from a
            beam that says nothing.
        odometry: x, y (m) and heading (rad) in the odometry's frame, which begins at the origin and drifts.
        twist: Measured speed and turn rate, m/s and rad/s.
        people_id: Of shape [people]: who is told of; steady over time.
        people: Of shape [people, 4]: x, y, vx and vy, map frame, m and m/s.
        person_radius: m.
        true_pose: x, y and heading where the robot really is, map frame. A planner is not told.
        true_twist: Its true speed and turn rate.
        person_clearance: From its edge to that of the nearest person, m; infinite without people.
        wall_clearance: From its edge to the nearest wall, m.
        collides: Whether it touches a person, or hits a wall in this tick.
    """

    tick: int
    stamp: float
    ranges: NDArray[np.float32]
    odometry: tuple[float, float, float]
    twist: tuple[float, float]
    people_id: NDArray[np.uint32]
    people: NDArray[np.float64]
    person_radius: float
    true_pose: tuple[float, float, float]
    true_twist: tuple[float, float]
    person_clearance: float
    wall_clearance: float
    collides: bool

class World:
    order: bytes
    map: bytes
    time_limit: float
    def __init__(self, request: bytes) -> None: ...
    def reset(self, seed: int | None = None) -> Observation: ...
    def step(self, v: float, omega: float) -> Observation: ...
    def sense(self) -> tuple[bytes, bytes, bytes | None]: ...

class Planner:
    def __init__(
        self,
        map: bytes,  # noqa: A002
        profile: bytes,
        robot: bytes | None,
        laser: bytes | None,
        noise: bytes | None,
        seed: int,
    ) -> None: ...
    def reset(self) -> None: ...
    def plan(
        self,
        stamp: float,
        belief: bytes,
        people: bytes,
        goal: tuple[float, float, float | None],
        obstacles: NDArray[np.float64] | None = None,
    ) -> tuple[bytes, bytes, dict[str, NDArray[np.float64]], NDArray[np.float64], bool]: ...

class Localizer:
    def __init__(
        self,
        map: bytes,  # noqa: A002
        laser: bytes | None,
        noise: bytes | None,
        parameters: bytes,
        start: tuple[tuple[float, float, float], list[float]],
        seed: int,
    ) -> None: ...
    def update(self, odometry: bytes, scan: bytes) -> bytes: ...

class PeopleTracker:
    def __init__(
        self,
        map: bytes,  # noqa: A002
        noise: bytes | None,
        parameters: bytes,
        range_sigma: float,
    ) -> None: ...
    def update(self, odometry: bytes, scan: bytes, belief: bytes) -> bytes: ...

class Worlds:
    def __init__(self, requests: list[bytes], localizes: bool, most_people: int) -> None: ...
    def advance(self, commands: NDArray[np.float64], seeds: list[int | None]) -> tuple[NDArray[Any], ...]: ...
    def restart(self, seeds: list[int | None]) -> tuple[NDArray[Any], ...]: ...
    def finish(self, world: int) -> bytes: ...
    def everyone(self, world: int) -> NDArray[np.float64]: ...
