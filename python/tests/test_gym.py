"""Crowds as environments of Gymnasium."""

from __future__ import annotations

import math
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import hall

pytest.importorskip("curionav_native", reason="no extension module; pip install ./python with Cargo")
gymnasium = pytest.importorskip("gymnasium", reason="no gymnasium; pip install './python[gym]'")

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

from curionav import Scenario  # noqa: E402
from curionav_gym import ID, CrowdEnv, CrowdVectorEnv, Reward  # noqa: E402

EXAMPLES = ROOT / "python" / "examples"


@pytest.fixture
def small(tmp_path: Path) -> Scenario:
    data = hall(tmp_path)
    # It begins where the file says.
    data["robot"]["start_noise"] = 0.0
    return Scenario.from_dict(data, tmp_path)


@pytest.mark.parametrize(
    "options", [{}, {"perception": "tracked", "localizes": True}, {"people": 3, "ends_in_collision": False}]
)
def test_gymnasium_finds_nothing_wrong(options: dict[str, Any]) -> None:
    env = gymnasium.make(ID, render_mode="rgb_array", **options)
    check_env(env.unwrapped, skip_render_check=False)


def test_a_scenario_has_a_name_and_people_may_be_tracked() -> None:
    options = {"scenario": "dense/plaza-hrvo-02", "people": 60}
    env = gymnasium.make("curionav_gym:curionav/Crowd-v0", perception="tracked", **options)
    observation, _ = env.reset(seed=3)
    for _ in range(20):
        observation, *_ = env.step(np.array([0.0, 0.0], np.float32))
    told = gymnasium.make(ID, **options)
    known, _ = told.reset(seed=3)
    assert 0 < observation["mask"].sum() < known["mask"].sum() == 51, "a laser does not see everyone"


def test_the_goal_is_seen_from_the_robot(small: Scenario) -> None:
    env = CrowdEnv(small)
    observation, info = env.reset(seed=1)
    assert observation["goal"] == pytest.approx([4.0, 0.0], abs=1e-5)  # from (2, 3) facing x to (6, 3)
    assert observation["belief"] == pytest.approx([2.0, 3.0, 0.0, 0.0, 0.0], abs=1e-6)
    for _ in range(30):
        observation, *_, info = env.step(np.array([0.0, 1.0], np.float32))
    heading = info["true_pose"][2]
    assert heading > 1.0
    assert observation["goal"] == pytest.approx([4.0 * math.cos(heading), -4.0 * math.sin(heading)], abs=1e-4)


def test_people_are_told_nearest_first_with_a_mask(small: Scenario) -> None:
    observation, _ = CrowdEnv(small, people=4).reset(seed=1)
    assert observation["mask"].tolist() == [1, 0, 0, 0]
    assert observation["people"][1:].tolist() == np.zeros((3, 5)).tolist()
    assert observation["people"][0][4] == pytest.approx(0.25)
    crowded, _ = CrowdEnv("dense/plaza-hrvo-02", people=10).reset(seed=1)
    distances = np.hypot(*crowded["people"][:, :2].T)
    assert (np.diff(distances) >= 0.0).all()


def test_one_seed_is_one_episode_and_the_next_world_is_another() -> None:
    env = CrowdEnv()

    def drive(seed: int | None) -> bytes:
        seen = [env.reset(seed=seed)[0]["ranges"]]
        seen += [env.step(np.array([0.5, 0.1], np.float32))[0]["ranges"] for _ in range(15)]
        return np.concatenate(seen).tobytes()

    first, second = drive(7), drive(None)
    assert first != second
    assert (drive(7), drive(None)) == (first, second)


