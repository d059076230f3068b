"""Writes ``src/curionav/messages.py``, the classes of the messages, from the wire contract in ``schemas/*.cddl``.

A rule that is a map becomes a class, one whose alternatives are texts a ``Literal``, and one whose alternatives have a
``code`` a table of codes. The comment above a rule is its docstring, the one behind a field that of the field. What
CDDL cannot say is read from the comment of the field: ``0-basics.cddl`` lists these words. The limits of messages are
those of ``schemas/README.md``. Methods and checks are written by hand, in ``message_methods.py``.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "python" / "src" / "curionav" / "messages.py"
METHODS = TARGET.with_name("message_methods.py")

HEAD = '''"""The messages of the wire contract, one frozen dataclass each; units are SI and radians.

Poses are in the map frame unless a field says otherwise, arrays are NumPy arrays. ``Message.encode()`` gives the CBOR
bytes, ``Message.decode(bytes)`` reads and checks them. `generate_messages.py` writes this file from the contract,
``schemas/*.cddl``: change it there. A docstring says what stands on the wire; a field that is absent there is ``None``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from . import message_methods as methods
from .array import F32, F64, I8, U8, U32, Array, Indices, ScoredOnly
from .field_types import (
    Bytes,
    Float,
    Fraction,
    Integer,
    MapId,
    Name,
    NonNegative,
    Number,
    Params,
    Positive,
    Text,
    Uint,
    Uint32,
)
from .message_methods import NO_PARENT
from .record import Message, Record, coded


'''

SCALARS = {
    "bool": "bool",
    "tstr": "str",
    "bstr": "Annotated[bytes, Bytes()]",
    "uint": "Uint",
    "uint32": "Uint32",
    "identifier": "Name",
    "name": "Name",
    "sha256": "Annotated[str, Text(is_hash=True)]",
    "map_id": "MapId",
    "params": "Params",
}
NO_CLASSES = {*SCALARS, "f64_array", "f32_array", "u32_array", "i8_array", "u8_array", "rejected_candidate"}
"""Rules that another field type stands for."""


@dataclass
class Field:
    """A field of a map, and what its comments say."""

    name: str
    type: str
    optional: bool
    doc: str

    def says(self, pattern: str) -> re.Match[str] | None:
        """Where the comment has these words."""
        return re.search(pattern, self.doc)


@dataclass
class Rule:
    """A rule of the contract: a map has fields, any other rule alternatives."""

    name: str
    doc: str
    fields: list[Field]
    alternatives: list[str]

    @property
    def title(self) -> str:
        """Its name in Python."""
        return "".join(word.capitalize() for word in self.name.split("_"))

    def names(self) -> set[str]:
        """The rules that it may mention, and other words."""
        types = [*self.alternatives, *(field.type for field in self.fields)]
        return set(re.findall(r"[a-z_0-9]+", re.sub(r'"[^"]*"', "", " ".join(types))))


@dataclass
class Contract:
    """What there is: the rules, the messages with their limits in KiB, and the classes of methods."""

    rules: dict[str, Rule]
    limits: dict[str, int]
    methods: set[str]

    def base(self, rule: Rule) -> str:
        """The class that the class of a rule is derived from."""
        unions = (union.title for union in self.rules.values() if rule.name in union.alternatives)
        return next(unions, "Message" if rule.name in self.limits else "Record")


def read_rules(text: str) -> dict[str, Rule]:
    """The rules of a CDDL text by name, in its order."""
    rules = {}
    doc: list[str] = []
    # Rules, lines of comments and empty lines.
    for block in re.split(r"\n(?=\n|;|[a-z_0-9]+ = )", text):
        head = re.match(r"([a-z_0-9]+) = ", block)
        if head:
            rules[head[1]] = read_rule(head[1], " ".join(doc), block[head.end() :].rstrip())
        # A line of dashes begins a part of the file.
        is_doc = block.startswith(";") and "----" not in block
        doc = [*doc, block.strip("; ")] if is_doc else []
    return rules


def read_rule(name: str, doc: str, body: str) -> Rule:
    """One rule from what stands behind its equals sign."""
    if body.startswith("{\n"):
        return Rule(name, doc, list(read_fields(body.splitlines()[1:-1])), [])
    lines = [line.partition(";") for line in body.splitlines()]
    alternatives = [part.strip(" /") for code, _, _ in lines for part in code.split(" / ")]
    alternatives = [part for part in alternatives if part]
    if len(alternatives) == 1 and alternatives[0].startswith("{ kind:"):
        return Rule(name, doc, [read_field(part, "") for part in alternatives[0].strip("{} ").split(", ")], [])
    return Rule(name, doc or lines[0][2].strip(), [], alternatives)


def read_fields(lines: list[str]) -> Iterator[Field]:
    """The fields of a map, one a line; a comment by itself belongs to the next, or far to the right to the last."""
    found: list[Field] = []
    above: list[str] = []
    for line in lines:
        code, _, comment = line.partition(";")
        if code.strip():
            doc = "\n".join([*above, *([comment.strip()] if comment else [])])
            found.append(read_field(code.strip(" ,"), doc))
            above = []
        elif len(code) > 20 and found:
            found[-1].doc += " " + comment.strip()
        else:
            above.append(comment.removeprefix(" "))
    yield from found


def read_field(code: str, doc: str) -> Field:
    """One field, such as ``? person: uint32``."""
    name, _, kind = code.partition(":")
    return Field(name.strip("? "), kind.strip(), name.startswith("?"), doc)


def hint(field: Field) -> str:
    """The annotation of a field, but for being optional."""
    kind = field.type
    if kind in SCALARS:
        return SCALARS[kind]
    if kind == "float":
        return float_hint(field)
    if kind.endswith("_array"):
        return array_hint(field)
    if kind.startswith('"'):
        return literal(kind.split(" / "))
    if within := re.fullmatch(r"(\d+)\.\.(\d+)", kind):
        return f"Annotated[int, Integer({within[1]}, {within[2]})]"
    if kind == "[* rejected_candidate]":
        return 'Annotated[list[dict[str, Any] | None], methods.Rejections("candidates.count", Rejection)]'
    if listed := re.fullmatch(r"\[(?:0\*(\d+)|\*) (\w+)\]", kind):
        return limited(f"list[{hint(Field('', listed[2], False, ''))}]", field, listed[1])
    if mapped := re.fullmatch(r"\{ (?:0\*(\d+)|\*) (\w+) => (\w+) \}", kind):
        entries = f"dict[str, {hint(Field('', mapped[3], False, field.doc))}]"
        return limited(entries, field, mapped[1], *(['"free_keys": True'] if mapped[2] == "tstr" else []))
    return "".join(word.capitalize() for word in kind.split("_"))


def limited(kind: str, field: Field, limit: str | None, *notes: str) -> str:
    """A list or map, with a limit of its own if there is one."""
    notes = (*([f'"limit": {limit}'] if limit else []), *notes)
    # A note that cannot be hashed must stand outside the choice with `None`.
    kind += " | None" if notes and field.optional else ""
    return f"Annotated[{kind}, {{{', '.join(notes)}}}]" if notes else kind


def float_hint(field: Field) -> str:
    """A number, as its comment limits it."""
    most = field.says(r"at most (\d+\.\d+)")
    if most and field.says("positive"):
        return f"Annotated[float, Float(high={most[1]}, positive=True)]"
    words = {"positive": "Positive", "not negative": "NonNegative", r"\b0(\.\.| to )1\b": "Fraction"}
    return next((name for word, name in words.items() if field.says(word)), "Number")


def array_hint(field: Field) -> str:
    """A typed array of the shape that its comment begins with."""
    element = field.type.removesuffix("_array")
    if field.says("indices of the candidates"):
        return f'Annotated[{element.upper()}, Indices("candidates.count")]'
    shape = field.says(r"\[([^]]*)\]")
    if shape is None:
        raise ValueError(f"{field.name}: the comment of an array has its shape, such as [people]")
    if shape[1] == "scored":
        return f'Annotated[{element.upper()}, ScoredOnly("candidates.count")]'
    dims, _, limit = shape[1].partition(" <= ")
    arguments = [f'"{element}"']
    for dim in dims.split(", "):
        name = re.findall(r"[a-zA-Z*]+|\d+$", dim)[0]
        arguments.append(name if name.isdigit() else f'"{name}"')
    within = field.says(r"(-?\d+)\.\.(\d+)")
    if within:
        arguments += [f"low={within[1]}", f"high={within[2]}"]
    elif element == "u32":
        arguments.append("high=2**32 - 1")
    elif field.says("not negative"):
        arguments.append("low=0.0")
    if field.says("or NaN"):
        arguments.append("nan=True")
    if limit:
        arguments.append(f"limit={limit}")
    return f"Annotated[{element.upper()}, Array({', '.join(arguments)})]"


def literal(texts: list[str]) -> str:
    """One of a few texts."""
    return f"Literal[{', '.join(texts)}]"


def wrapped(begin: str, entries: list[str], end: str) -> str:
    """A list in brackets, over several lines if it is long."""
    line = f"{begin}{', '.join(entries)}{end}"
    if len(line) <= 119:
        return line
    # A blank inside an entry is no place to break a line.
    glued = " ".join(entry.replace(" ", "\0") + "," for entry in entries)
    lines = textwrap.fill(glued, 119, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)
    return f"{begin}\n{lines.replace(chr(0), ' ')}\n{end}"


def docstring(doc: str, indent: str) -> str:
    """A docstring of the first sentence, and after an empty line the rest; one of several lines stays as it is."""
    if "\n" in doc:
        return textwrap.indent(f'"""{doc}\n"""\n', indent)
    first, _, rest = re.sub(r"(?<=[a-z0-9)`\"]\.) ", "\n", doc, count=1).partition("\n")
    paragraphs = [textwrap.fill(first, 110 - len(indent)), *([textwrap.fill(rest, 119 - len(indent))] if rest else [])]
    quotes = '"""'
    end = f"\n{quotes}" if "\n" in "\n\n".join(paragraphs) else quotes
    return textwrap.indent(f"{quotes}{(chr(10) * 2).join(paragraphs)}{end}\n", indent)


def python(rule: Rule, contract: Contract) -> str:
    """The class, or the type of a field, that a rule becomes."""
    first = rule.alternatives[0] if rule.alternatives else ""
    if first.startswith("{"):
        return codes(rule) + "\n" + docstring(rule.doc, "")
    if first.startswith('"'):
        return wrapped(f"{rule.title} = Literal[", rule.alternatives, "]") + "\n" + docstring(rule.doc, "")
    return class_of(rule, contract)


def codes(rule: Rule) -> str:
    """The type of a reason: its codes, each with the parameters that it has."""
    table = []
    for alternative in rule.alternatives:
        (_, code), *parameters = (part.split(": ", 1) for part in alternative.strip("{} ").split(", "))
        kinds = [f'"{name}": {hint(Field(name, kind, False, ""))}' for name, kind in parameters]
        table.append(f"{code}: {{{', '.join(kinds)}}}")
    unknown = ', otherwise="unknown"' if '{ code: "unknown" }' in rule.alternatives else ""
    return wrapped(f"{rule.title} = Annotated[dict[str, Any], coded({{", table, f"}}{unknown})]")


def class_of(rule: Rule, contract: Contract) -> str:
    """A class of fields, or of no field for what is one of several classes."""
    parents = [f"methods.{rule.title}"] if rule.title in contract.methods else []
    parents.append(contract.base(rule))
    lines = [] if rule.alternatives else ["@dataclass(frozen=True, eq=False, kw_only=True)"]
    lines += [f"class {rule.title}({', '.join(parents)}):", docstring(rule.doc, "    ")]
    if rule.name in contract.limits:
        lines.append(f'    NAME: ClassVar[str] = "{rule.name}"')
        lines.append(f"    MAX_BYTES: ClassVar[int] = {contract.limits[rule.name]} << 10")
    if rule.alternatives:
        lines.append("    TAGGED: ClassVar[bool] = True")
    for field in rule.fields:
        kind = hint(field)
        if field.name == "kind":
            kind += f" = {field.type}"
        elif field.optional:
            if field.says("no if left out"):
                kind += " = False"
            else:
                kind += " = None" if "| None," in kind else " | None = None"
        lines.append(f"    {field.name}: {kind}")
        if field.doc:
            lines.append(docstring(in_python(field), "    ").rstrip("\n"))
    return "\n".join(lines) + "\n"


def in_python(field: Field) -> str:
    """The comment of a field, where Python's value has another form than that on the wire."""
    if field.type == "[* rejected_candidate]":
        return "one entry per candidate: why it was rejected, `None` if it was not"
    return field.doc.replace("[scored]", "[candidates], NaN for one that is not scored:")


def in_order(rules: dict[str, Rule]) -> list[Rule]:
    """The rules that become something in Python, each behind those that it mentions."""
    done: dict[str, Rule] = {}

    def visit(rule: Rule) -> None:
        if rule.name in done or rule.name in NO_CLASSES:
            return
        is_union = bool(rule.alternatives) and rule.alternatives[0] in rules
        if is_union:
            done[rule.name] = rule
        for name in sorted(rule.names() & rules.keys()):
            visit(rules[name])
        done.setdefault(rule.name, rule)

    for rule in rules.values():
        visit(rule)
    return list(done.values())


def generate() -> str:
    """The text of ``messages.py``."""
    schemas = ROOT / "schemas"
    rules = read_rules("\n".join(path.read_text("utf-8") for path in sorted(schemas.glob("*.cddl"))))
    readme = (schemas / "README.md").read_text("utf-8")
    limits = {name: int(size) for name, size in re.findall(r"^\| `(\w+)` \| (\d+) KiB \|$", readme, re.MULTILINE)}
    methods = set(re.findall(r"^class (\w+)\(Record\)", METHODS.read_text("utf-8"), re.MULTILINE))
    ordered = in_order(rules)
    contract = Contract(rules, limits, methods)
    parts = [python(rule, contract) for rule in ordered]
    titles = [rules[name].title for name in limits]
    table = wrapped("_MESSAGES: list[type[Message]] = [", titles, "]")
    table += "\n\nMESSAGES: dict[str, type[Message]] = {message.NAME: message for message in _MESSAGES}"
    parts.append(table + '\n"""Every message by its name in the encoding string, which is also its CDDL rule."""\n')
    names = {*(rule.title for rule in ordered), "MESSAGES", "NO_PARENT", "Message", "Record"}
    public = sorted(names, key=lambda name: (not name.isupper(), name))
    parts.append(wrapped("__all__ = [", [f'"{name}"' for name in public], "]") + "\n")
    return HEAD + "\n\n".join(parts)


if __name__ == "__main__":
    TARGET.write_text(generate(), "utf-8")
