"""A run from above as a moving picture, drawn with matplotlib."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import IncompleteResult
from .extras import library
from .messages import Disc, Polygon
from .plot import PERSON, TRUTH, frame, ground

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .result import Result

PERSON_RADIUS_M = 0.25
"""Results do not say how large people are; this is what scenarios have by default."""
ROBOT_RADIUS_M = 0.3
"""Of a robot whose mission is not known."""


def write(result: Result, file: Path, speed: float, frames_per_second: float) -> None:
    """Writes a GIF that ends with the run.

    Raises:
        IncompleteResult: The result has no trace.
        MissingExtra: matplotlib is not installed.
    """
    if not {"time_s", "true_x", "true_y", "true_heading"} <= result.trace.keys():
        raise IncompleteResult("the result has no trace; take that of `curionav.run`, or load a recording (.mcap)")
    animation = library("matplotlib.animation")
    pyplot = library("matplotlib.pyplot")
    figure, ax = pyplot.subplots(figsize=(6.4, 4.8), layout="constrained")
    try:
        ground(ax, result)
        frame(ax, result)
        moving = _Moving.on(ax, result)
        time_s = result.trace["time_s"]
        shown = np.searchsorted(time_s, np.arange(time_s[0], time_s[-1], speed / frames_per_second))
        film = animation.FuncAnimation(figure, moving.show, frames=[*shown, time_s.size - 1], blit=False)
        film.save(file, writer=animation.PillowWriter(fps=frames_per_second), dpi=80)
    finally:
        pyplot.close(figure)


@dataclass(frozen=True)
class _Moving:
    """What moves in the picture."""

    result: Result
    way: Any
    robot: Any
    ahead: Any
    people: Any
    time: Any
    radius: float

    @classmethod
    def on(cls, ax: Axes, result: Result) -> _Moving:
        ellipses = library("matplotlib.collections").EllipseCollection
        radius = _radius(result)
        size = 2.0 * PERSON_RADIUS_M
        discs = {"units": "xy", "offset_transform": ax.transData, "angles": 0.0, "offsets": np.empty((0, 2))}
        people = ax.add_collection(ellipses(widths=size, heights=size, facecolor=PERSON, zorder=3, **discs))
        robot = ax.add_collection(
            ellipses(widths=2.0 * radius, heights=2.0 * radius, facecolor=TRUTH, zorder=5, **discs)
        )
        (way,) = ax.plot([], [], color=TRUTH, lw=1.5, alpha=0.6, zorder=4)
        (ahead,) = ax.plot([], [], color="white", lw=2.0, zorder=6)
        time = ax.text(0.01, 0.98, "", transform=ax.transAxes, va="top", zorder=7)
        return cls(result, way, robot, ahead, people, time, radius)

    def show(self, row: int) -> list[Any]:
        """Sets the picture of one row of the trace."""
        trace, people = self.result.trace, self.result.people
        x, y, heading = (trace[name][row] for name in ("true_x", "true_y", "true_heading"))
        self.way.set_data(trace["true_x"][: row + 1], trace["true_y"][: row + 1])
        self.robot.set_offsets([[x, y]])
        self.ahead.set_data([x, x + self.radius * np.cos(heading)], [y, y + self.radius * np.sin(heading)])
        if people.rows:
            self.people.set_offsets(people.xy[row][people.present[row] == 1])
        self.time.set_text(f"{trace['time_s'][row]:.1f} s")
        return [self.way, self.robot, self.ahead, self.people, self.time]


def _radius(result: Result) -> float:
    """Of the robot's disc, or of the circle around its polygon."""
    if result.order is None:
        return ROBOT_RADIUS_M
    outline = result.order.robot_model.footprint
    if isinstance(outline, Polygon):
        return float(np.hypot(outline.x, outline.y).max())
    assert isinstance(outline, Disc)
    return outline.radius
