"""A run under way: its reports, decisions and status as they come, and its result."""

from __future__ import annotations

import contextlib
import logging
import time
from collections import deque
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TypeVar

import zenoh

from . import keys
from .commands import UNPROVEN, command
from .crowd import CrowdFunction, CrowdThread
from .errors import CurionavError, DecodeError, NoAnswer, Rejected, RunFailed
from .explain import Explanation
from .messages import (
    Cancel,
    CycleReport,
    Decision,
    InjectRequest,
    Message,
    RunStatus,
)
from .result import Result
from .session import Asked, Mailbox, News, ask, close_at_exit, subscribe
from .words import say

M = TypeVar("M", CycleReport, Decision)
A = TypeVar("A", bound=Message)

MAILBOX_BYTES = 256 << 20
"""Reports or decisions that may wait to be read: a long run with small reports, or a minute with the largest."""

RECENT_REPORTS = 64
"""Reports that have been given are kept for `Run.explain`; one takes some 100 kB."""

SCENARIO_TIMEOUT = 30.0
"""Reading a scenario's maps and recordings takes the simulator a while, seconds."""

_POLL_PERIOD = 1.0
"""Without news for this long the status is asked for, seconds."""
_ASK_TIMEOUT = 5.0
"""A status with a result may be large, seconds."""
_CANCEL_PERIOD = 0.2
_ATTEMPTS = 5
"""Questions about the status that may fail in a row before the simulator is given up."""
_LAST_REPORT = 0.5
"""How long the reports that go with the last decisions may take after the end of the run, seconds: they have the
lowest priority. None comes for a cycle that ended in a stop before planning."""

_log = logging.getLogger("curionav")


