"""What a step is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curionav.array import F64

from .facts import Facts


@dataclass(frozen=True)
class Reward:
    """Weights of the terms, which are summed. A term of weight 0 is left out of what counts, and still shown.

    Attributes:
        progress: Per metre by which the shortest way to the goal has become shorter in this step.
        arrival: Once, when the robot reaches the goal.
        collision: Once, when it touches a person or runs into a wall; negative.
        closeness: Per second at the edge of a person, falling linearly to nothing at ``comfort`` metres; negative.
        comfort: m between the edges of robot and person that bother no person.
        turning: Per radian that the robot turns; negative.
        time: Per second; negative.
    """

    progress: float = 1.0
    arrival: float = 10.0
    collision: float = -10.0
    closeness: float = -1.0
    comfort: float = 0.5
    turning: float = -0.05
    time: float = -0.1

    def terms(self, before: Facts, now: Facts) -> dict[str, F64]:
        """The terms of a step by name, weighted, each of shape [worlds]."""
        step = now.time - before.time
        finite = np.isfinite(before.to_go) & np.isfinite(now.to_go)
        gained = np.subtract(before.to_go, now.to_go, out=np.zeros_like(step), where=finite)
        near: F64 = np.asarray(np.clip(1.0 - now.person_clearance / self.comfort, 0.0, 1.0), np.float64)
        return {
            "progress": self.progress * gained,
            "arrival": self.arrival * now.reached,
            "collision": np.where(now.touches > 0.0, self.collision, 0.0),
            "closeness": self.closeness * near * step,
            "turning": self.turning * np.abs(now.omega) * step,
            "time": self.time * step,
        }
