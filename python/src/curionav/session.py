"""The Zenoh session: the only module that knows how bytes travel.

Zenoh calls back on its receiving threads. Callbacks here only put what came into a queue; everything else happens on
the caller's thread, which therefore stays interruptible, and no thread of ours runs.
"""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import json
import os
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

import zenoh

from . import secure
from .endpoint import check_endpoint, check_namespace
from .errors import ConnectionFailed, CurionavError, DecodeError, NoAnswer, Rejected
from .messages import Message, Reject
from .secure import Identity

M = TypeVar("M", bound=Message)

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
"""Where `curionav up` and `curionav router` listen unless told otherwise."""

_CONFIGURATION = """{
  mode: "client",
  scouting: { multicast: { enabled: false }, gossip: { enabled: false } },
  queries_default_timeout: 1000,
  adminspace: { enabled: false },
  transport: {
    unicast: { open_timeout: 1000 },
    link: {
      tx: { lease: 1000, keep_alive: 4, queue: { size: { real_time: 8, interactive_low: 16 }, congestion_control: {
        block: { wait_before_close: 500000 },
        drop: { wait_before_drop: 1000, max_wait_before_drop_fragments: 200000 } } } },
      rx: { max_message_size: 67174400 },
    },
    shared_memory: { enabled: false },
  },
}"""
"""The settings of the services (``crates/runtime/src/session.rs``): no scouting, a lease of one second, a link that is
given up after one second of opening or half a second of a blocked send, no shared memory, short queries."""


def open_session(
    endpoint: str | None,
    namespace: str | None,
    config: str | os.PathLike[str] | None,
    timeout: float,
    identity: Identity | None = None,
) -> zenoh.Session:
    """A session with a router behind it.

    Raises:
        ConnectionFailed: No router answered within ``timeout`` s, or the configuration was refused.
    """
    if timeout <= 0.0:
        raise ValueError(f"timeout must be positive, found {timeout}")
    _check_process()
    if endpoint is not None:
        check_endpoint(endpoint)
    if namespace is not None:
        check_namespace(namespace)
    if identity is not None:
        endpoint = endpoint or (secure.DEFAULT_ENDPOINT if _file(config) is None else None)
        if endpoint is not None:
            secure.check_endpoint(endpoint)
    settings, where = _configure(endpoint, namespace, config, timeout, identity)
    deadline = time.monotonic() + timeout
    try:
        session = _open(settings, where, timeout)
    except ConnectionFailed as error:
        reason = identity.distrust(endpoint) if identity is not None and endpoint is not None else None
        if reason is None:
            raise
        raise ConnectionFailed(f"the router at {where} was not reached over TLS: {reason}") from error
    # Opening can succeed without a router behind it: a refused certificate is only a warning to Zenoh.
    try:
        while not session.info.routers_zid():
            if time.monotonic() > deadline:
                raise ConnectionFailed(_no_router(where, timeout))
            time.sleep(0.02)
    except BaseException:
        session.close()
        raise
    return session


def _file(config: str | os.PathLike[str] | None) -> str | os.PathLike[str] | None:
    """The configuration file that was given, here or in the environment."""
    return config or os.environ.get("ZENOH_CONFIG")


def _configure(
    endpoint: str | None,
    namespace: str | None,
    config: str | os.PathLike[str] | None,
    timeout: float,
    identity: Identity | None,
) -> tuple[zenoh.Config, str]:
    file = _file(config)
    if file is None and endpoint is None:
        endpoint = DEFAULT_ENDPOINT
    where = endpoint or f"the endpoints of {file}"
    try:
        settings = zenoh.Config.from_json5(_CONFIGURATION) if file is None else zenoh.Config.from_file(Path(file))
        if endpoint is not None:
            settings.insert_json5("mode", '"client"')
            settings.insert_json5("connect/endpoints", json.dumps([endpoint]))
        if identity is not None:
            for path, value in identity.settings().items():
                settings.insert_json5(path, value)
        if namespace is not None:
            settings.insert_json5("namespace", json.dumps(namespace))
        settings.insert_json5("connect/timeout_ms", str(max(1, round(timeout * 1000))))
        settings.insert_json5("connect/exit_on_failure", "true")
        retry = {"period_init_ms": 100, "period_max_ms": 400, "period_increase_factor": 2}
        settings.insert_json5("connect/retry", json.dumps(retry))
    except zenoh.ZError as error:
        raise ConnectionFailed(f"the Zenoh configuration for {where} was refused: {error}") from error
    return settings, where


def _no_router(where: str, timeout: float) -> str:
    return f"no router answered at {where} within {timeout:g} s: is `curionav up` (or `curionav router`) running there?"


