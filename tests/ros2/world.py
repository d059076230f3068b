"""A small simulated world in NumPy, independent of curionav's own simulator: a base, a laser and walkers.

It reads a scenario file of curionav. Lengths are metres, angles radians, times seconds; poses are `[x, y, heading]`.
The walkers go back and forth on their routes and wait while the robot is in their way.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

Array = NDArray[np.float64]
RAY_STEP = 0.5
"""A ray is looked at every half cell."""


def moved(pose: Array, by: Array) -> Array:
    """The pose that `by` has in the frame in which `pose` is: `pose` then `by`."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.array([pose[0] + c * by[0] - s * by[1], pose[1] + s * by[0] + c * by[1], pose[2] + by[2]])


@dataclass
class Grid:
    """A map: cells of 0 (free), 100 (occupied), -1 (unknown), the first row is the southernmost."""

    cells: NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]

    @classmethod
    def load(cls, description: Path) -> Grid:
        """Reads a `map_server` YAML file with a binary PGM."""
        about = yaml.safe_load(description.read_text())
        magic, size, _, pixels = (description.parent / about["image"]).read_bytes().split(b"\n", 3)
        assert magic == b"P5", description
        width, height = map(int, size.split())
        image = np.frombuffer(pixels, np.uint8, width * height).reshape(height, width)[::-1]
        occupancy = (255 - image.astype(np.float64)) / 255
        cells = np.full(image.shape, -1, np.int8)
        cells[occupancy > about["occupied_thresh"]] = 100
        cells[occupancy < about["free_thresh"]] = 0
        return cls(cells, about["resolution"], (about["origin"][0], about["origin"][1]))

    def is_wall(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether the cells at these points are occupied; outside nothing is."""
        column = np.floor((x - self.origin[0]) / self.resolution).astype(int)
        row = np.floor((y - self.origin[1]) / self.resolution).astype(int)
        height, width = self.cells.shape
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        cells = self.cells[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        return inside & (cells == 100)


@dataclass
class Walker:
    """A person who goes back and forth on a route."""

    route: Array
    speed: float
    pause_s: float
    walked: float
    forth: bool = True
    resting: float = 0.0
    velocity: Array = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        self.reached = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.route, axis=0), axis=1))])

    def position(self, walked: float | None = None) -> Array:
        at = self.walked if walked is None else walked
        return np.array([np.interp(at, self.reached, self.route[:, axis]) for axis in (0, 1)])

    def step(self, dt: float, robot: Array, keep_off: float) -> None:
        here = self.position()
        self.velocity = np.zeros(2)
        if self.resting > 0.0:
            self.resting -= dt
            return
        ahead = self.walked + (dt if self.forth else -dt) * self.speed
        there = self.position(ahead)
        if float(np.dot(there - here, robot - here)) > 0.0 and np.linalg.norm(there - robot) < keep_off:
            return
        self.velocity = (there - here) / dt
        self.walked = float(np.clip(ahead, 0.0, self.reached[-1]))
        if self.walked != ahead:
            self.forth = not self.forth
            self.resting = self.pause_s


@dataclass
class Measures:
    """What became of the robot so far."""

    way: float = 0.0
    nearest_person: float = math.inf
    touched_walls: int = 0
    touched_people: int = 0


class World:
    """The scenario in `file`, played by `step`. `mount` is the laser's pose on the robot."""

    def __init__(self, file: Path, seed: int, mount: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        about: dict[str, Any] = tomllib.loads(file.read_text())
        self.grid = Grid.load(file.parent / about["map"]["file"])
        robot, self.laser, noise = about["robot"], about["laser"], about["odometry_noise"]
        self.start = np.array(robot["start"], float)
        self.goal = np.array(robot["goal"], float)
        self.model = robot["model"]
        self.radius = self.model["footprint"]["radius"]
        self.person_radius = about["people"]["radius"]
        self.mount = np.array(mount, float)
        self.walkers = [
            Walker(np.array(one["route"], float), one["speed"], one["pause_s"], one["start_offset"])
            for one in about.get("walkers", [])
        ]
        self.noise = noise
        self.random = np.random.default_rng(seed)
        self.pose = self.start.copy()
        self.odometry = np.zeros(3)
        self.v = self.omega = 0.0
        self.measures = Measures()

    def step(self, dt: float, v: float, omega: float) -> None:
        """`dt` seconds pass, in which the base goes for the speeds `v` and `omega`."""
        model = self.model
        self.v += float(np.clip(np.clip(v, 0.0, model["v_max"]) - self.v, -model["a_max"] * dt, model["a_max"] * dt))
        turn = model["alpha_max"] * dt
        self.omega += float(np.clip(np.clip(omega, -model["omega_max"], model["omega_max"]) - self.omega, -turn, turn))
        way, angle = self.v * dt, self.omega * dt
        by = np.array([way * math.cos(angle / 2), way * math.sin(angle / 2), angle])
        there = moved(self.pose, by)
        around = np.linspace(0.0, 2 * math.pi, 24, endpoint=False)
        if self.grid.is_wall(there[0] + self.radius * np.cos(around), there[1] + self.radius * np.sin(around)).any():
            self.measures.touched_walls += 1
            self.v = self.omega = way = angle = 0.0
            by = np.zeros(3)
        self.pose = moved(self.pose, by)
        self.measures.way += way
        for walker in self.walkers:
            walker.step(dt, self.pose[:2], self.radius + self.person_radius + 0.1)
            away = float(np.linalg.norm(walker.position() - self.pose[:2]))
            self.measures.nearest_person = min(self.measures.nearest_person, away)
            self.measures.touched_people += away < self.radius + self.person_radius
        # Variances grow with the way and the turn.
        metres, radians = abs(way), abs(angle)
        position = self.noise["position_per_metre"] * metres + self.noise["position_per_radian"] * radians
        heading = self.noise["heading_per_metre"] * metres + self.noise["heading_per_radian"] * radians
        drift = self.random.normal(0.0, 1.0, 3) * np.sqrt([position, position, heading])
        self.odometry = moved(self.odometry, by + drift)

    def scan(self) -> Array:
        """What the laser measures: `inf` where there is nothing within its range."""
        laser, eye = self.laser, moved(self.pose, self.mount)
        angles = eye[2] + np.linspace(-laser["fov"] / 2, laser["fov"] / 2, laser["beams"])
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        lengths = np.arange(0.0, laser["range_max"], RAY_STEP * self.grid.resolution)
        hit = self.grid.is_wall(
            eye[0] + directions[:, :1] * lengths[None, :], eye[1] + directions[:, 1:] * lengths[None, :]
        )
        ranges = np.where(hit.any(axis=1), lengths[hit.argmax(axis=1)], math.inf)
        for walker in self.walkers:
            to = walker.position() - eye[:2]
            along = directions @ to
            aside = np.abs(directions[:, 0] * to[1] - directions[:, 1] * to[0])
            touched = (along > 0.0) & (aside < self.person_radius)
            near = along - np.sqrt(np.maximum(self.person_radius**2 - aside**2, 0.0))
            ranges = np.where(touched & (near < ranges), np.maximum(near, 0.0), ranges)
        ranges = ranges + self.random.normal(0.0, laser["range_sigma"], len(ranges))
        return np.where(ranges < laser["range_max"], np.maximum(ranges, 0.02), math.inf)
