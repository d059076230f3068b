"""What a robot is to do (``schemas/mission.cddl``)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from ..array import Variances
from ..kinds import Integer, MapId, Name, Number, Params, Positive, Uint
from ..record import Message
from .robot import LaserModel, OdometryNoise, Pose, RobotModel
from .sensing import check_variances

Clock = Literal["lockstep", "realtime"]
"""How time passes: every stream is awaited, or the newest wins."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Mission(Message):
    """Everything the services of a robot share; ``revision`` grows with every change.

    The goal is in m, map frame, its heading (rad) ``None`` if any will do. ``initial_covariance`` has shape [3, 3], of
    (x, y, heading). ``tick_s`` is in s; ``plan_every`` counts ticks; ``time_scale`` is simulated seconds a second of
    wall time. ``require`` names the roles that must be in ``ready`` before it runs.
    """

    NAME: ClassVar[str] = "mission"
    MAX_BYTES: ClassVar[int] = 256 << 10

    run: Uint
    revision: Uint
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
    laser: LaserModel
    robot_model: RobotModel
    odometry_noise: OdometryNoise
    seed: Uint
    clock: Clock
    time_scale: Positive
    tick_s: Positive
    plan_every: Annotated[int, Integer(1, 2**32 - 1)]
    require: list[Name]
    ready: list[Name]
    state: Literal["preparing", "running", "paused", "cancelled", "finished"]
    has_run: bool
    note: str

    def check(self) -> None:
        """No variance is negative."""
        check_variances("initial_covariance", self.initial_covariance)


class MissionRequest(Message):
    """A wish about a robot's mission; the reply is the `Mission` as it is then."""

    NAME: ClassVar[str] = "mission_request"
    MAX_BYTES: ClassVar[int] = 257 << 10
    TAGGED: ClassVar[bool] = True


@dataclass(frozen=True, eq=False, kw_only=True)
class SetMission(MissionRequest):
    """Begin this mission; its revision is ignored: the keeper counts."""

    kind: Literal["set"] = "set"
    mission: Mission


@dataclass(frozen=True, eq=False, kw_only=True)
class RoleReady(MissionRequest):
    """A service is prepared for a revision."""

    kind: Literal["ready"] = "ready"
    role: Name
    instance: Name
    revision: Uint


@dataclass(frozen=True, eq=False, kw_only=True)
class ChangeGoal(MissionRequest):
    """Go elsewhere on the same map: m and rad, map frame; ``heading`` is ``None`` if any will do."""

    kind: Literal["goal"] = "goal"
    x: Number
    y: Number
    heading: Number | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Pause(MissionRequest):
    """Halt."""

    kind: Literal["pause"] = "pause"


@dataclass(frozen=True, eq=False, kw_only=True)
class Resume(MissionRequest):
    """Go on."""

    kind: Literal["resume"] = "resume"


@dataclass(frozen=True, eq=False, kw_only=True)
class Cancel(MissionRequest):
    """Give up."""

    kind: Literal["cancel"] = "cancel"


@dataclass(frozen=True, eq=False, kw_only=True)
class Finish(MissionRequest):
    """A revision is over, for a reason."""

    kind: Literal["finish"] = "finish"
    revision: Uint
    reason: str
