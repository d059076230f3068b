"""Libraries that are imported only when a function needs them."""

from __future__ import annotations

import importlib
from typing import Any

from .errors import MissingExtra


def library(name: str, extra: str = "frames") -> Any:
    """The module of this name, such as ``pandas`` or ``mcap.reader``.

    Args:
        name: The module, with dots.
        extra: The optional dependencies of this package that bring it.

    Raises:
        MissingExtra: It is not installed.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise MissingExtra(
            f"{name.partition('.')[0]} is not installed; `pip install 'curionav[{extra}]'` brings it, in a checkout "
            f"`pip install './python[{extra}]'`"
        ) from error
