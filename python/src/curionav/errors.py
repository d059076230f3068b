"""What can go wrong: one class for each thing that a caller may want to treat differently."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .words import say


class CurionavError(Exception):
    """Base of everything this package raises on its own."""


class ConnectionFailed(CurionavError, ConnectionError):  # noqa: N818 - reads as the outcome it is
    """No router answered in time, or the session's configuration was refused."""


class NoAnswer(CurionavError, TimeoutError):  # noqa: N818
    """No service has what was asked for, or the one that has it did not answer in time."""


class Rejected(CurionavError):  # noqa: N818
    """A service refused a request.

    Attributes:
        field: Path of the field at fault, such as ``robot.goal``; ``None`` if it concerns no field.
        why: The refusal: its ``code`` and the parameters of that code (``refusal`` in ``schemas/service.cddl``).
        code: What kind of refusal it is, for a program, such as ``out_of_range``, ``overloaded`` or ``stopped``.
        reason: What is wrong, for a person.
        file: The file that the field is in, if it is known.
    """

    def __init__(self, field: str | None, why: dict[str, Any], file: Path | None = None) -> None:
        self.field = field
        self.why = why
        self.code: str = why["code"]
        self.reason = say("refusal", why)
        self.file = file
        super().__init__(": ".join(str(part) for part in (file, field, self.reason) if part))


class EvaluatorError(CurionavError):
    """An evaluator's function raised, was late, or gave anything but one finite cost >= 0 per candidate.

    Attributes:
        term: The term that the evaluator computes.
        reason: What is wrong, for a person.
    """

    def __init__(self, term: str, reason: str) -> None:
        super().__init__(f"{term} {reason}")
        self.term = term
        self.reason = reason


class RunFailed(CurionavError):  # noqa: N818
    """A run ended without a result: it was cancelled, a service was lost, or the world went on to another run.

    Attributes:
        end: Why the mission ended, if the world says so: a ``code`` and its parameters (``mission_end`` in
            ``schemas/mission.cddl``).
    """

    def __init__(self, reason: str, end: dict[str, Any] | None = None) -> None:
        super().__init__(reason)
        self.end = end


class ScenarioError(CurionavError, ValueError):
    """A scenario cannot be sent: a file it names is missing, or a value has no form on the wire.

    Attributes:
        field: Path of the field at fault, such as ``map.file``.
        reason: What is wrong, for a person.
    """

    def __init__(self, field: str, reason: str) -> None:
        super().__init__(f"{field}: {reason}" if field else reason)
        self.field = field
        self.reason = reason


class DatasetError(CurionavError):
    """A file of a dataset is not there, or cannot be downloaded."""


class FileError(CurionavError, ValueError):
    """A file is not what it was taken for.

    Attributes:
        file: Which file.
        line: Number of the line at fault, from 1; ``None`` if it is no single line.
        reason: What is wrong and what mends it, for a person.
    """

    def __init__(self, file: str | os.PathLike[str], reason: str, line: int | None = None) -> None:
        super().__init__(f"{file}: {reason}" if line is None else f"{file}, line {line}: {reason}")
        self.file = file
        self.line = line
        self.reason = reason


class IncompleteResult(CurionavError, ValueError):  # noqa: N818
    """A result lacks what a picture or an export needs, such as its trace or the map."""


class MissingExtra(CurionavError, ImportError):  # noqa: N818
    """A library that only an extra of this package brings is not installed; the message names the extra."""


class MessageError(CurionavError, ValueError):
    """A message has a field it may not have.

    Attributes:
        message: Name of the message, such as ``cycle_report``.
        field: Path of the field at fault, such as ``scene.people.x``; empty for the message as a whole.
        why: What is wrong: a ``code`` and its parameters (``refusal`` in ``schemas/service.cddl``).
        reason: The same for a person.
    """

    def __init__(self, message: str, field: str, why: dict[str, Any]) -> None:
        self.message = message
        self.field = field
        self.why = why
        self.reason = say("refusal", why)
        super().__init__(f"{message}: {field}: {self.reason}" if field else f"{message}: {self.reason}")


class DecodeError(MessageError):
    """Bytes that were received are not the message they were taken for."""


class EncodeError(MessageError):
    """A message cannot be sent as it is: its reader would refuse it."""


class PlannerError(CurionavError):
    """A planner of one's own cannot be used: it is not there, raised, or answered what is no proposal."""

    def __init__(self, planner: str, problem: str) -> None:
        super().__init__(f"planner {planner}: {problem}")
