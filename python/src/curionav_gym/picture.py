"""A world from above, as pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from curionav import World
from curionav.array import F64
from curionav.extras import library

from .facts import Facts

Pixels = NDArray[np.uint8]

_LONGEST = 600
"""Pixels of the longer side, about."""
_WALL, _UNKNOWN, _FLOOR = (40, 40, 40), (150, 150, 150), (245, 245, 245)
_ROBOT, _HEADING, _PERSON, _GOAL, _BEAM = (30, 90, 200), (255, 255, 255), (220, 120, 40), (40, 160, 70), (240, 90, 90)


class Picture:
    """Draws the worlds of one scenario."""

    def __init__(self, world: World) -> None:
        grid, order = world.map, world.order
        self._order = order
        self._per_metre = _LONGEST / (max(grid.width, grid.height) * grid.resolution)
        self._origin = grid.origin
        self._floor = self._background(grid)
        self._image: Any = None

    def _background(self, grid: Any) -> Pixels:
        """The map, its first row below."""
        cells = np.asarray(grid.cells).reshape(grid.height, grid.width)
        height, width = (round(n * grid.resolution * self._per_metre) for n in cells.shape)
        row = np.arange(height) * grid.height // height
        column = np.arange(width) * grid.width // width
        enlarged = cells[row][:, column]
        pixels = np.empty((*enlarged.shape, 3), np.uint8)
        pixels[:] = _FLOOR
        pixels[enlarged > 0] = _WALL
        pixels[enlarged < 0] = _UNKNOWN
        return pixels

    def draw(self, facts: Facts, people: F64, ranges: NDArray[np.float32]) -> Pixels:
        """Robot, people, goal and what the laser meets; of shape [height, width, 3], the map's y upwards."""
        pixels = self._floor.copy()
        order = self._order
        x, y, heading = float(facts.x[0]), float(facts.y[0]), float(facts.heading[0])
        self._disc(pixels, (order.goal_x, order.goal_y), order.goal_tolerance, _GOAL)
        for px, py, radius in people:
            self._disc(pixels, (px, py), radius, _PERSON)
        self._beams(pixels, (x, y, heading), ranges)
        self._disc(pixels, (x, y), 0.3, _ROBOT)
        self._disc(pixels, (x + 0.2 * np.cos(heading), y + 0.2 * np.sin(heading)), 0.08, _HEADING)
        return np.ascontiguousarray(pixels[::-1])

    def _beams(self, pixels: Pixels, pose: tuple[float, float, float], ranges: NDArray[np.float32]) -> None:
        laser = self._order.laser
        x, y, heading = pose
        mount = laser.robot_from_laser
        at_x = x + np.cos(heading) * mount.x - np.sin(heading) * mount.y
        at_y = y + np.sin(heading) * mount.x + np.cos(heading) * mount.y
        bearing = heading + mount.heading + np.linspace(-0.5, 0.5, len(ranges)) * laser.fov
        met = (ranges > 0.0) & (ranges < laser.range_max)
        ends = np.stack([at_x + ranges * np.cos(bearing), at_y + ranges * np.sin(bearing)], axis=1)[met]
        column, row = self._pixel(ends).astype(int).T
        inside = (row >= 0) & (row < pixels.shape[0]) & (column >= 0) & (column < pixels.shape[1])
        pixels[row[inside], column[inside]] = _BEAM

    def _pixel(self, places: F64) -> F64:
        """Column and row of places on the map, of shape [..., 2]."""
        origin = self._origin
        cos, sin = np.cos(origin.heading), np.sin(origin.heading)
        turned: F64 = (places - (origin.x, origin.y)) @ np.array([[cos, -sin], [sin, cos]])
        return turned * self._per_metre

    def _disc(self, pixels: Pixels, place: tuple[float, float], radius: float, colour: tuple[int, int, int]) -> None:
        centre = self._pixel(np.array(place))
        reach = radius * self._per_metre
        low = np.maximum(np.floor(centre - reach).astype(int), 0)
        high = np.ceil(centre + reach).astype(int) + 1
        part = pixels[low[1] : max(high[1], 0), low[0] : max(high[0], 0)]
        row, column = np.ogrid[low[1] : low[1] + part.shape[0], low[0] : low[0] + part.shape[1]]
        part[np.hypot(column + 0.5 - centre[0], row + 0.5 - centre[1]) <= reach] = colour

    def show(self, pixels: Pixels) -> None:
        """Shows them in a window.

        Raises:
            MissingExtra: matplotlib is not installed.
        """
        pyplot = library("matplotlib.pyplot")
        if self._image is None:
            figure, axes = pyplot.subplots()
            axes.set_axis_off()
            self._image = axes.imshow(pixels)
            figure.tight_layout()
        self._image.set_data(pixels)
        pyplot.pause(0.001)

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._image is not None:
            library("matplotlib.pyplot").close(self._image.figure)
            self._image = None
