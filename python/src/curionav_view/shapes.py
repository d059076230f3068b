"""Messages as shapes: map frame, metres, z upwards; what lies flat is stacked by height."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from curionav.messages import (
    Belief,
    CycleReport,
    Decision,
    Disc,
    OccupancyGrid,
    Particles,
    People,
    RobotModel,
    Scan,
)
from curionav.words import UNSEEN, say

from . import colours
from .heat import OCCUPIED, Field

HEIGHT_INFORMATION, HEIGHT_DENSITY, HEIGHT_CANDIDATES, HEIGHT_DECISION = 0.01, 0.03, 0.06, 0.12
HEIGHT_RINGS = 0.09
PERSON_HEIGHT = 1.7
SURE = 0.95
"""From this probability on, what is followed needs no label to say that it is a person."""
ROBOT_HEIGHT = 0.5
OBSTACLE_HEIGHT = 0.5
HEIGHT_PARTICLES, HEIGHT_ELLIPSE = ROBOT_HEIGHT + 0.02, ROBOT_HEIGHT + 0.05
"""Above the robot, which would hide a belief that is narrower than itself."""
NEAR = 1.5
"""Closer than this to the robot's centre a person is shown as too near, m, unless the profile says otherwise."""
MAX_DRAWN = 512
"""Candidates drawn: more are thinned out evenly by rank."""
MAX_PARTICLES = 1000
"""Particles drawn: of more an even choice."""
MAX_WAY = 200
"""Points of the true way at one moment."""
SIGMAS = 2.4477
"""A Gaussian position is within the ellipse of so many standard deviations with 95 %."""
DENSE = 0.32
"""People per m^2 at the top of the ramp: three people at one place."""
_CIRCLE = np.linspace(0.0, math.tau, 49)


def _flat(x: Any, y: Any, z: float) -> NDArray[np.float32]:
    """Points on one height, shape [..., 3]."""
    x, y = np.asarray(x), np.asarray(y)
    points = np.empty((*x.shape, 3), np.float32)
    points[..., 0], points[..., 1], points[..., 2] = x, y, z
    return points


def circles(x: Any, y: Any, radius: Any, z: float) -> NDArray[np.float32]:
    """Closed strips, shape [circles, points, 3]."""
    x, y, radius = (np.atleast_1d(np.asarray(v, np.float64))[:, None] for v in (x, y, radius))
    return _flat(x + radius * np.cos(_CIRCLE), y + radius * np.sin(_CIRCLE), z)


def _raster(pixels: colours.Colours, field: tuple[float, float, float, float], z: float, solid: bool) -> rr.GridMap:
    """An image whose first row is that of least y; ``field`` is (x, y, heading, cell) of its corner."""
    x, y, heading, cell = field
    rows, columns = pixels.shape[:2]
    return rr.GridMap(
        # Images begin at the top.
        data=np.ascontiguousarray(pixels[::-1]).tobytes(),
        format=rr.components.ImageFormat(width=columns, height=rows, color_model="RGBA", channel_datatype="U8"),
        cell_size=cell,
        translation=[x, y, z],
        rotation_axis_angle=rr.components.RotationAxisAngle([0.0, 0.0, 1.0], heading),
        # At 1 it covers what lies below, whatever the opacity of its colours.
        opacity=1.0 if solid else 0.99,
    )


def _plan(grid: OccupancyGrid) -> colours.Colours:
    cells = np.asarray(grid.cells)
    palette = np.array([colours.UNKNOWN, colours.FLOOR, colours.WALL], np.uint8)
    pixels = palette[np.where(cells < 0, 0, np.where(cells >= OCCUPIED, 2, 1))]
    if grid.limits is not None:
        limits = np.asarray(grid.limits)
        free = (cells >= 0) & (cells < OCCUPIED)
        share = limits[..., None] / 100.0
        tint = share * np.array(colours.FLOOR) + (1.0 - share) * np.array(colours.SLOW)
        pixels = np.where((free & (limits < 100))[..., None], tint.round().astype(np.uint8), pixels)
        pixels[free & (limits == 0)] = colours.KEEPOUT
    return pixels


