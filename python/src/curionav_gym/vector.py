"""Many robots, each in a crowd of its own, stepped on all cores."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from curionav.injection import Playable

from .crowd import Crowd, Observation, Perception, seen_of
from .facts import Facts
from .reward import Reward

_SEEDS = 2**32
"""Seeds of worlds are below it."""


class CrowdVectorEnv(gymnasium.vector.VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]):
    """As `CrowdEnv`, ``num_envs`` times, in Rust on all cores of the machine.

    ``info["measures"]`` has the measures of the runs that ended in this step, an object by world; ``_measures`` says
    where.

    Args:
        num_envs: How many.
        scenario: As of `CrowdEnv`, and so are the arguments after it.
        perception: How people are known.
        localizes: Whether robots have to localise themselves.
        people: Of how many people each robot is told.
        reward: The weights of the reward's terms.
        ends_in_collision: Whether a collision ends an episode.
        autoreset_mode: ``NextStep``: the step after an episode's end begins another one and ignores the action.
            ``SameStep``: the step that ends it does; ``info["final_obs"]`` then has what was seen last.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as in Gymnasium

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Playable = "quickstart",
        perception: Perception | None = None,
        *,
        localizes: bool = False,
        people: int = 20,
        reward: Reward | None = None,
        ends_in_collision: bool = True,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ) -> None:
        self._mode = AutoresetMode(autoreset_mode)
        if self._mode not in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
            raise ValueError(f"autoreset_mode: `{self._mode.value}` is not one of NextStep, SameStep")
        self.metadata = {**type(self).metadata, "autoreset_mode": self._mode}
        self.num_envs = num_envs
        self._crowd = Crowd(num_envs, scenario, perception, localizes, people)
        self._reward = reward or Reward()
        self._ends_in_collision = ends_in_collision
        self._facts: Facts | None = None
        self._ended = np.zeros(num_envs, bool)
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self.single_observation_space, self.single_action_space = self._crowd.observations, self._crowd.actions
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """New worlds. With one ``seed`` world i begins by ``seed + i``, as in Gymnasium's own vectors."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        for i, own in enumerate(seeds):
            if own is not None:
                self._generators[i], _ = gymnasium.utils.seeding.np_random(own)
        everywhere = np.ones(self.num_envs, bool)
        observation, self._facts = self._crowd.advance(np.zeros((self.num_envs, 2)), self._drawn(everywhere))
        self._ended[:] = False
        return observation, seen_of(self._facts, {})

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One tick in every world, in which base i is told to drive ``actions[i]``: m/s and rad/s."""
        before = self._facts
        if before is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        anew = self._ended.copy()
        commands = np.asarray(actions, np.float64)
        observation, facts = self._crowd.advance(commands, self._drawn(anew))
        terms = {name: np.where(anew, 0.0, term) for name, term in self._reward.terms(before, facts).items()}
        stopped = (facts.reached > 0.0) | (self._ends_in_collision & (facts.touches > 0.0))
        terminated = stopped & ~anew
        truncated = (facts.late > 0.0) & ~stopped & ~anew
        self._facts, self._ended = facts, terminated | truncated
        info = seen_of(facts, terms)
        if self._ended.any():
            info["measures"], info["_measures"] = self._measures(), self._ended.copy()
        if self._mode is AutoresetMode.SAME_STEP and self._ended.any():
            observation = self._restart(observation, info)
        return observation, sum(terms.values(), np.zeros(self.num_envs)), terminated, truncated, info

    def _restart(self, last: Observation, info: dict[str, Any]) -> Observation:
        """Begins the ended episodes anew; the others have been stepped already, and stay as they are."""
        final = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(self._ended):
            final[i] = {name: array[i].copy() for name, array in last.items()}
        info["final_obs"], info["_final_obs"] = final, self._ended.copy()
        info["final_info"], info["_final_info"] = {**info}, self._ended.copy()
        first, facts = self._crowd.restart(self._drawn(self._ended))
        for row, i in enumerate(np.flatnonzero(self._ended)):
            for name, array in last.items():
                array[i] = first[name][row]
        assert self._facts is not None
        self._facts = self._facts.with_rows(self._ended, facts)
        self._ended = np.zeros(self.num_envs, bool)
        return last

    def _drawn(self, where: NDArray[np.bool_]) -> list[int | None]:
        """A seed for each world that begins anew."""
        own = zip(where, self._generators, strict=True)
        return [int(generator.integers(_SEEDS)) if begins else None for begins, generator in own]

    def _measures(self) -> NDArray[np.object_]:
        """The measures of the runs that have ended, by world."""
        found = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(self._ended):
            found[i] = self._crowd.measures(int(i))
        return found
