"""A run from above, drawn with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .array import F64
from .errors import IncompleteResult
from .extras import library
from .messages import OccupancyGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .result import Result

# The colours of the program's own pictures (``crates/picture/src/palette.rs``), told apart by any colour vision.
TRUTH = "#0072B2"
BELIEF = "#D55E00"
GOAL = "#009E73"
PERSON = "#A6457F"
CONTACT = "#000000"
INK = "#1a1a1a"

MARGIN_M = 1.5
"""Shown around the ways of the robot and the people."""
MARK_EVERY_S = 2.0
"""Dots on the ways, so that one sees who was where at the same time."""
NEAR_M = 1.5
"""People are drawn boldly where the measure TD counts them as too near; in a crowd the rest is a background."""
_OUTCOMES = {"reached": "reached", "timeout": "out of time", "lost": "lost", "no_way": "no way"}


def draw(result: Result, ax: Axes | None = None) -> Axes:
    """Draws a result into ``ax``, or into a new figure; gives the axes.

    Raises:
        IncompleteResult: It has no trace.
        MissingExtra: matplotlib is not installed.
    """
    if not {"time_s", "true_x", "true_y"} <= result.trace.keys():
        raise IncompleteResult("the result has no trace; load the folder of `--out` or a recording (.mcap)")
    pyplot = library("matplotlib.pyplot")
    if ax is None:
        _, ax = pyplot.subplots(figsize=(9.0, 7.0), layout="constrained")
    assert ax is not None
    ground(ax, result)
    _draw_people(ax, result)
    _draw_robot(ax, result)
    _draw_contacts(ax, result)
    frame(ax, result)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, frameon=False)
    return ax


def ground(ax: Axes, result: Result) -> None:
    """Draws what does not move: the map and the goal."""
    if result.grid is not None:
        _draw_map(ax, result.grid)
    _draw_goal(ax, result)


def _draw_map(ax: Axes, grid: OccupancyGrid) -> None:
    """Occupied cells dark, unknown ones grey, free ones white."""
    grey = np.where(grid.cells < 0, 0.82, 1.0 - 0.75 * np.clip(grid.cells, 0, 100) / 100.0)
    size = (grid.width * grid.resolution, grid.height * grid.resolution)
    turned = library("matplotlib.transforms").Affine2D().rotate(grid.origin.heading)
    placed = turned.translate(grid.origin.x, grid.origin.y) + ax.transData
    extent = (0.0, size[0], 0.0, size[1])
    ax.imshow(grey, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=extent, transform=placed, zorder=0)


def _draw_people(ax: Axes, result: Result) -> None:
    """The ways of all people: faint, and bold with dots and an id where they were near the robot."""
    people, trace = result.people, result.trace
    if not people.rows or not people.id.size:
        return
    robot = np.column_stack([trace["true_x"], trace["true_y"]])[:, None]
    xy = np.where(people.present[:, :, None] == 1, people.xy, np.nan).astype(np.float64)
    distance = np.hypot(*np.moveaxis(xy - robot, 2, 0))
    near = np.where((distance < NEAR_M)[:, :, None], xy, np.nan)
    marked = _marked(trace["time_s"])
    faint = min(0.6, 6.0 / people.id.size)
    ax.plot(xy[:, :, 0], xy[:, :, 1], color=PERSON, lw=1.0, alpha=faint, zorder=2)
    lines = ax.plot(near[:, :, 0], near[:, :, 1], color=PERSON, lw=1.5, alpha=0.9, zorder=3)
    lines[0].set_label(f"people, bold within {NEAR_M:g} m")
    ax.scatter(near[marked, :, 0], near[marked, :, 1], s=14, color=PERSON, lw=0.0, zorder=3)
    for index in np.flatnonzero((distance < NEAR_M).any(axis=0)):
        x, y = xy[np.nanargmin(distance[:, index]), index]
        ax.text(x, y, f" {people.id[index]}", color=PERSON, fontsize=8, va="bottom", clip_on=True, zorder=3)


def _draw_robot(ax: Axes, result: Result) -> None:
    trace = result.trace
    x, y, marked = trace["true_x"], trace["true_y"], _marked(trace["time_s"])
    ax.plot(x, y, color=TRUTH, lw=2.0, zorder=4, label=f"robot, dots every {MARK_EVERY_S:g} s")
    ax.scatter(x[marked], y[marked], s=22, color=TRUTH, lw=0.0, zorder=4)
    if {"belief_x", "belief_y"} <= trace.keys():
        ax.plot(
            trace["belief_x"], trace["belief_y"], color=BELIEF, lw=1.3, ls=(0, (4, 2)), zorder=5, label="believed way"
        )
    if x.size:
        ax.plot(x[0], y[0], "o", ms=10, mfc="white", mec=TRUTH, mew=2.0, zorder=6, label="start")


def _draw_goal(ax: Axes, result: Result) -> None:
    order = result.order
    if order is None:
        return
    circle = library("matplotlib.patches").Circle
    ax.add_patch(circle((order.goal_x, order.goal_y), order.goal_tolerance, color=GOAL, alpha=0.25, lw=0.0, zorder=1))
    ax.plot(order.goal_x, order.goal_y, "*", ms=14, color=GOAL, mec="white", mew=0.8, zorder=6, label="goal")


def _draw_contacts(ax: Axes, result: Result) -> None:
    """A cross where the robot was at each contact."""
    times = [contact.time_s for contact in result.contacts]
    if times and result.trace["time_s"].size:
        x, y = (np.interp(times, result.trace["time_s"], result.trace[name]) for name in ("true_x", "true_y"))
        ax.plot(x, y, "X", ms=11, color=CONTACT, mec="white", mew=1.0, ls="none", zorder=7, label="contact")


def frame(ax: Axes, result: Result) -> None:
    """Sets what is shown, axes in metres and the title."""
    corners = _shown(result)
    if corners.size:
        (left, bottom), (right, top) = corners.min(axis=0) - MARGIN_M, corners.max(axis=0) + MARGIN_M
        ax.set_xlim(left, right)
        ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    ax.set_xlabel("x in m")
    ax.set_ylabel("y in m")
    ended = f"{_OUTCOMES[result.outcome]} after {result.measures.time_s:.1f} s"
    ax.set_title(f"{result.scenario}, {result.planner}, seed {result.seed}: {ended}", color=INK, fontsize=11)


def _shown(result: Result) -> F64:
    """Points that must be seen, shape [points, 2]: the robot's ways, its goal, and people that came near it."""
    trace, people = result.trace, result.people
    way = np.column_stack([trace["true_x"], trace["true_y"]])
    if result.order is not None:
        way = np.vstack([way, [result.order.goal_x, result.order.goal_y]])
    if not way.size or not people.rows:
        return way
    low, high = way.min(axis=0) - 2.0 * MARGIN_M, way.max(axis=0) + 2.0 * MARGIN_M
    met: Any = people.xy[people.present == 1]
    return np.vstack([way, met[((met >= low) & (met <= high)).all(axis=1)]])


def _marked(time_s: F64) -> NDArray[np.intp]:
    """The rows nearest to every `MARK_EVERY_S`, but not the first."""
    if not time_s.size:
        return np.empty(0, np.intp)
    wanted = np.arange(time_s[0] + MARK_EVERY_S, time_s[-1] + 1e-9, MARK_EVERY_S)
    return np.searchsorted(time_s, wanted - 1e-9).astype(np.intp)
