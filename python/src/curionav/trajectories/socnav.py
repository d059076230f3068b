"""SocNavData's files: one JSON object per trajectory, with map, walls, and a sequence of robot, goal and people.

As the dataset's ``schema.json`` says (the form of 2026, with ``length`` in shapes). Its tools draw the first row of
``grid.data`` at the top, so rows go from the greatest y down; its metrics take distances from ``walls`` alone.
"""

from __future__ import annotations

import itertools
import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array import F64
from ..errors import FileError, IncompleteResult
from ..messages import Disc, Footprint, MissionOrder, OccupancyGrid, Polygon
from ..result import Result
from .rows import MAX_ID, lines_of, number, write
from .tracks import Tracks, from_result

OCCUPIED = 50
"""Per cent from which a cell counts as occupied."""
ANY_HEADING_RAD = math.pi
"""Threshold of a goal at which any heading will do."""
HEADING_RAD = 0.35
"""Threshold of a goal with a heading, some 20 degrees: what makers of such files take where nothing else is known."""


def write_socnav(result: Result, file: str | os.PathLike[str], context: str = "") -> None:
    """Writes a run, with true poses. Objects of the scenario that are on no map are not in a result, so not in it.

    People look where they walk, as results hold no headings of people.

    Args:
        result: From a recording: mission and map are needed.
        file: What to write.
        context: What the robot is about, in English, for those who rate it (``metadata``).

    Raises:
        IncompleteResult: The result has no trace, mission or map.
        FileError: The file cannot be written.
    """
    if result.order is None or result.grid is None or "true_heading" not in result.trace:
        raise IncompleteResult("the result has no mission and map; load a recording of `curionav run --record` (.mcap)")
    tracks, trace = from_result(result), result.trace
    goal, shape, people = _goal(result.order), _shape(result.order.robot_model.footprint), _people(tracks)
    sequence = [
        {
            "timestamp": float(trace["time_s"][frame]),
            "robot": {
                "shape": shape,
                "x": float(trace["true_x"][frame]),
                "y": float(trace["true_y"][frame]),
                "angle": float(trace["true_heading"][frame]),
                "speed_x": float(trace["v"][frame]),
                "speed_y": 0.0,
                "speed_a": float(trace["omega"][frame]),
            },
            "goal": goal,
            "people": people.get(frame, []),
            "objects": [],
        }
        for frame in range(len(trace["time_s"]))
    ]
    data = {"metadata": context, "grid": _grid(result.grid), "walls": walls(result.grid).tolist(), "sequence": sequence}
    write(Path(file), [json.dumps(data)])


def _goal(order: MissionOrder) -> dict[str, Any]:
    any_heading = order.goal_heading is None
    return {
        "type": "go-to",
        "human": None,
        "x": order.goal_x,
        "y": order.goal_y,
        "angle": order.goal_heading or 0.0,
        "pos_threshold": order.goal_tolerance,
        "angle_threshold": ANY_HEADING_RAD if any_heading else HEADING_RAD,
    }


def _shape(footprint: Footprint) -> dict[str, Any]:
    """A disc, or the rectangle around a polygon: width across, length along the heading."""
    if isinstance(footprint, Disc):
        return {"type": "circle", "width": 2.0 * footprint.radius, "length": 2.0 * footprint.radius}
    assert isinstance(footprint, Polygon)
    return {"type": "rectangle", "width": float(np.ptp(footprint.y)), "length": float(np.ptp(footprint.x))}


def _people(tracks: Tracks) -> dict[int, list[dict[str, Any]]]:
    """The people of each frame."""
    people = tracks.people().by_time()
    found: dict[int, list[dict[str, Any]]] = {}
    columns = (people.frame, people.id, people.x, people.y, people.headings())
    for frame, one, x, y, angle in zip(*(column.tolist() for column in columns), strict=True):
        found.setdefault(frame, []).append({"id": one, "x": round(x, 4), "y": round(y, 4), "angle": round(angle, 4)})
    return found


def _grid(grid: OccupancyGrid) -> dict[str, Any]:
    cells = np.where(grid.cells < 0, -1, grid.cells >= OCCUPIED).astype(int)
    return {
        "width": grid.width,
        "height": grid.height,
        "cell_size": grid.resolution,
        "x_orig": grid.origin.x,
        "y_orig": grid.origin.y,
        "angle_orig": grid.origin.heading,
        "data": cells[::-1].tolist(),
    }


def walls(grid: OccupancyGrid) -> F64:
    """The edges between occupied and other cells as straight segments ``x1 y1 x2 y2``, shape [segments, 4], m."""
    occupied = np.pad(grid.cells >= OCCUPIED, 1)
    along_x = _edges(occupied)
    along_y = _edges(occupied.T)[:, [1, 0, 3, 2]]
    ends = np.vstack([along_x, along_y]).reshape(-1, 2) * grid.resolution
    cos, sin = math.cos(grid.origin.heading), math.sin(grid.origin.heading)
    turned: F64 = ends @ np.array([[cos, sin], [-sin, cos]]) + (grid.origin.x, grid.origin.y)
    return turned.reshape(-1, 4)


