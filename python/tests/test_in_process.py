"""What runs in this process: the same as a deployment, without one."""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import hall, program

import curionav
from curionav import Belief, FileError, MissingExtra, People, Rejected, RunFailed, Scenario, ScenarioError
from curionav.built_in_scenarios import names
from curionav.messages import Disc

pytest.importorskip("curionav_native", reason="no extension module; pip install ./python with Cargo")

SAME = [("quickstart", "curionav"), ("rooms/offices-1", "curiosity"), ("dense/door-hrvo-01", "dwa")]
TOUCH = 0.55
"""Between the centres of a robot of 0.3 m and a person of 0.25 m that touch, m."""


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    folder = tmp_path_factory.mktemp("hall")
    return Scenario.from_dict(hall(folder), folder)


def of_the_program(scenario: str, *arguments: str) -> dict[str, Any]:
    """What `curionav run` prints of a scenario of the checkout."""
    file = ROOT / "scenarios" / f"{scenario}.toml"
    command = [str(program()), "run", str(file), "--json", *arguments]
    printed = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False).stdout
    shown: dict[str, Any] = json.loads(printed)
    return shown


START = Belief.at(2.0, 3.0, 0.0)
GOAL = (9.0, 3.0)
NOBODY = People.at([], [])
IN_THE_WAY = People.at([5.0], [3.0])


@pytest.mark.parametrize(("scenario", "planner"), SAME)
def test_a_run_is_that_of_the_program(scenario: str, planner: str) -> None:
    shown = of_the_program(scenario, "--planner", planner, "--seed", "3")
    result = curionav.run(scenario, planner=planner, seed=3)
    assert result.decisions_sha256 == shown["decisions_sha256"]
    assert (result.outcome, result.planner, result.seed) == (shown["outcome"], planner, 3)
    for name, value in shown["metrics"].items():
        assert getattr(result.measures, name) == value, name


def test_a_run_in_which_people_are_tracked_is_that_of_the_program() -> None:
    shown = of_the_program("quickstart", "--perception", "tracked")
    tracked = curionav.run(Scenario.load("quickstart").with_perception("tracked"))
    assert tracked.decisions_sha256 == shown["decisions_sha256"] != curionav.run("quickstart").decisions_sha256


@pytest.mark.live
def test_a_run_gives_what_an_injected_one_gives(connected: curionav.Deployment, small: Scenario) -> None:
    injected = connected.inject(small, seed=5).wait()
    here = curionav.run(small, seed=5)
    assert here.decisions_sha256 == injected.decisions_sha256
    assert (here.outcome, here.measures, here.social) == (injected.outcome, injected.measures, injected.social)
    assert all(np.array_equal(here.trace[name], injected.trace[name]) for name in injected.trace)


def test_scenarios_of_the_package_need_no_file() -> None:
    assert {"quickstart", "dense/plaza-hrvo-02"} <= set(names())
    assert curionav.run("quickstart").scenario == "quickstart"
    with pytest.raises(ScenarioError, match=r"no scenario `quickstat`.*quickstart"):
        curionav.run("quickstat")
    with pytest.raises(ScenarioError, match=r"no scenario `dense/plaza`.*dense/plaza-hrvo-02"):
        curionav.run("dense/plaza")


def test_what_is_refused_names_file_field_and_what_would_do(small: Scenario, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.toml"
    shutil.copytree(ROOT / "scenarios" / "maps", tmp_path / "maps")
    text = (ROOT / "scenarios" / "quickstart.toml").read_text()
    wrong.write_text(text.replace("goal_tolerance = 0.5", "goal_tolerance = -1.0"))
    with pytest.raises(Rejected) as refused:
        curionav.run(wrong)
    assert (refused.value.file, refused.value.field) == (wrong, "robot.goal_tolerance")
    assert str(refused.value).startswith(f"{wrong}: robot.goal_tolerance: ")
    with pytest.raises(RunFailed, match="smooth") as failed:
        curionav.run(small.with_term("smooth"))
    assert failed.value.end is not None
    assert failed.value.end["code"] == "unprepared"
    with pytest.raises(RunFailed, match=r"people\.kind"):
        curionav.run(small.with_live_people())
    with pytest.raises(ScenarioError, match=r"none\.toml"):
        curionav.run(tmp_path / "none.toml")
    with pytest.raises(ScenarioError, match=r"planner.*no-such-planner"):
        curionav.run(small, planner="no-such-planner")


def test_without_the_module_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "curionav_native", None)
    with pytest.raises(MissingExtra, match=r"curionav_native.*pip install \./python"):
        curionav.run("quickstart")


