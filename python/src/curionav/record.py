"""How a dataclass becomes a CBOR map and back: the machinery under ``messages.py``."""

from __future__ import annotations

import dataclasses
import io
import types
import typing
from typing import Any, ClassVar, TypeVar

import cbor2
import numpy as np

from .errors import DecodeError, EncodeError
from .field_types import (
    Boolean,
    Coded,
    Fault,
    FieldType,
    Float,
    Integer,
    ListOf,
    MapOf,
    OneOf,
    Scope,
    Text,
    at,
    expected,
    wrong,
)

R = TypeVar("R", bound="Record")
M = TypeVar("M", bound="Message")

MAX_DEPTH = 18
"""Nesting of arrays, maps and tags that is read; the contract allows 16."""


@dataclasses.dataclass(frozen=True)
class _Field:
    name: str
    type: FieldType
    optional: bool
    """May be absent on the wire, and is left out at its default."""
    default: object
    """What its absence means."""


class Record:
    """A map of the contract. Subclasses are frozen dataclasses whose annotations say how each field travels.

    A class with ``TAGGED`` set is one of several maps, told apart by their field ``kind``.
    """

    TAGGED: ClassVar[bool] = False

    def check(self) -> None:
        """Checks what concerns more than one field.

        Raises:
            Fault: It does not hold.
        """

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        names = [f.name for f in dataclasses.fields(self)]  # type: ignore[arg-type]
        return all(_equal(getattr(self, name), getattr(other, name)) for name in names)

    def __hash__(self) -> int:
        raise TypeError(f"{type(self).__name__} holds arrays and cannot be hashed")


def _equal(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        # NaN stands for a candidate without a score.
        return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_equal(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_equal, a, b))
    return a == b


@dataclasses.dataclass(frozen=True)
class Part(FieldType):
    """A map of its own inside a message."""

    type: type[Record]

    def take(self, value: object, scope: Scope) -> Record:
        """Reads the fields of the record; keys it does not know are passed over."""
        if not isinstance(value, dict):
            raise expected("a map", value)
        cls = _variant(self.type, value.get("kind"))
        inner = Scope({}, outer=scope)
        for field in _fields(cls):
            if field.name in value:
                inner.values[field.name] = at(field.name, field.type.take, value[field.name], inner)
            elif field.optional:
                inner.values[field.name] = field.default
            else:
                raise wrong("is missing", field.name)
        record = cls(**inner.values)
        record.check()
        return record

    def give(self, value: Any, scope: Scope) -> dict[str, object]:
        """Writes the fields of the record."""
        if not isinstance(value, self.type):
            raise expected(f"a {self.type.__name__}", value)
        inner = Scope(vars(value), outer=scope)
        given = {}
        for field in _fields(type(value)):
            found = getattr(value, field.name)
            if not field.optional or not _equal(found, field.default):
                given[field.name] = at(field.name, field.type.give, found, inner)
        value.check()
        return given


def _variant(cls: type[R], kind: object) -> type[R]:
    if not cls.TAGGED:
        return cls
    variants = {sub.__dataclass_fields__["kind"].default: sub for sub in cls.__subclasses__()}  # type: ignore[attr-defined]
    if kind not in variants:
        raise Fault("unknown_name", "kind", found=str(kind)[:64], known=list(variants))
    found: type[R] = variants[kind]
    return found


def _fields(cls: Any) -> tuple[_Field, ...]:
    """The fields of a record, read from its annotations once."""
    found: tuple[_Field, ...] | None = vars(cls).get("_wire_fields")
    if found is None:
        found = _read_fields(cls)
        cls._wire_fields = found
    return found


def _read_fields(cls: Any) -> tuple[_Field, ...]:
    # Of the constructor: the classes of methods have annotations of their own.
    hints = typing.get_type_hints(cls.__init__, include_extras=True)
    result = []
    for field in dataclasses.fields(cls):
        has_default = field.default is not dataclasses.MISSING and field.name != "kind"
        default = field.default if has_default else None
        result.append(_Field(field.name, field_type(hints[field.name]), has_default, default))
    return tuple(result)


