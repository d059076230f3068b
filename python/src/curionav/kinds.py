"""What a field of a message may hold, how it is written and what is checked: the vocabulary of ``messages/``.

A message is a dataclass whose annotations carry these kinds: ``x: Annotated[F64, Array("f64", "count", "steps")]`` is
one typed array (RFC 8746) of the shape its sibling fields ``count`` and ``steps`` give. ``take`` turns what CBOR gave
into Python values, ``give`` does the reverse; both check, so that a message that decodes also encodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

import cbor2
import numpy as np

from . import keys

MAX_MAGNITUDE = 1e12
"""Largest magnitude of a number with a meaning (metres, seconds, costs)."""
MAX_TEXT = 1024
"""Bytes of UTF-8 in a text."""
MAX_LIST = 64
"""Entries in a list, unless its field says otherwise."""


class Fault(Exception):  # noqa: N818 - never leaves this package; becomes a MessageError
    """A value that does not belong in its field; the path grows as it passes outwards."""

    def __init__(self, reason: str, path: str = "") -> None:
        super().__init__(reason)
        self.reason = reason
        self.path = path

    def within(self, parent: str) -> Fault:
        """The same fault seen from the value that holds the one at fault as ``parent``."""
        separator = "" if not self.path or self.path.startswith("[") else "."
        return Fault(self.reason, f"{parent}{separator}{self.path}")


@dataclass
class Scope:
    """The message around a field: its values so far, and the lengths that no field states."""

    values: dict[str, Any]
    lengths: dict[str, int] = field(default_factory=dict)

    def length(self, name: str) -> int | None:
        """Length called ``name``: of an integer field (``a.b`` for one of a part), or met before; else ``None``."""
        head, _, attribute = name.partition(".")
        value = self.values.get(head)
        if attribute and value is not None:
            value = getattr(value, attribute)
        return value if isinstance(value, int) else self.lengths.get(name)


class Kind:
    """How one field is read and written."""

    def take(self, value: object, scope: Scope) -> Any:
        """The Python value of what CBOR gave."""
        raise NotImplementedError

    def give(self, value: Any, scope: Scope) -> object:
        """What CBOR is to write for a Python value."""
        return self.take(value, scope)


def expected(what: str, value: object) -> Fault:
    """The fault of a value of another type."""
    return Fault(f"must be {what}, found {type(value).__name__}")


@dataclass(frozen=True)
class Float(Kind):
    """A finite number; on the wire always a float, never an integer."""

    low: float = -MAX_MAGNITUDE
    high: float = MAX_MAGNITUDE
    positive: bool = False

    def take(self, value: object, scope: Scope) -> float:
        """Refuses integers: another type on the wire."""
        if not isinstance(value, float):
            raise expected("a float", value)
        if not self.low <= value <= self.high:
            raise Fault(f"{value} is not a finite number within {self.low:g}..{self.high:g}")
        if self.positive and value <= 0.0:
            raise Fault(f"{value} is not positive")
        return value

    def give(self, value: Any, scope: Scope) -> float:
        """Takes any number."""
        if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
            raise expected("a number", value)
        return self.take(float(value), scope)


@dataclass(frozen=True)
class Integer(Kind):
    """An integer within ``low..high``."""

    low: int = 0
    high: int = 2**64 - 1

    def take(self, value: object, scope: Scope) -> int:
        """Refuses floats and booleans."""
        if isinstance(value, bool) or not isinstance(value, int | np.integer):
            raise expected("an integer", value)
        number = int(value)
        if not self.low <= number <= self.high:
            raise Fault(f"{number} is not within {self.low}..{self.high}")
        return number


class Boolean(Kind):
    """True or false."""

    def take(self, value: object, scope: Scope) -> bool:
        """Refuses numbers."""
        if not isinstance(value, bool | np.bool_):
            raise expected("a boolean", value)
        return bool(value)


@dataclass(frozen=True)
class Text(Kind):
    """A text; an ``identifier`` is a chunk of a key, ``hex_digits`` a hash as text."""

    identifier: bool = False
    hex_digits: int = 0

    def take(self, value: object, scope: Scope) -> str:
        """Checks length and characters."""
        if not isinstance(value, str):
            raise expected("a text", value)
        if len(value.encode(errors="surrogatepass")) > MAX_TEXT:
            raise Fault(f"is longer than {MAX_TEXT} bytes")
        if self.identifier and not keys.is_name(value):
            raise Fault(f"{value[:64]!r} must be 1 to 64 of the characters a-z, 0-9, `_` and `-`")
        if self.hex_digits and (len(value) != self.hex_digits or set(value) - set("0123456789abcdef")):
            raise Fault(f"must be {self.hex_digits} lower-case hexadecimal digits")
        return value


@dataclass(frozen=True)
class Bytes(Kind):
    """A byte string, of ``size`` bytes if that is not ``None``."""

    size: int | None = None

    def take(self, value: object, scope: Scope) -> bytes:
        """Checks the size."""
        if not isinstance(value, bytes | bytearray):
            raise expected("bytes", value)
        if self.size is not None and len(value) != self.size:
            raise Fault(f"has {len(value)} bytes, must have {self.size}")
        return bytes(value)


@dataclass(frozen=True)
class OneOf(Kind):
    """One of a few texts."""

    choices: tuple[str, ...]

    def take(self, value: object, scope: Scope) -> str:
        """Refuses any other."""
        if not isinstance(value, str) or value not in self.choices:
            raise Fault(f"{str(value)[:64]!r} is none of {', '.join(self.choices)}")
        return value


@dataclass(frozen=True)
class ListOf(Kind):
    """A list of up to ``limit`` entries; or of exactly the length a field states."""

    entry: Kind
    limit: int | str = MAX_LIST

    def _each(self, values: object, scope: Scope, convert: Callable[[Any, Scope], Any]) -> list[Any]:
        if not isinstance(values, list | tuple):
            raise expected("a list", values)
        limit = scope.length(self.limit) if isinstance(self.limit, str) else self.limit
        if isinstance(self.limit, str) and len(values) != limit:
            raise Fault(f"holds {len(values)} entries, must hold {limit}")
        if limit is not None and len(values) > limit:
            raise Fault(f"{len(values)} entries exceed the limit of {limit}")
        result = []
        for index, value in enumerate(values):
            try:
                result.append(convert(value, scope))
            except Fault as fault:
                raise fault.within(f"[{index}]") from None
        return result

    def take(self, value: object, scope: Scope) -> list[Any]:
        """Takes each entry."""
        return self._each(value, scope, self.entry.take)

    def give(self, value: Any, scope: Scope) -> list[Any]:
        """Gives each entry."""
        return self._each(value, scope, self.entry.give)


@dataclass(frozen=True)
class MapOf(Kind):
    """A map of up to ``limit`` entries; its keys are identifiers, or any text of up to 255 bytes (``free_keys``)."""

    entry: Kind
    limit: int = MAX_LIST
    free_keys: bool = False

    def _each(self, values: object, scope: Scope, convert: Callable[[Any, Scope], Any]) -> dict[str, Any]:
        if not isinstance(values, dict):
            raise expected("a map", values)
        if len(values) > self.limit:
            raise Fault(f"{len(values)} entries exceed the limit of {self.limit}")
        result = {}
        for key, value in values.items():
            if not isinstance(key, str) or len(key) > 255 or not (self.free_keys or keys.is_name(key)):
                raise Fault(f"{str(key)[:64]!r} cannot be a key")
            try:
                result[key] = convert(value, scope)
            except Fault as fault:
                raise fault.within(key) from None
        return result

    def take(self, value: object, scope: Scope) -> dict[str, Any]:
        """Takes each entry."""
        return self._each(value, scope, self.entry.take)

    def give(self, value: Any, scope: Scope) -> dict[str, Any]:
        """Gives each entry."""
        return self._each(value, scope, self.entry.give)


class Parameters(Kind):
    """Free-form parameters: a map with text keys; numbers inside are finite."""

    def take(self, value: object, scope: Scope) -> dict[str, Any]:
        """NumPy scalars and arrays inside become plain numbers and lists."""
        if not isinstance(value, dict):
            raise expected("a map", value)
        result: dict[str, Any] = plain(value)
        return result


def plain(value: Any) -> Any:
    """``value`` made of maps with text keys, lists, texts, bytes, booleans and finite numbers only.

    Raises:
        Fault: It holds something else.
    """
    match value:
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case None | bool() | int() | bytes():
            return value
        case str():
            return Text().take(value, Scope({}))
        case float():
            if not np.isfinite(value):
                raise Fault(f"{value} is not finite")
            return value
        case cbor2.CBORTag():
            return cbor2.CBORTag(value.tag, plain(value.value))
        case list() | tuple():
            return [_part(f"[{i}]", entry) for i, entry in enumerate(value)]
        case dict():
            for key in value:
                if not isinstance(key, str):
                    raise Fault(f"key {key!r} is not a text")
            return {key: _part(key, entry) for key, entry in value.items()}
    raise Fault(f"a value of type {type(value).__name__} has no form on the wire")


def _part(name: str, value: Any) -> Any:
    try:
        return plain(value)
    except Fault as fault:
        raise fault.within(name) from None


Number = Annotated[float, Float()]
"""A finite number."""
Positive = Annotated[float, Float(positive=True)]
"""A finite number greater than zero."""
NonNegative = Annotated[float, Float(low=0.0)]
"""A finite number of zero or more."""
Fraction = Annotated[float, Float(low=0.0, high=1.0)]
"""A number from 0 to 1."""
Uint = Annotated[int, Integer()]
"""An integer from 0 to 2^64 - 1."""
Uint32 = Annotated[int, Integer(high=2**32 - 1)]
"""An integer from 0 to 2^32 - 1."""
Name = Annotated[str, Text(identifier=True)]
"""An identifier: robot, instance, role, metric, world."""
MapId = Annotated[bytes, Bytes(32)]
"""SHA-256 of a map's content, 32 bytes."""
Params = Annotated[dict[str, Any], Parameters()]
"""Free-form parameters."""
