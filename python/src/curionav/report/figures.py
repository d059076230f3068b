"""Several planners in one scenario: their ways as the paper's Fig. 4, uncertainty and speed as its Fig. 5."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..array import F64
from ..messages import Trace
from .charts import LEFT, Chart, Curve, Scale, grid, label, map_image, outline, steps

MAP_WIDTH = 616.0
MAP_HEIGHT = 758.0
PLOT_WIDTH = 470.0
PLOT_HEIGHT = 240.0
"""That of each of the two plots at least."""
MARGIN_M = 3.0
"""Free space around what is shown of a large map."""
WHOLE_UP_TO = 4.0
"""A map is shown whole while it has at most this many times the area of the part that matters."""
LEAST_UNCERTAINTY = 1e-4
"""The smallest uncertainty that a logarithmic axis tells apart, m2 + rad2."""
TOLERANCE = 1.0
"""How far a drawn line may be from the true one, px; doubled up to `TOLERANCE_MOST` until a picture is small enough."""
TOLERANCE_MOST = 64.0
ROWS = 5
"""Rows of a trace over which a velocity is taken."""
STANDING = 0.05
"""A slower person stands, m/s."""
COLOURS = {
    "curiosity": "#D55E00",
    "cpc-only": "#009E73",
    "cnc-only": "#0072B2",
    "distance-only": "#444444",
    "risk-rrt": "#E69F00",
    "bi-risk-rrt": "#CC79A7",
    "mppi": "#7F3C8D",
    "dwa": "#7A4A1E",
    "hrvo-robot": "#3969AC",
    "transient-goal": "#80BA5A",
    "human-space": "#A5AA99",
    "risk-aware": "#E73F74",
    "curionav": "#00B5D8",
}
"""Colours that people with any colour vision can tell apart (Okabe and Ito 2008, for the paper's planners)."""
REST = ("#56B4E9", "#8c564b", "#7f7fd5", "#b8a200")


def colour(planner: str, index: int) -> str:
    """That of a planner: known ones always have the same, others take what is left in their order."""
    return COLOURS.get(planner, REST[index % len(REST)])


@dataclass(frozen=True)
class Course:
    """What one planner did: the ways of all runs, m, and of the run with the first seed way and trace."""

    ways: list[F64]
    first: F64 | None
    trace: Trace | None


@dataclass(frozen=True)
class View:
    """A part of the map frame on the page: metres to pixels, y upwards to y downwards."""

    left: float
    top: float
    scale: float
    width: float
    height: float

    @classmethod
    def of(cls, scenario: dict[str, Any], courses: Sequence[Course]) -> View:
        """The known part of the map, of a large one what is around the ways."""
        ways = [way for course in courses for way in course.ways]
        points = np.concatenate([*ways, [scenario["start"], scenario["goal"]]])
        low = points.min(axis=0) - MARGIN_M
        high = points.max(axis=0) + MARGIN_M
        corners = _known(scenario["picture"])
        if np.prod(np.ptp(corners, axis=0)) <= WHOLE_UP_TO * np.prod(high - low):
            low, high = corners
        else:
            low, high = np.maximum(corners[0], low), np.minimum(corners[1], high)
        width, height = high - low
        scale = min(MAP_WIDTH / width, MAP_HEIGHT / height)
        return cls(float(low[0]), float(high[1]), float(scale), float(scale * width), float(scale * height))

    def at(self, points: F64) -> F64:
        """Where they are on the page."""
        result: F64 = self.scale * (np.asarray(points) - [self.left, self.top]) * [1.0, -1.0]
        return result


def draw(scenario: dict[str, Any], courses: Sequence[Course], budget: int) -> str:
    """The picture of a scenario as one `svg` element of about `budget` bytes at most."""
    view = View.of(scenario, courses)
    tolerance = TOLERANCE
    drawn = _draw(scenario, courses, view, tolerance)
    while len(drawn) > budget and tolerance < TOLERANCE_MOST:
        tolerance *= 2
        drawn = _draw(scenario, courses, view, tolerance)
    return drawn


def _draw(scenario: dict[str, Any], courses: Sequence[Course], view: View, tolerance: float) -> str:
    goal_x, goal_y = view.at(scenario["goal"])
    start_x, start_y = view.at(scenario["start"])
    goal = f'cx="{goal_x:.0f}" cy="{goal_y:.0f}"'
    start = f'cx="{start_x:.0f}" cy="{start_y:.0f}"'
    height = max(view.height + 24, 2 * PLOT_HEIGHT)
    plots = _over_time(scenario, courses, height / 2, tolerance)
    return (
        f'<svg class="comparison" viewBox="-{LEFT} -4 {view.width + PLOT_WIDTH + 2 * LEFT:.0f} {height + 4:.0f}">'
        f'<svg width="{view.width:.0f}" height="{view.height:.0f}">{_floor(scenario["picture"], view)}'
        f"{_people(scenario, courses, view, tolerance)}"
        f'<circle class="goal" {goal} r="{max(view.scale * scenario["goal_tolerance_m"], 2):.0f}"/>'
        f'<circle class="aim" {goal} r="4"/>'
        f'<circle class="start" {start} r="{max(view.scale * scenario["robot_radius_m"], 2):.0f}"/>'
        f"{_ways(courses, view, tolerance)}</svg>{_axes(view)}"
        f'<g transform="translate({view.width + 10:.0f} 0)">{plots}</g></svg>'
    )


def _known(picture: dict[str, Any]) -> F64:
    """The least and the greatest coordinates of the known cells, of all cells if none is, m."""
    cells = np.array([list(row) for row in picture["rows"]])
    rows, columns = np.nonzero(cells != "?") if (cells != "?").any() else np.nonzero(cells == "?")
    x, y, heading = picture["origin"]
    corners = np.array([(u, v) for u in (columns.min(), columns.max() + 1) for v in (rows.min(), rows.max() + 1)])
    turn = np.array([[math.cos(heading), math.sin(heading)], [-math.sin(heading), math.cos(heading)]])
    placed = [x, y] + picture["cell_m"] * corners @ turn
    result: F64 = np.array([placed.min(axis=0), placed.max(axis=0)])
    return result


def _floor(picture: dict[str, Any], view: View) -> str:
    side = view.scale * picture["cell_m"]
    heading = picture["origin"][2]
    cosine = side * math.cos(heading)
    sine = side * math.sin(heading)
    left, top = view.at(picture["origin"][:2])
    matrix = " ".join(f"{value:.4g}" for value in (cosine, -sine, -sine, -cosine))
    size = f'width="{len(picture["rows"][0])}" height="{len(picture["rows"])}"'
    place = f'transform="matrix({matrix} {left:.1f} {top:.1f})"'
    return f'<image class="floor" {size} {place} href="{map_image(picture["rows"])}"/>'


def _axes(view: View) -> str:
    right = view.left + view.width / view.scale
    bottom = view.top - view.height / view.scale
    apart = 70.0
    xs = steps(view.left, right, max(int(view.width / apart), 1))
    ys = steps(bottom, view.top, max(int(view.height / apart), 1))
    across = [(view.scale * (x - view.left), label(x)) for x in xs]
    up = [(view.scale * (view.top - y), label(y)) for y in ys]
    return grid(across, up, view.width, view.height)


def _ways(courses: Sequence[Course], view: View, tolerance: float) -> str:
    """Those of the first planner on top; the runs with the first seed strong."""
    faint = ""
    strong = ""
    for planner, course in reversed(list(enumerate(courses))):
        drawn = "".join(outline(view.at(way), tolerance) for way in course.ways)
        faint += f'<path class="f c{planner}" d="{drawn}"/>'
        if course.first is not None:
            strong += f'<path class="w c{planner}" d="{outline(view.at(course.first), tolerance)}"/>'
    return faint + strong


def _people(scenario: dict[str, Any], courses: Sequence[Course], view: View, tolerance: float) -> str:
    """The people's ways in the run of the first planner that is shown, and where they walk at its start and its end."""
    trace = next((course.trace for course in courses if course.trace is not None), None)
    if trace is None:
        return ""
    time = _column(trace, "time_s")
    size = max(view.scale * scenario["person_radius_m"], 3.0)
    ways = ""
    starts = ""
    ends = ""
    for person in range(len(trace.people.id)):
        rows = np.flatnonzero(trace.people.present[:, person])
        if len(rows) == 0:
            continue
        at = view.at(trace.people.xy[:, person].astype(float))
        stretches = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        ways += "".join(outline(at[stretch], 2 * tolerance) for stretch in stretches)
        first = stretches[0][[0, min(ROWS, len(stretches[0]) - 1)]]
        last = stretches[-1][[max(-ROWS - 1, -len(stretches[-1])), -1]]
        starts += _walker(at[first], at[first[0]], time[first], view.scale, size)
        ends += _walker(at[last], at[last[1]], time[last], view.scale, size)
    return f'<path class="track" d="{ways}"/><path class="then" d="{starts}"/><path class="now" d="{ends}"/>'


def _walker(moved: F64, place: F64, time: F64, scale: float, size: float) -> str:
    """A triangle that points where a person walks; a square for one who stands."""
    way = moved[1] - moved[0]
    length = float(np.hypot(*way))
    if length <= STANDING * scale * float(time[1] - time[0]):
        return f"M{place[0] - size / 2:.0f} {place[1] - size / 2:.0f}h{size:.0f}v{size:.0f}h-{size:.0f}z"
    along = 1.5 * size * way / length
    across = np.array([-along[1], along[0]])
    corners = np.array([place + along, place - 0.6 * along + 0.55 * across, place - 0.6 * along - 0.55 * across])
    return outline(corners) + "z"


def _column(trace: Trace, name: str) -> F64:
    result: F64 = trace.values[:, trace.columns.index(name)]
    return result


def _over_time(scenario: dict[str, Any], courses: Sequence[Course], height: float, tolerance: float) -> str:
    uncertainty = []
    speed = []
    end = 1.0
    for planner, course in enumerate(courses):
        if course.trace is None or not course.trace.rows:
            continue
        time = _column(course.trace, "time_s")
        traced = sum(_column(course.trace, name) for name in ("cov_xx", "cov_yy", "cov_hh"))
        uncertainty.append(Curve(planner, np.column_stack([time, np.maximum(traced, LEAST_UNCERTAINTY)])))
        speed.append(Curve(planner, np.column_stack([time, _column(course.trace, "v")])))
        end = max(end, float(time[-1]))
    threshold = scenario["threshold"]
    least, most = _range(uncertainty, threshold, threshold)
    slowest, fastest = _range(speed, 0.0, 0.5)
    upper = Chart(
        title="Trace of the covariance of the estimated pose, m² + rad²",
        scale=Scale(least / 1.3, most * 1.5, is_logarithmic=True),
        across=end,
        curves=uncertainty,
        unit="s",
        levels={threshold: "Thr\u2032"},
    )
    lower = Chart("Speed, m/s", Scale(slowest * 1.08, fastest * 1.12), end, speed, unit="s")
    return (
        upper.draw(PLOT_WIDTH, height, tolerance)
        + f'<g transform="translate(0 {height:.0f})">{lower.draw(PLOT_WIDTH, height, tolerance)}</g>'
    )


def _range(curves: Sequence[Curve], least: float, most: float) -> tuple[float, float]:
    """The least and the greatest of the given two values and of those of all curves."""
    for curve in curves:
        least = min(least, float(curve.points[:, 1].min()))
        most = max(most, float(curve.points[:, 1].max()))
    return least, most
