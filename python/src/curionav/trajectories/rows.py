"""What the readers and writers of the text formats have in common: files, and rows as they are read."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ..errors import FileError
from .tracks import Tracks

MAX_ID = 2**32 - 1
"""The greatest id that a scenario's recording may have."""


class Rows:
    """Rows of a file in the order in which they are read, each checked when it is added."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._line_of: dict[tuple[int, int], int] = {}
        self._xy: list[tuple[float, float]] = []

    def add(self, line: int, one: float, frame: float, x: float, y: float) -> None:
        """Takes the row of person ``one`` in this line.

        Raises:
            FileError: A number cannot be what it stands for, or the person was in this frame before.
        """
        if one != int(one) or not 0 <= one <= MAX_ID:
            raise FileError(self._file, f"{one:g} is no id; ids are whole numbers from 0 to {MAX_ID}", line)
        if frame != int(frame):
            raise FileError(self._file, f"{frame:g} is no frame; number the frames and give their rate", line)
        before = self._line_of.setdefault((int(one), int(frame)), line)
        if before != line:
            raise FileError(
                self._file, f"person {one:g} is already at frame {frame:g} in line {before}; keep one of them", line
            )
        self._xy.append((x, y))

    def tracks(self, frame_rate: float, robot: int | None = None) -> Tracks:
        """All rows that were added.

        Raises:
            FileError: There are none, or the frame rate is not above 0.
        """
        if not self._xy:
            raise FileError(self._file, "there are no rows; give a file with at least one position")
        if not 0.0 < frame_rate < math.inf:
            raise FileError(self._file, f"the frame rate {frame_rate:g} must be above 0")
        keys = np.array(list(self._line_of), np.int64)
        xy = np.array(self._xy)
        return Tracks(frame_rate, keys[:, 0], keys[:, 1], xy[:, 0], xy[:, 1], robot)


def number(file: Path, line: int | None, value: object, what: str) -> float:
    """A finite number of a file, from JSON or from text.

    Raises:
        FileError: It is none.
    """
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found) or isinstance(value, bool):
        raise FileError(file, f"{what} is {str(value)[:40]!r}, not a finite number", line)
    return found


def lines_of(file: Path) -> list[str]:
    """The lines of a text.

    Raises:
        FileError: It cannot be read.
    """
    try:
        return file.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(file, f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise FileError(file, "this is no text; unpack it if it is compressed") from error


def write(file: Path, lines: list[str]) -> None:
    """Writes lines of text.

    Raises:
        FileError: They cannot be written.
    """
    try:
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise FileError(file, f"cannot be written: {error.strerror}") from error
