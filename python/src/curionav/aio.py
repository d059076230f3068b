"""The same for programs that use asyncio: nothing here holds up the event loop.

>>> import asyncio, curionav.aio
>>> async def main():
...     async with curionav.aio.connect("tcp/127.0.0.1:7447") as deployment:
...         async with deployment.inject("scenarios/quickstart.toml", seed=1) as run:
...             async for report in run:
...                 print(report.scene.stamp, report.decision.action)
...             print((await run.wait()).measures)
>>> asyncio.run(main())                                                          # doctest: +SKIP
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Generator
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Protocol, TypeVar

from . import deployment as blocking
from .crowd import CrowdFunction
from .errors import CurionavError
from .evaluation import Evaluator
from .explain import Explanation
from .injected_run import _POLL_PERIOD, Run
from .messages import Clock, CycleReport, Decision, Lease, Mission, OccupancyGrid, RunStatus
from .profiles import Planner
from .result import Result
from .scenario import Scenario
from .serving import EvaluatorServer
from .session import Mailbox

M = TypeVar("M", CycleReport, Decision)


class _Closable(Protocol):
    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


E = TypeVar("E", bound=_Closable)


class Opening(Generic[E]):
    """Something that takes time to open: ``await`` it, or enter it with ``async with``."""

    def __init__(self, opened: Callable[[], Awaitable[E]]) -> None:
        self._open = opened
        self._opened: E | None = None

    def __await__(self) -> Generator[Any, None, E]:
        return self._open().__await__()

    async def __aenter__(self) -> E:
        self._opened = await self._open()
        return self._opened

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._opened is not None:
            await self._opened.__aexit__(kind, error, trace)


def connect(
    endpoint: str | None = None,
    namespace: str | None = None,
    config: str | os.PathLike[str] | None = None,
    timeout: float = 5.0,
    *,
    secure: str | os.PathLike[str] | None = None,
    certificate: str = "experimenter",
) -> Opening[AsyncDeployment]:
    """As `curionav.connect`."""

    def connecting() -> blocking.Deployment:
        return blocking.connect(endpoint, namespace, config, timeout, secure=secure, certificate=certificate)

    async def opened() -> AsyncDeployment:
        return AsyncDeployment(await asyncio.to_thread(connecting))

    return Opening(opened)


class AsyncDeployment:
    """As `curionav.Deployment`."""

    def __init__(self, deployment: blocking.Deployment) -> None:
        self._blocking = deployment

    def inject(
        self,
        scenario: Scenario | str | Path | dict[str, Any],
        planner: Planner | None = None,
        seed: int = 1,
        clock: Clock = "lockstep",
        time_scale: float = 1.0,
        *,
        world: str = "world",
        robot: str = "robot",
        crowd: CrowdFunction | None = None,
    ) -> Opening[AsyncRun]:
        """As `curionav.Deployment.inject`; ``crowd`` is called on a thread of its own."""

        async def opened() -> AsyncRun:
            def inject() -> Run:
                return self._blocking.inject(
                    scenario, planner, seed, clock, time_scale, world=world, robot=robot, crowd=crowd
                )

            return AsyncRun(await asyncio.to_thread(inject))

        return Opening(opened)

    async def validate(
        self, scenario: Scenario | str | Path | dict[str, Any], planner: Planner | None = None, *, world: str = "world"
    ) -> None:
        """As `curionav.Deployment.validate`."""
        await asyncio.to_thread(self._blocking.validate, scenario, planner, world=world)

    def serve(
        self, evaluator: Evaluator, instance: str | None = None, *, slots: int = 1, queue: int = 16
    ) -> EvaluatorServer:
        """As `curionav.Deployment.serve`; its threads do not hold up the loop."""
        return self._blocking.serve(evaluator, instance, slots=slots, queue=queue)

    async def status(self) -> list[blocking.Service]:
        """Every service that is alive."""
        return await asyncio.to_thread(self._blocking.status)

    async def mission(self, robot: str = "robot") -> Mission:
        """What a robot is to do."""
        return await asyncio.to_thread(self._blocking.mission, robot)

    async def pause(self, robot: str = "robot") -> None:
        """Makes a robot stand until `resume`."""
        await asyncio.to_thread(self._blocking.pause, robot)

    async def resume(self, robot: str = "robot") -> None:
        """Lets it go on."""
        await asyncio.to_thread(self._blocking.resume, robot)

    async def lease(self, robot: str = "robot") -> Lease:
        """Which driver its base obeys, and whether it is paused."""
        return await asyncio.to_thread(self._blocking.lease, robot)

    async def cancel(self, robot: str = "robot") -> Mission:
        """Ends its mission."""
        return await asyncio.to_thread(self._blocking.cancel, robot)

    async def goal(self, x: float, y: float, heading: float | None = None, robot: str = "robot") -> Mission:
        """Sends it elsewhere."""
        return await asyncio.to_thread(self._blocking.goal, x, y, heading, robot)

    async def grid(self, identity: bytes) -> OccupancyGrid:
        """The map with this hash."""
        return await asyncio.to_thread(self._blocking.grid, identity)

    async def close(self) -> None:
        """Closes the connection."""
        await asyncio.to_thread(self._blocking.close)

    async def __aenter__(self) -> AsyncDeployment:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()


class AsyncRun:
    """As `curionav.Run`: ``async for report in run``; leaving its ``async with`` block cancels it."""

    def __init__(self, run: Run) -> None:
        self._run = run

    @property
    def id(self) -> int:
        """The simulator's number of this run."""
        return self._run.id

    @property
    def lost(self) -> int:
        """Reports and decisions that were dropped because the program did not read them in time."""
        return self._run.lost

    def __aiter__(self) -> AsyncIterator[CycleReport]:
        return self.reports()

    def reports(self) -> AsyncIterator[CycleReport]:
        """The account of each planning cycle, as they come; ends with the run."""
        return self._follow(self._run._reports, CycleReport, self._run._reports_complete)

    def explain(self, cycle: int | CycleReport | None = None, top: int = 10) -> Explanation:
        """Why a cycle was decided as it was, as of `curionav.Run.explain`; it does not wait."""
        return self._run.explain(cycle, top)

    def decisions(self) -> AsyncIterator[Decision]:
        """The decisions alone; ends with the run."""
        return self._follow(self._run._decisions, Decision, lambda: True)

    async def _follow(self, mailbox: Mailbox, message: type[M], complete: Callable[[], bool]) -> AsyncIterator[M]:
        run = self._run
        ended_at: float | None = None
        while True:
            seen = run._news.count
            found = run._next(mailbox, message)
            if found is not None:
                yield found
                # A long backlog must not keep other tasks waiting.
                await asyncio.sleep(0)
            elif await self._goes_on() and not run._closed:
                await run._news.wait_async(seen, _POLL_PERIOD)
            else:
                ended_at = ended_at or time.monotonic()
                left = run._left(ended_at, complete)
                if left <= 0.0:
                    return
                await run._news.wait_async(seen, left)

    async def _goes_on(self) -> bool:
        run = self._run
        failed = run._crowd is not None and run._crowd.failure is not None
        return await asyncio.to_thread(run._goes_on) if failed or run._is_to_be_asked() else run._goes_on()

    def status(self) -> RunStatus:
        """Where the run stands: the newest that is known."""
        return self._run.status()

    async def progress(self) -> AsyncIterator[RunStatus]:
        """Where the run stands, whenever the simulator says so; ends with the run's end."""
        run = self._run
        told: RunStatus | None = None
        while True:
            seen = run._news.count
            goes_on = await self._goes_on()
            if run._status is not told:
                told = run._status
                yield told
            if not goes_on or run._closed:
                return
            await run._news.wait_async(seen, _POLL_PERIOD)

    async def wait(self, timeout: float | None = None) -> Result:
        """Waits for the end of the run and gives its result; errors as of `curionav.Run.wait`."""
        run = self._run
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            seen = run._news.count
            if not await self._goes_on():
                return run._result()
            await run._news.wait_async(seen, run._patience(timeout, deadline))

    async def cancel(self, timeout: float = 10.0) -> None:
        """Cancels the run and waits until it has ended."""
        await asyncio.to_thread(self._run.cancel, timeout)

    async def close(self) -> None:
        """Stops listening; the run itself goes on."""
        await asyncio.to_thread(self._run.close)

    async def __aenter__(self) -> AsyncRun:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        def leave() -> CurionavError | None:
            try:
                self._run.__exit__(kind, error, trace)
            except CurionavError as failure:
                return failure
            return None

        failure = await asyncio.to_thread(leave)
        if failure is not None:
            raise failure
