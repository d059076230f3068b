"""What a run looks like: each message becomes shapes, numbers and words in a Rerun recording.

Everything stands on two timelines, the robot's clock (``robot_time``) and the planning cycle (``cycle``); what no cycle
knows yet belongs to the newest one.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr

from curionav.messages import (
    Belief,
    CycleReport,
    Decision,
    Message,
    Mission,
    OccupancyGrid,
    Odometry,
    Particles,
    People,
    RunResult,
    RunStatus,
    Scan,
    Twist,
)
from curionav.words import say

from . import colours, heat, layout, result_replay, shapes, words

TRAIL = 400
"""Points of the trail of where the robot believed it was: beyond it every second one goes."""
TRAIL_EVERY = 3
"""Beliefs from point to point at first; the ellipse and the robot follow each."""
LIMITS_EVERY = 1.0
"""Lines that do not move are drawn on so often, s."""
BEYOND = "information-to-go"
"""The term whose raw cost candidates are coloured by, if that is switched on: metres by which the way beyond counts
longer."""
_RECENT = 32
"""Beliefs remembered, so that what comes a little late finds that of its tick."""
_AFTER = 0.05
"""s."""
_MS = 1e-3
_TERMS = [(94, 200, 255, 255), (255, 160, 90, 255), (126, 158, 255, 255), (120, 230, 140, 255), (230, 120, 210, 255)]


class SceneLogger:
    """Draws one run into one recording.

    Attributes:
        grid: The map, once it is known.
        mission: What the robot is to do, once that is known.
    """

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._to = recording
        self._newest = 0.0
        self._cycle = 0
        self._cycles: list[tuple[float, int]] = []
        self._belief: Belief | None = None
        self._recent: dict[int, Belief] = {}
        self._decision: Decision | None = None
        self._driven: str | None = None
        self._nearest: float | None = None
        self._trail: list[tuple[float, float]] = []
        self._every = TRAIL_EVERY
        self._skipped = TRAIL_EVERY
        self._limits_at = -LIMITS_EVERY
        self._named: set[str] = set()
        self._told = False
        self.grid: OccupancyGrid | None = None
        self.mission: Mission | None = None
        self._draw: dict[type[Message], Callable[[Any], None]] = {
            OccupancyGrid: self._draw_map,
            Mission: self._draw_mission,
            Scan: self._draw_scan,
            Odometry: self._draw_odometry,
            People: self._draw_people,
            Belief: self._draw_belief,
            Particles: self._draw_particles,
            Decision: self._draw_decision,
            Twist: self._draw_command,
            CycleReport: self._draw_report,
            RunStatus: self._draw_status,
        }
        # Only the clocks that mean something: the robot's and the planner's.
        recording.set_log_time_enabled(False)
        recording.set_log_tick_enabled(False)
        recording.send_blueprint(layout.default())
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._style()

    def draw(self, message: Message) -> None:
        """Draws a message of the run; passes over what has no picture."""
        draw = self._draw.get(type(message))
        if draw is not None:
            draw(message)

    def recall(self, status: RunStatus) -> None:
        """Draws a run that was over before the viewer started, from its result."""
        if status.result is not None and not self._told:
            for message in result_replay.messages(status.result):
                self.draw(message)
        self.draw(status)

    def note(self, text: str, always: bool) -> None:
        """Says something in place of a decision: from now on, or ``always``, whatever time is looked at."""
        if not always:
            # After the last decision, whose report may be on its way still.
            self._at(self._newest + _AFTER)
        self._to.log("/decision", rr.TextDocument(text, media_type="text/markdown"), static=always)

    # ---- what the run is about ----

    def _draw_map(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._to.log("/map/floor", shapes.floor(grid), static=True)
        self._to.send_blueprint(layout.default(grid))
        self._draw_information()

    def _draw_mission(self, mission: Mission) -> None:
        first = self.mission is None
        if not first and self.mission is not None and self.mission.state != mission.state:
            self._at(self._newest)
            self._to.log("/events", rr.TextLog(f"mission {words.standing(mission)}", level="INFO"))
        self.mission, order = mission, mission.order
        self._at(self._newest)
        self._to.log("/plan/goal", shapes.goal(order.goal_x, order.goal_y, order.goal_tolerance))
        if first:
            self._to.log("/robot/body", shapes.body(order.robot_model), static=True)
            self._to.log("/robot/comfort", shapes.comfort(self._comfort()), static=True)
            self._draw_information()

    def _draw_information(self) -> None:
        """Needs the map and the laser, whichever comes last."""
        if self.grid is None or self.mission is None:
            return
        params = self.mission.order.profile.get("information")
        field = heat.information(self.grid, self.mission.order.laser, params if isinstance(params, dict) else {})
        self._to.log("/map/information", shapes.information(self.grid, field), static=True)

    def _comfort(self) -> float:
        return words.number(self.mission, "hccdm", "personal_distance") or shapes.NEAR

    # ---- tick by tick ----

    def _draw_scan(self, scan: Scan) -> None:
        self._at(scan.stamp)
        self._to.log("/robot/scan", shapes.scan(scan))

    def _draw_odometry(self, odometry: Odometry) -> None:
        self._at(odometry.stamp)
        self._to.log("/plots/speed/driven", rr.Scalars(odometry.v))

    def _draw_command(self, twist: Twist) -> None:
        self._at(twist.stamp)
        self._to.log("/plots/speed/commanded", rr.Scalars(twist.v))
        if self._driven is None or self._driven != twist.reason:
            self._driven = twist.reason
            level = "INFO" if twist.reason in words.NORMAL else "WARN"
            self._to.log("/events", rr.TextLog(f"driver: {say('command_reason', twist.reason)}", level=level))

    def _draw_belief(self, belief: Belief) -> None:
        self._belief = belief
        self._recent[belief.tick] = belief
        if len(self._recent) > _RECENT:
            del self._recent[next(iter(self._recent))]
        self._at(belief.stamp)
        turn = rr.RotationAxisAngle([0.0, 0.0, 1.0], belief.heading)
        self._to.log("/robot", rr.Transform3D(translation=[belief.x, belief.y, 0.0], rotation_axis_angle=turn))
        self._to.log("/eye", rr.Transform3D(translation=[belief.x, belief.y, 0.0]))
        self._to.log("/belief/ellipse", shapes.ellipse(belief))
        self._skipped += 1
        if self._skipped >= self._every:
            self._skipped = 0
            self._trail.append((belief.x, belief.y))
            if len(self._trail) > TRAIL:
                self._trail = self._trail[::2]
                self._every *= 2
            self._to.log("/belief/trail", shapes.trail(np.array(self._trail), colours.BELIEF))

    def _draw_particles(self, particles: Particles) -> None:
        """In the robot's frame: until the next ones come the cloud goes along with the belief."""
        belief = self._recent.get(particles.tick, self._belief)
        if belief is not None:
            self._at(particles.stamp)
            self._to.log("/robot/particles", shapes.particles(particles, belief))

    def _draw_people(self, people: People) -> None:
        belief = self._belief
        if belief is None:
            return
        self._at(people.stamp)
        x, y, vx, vy = shapes.in_map(people, belief)
        distance = np.hypot(x - belief.x, y - belief.y)
        self._nearest = float(distance.min()) if len(distance) else None
        comfort = self._comfort()
        self._to.log("/people/bodies", shapes.bodies(x, y, people.radius, distance < comfort))
        self._to.log("/people/velocities", shapes.velocities(x, y, vx, vy))
        if people.position_covariance is not None:
            self._to.log("/people/ellipses", shapes.people_ellipses(people, belief))
        if self._nearest is not None:
            self._to.log("/plots/person/nearest", rr.Scalars(self._nearest))
        self._limits(people.stamp, comfort)

    def _limits(self, stamp: float, comfort: float) -> None:
        if stamp < self._limits_at + LIMITS_EVERY:
            return
        self._limits_at = stamp
        self._to.log("/plots/person/comfortable", rr.Scalars(comfort))
        threshold = words.threshold(self.mission)
        if threshold is not None:
            self._to.log("/plots/uncertainty/threshold", rr.Scalars(threshold))

    # ---- cycle by cycle ----

    def _draw_decision(self, decision: Decision) -> None:
        self._cycle = max(self._cycle, decision.seq)
        self._at(decision.stamp, decision.seq)
        self._to.log("/plan/chosen", shapes.decided(decision, self._belief))
        self._to.log("/plots/uncertainty/l", rr.Scalars(decision.uncertainty))
        self._lanes(decision)
        event = words.event(self._decision, decision)
        if event is not None:
            self._to.log("/events", rr.TextLog(event[0], level=event[1]))
        self._decision = decision

    def _lanes(self, decision: Decision) -> None:
        """Changes only: a lane goes on until the next."""
        previous = self._decision
        degraded = "degraded" if decision.degraded else "healthy"
        if previous is None or previous.action != decision.action:
            self._to.log("/modes/driving", rr.StateChange(state=decision.action))
        if previous is None or previous.uncertain != decision.uncertain:
            self._to.log("/modes/localisation", rr.StateChange(state="curious" if decision.uncertain else "sure"))
        if previous is None or bool(previous.degraded) != bool(decision.degraded):
            self._to.log("/modes/services", rr.StateChange(state=degraded))

    def _draw_report(self, report: CycleReport) -> None:
        self._cycle = max(self._cycle, report.seq)
        stamp = report.scene.stamp
        self._at(stamp, report.seq)
        self._cycles.append((stamp, report.seq))
        belief = report.scene.belief
        self._to.log("/plan/candidates", shapes.candidates(report))
        self._to.log("/plan/rejected", shapes.rejected(report))
        self._to.log("/plan/beyond", shapes.by_term(report, BEYOND))
        self._to.log("/people/unseen", shapes.unseen(report))
        self._to.log("/people/crowds", shapes.crowds(report))
        self._to.log("/map/obstacles", shapes.obstacles(report))
        self._to.log("/map/density", shapes.density(heat.density(report.crowds, belief.x, belief.y)))
        text = words.decision(report, self.mission, self._nearest)
        self._to.log("/decision", rr.TextDocument(text, media_type="text/markdown"))
        timings = report.timings
        self._time("total", timings.total_us, colours.ROBOT)
        self._time("generate", timings.generate_us, (150, 156, 170, 255))
        for index, time in enumerate(timings.evaluate_us):
            self._time(time.term, time.us, _TERMS[index % len(_TERMS)])

    def _time(self, name: str, microseconds: int, colour: tuple[int, int, int, int]) -> None:
        path = f"/plots/cycle/{name}"
        if name not in self._named:
            self._named.add(name)
            self._to.log(path, layout.series(name, colour, 1.5), static=True)
        self._to.log(path, rr.Scalars(microseconds * _MS))

    # ---- at the end ----

    def _draw_status(self, status: RunStatus) -> None:
        if status.error and not self._told:
            self._told = True
            self._at(self._newest)
            self._to.log("/events", rr.TextLog(f"run {status.state}: {say('end', status.error)}", level="ERROR"))
        if status.result is not None and not self._told:
            self._told = True
            self._at(self._newest)
            done = f"{status.result.outcome} after {status.result.measures.time_s:.1f} s"
            self._to.log("/events", rr.TextLog(f"run finished: {done}", level="INFO"))
            self._draw_truth(status.result)

    def _draw_truth(self, result: RunResult) -> None:
        """Where the robot really was, which a simulator tells when all is over, laid over the whole run."""
        column = {name: result.trace.values[:, i] for i, name in enumerate(result.trace.columns)}
        if result.trace.rows == 0 or not {"time_s", "true_x", "true_y", "belief_x", "belief_y"} <= column.keys():
            return
        times, x, y = column["time_s"], column["true_x"], column["true_y"]
        stamps, cycles = [stamp for stamp, _ in self._cycles], [cycle for _, cycle in self._cycles]
        at = [cycles[max(bisect_right(stamps, t) - 1, 0)] if cycles else 0 for t in times]
        indexes = [rr.TimeColumn(layout.TIMELINE, duration=times), rr.TimeColumn(layout.CYCLES, sequence=at)]
        ghost = shapes.ghosts(x, y, self.mission.order.robot_model if self.mission else None)
        self._to.send_columns("/truth/robot", indexes=indexes, columns=ghost)
        self._to.log("/truth/way", rr.LineStrips3D.from_fields(colors=[colours.TRUTH], radii=[0.02]), static=True)
        ways = shapes.ways(np.stack([x, y], axis=1))
        self._to.send_columns("/truth/way", indexes=indexes, columns=rr.LineStrips3D.columns(strips=ways))
        error = np.hypot(column["belief_x"] - x, column["belief_y"] - y)
        self._to.send_columns("/plots/uncertainty/error", indexes=indexes, columns=rr.Scalars.columns(scalars=error))

    # ---- time and style ----

    def _at(self, stamp: float, cycle: int | None = None) -> None:
        self._newest = max(self._newest, stamp)
        self._to.set_time(layout.TIMELINE, duration=stamp)
        self._to.set_time(layout.CYCLES, sequence=self._cycle if cycle is None else cycle)

    def _style(self) -> None:
        """What never changes: names and colours of lines and lanes, and which way the robot looks."""
        colour = colours.SERIES
        for path, name, shade in (
            ("uncertainty/l", "l", colour["uncertainty"]),
            ("uncertainty/threshold", "Thr'", colour["limit"]),
            ("uncertainty/error", "true error (m)", colour["error"]),
            ("person/nearest", "nearest person", colour["distance"]),
            ("person/comfortable", "comfortable", colour["limit"]),
            ("speed/driven", "driven", colour["speed"]),
            ("speed/commanded", "commanded", colour["command"]),
        ):
            self._to.log(f"/plots/{path}", layout.series(name, shade), static=True)
        self._lane("driving", {name: (name, shade) for name, shade in colours.ACTIONS.items()})
        self._lane("localisation", {"sure": ("sure", colour["uncertainty"]), "curious": ("curious", colours.COMFORT)})
        self._lane("services", {"healthy": ("healthy", colours.GOAL), "degraded": ("degraded", colours.PERSON_NEAR)})
        nose = rr.Arrows3D(vectors=[[0.9, 0.0, 0.0]], origins=[[0.0, 0.0, 0.55]], colors=[colours.ROBOT], radii=[0.05])
        self._to.log("/robot/nose", nose, static=True)
        marker = rr.Points3D([[0.0, 0.0, 1.0]], colors=[colours.ROBOT], radii=rr.Radius.ui_points([6.0]))
        self._to.log("/robot/marker", marker, static=True)

    def _lane(self, name: str, states: dict[str, tuple[str, tuple[int, int, int, int]]]) -> None:
        shown = rr.StateConfiguration(
            values=list(states), labels=[label for label, _ in states.values()], colors=[c for _, c in states.values()]
        )
        self._to.log(f"/modes/{name}", shown, static=True)
