"""Random messages of any type of rclpy, with the values that codecs get wrong."""

from __future__ import annotations

import importlib
import math
import random
import re
import struct
from typing import Any

from rosidl_parser.definition import (
    AbstractSequence,
    AbstractString,
    Array,
    BasicType,
    BoundedSequence,
    NamespacedType,
)

FLOATS = (0.0, -0.0, math.inf, -math.inf, math.nan, 5e-324, 1.7976931348623157e308)
SINGLES = (0.0, -0.0, math.inf, -math.inf, math.nan, 2.0**-149, 2.0**127)
MESSAGES, NESTED = 60, 5
"""Elements of a sequence of messages, and of the sequences in them."""
TEXTS = ("", "map", "odom", "é", "名前", "a b\n\"'\\", "🤖" * 7, "x" * 255)


def type_named(name: str) -> Any:
    """The class of `nav2_msgs/action/NavigateToPose_SendGoal_Request` and the like."""
    package, kind, message = name.split("/")
    outer = message.split("_")[0]
    file = re.sub(r"(?<=[a-z0-9])([A-Z])|(?<!^)([A-Z])(?=[a-z])", r"_\1\2", outer).lower()
    return getattr(importlib.import_module(f"{package}.{kind}._{file}"), message)


def random_message(of: Any, rng: random.Random, longest: int = 5) -> Any:
    """A message of the class `of`; a sequence of numbers has up to `longest` elements, one of messages fewer."""
    message = of()
    for field, slot in zip(of.get_fields_and_field_types(), of.SLOT_TYPES, strict=True):
        setattr(message, field, random_value(slot, rng, longest))
    return message


def random_value(slot: Any, rng: random.Random, longest: int) -> Any:
    if isinstance(slot, BasicType):
        return random_basic(slot.typename, rng)
    if isinstance(slot, AbstractString):
        return rng.choice(TEXTS)
    if isinstance(slot, NamespacedType):
        return random_message(type_named("/".join(slot.namespaced_name())), rng, longest)
    if isinstance(slot, Array):
        return [random_value(slot.value_type, rng, longest) for _ in range(slot.size)]
    assert isinstance(slot, AbstractSequence), slot
    most = longest if isinstance(slot.value_type, BasicType) else min(longest, MESSAGES)
    most = min(most, slot.maximum_size) if isinstance(slot, BoundedSequence) else most
    count = rng.choice((0, 1, rng.randint(0, most), most))
    return [random_value(slot.value_type, rng, min(longest, NESTED)) for _ in range(count)]


def single(value: float) -> float:
    """The nearest number of single precision."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def random_basic(name: str, rng: random.Random) -> Any:
    if name == "boolean":
        return rng.random() < 0.5
    if name == "double":
        return rng.choice((*FLOATS, rng.gauss(0.0, 1.0), rng.uniform(-1e9, 1e9)))
    if name == "float":
        return rng.choice((*SINGLES, *map(single, (rng.gauss(0.0, 1.0), rng.uniform(-1e9, 1e9)))))
    if name == "octet":
        return bytes([rng.randrange(256)])
    match = re.fullmatch(r"(u?)int(\d+)", name)
    assert match, name
    bits = int(match[2])
    low, high = (0, 2**bits - 1) if match[1] else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return rng.choice((low, high, 0, rng.randint(low, high)))
