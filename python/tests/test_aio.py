"""The asyncio variant, against a real deployment."""

from __future__ import annotations

import asyncio
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from live import RUN_TIMEOUT, Up, interrupted

import curionav
import curionav.aio
from curionav import Scenario

pytestmark = pytest.mark.live


def test_a_run_gives_every_cycle_while_the_loop_goes_on(up: Up, scenario: Scenario) -> None:
    beats = 0

    async def beat() -> None:
        nonlocal beats
        while True:
            beats += 1
            await asyncio.sleep(0.01)

    async def main() -> None:
        heart = asyncio.create_task(beat())
        async with curionav.aio.connect(up.endpoint) as deployment:
            services = await deployment.status()
            assert len(services) == len(up.pids) - 1
            await deployment.validate(scenario)
            async with deployment.inject(scenario, seed=3) as run:
                reports = [report async for report in run]
                decisions = [decision async for decision in run.decisions()]
                result = await run.wait(RUN_TIMEOUT)
            assert [status async for status in run.progress()][-1].state == "finished"
            assert len(reports) == len(decisions) == result.cycles.count
            assert (await deployment.grid(reports[0].map)).cells.shape == (60, 120)
            run = await deployment.inject(scenario, clock="realtime")
            with pytest.raises(TimeoutError):
                await run.wait(0.2)
            before, started = beats, time.monotonic()
            async for _ in run.decisions():
                if time.monotonic() - started > 1.0:
                    break
            assert beats - before > 30, "the loop was held up"
            await run.cancel()
            await run.close()
            assert run.status().state == "failed"
        heart.cancel()

    asyncio.run(main())


def test_a_run_explains_the_cycles_it_has_given(up: Up, scenario: Scenario) -> None:
    async def main() -> None:
        async with curionav.aio.connect(up.endpoint) as deployment, deployment.inject(scenario, seed=3) as run:
            with pytest.raises(KeyError):
                run.explain()
            reports = [report async for report in run]
            assert run.explain().report is reports[-1]
            assert run.explain(reports[-2].seq).report is reports[-2]
            assert f"cycle {reports[-2].seq} at" in str(run.explain(reports[-2].seq, top=3))

    asyncio.run(main())


def test_leaving_the_block_cancels_a_run_and_errors_come_through(up: Up, scenario: Scenario) -> None:
    def stumbling(step: curionav.CrowdStep) -> Any:
        raise LookupError("it is not there")

    async def main() -> None:
        async with await curionav.aio.connect(up.endpoint) as deployment:
            with pytest.raises(curionav.Rejected):
                await deployment.inject({"name": "bad"})
            async with deployment.inject(scenario, clock="realtime") as run:
                await anext(run.reports())
            assert run.status().state == "failed"
            with pytest.raises(curionav.RunFailed, match="it is not there"):
                async with deployment.inject(scenario, crowd=stumbling) as run:
                    await run.wait(RUN_TIMEOUT)

    asyncio.run(main())
    assert not [t for t in threading.enumerate() if t.name.startswith("curionav")]


def test_ctrl_c_ends_a_program_and_cancels_its_run(up: Up, directory: Path) -> None:
    code = """
import asyncio, curionav.aio
async def main():
    async with curionav.aio.connect(endpoint) as deployment:
        async with deployment.inject(scenario, **slowly) as run:
            async for report in run: here()
asyncio.run(main())
"""
    interrupted(code, up, directory)
    with curionav.connect(up.endpoint) as connection:
        assert connection.mission().state in ("cancelled", "finished")
