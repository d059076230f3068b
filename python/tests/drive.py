"""A made-up drive through a hall, as the messages of a robot, and a recording of it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer

from curionav import keys
from curionav.array import F64
from curionav.messages import (
    Belief,
    CandidateSet,
    Crowd,
    CycleReport,
    Cycles,
    Decision,
    Disc,
    Health,
    LaserModel,
    Measures,
    Message,
    Mission,
    MissionOrder,
    OccupancyGrid,
    Odometry,
    OdometryNoise,
    Particles,
    People,
    PeopleTrace,
    Pose,
    RobotModel,
    RunResult,
    RunStatus,
    Scan,
    Scene,
    TermReport,
    TermTime,
    Timings,
    Trace,
    Twist,
)

ROBOT, WORLD = "robot", "world"
COUNT, STEPS, DT = 24, 10, 0.3
THRESHOLD = 0.1
BEAMS = 91


def grid() -> OccupancyGrid:
    """A hall of 16 m x 10 m with walls around and a pillar; the robot starts in the open."""
    cells = np.zeros((50, 80), np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 100, 100, 100, 100
    cells[30:36, 50:56] = 100
    cells[2:6, 70:78] = -1
    unnamed = OccupancyGrid(
        width=80, height=50, resolution=0.2, origin=Pose(x=-1.0, y=-2.0, heading=0.0), cells=cells, map=bytes(32)
    )
    return dataclasses.replace(unnamed, map=unnamed.identity())


def mission(state: str = "running", run: int = 1) -> Mission:
    terms = {
        "cnc": {"scale": 0.1, "weight": 4.0, "when": "always"},
        "cpc": {"scale": 0.1, "weight": 2.0, "when": "uncertain"},
        "distance": {"scale": 2.0, "weight": 1.0, "when": "always"},
    }
    profile = {
        "name": "curiosity",
        "normalisation": "fixed",
        "terms": terms,
        "uncertainty": {"threshold": THRESHOLD},
        "hccdm": {"personal_distance": 1.5},
        "information": {"sigma": 0.2, "beams": 20, "correlation": 4.0},
    }
    order = MissionOrder(
        robot=ROBOT,
        map=grid().map,
        initial_pose=Pose(x=1.0, y=3.0, heading=0.0),
        initial_covariance=np.eye(3) * 0.1,
        goal_x=12.0,
        goal_y=3.0,
        goal_tolerance=0.5,
        profile=profile,
        localizer={},
        laser=LaserModel(
            robot_from_laser=Pose(x=0.1, y=0.0, heading=0.0), fov=math.pi, beams=BEAMS, range_max=5.0, range_sigma=0.03
        ),
        robot_model=RobotModel(footprint=Disc(radius=0.3), v_max=1.0, a_max=0.5, omega_max=1.0, alpha_max=1.0),
        odometry_noise=OdometryNoise(
            position_per_metre=0.004, position_per_radian=0.0, heading_per_metre=0.001, heading_per_radian=0.001
        ),
        seed=1,
        clock="realtime",
        time_scale=1.0,
        tick_s=0.1,
        plan_every=1,
        require=[],
    )
    return Mission(
        lease=17,
        run=run,
        revision=1,
        order=order,
        ready=[],
        state=state,  # type: ignore[arg-type]
        has_run=True,
        end={"code": "reached"} if state == "finished" else None,
    )


def belief(tick: int) -> Belief:
    variance = 0.3 * math.exp(-tick / 10.0) + 0.002
    return Belief(
        tick=tick,
        stamp=tick * 0.1,
        x=1.0 + 0.1 * tick,
        y=3.0,
        heading=0.0,
        covariance=np.array([[variance, 0.2 * variance, 0.0], [0.2 * variance, 0.3 * variance, 0.0], [0.0, 0.0, 0.01]]),
        v=1.0,
        omega=0.0,
        health=Health(outside_weight=0.0, scan_fit=1.0, particles=300, confidence="sure"),
    )


def particles(tick: int) -> Particles:
    """Drawn from the belief; the last one is far off and weighs nothing."""
    here = belief(tick)
    mean = (here.x, here.y, here.heading)
    drawn = np.random.default_rng(tick).multivariate_normal(mean, here.covariance, 300).astype(np.float32)
    drawn[-1] = (14.0, 1.0, 3.0)
    weight = np.full(300, 1.0 / 299.0, np.float32)
    weight[-1] = 0.0
    return Particles(tick=tick, stamp=tick * 0.1, x=drawn[:, 0], y=drawn[:, 1], heading=drawn[:, 2], weight=weight)


def people(tick: int, frame: str = "map") -> People:
    angles = np.arange(5) * 1.1
    return People(
        tick=tick,
        stamp=tick * 0.1,
        frame=frame,  # type: ignore[arg-type]
        radius=0.25,
        id=np.arange(5, dtype=np.uint32),
        x=7.0 + np.cos(angles),
        y=5.0 + 0.8 * np.sin(angles) - 0.02 * tick,
        vx=np.full(5, 0.1),
        vy=np.full(5, -0.2),
    )


def report(tick: int) -> CycleReport:
    """A cycle at every tick; the third candidate is chosen, whatever it costs, every sixth rejected."""
    here = belief(tick)
    uncertain = bool(np.trace(here.covariance) > THRESHOLD)
    turn = np.linspace(-1.0, 1.0, COUNT)[:, None]
    time = (np.arange(STEPS) + 1) * DT
    heading = turn * time / 2.0
    x = here.x + np.cumsum(np.cos(heading) * DT, axis=1)
    y = here.y + np.cumsum(np.sin(heading) * DT, axis=1)
    ones = np.ones((COUNT, STEPS))
    # The scale is that of one state.
    raw: dict[str, F64] = {
        "cnc": np.linspace(0.5, 0.1, COUNT),
        "cpc": np.linspace(0.1, 0.9, COUNT),
        "distance": np.linspace(20.0, 43.0, COUNT),
    }
    profile = mission().order.profile["terms"]
    asked = {name: term for name, term in profile.items() if uncertain or term["when"] == "always"}
    cost = {name: term["weight"] * raw[name] / (term["scale"] * STEPS) for name, term in asked.items()}
    none = np.full(COUNT, np.nan)
    terms = [
        TermReport.of(
            term=name,
            weight=term["weight"],
            scale=term["scale"],
            active=name in asked,
            raw=raw[name] if name in asked else none,
            evaluated="local" if name == "distance" else "pool",
            cost=cost.get(name, none),
        )
        for name, term in profile.items()
    ]
    rejected: list[dict[str, Any] | None] = [
        {"code": "hits_wall", "after_s": 0.1 * i} if i % 6 == 5 else None for i in range(COUNT)
    ]
    total = np.asarray(sum(cost.values()))
    chosen = 2
    runner_up = min((i for i in range(COUNT) if i != chosen and not rejected[i]), key=lambda i: float(total[i]))
    decision = Decision(
        epoch=1,
        seq=tick,
        tick=tick,
        stamp=tick * 0.1,
        valid_for_s=1.2,
        action="follow",
        reason={"code": "least_cost"},
        arrived=False,
        candidate=chosen,
        dt=DT,
        x=x[chosen],
        y=y[chosen],
        heading=heading[chosen],
        v=ones[chosen],
        omega=0 * ones[chosen],
        uncertainty=float(np.trace(here.covariance)),
        uncertain=uncertain,
        evaluated={"cnc": "pool", "distance": "local"},
        degraded=[{"code": "evaluated_locally", "term": "cnc"}] if tick == 4 else [],
        elapsed_us=9000,
    )
    return CycleReport(
        robot=ROBOT,
        epoch=1,
        seq=tick,
        map=grid().map,
        scene=Scene(tick=tick, stamp=tick * 0.1, belief=here, people=people(tick), uncertain=uncertain, in_place_s=0.0),
        candidates=CandidateSet(
            count=COUNT,
            steps=STEPS,
            dt=DT,
            id=np.arange(COUNT, dtype=np.uint32),
            x=x,
            y=y,
            heading=heading,
            v=ones,
            omega=0 * ones,
        ),
        terms=terms,
        scored=np.arange(COUNT, dtype=np.uint32),
        total=total,
        rejected=rejected,
        chosen=chosen,
        runner_up=runner_up,
        margin=float(total[runner_up] - total[chosen]),
        decision=decision,
        timings=Timings(
            generate_us=5000,
            evaluate_us=[TermTime(term="cnc", us=2000), TermTime(term="distance", us=500)],
            arbitrate_us=30,
            total_us=9000,
        ),
        crowds=[
            Crowd(x=7.0, y=5.0, sigma=2.0, weight=4.0, members=4),
            Crowd(x=9.0, y=2.0, sigma=1.5, weight=1.0, members=1),
        ],
        driven=command(tick - 1) if tick else None,
        gap=0,
    )


def command(tick: int) -> Twist:
    """The driver follows, but for one tick in which something is too close."""
    near = tick == 6
    since = 0.6 if near else 0.7 if tick > 6 else 0.0
    return Twist(
        lease=17,
        epoch=1, seq=tick, tick=tick, stamp=tick * 0.1, v=0.2 if near else 1.0, omega=0.0,
        reason="too_close" if near else "tracking", since=since,
    )  # fmt: skip


def status(ticks: int) -> RunStatus:
    """The end of a run, with what really happened: 10 cm beside what was believed."""
    columns = ["time_s", "true_x", "true_y", "belief_x", "belief_y", "belief_heading"]
    columns += ["cov_xx", "cov_xy", "cov_yy", "cov_hh", "v", "omega"]
    rows = [
        (b.stamp, b.x, b.y + 0.1, b.x, b.y, b.heading, *np.asarray(b.covariance)[[0, 0, 1, 2], [0, 1, 1, 2]], b.v, 0.0)
        for b in map(belief, range(ticks))
    ]
    walkers = [people(tick) for tick in range(ticks)]
    # The last of the five leaves after the first tick.
    present = np.ones((ticks, 5), np.uint8)
    present[1:, 4] = 0
    tracks = PeopleTrace(
        rows=ticks, id=walkers[0].id, xy=np.stack([np.stack([w.x, w.y], axis=1) for w in walkers]), present=present
    )
    result = RunResult(
        scenario="made-up",
        planner="curiosity",
        seed=1,
        outcome="reached",
        measures=Measures(
            rmse_m=0.1, tcm=0.1, nm=0, td=0.0, md_m=1.9, nt=0, vel_mps=1.0, length_m=5.0, time_s=5.0, collisions=0,
            clearance_min_m=0.5,
        ),
        contacts=[],
            cycles=Cycles(count=ticks, degraded=1, p50_ms=9.0, p99_ms=9.0, max_ms=9.0),
        real_time_factor=1.0,
        decisions_sha256="0" * 64,
        trace=Trace(rows=ticks, columns=columns, values=np.array(rows), people=tracks),
    )  # fmt: skip
    return RunStatus(
        run=1, world=WORLD, state="finished", tick=ticks, time_s=ticks * 0.1, distance_to_goal=0.2, result=result
    )


def drive(ticks: int = 20) -> list[tuple[str, Message]]:
    """(key, message) of a whole run, in the order they were sent."""

    def own(stream: str) -> str:
        return keys.robot(ROBOT, stream)

    sent: list[tuple[str, Message]] = [(own("mission"), mission()), (keys.grid(grid().map), grid())]
    for tick in range(ticks):
        stamp = tick * 0.1
        angles = np.linspace(-math.pi / 2, math.pi / 2, BEAMS)
        ranges = np.minimum(5.0 / np.maximum(np.abs(np.sin(angles)), 1e-3), 5.0)
        sent += [
            (own("scan"), Scan(
                tick=tick, stamp=stamp, angle_min=-math.pi / 2, angle_increment=math.pi / (BEAMS - 1), range_max=5.0,
                laser=Pose(x=0.1, y=0.0, heading=0.0), ranges=ranges,
            )),
            (own("odom"), Odometry(tick=tick, stamp=stamp, x=0.1 * tick, y=0.0, heading=0.0, v=1.0, omega=0.0)),
            (own("belief"), belief(tick)),
            (own("people"), people(tick)),
            (own("decision"), report(tick).decision),
            (own("report"), report(tick)),
            (own("cmd"), command(tick)),
        ]  # fmt: skip
        if tick % 5 == 0:
            sent.append((own("particles"), particles(tick)))
    return [*sent, (own("mission"), mission("finished")), (keys.world(WORLD, "run"), status(ticks))]


def record(path: Path, messages: list[tuple[str, Message]], start_ns: int | None = None) -> Path:
    """Writes messages as `curionav record` does, with a picture for others beside them.

    From ``start_ns`` on they have the times of their stamps; without it they are one nanosecond apart.
    """
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=100_000)
        writer.start(profile="", library="curionav tests")
        picture = writer.register_schema(name="foxglove.Log", encoding="jsonschema", data=b"{}")
        other = writer.register_channel(topic="/robot/log", message_encoding="json", schema_id=picture)
        writer.add_message(other, 0, b"{}", 0)
        channels: dict[str, int] = {}
        time = 0 if start_ns is None else start_ns
        for number, (key, message) in enumerate(messages):
            if start_ns is None:
                time = number
            elif hasattr(message, "stamp"):
                time = start_ns + round(1e9 * message.stamp)
            if key not in channels:
                schema = writer.register_schema(name=f"curionav.{message.NAME}.v1", encoding="cddl", data=b"")
                channels[key] = writer.register_channel(topic=key, message_encoding="cbor", schema_id=schema)
            writer.add_message(channels[key], time, message.encode(), time)
        writer.finish()  # type: ignore[no-untyped-call, unused-ignore]
    return path
