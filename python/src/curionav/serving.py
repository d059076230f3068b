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
from types import TracebackType

import numpy as np
import zenoh

from . import keys
from .errors import CurionavError, DecodeError, EvaluatorError
from .evaluation import Evaluator
from .fair_queue import FairQueue
from .messages import EvaluateRequest, Message, Reject, Scores, ServiceStatus
from .session import answer_queries, close_at_exit

_PREPARED_MAX = 256
"""Missions a replica remembers to be prepared for."""
_LATENCIES = 1024
_REPORT_PERIOD = 10.0
"""Between two lines about the same failure, seconds."""

_log = logging.getLogger("curionav")

Waiting = tuple[zenoh.Query, float]
"""A query and when it came."""


class _LateError(EvaluatorError):
    """The function took longer than the budget."""


class EvaluatorServer:
    """A replica of an evaluator; made by `Deployment.serve`. A context manager that ends it.

    Attributes:
        metric: What it computes.
        instance: Its name among the replicas of the metric.
        answered: Questions answered.
        refused: Questions refused, by code: ``overloaded``, ``cold``, ``stopped`` (late), ``malformed``, and
            ``unknown`` for a function that raised or gave no usable costs.
        last_failure: Why the function failed last; ``None`` if it never has.
    """

    def __init__(
        self, session: zenoh.Session, evaluator: Evaluator, instance: str | None, slots: int, queue: int
    ) -> None:
        close_at_exit(self, session)
        if slots < 1 or queue < 1:
            raise ValueError(f"slots and queue must be at least 1, found {slots} and {queue}")
        self.metric = evaluator.metric
        self.instance = instance or f"{evaluator.metric[:50]}-{uuid.uuid4().hex[:8]}"
        self.answered = 0
        self.refused: Counter[str] = Counter()
        self.last_failure: str | None = None
        self._evaluator = evaluator
        self._slots = slots
        self._queue = FairQueue[Waiting](queue)
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
        names = (self.metric, self.instance)
        # Made before anything is declared: a bad name then leaves nothing behind.
        asked, status, live = keys.evaluate(*names), keys.status(*names), keys.live(*names)
        try:
            self._declared.append(answer_queries(session, asked, self._admit))
            self._declared.append(answer_queries(session, status, self._tell))
            for thread in self._threads:
                thread.start()
            # Last: nobody is to ask whoever does not answer yet.
            self._declared.append(session.liveliness().declare_token(live))
        except BaseException:
            self.close()
            raise

    # ---- on Zenoh's threads ----

    def _admit(self, query: zenoh.Query) -> None:
        attachment = query.attachment
        robot = attachment.to_bytes().decode("utf-8", "replace") if attachment is not None else ""
        # Who says nothing about whose work it is shares a line with all who do not.
        refused = self._queue.push(robot if keys.is_name(robot) else "", (query, time.monotonic()))
        if refused is not None:
            self._refuse(refused[0], "overloaded", "every slot is busy and the queue is full")

    def _tell(self, query: zenoh.Query) -> None:
        with query:
            _reply(query, self.status())

    # ---- on our threads ----

    def _work(self) -> None:
        while (waiting := self._queue.pop()) is not None:
            query, arrived = waiting
            with self._lock:
                self._computing += 1
            try:
                self._answer(query, arrived)
            except Exception:
                # The next question finds the replica alive, whatever was wrong with this one.
                _log.exception("%s: a question could not be answered", self.instance)
            finally:
                with self._lock:
                    self._computing -= 1
                    self._latencies.append(time.monotonic() - arrived)

    def _answer(self, query: zenoh.Query, arrived: float) -> None:
        payload = query.payload
        try:
            request = EvaluateRequest.decode(
                payload.to_bytes() if payload is not None else b"", str(query.encoding) if query.encoding else None
            )
        except DecodeError as error:
            self._refuse(query, _code(error), error.reason, error.field or None)
            return
        warms_up = request.candidates.count == 0
        need = _need(request)
        prepared = need in self._prepared
        if not warms_up and not prepared:
            self._refuse(query, "cold", "not prepared for this mission: ask without candidates first")
            return
        if not warms_up and _spent_ms(arrived) > request.budget_ms:
            self._refuse(query, "stopped", "its time was over before a slot was free")
            return
        try:
            cost = self._evaluator.trial(request) if warms_up and not prepared else self._evaluator.costs(request)
            if not warms_up and _spent_ms(arrived) > request.budget_ms:
                late = f"took {_spent_ms(arrived):.0f} ms of a budget of {request.budget_ms} ms"
                raise _LateError(self.metric, late)
        except EvaluatorError as error:
            self._failed(error, need)
            self._refuse(query, "stopped" if isinstance(error, _LateError) else "unknown", str(error))
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
            metric=self.metric,
            instance=self.instance,
            cost=cost,
            elapsed_us=max(0, round(_spent_ms(arrived) * 1e3)),
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
            _log.error("%s (%s): %s", self.metric, self.instance, error.reason, exc_info=error.__cause__)

    def _refuse(self, query: zenoh.Query, code: str, reason: str, field: str | None = None) -> None:
        with self._lock:
            self.refused[code] += 1
        with query:
            _reply(query, Reject(reason=_cut(reason), field=_cut(field) if field else None, code=code))

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
            role=self.metric,
            instance=self.instance,
            version=_version(),
            uptime_s=time.monotonic() - self._started,
            time_s=time.time(),
            load=in_flight / self._slots,
            requests=answered,
            rejected=refused,
            p50_ms=float(p50),
            p99_ms=float(p99),
            warmed=[],
        )

    def wait(self, timeout: float | None = None) -> bool:
        """Waits until it is closed, at most ``timeout`` s; whether it is. Ctrl-C gets through."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self._closed.is_set():
            left = 0.5 if deadline is None else min(0.5, deadline - time.monotonic())
            if left <= 0.0:
                return False
            self._closed.wait(left)
        return True

    def close(self, timeout: float = 2.0) -> None:
        """Ends it: what waits is still answered, for at most ``timeout`` s. Does nothing the second time."""
        # The token goes first: nobody is to ask whoever has stopped answering.
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

    def __enter__(self) -> EvaluatorServer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _need(request: EvaluateRequest) -> tuple[object, ...]:
    """What a replica is prepared for: another map, goal, profile or shape of candidates is tried anew."""
    return (
        request.robot,
        request.map,
        request.goal_x,
        request.goal_y,
        request.candidates.steps,
        request.candidates.dt,
    )


def _spent_ms(arrived: float) -> float:
    return (time.monotonic() - arrived) * 1e3


def _code(error: DecodeError) -> str:
    if error.field:
        return "invalid"
    if error.reason.startswith("encoding"):
        return "version"
    return "oversize" if "exceed the limit" in error.reason else "malformed"


def _cut(text: str) -> str:
    return text.encode()[:1000].decode("utf-8", "ignore")


def _reply(query: zenoh.Query, message: Message) -> None:
    try:
        if isinstance(message, Reject):
            query.reply_err(message.encode(), encoding=message.encoding())
        else:
            query.reply(query.key_expr, message.encode(), encoding=message.encoding())
    except (zenoh.ZError, CurionavError) as error:
        _log.debug("reply not sent: %s", error)


@functools.cache
def _version() -> str:
    try:
        return f"python-{metadata.version('curionav')}"
    except metadata.PackageNotFoundError:
        return "python"