class Run:
    """A run of an injected scenario; made by `Deployment.inject`.

    Iterating over it gives its `CycleReport`s as they come and ends with the run. Leaving its ``with`` block cancels a
    run that still goes on; `close` alone leaves it to itself.

    Attributes:
        id: The simulator's number of this run.
        refused: Messages that could not be understood and were passed over.
    """

    def __init__(
        self,
        session: zenoh.Session,
        request: InjectRequest,
        world: str,
        robot: str,
        *,
        crowd: CrowdFunction | None = None,
        by: str = UNPROVEN,
    ) -> None:
        self._session = session
        self._by = by
        close_at_exit(self, session)
        self._run_key = keys.world(world, "run")
        self._robot = robot
        decision_key = keys.robot(robot, "decision")
        self._news = News()
        self._statuses = Mailbox(self._news, MAILBOX_BYTES)
        self._reports = Mailbox(self._news, MAILBOX_BYTES)
        self._decisions = Mailbox(self._news, MAILBOX_BYTES)
        self._heard = time.monotonic()
        self._attempts = 0
        self._closed = False
        self._crowd: CrowdThread | None = None
        self._cancelling = False
        self.refused = 0
        self._stale = self._order_before(decision_key)
        self._newest_report = self._stale
        self._recent: deque[CycleReport] = deque(maxlen=RECENT_REPORTS)
        self._subscribers: list[zenoh.Subscriber[None]] = []
        try:
            # Before the injection, so that nothing of the run is missed.
            self._subscribers.append(subscribe(session, self._run_key, self._statuses.put))
            self._subscribers.append(subscribe(session, keys.robot(robot, "report"), self._reports.put))
            self._subscribers.append(subscribe(session, decision_key, self._decisions.put))
            if crowd is not None:
                self._crowd = CrowdThread(session, world, crowd, self._news.tell)
            self._inject(keys.world(world, "scenario"), request)
            if self._crowd is not None:
                self._crowd.start()
        except BaseException:
            self.close()
            raise

    def _inject(self, key: str, request: InjectRequest) -> None:
        asked = Asked(self._session, key, RunStatus, request, SCENARIO_TIMEOUT)
        try:
            self._begin(asked.wait(SCENARIO_TIMEOUT))
        except KeyboardInterrupt:
            # The simulator may have begun: a run that its program never had must not go on.
            with contextlib.suppress(CurionavError):
                self._begin(asked.wait(_ASK_TIMEOUT))
                self.cancel()
            raise

    def _begin(self, status: RunStatus) -> None:
        self._status = status
        self.id = status.run

    def _order_before(self, key: str) -> tuple[int, int]:
        """(epoch, seq) of the last decision before this run: what is not after it belongs to an earlier one."""
        try:
            last = ask(self._session, key, Decision, None, _ASK_TIMEOUT)
        except (NoAnswer, Rejected, DecodeError):
            return (-1, -1)
        return (last.epoch, last.seq)

    # ---- following ----

    def __iter__(self) -> Iterator[CycleReport]:
        return self.reports()

    def reports(self) -> Iterator[CycleReport]:
        """The account of each planning cycle, as they come; ends with the run. Each report is given once."""
        return self._follow(self._reports, CycleReport, self._reports_complete)

    def explain(self, cycle: int | CycleReport | None = None, top: int = 10) -> Explanation:
        """Why a cycle was decided as it was: in words, and as a table of candidates and their costs.

        Args:
            cycle: A report, or the number (``seq``) of one of the last `RECENT_REPORTS` that this run has given;
                ``None`` for the newest of them.
            top: Candidates in the table; 0 for all.

        Raises:
            KeyError: There is no such report.
        """
        if isinstance(cycle, CycleReport):
            return Explanation(cycle, top)
        known = [report for report in self._recent if cycle is None or report.seq == cycle]
        if not known:
            raise KeyError(f"no report of cycle {cycle} has been given; iterate over the run to get them")
        return Explanation(known[-1], top)

    def decisions(self) -> Iterator[Decision]:
        """The decisions alone, also those of cycles without a report; ends with the run. Each is given once."""
        return self._follow(self._decisions, Decision, lambda: True)

    @property
    def lost(self) -> int:
        """Reports and decisions that were dropped unread: `MAILBOX_BYTES` of each are kept."""
        return self._reports.lost + self._decisions.lost

    def _reports_complete(self) -> bool:
        """Whether the report of the newest decision has come."""
        newest = self._decisions.newest and self._decode(Decision, self._decisions.newest)
        return newest is None or (newest.epoch, newest.seq) <= self._newest_report

    def _follow(self, mailbox: Mailbox, message: type[M], complete: Callable[[], bool]) -> Iterator[M]:
        ended_at: float | None = None
        while True:
            seen = self._news.count
            found = self._next(mailbox, message)
            if found is not None:
                yield found
            elif self._goes_on() and not self._closed:
                self._news.wait(seen, _POLL_PERIOD)
            else:
                ended_at = ended_at or time.monotonic()
                left = self._left(ended_at, complete)
                if left <= 0.0:
                    return
                self._news.wait(seen, left)

    def _next(self, mailbox: Mailbox, message: type[M]) -> M | None:
        """The next message of this run that is here."""
        while (item := mailbox.take()) is not None:
            found = self._decode(message, item)
            if found is not None and (found.epoch, found.seq) > self._stale:
                if isinstance(found, CycleReport):
                    self._newest_report = (found.epoch, found.seq)
                    self._recent.append(found)
                return found
        return None

    def _left(self, ended_at: float, complete: Callable[[], bool]) -> float:
        """How long to wait for what was sent before the end and may still be on its way behind it, s."""
        if self._closed or complete():
            return 0.0
        return ended_at + _LAST_REPORT - time.monotonic()

    def _decode(self, message: type[A], item: tuple[bytes, str]) -> A | None:
        try:
            return message.decode(*item)
        except DecodeError as error:
            self.refused += 1
            _log.warning("passed over: %s", error)
            return None

    # ---- status and result ----

    def status(self) -> RunStatus:
        """Where the run stands: the newest that is known, without waiting."""
        self._take_in()
        return self._status

    def progress(self) -> Iterator[RunStatus]:
        """Where the run stands, whenever the simulator says so (five times per second); ends with the run's end."""
        told: RunStatus | None = None
        while True:
            seen = self._news.count
            goes_on = self._goes_on()
            if self._status is not told:
                told = self._status
                yield told
            if not goes_on or self._closed:
                return
            self._news.wait(seen, _POLL_PERIOD)

    def wait(self, timeout: float | None = None) -> Result:
        """Waits for the end of the run and gives its result.

        Args:
            timeout: How long to wait, s; ``None`` for as long as it takes.

        Raises:
            TimeoutError: The run still goes on after ``timeout``.
            RunFailed: The run ended without a result, or the simulator is lost.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            seen = self._news.count
            if not self._goes_on():
                return self._result()
            self._news.wait(seen, self._patience(timeout, deadline))

    def _patience(self, timeout: float | None, deadline: float | None) -> float:
        """How long to wait for news before looking again, s."""
        left = _POLL_PERIOD if deadline is None else min(deadline - time.monotonic(), _POLL_PERIOD)
        if left <= 0.0:
            raise TimeoutError(f"the run still goes on after {timeout:g} s")
        if self._closed:
            raise RunFailed("the run was closed before it ended")
        return left

    def _result(self) -> Result:
        if self._status.result is None:
            end = self._status.error
            raise RunFailed(say("end", end) if end else "the run ended without a result", end)
        return Result.of(self._status.result)

    def cancel(self, timeout: float = 10.0) -> None:
        """Cancels the run and waits until it has ended; does nothing if it has.

        Raises:
            NoAnswer: It did not end within ``timeout`` s.
        """
        deadline = time.monotonic() + timeout
        while self._goes_on():
            seen = self._news.count
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise NoAnswer(f"the run did not end within {timeout:g} s of being cancelled")
            # Again and again: the mission of a run that has just been injected may not be there yet.
            with contextlib.suppress(NoAnswer, Rejected):
                command(self._session, self._robot, self._by, Cancel(), min(left, _ASK_TIMEOUT))
            self._news.wait(seen, min(left, _CANCEL_PERIOD))

    def close(self) -> None:
        """Stops listening; the run itself goes on. Does nothing the second time."""
        self._closed = True
        if self._crowd is not None:
            self._crowd.close()
        while self._subscribers:
            with contextlib.suppress(zenoh.ZError):
                self._subscribers.pop().undeclare()
        self._news.tell()

    def __enter__(self) -> Run:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.cancel()
        except CurionavError as failure:
            if error is None:
                raise
            _log.warning("the run could not be cancelled: %s", failure)
        finally:
            self.close()

    def _check_crowd(self) -> None:
        """A crowd that has failed ends the run: it cannot go on without people."""
        failure = self._crowd.failure if self._crowd is not None else None
        if failure is not None and not self._closed and not self._cancelling:
            self._cancelling = True
            with contextlib.suppress(CurionavError):
                self.cancel()
            raise RunFailed(f"the crowd failed: {type(failure).__name__}: {failure}") from failure

    def _ended(self) -> bool:
        return self._status.state in ("finished", "failed")

    def _goes_on(self) -> bool:
        """Whether the run goes on, by what was published; asks when nothing has been for a while."""
        self._take_in()
        if not self._ended():
            self._check_crowd()
        if self._is_to_be_asked():
            self._poll()
        return not self._ended()

    def _is_to_be_asked(self) -> bool:
        """Whether so little has been heard that the status is asked for, which takes time."""
        return not self._ended() and not self._closed and time.monotonic() - self._heard >= _POLL_PERIOD

    def _take_in(self) -> None:
        while (item := self._statuses.take()) is not None:
            status = self._decode(RunStatus, item)
            if status is not None and status.run == self.id and not self._ended():
                self._status = status
                self._heard, self._attempts = time.monotonic(), 0

    def _poll(self) -> None:
        try:
            status = ask(self._session, self._run_key, RunStatus, None, _ASK_TIMEOUT)
        except (NoAnswer, Rejected, DecodeError) as error:
            self._attempts += 1
            if self._attempts >= _ATTEMPTS:
                raise RunFailed(f"the simulator is lost: {error}") from error
        else:
            if status.run != self.id:
                raise RunFailed(f"run {self.id} is gone: the simulator is at run {status.run}")
            self._status = status
            self._attempts = 0
        self._heard = time.monotonic()
