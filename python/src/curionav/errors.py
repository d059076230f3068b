"""What can go wrong, one class for each thing a caller may want to treat differently."""

from __future__ import annotations


class CurionavError(Exception):
    """Base of everything this package raises on its own."""


class ConnectionFailed(CurionavError, ConnectionError):  # noqa: N818 - reads as the outcome it is
    """No router answered in time, or the session's configuration was refused."""


class NoAnswer(CurionavError, TimeoutError):  # noqa: N818
    """Nobody serves what was asked for, or whoever does did not answer in time."""


class Rejected(CurionavError):  # noqa: N818
    """A service refused a request.

    Attributes:
        field: Path of the field at fault, such as ``robot.goal``; ``None`` if it concerns no field.
        reason: What is wrong, for a person.
        code: What kind of refusal it is, for a program: ``malformed``, ``oversize``, ``version``, ``invalid``,
            ``overloaded``, ``stopped``, ``cold`` or ``unknown``.
    """

    def __init__(self, field: str | None, reason: str, code: str) -> None:
        super().__init__(f"{field}: {reason}" if field else reason)
        self.field = field
        self.reason = reason
        self.code = code


class EvaluatorError(CurionavError):
    """An evaluator's function raised, was late, or gave anything but one finite cost >= 0 a candidate.

    Attributes:
        metric: Which evaluator.
        reason: What is wrong, for a person.
    """

    def __init__(self, metric: str, reason: str) -> None:
        super().__init__(f"{metric} {reason}")
        self.metric = metric
        self.reason = reason


class RunFailed(CurionavError):  # noqa: N818
    """A run ended without a result: it was cancelled, a service was lost, or the world went on to another run."""


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


class MessageError(CurionavError, ValueError):
    """A message has a field it may not have.

    Attributes:
        message: Name of the message, such as ``cycle_report``.
        field: Path of the field at fault, such as ``scene.people.x``; empty for the message as a whole.
        reason: What is wrong, for a person.
    """

    def __init__(self, message: str, field: str, reason: str) -> None:
        super().__init__(f"{message}: {field}: {reason}" if field else f"{message}: {reason}")
        self.message = message
        self.field = field
        self.reason = reason


class DecodeError(MessageError):
    """Bytes that were received are not the message they were taken for."""


class EncodeError(MessageError):
    """A message cannot be sent as it is: its reader would refuse it."""
