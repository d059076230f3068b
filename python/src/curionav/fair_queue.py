"""A bounded queue shared fairly: one line for each robot, served in turn."""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from typing import Generic, TypeVar

T = TypeVar("T")


class FairQueue(Generic[T]):
    """Items waiting, by who sent them; safe to use from several threads. It is bounded in items and in bytes.

    >>> queue = FairQueue[int](4, 100)
    >>> [queue.push(robot, item, 10) for robot, item in [("a", 1), ("a", 2), ("a", 3), ("b", 4)]]
    [[], [], [], []]
    >>> queue.push("b", 5, 10)  # full: the newest of the longest line goes
    [3]
    >>> queue.push("c", 6, 1000)  # more than may wait at all
    [6]
    >>> [queue.pop() for _ in range(4)]
    [1, 4, 2, 5]
    """

    def __init__(self, limit: int, limit_bytes: int) -> None:
        self._lines: OrderedDict[str, deque[tuple[int, T]]] = OrderedDict()  # in the order of their turns
        self._waiting = 0
        self._bytes = 0
        self._limit = max(limit, 1)
        self._limit_bytes = limit_bytes
        self._ended = False
        self._changed = threading.Condition()

    def push(self, robot: str, item: T, size: int) -> list[T]:
        """Adds an item of ``robot``, of ``size`` bytes; gives back what finds no room: ``item`` itself or others'."""
        refused: list[T] = []
        with self._changed:
            if self._ended or size > self._limit_bytes:
                return [item]
            while not (has_room := self._waiting < self._limit) or self._bytes + size > self._limit_bytes:
                # By what there is too much of: bytes, or items.
                own = self._share(robot, has_room) + (size if has_room else 1)
                longest = min(self._lines, key=lambda name: (-self._share(name, has_room), name), default=None)
                if longest is None or own >= self._share(longest, has_room):
                    return [*refused, item]
                refused.append(self._take(longest, newest=True))
            self._lines.setdefault(robot, deque()).append((size, item))
            self._waiting += 1
            self._bytes += size
            self._changed.notify()
        return refused

    def _share(self, robot: str, in_bytes: bool) -> int:
        line = self._lines.get(robot, ())
        return sum(size for size, _ in line) if in_bytes else len(line)

    def _take(self, robot: str, newest: bool) -> T:
        line = self._lines[robot]
        size, item = line.pop() if newest else line.popleft()
        if not line:
            del self._lines[robot]
        self._waiting -= 1
        self._bytes -= size
        return item

    def pop(self) -> T | None:
        """The next item, waited for: the oldest of the robot whose turn it is. ``None`` once the queue has ended."""
        with self._changed:
            while not self._lines:
                if self._ended:
                    return None
                self._changed.wait()
            robot = next(iter(self._lines))
            item = self._take(robot, newest=False)
            if robot in self._lines:
                self._lines.move_to_end(robot)
            return item

    def end(self) -> None:
        """Takes nothing more; what waits is still given out."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def __len__(self) -> int:
        return self._waiting
