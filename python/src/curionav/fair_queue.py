"""A bounded queue shared fairly: one line for each robot, served in turn."""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from typing import Generic, TypeVar

T = TypeVar("T")


class FairQueue(Generic[T]):
    """Items waiting, by who sent them; safe to use from several threads.

    >>> queue = FairQueue[int](4)
    >>> [queue.push(robot, item) for robot, item in [("a", 1), ("a", 2), ("a", 3), ("b", 4)]]
    [None, None, None, None]
    >>> queue.push("b", 5)  # full: the newest of the longest line goes
    3
    >>> [queue.pop() for _ in range(4)]
    [1, 4, 2, 5]
    """

    def __init__(self, limit: int) -> None:
        self._lines: OrderedDict[str, deque[T]] = OrderedDict()  # in the order of their turns
        self._waiting = 0
        self._limit = max(limit, 1)
        self._ended = False
        self._changed = threading.Condition()

    def push(self, robot: str, item: T) -> T | None:
        """Adds an item of ``robot``; gives back the one that finds no room, ``item`` itself or another's."""
        refused: T | None = None
        with self._changed:
            if self._ended:
                return item
            if self._waiting >= self._limit:
                own = len(self._lines.get(robot, ()))
                longest = min(self._lines, key=lambda name: (-len(self._lines[name]), name))
                if own + 1 >= len(self._lines[longest]):
                    return item
                refused = self._lines[longest].pop()
                self._waiting -= 1
            self._lines.setdefault(robot, deque()).append(item)
            self._waiting += 1
            self._changed.notify()
        return refused

    def pop(self) -> T | None:
        """The next item, waited for: the oldest of the robot whose turn it is. ``None`` once the queue has ended."""
        with self._changed:
            while not self._lines:
                if self._ended:
                    return None
                self._changed.wait()
            robot, line = self._lines.popitem(last=False)
            item = line.popleft()
            if line:
                self._lines[robot] = line
            self._waiting -= 1
            return item

    def end(self) -> None:
        """Takes nothing more; what waits is still given out."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def __len__(self) -> int:
        return self._waiting
