"""Typed arrays (RFC 8746) as NumPy arrays: the one kind of field with a shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import cbor2
import numpy as np
from numpy.typing import NDArray

from .field_types import MAX_MAGNITUDE, Fault, FieldType, Scope, wrong

_ELEMENTS: dict[str, tuple[int, np.dtype[Any]]] = {
    "f64": (86, np.dtype("<f8")),
    "f32": (85, np.dtype("<f4")),
    "u32": (70, np.dtype("<u4")),
    "i8": (72, np.dtype("i1")),
    "u8": (64, np.dtype("u1")),
}


class Array(FieldType):
    """A typed array of RFC 8746, row-major, with elements within ``low..high``.

    Args:
        element: ``f64``, ``f32``, ``u32``, ``i8`` or ``u8``.
        dims: The shape: numbers, names of integer fields, or other names, which stand for a length that the first
            array to use it determines. ``*`` is a length of this array alone.
        low: Least element.
        high: Greatest element.
        limit: Greatest length of the first dimension.
        nan: Whether an element may be NaN.
    """

    def __init__(
        self,
        element: str,
        *dims: int | str,
        low: float = -MAX_MAGNITUDE,
        high: float = MAX_MAGNITUDE,
        limit: int = 2**32,
        nan: bool = False,
    ) -> None:
        self.tag, self.dtype = _ELEMENTS[element]
        self.dims = dims
        self.low = low
        self.high = high
        self.limit = limit
        self.nan = nan

    def _shape(self, size: int, scope: Scope) -> tuple[int, ...]:
        """The shape of ``size`` elements; binds a length met for the first time."""
        known = [d if isinstance(d, int) else None if d == "*" else scope.length(d) for d in self.dims]
        product = int(np.prod([n for n in known if n is not None], dtype=np.int64))
        shape = tuple(size // product if product else 0 for n in known if n is None)
        free = iter(shape)
        result = tuple(next(free) if n is None else n for n in known)
        if len(shape) > 1 or int(np.prod(result, dtype=np.int64)) != size:
            raise Fault("wrong_length", found=size, expected=product if len(shape) <= 1 else 0)
        for name, length in zip(self.dims, result, strict=True):
            if isinstance(name, str) and name != "*":
                scope.lengths.setdefault(name, length)
        if result[0] > self.limit:
            raise Fault("too_many", found=result[0], most=self.limit)
        return result

    def _checked(self, array: NDArray[Any]) -> NDArray[Any]:
        # A NaN makes both comparisons false.
        if array.size and not (array.min() >= self.low and array.max() <= self.high):
            flat = array.reshape(-1)
            good = (flat >= self.low) & (flat <= self.high)
            if self.nan:
                good |= np.isnan(flat)
            if good.all():
                return array
            index = int(np.flatnonzero(~good)[0])
            found = float(flat[index])
            if not abs(found) <= MAX_MAGNITUDE:
                raise Fault("not_finite", f"[{index}]")
            raise Fault("out_of_range", f"[{index}]", found=found, least=float(self.low), most=float(self.high))
        return array

    def take(self, value: object, scope: Scope) -> NDArray[Any]:
        """A read-only view of the received bytes, in shape."""
        if not isinstance(value, cbor2.CBORTag) or value.tag != self.tag or not isinstance(value.value, bytes):
            found = f"tag {value.tag}" if isinstance(value, cbor2.CBORTag) else type(value).__name__
            raise wrong(f"must be a typed array with tag {self.tag}, found {found}")
        if len(value.value) % self.dtype.itemsize:
            raise wrong(f"{len(value.value)} bytes are no whole number of {self.dtype.itemsize}-byte elements")
        array = np.frombuffer(value.value, self.dtype)
        return self._checked(array.reshape(self._shape(array.size, scope)))

    def give(self, value: Any, scope: Scope) -> cbor2.CBORTag:
        """Takes anything NumPy can make such an array of; integers must fit."""
        try:
            given = np.asarray(value)
            array = np.ascontiguousarray(given, self.dtype)
        except (TypeError, ValueError, OverflowError) as error:
            raise wrong(f"is no array of numbers: {error}") from None
        if self.dtype.kind in "iu" and not np.array_equal(array, given):
            raise wrong(f"does not fit {self.dtype.name}")
        shape = self._shape(array.size, scope)
        if array.size and array.shape != shape:
            raise wrong(f"has shape {array.shape}, must have {shape}")
        return cbor2.CBORTag(self.tag, self._checked(array).tobytes())


@dataclass(frozen=True)
class ScoredOnly(FieldType):
    """Numbers of candidates, some of which have none: here NaN stands for those, on the wire they are left out.

    The field ``scored`` beside it, which comes first, has the indices of those with a number, in ascending order;
    ``count`` names the number of all candidates.
    """

    count: str

    def take(self, value: object, scope: Scope) -> NDArray[Any]:
        """An array of shape [count]."""
        found = Array("f64", "scored").take(value, Scope({"scored": len(scope.values["scored"])}))
        spread = np.full(self._count(scope), np.nan)
        spread[scope.values["scored"]] = found
        spread.flags.writeable = False
        return spread

    def give(self, value: Any, scope: Scope) -> cbor2.CBORTag:
        """The numbers of the candidates that have one."""
        try:
            every = np.asarray(value, np.float64)
        except (TypeError, ValueError) as error:
            raise wrong(f"is no array of numbers: {error}") from None
        if every.shape != (self._count(scope),):
            raise Fault("wrong_length", found=every.size, expected=self._count(scope))
        if not np.array_equal(np.flatnonzero(~np.isnan(every)), scope.values["scored"]):
            raise wrong("must have a number for the candidates in `scored`, and NaN for all others")
        return Array("f64", "*").give(every[scope.values["scored"]], Scope({}))

    def _count(self, scope: Scope) -> int:
        count = scope.length(self.count)
        assert count is not None
        return count


@dataclass(frozen=True)
class Indices(FieldType):
    """Indices of candidates in ascending order; ``count`` names the number of all candidates."""

    count: str

    def take(self, value: object, scope: Scope) -> NDArray[Any]:
        """Refuses indices that do not rise, or that lie beyond the candidates."""
        return self._checked(Array("u32", "*", high=2**32 - 1).take(value, Scope({})), scope)

    def give(self, value: Any, scope: Scope) -> cbor2.CBORTag:
        """Takes anything that NumPy can make such an array of."""
        given = Array("u32", "*", high=2**32 - 1).give(value, Scope({}))
        self._checked(np.asarray(value), scope)
        return given

    def _checked(self, indices: NDArray[Any], scope: Scope) -> NDArray[Any]:
        if (indices[1:] <= indices[:-1]).any():
            raise Fault("not_ascending")
        if len(indices) and int(indices[-1]) >= (scope.length(self.count) or 0):
            raise Fault("no_such_index", found=int(indices[-1]))
        return indices


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
