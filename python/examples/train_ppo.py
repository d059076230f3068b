"""Trains a policy by PPO in many worlds at once, and saves it: `python train_ppo.py --steps 200000`.

It needs stable-baselines3 (MIT), which is no dependency of the package: `pip install stable-baselines3`. Then
`evaluate_policy.py` says how well the policy drives, beside the planners.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from curionav_gym import ID


class Adapter(VecEnv):  # type: ignore[misc]
    """A vector of Gymnasium as stable-baselines3 wants it: it begins anew in the step that ends an episode."""

    def __init__(self, envs: gymnasium.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self._envs = envs
        self._actions: NDArray[np.float32] | None = None
        self._returns, self._lengths = np.zeros(envs.num_envs), np.zeros(envs.num_envs, int)

    def reset(self) -> Any:
        """The first observation of every world."""
        first = self._seeds[0]
        self._reset_seeds()
        return self._envs.reset(seed=None if first is None else int(first))[0]

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keeps the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Any:
        """One tick of every world."""
        observation, reward, terminated, truncated, info = self._envs.step(self._actions)
        ended = terminated | truncated
        self._returns += reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(ended):
            episode = {"r": self._returns[i], "l": self._lengths[i]}
            infos[i] = {
                "terminal_observation": info["final_obs"][i], "TimeLimit.truncated": bool(truncated[i]),
                "episode": episode,
            }  # fmt: skip
        self._returns[ended], self._lengths[ended] = 0.0, 0
        return observation, reward.astype(np.float32), ended, infos

    def close(self) -> None:
        """Ends the worlds."""
        self._envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute, the same of every world."""
        return [getattr(self._envs, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Worlds have none to be set."""
        raise NotImplementedError(attr_name)

    def env_method(self, method_name: str, *arguments: Any, indices: Any = None, **named: Any) -> list[Any]:
        """Worlds have none to be called."""
        raise NotImplementedError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """None is."""
        return [False] * self.num_envs


def main() -> None:
    """Trains, and saves the policy."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--scenario", default="quickstart")
    parser.add_argument("--steps", type=int, default=200_000, help="of all worlds together")
    parser.add_argument("--worlds", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("policy.zip"))
    options = parser.parse_args()
    envs = gymnasium.make_vec(ID, num_envs=options.worlds, scenario=options.scenario, autoreset_mode="SameStep")
    adapter = Adapter(envs)
    policy = PPO("MultiInputPolicy", adapter, n_steps=256, batch_size=512, seed=options.seed, verbose=1)
    policy.learn(options.steps)
    policy.save(options.out)
    adapter.close()
    print(f"saved {options.out}")


if __name__ == "__main__":
    main()
