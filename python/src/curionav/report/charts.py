"""What pictures are made of: paths of whole pixels, axes, curves over a scale, and maps as small images."""

from __future__ import annotations

import base64
import math
import struct
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..array import F64
from .measures import plain

LEFT = 40
"""Room for the numbers left of a chart, px; above and below it are `TOP` and `BOTTOM`."""
TOP = 22
BOTTOM = 24
PALETTE = {".": "ffffff", "#": "3c3c3c", "?": "e9e9e9", "-": "d4d4d4"}
"""Colours of the cells of `picture.rows` in bench.json."""


def steps(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten from `low` to `high`, at most `most` steps apart.

    >>> steps(-1.0, 11.0, 6)
    [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
    """
    rough = max(high - low, 1e-9) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next((factor * power for factor in (1.0, 2.0, 5.0) if factor * power >= rough * (1 - 1e-9)), 10.0 * power)
    first = math.ceil(low / step - 1e-9)
    return [index * step for index in range(first, math.floor(high / step + 1e-9) + 1)]


def label(value: float) -> str:
    """A number along an edge, with as few digits as it needs."""
    return plain(round(value, 3) + 0.0).replace("-", "\u2212")


def thinned(points: F64, tolerance: float) -> F64:
    """The fewest of the points from which none of the others is farther than `tolerance` (Douglas and Peucker 1973)."""
    kept = np.zeros(len(points), bool)
    kept[[0, -1]] = True
    open_parts = [(0, len(points) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        along = points[last] - points[first]
        offsets = points[first + 1 : last] - points[first]
        share = np.clip(offsets @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
        far = np.hypot(*(offsets - share[:, None] * along).T)
        middle = first + 1 + int(far.argmax())
        if far.max() > tolerance:
            kept[middle] = True
            open_parts += [(first, middle), (middle, last)]
    result: F64 = points[kept]
    return result


def outline(points: F64, tolerance: float = 0.0) -> str:
    """The points, thinned and in whole pixels, as the attribute `d` of a path."""
    if len(points) == 0:
        return ""
    whole = np.rint(thinned(points, tolerance)).astype(int)
    moves = np.diff(whole, axis=0)
    moves = moves[np.any(moves != 0, axis=1)]
    numbers = "".join(f"{' ' if x >= 0 and i else ''}{x}{' ' if y >= 0 else ''}{y}" for i, (x, y) in enumerate(moves))
    # A line of no length is a dot.
    return f"M{whole[0][0]} {whole[0][1]}l{numbers or '0 0'}"


def text(x: float, y: float, words: str, kind: str = "") -> str:
    """Words in a picture; they need no escapes."""
    named = f' class="{kind}"' if kind else ""
    return f'<text{named} x="{x:.0f}" y="{y:.0f}">{words}</text>'


def grid(across: Sequence[tuple[float, str]], up: Sequence[tuple[float, str]], width: float, height: float) -> str:
    """Lines at these places, px, with what stands below and left of them, and a frame around."""
    lines = "".join(f"M{x:.0f} 0v{height:.0f}" for x, _ in across) + "".join(f"M0 {y:.0f}h{width:.0f}" for y, _ in up)
    below = "".join(text(x, height + 15, words) for x, words in across)
    left = "".join(text(-6, y + 3, words) for y, words in up)
    frame = f"M0 0h{width:.0f}v{height:.0f}h-{width:.0f}z"
    return (
        f'<path class="grid" d="{lines}"/><path class="frame" d="{frame}"/>'
        f'<g class="below">{below}</g><g class="left">{left}</g>'
    )


@dataclass(frozen=True)
class Scale:
    """What the heights of a chart stand for."""

    low: float
    high: float
    is_logarithmic: bool = False

    def share(self, value: float) -> float:
        """Where a value is between the lower edge (0) and the upper one (1)."""
        if self.is_logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def steps(self) -> list[float]:
        """The values beside which a number stands."""
        if not self.is_logarithmic:
            return steps(self.low, self.high, 5)
        digits = [1.0] if self.high / self.low > 50.0 else [1.0, 2.0, 5.0]
        powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        everything = [digit * 10.0**power for power in powers for digit in digits]
        return [value for value in everything if self.low <= value <= self.high]


@dataclass(frozen=True)
class Curve:
    """Points (place across, value) of a planner, which is named by its place."""

    planner: int
    points: F64


@dataclass(frozen=True)
class Chart:
    """Curves over one quantity, from 0 to `across`, and levels to compare with."""

    title: str
    scale: Scale
    across: float
    curves: Sequence[Curve]
    unit: str = ""
    levels: dict[float, str] = field(default_factory=dict)

    def draw(self, width: float, height: float, tolerance: float) -> str:
        """The chart within so many pixels; the first curve is on top."""
        wide = width - LEFT
        high = height - TOP - BOTTOM
        up = [(high * (1.0 - self.scale.share(value)), label(value)) for value in self.scale.steps()]
        moments = steps(0.0, self.across, 10)
        across = [(wide * value / self.across, f"{label(value)} {self.unit}".rstrip()) for value in moments]
        parts = [text(0, -7, self.title, "title"), grid(across, up, wide, high)]
        for value, name in self.levels.items():
            y = high * (1.0 - self.scale.share(value))
            parts.append(f'<path class="level" d="M0 {y:.0f}h{wide:.0f}"/>{text(wide - 4, y - 4, name, "name")}')
        for curve in reversed(self.curves):
            x = wide * curve.points[:, 0] / self.across
            ys = [high * (1.0 - self.scale.share(value)) for value in curve.points[:, 1].tolist()]
            drawn = outline(np.column_stack([x, ys]), tolerance)
            parts.append(f'<path class="v c{curve.planner}" d="{drawn}"/>')
        return f'<g transform="translate({LEFT} {TOP})">{"".join(parts)}</g>'


def map_image(rows: Iterable[str]) -> str:
    """Cells as an image for the attribute `href`, the first row at its top."""
    codes = np.array([[list(PALETTE).index(cell) for cell in row] for row in rows], np.uint8)
    height, width = codes.shape
    filled = np.pad(codes, ((0, 0), (0, -width % 4)))
    # Four cells a byte, and before each row the number of its filter: none.
    packed = filled[:, 0::4] << 6 | filled[:, 1::4] << 4 | filled[:, 2::4] << 2 | filled[:, 3::4]
    lines = np.pad(packed, ((0, 0), (1, 0))).tobytes()
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 2, 3, 0, 0, 0)),
        (b"PLTE", bytes.fromhex("".join(PALETTE.values()))),
        (b"IDAT", zlib.compress(lines, 9)),
        (b"IEND", b""),
    ]
    image = b"\x89PNG\r\n\x1a\n"
    for name, data in chunks:
        image += struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    return f"data:image/png;base64,{base64.b64encode(image).decode()}"
