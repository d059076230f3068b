"""A Python evaluator as a replica like any other: queue, budget, refusals, counts and liveliness.

Zenoh calls back on its receiving threads, which only put the query into a bounded queue or refuse it at once; threads
of our own compute and answer. They are daemons, so that a function that never returns holds up no program's end.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import threading
import time
import uuid
from collections import Counter, deque
from importlib import metadata
from typing import Any

import numpy as np
import zenoh

from . import keys
from .closable import Closable
from .errors import CurionavError, DecodeError, EvaluatorError
from .evaluation import Evaluator
from .fair_queue import FairQueue
from .messages import EvaluateRequest, Message, Reject, Scores, ServiceStatus
from .session import answer_queries, close_at_exit

_PREPARED_MAX = 256
"""Missions a replica remembers to be prepared for."""
_QUEUE_BYTES = 32 << 20
"""Bytes of questions that may wait."""
_LATENCIES = 1024
_REPORT_PERIOD = 10.0
"""Between two lines about the same failure, seconds."""

_log = logging.getLogger("curionav")

Waiting = tuple[zenoh.Query, str, float]
"""A query, the robot that asks, and when it came."""


class _LateError(EvaluatorError):
    """The function took longer than the budget."""


class EvaluatorServer(Closable):
    """A replica of an evaluator; made by `Deployment.serve`. A context manager that ends it.

    Attributes:
        term: What it computes.
        instance: Its name among the replicas of the term.
        answered: Questions answered.
        refused: Questions refused, by the code of the refusal: ``overloaded``, ``cold``, ``stopped`` (late),
            ``wrong_robot``, that of a question that is not understood, and ``failed`` for a function that raised or
            gave no usable costs.
        last_failure: Why the function failed last; ``None`` if it never has.
    """

    def __init__(
        self, session: zenoh.Session, evaluator: Evaluator, instance: str | None, slots: int, queue: int
    ) -> None:
        close_at_exit(self, session)
        if slots < 1 or queue < 1:
            raise ValueError(f"slots and queue must be at least 1, found {slots} and {queue}")
        self.term = evaluator.term
        self.instance = instance or f"{evaluator.term[:50]}-{uuid.uuid4().hex[:8]}"
        self.answered = 0
        self.refused: Counter[str] = Counter()
        self.last_failure: str | None = None
        self._evaluator = evaluator
        self._slots = slots
        self._queue = FairQueue[Waiting](queue, _QUEUE_BYTES)
        self._computing = 0
        self._prepared: dict[tuple[object, ...], None] = {}
        self._latencies: deque[float] = deque(maxlen=_LATENCIES)
        self._said: dict[str, float] = {}
        self._started = time.monotonic()
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._declared: list[zenoh.Queryable[None] | zenoh.LivelinessToken] = []
        self._threads = [
            threading.Thread(target=self._work, name=f"{self.instance}-{slot}", daemon=True) for slot in range(slots)
        ]
        names = (self.term, self.instance)
        # Made before anything is declared: a bad name then leaves nothing behind.
        asked, status, live = keys.questions(*names), keys.status(*names), keys.live(*names)
        try:
            self._declared.append(answer_queries(session, asked, self._admit))
            self._declared.append(answer_queries(session, status, self._tell))
            for thread in self._threads:
                thread.start()
            # Last: a replica that does not answer yet must not be asked.
            self._declared.append(session.liveliness().declare_token(live))
        except BaseException:
            self.close()
            raise

    # ---- on Zenoh's threads ----

    def _admit(self, query: zenoh.Query) -> None:
        robot = keys.asker(str(query.key_expr))
        if robot is None:
            self._refuse(query, {"code": "wrong_robot"})
            return
        size = 0 if query.payload is None else len(query.payload)
        if size > EvaluateRequest.MAX_BYTES:
            # Before anything of it is copied.
            self._refuse(query, {"code": "oversize", "found": size, "most": EvaluateRequest.MAX_BYTES})
            return
        for refused in self._queue.push(robot, (query, robot, time.monotonic()), size):
            self._refuse(refused[0], {"code": "overloaded"})

    def _tell(self, query: zenoh.Query) -> None:
        with query:
            # A question to several is answered under the key of this one: access rules allow no other.
            _reply(query, self.status(), keys.status(self.term, self.instance))

    # ---- on our threads ----

    def _work(self) -> None:
        while (waiting := self._queue.pop()) is not None:
            query, robot, arrived = waiting
            with self._lock:
                self._computing += 1
            try:
                self._answer(query, robot, arrived)
            except Exception:
                # The next question finds the replica alive, whatever was wrong with this one.
                _log.exception("%s: a question could not be answered", self.instance)
            finally:
                with self._lock:
                    self._computing -= 1
                    self._latencies.append(time.monotonic() - arrived)

    def _answer(self, query: zenoh.Query, robot: str, arrived: float) -> None:
        payload = query.payload
        try:
            request = EvaluateRequest.decode(
                payload.to_bytes() if payload is not None else b"", str(query.encoding) if query.encoding else None
            )
            request.all_columns(self.term)
        except DecodeError as error:
            self._refuse(query, error.why, error.field or None)
            return
        warms_up = request.candidates.count == 0
        need = _need(robot, request)
        prepared = need in self._prepared
        if not warms_up and not prepared:
            self._refuse(query, {"code": "cold", "detail": "the mission"})
            return
        if not warms_up and _spent_ms(arrived) > request.budget_ms:
            self._refuse(query, {"code": "stopped"})
            return
        begun = time.monotonic()
        try:
            cost = self._evaluator.trial(request) if warms_up and not prepared else self._evaluator.costs(request)
            if not warms_up and _spent_ms(arrived) > request.budget_ms:
                took = f"took {_spent_ms(arrived):.0f} ms of a budget of {request.budget_ms} ms"
                raise _LateError(self.term, took)
        except EvaluatorError as error:
            self._failed(error, need)
            late = isinstance(error, _LateError)
            self._refuse(query, {"code": "stopped"} if late else {"code": "failed", "detail": _cut(str(error))})
            return
        if warms_up:
            with self._lock:
                self._prepared[need] = None
                while len(self._prepared) > _PREPARED_MAX:
                    del self._prepared[next(iter(self._prepared))]
        scores = Scores(
            epoch=request.epoch,
            seq=request.seq,
            shard=request.shard,
            term=self.term,
            instance=self.instance,
            cost=cost,
            elapsed_us=round(_spent_ms(begun) * 1e3),
            slots=self._slots,
        )
        self._settle(query, scores)

    def _failed(self, error: EvaluatorError, need: tuple[object, ...]) -> None:
        """Says what is wrong, the same thing once in a while. The function is tried anew before it gets more work."""
        with self._lock:
            self._prepared.pop(need, None)
        self.last_failure = error.reason
        what, now = error.reason[:60], time.monotonic()
        if now - self._said.get(what, -_REPORT_PERIOD) >= _REPORT_PERIOD:
            if len(self._said) > 100:
                self._said.clear()
            self._said[what] = now
            _log.error("%s (%s): %s", self.term, self.instance, error.reason, exc_info=error.__cause__)

    def _refuse(self, query: zenoh.Query, why: dict[str, Any], field: str | None = None) -> None:
        with self._lock:
            self.refused[why["code"]] += 1
        with query:
            _reply(query, Reject(field=_cut(field) if field else None, why=why))

    def _settle(self, query: zenoh.Query, scores: Message) -> None:
        with self._lock:
            self.answered += 1
        with query:
            _reply(query, scores)

    # ---- for its owner ----

    def status(self) -> ServiceStatus:
        """What it says about itself to ``curionav status``."""
        with self._lock:
            latencies = list(self._latencies)
            in_flight = len(self._queue) + self._computing
            answered, refused = self.answered, self.refused.total()
        p50, p99 = np.percentile(latencies or [0.0], [50.0, 99.0]) * 1e3
        return ServiceStatus(
            role=self.term,
            instance=self.instance,
            version=_version(),
            uptime_s=time.monotonic() - self._started,
            time_s=time.time(),
            load=in_flight / self._slots,
            requests=answered,
            rejected=refused,
            p50_ms=float(p50),
            p99_ms=float(p99),
            prepared=[],
        )

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until it is closed, at most ``timeout`` s; whether it is. Ctrl-C gets through."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._closed.is_set():
            left = 0.05 if deadline is None else min(0.05, deadline - time.monotonic())
            if left <= 0.0:
                return False
            # Not the event's own wait: Ctrl-C at its start may leave the event locked, and `close` would never end.
            time.sleep(left)
        return True

    def close(self, timeout: float = 2.0) -> None:
        """Ends it: what waits is still answered, for at most ``timeout`` s. Does nothing the second time."""
        # The token goes first: a replica that has stopped answering must not be asked.
        while self._declared:
            with contextlib.suppress(zenoh.ZError):
                self._declared.pop().undeclare()  # type: ignore[no-untyped-call]
        self._queue.end()
        deadline = time.monotonic() + timeout
        for thread in self._threads:
            if thread.ident is not None and thread is not threading.current_thread():
                thread.join(max(0.0, deadline - time.monotonic()))
                if thread.is_alive():
                    _log.warning("%s: the function has not returned; it is left behind", self.instance)
        self._closed.set()


def _need(robot: str, request: EvaluateRequest) -> tuple[object, ...]:
    """What a replica is prepared for: another robot, map, goal or shape of candidates is tried anew."""
    return (
        robot,
        request.map,
        request.goal_x,
        request.goal_y,
        request.candidates.steps,
        request.candidates.dt,
    )


def _spent_ms(arrived: float) -> float:
    return (time.monotonic() - arrived) * 1e3


def _cut(text: str) -> str:
    return text.encode()[:1000].decode("utf-8", "ignore")


def _reply(query: zenoh.Query, message: Message, key: str | None = None) -> None:
    try:
        if isinstance(message, Reject):
            query.reply_err(message.encode(), encoding=message.encoding())
        else:
            query.reply(key or query.key_expr, message.encode(), encoding=message.encoding())
    except (zenoh.ZError, CurionavError) as error:
        _log.debug("reply not sent: %s", error)


@functools.cache
def _version() -> str:
    try:
        return f"python-{metadata.version('curionav')}"
    except metadata.PackageNotFoundError:
        return "python"
