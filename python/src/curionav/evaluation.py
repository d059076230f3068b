"""Evaluators written in Python: a function from a scene and candidates to one cost per candidate."""

from __future__ import annotations

import dataclasses
import inspect
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from . import keys
from .array import F64
from .errors import EvaluatorError
from .field_types import MAX_MAGNITUDE
from .messages import CandidateSet, CandidateShard, EvaluateRequest, People, Scene

BUILT_IN = frozenset(
    {
        "cnc",
        "collision-risk",
        "cpc",
        "cpc-occluded",
        "distance",
        "doppler",
        "human-space",
        "information-to-go",
        "order",
        "risk",
        "uncertainty",
    }
)
"""Terms that the services compute themselves: a function of that name would be mixed with theirs."""


class Evaluator:
    """A term of the cost and the function that computes it; made by `evaluator`. Calling it calls the function.

    Attributes:
        term: Name of the term, as in the profile's ``terms``.
    """

    def __init__(self, term: str, function: Callable[..., Any]) -> None:
        if not keys.is_name(term):
            raise ValueError(f"term {term[:64]!r} must be 1 to 64 of the characters a-z, 0-9, `_` and `-`")
        if term in BUILT_IN:
            raise ValueError(f"term {term!r} is built in: choose another name")
        self.term = term
        self._function = function
        self._takes_request = _takes_request(function)
        self.__doc__ = function.__doc__
        self.__name__ = getattr(function, "__name__", term)

    def __call__(self, *arguments: Any) -> Any:
        """What the function gives, unchecked."""
        return self._function(*arguments)

    def __repr__(self) -> str:
        return f"Evaluator({self.term!r}, {self.__name__})"

    def costs(self, request: EvaluateRequest) -> F64:
        """The checked costs of a request's candidates, shape [count].

        Raises:
            EvaluatorError: The function raised, or gave anything but one finite cost >= 0 per candidate.
            DecodeError: A column of the candidates is absent, which the services never leave out for such a term.
        """
        candidates = request.all_columns(self.term)
        if not candidates.count:
            return np.empty(0)
        arguments = [request.scene, candidates]
        try:
            found = self._function(*arguments, request) if self._takes_request else self._function(*arguments)
        except Exception as error:
            raise EvaluatorError(self.term, f"raised {type(error).__name__}: {error}{_place(error)}") from error
        return self._checked(found, candidates.count)

    def trial(self, request: EvaluateRequest) -> F64:
        """Tries the function on three candidates, without people and among two, before work depends on it.

        Gives no costs. ``request`` is one without candidates; what it says of map, goal and robot model holds.

        Raises:
            EvaluatorError: As `costs`, or a candidate's cost changes with its neighbours in the batch.
        """
        three = _three_candidates(request)
        for people in (_people(request.scene, 0), _people(request.scene, 2)):
            scene = dataclasses.replace(request.scene, people=people)

            def asked(candidates: CandidateSet, scene: Scene = scene) -> F64:
                return self.costs(dataclasses.replace(request, scene=scene, candidates=CandidateShard.of(candidates)))

            together = asked(three)
            alone = np.concatenate([asked(part(three, index)) for index in range(three.count)])
            if not np.allclose(together, alone, rtol=1e-6, atol=1e-9):
                raise EvaluatorError(
                    self.term,
                    f"the cost of a candidate changes with its neighbours: {together} for three together, {alone} for "
                    "each alone; a batch is cut into parts, so do not scale or rank costs within it",
                )
        return np.empty(0)

    def _checked(self, found: Any, count: int) -> F64:
        try:
            cost = np.asarray(found, np.float64)
        except (TypeError, ValueError) as error:
            raise EvaluatorError(self.term, f"gave no array of numbers: {error}") from error
        if cost.shape != (count,):
            raise EvaluatorError(self.term, f"gave an array of shape {cost.shape}, expected ({count},)")
        usable = (cost >= 0.0) & (cost <= MAX_MAGNITUDE)  # a NaN is neither
        if not usable.all():
            index = int(np.flatnonzero(~usable)[0])
            raise EvaluatorError(self.term, f"cost[{index}] is {cost[index]}, not a finite number >= 0")
        return cost


def evaluator(term: str) -> Callable[[Callable[..., Any]], Evaluator]:
    """Makes a function an evaluator of ``term``.

    The function takes a `Scene` and a `CandidateSet`, and if it has a third parameter the whole `EvaluateRequest`
    (goal, map, robot model). It gives one finite cost >= 0 per candidate, shape [count]; lower is better. A candidate's
    cost must not depend on the others: a batch is cut into parts, over as many replicas as there are.

    >>> @evaluator("tempo")
    ... def tempo(scene, candidates):
    ...     "Metres per second missing to 1 m/s."
    ...     return abs(1.0 - candidates.v).mean(axis=1)
    >>> tempo.term
    'tempo'
    """
    if not isinstance(term, str):
        raise TypeError('give the term a name: @curionav.evaluator("my-term")')

    def decorate(function: Callable[..., Any]) -> Evaluator:
        return Evaluator(term, function)

    return decorate


def _takes_request(function: Callable[..., Any]) -> bool:
    """Whether a function takes the whole request too; a parameter with a default is its own."""
    signature = inspect.signature(function)
    for count in (2, 3):
        try:
            signature.bind(*range(count))
        except TypeError:
            continue
        return count == 3
    raise TypeError("an evaluator takes (scene, candidates) or (scene, candidates, request)")


def _place(error: Exception) -> str:
    """Where in the user's code an exception came from."""
    frames = traceback.extract_tb(error.__traceback__)[1:]
    return f" (line {frames[0].lineno} of {frames[0].name})" if frames else ""


def part(candidates: CandidateSet, index: int) -> CandidateSet:
    """The candidate at ``index`` alone."""
    rows = slice(index, index + 1)
    arrays = {name: getattr(candidates, name)[rows] for name in ("id", "x", "y", "heading", "v", "omega")}
    return dataclasses.replace(candidates, count=1, **arrays)


def _three_candidates(request: EvaluateRequest) -> CandidateSet:
    """Arcs from where the robot is: slow to the right, ahead, fast to the left."""
    steps, dt, belief = request.candidates.steps, request.candidates.dt, request.scene.belief
    v = np.repeat([[0.25], [0.5], [1.0]], steps, axis=1)
    omega = np.repeat([[-0.3], [0.0], [0.3]], steps, axis=1)
    heading = belief.heading + np.cumsum(omega * dt, axis=1)
    arrays: dict[str, Any] = {
        "id": np.arange(3, dtype=np.uint32),
        "x": belief.x + np.cumsum(v * dt * np.cos(heading), axis=1),
        "y": belief.y + np.cumsum(v * dt * np.sin(heading), axis=1),
        "heading": heading,
        "v": v,
        "omega": omega,
    }
    for array in arrays.values():
        array.flags.writeable = False  # as those that are received
    return CandidateSet(count=3, steps=steps, dt=dt, **arrays)


def _people(scene: Scene, count: int) -> People:
    """The first ``count`` of: one person 2 m ahead who comes nearer, one 3 m behind who stands."""
    belief = scene.belief
    ahead, speed = np.array([2.0, -3.0])[:count], np.array([-1.0, 0.0])[:count]
    cos, sin = np.cos(belief.heading), np.sin(belief.heading)
    return People(
        tick=scene.tick,
        stamp=scene.stamp,
        frame="map",
        radius=0.25,
        id=np.arange(count, dtype=np.uint32),
        x=belief.x + ahead * cos,
        y=belief.y + ahead * sin,
        vx=speed * cos,
        vy=speed * sin,
    )