def test_other_threads_go_on_while_a_run_is_computed() -> None:
    ended = threading.Event()
    seen = 0

    def count() -> None:
        nonlocal seen
        while not ended.wait(0.001):
            seen += 1

    counter = threading.Thread(target=count)
    counter.start()
    try:
        before = seen
        curionav.run("quickstart")
        during = seen - before
    finally:
        ended.set()
        counter.join()
    # Were the lock held, it would count once as the run begins and once as it ends.
    assert during > 20


def test_a_run_is_ended_by_ctrl_c() -> None:
    code = "import curionav, sys; print('here', flush=True); curionav.run('dense/plaza-hrvo-08')"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "here\n"
            time.sleep(1.0)
            assert process.poll() is None
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=20)
        finally:
            process.kill()
    assert errors.strip().endswith("KeyboardInterrupt")
    assert process.returncode != 0


def test_a_world_is_repeated_by_its_seed() -> None:
    world = curionav.World("quickstart", seed=4)

    def drive(seed: int | None) -> bytes:
        ranges = [world.reset(seed).ranges]
        ranges += [world.step(0.4, 0.2).ranges for _ in range(20)]
        return np.concatenate(ranges).tobytes()

    first = drive(None)
    assert drive(None) == first
    assert drive(5) != first
    assert drive(4) == first


def test_a_world_moves_as_it_is_told_and_tells_the_truth_apart(small: Scenario) -> None:
    world = curionav.World(small, seed=1)
    start = world.reset()
    assert start.tick == 0
    assert start.ranges.shape == (world.order.laser.beams,)
    assert start.ranges.dtype == np.float32
    assert start.people.shape == (1, 4)
    for _ in range(30):
        seen = world.step(0.5, 0.0)
    assert seen.stamp == pytest.approx(3.0)
    assert seen.twist == pytest.approx((0.5, 0.0), abs=0.02)
    # From a stand by a_max to 0.5 m/s, and then on: less than 1.5 m by what the acceleration costs.
    a_max = world.order.robot_model.a_max
    moved = math.dist(seen.true_pose[:2], start.true_pose[:2])
    assert moved == pytest.approx(1.5 - 0.5 * 0.5**2 / a_max, abs=0.05)
    assert math.hypot(*seen.odometry[:2]) == pytest.approx(moved, rel=0.05)
    # It sees the end wall, which is 0.1 m thick, ahead: 11.9 m from the origin.
    x, _, heading = seen.true_pose
    ahead = np.argmin(np.abs(np.linspace(-0.5, 0.5, len(seen.ranges)) * world.order.laser.fov + heading))
    assert seen.ranges[ahead] == pytest.approx(11.9 - x, abs=0.15)
    assert not seen.collides


def test_a_world_says_when_the_robot_hits_a_wall(small: Scenario) -> None:
    world = curionav.World(small, seed=1)
    seen = world.reset()
    while not seen.collides and seen.tick < 200:
        seen = world.step(1.0, 0.0)
    assert seen.collides
    assert min(seen.wall_clearance, seen.person_clearance) < 0.05


