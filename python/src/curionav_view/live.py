"""Messages as they come over Zenoh: one run after the other, each with a story of its own."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

from curionav import Deployment, keys
from curionav.errors import CurionavError, DecodeError, NoAnswer, Rejected
from curionav.messages import MESSAGES, Message, Mission, OccupancyGrid
from curionav.session import Mailbox, News, open_session, subscribe

from .story import Story

STREAMS = ("scan", "odom", "people", "belief", "mission", "decision", "cmd", "report")
"""What is listened to of a robot."""
MAILBOX_BYTES = 128 << 20
"""Messages that may wait to be drawn; a lockstep run may be faster than the eye, and is drawn behind."""
_KINDS = {kind.encoding(): kind for kind in MESSAGES.values()}
_POLL = 0.5
_LATE = 1.5
"""What still comes after the end of a run: the last reports, and the result, seconds."""

_log = logging.getLogger("curionav")


@dataclass(frozen=True)
class Source:
    """Where to listen."""

    endpoint: str | None = None
    namespace: str | None = None
    config: str | None = None
    timeout: float = 5.0
    robot: str = "robot"
    world: str = "world"


class Live:
    """Listens to a robot and draws what it hears.

    Attributes:
        refused: Messages that could not be understood and were passed over.
    """

    def __init__(self, source: Source, begin: Callable[[str], Story], say: Callable[[str], None]) -> None:
        self._source, self._begin, self._say = source, begin, say
        self._session = open_session(source.endpoint, source.namespace, source.config, source.timeout)
        self._deployment = Deployment(self._session)
        self._news = News()
        self._mail = Mailbox(self._news, MAILBOX_BYTES)
        self._story: Story | None = None
        self._run: int | None = None
        self._maps: dict[bytes, OccupancyGrid] = {}
        self._asked = 0.0
        self._over: float | None = None
        self.refused = 0
        wanted = [keys.robot(source.robot, stream) for stream in STREAMS] + [keys.world(source.world, "run")]
        self._subscribers = [subscribe(self._session, key, self._mail.put) for key in wanted]

    def follow(self, goes_on: Callable[[], bool], once: bool = False) -> None:
        """Draws until ``goes_on`` says no, or with ``once`` until the run under way, or else the next, has ended."""
        self._join()
        while goes_on():
            seen = self._news.count
            item = self._mail.take()
            if item is not None:
                self._receive(*item)
                continue
            self._fetch_map()
            if once and self._over is not None and time.monotonic() - self._over > _LATE:
                return
            self._news.wait(seen, _POLL)

    def _join(self) -> None:
        """Takes in a run that is under way already."""
        try:
            mission = self._deployment.mission(self._source.robot)
        except Rejected:
            self._say(f"robot `{self._source.robot}` has had nothing to do yet; waiting for a run")
        except (NoAnswer, DecodeError):
            others = [name for name in self._robots() if name != self._source.robot]
            hint = f"; there is {', '.join(others)}: choose with --robot" if others else ""
            self._say(f"no robot `{self._source.robot}` answers yet{hint}; waiting for one")
        else:
            if mission.state in ("finished", "cancelled"):
                self._run = mission.run
                self._say(f"robot `{self._source.robot}` has nothing to do at the moment; waiting for a run")
                return
            self._receive_message(mission)

    def _robots(self) -> list[str]:
        services = [service.status for service in self._deployment.status()]
        return sorted({status.robot for status in services if status is not None and status.robot})

    def _receive(self, data: bytes, encoding: str) -> None:
        kind = _KINDS.get(encoding)
        try:
            if kind is None:
                raise DecodeError(encoding[:96], "", "is no message of this version")
            self._receive_message(kind.decode(data, encoding))
        except DecodeError as error:
            self.refused += 1
            if self.refused == 1:
                self._say(f"a message was not understood and passed over: {error}")
            _log.warning("passed over: %s", error)

    def _receive_message(self, message: Message) -> None:
        if isinstance(message, Mission):
            if message.run != self._run:
                self._run = message.run
                self._over = None
                self._story = self._begin(f"{message.robot}, run {message.run}")
                self._asked = 0.0
            if message.state in ("finished", "cancelled") and self._over is None:
                self._over = time.monotonic()
                self._say(f"the mission is {message.state}" + (f": {message.note}" if message.note else ""))
        if self._story is not None:
            self._story.draw(message)

    def _fetch_map(self) -> None:
        """Asks for the mission's map until it is there: it may come a little later than the mission."""
        story = self._story
        if story is None or story.mission is None or story.grid is not None:
            return
        if time.monotonic() - self._asked < 1.0:
            return
        self._asked = time.monotonic()
        wanted = story.mission.map
        try:
            grid = self._maps[wanted] if wanted in self._maps else self._deployment.grid(wanted)
        except CurionavError as error:
            _log.info("no map yet: %s", error)
            return
        self._maps = {wanted: grid}
        story.draw(grid)

    @property
    def lost(self) -> int:
        """Messages given up because they came faster than they could be drawn."""
        return self._mail.lost

    def close(self) -> None:
        """Stops listening. Does nothing the second time."""
        self._deployment.close()
