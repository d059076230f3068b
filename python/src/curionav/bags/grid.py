"""Writing a map of a bag as the files of ROS's map_server."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from .bag import Bag, BagError
from .frames import planar
from .topics import map_topic

OCCUPIED = 0.65
FREE = 0.25
"""Shares above and below which a cell is occupied or free, as map_saver of ROS 2 has them."""


@dataclass(frozen=True)
class WrittenMap:
    """A map that was written."""

    topic: str
    width: int
    """cells"""
    height: int
    """cells"""
    resolution: float
    """m per cell"""


def write_map(bag_path: Path, description: Path, topic: str | None = None) -> WrittenMap:
    """Writes the last map on a topic: ``description`` (YAML), and an image (PGM) beside it.

    Raises:
        BagError: The bag cannot be read, or has no map; or the map contradicts itself.
    """
    with Bag(bag_path) as bag:
        chosen = map_topic(bag, topic)
        grid = None
        for entry in bag.entries([chosen]):
            grid = entry.message
        if grid is None:
            raise bag.without(chosen)
    width, height, resolution = int(grid.info.width), int(grid.info.height), float(np.float32(grid.info.resolution))
    cells = np.asarray(grid.data, np.int16)
    if not (width and height and cells.size == width * height and math.isfinite(resolution) and resolution > 0.0):
        size = f"{width} x {height} cells of {resolution} m"
        raise BagError(f"{bag_path}: the map on `{chosen}` has {size}, but {cells.size} values")
    # Cells that are neither free nor occupied become as grey as those that are unknown.
    pixels = np.full(cells.size, 205, np.uint8)
    pixels[(cells >= 0) & (cells <= 100 * FREE)] = 254
    pixels[cells >= 100 * OCCUPIED] = 0
    origin = planar(grid.info.origin.position, grid.info.origin.orientation)
    image = description.with_suffix(".pgm")
    described = {
        "image": image.name,
        "mode": "trinary",
        # What was meant by the nearest float32, such as 0.05.
        "resolution": float(np.format_float_positional(np.float32(resolution))),
        "origin": [origin.x, origin.y, origin.heading],
        "negate": 0,
        "occupied_thresh": OCCUPIED,
        "free_thresh": FREE,
    }
    description.parent.mkdir(parents=True, exist_ok=True)
    rows = pixels.reshape(height, width)[::-1]
    image.write_bytes(f"P5\n{width} {height}\n255\n".encode() + rows.tobytes())
    description.write_text(yaml.safe_dump(described, sort_keys=False), "utf-8")
    return WrittenMap(chosen, width, height, resolution)