def test_a_planner_goes_around_a_person_who_stands_in_its_way(small: Scenario) -> None:
    """The plan of each cycle is followed exactly, on to the goal."""
    grid = curionav.World(small).map

    def nearest(people: People) -> float:
        """Least distance of all decided states to (5, 3), m."""
        planner = curionav.Planner(grid, "curionav", seed=1)
        belief, least = START, math.inf
        for cycle in range(60):
            plan = planner.plan(belief, people, GOAL, stamp=0.3 * cycle)
            decided = plan.decision
            if decided.arrived:
                return least
            if decided.action == "stop":
                continue
            least = min(least, *np.hypot(decided.x - 5.0, decided.y - 3.0))
            done = round(0.3 / decided.dt) - 1
            pose = (float(column[done]) for column in (decided.x, decided.y, decided.heading))
            v, omega = float(decided.v[done]), float(decided.omega[done])
            belief = Belief.at(*pose, v=v, omega=omega, stamp=0.3 * cycle + 0.3)
        raise AssertionError("it does not arrive")

    assert nearest(NOBODY) < 0.3
    assert nearest(IN_THE_WAY) > TOUCH


def test_a_planner_shows_what_each_candidate_costs(small: Scenario) -> None:
    planner = curionav.Planner(curionav.World(small).map, "curionav", seed=1)
    plan = planner.plan(START, IN_THE_WAY, GOAL)
    count = plan.candidates.count
    assert plan.total.shape == (count,)
    assert {cost.shape for cost in plan.costs.values()} == {(count,)}
    assert {"distance", "cnc"} <= set(plan.costs)
    assert plan.decision.reason["code"] == "least_cost"
    assert plan.decision.candidate == plan.candidates.id[np.nanargmin(plan.total)]
    # Candidates that end beside the person cost more comfort than the farthest ones.
    ends = np.hypot(plan.candidates.x - 5.0, plan.candidates.y - 3.0).min(axis=1)
    assert plan.costs["cnc"][ends.argmin()] > plan.costs["cnc"][ends.argmax()]


def test_a_planner_goes_around_an_obstacle_that_is_on_no_map(small: Scenario) -> None:
    planner = curionav.Planner(curionav.World(small).map, "curionav", seed=1)
    wall = np.array([(4.0, y) for y in np.arange(2.0, 4.01, 0.05)])
    plan = planner.plan(START, NOBODY, GOAL, obstacles=wall)
    decided = np.stack([plan.decision.x, plan.decision.y], axis=1)
    assert np.hypot(*(decided[:, None] - wall).T).min() >= 0.3


def test_a_planner_begins_anew_and_refuses_what_cannot_be(small: Scenario) -> None:
    grid = curionav.World(small).map
    planner = curionav.Planner(grid, "curionav", seed=7)
    belief, people, goal = START, IN_THE_WAY, GOAL
    first = planner.plan(belief, people, goal)
    planner.plan(belief, people, goal)
    planner.reset()
    again = planner.plan(belief, people, goal)
    assert np.array_equal(first.total, again.total, equal_nan=True)
    assert np.array_equal(first.decision.x, again.decision.x)
    with pytest.raises(Rejected) as refused:
        planner.plan(belief, people, (-100.0, -100.0))
    assert refused.value.field == "goal"
    with pytest.raises(Rejected) as refused:
        planner.plan(belief, people, goal, obstacles=np.zeros((3, 3)))
    assert refused.value.field == "obstacles"
    with pytest.raises(Rejected) as refused:
        curionav.Planner(grid, "curionav", curionav.RobotModel(
            footprint=Disc(radius=0.3), v_max=1e6, a_max=0.5, omega_max=1.0, alpha_max=1.0
        ))  # fmt: skip
    assert refused.value.field == "robot.v_max"
    with pytest.raises(ScenarioError, match="profile"):
        curionav.Planner(grid, "no-such-profile")


def test_a_localiser_finds_out_where_the_robot_is() -> None:
    world = curionav.World("quickstart", seed=2)
    order = world.order
    start = order.initial_pose
    localizer = curionav.Localizer(
        world.map, (start.x, start.y, start.heading), order.initial_covariance, laser=order.laser,
        odometry_noise=order.odometry_noise,
    )  # fmt: skip
    seen = world.reset()
    errors, spread = [], []
    for _ in range(40):
        odometry, scan, _ = world.sense()
        belief = localizer.update(odometry, scan)
        errors.append(math.dist((belief.x, belief.y), seen.true_pose[:2]))
        spread.append(np.trace(belief.covariance[:2, :2]))
        seen = world.step(0.5, 0.2)
    assert math.dist((start.x, start.y), world.reset().true_pose[:2]) > 0.2, "the seed should begin elsewhere"
    assert max(errors[-10:]) < 0.15
    assert spread[-1] < 0.1 * np.trace(order.initial_covariance[:2, :2])


