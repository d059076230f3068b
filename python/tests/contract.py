"""Where the contract lies, and a validator for it."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import pycddl

ROOT = Path(__file__).resolve().parents[2]
SCHEMAS = ROOT / "schemas"


def golden_files() -> list[tuple[Path, str]]:
    """(file, CDDL rule) of every golden message, by ``golden/index.txt``."""
    lines = (SCHEMAS / "golden" / "index.txt").read_text().splitlines()
    pairs = (line.split() for line in lines if line and not line.startswith("#"))
    return [(SCHEMAS / "golden" / name, rule) for name, rule in pairs]


def golden(name: str) -> bytes:
    """The bytes of a golden message, such as ``cycle_report``."""
    return (SCHEMAS / "golden" / f"{name}.cbor").read_bytes()


@lru_cache
def validator(rule: str) -> pycddl.Schema:
    """The CDDL of a message; the first rule of a text is the one validated."""
    rules = "\n".join(path.read_text() for path in sorted(SCHEMAS.glob("*.cddl")))
    # In an array the validator tries the first of several maps only. A map with several groups means the same.
    rules = re.sub(r"\}\s*/ \{", " // ", re.sub(r"[ \t]*;[^\n]*", "", rules))
    return pycddl.Schema(f"validated = {rule}\n{rules}")
