"""A running deployment, seen from outside."""

from __future__ import annotations

import os
import time
import weakref
from dataclasses import dataclass
from typing import TypeVar

import zenoh

from . import keys
from .closable import Closable
from .commands import UNPROVEN, command, lease_of, pause
from .crowd import Crowd, CrowdFunction
from .errors import ConnectionFailed, DecodeError, NoAnswer, Rejected
from .evaluation import Evaluator
from .injected_run import SCENARIO_TIMEOUT, Run
from .injection import Playable, injection, scenario_of
from .messages import (
    Cancel,
    ChangeGoal,
    Clock,
    Lease,
    Message,
    Mission,
    MissionCommand,
    OccupancyGrid,
    RunStatus,
    ServiceStatus,
)
from .profiles import Planner
from .secure import Identity
from .serving import EvaluatorServer
from .session import alive, ask, check_session, close_at_exit, is_forked, open_session

A = TypeVar("A", bound=Message)

_TIMEOUT = 2.0
"""For questions about small things, seconds."""
_MAP_TIMEOUT = 10.0
"""For a map of up to 16 MB, seconds."""


_GOAL_TIMEOUT = 10.0
"""Longest that services are waited for until they have prepared for a goal, s."""
_GOAL_PAUSE = 0.1


@dataclass(frozen=True)
class Service:
    """A service that is alive: its role, its name within it, and its counts if it keeps any."""

    role: str
    instance: str
    status: ServiceStatus | None


def connect(
    endpoint: str | None = None,
    namespace: str | None = None,
    config: str | os.PathLike[str] | None = None,
    timeout: float = 5.0,
    *,
    secure: str | os.PathLike[str] | None = None,
    certificate: str = "experimenter",
) -> Deployment:
    """Connects to a running deployment as a client of its router.

    Args:
        endpoint: Where the router listens, such as ``tcp/10.0.0.1:7447``. Default: that of ``config``, else
            ``tcp/127.0.0.1:7447``.
        namespace: Prefix of every key of the deployment, if it has one.
        config: A Zenoh configuration file (json5) to start from, for TLS for example. Default: the file the
            environment variable ``ZENOH_CONFIG`` names, else settings like those of the services.
        timeout: How long to try, s.
        secure: A folder of certificates, as ``curionav up --secure`` makes it: connect over TLS alone. The default
            endpoint is then ``tls/127.0.0.1:7447``.
        certificate: Which certificate of that folder to show. It decides what the router allows: ``viewer`` looks,
            ``operator`` also commands robots, ``viewer.NAME`` and ``operator.NAME`` those that the certificate lists,
            ``experimenter`` runs scenarios, ``crowd.WORLD`` plays a crowd, and
            ``TERM.INSTANCE`` serves an evaluator.

    Raises:
        ConnectionFailed: No router answered in time, it was not trusted or did not trust the certificate, or the
            configuration was refused.
    """
    identity = None if secure is None else Identity.of(secure, certificate)
    session = open_session(endpoint, namespace, config, timeout, identity)
    return Deployment(session, None if identity is None else identity.name)


def _accepted(mission: Mission) -> Mission:
    if mission.end is not None and mission.end["code"] == "unprepared":
        reject = mission.end["reject"]
        raise Rejected(reject.field, reject.why)
    return mission


