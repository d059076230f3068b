"""Crowds as environments of Gymnasium.

Importing this module registers ``curionav/Crowd-v0``; ``gymnasium.make`` also imports it when told so:

>>> import gymnasium
>>> env = gymnasium.make("curionav_gym:curionav/Crowd-v0", scenario="dense/plaza-hrvo-02")      # doctest: +SKIP
>>> envs = gymnasium.make_vec("curionav_gym:curionav/Crowd-v0", num_envs=8)                     # doctest: +SKIP
"""

import gymnasium

from .env import CrowdEnv
from .reward import Reward
from .vector import CrowdVectorEnv

__all__ = ["ID", "CrowdEnv", "CrowdVectorEnv", "Reward"]

ID = "curionav/Crowd-v0"
"""Name of the environment."""

gymnasium.register(ID, entry_point="curionav_gym.env:CrowdEnv", vector_entry_point="curionav_gym.vector:CrowdVectorEnv")