def floor(grid: OccupancyGrid) -> rr.GridMap:
    """The map: free, wall, unknown, and its zones."""
    return _raster(_plan(grid), (grid.origin.x, grid.origin.y, grid.origin.heading, grid.resolution), 0.0, True)


def information(grid: OccupancyGrid, field: Field) -> rr.GridMap:
    """The map with what a scan tells.

    On a scale of roots: a wall across the room counts, and a corner does not outshine all.
    """
    values = field.values
    top = float(np.quantile(values[values > 0.0], 0.95)) if (values > 0.0).any() else 1.0
    tint = colours.information(np.sqrt(np.clip(values / top, 0.0, 1.0)))
    block = round(field.cell / grid.resolution)
    tint = tint.repeat(block, axis=0).repeat(block, axis=1)[: grid.height, : grid.width]
    plan = _plan(grid)
    free = (np.asarray(grid.cells) >= 0) & (np.asarray(grid.cells) < OCCUPIED)
    share = tint[free][:, 3:].astype(np.float64) / 255.0
    plan[free, :3] = ((1.0 - share) * plan[free][:, :3] + share * tint[free][:, :3]).astype(np.uint8)
    at = (grid.origin.x, grid.origin.y, grid.origin.heading, grid.resolution)
    return _raster(plan, at, HEIGHT_INFORMATION, True)


def density(field: Field) -> rr.GridMap:
    """The HCCDM now."""
    pixels = colours.density(np.sqrt(np.clip(field.values / DENSE, 0.0, 1.0)))
    # Rerun takes colours as multiplied by their opacity already.
    alpha = pixels[..., 3:].astype(np.uint16)
    pixels[..., :3] = pixels[..., :3] * alpha // 255
    return _raster(pixels, (field.x, field.y, field.heading, field.cell), HEIGHT_DENSITY, False)


def body(model: RobotModel) -> rr.Cylinders3D | rr.Mesh3D:
    """The robot in its own frame."""
    outline = model.footprint
    if isinstance(outline, Disc):
        return rr.Cylinders3D(
            lengths=[ROBOT_HEIGHT],
            radii=[outline.radius],
            centers=[[0.0, 0.0, ROBOT_HEIGHT / 2]],
            colors=[colours.ROBOT],
            fill_mode=rr.components.FillMode.Solid,
        )
    x, y = np.asarray(outline.x), np.asarray(outline.y)  # type: ignore[attr-defined]
    count = len(x)
    lower, upper = _flat(x, y, 0.0), _flat(x, y, ROBOT_HEIGHT)
    sides = [(i, (i + 1) % count) for i in range(count)]
    walls = [t for i, j in sides for t in ((i, j, count + j), (i, count + j, count + i))]
    # A fan closes the top of a convex outline; one that is not looks a little fuller than it is.
    top = [(count, count + i, count + i + 1) for i in range(1, count - 1)]
    return rr.Mesh3D(
        vertex_positions=np.concatenate([lower, upper]),
        triangle_indices=walls + top,
        vertex_colors=np.tile(np.array(colours.ROBOT, np.uint8), (2 * count, 1)),
    )


def scan(message: Scan) -> rr.Points3D:
    """The beams that hit something, in the robot's frame."""
    hit = message.met()
    ranges = np.maximum(np.asarray(message.ranges), message.range_min or 0.0)
    angles = message.laser.heading + message.angle_min + message.angle_increment * np.flatnonzero(hit)
    x = message.laser.x + ranges[hit] * np.cos(angles)
    y = message.laser.y + ranges[hit] * np.sin(angles)
    return rr.Points3D(_flat(x, y, 0.25), colors=[colours.SCAN], radii=[0.05])


