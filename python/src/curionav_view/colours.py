"""Colours: ramps that also those can read who see no red or green, on a dark ground.

A colour is four bytes, RGBA.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Colours = NDArray[np.uint8]
"""Shape [..., 4]."""

FLOOR = (30, 34, 43, 255)
WALL = (150, 158, 174, 255)
OBSTACLE = (186, 160, 92, 255)
"""What stands on no map."""
KEEPOUT = (126, 44, 58, 255)
"""Floor on which the robot must not drive."""
SLOW = (96, 78, 30, 255)
"""Floor on which the robot is slow: the slower, the nearer to this."""
UNKNOWN = (16, 18, 24, 255)
"""Also the ground behind everything."""
ROBOT = (240, 244, 250, 255)
SCAN = (255, 96, 96, 255)
BELIEF = (94, 200, 255, 255)
PARTICLE = (40, 120, 255, 200)
TRUTH = (255, 255, 255, 255)
GOAL = (120, 230, 140, 255)
COMFORT = (255, 190, 70, 160)
PERSON = (126, 158, 255, 255)
PERSON_NEAR = (255, 84, 72, 255)
UNSEEN = (255, 120, 220, 255)
"""What only the driver sees."""
CROWD = (255, 160, 90, 255)
REJECTED = (120, 126, 140, 56)

ACTIONS = {"follow": (70, 240, 220, 255), "hold": (255, 190, 70, 255), "stop": (255, 84, 72, 255)}
"""What is done, as the decided trajectory and the lane of modes show it."""
SERIES = {
    "uncertainty": (94, 200, 255, 255),
    "limit": (255, 190, 70, 255),
    "distance": (126, 158, 255, 255),
    "speed": (70, 240, 220, 255),
    "command": (150, 156, 170, 255),
    "error": (255, 255, 255, 255),
}

# Least to most; the last number of each is the opacity.
_COST = [(253, 231, 37, 255), (94, 201, 98, 225), (33, 145, 140, 190), (59, 82, 139, 160), (84, 40, 120, 130)]
_DENSITY = [(90, 20, 120, 0), (150, 40, 126, 110), (222, 73, 104, 165), (254, 159, 109, 200), (252, 253, 191, 225)]
_INFORMATION = [(12, 44, 60, 0), (14, 80, 92, 80), (22, 120, 120, 110), (50, 160, 140, 130), (120, 210, 165, 150)]


def _ramp(anchors: list[tuple[int, int, int, int]], share: Any) -> Colours:
    """Colours along a ramp for numbers of 0 to 1; what is not a number counts as 0."""
    values = np.clip(np.nan_to_num(np.asarray(share, np.float64), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    at = np.linspace(0.0, 1.0, len(anchors))
    table = np.asarray(anchors, np.float64)
    channels = [np.interp(values, at, table[:, channel]) for channel in range(4)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def cost(share: Any) -> Colours:
    """Of candidates: 0 the cheapest, bright, to 1 the dearest, dark."""
    return _ramp(_COST, share)


def density(share: Any) -> Colours:
    """Of people: nothing at 0."""
    return _ramp(_DENSITY, share)


def information(share: Any) -> Colours:
    """Of what the laser tells: nothing at 0."""
    return _ramp(_INFORMATION, share)
