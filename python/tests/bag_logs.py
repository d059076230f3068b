"""Logs of the Carmen toolkit that bags became, read as the toolkit describes their lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from curionav.array import F64


@dataclass(frozen=True)
class Line:
    """A scan as it stands in a log."""

    stamp: float
    start: float
    step: float
    range_max: float
    ranges: F64
    laser: list[float]
    robot: list[float]

    def points(self) -> F64:
        """Where its beams end in the frame of the robot's pose, shape [beams, 2]."""
        x, y, heading = self.laser
        angles = heading + self.start + self.step * np.arange(len(self.ranges))
        return np.stack([x + self.ranges * np.cos(angles), y + self.ranges * np.sin(angles)], axis=1)


def lines(log: Path) -> list[Line]:
    """The scans of a log."""
    found = []
    for text in log.read_text().splitlines():
        words = text.split()
        assert words[0] == "ROBOTLASER1"
        _, start, fov, step, range_max, _, _, count = map(float, words[1:9])
        ranges = np.array(words[9 : 9 + int(count)], float)
        rest = [float(word) for word in words[9 + int(count) :] if word != "bag"]
        assert fov == pytest.approx(step * (count - 1))
        assert len(rest) == 1 + 6 + 5 + 2
        assert rest[0] == 0.0, "no remissions"
        found.append(Line(rest[-1], start, step, range_max, ranges, rest[1:4], rest[4:7]))
    return found


def references(log: Path) -> list[tuple[float, list[float], list[float]]]:
    """(stamp, pose, pose beside it) of a log of references."""
    rows = [line.split() for line in log.read_text().splitlines()]
    assert {tuple(row[:4]) for row in rows} == {("FLASER", "2", "0", "0")}
    return [(float(row[-1]), [float(w) for w in row[4:7]], [float(w) for w in row[7:10]]) for row in rows]
