"""What a robot is to do (``schemas/mission.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from ..array import Variances
from ..field_types import Coded, Integer, MapId, Name, Number, Params, Positive, Text, Uint
from ..record import Message, Part, Record
from .robot import LaserModel, OdometryNoise, Pose, RobotModel
from .sensing import check_variances
from .service import MissionState, Reject

Clock = Literal["lockstep", "realtime"]
"""How time passes: every stream is awaited, or the newest wins."""

_NAME = Text(identifier=True)

MissionEnd = Annotated[
    dict[str, Any],
    Coded(
        {
            "reached": {},
            "timeout": {},
            "lost": {},
            "cancelled": {},
            "unprepared": {"role": _NAME, "instance": _NAME, "reject": Part(Reject)},
            "world_failed": {"reject": Part(Reject)},
        }
    ),
]
"""Why a mission ended: a ``code`` and its parameters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MissionOrder(Record):
    """What is to be done, and everything that the services of the robot share for it.

    The goal is in m, map frame, its heading (rad) ``None`` if any will do. ``initial_covariance`` has shape [3, 3], of
    (x, y, heading). ``tick_s`` is in s; ``plan_every`` counts ticks; ``time_scale`` is simulated seconds per second of
    wall time. ``require`` names the roles that must be ready before it runs.
    """

    robot: Name
    map: MapId
    initial_pose: Pose
    initial_covariance: Variances
    goal_x: Number
    goal_y: Number
    goal_heading: Number | None = None
    goal_tolerance: Positive
    profile: Params
    localizer: Params
    tracker: Params | None = None
    laser: LaserModel
    robot_model: RobotModel
    odometry_noise: OdometryNoise
    seed: Uint
    clock: Clock
    time_scale: Positive
    tick_s: Positive
    plan_every: Annotated[int, Integer(1, 2**32 - 1)]
    require: list[Name]

    def check(self) -> None:
        """No variance is negative."""
        check_variances("initial_covariance", self.initial_covariance)


@dataclass(frozen=True, eq=False, kw_only=True)
class Mission(Message):
    """What a robot is to do, as its driver says.

    ``run`` counts the missions begun on this robot; ``revision`` grows with every change of what is to be done.
    ``ready`` names the roles that are ready for this revision, ``has_run`` says whether the robot may have left its
    start, ``end`` why the mission is cancelled or finished.
    """

    NAME: ClassVar[str] = "mission"
    MAX_BYTES: ClassVar[int] = 256 << 10

    run: Uint
    revision: Uint
    order: MissionOrder
    ready: list[Name]
    state: MissionState
    has_run: bool
    end: MissionEnd | None = None


class MissionCommand(Message):
    """A wish about a robot's mission; the reply is the `Mission` as it is then."""

    NAME: ClassVar[str] = "mission_command"
    MAX_BYTES: ClassVar[int] = 257 << 10
    TAGGED: ClassVar[bool] = True


@dataclass(frozen=True, eq=False, kw_only=True)
class SetMission(MissionCommand):
    """Begin a mission with this order."""

    kind: Literal["set"] = "set"
    order: MissionOrder


@dataclass(frozen=True, eq=False, kw_only=True)
class ChangeGoal(MissionCommand):
    """Go elsewhere on the same map: m and rad, map frame; ``heading`` is ``None`` if any will do."""

    kind: Literal["goal"] = "goal"
    x: Number
    y: Number
    heading: Number | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Pause(MissionCommand):
    """Halt."""

    kind: Literal["pause"] = "pause"


@dataclass(frozen=True, eq=False, kw_only=True)
class Resume(MissionCommand):
    """Go on."""

    kind: Literal["resume"] = "resume"


@dataclass(frozen=True, eq=False, kw_only=True)
class Cancel(MissionCommand):
    """Give up."""

    kind: Literal["cancel"] = "cancel"


@dataclass(frozen=True, eq=False, kw_only=True)
class Finish(MissionCommand):
    """A revision is over, and why."""

    kind: Literal["finish"] = "finish"
    revision: Uint
    end: MissionEnd


@dataclass(frozen=True, eq=False, kw_only=True)
class Readiness(Message):
    """A service is prepared for a revision of a robot's mission, or says why it never can be (``refused``)."""

    NAME: ClassVar[str] = "readiness"
    MAX_BYTES: ClassVar[int] = 8 << 10

    role: Name
    instance: Name
    revision: Uint
    refused: Reject | None = None
