"""Results that ``curionav run`` has left behind: its JSON, the folder of ``--out``, a recording of ``--record``."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .errors import FileError
from .extras import library
from .field_types import Fault, Scope
from .messages import Message, Mission, MissionOrder, OccupancyGrid, PeopleTrace, RunResult, RunStatus, Trace
from .record import Part

_WHAT = (
    "give the folder of `curionav run --out`, a recording of `curionav run --record` (.mcap), or what "
    "`curionav run --json` prints"
)
_KINDS = {f"curionav.{kind.NAME}.v1": kind for kind in (RunStatus, Mission, OccupancyGrid)}


@dataclass(frozen=True)
class StoredResult:
    """The result of a run; with its mission and map where the file has them."""

    message: RunResult
    order: MissionOrder | None = None
    grid: OccupancyGrid | None = None


def read(path: Path) -> StoredResult:
    """The result in a file or folder; of a recording with several runs that of the last.

    Raises:
        FileError: There is no result, or it is damaged.
        MissingExtra: It is a recording, and mcap is not installed.
    """
    if path.is_dir():
        path /= "metrics.json"
    if path.suffix == ".mcap":
        return _recorded(path)
    return StoredResult(_summary(path))


def _summary(path: Path) -> RunResult:
    """The JSON of a run; the trace lies beside it if it is ``metrics.json`` of a folder."""
    try:
        data = json.loads(_text(path))
    except json.JSONDecodeError as error:
        raise FileError(path, f"this is no JSON ({error.msg}); {_WHAT}", error.lineno) from error
    if not isinstance(data, dict) or not isinstance(data.get("metrics"), dict):
        raise FileError(path, f"this JSON is no result of a run; {_WHAT}")
    beside = path.with_name("trajectory.csv")
    trace = _trace(beside) if path.name == "metrics.json" else _trace_of([], [])
    try:
        # A measure without a value is null in the file and absent in the message.
        measures = {name: value for name, value in data.pop("metrics").items() if value is not None}
        plain = {**data, "measures": measures, "trace": Part(Trace).give(trace, Scope({}))}
        message = Part(RunResult).take(plain, Scope({}))
    except Fault as fault:
        raise FileError(path, f"{fault.path}: {fault.reason}; {_WHAT}") from None
    assert isinstance(message, RunResult)
    return message


def _trace(path: Path) -> Trace:
    header, *lines = _text(path).splitlines() or [""]
    columns, rows = header.split(","), []
    for number, line in enumerate(lines, 2):
        try:
            row = [float(value) for value in line.split(",")]
        except ValueError as error:
            raise FileError(path, f"{error}; write the folder anew with `curionav run --out`", number) from error
        if len(row) != len(columns):
            raise FileError(path, f"has {len(row)} numbers, but the first line names {len(columns)} columns", number)
        rows.append(row)
    return _trace_of(columns, rows)


def _trace_of(columns: list[str], rows: list[list[float]]) -> Trace:
    """A trace whose people were not stored."""
    none = PeopleTrace(
        rows=0, id=np.empty(0, np.uint32), xy=np.empty((0, 0, 2), np.float32), present=np.empty((0, 0), np.uint8)
    )
    return Trace(rows=len(rows), columns=columns, values=np.array(rows).reshape(len(rows), len(columns)), people=none)


def _recorded(path: Path) -> StoredResult:
    """The last result of a recording. Whose mission it was is known only if one robot was recorded."""
    orders: dict[str, MissionOrder] = {}
    grids: dict[bytes, OccupancyGrid] = {}
    found: StoredResult | None = None
    for topic, message in _messages(path):
        if isinstance(message, Mission):
            orders[topic] = message.order
        elif isinstance(message, OccupancyGrid):
            grids[message.map] = message
        elif isinstance(message, RunStatus) and message.result is not None:
            order = next(iter(orders.values())) if len(orders) == 1 else None
            found = StoredResult(message.result, order, grids.get(order.map) if order else None)
    if found is None:
        raise FileError(path, "no run of this recording has ended with a result; record one with `curionav run`")
    return found


def _messages(path: Path) -> list[tuple[str, Message]]:
    """(topic, message) of what is needed of a recording, by time."""
    reader, exceptions = library("mcap.reader"), library("mcap.exceptions")
    try:
        with path.open("rb") as file:
            recording = reader.make_reader(file)
            summary = recording.get_summary()
            if summary is None:
                mend = f"`curionav record whole.mcap --recover {path.name}` writes one that has it"
                raise FileError(path, f"the recording has no index, for its recorder was killed; {mend}")
            named = {channel.topic: summary.schemas.get(channel.schema_id) for channel in summary.channels.values()}
            topics = [topic for topic, schema in named.items() if schema is not None and schema.name in _KINDS]
            entries: Any = recording.iter_messages(topics=topics) if topics else ()
            return [(channel.topic, _KINDS[schema.name].decode(entry.data)) for schema, channel, entry in entries]
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror}") from error
    except (exceptions.McapError, exceptions.EndOfFile, ValueError, struct.error) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(path, f"this is no recording of curionav, or it is damaged: {error}") from error


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(path, f"cannot be read: {error.strerror}; {_WHAT}") from error
    except UnicodeDecodeError as error:
        raise FileError(path, f"this is no text; {_WHAT}") from error
