"""What a field of a message may hold, how it is written and what is checked: the vocabulary of ``messages.py``.

A message is a dataclass whose annotations carry field types: ``x: Annotated[F64, Array("f64", "count", "steps")]`` is
one typed array (RFC 8746) of the shape its sibling fields ``count`` and ``steps`` give. ``take`` turns what CBOR gave
into Python values, ``give`` does the reverse; both check, so that a message that decodes also encodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any, TypeVar

import cbor2
import numpy as np

from . import keys
from .words import say

T = TypeVar("T")

MAX_MAGNITUDE = 1e12
"""Largest magnitude of a number with a meaning (metres, seconds, costs)."""
MAX_TEXT = 1024
"""Bytes of UTF-8 in a text."""
MAX_LIST = 64
"""Entries in a list, unless its field says otherwise."""


class Fault(Exception):  # noqa: N818 - never leaves this package; becomes a MessageError
    """A value that does not belong in its field: a refusal of the contract, with the path of the field.

    The path grows as the fault passes outwards.
    """

    def __init__(self, code: str, path: str = "", **parameters: Any) -> None:
        self.why: dict[str, Any] = {"code": code, **parameters}
        self.path = path
        super().__init__(self.reason)

    @property
    def reason(self) -> str:
        """What is wrong, for a person."""
        return say("refusal", self.why)

    def within(self, parent: str) -> Fault:
        """The same fault seen from the value that holds the one at fault as ``parent``."""
        separator = "" if not self.path or self.path.startswith("[") else "."
        return Fault(path=f"{parent}{separator}{self.path}", **self.why)


@dataclass
class Scope:
    """The message around a field: its values so far, and the lengths that no field states."""

    values: dict[str, Any]
    lengths: dict[str, int] = field(default_factory=dict)
    outer: Scope | None = None
    """The message that this one is a part of."""

    def length(self, name: str) -> int | None:
        """Length called ``name``: of an integer field (``a.b`` for one of a part), or met before; else ``None``.

        A length ``a.b`` may also be one of the message around this one.
        """
        head, _, attribute = name.partition(".")
        value = self.values.get(head)
        if attribute and value is not None:
            value = getattr(value, attribute)
        if not isinstance(value, int):
            value = self.lengths.get(name)
        # A length of this message alone may have the same name as one around it.
        return self.outer.length(name) if value is None and attribute and self.outer is not None else value


class FieldType:
    """How one field is read and written."""

    def take(self, value: object, scope: Scope) -> Any:
        """The Python value of what CBOR gave."""
        raise NotImplementedError

    def give(self, value: Any, scope: Scope) -> object:
        """What CBOR is to write for a Python value."""
        return self.take(value, scope)


def at(name: str, convert: Callable[[Any, Scope], T], value: object, scope: Scope) -> T:
    """Converts the value of the field ``name``, which a fault then names."""
    try:
        return convert(value, scope)
    except Fault as fault:
        raise fault.within(name) from None


def expected(what: str, value: object) -> Fault:
    """The fault of a value of another type."""
    return wrong(f"must be {what}, found {type(value).__name__}")


def wrong(detail: str, path: str = "") -> Fault:
    """The fault of a value that is not what its field holds."""
    return Fault("wrong_structure", path, detail=detail)


@dataclass(frozen=True)
class Float(FieldType):
    """A finite number; on the wire always a float, never an integer."""

    low: float = -MAX_MAGNITUDE
    high: float = MAX_MAGNITUDE
    positive: bool = False

    def take(self, value: object, scope: Scope) -> float:
        """Refuses integers: another type on the wire."""
        if not isinstance(value, float):
            raise expected("a float", value)
        if not abs(value) <= MAX_MAGNITUDE:  # a NaN is not
            raise Fault("not_finite")
        if self.positive and value <= 0.0:
            raise Fault("not_positive", found=value)
        if not self.low <= value <= self.high:
            raise Fault("out_of_range", found=value, least=self.low, most=self.high)
        return value

    def give(self, value: Any, scope: Scope) -> float:
        """Takes any number."""
        if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
            raise expected("a number", value)
        return self.take(float(value), scope)


@dataclass(frozen=True)
class Integer(FieldType):
    """An integer within ``low..high``."""

    low: int = 0
    high: int = 2**64 - 1

    def take(self, value: object, scope: Scope) -> int:
        """Refuses floats and booleans."""
        if isinstance(value, bool) or not isinstance(value, int | np.integer):
            raise expected("an integer", value)
        number = int(value)
        if not self.low <= number <= self.high:
            raise wrong(f"{number} is not within {self.low} to {self.high}")
        return number


class Boolean(FieldType):
    """True or false."""

    def take(self, value: object, scope: Scope) -> bool:
        """Refuses numbers."""
        if not isinstance(value, bool | np.bool_):
            raise expected("a boolean", value)
        return bool(value)


@dataclass(frozen=True)
class Text(FieldType):
    """A text; an ``identifier`` is a chunk of a key, a hash is 64 hexadecimal digits."""

    identifier: bool = False
    is_hash: bool = False

    def take(self, value: object, scope: Scope) -> str:
        """Checks length and characters."""
        if not isinstance(value, str):
            raise expected("a text", value)
        length = len(value.encode(errors="surrogatepass"))
        if length > MAX_TEXT:
            raise Fault("too_many", found=length, most=MAX_TEXT)
        if self.identifier and not keys.is_name(value):
            raise Fault("not_a_name", found=value[:64])
        if self.is_hash and (len(value) != 64 or set(value) - set("0123456789abcdef")):
            raise Fault("not_a_hash")
        return value


@dataclass(frozen=True)
class Bytes(FieldType):
    """A byte string, of ``size`` bytes if that is not ``None``."""

    size: int | None = None

    def take(self, value: object, scope: Scope) -> bytes:
        """Checks the size."""
        if not isinstance(value, bytes | bytearray):
            raise expected("bytes", value)
        if self.size is not None and len(value) != self.size:
            raise Fault("wrong_length", found=len(value), expected=self.size)
        return bytes(value)


@dataclass(frozen=True)
class OneOf(FieldType):
    """One of a few texts."""

    choices: tuple[str, ...]

    def take(self, value: object, scope: Scope) -> str:
        """Refuses any other."""
        if not isinstance(value, str) or value not in self.choices:
            raise Fault("unknown_name", found=str(value)[:64], known=list(self.choices))
        return value


@dataclass(frozen=True)
class ListOf(FieldType):
    """A list of up to ``limit`` entries; or of exactly the length a field states."""

    entry: FieldType
    limit: int | str = MAX_LIST

    def _each(self, values: object, scope: Scope, convert: Callable[[Any, Scope], Any]) -> list[Any]:
        if not isinstance(values, list | tuple):
            raise expected("a list", values)
        limit = scope.length(self.limit) if isinstance(self.limit, str) else self.limit
        if isinstance(self.limit, str) and len(values) != limit:
            raise Fault("wrong_length", found=len(values), expected=limit or 0)
        if limit is not None and len(values) > limit:
            raise Fault("too_many", found=len(values), most=limit)
        return [at(f"[{index}]", convert, value, scope) for index, value in enumerate(values)]

    def take(self, value: object, scope: Scope) -> list[Any]:
        """Takes each entry."""
        return self._each(value, scope, self.entry.take)

    def give(self, value: Any, scope: Scope) -> list[Any]:
        """Gives each entry."""
        return self._each(value, scope, self.entry.give)


@dataclass(frozen=True)
class MapOf(FieldType):
    """A map of up to ``limit`` entries; its keys are identifiers, or any text of up to 255 bytes (``free_keys``)."""

    entry: FieldType
    limit: int = MAX_LIST
    free_keys: bool = False

    def _each(self, values: object, scope: Scope, convert: Callable[[Any, Scope], Any]) -> dict[str, Any]:
        if not isinstance(values, dict):
            raise expected("a map", values)
        if len(values) > self.limit:
            raise Fault("too_many", found=len(values), most=self.limit)
        result = {}
        for key, value in values.items():
            if not isinstance(key, str) or len(key) > 255 or not (self.free_keys or keys.is_name(key)):
                raise wrong(f"{str(key)[:64]!r} cannot be a key")
            result[key] = at(key, convert, value, scope)
        return result

    def take(self, value: object, scope: Scope) -> dict[str, Any]:
        """Takes each entry."""
        return self._each(value, scope, self.entry.take)

    def give(self, value: Any, scope: Scope) -> dict[str, Any]:
        """Gives each entry."""
        return self._each(value, scope, self.entry.give)


@dataclass(frozen=True, eq=False)
class Coded(FieldType):
    """A map with a ``code`` and the parameters of that code, of which `words.say` makes a sentence.

    ``codes`` has the parameters by code. A reader takes a code that it does not know for ``otherwise``, if that is set.
    """

    codes: dict[str, dict[str, FieldType]]
    otherwise: str | None = None

    def _each(self, value: object, conversion: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise expected("a map", value)
        code = value.get("code")
        if code not in self.codes:
            if self.otherwise is None or not isinstance(code, str):
                raise Fault("unknown_name", "code", found=str(code)[:64], known=list(self.codes))
            return {"code": self.otherwise}
        result = {"code": code}
        for name, kind in self.codes[code].items():
            if name not in value:
                raise wrong("is missing", name)
            result[name] = at(name, getattr(kind, conversion), value[name], Scope({}))
        return result

    def take(self, value: object, scope: Scope) -> dict[str, Any]:
        """Takes the parameters of the code; others are passed over."""
        return self._each(value, "take")

    def give(self, value: Any, scope: Scope) -> dict[str, Any]:
        """Gives the parameters of the code."""
        return self._each(value, "give")


class Parameters(FieldType):
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
                raise Fault("not_finite")
            return value
        case cbor2.CBORTag():
            return cbor2.CBORTag(value.tag, plain(value.value))
        case list() | tuple():
            return [at(f"[{i}]", _plain, entry, Scope({})) for i, entry in enumerate(value)]
        case dict():
            for key in value:
                if not isinstance(key, str):
                    raise Fault("not_a_map")
            return {key: at(key, _plain, entry, Scope({})) for key, entry in value.items()}
    raise wrong(f"a value of type {type(value).__name__} has no form on the wire")


def _plain(value: Any, scope: Scope) -> Any:
    return plain(value)


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
"""An identifier: robot, instance, role, term, world."""
MapId = Annotated[bytes, Bytes(32)]
"""SHA-256 of a map's content, 32 bytes."""
Params = Annotated[dict[str, Any], Parameters()]
"""Free-form parameters."""
