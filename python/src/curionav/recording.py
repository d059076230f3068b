"""Messages of a recording: an MCAP file with messages of the contract, on topics named by their Zenoh keys."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from mcap.records import Message as Entry
from mcap.stream_reader import StreamReader

from . import keys
from .errors import CurionavError, DecodeError
from .messages import MESSAGES, Message

_ROBOT = f"{keys.ROOT}/robot/"
_MAGIC = b"\x89MCAP0\r\n"

_log = logging.getLogger("curionav")


class BadRecording(CurionavError):  # noqa: N818 - reads as what it is
    """A file is no recording of curionav's, or has nothing to show."""


@dataclass(frozen=True)
class Recorded:
    """A message as it was recorded."""

    stamp_ns: int
    """ns: the robot's clock, placed along wall time"""
    message: Message


@dataclass(frozen=True)
class _Entry:
    """A message as it stands in the file."""

    topic: str
    name: str
    """of the message"""
    stamp_ns: int
    data: bytes


def robots(path: Path) -> list[str]:
    """Names of the robots a recording tells of."""
    topics = _index(path) or {entry.topic for entry in _entries(path, quiet=True)}
    return sorted({topic.removeprefix(_ROBOT).partition("/")[0] for topic in topics if topic.startswith(_ROBOT)})


def _index(path: Path) -> set[str]:
    """Topics by the index at the end of the file; none if it has none."""
    with contextlib.suppress(OSError, McapError, EndOfFile, ValueError), path.open("rb") as file:
        summary = make_reader(file).get_summary()
        if summary is not None:
            return {channel.topic for channel in summary.channels.values()}
    return set()


def messages(path: Path, robot: str | None = None) -> Iterator[Message]:
    """The messages about a robot, without their times; see `entries`."""
    return (entry.message for entry in entries(path, robot))


def entries(path: Path, robot: str | None = None) -> Iterator[Recorded]:
    """The messages about a robot, in their order; maps and worlds belong to all. Ends early where a file was cut short.

    Raises:
        BadRecording: There is no such file, it is no MCAP, or it holds no message of this robot.
    """
    found = robots(path)
    if not found:
        raise BadRecording(f"{path} holds no messages of curionav: record with `curionav record` or `run --record`")
    if robot is None and len(found) > 1:
        raise BadRecording(f"{path} tells of several robots: choose one with --robot: {', '.join(found)}")
    if robot is not None and robot not in found:
        raise BadRecording(f"{path} has no robot `{robot}`; it tells of {', '.join(found)}")
    own = f"{_ROBOT}{robot or found[0]}/"
    refused = 0
    for entry in _entries(path):
        kind = MESSAGES.get(entry.name)
        if kind is None or (entry.topic.startswith(_ROBOT) and not entry.topic.startswith(own)):
            continue
        # A further sensor's scan would be taken for the scanner's.
        if entry.topic.startswith(f"{own}scan/"):
            continue
        try:
            yield Recorded(entry.stamp_ns, kind.decode(entry.data))
        except DecodeError as error:
            refused += 1
            _log.warning("passed over: %s", error)
    if refused:
        _log.warning("%d messages of %s were not understood", refused, path)


def _entries(path: Path, quiet: bool = False) -> Iterator[_Entry]:
    """What is in CBOR; the pictures beside it are for others."""
    try:
        file = path.open("rb")
    except OSError as error:
        raise BadRecording(f"cannot read {path}: {error.strerror}") from error
    with file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise BadRecording(f"{path} is no MCAP recording")
        file.seek(0)
        schemas: dict[int, str] = {}
        channels: dict[int, tuple[str, str]] = {}
        try:
            # In the file's order and without its index, which a recording that was killed does not have.
            for record in StreamReader(file).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, Channel) and record.message_encoding == "cbor":
                    name = schemas.get(record.schema_id, "")
                    channels[record.id] = (record.topic, _message(record.topic, name))
                elif isinstance(record, Entry) and record.channel_id in channels:
                    topic, name = channels[record.channel_id]
                    yield _Entry(topic, name, record.log_time, record.data)
        except EndOfFile:
            if not quiet:
                _log.warning("%s ends in the middle: it was cut short", path)
        except McapError as error:
            raise BadRecording(f"{path} is damaged: {error}") from error


_BY_TOPIC = {"odom": "odometry", "cmd": "twist", "report": "cycle_report", "run": "run_status"}
"""Last chunks of keys that are not the name of their message."""


def _message(topic: str, schema: str) -> str:
    """Name of the message, from the schema's (``curionav.scan.v1``, or ``scan``), else from the key."""
    for part in (schema, schema.removeprefix("curionav.").removesuffix(".v1")):
        if part in MESSAGES:
            return part
    if topic.startswith(f"{keys.ROOT}/map/"):
        return "occupancy_grid"
    last = topic.rpartition("/")[2]
    return _BY_TOPIC.get(last, last)