@pytest.mark.parametrize("populated", [True, False])
def test_a_tracker_sees_who_walks_before_the_laser(small: Scenario, *, populated: bool) -> None:
    scenario = Scenario.from_dict(small.data, small.base)
    if not populated:
        scenario.data["walkers"] = []
    world = curionav.World(scenario, seed=1)
    tracker = curionav.PeopleTracker(world.map, odometry_noise=world.order.odometry_noise)
    seen = world.reset()
    for _ in range(30):
        odometry, scan, _ = world.sense()
        x, y, heading = seen.true_pose
        belief = Belief.at(x, y, heading, stamp=seen.stamp)
        people = tracker.update(odometry, scan, belief)
        seen, last = world.step(0.0, 0.0), seen
    if not populated:
        assert len(people.id) == 0
        return
    assert len(people.id) == 1
    assert people.frame == "robot"
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    place = turn @ (people.x[0], people.y[0]) + (x, y)
    velocity = turn @ (people.vx[0], people.vy[0])
    assert place == pytest.approx(last.people[0, :2], abs=0.2)
    assert velocity == pytest.approx(last.people[0, 2:], abs=0.4)


def test_localiser_tracker_and_planner_drive_a_robot_to_its_goal() -> None:
    world = curionav.World("quickstart", seed=1)
    order = world.order
    pose = order.initial_pose
    localizer = curionav.Localizer(
        world.map, (pose.x, pose.y, pose.heading), order.initial_covariance, laser=order.laser,
        odometry_noise=order.odometry_noise,
    )  # fmt: skip
    tracker = curionav.PeopleTracker(world.map, odometry_noise=order.odometry_noise)
    planner = curionav.Planner(
        world.map, "curionav", order.robot_model, laser=order.laser, odometry_noise=order.odometry_noise
    )
    seen = world.reset()
    goal = (order.goal_x, order.goal_y)
    driven = (0.0, 0.0)
    for tick in range(int(world.time_limit / order.tick_s)):
        odometry, scan, told = world.sense()
        assert told is not None
        belief = localizer.update(odometry, scan)
        people = tracker.update(odometry, scan, belief)
        if tick % 3 == 0:
            plan = planner.plan(belief, people, goal)
            if plan.decision.arrived:
                break
            moving = plan.decision.action != "stop"
            driven = (plan.decision.v[0], plan.decision.omega[0]) if moving else (0.0, 0.0)
        seen = world.step(*driven)
        assert seen.person_clearance > 0.0
    assert math.dist(seen.true_pose[:2], goal) < order.goal_tolerance + 0.2


def test_a_map_is_read_as_map_server_has_it(tmp_path: Path) -> None:
    grid = curionav.load_map(ROOT / "scenarios" / "maps" / "quickstart.yaml")
    assert grid.map == curionav.World("quickstart").map.map
    with pytest.raises(FileError, match="cannot be read"):
        curionav.load_map(tmp_path / "none.yaml")
    (tmp_path / "empty.yaml").write_text("resolution: 0.1\n")
    with pytest.raises(FileError, match="names no image"):
        curionav.load_map(tmp_path / "empty.yaml")


@pytest.mark.live
def test_a_local_deployment_lasts_as_long_as_its_block(small: Scenario) -> None:
    with curionav.local(program()) as deployment:
        assert deployment.inject(small, seed=2).wait().decisions_sha256 == curionav.run(small, seed=2).decisions_sha256
        assert len(deployment.status()) > 5
    with pytest.raises(curionav.ConnectionFailed, match="no program"), curionav.local("/no/such/program"):
        pass
