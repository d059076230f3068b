"""The extension module, and how its refusals become errors of this package."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import cbor2

from .errors import MissingExtra, Rejected, RunFailed
from .field_types import Scope, plain
from .messages import Reject, RunStatus
from .record import Part, Record
from .words import say


def module() -> Any:
    """The module ``curionav_native``.

    Raises:
        MissingExtra: This installation was made without it.
    """
    try:
        return importlib.import_module("curionav_native")
    except ModuleNotFoundError as error:
        raise MissingExtra(
            "this installation has no module `curionav_native`, which runs in process; install a wheel that has it, or "
            "in a checkout, on a machine with Rust, `pip install ./python`"
        ) from error


@contextlib.contextmanager
def errors(file: Path | None = None) -> Iterator[ModuleType]:
    """The module, whose refusals are raised as errors of this package.

    Args:
        file: The file that holds what it is given, if there is one.

    Raises:
        Rejected: What was given is refused; the error names the field.
        RunFailed: A run ended without a result.
        MissingExtra: This installation was made without the module.
    """
    native = module()
    try:
        yield native
    except native.Refused as refused:
        reject = Reject.decode(refused.args[0])
        raise Rejected(reject.field, reject.why, file) from None
    except native.Ended as ended:
        end = RunStatus.decode(ended.args[0]).error
        raise RunFailed(say("end", end), end) from None


def part(record: Record | None) -> bytes | None:
    """The bytes of a part of a message, if there is one."""
    return None if record is None else cbor2.dumps(Part(type(record)).give(record, Scope({})))


def table(values: Mapping[str, Any] | None) -> bytes:
    """The bytes of tables as in a file."""
    return cbor2.dumps(plain(dict(values or {})))
