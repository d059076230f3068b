"""Typed arrays (RFC 8746) as NumPy arrays: the one kind of field with a shape."""

from __future__ import annotations

from typing import Annotated, Any

import cbor2
import numpy as np
from numpy.typing import NDArray

from .kinds import MAX_MAGNITUDE, Fault, Kind, Scope

_ELEMENTS: dict[str, tuple[int, np.dtype[Any]]] = {
    "f64": (86, np.dtype("<f8")),
    "f32": (85, np.dtype("<f4")),
    "u32": (70, np.dtype("<u4")),
    "i8": (72, np.dtype("i1")),
    "u8": (64, np.dtype("u1")),
}


class Array(Kind):
    """A typed array of RFC 8746, row-major, with elements within ``low..high``.

    Args:
        element: ``f64``, ``f32``, ``u32``, ``i8`` or ``u8``.
        dims: The shape: numbers, names of integer fields, or other names, which stand for a length that the first
            array to use it determines. ``*`` is a length of this array alone.
        low: Least element.
        high: Greatest element.
        limit: Greatest length of the first dimension.
    """

    def __init__(
        self,
        element: str,
        *dims: int | str,
        low: float = -MAX_MAGNITUDE,
        high: float = MAX_MAGNITUDE,
        limit: int = 2**32,
    ) -> None:
        self.tag, self.dtype = _ELEMENTS[element]
        self.dims = dims
        self.low = low
        self.high = high
        self.limit = limit

    def _shape(self, size: int, scope: Scope) -> tuple[int, ...]:
        """The shape of ``size`` elements; binds a length met for the first time."""
        known = [d if isinstance(d, int) else None if d == "*" else scope.length(d) for d in self.dims]
        product = int(np.prod([n for n in known if n is not None], dtype=np.int64))
        shape = tuple(size // product if product else 0 for n in known if n is None)
        free = iter(shape)
        result = tuple(next(free) if n is None else n for n in known)
        if len(shape) > 1 or int(np.prod(result, dtype=np.int64)) != size:
            wanted = " x ".join(str(d if n is None else n) for n, d in zip(known, self.dims, strict=True))
            raise Fault(f"holds {size} elements, its shape is {wanted}")
        for name, length in zip(self.dims, result, strict=True):
            if isinstance(name, str) and name != "*":
                scope.lengths.setdefault(name, length)
        if result[0] > self.limit:
            raise Fault(f"{result[0]} exceeds the limit of {self.limit}")
        return result

    def _checked(self, array: NDArray[Any]) -> NDArray[Any]:
        # A NaN makes both comparisons false.
        if array.size and not (array.min() >= self.low and array.max() <= self.high):
            flat = array.reshape(-1)
            index = int(np.flatnonzero(~((flat >= self.low) & (flat <= self.high)))[0])
            low_high = f"{self.low:g}..{self.high:g}"
            raise Fault(f"{flat[index]} is not a finite number within {low_high}", f"[{index}]")
        return array

    def take(self, value: object, scope: Scope) -> NDArray[Any]:
        """A read-only view of the received bytes, in shape."""
        if not isinstance(value, cbor2.CBORTag) or value.tag != self.tag or not isinstance(value.value, bytes):
            found = f"tag {value.tag}" if isinstance(value, cbor2.CBORTag) else type(value).__name__
            raise Fault(f"must be a typed array with tag {self.tag}, found {found}")
        if len(value.value) % self.dtype.itemsize:
            raise Fault(f"{len(value.value)} bytes are no whole number of {self.dtype.itemsize}-byte elements")
        array = np.frombuffer(value.value, self.dtype)
        return self._checked(array.reshape(self._shape(array.size, scope)))

    def give(self, value: Any, scope: Scope) -> cbor2.CBORTag:
        """Takes anything NumPy can make such an array of; integers must fit."""
        try:
            given = np.asarray(value)
            array = np.ascontiguousarray(given, self.dtype)
        except (TypeError, ValueError, OverflowError) as error:
            raise Fault(f"is no array of numbers: {error}") from None
        if self.dtype.kind in "iu" and not np.array_equal(array, given):
            raise Fault(f"does not fit {self.dtype.name}")
        shape = self._shape(array.size, scope)
        if array.size and array.shape != shape:
            raise Fault(f"has shape {array.shape}, must have {shape}")
        return cbor2.CBORTag(self.tag, self._checked(array).tobytes())


F64 = NDArray[np.float64]
"""An array of float64."""
F32 = NDArray[np.float32]
"""An array of float32."""
U32 = NDArray[np.uint32]
"""An array of uint32."""
I8 = NDArray[np.int8]
"""An array of int8."""
U8 = NDArray[np.uint8]
"""An array of uint8."""

Variances = Annotated[F64, Array("f64", 3, 3)]
"""A covariance of (x, y, heading), shape [3, 3]; m^2, m rad, rad^2."""
