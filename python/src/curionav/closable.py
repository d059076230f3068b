"""What is closed at the end of its ``with`` block."""

from __future__ import annotations

from types import TracebackType
from typing import Self


class Closable:
    """What has a ``close`` that a ``with`` block calls at its end."""

    def close(self) -> None:
        """Closes it."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