def _edges(occupied: NDArray[np.bool_]) -> F64:
    """Longest runs of edges between a row of padded cells and the next, ``x1 y1 x2 y2`` in cells."""
    found = []
    # The side on which the wall is tells edges that meet at a corner apart.
    side = np.diff(occupied.astype(np.int8), axis=0)
    for y, row in enumerate(side):
        changes = np.flatnonzero(np.diff(row))
        for left, right in itertools.pairwise(changes):
            if row[left + 1]:
                found.append((left, y, right, y))
    return np.array(found, np.float64).reshape(-1, 4)


def read_socnav(file: str | os.PathLike[str], frame_rate: float | None = None) -> Tracks:
    """Reads robot and people of such a file.

    Its times need not be evenly spaced: positions are interpolated, and the first time is frame 0. The robot's id is
    the one after the greatest of the people.

    Args:
        file: The file.
        frame_rate: Frames per second of the tracks. Default: one frame per entry of the sequence, on average.

    Raises:
        FileError: It cannot be read, or an entry of the sequence is wrong.
    """
    path = Path(file)
    sequence = _sequence(path)
    time_s = np.array([_number(path, index, entry, "timestamp") for index, entry in enumerate(sequence)])
    if not (np.diff(time_s) > 0.0).all():
        index = int(np.flatnonzero(np.diff(time_s) <= 0.0)[0]) + 1
        raise FileError(path, f"sequence[{index}].timestamp is not after the one before; sort the sequence")
    # In microseconds, so that what was 0.1 s apart is so again.
    time_s = np.round(time_s - time_s[0], 6)
    rate = round((time_s.size - 1) / time_s[-1], 2) if frame_rate is None else frame_rate
    if not 0.0 < rate < math.inf:
        raise FileError(path, f"the frame rate {rate:g} must be above 0")
    ways: dict[int, F64] = {}
    robot = np.array(
        [[_number(path, index, entry.get("robot"), name) for name in "xy"] for index, entry in enumerate(sequence)]
    )
    for index, entry in enumerate(sequence):
        for person in entry.get("people") or []:
            one = _id(path, index, person)
            way = ways.setdefault(one, np.full((time_s.size, 2), np.nan))
            if not np.isnan(way[index]).all():
                raise FileError(path, f"sequence[{index}].people has the id {one} twice; keep one of them")
            way[index] = [_number(path, index, person, name) for name in "xy"]
    return _even({**ways, max(ways, default=-1) + 1: robot}, time_s, rate)


def _even(ways: dict[int, F64], time_s: F64, frame_rate: float) -> Tracks:
    """The positions at even frames; NaN, where a person is absent, stays NaN up to the next position and is left out.

    Of the ways, shape [times, 2] each, the last is the robot's.
    """
    frame = np.arange(math.floor(time_s[-1] * frame_rate + 1e-6) + 1)
    at = np.round(frame / frame_rate, 6)
    xy = np.array([[np.interp(at, time_s, way[:, axis]) for axis in (0, 1)] for way in ways.values()])
    one, row = np.nonzero(~np.isnan(xy[:, 0]))
    ids = np.array(list(ways))
    return Tracks(frame_rate, ids[one], frame[row], xy[one, 0, row], xy[one, 1, row], int(ids[-1]))


def _sequence(file: Path) -> list[dict[str, Any]]:
    try:
        data = json.loads("\n".join(lines_of(file)))
    except json.JSONDecodeError as error:
        raise FileError(file, f"this is no JSON ({error.msg})", error.lineno) from error
    sequence = data.get("sequence") if isinstance(data, dict) else None
    if not isinstance(sequence, list) or len(sequence) < 2:
        raise FileError(file, "has no `sequence` of two entries; give a trajectory of SocNavData")
    for index, entry in enumerate(sequence):
        if not isinstance(entry, dict):
            raise FileError(file, f"sequence[{index}] is no object with `timestamp`, `robot` and `people`")
    return sequence


def _id(file: Path, index: int, person: Any) -> int:
    one = _number(file, index, person, "id")
    if one != int(one) or not 0 <= one <= MAX_ID:
        raise FileError(file, f"sequence[{index}].people: {one:g} is no id; ids are whole numbers from 0 to {MAX_ID}")
    return int(one)


def _number(file: Path, index: int, holder: Any, name: str) -> float:
    """A number of an entry of the sequence."""
    value = holder.get(name) if isinstance(holder, dict) else None
    return number(file, None, value, f"sequence[{index}]: `{name}`")
