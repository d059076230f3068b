"""Codes of the contract in words, for people.

All sentences come from the table ``words.toml``, which is the same in Rust, so that both say the same.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

UNSEEN = 2**32 - 1
"""The identity of what only the driver sees, which is no person that a tracker knows."""
_WORDS: dict[str, dict[str, str]] = tomllib.loads(Path(__file__).with_name("words.toml").read_text("utf-8"))


def say(family: str, reason: object) -> str:
    """A reason in words.

    Args:
        family: Table of ``words.toml``, such as ``reason``, ``rejection`` or ``refusal``.
        reason: A code by itself, or a map with its ``code`` and its parameters. A code that the table does not have is
            its own word.
    """
    found = reason if isinstance(reason, str) else _parameter(reason, "code")
    code = found if isinstance(found, str) else ""
    template = _WORDS.get(family, {}).get(code)
    if template is None:
        return code
    said = ""
    while "{" in template:
        before, _, rest = template.partition("{")
        place, _, template = rest.partition("}")
        name, _, decimals = place.partition(":.")
        said += before + _word(name, _parameter(reason, name), decimals)
    return said + template


def say_all(family: str, reasons: Iterable[object]) -> str:
    """Several reasons of one family in words, with semicolons between them."""
    return "; ".join(say(family, reason) for reason in reasons)


def families() -> dict[str, set[str]]:
    """The codes of every family of the table."""
    return {family: set(codes) for family, codes in _WORDS.items()}


def _parameter(reason: object, name: str) -> Any:
    """A parameter of a map, or of a part of a message that is a class of its own (a `Reject`)."""
    return reason.get(name) if isinstance(reason, Mapping) else getattr(reason, name, None)


def _word(name: str, value: Any, decimals: str) -> str:
    match value:
        case bool() | None:
            return ""
        case str():
            return say(name, value) if name in _WORDS else value
        case int() if name == "person":
            return say("person", {"code": "unseen" if value == UNSEEN else "any", "number": value})
        case int():
            return str(value)
        case float():
            return f"{value:.{decimals}f}" if decimals else _shortest(value)
        case list():
            return ", ".join(_word(name, entry, decimals) for entry in value)
    why = _parameter(value, "why")
    if why is None:
        return say(name, value)
    # A refusal with the field that it is about.
    field = _parameter(value, "field")
    return f"{field}: {say('refusal', why)}" if field else say("refusal", why)


def _shortest(number: float) -> str:
    """The shortest digits that stand for a number, as Rust writes them: ``1e-12`` and ``1e16``, not ``1e+16``."""
    mantissa, _, exponent = repr(number).partition("e")
    mantissa = mantissa.removesuffix(".0")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa
