"""JuPedSim (``pip install './python[examples]'``) as the live crowd of a real map, the depot of Nav2.

Start a deployment first: ``curionav up deploy/local.toml``. Then: ``python python/examples/jupedsim_crowd.py``
``python -m curionav.datasets maps_nav2_turtlebot`` downloads the map.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import curionav

# Where people walk: the hall north of the offices, between its walls and around its posts and shelf.
HALL = [(0.8, 6.6), (29.2, 6.6), (29.2, 14.0), (0.8, 14.0)]
OBSTACLES = [
    [(7.0, 10.8), (7.8, 10.8), (7.8, 12.2), (7.0, 12.2)],
    [(12.6, 10.8), (14.6, 10.8), (14.6, 13.4), (12.6, 13.4)],
    [(22.0, 10.8), (22.8, 10.8), (22.8, 12.2), (22.0, 12.2)],
]
SPEED = 0.9
WAITS_WITHIN_M = 1.0


class JuPedSimCrowd:
    """Two groups of eight who cross the hall in opposite directions and wait while the robot is close."""

    def __init__(self) -> None:
        import jupedsim as jps  # noqa: PLC0415 - an extra

        model = jps.CollisionFreeSpeedModel()
        self.simulation = jps.Simulation(model=model, geometry=HALL, excluded_areas=OBSTACLES, dt=0.05)
        for start, end in ((6.0, 28.2), (20.0, 0.8)):
            leave = self.simulation.add_exit_stage([(end, 7.0), (end + 1.0, 7.0), (end + 1.0, 10.0), (end, 10.0)])
            journey = self.simulation.add_journey(jps.JourneyDescription([leave]))
            for i in range(8):
                place = (start + 1.3 * (i % 4), 7.4 + 1.4 * (i // 4))
                agent = jps.CollisionFreeSpeedModelAgentParameters(
                    position=place, journey_id=journey, stage_id=leave, desired_speed=SPEED, radius=0.25
                )
                self.simulation.add_agent(agent)

    def __call__(self, step: curionav.CrowdStep) -> tuple[NDArray[Any], ...]:
        """All people at this step: x, y, vx, vy, id."""
        before = {}
        for agent in self.simulation.agents():
            before[agent.id] = np.array(agent.position)
            gap = np.hypot(agent.position[0] - step.robot.x, agent.position[1] - step.robot.y)
            agent.model.desired_speed = SPEED if gap > WAITS_WITHIN_M else 0.0
        begun = self.simulation.elapsed_time()
        while self.simulation.elapsed_time() < step.time - 1e-6:
            self.simulation.iterate()
        now = {agent.id: np.array(agent.position) for agent in self.simulation.agents()}
        place = np.array(list(now.values())).reshape(-1, 2)
        way = place - np.array([before[person] for person in now]).reshape(-1, 2)
        speed = way / max(self.simulation.elapsed_time() - begun, 0.05)
        return place[:, 0], place[:, 1], speed[:, 0], speed[:, 1], np.array(list(now), np.int64)


def main() -> int:
    """The robot drives the length of the hall among them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", metavar="ENDPOINT", help="router of the deployment")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    scenario = curionav.Scenario.from_dict(
        {
            "name": "depot-jupedsim",
            "map": {"file": "dataset:maps_nav2_turtlebot/depot.yaml"},
            "robot": {"start": [1.5, 9.5, 0.0], "goal": [27.5, 9.0]},
            "laser": {"range_max": 10.0},
        }
    )
    with (
        curionav.connect(options.connect) as deployment,
        deployment.inject(scenario, seed=options.seed, crowd=JuPedSimCrowd()) as run,
    ):
        for report in run:
            print(f"{report.scene.stamp:5.1f} s  {len(report.scene.people.id)} people near, {report.decision.action}")
        result = run.wait()
    print(f"{result.outcome}: {result.measures.collisions} collisions, nearest {result.measures.md_m:.2f} m")
    return 0


if __name__ == "__main__":
    sys.exit(main())
