"""Runs, worlds, planner, localiser and tracker in this process: no deployment, no network.

Everything is computed in Rust, by the code of the services. While it works, other threads of Python go on.

>>> import curionav
>>> curionav.run("quickstart").outcome                                      # doctest: +SKIP
'reached'
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import cbor2
import numpy as np
import yaml

from . import native, profiles
from .array import F64
from .errors import FileError, ScenarioError
from .field_types import Scope
from .injection import Playable, injection, scenario_of
from .messages import (
    Belief,
    CandidateSet,
    Decision,
    LaserModel,
    MissionOrder,
    OccupancyGrid,
    Odometry,
    OdometryNoise,
    People,
    RobotModel,
    RunResult,
    Scan,
)
from .record import Part
from .result import Result

if TYPE_CHECKING:
    from curionav_native import Observation

Map = OccupancyGrid | str | os.PathLike[str]
"""A map, or the file that describes one as map_server has it (``.yaml``)."""


def run(
    scenario: Playable,
    planner: profiles.Planner | None = None,
    seed: int = 1,
) -> Result:
    """Plays a scenario to its end in this process, in lockstep.

    The result is the one that ``deployment.inject(...).wait()`` gives, with the same ``decisions_sha256``. It has
    mission and map as well, so that `Result.plot` draws it.

    Args:
        scenario: A scenario, a scenario file, its tables, or the name of one of the package, such as ``quickstart``
            or ``dense/plaza-hrvo-02``.
        planner: Planner profile: the name of a built-in one, a profile file (``.toml``), or tables as in such a file.
            Default: the scenario's own. The scenario's ``[profile]`` changes it in any case.
        seed: Seed of everything random; equal seeds give equal decisions.

    Raises:
        Rejected: The scenario was refused, with the field and the reason.
        RunFailed: The run ended without a result: the goal cannot be reached on the map, the profile has a term that
            is not built in, or people come from another program.
        ScenarioError: A file that the scenario names is missing, or there is no such planner.
        MissingExtra: The package was installed without its extension module.
    """
    played = scenario_of(scenario)
    request = injection(played, planner, seed).encode()
    with native.errors(played.file) as module:
        result, order, grid = module.run(request)
    return replace(Result.of(RunResult.decode(result)), order=_order(order), grid=OccupancyGrid.decode(grid))


def load_map(path: str | os.PathLike[str]) -> OccupancyGrid:
    """A map from the file that describes it as map_server has it (``.yaml``), with the image beside it.

    Raises:
        FileError: A file cannot be read, or the description names no image.
        Rejected: They are no map, with the reason.
    """
    path = Path(path)
    description = _bytes(path)
    try:
        tables = yaml.safe_load(description.decode("utf-8-sig", "replace"))
    except yaml.YAMLError as error:
        raise FileError(path, f"is not YAML: {' '.join(str(error).split())}") from error
    image = tables.get("image") if isinstance(tables, dict) else None
    if not isinstance(image, str):
        raise FileError(path, "names no image; it needs a line such as `image: map.pgm`")
    with native.errors() as module:
        return OccupancyGrid.decode(module.read_map(description, _bytes(path.parent / PurePosixPath(image))))


class World:
    """The simulated world of a scenario, which is driven tick by tick: what a planner or a policy of one's own needs.

    >>> world = curionav.World("quickstart", seed=1)                        # doctest: +SKIP
    >>> seen = world.reset()                                                # doctest: +SKIP
    >>> seen = world.step(0.5, 0.1)                                         # doctest: +SKIP

    Attributes:
        map: The map that the robot is given.
        order: What the robot is given besides: goal, laser, outline and limits, noise of its odometry.
        time_limit: After so many seconds a run of the scenario is over.
    """

    def __init__(self, scenario: Playable, seed: int = 1) -> None:
        played = scenario_of(scenario)
        request = injection(played, None, seed).encode()
        with native.errors(played.file) as module:
            self._world = module.World(request)
        self.map = OccupancyGrid.decode(self._world.map)
        self.order = _order(self._world.order)
        self.time_limit: float = self._world.time_limit

    def reset(self, seed: int | None = None) -> Observation:
        """Back to the start; with another seed, if one is given, from now on."""
        with native.errors():
            seen: Observation = self._world.reset(seed)
        if seed is not None:
            self.order = _order(self._world.order)
        return seen

    def step(self, v: float, omega: float) -> Observation:
        """One tick, in which the base is told to drive so.

        Args:
            v: m/s; within what the base can do, whatever is told.
            omega: rad/s.
        """
        seen: Observation = self._world.step(v, omega)
        return seen

    def sense(self) -> tuple[Odometry, Scan, People | None]:
        """The newest observation as messages, such as `Localizer` and `PeopleTracker` take them.

        There are no people if the scenario has ``perception.source = "tracker"``.
        """
        with native.errors():
            odometry, scan, people = self._world.sense()
        told = None if people is None else People.decode(people)
        return Odometry.decode(odometry), Scan.decode(scan), told


@dataclass(frozen=True)
class Plan:
    """What a planner has decided, and from what.

    Attributes:
        decision: What to drive, and why.
        candidates: What could have been driven.
        costs: By each term that counts now: the raw cost of each candidate in the term's unit; NaN without one.
        total: Of shape [count]: what the planner compares; NaN of a candidate that a term did not score.
        uncertain: Whether the position counts as uncertain.
    """

    decision: Decision
    candidates: CandidateSet
    costs: dict[str, F64]
    total: F64
    uncertain: bool


class Planner:
    """A planner for one robot on one map. Trees and the last decision stay inside from one call to the next.

    Args:
        map: The map.
        profile: The name of a built-in profile, a profile file (``.toml``), or tables as in such a file.
        robot: Outline and limits; by default a disc of 0.3 m that drives 1 m/s.
        laser: What the robot localises itself with.
        odometry_noise: What its odometry misses.
        seed: Of what the planner samples.

    Raises:
        Rejected: A value is refused; the error names the field.
        ScenarioError: There is no such profile, or its file cannot be read.
    """

    def __init__(
        self,
        map: Map,  # noqa: A002 - what it is
        profile: profiles.Planner = profiles.DEFAULT,
        robot: RobotModel | None = None,
        *,
        laser: LaserModel | None = None,
        odometry_noise: OdometryNoise | None = None,
        seed: int = 0,
    ) -> None:
        made = native.table(profiles.complete(profile, Path(), "profile"))
        of_robot, of_laser = native.part(robot), native.part(laser)
        with native.errors() as module:
            self._planner = module.Planner(_map(map), made, of_robot, of_laser, native.part(odometry_noise), seed)

    def plan(
        self,
        belief: Belief,
        people: People,
        goal: tuple[float, float],
        *,
        goal_heading: float | None = None,
        obstacles: F64 | None = None,
        stamp: float | None = None,
    ) -> Plan:
        """Plans once.

        Args:
            belief: Where the robot believes to be.
            people: Who is around, in the frame that the message names.
            goal: x and y, m, map frame. Another goal than before forgets what was decided, and may take a second.
            goal_heading: With which heading to end, rad; ``None`` if any will do.
            obstacles: Of shape [n, 2]: places of what stands on the map that it does not have; ``None``: as before.
            stamp: Robot's clock, s; by default that of the belief. It must not fall.

        Raises:
            Rejected: The goal is in a wall.
        """
        now = belief.stamp if stamp is None else stamp
        places = None if obstacles is None else np.ascontiguousarray(obstacles, np.float64)
        with native.errors():
            decision, candidates, costs, total, uncertain = self._planner.plan(
                now, belief.encode(), people.encode(), (float(goal[0]), float(goal[1]), goal_heading), places
            )
        return Plan(Decision.decode(decision), CandidateSet.decode(candidates), costs, total, uncertain)

    def reset(self) -> None:
        """Forgets goal, trees, obstacles and what was decided."""
        self._planner.reset()


class Localizer:
    """Adaptive Monte Carlo localisation of one robot on one map.

    Args:
        map: The map.
        start: x, y and heading where the robot is at first, m and rad, map frame.
        covariance: Of shape [3, 3]: how well that is known; by default 0.5 m and 0.26 rad.
        laser: Its laser, by default one of 181 beams over half a turn that sees 5 m.
        odometry_noise: What its odometry misses.
        parameters: As in a scenario's table ``[localizer]``.
        seed: Of the particles.

    Raises:
        Rejected: A value is refused; the error names the field.
    """

    def __init__(
        self,
        map: Map,  # noqa: A002 - what it is
        start: tuple[float, float, float],
        covariance: F64 | None = None,
        *,
        laser: LaserModel | None = None,
        odometry_noise: OdometryNoise | None = None,
        parameters: Mapping[str, Any] | None = None,
        seed: int = 1,
    ) -> None:
        known = np.diag([0.25, 0.25, 0.0685]) if covariance is None else np.asarray(covariance, np.float64)
        if known.shape != (3, 3):
            raise ScenarioError("covariance", f"has the shape {known.shape}; give (3, 3)")
        pose = (float(start[0]), float(start[1]), float(start[2]))
        with native.errors() as module:
            self._localizer = module.Localizer(
                _map(map),
                native.part(laser),
                native.part(odometry_noise),
                native.table(parameters),
                (pose, known.ravel().tolist()),
                seed,
            )

    def update(self, odometry: Odometry, scan: Scan) -> Belief:
        """The belief after a scan of the same tick as the odometry.

        Raises:
            Rejected: The scan describes no scanner.
        """
        with native.errors():
            return Belief.decode(self._localizer.update(odometry.encode(), scan.encode()))


class PeopleTracker:
    """Finds people in the scans of one robot on one map, and follows them.

    Args:
        map: The map.
        odometry_noise: What the robot's odometry misses.
        parameters: As in a scenario's table ``[tracker]``.
        range_sigma: Standard deviation of a range, m.

    Raises:
        Rejected: A value is refused; the error names the field.
    """

    def __init__(
        self,
        map: Map,  # noqa: A002 - what it is
        *,
        odometry_noise: OdometryNoise | None = None,
        parameters: Mapping[str, Any] | None = None,
        range_sigma: float = 0.03,
    ) -> None:
        with native.errors() as module:
            self._tracker = module.PeopleTracker(
                _map(map), native.part(odometry_noise), native.table(parameters), range_sigma
            )

    def update(self, odometry: Odometry, scan: Scan, belief: Belief) -> People:
        """The people that a scan shows, in the frame of the robot, with those who are hidden now.

        Raises:
            Rejected: The scan describes no scanner.
        """
        with native.errors():
            return People.decode(self._tracker.update(odometry.encode(), scan.encode(), belief.encode()))


def _map(given: Map) -> bytes:
    return (given if isinstance(given, OccupancyGrid) else load_map(given)).encode()


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror}") from error


def _order(data: bytes) -> MissionOrder:
    order = Part(MissionOrder).take(cbor2.loads(data), Scope({}))
    assert isinstance(order, MissionOrder)
    return order
