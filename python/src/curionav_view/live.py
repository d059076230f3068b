"""Messages as they come over Zenoh: one run after the other, each with its own scene logger.

What was sent before the viewer listened does not come again. So it asks how things stand when it joins: what the robot
is to do, the map, and of a run that is over its result.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

from curionav import Deployment, keys, secure
from curionav.errors import CurionavError, DecodeError, NoAnswer, Rejected
from curionav.messages import MESSAGES, Message, Mission, OccupancyGrid, RunStatus
from curionav.secure import Identity
from curionav.session import DEFAULT_ENDPOINT, Mailbox, News, ask, open_session, subscribe

from . import words
from .scene_logger import SceneLogger

STREAMS = ("scan", "odom", "people", "belief", "particles", "mission", "decision", "cmd", "report")
"""What is listened to of a robot."""
MAILBOX_BYTES = 128 << 20
"""Messages that may wait to be drawn; a lockstep run may be faster than the eye, and is drawn behind."""
_KINDS = {kind.encoding(): kind for kind in MESSAGES.values()}
_OVER = ("finished", "cancelled")
_POLL = 0.5
_TIMEOUT = 2.0
"""For questions about small things, s."""
_AGAIN = 5.0
"""A robot of which nothing is known is asked for this often, s."""
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
    secure: str | None = None
    certificate: str = "viewer"


class Live:
    """Listens to a robot and draws what it hears.

    Args:
        source: Where to listen.
        begin: Makes the scene logger of a run that begins, from the run's name.
        say: Takes a line for the user of the program.
        aside: Makes the scene logger for what is not a new run: a run that was over before, or the wait for one.
            Without it such things are not drawn.

    Attributes:
        refused: Messages that could not be understood and were passed over.
    """

    def __init__(
        self,
        source: Source,
        begin: Callable[[str], SceneLogger],
        say: Callable[[str], None],
        aside: Callable[[str], SceneLogger] | None = None,
    ) -> None:
        self._source, self._begin, self._say, self._aside = source, begin, say, aside
        identity = None if source.secure is None else Identity.of(source.secure, source.certificate)
        self._session = open_session(source.endpoint, source.namespace, source.config, source.timeout, identity)
        self._deployment = Deployment(self._session)
        self._news = News()
        self._mail = Mailbox(self._news, MAILBOX_BYTES)
        self._scene_logger: SceneLogger | None = None
        self._run: int | None = None
        # Whether the run that is drawn began before the viewer did, or there is none.
        self._over_before = True
        self._joined = 0.0
        self._maps: dict[bytes, OccupancyGrid] = {}
        self._asked = 0.0
        self._over: float | None = None
        # Run and revision of the mission that is over.
        self._ended: tuple[int, int] | None = None
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
            self._look_again()
            if once and self._over is not None and time.monotonic() - self._over > _LATE:
                return
            self._news.wait(seen, _POLL)

    def _join(self) -> None:
        """Takes in how things stand."""
        self._joined = time.monotonic()
        robot = self._source.robot
        try:
            mission = self._deployment.mission(robot)
        except Rejected:
            self._wait(f"robot `{robot}` has had nothing to do yet; waiting for a run")
        except (NoAnswer, DecodeError):
            others = [name for name in self._robots() if name != robot]
            hint = f"; there is {', '.join(others)}: choose with --robot" if others else ""
            self._wait(f"no robot `{robot}` answers yet{hint}; waiting for one")
        else:
            if mission.state in _OVER:
                self._say(f"robot `{robot}` has nothing to do at the moment; waiting for a run")
            self._receive_message(mission)
            # A run that was over before is not the one that `once` waits for.
            self._over = None

    def _wait(self, why: str) -> None:
        """Says that there is nothing to see yet, also on the page."""
        self._say(why)
        if self._aside is not None:
            self._scene_logger = self._aside(f"{self._source.robot}, waiting")
            self._scene_logger.note(words.waiting(why, self._endpoint()), always=True)

    def _endpoint(self) -> str | None:
        """Where others can connect to; unknown if a configuration file says so."""
        default = DEFAULT_ENDPOINT if self._source.secure is None else secure.DEFAULT_ENDPOINT
        return self._source.endpoint or (default if self._source.config is None else None)

    def _look_again(self) -> None:
        """A robot that was out of reach may have been given its mission meanwhile."""
        if self._run is not None or time.monotonic() - self._joined < _AGAIN:
            return
        self._joined = time.monotonic()
        try:
            mission = self._deployment.mission(self._source.robot)
        except CurionavError:
            return
        self._receive_message(mission)

    def _robots(self) -> list[str]:
        services = [service.status for service in self._deployment.status()]
        return sorted({status.robot for status in services if status is not None and status.robot})

    def _receive(self, data: bytes, encoding: str) -> None:
        kind = _KINDS.get(encoding)
        try:
            if kind is None:
                known = "a message of this version of the contract"
                raise DecodeError(
                    encoding[:96], "", {"code": "wrong_encoding", "found": encoding[:96], "expected": known}
                )
            self._receive_message(kind.decode(data, encoding))
        except DecodeError as error:
            self.refused += 1
            if self.refused == 1:
                self._say(f"a message was not understood and passed over: {error}")
            _log.warning("passed over: %s", error)

    def _receive_message(self, message: Message) -> None:
        if isinstance(message, Mission):
            self._take(message)
        elif self._scene_logger is not None and self._over_before and isinstance(message, RunStatus):
            self._recall(self._scene_logger, message)
        elif self._scene_logger is not None:
            self._scene_logger.draw(message)

    def _take(self, mission: Mission) -> None:
        over = mission.state in _OVER
        # A robot that is sent on after its run was over stays in the same run.
        if mission.run != self._run or (self._over_before and not over):
            self._run, self._over_before, self._over, self._asked = mission.run, over, None, 0.0
            begin = self._aside if over else self._begin
            self._scene_logger = begin(f"{mission.order.robot}, run {mission.run}") if begin is not None else None
        # A mission is sent again and again while it stays as it is.
        ended = over and self._ended != (mission.run, mission.revision)
        self._ended = (mission.run, mission.revision) if over else None
        if not over:
            self._over = None
        elif ended:
            self._over = time.monotonic()
            self._say(f"the mission is {words.standing(mission)}")
        if self._scene_logger is None:
            return
        self._scene_logger.draw(mission)
        self._fetch_map()
        if ended:
            self._scene_logger.note(words.over(mission, None, self._over_before), always=self._over_before)
        if ended and self._over_before:
            self._ask_for_result(self._scene_logger)

    def _ask_for_result(self, scene_logger: SceneLogger) -> None:
        try:
            status = ask(self._session, keys.world(self._source.world, "run"), RunStatus, None, _TIMEOUT)
        except CurionavError as error:
            # A real robot, or a world of another name.
            _log.info("no result of the run: %s", error)
            return
        self._recall(scene_logger, status)

    @staticmethod
    def _recall(scene_logger: SceneLogger, status: RunStatus) -> None:
        scene_logger.recall(status)
        if scene_logger.mission is not None and status.result is not None:
            scene_logger.note(words.over(scene_logger.mission, status.result, before=True), always=True)

    def _fetch_map(self) -> None:
        """Asks for the mission's map until it is there: it may come a little later than the mission."""
        scene_logger = self._scene_logger
        if scene_logger is None or scene_logger.mission is None or scene_logger.grid is not None:
            return
        if time.monotonic() - self._asked < 1.0:
            return
        self._asked = time.monotonic()
        wanted = scene_logger.mission.order.map
        try:
            grid = self._maps[wanted] if wanted in self._maps else self._deployment.grid(wanted)
        except CurionavError as error:
            _log.info("no map yet: %s", error)
            return
        self._maps = {wanted: grid}
        scene_logger.draw(grid)

    @property
    def lost(self) -> int:
        """Messages given up because they came faster than they could be drawn."""
        return self._mail.lost

    def close(self) -> None:
        """Stops listening. Does nothing the second time."""
        self._deployment.close()
