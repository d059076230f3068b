"""Heat maps: the density of people (HCCDM, eqs. 16 to 18 of the paper), and what a scan would tell about the position.

The services publish the components of the first and nothing of the second; both are computed here, for the eye only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from curionav.messages import Crowd, LaserModel, OccupancyGrid

FAN = 72
"""Rays from each place, 5 degrees apart: as the CPC evaluator casts them."""
LEAST_INCIDENCE = 0.2
"""Least cosine between beam and wall normal: grazing beams are not taken for arbitrarily telling."""
MAX_PLACES = 12_000
"""Places a field is computed at: about a second for a laser of 5 m on a map of 0.05 m cells."""
OCCUPIED = 50
"""From this many per cent on a cell is a wall."""


@dataclass(frozen=True)
class Field:
    """Numbers on square cells: ``values`` has shape [rows, columns], the row of least y first.

    ``x, y, heading`` is the outer corner of the first cell in the map frame (m, rad), ``cell`` a side (m).
    """

    values: NDArray[np.float64]
    x: float
    y: float
    heading: float
    cell: float


def density(crowds: list[Crowd], x: float, y: float, reach: float = 10.0, cell: float = 0.25) -> Field:
    """People per m^2 within ``reach`` m of a place, now: the mixture the HCCDM evaluator costs candidates with."""
    side = 2 * math.ceil(reach / cell)
    # On a raster of its own, so that the picture does not swim as the robot moves.
    left, bottom = (round(v / cell) * cell - side * cell / 2 for v in (x, y))
    values = np.zeros((side, side))
    if crowds:
        parts = np.array([(c.x, c.y, c.sigma, c.weight) for c in crowds if c.sigma > 0.0]).reshape(-1, 4)
        centres = (np.arange(side) + 0.5) * cell
        along = (left + centres)[None, :] - parts[:, 0, None]
        up = (bottom + centres)[None, :] - parts[:, 1, None]
        variance = parts[:, 2, None]
        peak = (parts[:, 3] / (2.0 * math.pi * parts[:, 2]))[:, None]
        columns = np.exp(-0.5 * along**2 / variance)
        rows = peak * np.exp(-0.5 * up**2 / variance)
        values = rows.T @ columns
    return Field(values, left, bottom, 0.0, cell)


def information(grid: OccupancyGrid, laser: LaserModel, params: dict[str, Any]) -> Field:
    """What one scan tells about the position, 1/m^2, whichever way the robot looks.

    The trace of the position's part of ``C^T N'^-1 C`` (eqs. 8, 10, 11), with the laser's beams spread over the full
    turn.
    ``params`` is the table ``information`` of the planner profile: ``sigma`` (m), ``beams``, ``correlation``.
    """
    sigma, correlation = float(params.get("sigma", 0.2)), max(float(params.get("correlation", 4.0)), 1.0)
    beams = min(float(params.get("beams", 20)), laser.beams)
    weight = beams / (sigma * sigma * correlation) / FAN
    walls = np.asarray(grid.cells) >= OCCUPIED
    block = max(1, math.ceil(math.sqrt(grid.width * grid.height / MAX_PLACES)))
    rows, columns = math.ceil(grid.height / block), math.ceil(grid.width / block)
    iy = np.minimum(np.arange(rows) * block + block // 2, grid.height - 1)
    ix = np.minimum(np.arange(columns) * block + block // 2, grid.width - 1)
    free = np.asarray(grid.cells)[np.ix_(iy, ix)] == 0
    values = np.zeros((rows, columns))
    places = np.argwhere(free)
    if len(places):
        from_x, from_y = ix[places[:, 1]] + 0.5, iy[places[:, 0]] + 0.5
        told = _told(walls, from_x, from_y, laser.range_max / grid.resolution)
        values[free] = weight * told
        # Blocks whose middle is in a wall may reach into the free: they take what is beside them.
        padded = np.pad(values, 1)
        beside = [padded[1 + i : 1 + i + rows, 1 + j : 1 + j + columns] for i in (-1, 0, 1) for j in (-1, 0, 1)]
        values = np.where(free, values, np.max(beside, axis=0))
    origin = grid.origin
    return Field(values, origin.x, origin.y, origin.heading, block * grid.resolution)


def _told(walls: NDArray[np.bool_], x: NDArray[Any], y: NDArray[Any], reach: float) -> NDArray[np.float64]:
    """Sum of ``1 / cos^2`` of incidence over the rays that end in range; positions and range in cells."""
    margin = math.ceil(reach) + 2
    padded = np.pad(walls, margin)
    normal_x, normal_y = _normals(padded)
    flat, width = padded.ravel(), padded.shape[1]
    total = np.zeros(len(x))
    for ray in range(FAN):
        angle = ray * math.tau / FAN
        dx, dy = math.cos(angle), math.sin(angle)
        going = np.arange(len(x))
        for step in range(1, math.ceil(reach) + 1):
            at_x = (x[going] + step * dx).astype(np.int64) + margin
            at_y = (y[going] + step * dy).astype(np.int64) + margin
            cells = at_y * width + at_x
            ended = flat[cells]
            if ended.any():
                hit = cells[ended]
                cosine = np.abs(normal_x[hit] * dx + normal_y[hit] * dy)
                # A post has no normal and is met head-on from every side.
                cosine = np.where((normal_x[hit] == 0.0) & (normal_y[hit] == 0.0), 1.0, cosine)
                total[going[ended]] += 1.0 / np.maximum(cosine, LEAST_INCIDENCE) ** 2
                going = going[~ended]
    return total


def _normals(walls: NDArray[np.bool_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Direction out of the wall at each cell, flat; 0 where there is none."""
    smooth = walls.astype(np.float64)
    for axis in (0, 1):
        smooth = np.mean([np.roll(smooth, shift, axis) for shift in (-2, -1, 0, 1, 2)], axis=0)
    up, along = np.gradient(smooth)
    length = np.hypot(up, along)
    length[length < 1e-6] = np.inf
    return (along / length).ravel(), (up / length).ravel()