def field_type(hint: Any) -> FieldType:
    """The field type an annotation stands for."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return field_type(next(arm for arm in arguments if arm is not type(None)))
    if origin is typing.Annotated:
        inner, note = arguments[0], arguments[1]
        if isinstance(note, FieldType):
            return note
        # A list or map with a limit of its own.
        return dataclasses.replace(field_type(inner), **note)  # type: ignore[type-var]
    if origin is typing.Literal:
        return OneOf(arguments)
    if origin is list:
        return ListOf(field_type(arguments[0]))
    if origin is dict:
        return MapOf(field_type(arguments[1]))
    if isinstance(hint, type) and issubclass(hint, Record):
        return Part(hint)
    return _SIMPLE[hint]


def coded(codes: dict[str, dict[str, Any]], otherwise: str | None = None) -> Coded:
    """A reason: the parameters of every code by their annotations."""
    kinds = {code: {name: field_type(hint) for name, hint in names.items()} for code, names in codes.items()}
    return Coded(kinds, otherwise)


_SIMPLE: dict[Any, FieldType] = {float: Float(), int: Integer(), bool: Boolean(), str: Text()}


class Message(Record):
    """A map that crosses the wire on its own."""

    NAME: ClassVar[str]
    """Name in the encoding string, and of the CDDL rule."""
    MAX_BYTES: ClassVar[int]
    """Most bytes an encoded message may have."""

    @classmethod
    def encoding(cls) -> str:
        """The Zenoh encoding it travels with."""
        return f"application/cbor;curionav.{cls.NAME}.v1"

    def encode(self) -> bytes:
        """The CBOR bytes.

        Raises:
            EncodeError: A field has a value, shape or size its reader would refuse.
        """
        try:
            data = cbor2.dumps(Part(type(self)).give(self, Scope({})))
            if len(data) > self.MAX_BYTES:
                raise Fault("oversize", found=len(data), most=self.MAX_BYTES)
        except Fault as fault:
            raise EncodeError(self.NAME, fault.path, fault.why) from None
        return data

    @classmethod
    def decode(cls: type[M], data: bytes, encoding: str | None = None) -> M:
        """Reads a message from unchecked bytes.

        Arrays of the result are read-only views. ``encoding`` is the string that came with the bytes, if any did.

        Raises:
            DecodeError: They are not this message, or a field has a value, shape or size it may not have.
        """
        try:
            if len(data) > cls.MAX_BYTES:
                raise Fault("oversize", found=len(data), most=cls.MAX_BYTES)
            if encoding is not None and encoding != cls.encoding():
                raise Fault("wrong_encoding", found=encoding[:96], expected=cls.encoding())
            message = Part(cls).take(_parse(data), Scope({}))
        except Fault as fault:
            raise DecodeError(cls.NAME, fault.path, fault.why) from None
        assert isinstance(message, cls)
        return message


def _parse(data: bytes) -> object:
    """One CBOR item of definite length and nothing after it."""
    stream = io.BytesIO(data)
    try:
        decoder = cbor2.CBORDecoder(
            stream,
            max_depth=MAX_DEPTH,
            allow_indefinite=False,
            allow_duplicate_keys=False,
            strict_hashable_types=True,
        )
        value: object = decoder.decode()
    except cbor2.CBORDecodeEOF:
        raise Fault("malformed", offset=len(data), fault="cut_short") from None
    except (cbor2.CBORDecodeError, ValueError, TypeError, OverflowError, RecursionError, MemoryError) as error:
        raise wrong(f"is no well-formed CBOR: {error}") from None
    end = stream.tell()
    if end != len(data):
        raise Fault("malformed", offset=end, fault="trailing_bytes")
    return value
