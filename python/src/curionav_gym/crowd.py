"""What a single environment and a vector of them have in common: worlds in Rust, spaces, rewards and measures."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from curionav import World, native
from curionav.array import F64
from curionav.injection import Playable, injection, scenario_of
from curionav.messages import RunResult

from .facts import Facts

Perception = Literal["truth", "robot-frame", "tracked", "tracked-all-round"]
Observation = dict[str, NDArray[Any]]


class Crowd:
    """Worlds of one scenario.

    Attributes:
        world: One of them, for what they share: map, goal, robot and laser.
        observations: The space of what one robot sees.
        actions: The space of what one robot can be told.
    """

    def __init__(
        self,
        count: int,
        scenario: Playable,
        perception: Perception | None,
        localizes: bool,
        people: int,
    ) -> None:
        played = scenario_of(scenario)
        if perception is not None:
            played = played.with_perception(perception)
        self.world = World(played)
        request = injection(played, None, 1).encode()
        with native.errors(played.file) as module:
            self._worlds = module.Worlds([request] * count, localizes, people)
        self.count = count
        order = self.world.order
        robot, laser = order.robot_model, order.laser
        backwards = -float(robot.v_reverse or 0.0)
        self.actions = spaces.Box(
            np.array([backwards, -robot.omega_max], np.float32), np.array([robot.v_max, robot.omega_max], np.float32)
        )
        far = np.float32(np.inf)
        self.observations = spaces.Dict(
            {
                "ranges": spaces.Box(0.0, np.float32(laser.range_max), (laser.beams,), np.float32),
                "velocity": spaces.Box(-far, far, (2,), np.float32),
                "belief": spaces.Box(-far, far, (5,), np.float32),
                "goal": spaces.Box(-far, far, (2,), np.float32),
                "people": spaces.Box(-far, far, (people, 5), np.float32),
                "mask": spaces.MultiBinary(people),
            }
        )

    def advance(self, commands: F64, seeds: list[int | None]) -> tuple[Observation, Facts]:
        """Begins anew where there is a seed, and steps the others; each array has the world as its first axis."""
        with native.errors():
            return _named(self._worlds.advance(commands, seeds))

    def restart(self, seeds: list[int | None]) -> tuple[Observation, Facts]:
        """Begins anew where there is a seed; each array has a row for each of these worlds alone."""
        with native.errors():
            return _named(self._worlds.restart(seeds))

    def measures(self, index: int) -> dict[str, Any]:
        """How the run in a world went, as `curionav.run` measures it; asked once, at its end."""
        with native.errors():
            result = RunResult.decode(self._worlds.finish(index))
        return {"outcome": result.outcome, **vars(result.measures), "social": dict(result.social or {})}

    def everyone(self, index: int) -> F64:
        """Of shape [people, 3]: x, y and radius of who is really there."""
        with native.errors():
            everyone: F64 = self._worlds.everyone(index)
        return everyone


def _named(arrays: tuple[NDArray[Any], ...]) -> tuple[Observation, Facts]:
    *seen, facts = arrays
    return dict(zip(("ranges", "velocity", "belief", "goal", "people", "mask"), seen, strict=True)), Facts.of(facts)


def seen_of(facts: Facts, terms: dict[str, F64]) -> dict[str, Any]:
    """What ``info`` has of every step, each of shape [worlds]."""
    return {
        "time_s": facts.time,
        "true_pose": np.stack([facts.x, facts.y, facts.heading], axis=-1),
        "to_go_m": facts.to_go,
        "person_clearance_m": facts.person_clearance,
        "wall_clearance_m": facts.wall_clearance,
        "reached": facts.reached > 0.0,
        "collided": facts.touches > 0.0,
        "reward_terms": terms,
    }
