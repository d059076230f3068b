"""Measures how a policy drives: `python evaluate_policy.py --seeds 20`, or with `--policy policy.zip`.

`train_ppo.py` writes such a file. Without one it measures a rule that drives to the goal, and waits for people.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from curionav_gym import ID

Policy = Callable[[dict[str, NDArray[Any]]], NDArray[np.float32]]


def rule(observation: dict[str, NDArray[Any]]) -> NDArray[np.float32]:
    """Turns to the goal and drives, unless a person is within 1.2 m ahead."""
    x, y = observation["goal"]
    people = observation["people"][observation["mask"] > 0]
    ahead = people[(people[:, 0] > 0.0) & (np.abs(people[:, 1]) < 0.6)]
    is_free = not len(ahead) or ahead[:, 0].min() > 1.2
    off = np.arctan2(y, x)
    return np.array([0.8 * is_free * max(0.0, np.cos(off)), 1.5 * off], np.float32)


def learned(file: str) -> Policy:
    """The policy that `train_ppo.py` has saved."""
    from stable_baselines3 import PPO  # noqa: PLC0415 - only this needs it

    model = PPO.load(file)

    def policy(observation: dict[str, NDArray[Any]]) -> NDArray[np.float32]:
        action: NDArray[np.float32] = model.predict(observation, deterministic=True)[0]
        return action

    return policy


def drive(env: gymnasium.Env[Any, Any], policy: Policy, seed: int) -> dict[str, Any]:
    """The measures of an episode."""
    observation, info = env.reset(seed=seed)
    ended = False
    while not ended:
        action = np.clip(policy(observation), env.action_space.low, env.action_space.high)  # type: ignore[attr-defined]
        observation, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
    measures: dict[str, Any] = {**info["measures"], "reached": bool(info["reached"])}
    return measures


def main() -> None:
    """Prints a line of means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--scenario", default="quickstart")
    parser.add_argument("--perception", default=None)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--policy", help="a file of train_ppo.py")
    options = parser.parse_args()
    env = gymnasium.make(ID, scenario=options.scenario, perception=options.perception)
    policy = learned(options.policy) if options.policy else rule
    runs = [drive(env, policy, seed) for seed in range(1, options.seeds + 1)]
    reached = sum(run["reached"] for run in runs)
    collisions = sum(run["collisions"] for run in runs)
    seconds = np.mean([run["time_s"] for run in runs])
    print(f"{reached} of {len(runs)} at the goal, {collisions} collisions, {seconds:.1f} s on average")


if __name__ == "__main__":
    main()
