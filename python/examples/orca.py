"""ORCA as a planner of one's own: ``curionav bench rooms --planners curionav,python/examples/orca.py:planner``.

Optimal reciprocal collision avoidance (van den Berg, Guy, Lin and Manocha, 2011), written out. Every person forbids a
half plane of velocities, of which the robot takes half the blame; walls forbid half planes alone. Taken is the allowed
velocity nearest to that along the way, or the one that violates the half planes least. Vectors are complex numbers.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

import curionav
from curionav.planner import Situation, Task

HORIZON = 3.0  # seconds without a contact with people
WALL_HORIZON = 1.5  # and with walls
NEAR = 6.0  # people farther off are not looked at, metres
LEAD = 0.2  # the point that is steered, metres ahead of the axle: it can go in any direction
ROOM = 0.1  # kept to people beside the bodies, metres
AHEAD = 1.0  # how far along its way the robot aims, metres

Line = tuple[complex, complex]
"""A half plane: a point of its edge and the direction of the edge; allowed is what lies to the left."""


def dot(a: complex, b: complex) -> float:
    """The product of their lengths and the cosine between them."""
    return (a.conjugate() * b).real


def det(a: complex, b: complex) -> float:
    """Positive if ``b`` points to the left of ``a``."""
    return (a.conjugate() * b).imag


def half_plane(offset: complex, mine: complex, other: complex, radius: float) -> Line:
    """What a person at ``offset`` forbids who walks at ``other``; the sum of both radii is ``radius``."""
    relative, distance = mine - other, abs(offset)
    # Bodies that touch part within a cycle.
    horizon = HORIZON if distance > radius else 0.3
    w, touch = relative - offset / horizon, radius / horizon
    if distance <= radius or (dot(w, offset) < 0.0 and dot(w, offset) ** 2 > radius**2 * abs(w) ** 2):
        unit = w / abs(w) if abs(w) > 1e-9 else -offset / max(distance, 1e-9)
        return mine + 0.5 * (touch - abs(w)) * unit, -1j * unit
    leg = math.sqrt(distance**2 - radius**2)
    side = 1.0 if det(offset, w) > 0.0 else -1.0
    direction = side * offset * complex(leg, side * radius) / distance**2
    return mine + 0.5 * (dot(relative, direction) * direction - relative), direction


def along(line: Line, before: list[Line], speed: float, goal: complex, is_direction: bool) -> complex | None:
    """The best velocity on the edge of ``line`` that ``before`` allow; none if they allow none there."""
    point, direction = line
    middle = dot(point, direction)
    room = middle**2 + speed**2 - abs(point) ** 2
    if room < 0.0:
        return None
    low, high = -middle - math.sqrt(room), -middle + math.sqrt(room)
    for other, its in before:
        denominator, numerator = det(direction, its), det(its, point - other)
        if abs(denominator) < 1e-9:
            if numerator < 0.0:
                return None
        elif denominator > 0.0:
            high = min(high, numerator / denominator)
        else:
            low = max(low, numerator / denominator)
        if low > high:
            return None
    if is_direction:
        return point + (high if dot(goal, direction) > 0.0 else low) * direction
    return point + min(max(dot(direction, goal - point), low), high) * direction


def best(lines: list[Line], speed: float, goal: complex, is_direction: bool) -> tuple[int, complex]:
    """The velocity that the half planes allow, and how many of them could be kept."""
    found = goal * speed if is_direction else goal * min(1.0, speed / max(abs(goal), 1e-9))
    for index, (point, direction) in enumerate(lines):
        if det(direction, point - found) > 0.0:
            better = along((point, direction), lines[:index], speed, goal, is_direction)
            if better is None:
                return index, found
            found = better
    return len(lines), found


def least_violated(lines: list[Line], walls: int, begin: int, speed: float, found: complex) -> complex:
    """The velocity that violates those of people least and keeps the first ``walls``."""
    distance = 0.0
    for index in range(max(begin, walls), len(lines)):
        point, direction = lines[index]
        if det(direction, point - found) <= distance:
            continue
        projected = lines[:walls]
        for other, its in lines[walls:index]:
            turn = det(direction, its)
            if abs(turn) > 1e-9:
                corner = point + det(its, point - other) / turn * direction
            elif dot(direction, its) > 0.0:
                continue
            else:
                corner = 0.5 * (point + other)
            projected.append((corner, (its - direction) / abs(its - direction)))
        kept, nearer = best(projected, speed, 1j * direction, True)
        if kept == len(projected):
            found = nearer
        distance = det(direction, point - found)
    return found


class Orca:
    """One agent among people who all avoid each other."""

    def reset(self, task: Task) -> None:
        """Where walls are: the middles of all cells that are not free and have a free neighbour."""
        x, y, heading = task.map.origin
        taken = np.asarray(task.map.cells) != 0
        inner = taken.copy()
        inner[1:-1, 1:-1] &= taken[2:, 1:-1] & taken[:-2, 1:-1] & taken[1:-1, 2:] & taken[1:-1, :-2]
        rows, columns = np.nonzero(taken & ~inner)
        cells = (columns + 0.5 + 1j * (rows + 0.5)) * task.map.resolution
        self.walls = x + 1j * y + cells * cmath.exp(1j * heading)

    def __call__(self, known: Situation) -> tuple[float, float]:
        """Speed and turn rate that lead the steered point at the chosen velocity."""
        belief, task = known.belief, known.task
        ahead = cmath.exp(1j * belief.heading)
        here = belief.x + 1j * belief.y + LEAD * ahead
        mine = belief.v * ahead + belief.omega * LEAD * 1j * ahead
        radius = task.footprint.radius + LEAD
        walls = np.concatenate([self.walls, known.obstacles @ [1.0, 1j]]) - here
        walls = walls[np.abs(walls) < radius + WALL_HORIZON * task.limits.v_max]
        lines = []
        # The nearest in each of 24 directions; a wall does not yield, and forbids to come nearer than the body.
        sectors = (np.angle(walls) * 12.0 / np.pi).astype(int)
        for sector in np.unique(sectors):
            wall = min(walls[sectors == sector], key=abs)
            gap, unit = abs(wall) - task.footprint.radius, wall / abs(wall)
            lines.append((gap / WALL_HORIZON * unit, 1j * unit))
        count = len(lines)
        for place, velocity in zip(known.people.xy @ [1.0, 1j], known.people.velocity @ [1.0, 1j], strict=True):
            if abs(place - here) < NEAR:
                both = radius + known.people.radius + ROOM
                lines.append(half_plane(place - here, mine, velocity, both))
        aim = known.way[min(int(AHEAD / 0.25), len(known.way) - 1)] @ [1.0, 1j] if len(known.way) else here
        speed = min(task.limits.v_max, math.sqrt(task.limits.a_max * (known.to_go or 0.0)))
        wished = (aim - here) / max(abs(aim - here), 0.3) * speed
        kept, chosen = best(lines, task.limits.v_max, wished, False)
        if kept < len(lines):
            chosen = least_violated(lines, count, kept, task.limits.v_max, chosen)
        return dot(ahead, chosen), det(ahead, chosen) / LEAD


planner = curionav.planner("orca", map=True)(Orca)
unchecked = curionav.planner("orca-unchecked", map=True, check="driver")(Orca)
