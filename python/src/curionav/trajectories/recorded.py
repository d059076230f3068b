"""Recorded people as a scenario plays them: ``[[recorded]]`` with ``format = "text"``."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..errors import FileError
from .rows import write
from .tracks import Tracks


def write_recorded(tracks: Tracks, file: str | os.PathLike[str]) -> str:
    """Writes the people, without the robot, as lines ``frame id x y``; positions to a tenth of a millimetre.

    Returns:
        The lines of a scenario that play the file, if the scenario lies beside it.

    Raises:
        FileError: There are no people, or the file cannot be written.
    """
    rows, path = tracks.people().by_time(), Path(file)
    if not rows.id.size:
        raise FileError(
            path, "would hold nobody; take people from a file, or from a recording of `curionav run --record`"
        )
    columns = zip(rows.frame.tolist(), rows.id.tolist(), rows.x.tolist(), rows.y.tolist(), strict=True)
    rate = f"{tracks.frame_rate:.10g}"
    head = [f"# {rate} frames per second", "# frame id x y"]
    write(path, head + [f"{frame} {one} {x:.4f} {y:.4f}" for frame, one, x, y in columns])
    name = json.dumps(path.name, ensure_ascii=False)
    return f'[[recorded]]\nfile = {name}\nformat = "text"\nfps = {rate}\n'
