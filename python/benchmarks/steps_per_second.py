"""How fast the environments of Gymnasium step: `python steps_per_second.py`, beside IR-SIM where that is installed.

Seconds are those of the processor, of all threads, so that other work on the machine matters little. `--memory` steps
the first case so often, and prints how much larger the process has become after the first tenth.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from curionav import Scenario
from curionav_gym import ID

_SIDE = 12.0
"""Of the square hall, m."""
_PEOPLE = 20


def hall(folder: Path, people: int) -> Scenario:
    """A square hall with people who walk to and fro by HRVO, and a laser of 181 beams."""
    cells = round(_SIDE / 0.05)
    image = np.full((cells, cells), 254, np.uint8)
    image[[0, -1]] = image[:, [0, -1]] = 0
    (folder / "hall.pgm").write_bytes(f"P5\n{cells} {cells}\n255\n".encode() + image.tobytes())
    (folder / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    crowds = [{"count": people, "behaviour": "walk"}] if people else []
    return Scenario.from_dict(
        {
            "name": "hall",
            "map": {"file": "hall.yaml"},
            "robot": {"start": [1.0, 1.0, 0.8], "goal": [11.0, 11.0]},
            "laser": {"beams": 181, "range_max": 8.0},
            "clock": {"time_limit_s": 60.0},
            "people": {"motion": "hrvo"},
            "crowds": crowds,
        },
        folder,
    )


def ours(scenario: Scenario, **options: Any) -> Callable[[int], int]:
    """Steps one environment at random."""
    env = gymnasium.make(ID, disable_env_checker=True, scenario=scenario, ends_in_collision=False, **options)
    env.reset(seed=1)
    actions = [env.action_space.sample() for _ in range(64)]

    def run(steps: int) -> int:
        for step in range(steps):
            *_, terminated, truncated, _ = env.step(actions[step // 10 % 64])
            if terminated or truncated:
                env.reset()
        return steps

    return run


def vector(scenario: Scenario, worlds: int) -> Callable[[int], int]:
    """Steps many worlds at random; counts the steps of all of them."""
    envs = gymnasium.make_vec(ID, num_envs=worlds, scenario=scenario, ends_in_collision=False)
    envs.reset(seed=1)
    actions = envs.action_space.sample()

    def run(steps: int) -> int:
        rounds = -(-steps // worlds)
        for _ in range(rounds):
            envs.step(actions)
        return rounds * worlds

    return run


def ir_sim(folder: Path, people: int) -> Callable[[int], int]:
    """The same hall in IR-SIM (Apache-2.0): a differential robot with a laser of 181 beams, people by RVO."""
    import irsim  # noqa: PLC0415 - a peer, which need not be there

    crowd = (
        f"  - number: {people}\n    distribution: {{name: random, range_low: [1, 1, -3], range_high: [11, 11, 3]}}\n"
        "    kinematics: {name: omni}\n    shape: {name: circle, radius: 0.25}\n"
        "    behavior: {name: rvo, wander: true, range_low: [1, 1, -3], range_high: [11, 11, 3], vmax: 1.0}\n"
    )
    file = folder / "irsim.yaml"
    file.write_text(
        f"world: {{height: {_SIDE}, width: {_SIDE}, step_time: 0.1, sample_time: 0.1, control_mode: auto,"
        " collision_mode: unobstructed}\n"
        "robot:\n  - kinematics: {name: diff}\n    shape: {name: circle, radius: 0.3}\n    state: [1, 1, 0.8]\n"
        "    goal: [11, 11, 0]\n    sensors: [{name: lidar2d, range_max: 8, angle_range: 3.1416, number: 181}]\n"
        "obstacle:\n"
        f"  - shape: {{name: linestring, vertices: [[0, 0], [{_SIDE}, 0], [{_SIDE}, {_SIDE}], [0, {_SIDE}], [0, 0]]}}\n"
        "    state: [0, 0, 0]\n" + (crowd if people else "")
    )
    env: Any = irsim.make(str(file), display=False, log_level="ERROR")

    def run(steps: int) -> int:
        for _ in range(steps):
            env.step(np.array([[0.3], [0.2]]), 0)
            env.get_lidar_scan()
        return steps

    return run


def rate(run: Callable[[int], int], seconds: float) -> float:
    """Steps in a second of the processor."""
    run(50)
    began, done, chunk = time.process_time(), 0, 10
    while time.process_time() - began < seconds:
        done += run(chunk)
        chunk *= 2
    return done / (time.process_time() - began)


def memory_mb() -> float:
    """Greatest size of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    """Prints a row per case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seconds", type=float, default=5.0, help="of each case")
    parser.add_argument("--worlds", type=int, default=32, help="of the vector")
    parser.add_argument("--memory", type=int, metavar="STEPS", help="measure memory instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.memory:
            run = ours(hall(folder, _PEOPLE))
            run(options.memory // 10)
            early = memory_mb()
            run(options.memory - options.memory // 10)
            print(f"{early:.1f} MB after a tenth, {memory_mb():.1f} MB after {options.memory} steps")
            return
        for people in (0, _PEOPLE):
            scenario = hall(folder, people)
            tracked = scenario.with_perception("tracked")
            cases: dict[str, Callable[[], Callable[[int], int]]] = {
                "one environment": partial(ours, scenario),
                f"a vector of {options.worlds}": partial(vector, scenario, options.worlds),
                "one, localised and tracked": partial(ours, tracked, localizes=True),
            }
            if find_spec("irsim"):
                cases["IR-SIM"] = partial(ir_sim, folder, people)
            for case, make in cases.items():
                print(f"{people:3} people  {case:28} {rate(make(), options.seconds):10.0f} steps/s", flush=True)
        if not find_spec("irsim"):
            print("IR-SIM is not installed: `pip install ir-sim`")


if __name__ == "__main__":
    main()