def _ring(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of the ellipse that holds 95 % of a Gaussian around the origin, shape [2, points]."""
    values, vectors = np.linalg.eigh(covariance)
    half = SIGMAS * np.sqrt(np.maximum(values, 0.0))
    points: NDArray[np.float64] = vectors @ (half[:, None] * np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)]))
    return points


def ellipse(belief: Belief) -> rr.LineStrips3D:
    """Where the robot believes it is with 95 %: the position's part of the covariance."""
    points = _ring(np.asarray(belief.covariance)[:2, :2])
    strip = _flat(belief.x + points[0], belief.y + points[1], HEIGHT_ELLIPSE)
    return rr.LineStrips3D([strip], colors=[colours.BELIEF], radii=[0.045])


def particles(message: Particles, belief: Belief) -> rr.Points3D:
    """Where the robot may be, seen from where it believes it is: a dot each, the likelier the larger and brighter."""
    stride = max(1, math.ceil(len(message.x) / MAX_PARTICLES))
    x, y = message.x[::stride] - belief.x, message.y[::stride] - belief.y
    c, s = math.cos(belief.heading), math.sin(belief.heading)
    weight = np.asarray(message.weight[::stride], np.float64)
    share = np.sqrt(weight / max(float(weight.max(initial=0.0)), 1e-12))
    shade = np.tile(np.array(colours.PARTICLE, np.uint8), (len(share), 1))
    shade[:, 3] = (colours.PARTICLE[3] * (0.4 + 0.6 * share)).astype(np.uint8)
    return rr.Points3D(_flat(c * x + s * y, c * y - s * x, HEIGHT_PARTICLES), colors=shade, radii=0.02 + 0.03 * share)


def in_map(people: People, belief: Belief) -> tuple[NDArray[np.float64], ...]:
    """x, y, vx, vy of people in the map frame, also of those seen from the robot."""
    x, y, vx, vy = people.x, people.y, people.vx, people.vy
    if people.frame == "map":
        return x, y, vx, vy
    c, s = math.cos(belief.heading), math.sin(belief.heading)
    return belief.x + c * x - s * y, belief.y + s * x + c * y, c * vx - s * vy, s * vx + c * vy


def bodies(x: Any, y: Any, radius: float, too_near: NDArray[np.bool_]) -> rr.Capsules3D:
    """People, those too near to the robot in another colour."""
    count = len(x)
    radius = max(radius, 0.05)
    palette = np.array([colours.PERSON, colours.PERSON_NEAR], np.uint8)
    return rr.Capsules3D(
        lengths=np.full(count, PERSON_HEIGHT - 2 * radius, np.float32),
        radii=np.full(count, radius, np.float32),
        translations=_flat(x, y, radius),
        colors=palette[too_near.astype(np.intp)],
        fill_mode=rr.components.FillMode.Solid,
    )


def unseen(report: CycleReport) -> rr.Capsules3D:
    """What only the driver sees and the scene takes for a person."""
    people = report.scene.people
    found = people.id == UNSEEN
    radius = max(people.radius, 0.05)
    return rr.Capsules3D(
        lengths=np.full(int(found.sum()), PERSON_HEIGHT - 2 * radius, np.float32),
        radii=np.full(int(found.sum()), radius, np.float32),
        translations=_flat(people.x[found], people.y[found], radius),
        colors=[colours.UNSEEN],
        labels=[say("person", "unseen")] * int(found.sum()),
        show_labels=True,
        fill_mode=rr.components.FillMode.DenseWireframe,
    )


def velocities(x: Any, y: Any, vx: Any, vy: Any) -> rr.Arrows3D:
    """Where people will be in a second and a half."""
    return rr.Arrows3D(
        vectors=1.5 * _flat(vx, vy, 0.0), origins=_flat(x, y, HEIGHT_DECISION), colors=[colours.PERSON], radii=[0.035]
    )


def people_ellipses(people: People, belief: Belief) -> rr.LineStrips3D:
    """Where tracked people are with 95 %; labels say for how long they have been hidden, and what may be none."""
    covariance = people.position_covariance
    if covariance is None:
        return rr.LineStrips3D([])
    x, y, _, _ = in_map(people, belief)
    turn = belief.heading if people.frame == "robot" else 0.0
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    strips = [
        _flat(x[i] + points[0], y[i] + points[1], HEIGHT_ELLIPSE)
        for i, (xx, xy, yy) in enumerate(covariance)
        for points in [rotation @ _ring(np.array([[xx, xy], [xy, yy]]))]
    ]
    ages = np.zeros(len(x)) if people.age is None else people.age
    sure = np.ones(len(x)) if people.probability is None else people.probability
    labels = [_of_track(float(age), float(probability)) for age, probability in zip(ages, sure, strict=True)]
    return rr.LineStrips3D(strips, colors=[colours.PERSON], radii=[0.02], labels=labels, show_labels=True)


def _of_track(age: float, probability: float) -> str:
    hidden = [f"not seen for {age:.1f} s"] if age > 0.0 else []
    doubtful = [f"a person with {100.0 * probability:.0f} %"] if probability < SURE else []
    return ", ".join(hidden + doubtful)


def obstacles(report: CycleReport) -> rr.Boxes3D | rr.Clear:
    """What the robot has seen and is on no map."""
    cells = report.obstacles
    if cells is None:
        return rr.Clear(recursive=False)
    half = 0.5 * cells.side
    turn = rr.RotationAxisAngle([0.0, 0.0, 1.0], rr.Angle(rad=cells.heading))
    return rr.Boxes3D(
        centers=_flat(cells.x, cells.y, 0.5 * OBSTACLE_HEIGHT),
        half_sizes=[[half, half, 0.5 * OBSTACLE_HEIGHT]],
        rotation_axis_angles=[turn],
        colors=[colours.OBSTACLE],
        fill_mode="solid",
    )


def crowds(report: CycleReport) -> rr.LineStrips3D:
    """The components of the HCCDM: a ring of one standard deviation around each."""
    found = report.crowds
    strips = circles([c.x for c in found], [c.y for c in found], [math.sqrt(c.sigma) for c in found], HEIGHT_RINGS)
    labels = [f"crowd of {c.members}" if c.members > 1 else "" for c in found]
    return rr.LineStrips3D(strips, colors=[colours.CROWD], radii=[0.03], labels=labels, show_labels=False)


def _drawn(order: NDArray[np.intp]) -> NDArray[np.intp]:
    """The candidates of an order that are drawn, the last of them on top."""
    if len(order) <= MAX_DRAWN:
        return order
    return order[np.unique(np.linspace(0, len(order) - 1, MAX_DRAWN).round().astype(np.intp))]


def _kept(report: CycleReport) -> NDArray[np.bool_]:
    """Whether a candidate has a cost and was not rejected."""
    return np.array([why is None for why in report.rejected], bool) & ~np.isnan(report.total)


def candidates(report: CycleReport) -> rr.LineStrips3D:
    """Those that were compared, by cost: the cheapest bright and on top, the dearest dark."""
    scored = np.flatnonzero(_kept(report))
    order = _drawn(scored[np.argsort(-report.total[scored], kind="stable")])
    cost = report.total[order]
    share = np.zeros(len(order))
    if len(order):
        # One very expensive candidate would make all others look alike.
        low, high = float(cost.min()), float(np.quantile(cost, 0.9))
        share = (cost - low) / max(high - low, 1e-9)
    strips = _flat(report.candidates.x[order], report.candidates.y[order], HEIGHT_CANDIDATES)
    strips[..., 2] += 0.03 * (1.0 - np.clip(share, 0.0, 1.0))[:, None]
    return rr.LineStrips3D(strips, colors=colours.cost(share), radii=[0.03])


def by_term(report: CycleReport, term: str) -> rr.LineStrips3D:
    """All candidates that a term has scored, by its raw cost: the least bright and on top, the greatest dark."""
    found = next((each for each in report.terms if each.term == term), None)
    if found is None:
        return rr.LineStrips3D([])
    scored = np.flatnonzero(~np.isnan(found.raw))
    order = _drawn(scored[np.argsort(-found.raw[scored], kind="stable")])
    raw = found.raw[order]
    low = float(raw.min(initial=math.inf))
    share = (raw - low) / max(float(raw.max(initial=0.0)) - low, 1e-9)
    strips = _flat(report.candidates.x[order], report.candidates.y[order], HEIGHT_CANDIDATES + 0.04)
    labels = [f"{mean:.2f}" for mean in raw / max(report.candidates.steps, 1)]
    return rr.LineStrips3D(strips, colors=colours.cost(share), radii=[0.035], labels=labels, show_labels=False)


def rejected(report: CycleReport) -> rr.LineStrips3D:
    """Those that were rejected or have no cost."""
    order = _drawn(np.flatnonzero(~_kept(report)))
    strips = _flat(report.candidates.x[order], report.candidates.y[order], HEIGHT_CANDIDATES - 0.02)
    return rr.LineStrips3D(strips, colors=[colours.REJECTED], radii=[0.012])


def decided(decision: Decision, belief: Belief | None) -> rr.LineStrips3D:
    """The trajectory that is driven, thick; nothing while the robot stops."""
    if decision.action == "stop" or len(decision.x) == 0:
        return rr.LineStrips3D([])
    x, y = np.asarray(decision.x), np.asarray(decision.y)
    if belief is not None and decision.action == "follow":
        x, y = np.append(belief.x, x), np.append(belief.y, y)
    strip = _flat(x, y, HEIGHT_DECISION)
    return rr.LineStrips3D([strip], colors=[colours.ACTIONS[decision.action]], radii=[0.075])


def trail(points: NDArray[np.float64], colour: tuple[int, int, int, int], radius: float = 0.03) -> rr.LineStrips3D:
    """A way that was taken; ``points`` has shape [count, 2]."""
    strip = _flat(points[:, 0], points[:, 1], HEIGHT_CANDIDATES)
    return rr.LineStrips3D([strip] if len(strip) > 1 else [], colors=[colour], radii=[radius])


def ghosts(x: Any, y: Any, model: RobotModel | None) -> rr.ComponentColumnList:
    """Outline of the robot where it really was, moment by moment."""
    outline = model.footprint if model is not None else None
    count = len(x)
    return rr.Cylinders3D.columns(
        centers=_flat(x, y, ROBOT_HEIGHT / 2),
        lengths=np.full(count, ROBOT_HEIGHT, np.float32),
        radii=np.full(count, outline.radius if isinstance(outline, Disc) else 0.3, np.float32),
        line_radii=np.full(count, 0.015, np.float32),
        fill_mode=[rr.components.FillMode.MajorWireframe] * count,
        colors=np.tile(np.array(colours.TRUTH, np.uint8), (count, 1)),
    )


def ways(points: NDArray[np.float64]) -> list[NDArray[np.float32]]:
    """For each moment the way up to then, thinned out; ``points`` has shape [moments, 2]."""
    strip = _flat(points[:, 0], points[:, 1], HEIGHT_CANDIDATES)
    stride = math.ceil(len(strip) / MAX_WAY)
    return [np.concatenate([strip[: i + 1 : stride], strip[i : i + 1]]) for i in range(len(strip))]


def goal(x: float, y: float, tolerance: float) -> rr.LineStrips3D:
    """A ring as wide as the tolerance, and a pole to find it by."""
    pole = np.array([[x, y, 0.0], [x, y, 2.5]], np.float32)
    ring = circles(x, y, tolerance, HEIGHT_RINGS)[0]
    return rr.LineStrips3D([ring, pole], colors=[colours.GOAL], radii=[0.06], labels=["goal"], show_labels=False)


def comfort(radius: float) -> rr.LineStrips3D:
    """The distance people are to be left, around the robot, in its own frame."""
    return rr.LineStrips3D(circles(0.0, 0.0, radius, HEIGHT_RINGS), colors=[colours.COMFORT], radii=[0.02])
