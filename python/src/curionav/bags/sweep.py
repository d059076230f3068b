"""A scan of ROS as logs have it: counter-clockwise seen from above, with ranges that mean one thing each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..array import F32
from .bag import BagError

MOST_BEAMS = 8192
"""Beams of a scan that `curionav` reads. Of a scan with more, every second, third and so on is taken."""
FARTHEST = 200.0
"""Greatest range of a scanner that `curionav` reads, m."""
_NEAREST = 1e-3
"""Distance of something that is nearer than a least range of 0, m: 0 itself says nothing."""


@dataclass(frozen=True)
class Sweep:
    """Ranges from the rightmost beam to the leftmost one."""

    stamp: float
    """s"""
    start: float
    """rad, of the first beam in the scanner's frame"""
    step: float
    """rad from beam to beam, positive"""
    range_max: float
    """m; a beam of this range met nothing"""
    ranges: F32
    """[beams] m; 0 says nothing"""


def sweep(scan: Any, stamp: float, is_upside_down: bool = False) -> Sweep:
    """Reads a ``sensor_msgs/LaserScan``.

    NaN and 0 say nothing, as does REP 117 of NaN. Anything below ``range_min``, negative infinity among it, says that
    something is there, at ``range_min``. From ``range_max`` on, nothing was met.

    Raises:
        BagError: It describes no scanner.
    """
    angle, step = float(scan.angle_min), float(scan.angle_increment)
    least, most = float(scan.range_min), float(scan.range_max)
    ranges = np.asarray(scan.ranges, np.float32)
    if not all(map(math.isfinite, (angle, step, least))) or math.isnan(most) or not 0.0 <= least < most:
        raise _fault(stamp, f"angles from {angle} by {step} and ranges from {least} to {most} describe no scanner")
    if is_upside_down:
        angle, step = -angle, -step
    # A scan of a whole turn often has its first beam once more at the end.
    whole = int((math.tau + 1e-6) / abs(step)) if step else 0
    ranges = ranges[:whole]
    if len(ranges) < 2 or abs(step) * (len(ranges) - 1) < 0.01:
        raise _fault(stamp, f"{len(scan.ranges)} beams that are {step} rad apart are no sweep")
    if step < 0.0:
        angle, step, ranges = angle + step * (len(ranges) - 1), -step, ranges[::-1]
    every = -(-len(ranges) // MOST_BEAMS)
    most = min(most, FARTHEST)
    return Sweep(stamp, angle, step * every, most, _meant(ranges[::every], least, most))


def _meant(ranges: F32, least: float, most: float) -> F32:
    """Ranges as logs have them, in m."""
    silent = np.isnan(ranges) | (ranges == 0.0)
    return np.where(silent, 0.0, np.clip(ranges, max(least, _NEAREST), most)).astype(np.float32)


def _fault(stamp: float, what: str) -> BagError:
    return BagError(f"the scan at {stamp:.3f} s cannot be read: {what}")
