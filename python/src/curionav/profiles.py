"""Planner profiles: those that are built in, those of files, and what a scenario changes in them."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import ScenarioError
from .words import say

Planner = str | os.PathLike[str] | Mapping[str, Any]
"""A planner profile: the name of a built-in one, a profile file (``.toml``), or tables as in such a file."""

BUILT_IN: dict[str, dict[str, Any]] = json.loads(Path(__file__).with_name("profiles.json").read_text("utf-8"))
"""The built-in profiles by name, complete: ``crates/planning/profiles/curiosity.toml`` says what each field means."""

DEFAULT = "curionav"
"""The profile of a scenario that names none."""
_BASE = "curiosity"
"""The profile that has the value of every field that another one leaves out."""
_TERM = {"scale": 0.0, "weight": 1.0, "when": "always", "gives_way": False}
"""Fields that a term leaves out; a scale must be given, and the services refuse one of 0."""


def complete(planner: Planner, base: Path, field: str) -> dict[str, Any]:
    """A whole profile: fields that it leaves out have their default.

    Args:
        planner: Which one.
        base: The directory that a relative path starts from.
        field: What names the profile, for errors.

    Raises:
        ScenarioError: There is no such profile, or the file cannot be read or is not TOML.
    """
    if isinstance(planner, str) and planner in BUILT_IN:
        return BUILT_IN[planner]
    if not isinstance(planner, Mapping):
        planner = _read(planner, base, field)
    default = BUILT_IN[_BASE]
    # A profile that lists any term has exactly the terms that it lists.
    return changed(default | {"terms": {}} if "terms" in planner else default, planner)


def changed(profile: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The profile with some fields replaced: tables are merged, anything else is replaced."""
    terms = changes.get("terms")
    new = terms.keys() - profile["terms"].keys() if isinstance(terms, Mapping) else ()
    return _merged({**profile, "terms": profile["terms"] | dict.fromkeys(new, _TERM)}, changes)


def _merged(table: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    result = dict(table)
    for key, value in changes.items():
        old = table.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            result[key] = _merged(old, value)
        elif isinstance(old, float) and isinstance(value, int) and not isinstance(value, bool):
            # In TOML a whole number may stand for a float; on the wire it is another type.
            result[key] = float(value)
        else:
            result[key] = value
    return result


def _read(planner: str | os.PathLike[str], base: Path, field: str) -> dict[str, Any]:
    path = base / planner
    if path.suffix != ".toml":
        unknown = {"code": "unknown_name", "found": str(planner), "known": [*BUILT_IN, "a profile file (.toml)"]}
        raise ScenarioError(field, say("refusal", unknown))
    return read_toml(path, field)


def read_toml(path: Path, field: str) -> dict[str, Any]:
    """The tables of a file.

    Raises:
        ScenarioError: The file cannot be read or is not TOML; ``field`` is what names it.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ScenarioError(field, f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise ScenarioError(field, f"{path}: {error}") from error
