"""A run that is over, as messages: what its result tells of every tick, for those who come too late."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from curionav.messages import Belief, Health, Message, Odometry, People, RunResult

MAX_ROWS = 3000
"""Ticks taken of a run: of a longer one evenly fewer."""
_RADIUS = 0.3
"""Of a person, m: a result does not say."""
_NEEDED = frozenset(
    ("time_s", "belief_x", "belief_y", "belief_heading", "cov_xx", "cov_xy", "cov_yy", "cov_hh", "v", "omega")
)


def messages(result: RunResult) -> Iterator[Message]:
    """Odometry, belief and people of each row, whose index stands for the tick; nothing if columns are missing."""
    trace = result.trace
    column = {name: trace.values[:, i] for i, name in enumerate(trace.columns)}
    if not column.keys() >= _NEEDED:
        return
    for row in range(0, trace.rows, max(1, math.ceil(trace.rows / MAX_ROWS))):
        at = {name: float(values[row]) for name, values in column.items()}
        pose = {"x": at["belief_x"], "y": at["belief_y"], "heading": at["belief_heading"]}
        known = {"stamp": at["time_s"], "v": at["v"], "omega": at["omega"], **pose}
        yield Odometry(tick=row, **known)
        covariance = np.diag([max(at[name], 0.0) for name in ("cov_xx", "cov_yy", "cov_hh")])
        covariance[0, 1] = covariance[1, 0] = at["cov_xy"]
        health = Health(
            outside_weight=min(max(at.get("outside_weight", 0.0), 0.0), 1.0),
            scan_fit=1.0,
            particles=0,
            confidence="sure",
        )
        yield Belief(tick=row, **known, covariance=covariance, health=health)
        if row < trace.people.rows:
            yield _people(result, row, at["time_s"])


def _people(result: RunResult, row: int, stamp: float) -> People:
    """Who was there in a row of the trace, and how they have moved since the row before."""
    people, times = result.trace.people, result.trace.values[:, result.trace.columns.index("time_s")]
    there = np.asarray(people.present[row], bool)
    now = np.asarray(people.xy[row], np.float64)
    velocity = np.zeros_like(now)
    since = stamp - float(times[row - 1]) if row else 0.0
    if since > 0.0:
        both = there & np.asarray(people.present[row - 1], bool)
        velocity[both] = (now[both] - people.xy[row - 1][both]) / since
    return People(
        tick=row, stamp=stamp, frame="map", radius=_RADIUS, id=people.id[there],
        x=now[there, 0], y=now[there, 1], vx=velocity[there, 0], vy=velocity[there, 1],
    )  # fmt: skip
