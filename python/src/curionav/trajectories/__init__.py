"""Where a robot and people were over time, for the programs of pedestrian dynamics and of trajectory forecasts.

>>> import curionav, curionav.trajectories as trajectories
>>> tracks = trajectories.from_result(curionav.Result.load("run.mcap"))  # doctest: +SKIP
>>> trajectories.write_pedpy(tracks, "run.txt")  # doctest: +SKIP

`read_pedpy`, `read_trajnet` and `read_socnav` read such files, and `write_recorded` makes of their people what a
scenario plays as ``[[recorded]]``. The command ``python -m curionav.trajectories IN OUT --format FORMAT`` does the same
without a program. Metres and seconds; frames are whole numbers, `Tracks.frame_rate` of them per second.
"""

from __future__ import annotations

from .pedpy import read_pedpy, write_pedpy
from .recorded import write_recorded
from .socnav import read_socnav, write_socnav
from .tracks import Tracks, from_result
from .trajnet import read_trajnet, write_trajnet

__all__ = [
    "Tracks",
    "from_result",
    "read_pedpy",
    "read_socnav",
    "read_trajnet",
    "write_pedpy",
    "write_recorded",
    "write_socnav",
    "write_trajnet",
]
