"""Planners written in Python: what the robot knows in, what it is to do out.

`planner` makes one of a function, a class or an object. ``curionav bench --planners mine.py:policy`` compares it with
the built-in ones, ``curionav run --planner mine.py:policy`` plays one scenario, and `serve_planner` lets robots of a
deployment ask it. ``curionav.planner_host`` is what runs it.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from . import keys
from .array import F64
from .errors import PlannerError

Check = Literal["arbiter", "driver"]
"""What checks what a planner proposes, as in `planner`."""

_CELLS = {".": 0, "#": 100, "?": -1}


@dataclass(frozen=True, eq=False)
class Limits:
    """What the base can do: m/s, m/s^2, rad/s, rad/s^2. Backwards it drives no faster than ``v_reverse``, often 0."""

    v_max: float
    v_reverse: float
    a_max: float
    omega_max: float
    alpha_max: float


@dataclass(frozen=True, eq=False)
class Footprint:
    """The robot's outline: a disc of ``radius`` metres, or a polygon within it.

    Attributes:
        radius: Of the disc around the centre of rotation, metres.
        vertices: Of a polygon in the robot's frame, metres, counter-clockwise, shape [vertices, 2]; None for a disc.
    """

    radius: float
    vertices: F64 | None


@dataclass(frozen=True, eq=False)
class Map:
    """The map that the robot is given.

    Attributes:
        sha256: Names its content: the same map has the same name in every run.
        resolution: Side of a cell, metres.
        origin: Pose of the lower left corner in the map frame: x, y (metres) and heading (radians).
        shape: Rows and columns.
        cells: Shape [rows, columns], the lowest row first: 0 free, 100 occupied, -1 unknown. None unless the planner
            was made with ``map=True``.
    """

    sha256: str
    resolution: float
    origin: tuple[float, float, float]
    shape: tuple[int, int]
    cells: np.ndarray[tuple[int, int], np.dtype[np.int8]] | None


@dataclass(frozen=True, eq=False)
class Task:
    """What stays the same for a run.

    Attributes:
        robot: Whose it is.
        seed: Of everything random. The modules `random` and `numpy.random` are seeded with it already.
        goal: Where to go, map frame, metres.
        limits: What the base can do. Speed zones of a map may make the robot slower.
        footprint: How large it is.
        steps: The most poses of a trajectory.
        dt: Seconds from one of these poses to the next.
        map: What is known of the place.
    """

    robot: str
    seed: int
    goal: tuple[float, float]
    limits: Limits
    footprint: Footprint
    steps: int
    dt: float
    map: Map


@dataclass(frozen=True, eq=False)
class Belief:
    """Where the robot believes it is.

    Attributes:
        x: Metres, map frame.
        y: Metres, map frame.
        heading: Radians, counter-clockwise from x.
        v: Measured speed ahead, m/s.
        omega: Measured turn rate, rad/s.
        covariance: Of (x, y, heading), shape [3, 3].
        uncertain: Whether the position counts as uncertain.
    """

    x: float
    y: float
    heading: float
    v: float
    omega: float
    covariance: F64
    uncertain: bool


@dataclass(frozen=True, eq=False)
class KnownPeople:
    """The people near the robot, map frame.

    Attributes:
        radius: Of a person, metres.
        id: Steady over time, shape [people].
        xy: Where they are, metres, shape [people, 2].
        velocity: How they walk, m/s, shape [people, 2].
    """

    radius: float
    id: np.ndarray[tuple[int], np.dtype[np.int64]]
    xy: F64
    velocity: F64


@dataclass(frozen=True, eq=False)
class KnownScan:
    """The newest scan of the laser.

    Attributes:
        time: When it was taken, seconds of the robot's clock.
        angles: Of the beams in the laser's frame, radians, shape [beams].
        ranges: Metres, shape [beams]; ``range_max`` where a beam met nothing, NaN where it failed.
        range_max: Metres.
        laser: The laser in the robot's frame: x, y (metres) and heading (radians).
    """

    time: float
    angles: F64
    ranges: F64
    range_max: float
    laser: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Situation:
    """What is known in a cycle.

    Attributes:
        time: Seconds of the robot's clock.
        belief: Where the robot believes it is, and how it moves.
        people: Who is near.
        goal: Where to go, map frame, metres.
        way: The shortest way to it from the robot on, past all that is known to stand still: a point every 0.25 m for
            5 m, shape [points, 2]. Empty if there is none.
        to_go: The length of that way to the goal, metres; None if there is none.
        obstacles: Centres of squares on which something stands that is on no map, metres, shape [squares, 2].
        obstacle_side: The side of these squares, metres.
        scan: The newest scan; None unless the planner was made with ``scan=True``.
        task: What stays the same for the run.
    """

    time: float
    belief: Belief
    people: KnownPeople
    goal: tuple[float, float]
    way: F64
    to_go: float | None
    obstacles: F64
    obstacle_side: float
    scan: KnownScan | None
    task: Task


@dataclass(frozen=True)
class Drive:
    """To drive at ``v`` m/s and ``omega`` rad/s for ``seconds``, and then to brake."""

    v: float
    omega: float
    seconds: float = 0.6


Answer = Drive | Sequence[float] | F64
"""One thing to do: a `Drive`, ``(v, omega)``, or poses of shape [states, 3], one every ``task.dt`` seconds."""


class OwnPlanner:
    """A planner with its name and settings; made by `planner`. Calling it calls what it was made of.

    Attributes:
        name: In results.
        check: What checks what it proposes.
    """

    def __init__(self, made_of: Any, settings: Mapping[str, Any]) -> None:
        self.name: str = settings["name"]
        self.check: Check = settings["check"]
        self._settings = dict(settings)
        made = made_of() if inspect.isclass(made_of) else made_of
        if not callable(made):
            raise TypeError(f"planner {self.name!r}: it has to be callable with a Situation, found {made!r}")
        self._made_of: Callable[..., Any] = made
        self.__doc__ = made_of.__doc__

    def __call__(self, situation: Situation) -> Any:
        """What it answers, unchecked."""
        return self._made_of(situation)

    def __repr__(self) -> str:
        return f"OwnPlanner({self.name!r})"

    def hello(self) -> dict[str, Any]:
        """What it says of itself."""
        return {key: value for key, value in self._settings.items() if value is not None}

    def reset(self, task: Task) -> None:
        """Calls its ``reset`` before a run, if it has one."""
        reset = getattr(self._made_of, "reset", None)
        if reset is not None:
            reset(task)

    def answer(self, situation: Situation) -> dict[str, Any]:
        """What it proposes, as a line of the protocol.

        Raises:
            PlannerError: It answered what is no proposal.
        """
        found = self(situation)
        if isinstance(found, Candidates):
            return {"candidates": [_proposal(one, self.name) for one in found.proposals]}
        return _proposal(found, self.name)


@dataclass(frozen=True)
class Candidates:
    """Several things to do, the first choice first; the arbiter chooses by the terms of ``profile`` of `planner`."""

    proposals: Iterable[Answer]


def planner(
    name: str,
    *,
    check: Check = "arbiter",
    profile: str | None = None,
    scan: bool = False,
    map: bool = False,  # noqa: A002
    answer_within_s: float = 10.0,
) -> Callable[[Any], OwnPlanner]:
    """Makes a function, a class or an object a planner called ``name``.

    It is called with a `Situation` in every cycle, and answers what the robot is to do: ``(v, omega)``, a `Drive`,
    poses of shape [states, 3] (x, y, heading), one every ``task.dt`` seconds, or `Candidates`. If it has a method
    ``reset``, that is called with the `Task` before every run. A class is called without arguments first.

    Args:
        name: In results: 1 to 60 of ``a-z 0-9 _ -``, and no built-in planner's.
        check: ``"arbiter"``: the arbiter checks what is proposed for collisions, as it does for built-in planners, and
            the driver brakes for what its laser sees. ``"driver"``: the driver alone.
        profile: The built-in profile whose terms choose among `Candidates`. Without one the first that passes the
            check is taken.
        scan: Whether ``situation.scan`` is wanted.
        map: Whether ``task.map.cells`` are wanted.
        answer_within_s: How long an answer may take; later ones are not used.

    >>> @planner("straight")
    ... def straight(situation):
    ...     "Towards the next point of the way."
    ...     x, y = situation.way[min(3, len(situation.way) - 1)]
    ...     bearing = math.atan2(y - situation.belief.y, x - situation.belief.x)
    ...     turn = math.remainder(bearing - situation.belief.heading, math.tau)
    ...     return 0.5 * math.cos(turn), turn
    >>> straight.name
    'straight'
    """
    if not isinstance(name, str):
        raise TypeError('give the planner a name: @curionav.planner("mine")')
    if not keys.is_name(f"own-{name}"):
        raise ValueError(f"planner {name[:64]!r} must be 1 to 60 of the characters a-z, 0-9, `_` and `-`")
    if check not in ("arbiter", "driver"):
        raise ValueError(f"check of planner {name!r} is {check!r}; give 'arbiter' or 'driver'")
    settings = {
        "name": name,
        "check": check,
        "profile": profile,
        "scan": scan,
        "map": map,
        "answer_within_s": float(answer_within_s),
    }

    def decorate(made_of: Any) -> OwnPlanner:
        return OwnPlanner(made_of, settings)

    return decorate


def _proposal(found: Any, name: str) -> dict[str, Any]:
    if isinstance(found, Drive):
        return dataclasses.asdict(found)
    try:
        array = np.asarray(found, np.float64)
    except (TypeError, ValueError) as error:
        raise PlannerError(name, f"answered {_shown(found)}, which is no array of numbers") from error
    if array.shape == (2,):
        return {"v": float(array[0]), "omega": float(array[1])}
    if array.ndim == 2 and array.shape[1] == 3 and len(array):
        return {"poses": array.tolist()}
    raise PlannerError(
        name, f"answered {_shown(found)}; give (v, omega), a Drive, poses of shape [states, 3], or Candidates"
    )


def _shown(found: Any) -> str:
    text = " ".join(repr(found).split())
    return text if len(text) <= 80 else text[:77] + "..."


def read_task(line: Mapping[str, Any], known: dict[str, np.ndarray[Any, Any]]) -> Task:
    """The task of a line ``begin``. ``known`` has the cells of maps that were sent before, and gets new ones."""
    told = line["map"]
    shape = (told["height"], told["width"])
    if "cells" in told:
        of_character = np.zeros(128, np.int8)
        for character, value in _CELLS.items():
            of_character[ord(character)] = value
        cells = of_character[np.frombuffer(told["cells"].encode(), np.uint8)].reshape(shape)
        cells.flags.writeable = False
        known[told["sha256"]] = cells
    outline = line["footprint"]
    vertices = np.array(outline["vertices"], np.float64) if "vertices" in outline else None
    return Task(
        robot=line["robot"],
        seed=line["seed"],
        goal=tuple(line["goal"]),
        limits=Limits(**line["limits"]),
        footprint=Footprint(radius=outline["radius"], vertices=vertices),
        steps=line["steps"],
        dt=line["dt"],
        map=Map(
            sha256=told["sha256"],
            resolution=told["resolution"],
            origin=tuple(told["origin"]),
            shape=shape,
            cells=known.get(told["sha256"]),
        ),
    )


def read_situation(line: Mapping[str, Any], task: Task) -> Situation:
    """The situation of a line ``decide``."""
    belief, people, obstacles = line["belief"], line["people"], line["obstacles"]
    return Situation(
        time=line["time"],
        belief=Belief(**{**belief, "covariance": np.array(belief["covariance"], np.float64).reshape(3, 3)}),
        people=KnownPeople(
            radius=people["radius"],
            id=np.array(people["id"], np.int64),
            xy=_pairs(people["x"], people["y"]),
            velocity=_pairs(people["vx"], people["vy"]),
        ),
        goal=tuple(line["goal"]),
        way=np.array(line["way"], np.float64).reshape(-1, 2),
        to_go=line["to_go"],
        obstacles=_pairs(obstacles["x"], obstacles["y"]),
        obstacle_side=obstacles["side"],
        scan=_read_scan(line["scan"]) if "scan" in line else None,
        task=task,
    )


def _pairs(x: Sequence[float], y: Sequence[float]) -> F64:
    return np.array([x, y], np.float64).T.reshape(-1, 2)


def _read_scan(scan: Mapping[str, Any]) -> KnownScan:
    ranges = np.array([math.nan if one is None else one for one in scan["ranges"]], np.float64)
    return KnownScan(
        time=scan["time"],
        angles=scan["angle_min"] + scan["angle_increment"] * np.arange(len(ranges)),
        ranges=ranges,
        range_max=scan["range_max"],
        laser=tuple(scan["laser"]),
    )