class Deployment(Closable):
    """A connection to a deployment, made by `connect`; a context manager that closes it."""

    def __init__(self, session: zenoh.Session, certificate: str | None = None) -> None:
        self._session = session
        # What it shows, if links are over TLS.
        self._certificate = certificate
        self._by = certificate or UNPROVEN
        close_at_exit(self, session)
        self._owned: weakref.WeakSet[EvaluatorServer | Crowd] = weakref.WeakSet()

    def inject(
        self,
        scenario: Playable,
        planner: Planner | None = None,
        seed: int = 1,
        clock: Clock = "lockstep",
        time_scale: float = 1.0,
        *,
        world: str = "world",
        robot: str = "robot",
        crowd: CrowdFunction | None = None,
    ) -> Run:
        """Injects a scenario into a simulated world and starts its run.

        Args:
            scenario: A scenario, a scenario file, or its tables.
            planner: Planner profile: the name of a built-in one, a profile file (``.toml``), or tables as in such a
                file. Default: the scenario's own. The scenario's ``[profile]`` changes it in any case.
            seed: Seed of everything random; equal seeds give equal decisions in lockstep.
            clock: ``lockstep`` waits for every message and runs as fast as the machine allows; ``realtime`` takes the
                newest.
            time_scale: Simulated seconds per second of wall time, with a realtime clock.
            world: Name of the simulated world.
            robot: Name of the robot in it.
            crowd: Plays further people: a function from a `CrowdStep` to ``(x, y)``, ``(x, y, vx, vy)`` or
                ``(x, y, vx, vy, ids)``, columns with an entry per person; m and m/s, map frame. It is called once per
                tick, on a thread of its own; what it raises ends the run. The scenario's people become
                ``kind = "live"``.

        Raises:
            Rejected: The scenario was refused, with the field and the reason, or a run is under way there.
            ScenarioError: The scenario cannot be sent: a file it names is missing, or there is no such planner.
            NoAnswer: No simulator of this world is there.
        """
        found = scenario_of(scenario)
        request = injection(found if crowd is None else found.with_live_people(), planner, seed, clock, time_scale)
        return Run(self._open(), request, world, robot, crowd=crowd, by=self._by)

    def validate(self, scenario: Playable, planner: Planner | None = None, *, world: str = "world") -> None:
        """Checks a scenario as `inject` would, map and routes included, and runs nothing.

        Raises:
            Rejected: It would be refused, with the field and the reason.
            ScenarioError: It cannot be sent: a file it names is missing, or there is no such planner.
            NoAnswer: No simulator of this world is there.
        """
        request = injection(scenario_of(scenario), planner, 1)
        self._ask(keys.world(world, "check"), RunStatus, request, SCENARIO_TIMEOUT)

    def crowd(self, world: str = "world") -> Crowd:
        """The people of a simulated world, to be played from here tick by tick.

        For runs that others inject, or where `inject` with ``crowd`` is not enough. The scenario must say so:
        ``[people] kind = "live"``, or `Scenario.with_live_people`.
        """
        if self._certificate != "experimenter":
            self._need(f"crowd.{world}", f"play the crowd of the world {world}")
        crowd = Crowd(self._open(), world)
        self._owned.add(crowd)
        return crowd

    def serve(
        self, evaluator: Evaluator, instance: str | None = None, *, slots: int = 1, queue: int = 16
    ) -> EvaluatorServer:
        """Answers for an evaluator written in Python, on threads of this process, until the server is closed.

        A profile takes it in by a term of its name. For several processes use ``python -m curionav.serve``.

        Args:
            evaluator: A function decorated with `curionav.evaluator`.
            instance: Name of this replica, which no other replica may have. Default: a random one.
            slots: Questions computed at once, each on a thread of its own.
            queue: Questions that may wait; more are refused as ``overloaded``.
        """
        if self._certificate is not None:
            term, _, named = self._certificate.partition(".")
            instance = instance or (named if term == evaluator.term else None) or "NAME"
            self._need(f"{evaluator.term}.{instance}", f"serve the term {evaluator.term}")
        server = EvaluatorServer(self._open(), evaluator, instance, slots, queue)
        self._owned.add(server)
        return server

    def status(self) -> list[Service]:
        """Every service that is alive, by role and name; only some roles keep counts."""
        found = [keys.service_of(key) for key in alive(self._open(), keys.every_live(), _TIMEOUT)]
        return [Service(*names, self._counts(*names)) for names in found if names is not None]

    def _need(self, certificate: str, what: str) -> None:
        """Fails if the router would be silent because another certificate is needed."""
        if self._certificate not in {None, certificate}:
            raise ConnectionFailed(
                f"the certificate `{self._certificate}` may not {what}: connect with certificate={certificate!r}"
            )

    def _counts(self, role: str, instance: str) -> ServiceStatus | None:
        try:
            return self._ask(keys.status(role, instance), ServiceStatus)
        except (NoAnswer, Rejected, DecodeError):
            return None

    def mission(self, robot: str = "robot") -> Mission:
        """What a robot is to do.

        Raises:
            Rejected: It has had no mission yet (code ``no_mission``).
            NoAnswer: No driver of this robot is there; so for every function about a mission.
        """
        return self._ask(keys.robot(robot, "mission"), Mission)

    def pause(self, robot: str = "robot") -> None:
        """Makes a robot stand until `resume`, in whatever state its mission is, and if it has none.

        Raises:
            NoAnswer: Its base has not obeyed, or the driver that holds its lease.
        """
        pause(self._open(), robot, self._by, True, _TIMEOUT)

    def resume(self, robot: str = "robot") -> None:
        """Lets a paused robot go on."""
        pause(self._open(), robot, self._by, False, _TIMEOUT)

    def lease(self, robot: str = "robot") -> Lease:
        """Which driver the base of a robot obeys, and whether it is paused."""
        return lease_of(self._open(), robot, _TIMEOUT)

    def cancel(self, robot: str = "robot") -> Mission:
        """Ends a robot's mission; a run of it ends without a result."""
        return self._wish(robot, Cancel())

    def goal(self, x: float, y: float, heading: float | None = None, robot: str = "robot") -> Mission:
        """Sends a robot elsewhere on its map: m and rad, map frame; any heading will do if there is none.

        Gives the mission once the robot's services have prepared for the goal, or as it is after 10 s.

        Raises:
            Rejected: The goal is refused: it cannot be reached, or the heading is no turn.
        """
        asked = self._wish(robot, ChangeGoal(x=x, y=y, heading=heading))
        deadline = time.monotonic() + _GOAL_TIMEOUT
        while time.monotonic() < deadline:
            said = self.mission(robot)
            if said.revision != asked.revision:
                break
            if said.state != "preparing":
                return _accepted(said)
            time.sleep(_GOAL_PAUSE)
        return asked

    def grid(self, identity: bytes) -> OccupancyGrid:
        """The map with this hash, such as ``report.map``.

        Raises:
            NoAnswer: No service has this map.
            DecodeError: What came is another one.
        """
        grid = self._ask(keys.grid(identity), OccupancyGrid, timeout=_MAP_TIMEOUT)
        if grid.identity() != identity:
            raise DecodeError(OccupancyGrid.NAME, "map", {"code": "wrong_map"})
        return grid

    def close(self) -> None:
        """Closes the connection, its evaluators and crowds; runs go on without it. Does nothing the second time."""
        if is_forked():
            return
        for owned in list(self._owned):
            owned.close()
        if not self._session.is_closed():
            self._session.close()

    def _open(self) -> zenoh.Session:
        return check_session(self._session)

    def _wish(self, robot: str, request: MissionCommand) -> Mission:
        return command(self._open(), robot, self._by, request, _TIMEOUT)

    def _ask(self, key: str, answer: type[A], question: Message | None = None, timeout: float = _TIMEOUT) -> A:
        return ask(self._open(), key, answer, question, timeout)
