"""Playing the people of a simulated world from Python: any simulator, recording or detector can be the crowd.

With every tick the simulator says where the robot really is; the crowd answers with the people of that tick. In
lockstep the simulator waits for them, in real time it takes the newest.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import zenoh
from numpy.typing import ArrayLike

from . import keys
from .array import F64, U32
from .closable import Closable
from .errors import DecodeError, EncodeError
from .messages import Odometry, People
from .session import Mailbox, News, close_at_exit, publish, subscribe

_MAILBOX_BYTES = 1 << 20
"""Ticks that may wait: thousands; in lockstep there is one."""
_WAIT = 0.5
_STOP_TIMEOUT = 2.0
_AGAIN = 0.3
"""A question for a tick that comes again so long after its answer is from another run, seconds."""

_log = logging.getLogger("curionav")


@dataclass(frozen=True)
class CrowdStep:
    """A tick of the world whose people are wanted.

    Attributes:
        tick: Number of the tick, from 0.
        time: Simulated seconds since the start of the run.
        robot: Where the robot really is: ``x``, ``y`` (m) and ``heading`` (rad) in the map frame, ``v`` (m/s) and
            ``omega`` (rad/s).
    """

    tick: int
    time: float
    robot: Odometry


def people(  # noqa: PLR0917 - the columns of a table of people
    step: CrowdStep,
    x: ArrayLike,
    y: ArrayLike,
    vx: ArrayLike | None = None,
    vy: ArrayLike | None = None,
    ids: ArrayLike | None = None,
) -> People:
    """The people of a step: m and m/s, map frame, arrays of one shape [people].

    Args:
        step: The tick they are of.
        x: Positions.
        y: Positions.
        vx: Velocities; default: they stand.
        vy: Velocities; default: they stand.
        ids: Whole numbers, steady over time, below 4 billion; default: 0, 1, 2 and so on.

    Raises:
        EncodeError: A column is no array of numbers. Whether the columns fit together is checked as they are sent.
    """
    try:
        xs = _column(x)
        still = np.zeros(xs.size)
        return People(
            tick=step.tick,
            stamp=step.time,
            frame="map",
            # The scenario says how large people are.
            radius=0.25,
            id=_whole(np.arange(xs.size) if ids is None else ids),
            x=xs,
            y=_column(y),
            vx=still if vx is None else _column(vx),
            vy=still if vy is None else _column(vy),
        )
    except (TypeError, ValueError) as error:
        raise EncodeError(People.NAME, "", {"code": "invalid", "detail": str(error)}) from error


def _column(given: ArrayLike) -> F64:
    column = np.atleast_1d(np.asarray(given, np.float64))
    if column.ndim != 1:
        raise ValueError(f"a column of people has one dimension, found the shape {column.shape}")
    return column


_COLUMNS = (2, 4, 5)
"""How many columns a crowd may have."""


def _people_of(step: CrowdStep, found: People | Iterable[Any]) -> People:
    """What a function gives for its crowd, as a message.

    Rows are not columns: of two or four people both readings are possible, so neither arrays nor lists of
    pairs are guessed at.
    """
    if isinstance(found, People):
        return found
    if isinstance(found, np.ndarray):
        raise _no_columns(f"an array of the shape {found.shape}")
    if isinstance(found, list) and found and all(isinstance(entry, tuple) for entry in found):
        raise _no_columns(f"a list of {len(found)} tuples")
    columns = tuple(found)
    if len(columns) not in _COLUMNS:
        raise _no_columns(f"{len(columns)} columns")
    return people(step, *columns)


def _no_columns(what: str) -> EncodeError:
    detail = (
        f"the crowd is {what}; give the columns (x, y), (x, y, vx, vy) or (x, y, vx, vy, ids), such as "
        "(a[:, 0], a[:, 1]) of an array with a row per person"
    )
    return EncodeError(People.NAME, "", {"code": "invalid", "detail": detail})


def _whole(ids: ArrayLike) -> U32:
    given = np.atleast_1d(np.asarray(ids))
    result = given.astype(np.uint32)
    if not np.array_equal(result, given):
        raise ValueError("ids must be whole numbers from 0 to 2**32 - 1")
    return result


class Crowd(Closable):
    """The people of a simulated world, played from here; made by `Deployment.crowd`. A context manager that ends it.

    Iterating over it gives one `CrowdStep` per tick, for as long as runs of the world go on. Answer each with
    `publish`. In real time only the newest is given.
    """

    def __init__(self, session: zenoh.Session, world: str) -> None:
        self._session = session
        close_at_exit(self, session)
        self._key = keys.world(world, "people")
        self._news = News()
        self._ticks = Mailbox(self._news, _MAILBOX_BYTES)
        self._answered = (-1, 0.0)
        self._closed = False
        robot = keys.world(world, "robot")
        self._subscriber: zenoh.Subscriber[None] | None = subscribe(session, robot, self._ticks.put)

    def steps(self, timeout: float | None = None) -> Iterator[CrowdStep]:
        """The ticks as they come, until it is closed or none has come for ``timeout`` s."""
        while (step := self.step(timeout)) is not None:
            yield step

    def __iter__(self) -> Iterator[CrowdStep]:
        return self.steps()

    def step(self, timeout: float | None = None) -> CrowdStep | None:
        """The newest tick that has not been given yet, waited for; ``None`` after ``timeout`` s or once closed."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._closed:
            seen = self._news.count
            newest: CrowdStep | None = None
            while (item := self._ticks.take()) is not None:
                newest = _step(item) or newest
            # The simulator says a tick again while it waits; what is answered already is on its way.
            tick, at = self._answered
            if newest is not None and (newest.tick != tick or time.monotonic() - at > _AGAIN):
                return newest
            left = _WAIT if deadline is None else min(_WAIT, deadline - time.monotonic())
            if left <= 0.0:
                break
            self._news.wait(seen, left)
        return None

    def publish(  # noqa: PLR0917
        self,
        step: CrowdStep,
        x: ArrayLike,
        y: ArrayLike,
        vx: ArrayLike | None = None,
        vy: ArrayLike | None = None,
        ids: ArrayLike | None = None,
    ) -> None:
        """Says who is where at a step; see `people`.

        Raises:
            EncodeError: The arrays do not fit together, or hold what is no finite number.
        """
        self.send(people(step, x, y, vx, vy, ids))

    def send(self, message: People) -> None:
        """The same with a message made elsewhere, such as a detector's."""
        publish(self._session, self._key, message)
        self._answered = (message.tick, time.monotonic())

    def close(self) -> None:
        """Stops listening. Does nothing the second time."""
        self._closed = True
        if self._subscriber is not None:
            subscriber, self._subscriber = self._subscriber, None
            if not self._session.is_closed():
                subscriber.undeclare()
        self._news.tell()