def test_a_vector_is_its_environments_one_by_one(small: Scenario) -> None:
    envs = CrowdVectorEnv(3, small)
    singles = [CrowdEnv(small) for _ in range(3)]
    observation, _ = envs.reset(seed=5)
    expected = [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)]
    actions = np.array([[0.2, 0.3], [0.1, -0.5], [0.0, 1.0]], np.float32)
    for _ in range(60):
        for name, array in observation.items():
            assert all(np.array_equal(array[i], one[name]) for i, one in enumerate(expected)), name
        observation, reward, terminated, truncated, _ = envs.step(actions)
        stepped = [env.step(actions[i]) for i, env in enumerate(singles)]
        expected = [one[0] for one in stepped]
        assert reward.tolist() == pytest.approx([one[1] for one in stepped])
        assert not (terminated.any() or truncated.any())


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_an_episode_that_has_ended_begins_anew(small: Scenario, mode: AutoresetMode) -> None:
    """Robot 0 drives to its goal; robot 1 stands."""
    envs = CrowdVectorEnv(2, small, autoreset_mode=mode)
    envs.reset(seed=1)
    actions = np.array([[1.0, 0.0], [0.0, 0.0]], np.float32)
    for _ in range(100):
        observation, reward, terminated, truncated, info = envs.step(actions)
        if terminated.any():
            break
    assert terminated.tolist() == [True, False]
    assert not truncated.any()
    assert reward[0] > 5.0
    assert info["_measures"].tolist() == [True, False]
    assert info["measures"][0]["outcome"] == "reached"
    assert info["measures"][0]["length_m"] == pytest.approx(3.5, abs=0.3)  # 4 m less the tolerance of 0.5 m
    if mode is AutoresetMode.SAME_STEP:
        assert np.hypot(*info["final_obs"][0]["goal"]) < 0.6
        assert np.hypot(*observation["goal"][0]) == pytest.approx(4.0)
        return
    assert np.hypot(*observation["goal"][0]) < 0.6
    observation, reward, terminated, truncated, info = envs.step(actions)
    assert np.hypot(*observation["goal"][0]) == pytest.approx(4.0)
    assert reward[0] == 0.0
    assert not (terminated.any() or truncated.any())
    assert info["time_s"][0] == 0.0 < info["time_s"][1]


def test_the_reward_is_the_sum_of_its_terms(small: Scenario) -> None:
    env = CrowdEnv(small, reward=Reward(progress=2.0, time=-0.5, turning=-1.0))
    _, before = env.reset(seed=1)
    for _ in range(10):
        _, reward, _, _, info = env.step(np.array([0.5, 0.2], np.float32))
        terms = info["reward_terms"]
        assert reward == pytest.approx(sum(terms.values()))
        assert terms["progress"] == pytest.approx(2.0 * (before["to_go_m"] - info["to_go_m"]))
        assert terms["time"] == pytest.approx(-0.05)
        assert terms["collision"] == terms["arrival"] == 0.0
        before = info
    assert terms["turning"] < -0.01


def test_a_wall_ends_the_episode_unless_it_may_go_on(small: Scenario) -> None:
    def ends(*, ends_in_collision: bool) -> dict[str, Any]:
        scenario = Scenario.from_dict(small.data, small.base)
        scenario.data["robot"]["goal"] = [2, 5]
        env = CrowdEnv(scenario, ends_in_collision=ends_in_collision)
        env.reset(seed=1)
        for _ in range(400):
            *_, terminated, truncated, info = env.step(np.array([1.0, 0.0], np.float32))
            if terminated or truncated:
                return {"terminated": terminated, **info}
        raise AssertionError("the time limit is 30 s")

    assert ends(ends_in_collision=True)["terminated"]
    late = ends(ends_in_collision=False)
    assert not late["terminated"]
    assert late["measures"]["outcome"] == "timeout"
    assert late["time_s"] == pytest.approx(30.0)


def test_a_picture_shows_robot_people_and_goal(small: Scenario) -> None:
    env = CrowdEnv(small, render_mode="rgb_array")
    env.reset(seed=1)
    pixels = env.render()
    assert pixels.shape == (300, 600, 3)
    per_metre = 600 / 12.0

    def at(x: float, y: float) -> list[int]:
        colour: list[int] = pixels[int(300 - y * per_metre), int(x * per_metre)].tolist()
        return colour

    assert at(2.0, 3.0) == [30, 90, 200]
    assert at(8.0, 1.0) == [220, 120, 40]
    assert at(6.0, 3.0) == [40, 160, 70]
    assert at(0.05, 3.0) == [40, 40, 40]


def test_the_examples_train_and_evaluate(tmp_path: Path) -> None:
    evaluate = [sys.executable, str(EXAMPLES / "evaluate_policy.py"), "--seeds", "3"]
    printed = subprocess.run(evaluate, check=True, capture_output=True, text=True, cwd=tmp_path).stdout
    assert "of 3 at the goal" in printed
    if find_spec("stable_baselines3") is None:
        pytest.skip("stable_baselines3 is not installed: nothing is trained")
    train = [sys.executable, str(EXAMPLES / "train_ppo.py"), "--steps", "4096", "--worlds", "4"]
    subprocess.run(train, check=True, capture_output=True, cwd=tmp_path)
    again = [*evaluate, "--policy", "policy.zip"]
    assert "of 3 at the goal" in subprocess.run(again, check=True, capture_output=True, text=True, cwd=tmp_path).stdout
