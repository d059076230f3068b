"""A map of map_server as plain text, for programs that read no YAML and no pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

FREE = 0
OCCUPIED = 100
UNKNOWN = -1
_PGM = re.compile(rb"P5\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*(\d+)\s+(?:#[^\n]*\n\s*)*255\s")


@dataclass(frozen=True)
class OccupancyMap:
    """Cells by row, the lowest row first: `FREE`, `OCCUPIED` or `UNKNOWN`. The origin is the lower left corner."""

    cells: NDArray[np.int8]
    resolution: float
    x: float
    y: float

    @staticmethod
    def read(path: Path) -> OccupancyMap:
        """A trinary map with a PGM picture, not turned; raises `ValueError` for others."""
        described = yaml.safe_load(path.read_text())
        x, y, turned = (float(number) for number in described["origin"])
        if described.get("mode", "trinary") != "trinary" or turned != 0.0:
            raise ValueError(f"{path}: peers take trinary maps that are not turned")
        image = path.parent / described["image"]
        pixels = _pixels(image)
        dark = pixels if described.get("negate", 0) else 255 - pixels.astype(np.int16)
        occupancy = dark / 255.0
        cells = np.full(pixels.shape, UNKNOWN, np.int8)
        cells[occupancy > float(described["occupied_thresh"])] = OCCUPIED
        cells[occupancy < float(described["free_thresh"])] = FREE
        return OccupancyMap(np.flipud(cells), float(described["resolution"]), x, y)

    def text(self) -> str:
        """A line `width height resolution x y`, and then a line for each row."""
        height, width = self.cells.shape
        head = f"{width} {height} {self.resolution!r} {self.x!r} {self.y!r}"
        rows = [" ".join(map(str, row)) for row in self.cells.tolist()]
        return "\n".join([head, *rows, ""])


def _pixels(path: Path) -> NDArray[np.uint8]:
    data = path.read_bytes()
    head = _PGM.match(data)
    if head is None:
        raise ValueError(f"{path}: peers take binary PGM pictures with 255 shades of grey")
    width = int(head[1])
    height = int(head[2])
    return np.frombuffer(data, np.uint8, width * height, head.end()).reshape(height, width)
