"""TrajNet++'s files: a JSON object per line, ``scene`` or ``track``, with positions at about 2.5 rows per second.

As ``trajnetplusplustools`` 0.3 reads and writes them. A scene names a primary pedestrian and a stretch of frames, of
which the first 9 rows are observed and the next 12 are to be predicted.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FileError
from .rows import Rows, lines_of, number, write
from .tracks import I64, Tracks

ROWS_PER_SECOND = 2.5
"""The rate of TrajNet++'s own files, and of the models trained on them."""
SCENE_ROWS = 21
"""9 observed and 12 predicted rows, 8.4 s."""
SCENE_STEP = 3
"""Rows from the beginning of one scene to that of the next, as in TrajNet++'s own conversion."""


def write_trajnet(tracks: Tracks, file: str | os.PathLike[str]) -> None:
    """Writes every row that is needed for about `ROWS_PER_SECOND`, under its own frame number, and scenes.

    The primary pedestrian of a scene is the robot if there is one, else every person in turn. A new scene begins every
    `SCENE_STEP` rows of its way; none spans an absence. A way that is shorter than a scene is one short scene.
    Positions are to a tenth of a millimetre.

    Raises:
        FileError: The file cannot be written.
    """
    step = max(1, round(tracks.frame_rate / ROWS_PER_SECOND))
    rows = tracks.by_time()
    rows = rows.only((rows.frame - rows.frame.min(initial=0)) % step == 0)
    fps = tracks.frame_rate / step
    primaries = np.unique(rows.id).tolist() if tracks.robot is None else [tracks.robot]
    scenes = [(one, part) for one in primaries for part in _parts(rows.frame[rows.id == one], step)]
    lines = [
        _line("scene", id=index, p=one, s=int(part[0]), e=int(part[-1]), fps=round(fps, 6), tag=0)
        for index, (one, part) in enumerate(scenes)
    ]
    columns = zip(rows.frame.tolist(), rows.id.tolist(), rows.x.tolist(), rows.y.tolist(), strict=True)
    write(Path(file), lines + [_line("track", f=f, p=p, x=round(x, 4), y=round(y, 4)) for f, p, x, y in columns])


def _parts(frames: I64, step: int) -> list[I64]:
    """The frames of each scene of one primary pedestrian, who may be absent in between."""
    if frames.size <= SCENE_ROWS:
        return [frames]
    parts = [frames[row : row + SCENE_ROWS] for row in range(0, frames.size - SCENE_ROWS + 1, SCENE_STEP)]
    return [part for part in parts if part[-1] - part[0] == (SCENE_ROWS - 1) * step]


def _line(kind: str, **fields: float) -> str:
    return json.dumps({kind: fields})


def read_trajnet(file: str | os.PathLike[str], frame_rate: float | None = None) -> Tracks:
    """Reads the tracks of such a file; predictions (``prediction_number``) are passed over.

    Args:
        file: The file.
        frame_rate: Frames per second, that is per unit of ``f``. Default: the ``fps`` of the scenes, which counts rows,
            times the usual step between the frames of a person.

    Raises:
        FileError: It cannot be read, a line is wrong, or it says no frame rate and none is given.
    """
    path, rows, rates = Path(file), Rows(Path(file)), set[float]()
    for line, text in enumerate(lines_of(path), 1):
        if not text.strip():
            continue
        entry = _entry(path, line, text)
        track, scene = entry.get("track"), entry.get("scene")
        if isinstance(track, dict):
            if track.get("prediction_number") is None:
                rows.add(line, *(number(path, line, track.get(name), f"track.{name}") for name in "pfxy"))
        elif not isinstance(scene, dict):
            raise FileError(path, 'is neither {"scene": {...}} nor {"track": {...}}; remove the line', line)
        elif scene.get("fps") is not None:
            rates.add(number(path, line, scene["fps"], "scene.fps"))
    if frame_rate is None and len(rates) != 1:
        said = f"its scenes have the rates {sorted(rates)}" if rates else "its scenes have no `fps`"
        raise FileError(path, f"{said}; give frame_rate= or --frame-rate, in frames per second")
    tracks = rows.tracks(1.0)
    return rows.tracks(rates.pop() * _step(tracks) if frame_rate is None else frame_rate)


def _entry(path: Path, line: int, text: str) -> dict[str, Any]:
    try:
        entry = json.loads(text)
    except json.JSONDecodeError as error:
        raise FileError(path, f"is no JSON ({error.msg}); each line is one object", line) from error
    return entry if isinstance(entry, dict) else {}


def _step(tracks: Tracks) -> int:
    """The usual number of frames from one row of a person to the next; 1 if no person has two."""
    order = np.lexsort((tracks.frame, tracks.id))
    steps = np.diff(tracks.frame[order])[np.diff(tracks.id[order]) == 0]
    return int(np.median(steps)) if steps.size else 1
