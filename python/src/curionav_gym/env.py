"""One robot in a crowd."""

from __future__ import annotations

from typing import Any, cast

import gymnasium
import numpy as np
from numpy.typing import NDArray

from curionav.injection import Playable

from .crowd import Crowd, Observation, Perception, seen_of
from .facts import Facts
from .picture import Picture
from .reward import Reward

_SEEDS = 2**32
"""Seeds of worlds are below it."""


class CrowdEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """A robot that drives to its goal through people, a tick of the scenario per step.

    The episode ends (``terminated``) at the goal or in a collision, and (``truncated``) at the scenario's time limit.

    Args:
        scenario: A scenario, a scenario file, its tables, or the name of one of the package.
        perception: How people are known, as in `curionav.Scenario.with_perception`; ``None``: as the scenario says.
        localizes: Whether the robot has to localise itself; otherwise it knows where it is.
        people: Of how many people it is told, the nearest first.
        reward: The weights of the reward's terms.
        ends_in_collision: Whether a collision ends the episode.
        render_mode: ``rgb_array``, or ``human`` for a window.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 10}  # noqa: RUF012 - as in Gymnasium

    def __init__(
        self,
        scenario: Playable = "quickstart",
        perception: Perception | None = None,
        *,
        localizes: bool = False,
        people: int = 20,
        reward: Reward | None = None,
        ends_in_collision: bool = True,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"render_mode: `{render_mode}` is not one of {self.metadata['render_modes']}")
        self.render_mode = render_mode
        self._crowd = Crowd(1, scenario, perception, localizes, people)
        self._reward = reward or Reward()
        self._ends_in_collision = ends_in_collision
        self._facts: Facts | None = None
        self._ranges = np.empty(0, np.float32)
        self._picture: Picture | None = None
        self.observation_space = cast("gymnasium.Space[Observation]", self._crowd.observations)
        self.action_space = self._crowd.actions

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """A new world: by ``seed``, or else by the next number that the seed given before draws."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(_SEEDS))
        observation, facts = self._crowd.advance(np.zeros((1, 2)), [drawn])
        self._take(observation, facts)
        return {name: array[0] for name, array in observation.items()}, self._info(facts, {})

    def step(self, action: NDArray[np.float32]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One tick, in which the base is told to drive ``action``: m/s and rad/s."""
        before = self._facts
        if before is None:
            raise gymnasium.error.ResetNeeded("call reset() before step()")
        command = np.asarray(action, np.float64).reshape(1, 2)
        observation, facts = self._crowd.advance(command, [None])
        terms = self._reward.terms(before, facts)
        self._take(observation, facts)
        ended = bool(facts.reached[0]) or (self._ends_in_collision and bool(facts.touches[0]))
        late = not ended and bool(facts.late[0])
        info = self._info(facts, terms)
        if ended or late:
            info["measures"] = self._crowd.measures(0)
        reward = float(sum(term[0] for term in terms.values()))
        return {name: array[0] for name, array in observation.items()}, reward, ended, late, info

    def render(self) -> Any:
        """A picture from above, of shape [height, width, 3], if ``render_mode`` asks for it."""
        if self.render_mode is None or self._facts is None:
            return None
        self._picture = self._picture or Picture(self._crowd.world)
        pixels = self._picture.draw(self._facts, self._crowd.everyone(0), self._ranges)
        if self.render_mode == "rgb_array":
            return pixels
        self._picture.show(pixels)
        return None

    def close(self) -> None:
        """Closes the window."""
        if self._picture is not None:
            self._picture.close()

    def _take(self, observation: Observation, facts: Facts) -> None:
        self._facts, self._ranges = facts, observation["ranges"][0]
        if self.render_mode == "human":
            self.render()

    @staticmethod
    def _info(facts: Facts, terms: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
        shown = seen_of(facts, {})
        one: dict[str, Any] = {name: values[0] for name, values in shown.items() if name != "reward_terms"}
        return {**one, "reward_terms": {name: float(values[0]) for name, values in terms.items()}}