def _open(settings: zenoh.Config, where: str, timeout: float) -> zenoh.Session:
    """Opens on a thread that ends with the attempt, because Zenoh does not notice an interrupt while it connects."""
    opened: list[zenoh.Session] = []
    failed: list[Exception] = []
    done = threading.Event()
    abandoned = threading.Event()

    def attempt() -> None:
        try:
            session = zenoh.open(settings)
            if abandoned.is_set():
                session.close()
            else:
                opened.append(session)
        except Exception as error:
            failed.append(error)
        finally:
            done.set()

    threading.Thread(target=attempt, name="curionav-connect", daemon=True).start()
    try:
        # Zenoh ends an attempt by itself in time; the second guards against one that does not.
        done.wait(timeout + 1.0)
    except BaseException:
        abandoned.set()
        raise
    if opened:
        _of_process.opened = True
        return opened[0]
    abandoned.set()
    raise ConnectionFailed(_no_router(where, timeout)) from (failed[0] if failed else None)


_users: weakref.WeakKeyDictionary[object, zenoh.Session] = weakref.WeakKeyDictionary()


def close_at_exit(user: object, session: zenoh.Session) -> None:
    """Closes ``session`` at the end of the program if ``user`` still has it then.

    A session that is dropped while Python ends waits ten seconds for its callbacks, which can no longer run.
    """
    _users[user] = session


class _Process:
    """What this process has of Zenoh."""

    opened = False
    """Whether a session was opened here: Zenoh then has threads."""
    forked = False
    """Whether this process was forked from one that had such threads. They are not in it, and it would hang."""
    inherited: list[zenoh.Session]
    """Sessions of the process that this one was forked from; they are never dropped, which would wait for threads."""


_of_process = _Process()


def _after_fork() -> None:
    if _of_process.opened:
        _of_process.forked = True
        _of_process.inherited = list(_users.values())
        _users.clear()


os.register_at_fork(after_in_child=_after_fork)


def is_forked() -> bool:
    """Whether this process was forked from one with a connection: what it has inherited must be left alone."""
    return _of_process.forked


def _check_process() -> None:
    """Refuses a process that was forked from one with a connection.

    Raises:
        CurionavError: It was; what was meant works with a process that is started anew.
    """
    if _of_process.forked:
        raise CurionavError(
            "this process was forked from one with a connection, which Zenoh does not survive; start it with "
            '`multiprocessing.get_context("spawn")`, or fork before the first `connect`'
        )


def check_session(session: zenoh.Session) -> zenoh.Session:
    """The session, if it can be used.

    Raises:
        CurionavError: It is closed, or was opened before this process was forked.
    """
    _check_process()
    if session.is_closed():
        raise CurionavError("the connection is closed")
    return session


@atexit.register
def _close_all() -> None:
    for session in list(_users.values()):
        with contextlib.suppress(zenoh.ZError):
            if not session.is_closed():
                session.close()


class News:
    """Counts what came, so that a waiter misses nothing that came between looking and waiting."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._wakers: set[Callable[[], object]] = set()
        self.count = 0

    def tell(self) -> None:
        """Something came, or something is over."""
        with self._changed:
            self.count += 1
            self._changed.notify_all()
            wakers = tuple(self._wakers)
        for wake in wakers:
            # The loop of a waiter may have been closed meanwhile.
            with contextlib.suppress(RuntimeError):
                wake()

    def wait(self, seen: int, seconds: float) -> None:
        """Waits until there is more than at the count ``seen``, at most ``seconds``."""
        with self._changed:
            self._changed.wait_for(lambda: self.count != seen, max(seconds, 0.0))

    async def wait_async(self, seen: int, seconds: float) -> None:
        """The same without holding up the running event loop."""
        came = asyncio.Event()
        loop = asyncio.get_running_loop()

        def wake() -> object:
            return loop.call_soon_threadsafe(came.set)

        with self._changed:
            if self.count != seen:
                return
            self._wakers.add(wake)
        try:
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(came.wait(), max(seconds, 0.0))
        finally:
            with self._changed:
                self._wakers.discard(wake)


_ITEM_BYTES = 256
"""What a message takes in a mailbox besides its payload, about."""


class Mailbox:
    """What came and has not been read: in order, bounded in bytes; beyond the bound the oldest goes and is counted."""

    def __init__(self, news: News, limit_bytes: int) -> None:
        self._news = news
        self._limit = limit_bytes
        self._bytes = 0
        self._lock = threading.Lock()
        self._items: deque[tuple[bytes, str]] = deque()
        self.newest: tuple[bytes, str] | None = None
        self.lost = 0

    def put(self, sample: zenoh.Sample) -> None:
        """Keeps a sample; called by Zenoh."""
        size = len(sample.payload)
        if size > self._limit:
            # Before it is copied: it would not leave room for anything else.
            self.lost += 1
            return
        item = (sample.payload.to_bytes(), str(sample.encoding))
        with self._lock:
            self._items.append(item)
            self.newest = item
            self._bytes += size + _ITEM_BYTES
            while self._bytes > self._limit and len(self._items) > 1:
                self._bytes -= len(self._items.popleft()[0]) + _ITEM_BYTES
                self.lost += 1
        self._news.tell()

    def take(self) -> tuple[bytes, str] | None:
        """The oldest (payload, encoding), or ``None`` if there is none."""
        with self._lock:
            if not self._items:
                return None
            item = self._items.popleft()
            self._bytes -= len(item[0]) + _ITEM_BYTES
            return item


def subscribe(session: zenoh.Session, key: str, put: Callable[[zenoh.Sample], None]) -> zenoh.Subscriber[None]:
    """Calls ``put`` with every sample on ``key``, on Zenoh's thread."""
    # Not indirect: no thread of Python's, and what arrived before `close` is seen before it.
    handler: zenoh.handlers.Callback[zenoh.Sample] = zenoh.handlers.Callback(put, indirect=False)
    return session.declare_subscriber(key, handler)


