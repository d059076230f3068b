"""Files of claims, read and checked before anything is judged or run."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .measures import BY_KEY

FIELDS = {
    "success": (["planner", "at_least"], []),
    "as-often": (["planner"], ["than"]),
    "bound": (["planner", "measure"], ["at_most", "at_least", "of_best", "scenarios"]),
    "best": (["planner", "measure"], ["or_tied", "scenarios"]),
    "better": (["planner", "than", "measure"], ["p"]),
}
"""The fields of each kind of claim: those that must be there and those that may."""
TYPES: dict[str, type | tuple[type, ...]] = {
    **dict.fromkeys(["kind", "planner", "than", "measure"], str),
    **dict.fromkeys(["at_least", "at_most", "p"], (int, float)),
    **dict.fromkeys(["of_best", "or_tied"], bool),
    "scenarios": int,
}
WORDS = {str: "a text in quotes", (int, float): "a number", bool: "true or false", int: "a whole number"}


@dataclass(frozen=True)
class Known:
    """What a claim may be about: the planners that are run, and how many scenarios."""

    planners: list[str]
    scenarios: int


def read(file: Path, known: Known) -> list[dict[str, Any]]:
    """The claims of a file.

    Raises:
        ValueError: Names the file, the line and the field, and says how to mend it.
    """
    text = file.read_text(encoding="utf-8")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{file}: {error}") from error
    claims = content.pop("claim", None)
    if content or not isinstance(claims, list):
        others = f", not `{next(iter(content))}`" if content else ""
        raise ValueError(f"{file}: a file of claims has tables `[[claim]]` and nothing else{others}")
    heads = [number for number, line in enumerate(text.splitlines(), 1) if re.match(r"\s*\[\[\s*claim\s*]]", line)]
    for index, claim in enumerate(claims):
        fault = _fault(claim, known)
        if fault:
            line = f":{heads[index]}" if len(heads) == len(claims) else ""
            raise ValueError(f"{file}{line}: claim {index + 1}: {fault}")
    return claims


def _fault(claim: dict[str, Any], known: Known) -> str | None:
    """What is wrong with a claim, and what would be right."""
    kind = claim.get("kind")
    if kind not in FIELDS:
        said = "`kind` is missing" if kind is None else f"`{kind}` is no kind of claim"
        return f"{said}; it is one of {', '.join(FIELDS)}"
    needed, others = FIELDS[kind]
    for field, value in claim.items():
        if field not in ["kind", *needed, *others]:
            return f"`{field}` is no field of the kind `{kind}`, which has {', '.join([*needed, *others])}"
        wanted = TYPES[field]
        # In Python true is a number.
        if not isinstance(value, wanted) or (isinstance(value, bool) and wanted is not bool):
            return f"`{field}` must be {WORDS[wanted]}, not {value!r}"
    missing = [field for field in needed if field not in claim]
    if missing:
        return f"`{missing[0]}` is missing; the kind `{kind}` needs {', '.join(needed)}"
    return _wrong_name(claim, known) or _out_of_range(claim, known)


def _wrong_name(claim: dict[str, Any], known: Known) -> str | None:
    for field in ["planner", "than"]:
        if claim.get(field, known.planners[0]) not in known.planners:
            return f"the planner `{claim[field]}` is not run; it is one of {', '.join(known.planners)}"
    if claim.get("measure", "td") not in BY_KEY:
        return f"`{claim['measure']}` is no measure; it is one of {', '.join(BY_KEY)}"
    return None


def _out_of_range(claim: dict[str, Any], known: Known) -> str | None:
    if claim["kind"] == "success" and not 0.0 <= claim["at_least"] <= 1.0:
        return "`at_least` is a share of the runs, 0 to 1"
    if claim["kind"] == "bound" and not {"at_most", "at_least"} & claim.keys():
        return "give `at_most`, `at_least` or both"
    if not 0.0 <= claim.get("p", 0.01) < 1.0:
        return "`p` is a probability below 1"
    if not 1 <= claim.get("scenarios", 1) <= known.scenarios:
        return f"`scenarios` must be 1 to {known.scenarios}, the number of scenarios that are run"
    return None