def _step(item: tuple[bytes, str]) -> CrowdStep | None:
    try:
        robot = Odometry.decode(*item)
    except DecodeError as error:
        _log.warning("passed over: %s", error)
        return None
    return CrowdStep(robot.tick, robot.stamp, robot)


CrowdFunction = Callable[[CrowdStep], People | tuple[Any, ...]]
"""From a step to its people: a `People`, or a tuple (x, y), (x, y, vx, vy) or (x, y, vx, vy, ids)."""


class CrowdThread:
    """Answers every step with what a function gives, on a thread of its own, until it is closed.

    Attributes:
        failure: What the function raised; nothing is published after that.
    """

    def __init__(self, session: zenoh.Session, world: str, function: CrowdFunction, failed: Callable[[], None]) -> None:
        self.failure: Exception | None = None
        self._failed = failed
        self._function = function
        self._crowd = Crowd(session, world)
        self._thread = threading.Thread(target=self._work, name="curionav-crowd", daemon=True)

    def start(self) -> None:
        """Begins to answer, with what was asked meanwhile: the run is ours."""
        self._thread.start()

    def _work(self) -> None:
        try:
            for step in self._crowd.steps():
                found = self._function(step)
                self._crowd.send(_people_of(step, found))
        except Exception as error:
            self.failure = error
            self._failed()

    def close(self) -> None:
        """Ends it; a function that does not return is left behind."""
        self._crowd.close()
        if self._thread.ident is not None and self._thread is not threading.current_thread():
            self._thread.join(_STOP_TIMEOUT)