def publish(session: zenoh.Session, key: str, message: Message) -> None:
    """Sends one message that must not be lost."""
    session.put(
        key,
        message.encode(),
        encoding=message.encoding(),
        congestion_control=zenoh.CongestionControl.BLOCK,
        express=True,
    )


def answer_queries(session: zenoh.Session, key: str, answer: Callable[[zenoh.Query], None]) -> zenoh.Queryable[None]:
    """Calls ``answer`` with every query on ``key``, on Zenoh's thread; the query ends when it is dropped."""
    handler: zenoh.handlers.Callback[zenoh.Query] = zenoh.handlers.Callback(answer, indirect=False)
    return session.declare_queryable(key, handler, complete=True)


_REPLIES_MAX = 16
"""Replies to one question that wait to be read."""


def ask(
    session: zenoh.Session,
    key: str,
    answer: type[M],
    question: Message | None,
    timeout: float,
    *,
    accept: Callable[[M], bool] | None = None,
) -> M:
    """Asks ``key`` and waits for the first usable answer.

    With ``accept`` every service at the key is asked, and the first answer counts that it takes.

    Raises:
        NoAnswer: No service answers at the key within ``timeout`` s.
        Rejected: The service refused.
        DecodeError: The answer is not what it should be.
    """
    return Asked(session, key, answer, question, timeout, accept=accept).wait(timeout)


class Asked(Generic[M]):
    """A question that was sent. A caller who is interrupted while he waits can still wait for what became of it."""

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        answer: type[M],
        question: Message | None,
        timeout: float,
        *,
        accept: Callable[[M], bool] | None = None,
    ) -> None:
        self._key = key
        self._answer = answer
        self._accept = accept
        self._failure: Exception = NoAnswer(f"no service answers at {key}")
        self._replies: deque[zenoh.Reply] = deque()
        self._changed = threading.Condition()
        self._ended = False
        session.get(
            key,
            zenoh.handlers.Callback(self._reply, self._end, indirect=False),
            target=zenoh.QueryTarget.BEST_MATCHING if accept is None else zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            timeout=timeout,
            express=True,
            payload=None if question is None else question.encode(),
            encoding=None if question is None else question.encoding(),
        )

    def wait(self, timeout: float) -> M:
        """Waits for the first usable answer; raises as `ask` does."""
        deadline = time.monotonic() + timeout + 0.1
        while True:
            with self._changed:
                while not self._replies and not self._ended:
                    left = deadline - time.monotonic()
                    if left <= 0.0:
                        raise NoAnswer(f"no answer at {self._key} within {timeout:g} s")
                    self._changed.wait(left)
                if not self._replies:
                    raise self._failure
                received = self._replies.popleft()
            try:
                read = _answer(received, self._key, self._answer, timeout)
            except (DecodeError, NoAnswer, Rejected) as error:
                self._failure = error
                continue
            if self._accept is None or self._accept(read):
                return read

    def _reply(self, received: zenoh.Reply) -> None:
        with self._changed:
            # They are read as they come: of more than these that wait, none will be usable.
            if len(self._replies) < _REPLIES_MAX:
                self._replies.append(received)
                self._changed.notify()

    def _end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()


def _answer(reply: zenoh.Reply, key: str, answer: type[M], timeout: float) -> M:
    sample = reply.ok
    if sample is not None:
        if (size := len(sample.payload)) > answer.MAX_BYTES:
            raise NoAnswer(f"the answer at {key} has {size} bytes, more than {answer.MAX_BYTES}")
        return answer.decode(sample.payload.to_bytes(), str(sample.encoding))
    refusal = reply.err
    try:
        assert refusal is not None
        reject = Reject.decode(refusal.payload.to_bytes(), str(refusal.encoding))
    except DecodeError:
        # Zenoh's own error reply: the time is up.
        raise NoAnswer(f"no answer at {key} within {timeout:g} s") from None
    raise Rejected(reject.field, reject.why)


def alive(session: zenoh.Session, key: str, timeout: float) -> list[str]:
    """Keys of the liveliness tokens that match ``key``, in order."""
    found: list[str] = []
    ended = threading.Event()

    def reply(received: zenoh.Reply) -> None:
        if received.ok is not None:
            found.append(str(received.ok.key_expr))

    handler: zenoh.handlers.Callback[zenoh.Reply] = zenoh.handlers.Callback(reply, ended.set, indirect=False)
    session.liveliness().get(key, handler, timeout=timeout)
    ended.wait(timeout + 0.1)
    return sorted(set(found))
