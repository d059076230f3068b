"""Measures what the README promises: ``python python/benchmarks/measure.py [--connect ENDPOINT]``.

Decoding needs nothing else. With ``--connect`` it also compares an evaluator in Python with the services' own, and
watches a run in real time: for these a deployment must be up (``curionav up deploy/local.toml``).
"""

from __future__ import annotations

import argparse
import dataclasses
import resource
import statistics
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import curionav
from curionav import keys
from curionav.messages import CandidateSet, CandidateShard, CycleReport, EvaluateRequest, People, Scores, TermReport
from curionav.session import ask

GOLDEN = Path(__file__).resolve().parents[2] / "schemas" / "golden"
SCENARIO = Path(__file__).resolve().parents[2] / "scenarios" / "quickstart.toml"
REPEATS = 31


def median_ms(work: Callable[[], object]) -> tuple[float, float]:
    """(median, least) of `REPEATS` times, ms."""
    took = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        work()
        took.append((time.perf_counter() - started) * 1e3)
    return statistics.median(took), min(took)


def candidates(count: int, steps: int, near: tuple[float, float] = (16.0, 16.0)) -> CandidateSet:
    """Smooth random drives from one place."""
    random = np.random.default_rng(3)
    dt = 0.1
    omega = np.clip(np.cumsum(random.uniform(-0.15, 0.15, (count, steps)), axis=1), -1.0, 1.0)
    heading = np.cumsum(omega * dt, axis=1)
    v = np.repeat(random.uniform(0.35, 1.0, (count, 1)), steps, axis=1)
    return CandidateSet(
        count=count,
        steps=steps,
        dt=dt,
        id=np.arange(count, dtype=np.uint32),
        x=near[0] + np.cumsum(v * dt * np.cos(heading), axis=1),
        y=near[1] + np.cumsum(v * dt * np.sin(heading), axis=1),
        heading=heading,
        v=v,
        omega=omega,
    )


def people(count: int, near: tuple[float, float] = (16.0, 16.0)) -> People:
    """People around a place, on their way."""
    random = np.random.default_rng(2)
    return People(
        tick=0,
        stamp=0.0,
        frame="map",
        radius=0.25,
        id=np.arange(count, dtype=np.uint32),
        x=near[0] + random.uniform(-10.0, 10.0, count),
        y=near[1] + random.uniform(-10.0, 10.0, count),
        vx=random.uniform(-0.7, 0.7, count),
        vy=random.uniform(-0.7, 0.7, count),
    )


def report(count: int, steps: int) -> CycleReport:
    """A cycle report of a batch of that size."""
    golden = CycleReport.decode((GOLDEN / "cycle_report.cbor").read_bytes())
    raw = np.asarray(np.linspace(1.0, 2.0, count), np.float64)
    terms = [
        TermReport.of(term=term, weight=1.0, scale=1.0, active=True, raw=raw, cost=raw, evaluated="pool")
        for term in ("cnc", "cpc", "distance")
    ]
    return dataclasses.replace(
        golden,
        candidates=candidates(count, steps),
        terms=terms,
        scored=np.arange(count, dtype=np.uint32),
        total=raw,
        rejected=[None] * count,
        chosen=0,
    )


def request(count: int, steps: int) -> EvaluateRequest:
    """A question for that many candidates among 40 people."""
    golden = EvaluateRequest.decode((GOLDEN / "evaluate_request.cbor").read_bytes())
    scene = dataclasses.replace(golden.scene, people=people(40))
    return dataclasses.replace(
        golden,
        scene=scene,
        candidates=CandidateShard.of(candidates(count, steps)),
        budget_ms=10_000,
        goal_x=20.0,
        goal_y=20.0,
        params={},
    )


@curionav.evaluator("discomfort")
def discomfort(scene: curionav.Scene, candidates: CandidateSet) -> NDArray[np.float64]:
    """How far candidates come closer to people than 1.5 m; people walk on as they do."""
    around = scene.people
    ahead = candidates.dt * np.arange(1, candidates.steps + 1)
    cost = np.zeros(candidates.count)
    for x, y, vx, vy in zip(around.x, around.y, around.vx, around.vy, strict=True):
        squared = (candidates.x - (x + vx * ahead)) ** 2 + (candidates.y - (y + vy * ahead)) ** 2
        cost += np.maximum(2.25 - squared, 0.0).sum(axis=1)
    return cost


def decoding() -> None:
    """Bytes to arrays."""
    for name, message in [
        ("candidates", candidates(2000, 56)),
        ("evaluate_request", request(2000, 56)),
        ("cycle_report", report(2000, 56)),
    ]:
        data = message.encode()
        median, least = median_ms(partial(type(message).decode, data))
        print(f"decode {name:17} 2000 x 56, {len(data) / 1e6:.1f} MB: {median:6.2f} ms median, {least:6.2f} ms least")


def evaluating(deployment: curionav.Deployment) -> None:
    """A question to a Python evaluator, and the same to the services' own evaluator of crowds."""
    own = next(service.instance for service in deployment.status() if service.role == "cnc")
    with deployment.serve(discomfort) as server:
        for count, steps in [(100, 13), (2000, 56)]:
            asked = request(count, steps)
            none = dataclasses.replace(asked, candidates=CandidateShard.of(candidates(0, steps)))
            figures = {}
            for term, instance in [("discomfort", server.instance), ("cnc", own)]:
                key = keys.question(term, instance, "robot")
                ask(deployment._session, key, Scores, none, 10.0)
                inside: list[float] = []

                def once(key: str = key, inside: list[float] = inside, asked: EvaluateRequest = asked) -> None:
                    inside.append(ask(deployment._session, key, Scores, asked, 60.0).elapsed_us / 1e3)

                around, _ = median_ms(once)
                figures[term] = (statistics.median(inside), around)
            function, _ = median_ms(partial(discomfort.costs, asked))
            python, rust = figures["discomfort"], figures["cnc"]
            print(
                f"evaluate {count:4} x {steps}, 40 people: Python {python[0]:6.2f} ms in the replica "
                f"({function:.2f} ms of it the function), cnc in Rust {rust[0]:6.2f} ms: "
                f"{python[0] / rust[0]:.1f} times; with the way there and back {python[1]:.2f} and {rust[1]:.2f} ms"
            )


def watching(deployment: curionav.Deployment) -> None:
    """What following a run in real time costs, at a cycle every 0.1 s."""
    with deployment.inject(SCENARIO, clock="realtime") as run:
        reports = iter(run)
        next(reports)
        before, started, count = resource.getrusage(resource.RUSAGE_SELF), time.monotonic(), 0
        for _ in reports:
            count += 1
        after, seconds = resource.getrusage(resource.RUSAGE_SELF), time.monotonic() - started
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"watch {count / seconds:.1f} reports per second for {seconds:.0f} s: {100 * used / seconds:.1f} % of a core")


def main() -> None:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", metavar="ENDPOINT", help="router of a deployment that is up")
    options = parser.parse_args()
    decoding()
    if options.connect:
        with curionav.connect(options.connect) as deployment:
            evaluating(deployment)
            watching(deployment)


if __name__ == "__main__":
    main()
