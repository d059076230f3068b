"""The messages of the wire contract, one frozen dataclass each; units are SI and radians, poses in the map frame.

``Message.encode()`` gives the CBOR bytes, ``Message.decode(bytes)`` reads and checks them; arrays are NumPy arrays. The
contract is ``schemas/*.cddl``; these classes have its names.
"""

from __future__ import annotations

from ..record import Message, Record
from .decision import (
    Crowd,
    CycleReport,
    Decision,
    Evaluated,
    Memory,
    Place,
    Previous,
    TermReport,
    TermTime,
    Timings,
    Twist,
)
from .mission import (
    Cancel,
    ChangeGoal,
    Clock,
    Finish,
    Mission,
    MissionCommand,
    MissionOrder,
    Pause,
    Readiness,
    Resume,
    SetMission,
)
from .planning import (
    NO_PARENT,
    CandidateSet,
    CandidateShard,
    EvaluateRequest,
    GenerateReply,
    GenerateRequest,
    Scores,
    Tree,
)
from .robot import Disc, Footprint, LaserModel, OdometryNoise, Polygon, Pose, RobotModel
from .sensing import Belief, Health, Odometry, Particles, People, Scan, Scene
from .service import Reject, ServiceStatus
from .world import (
    Contact,
    Cycles,
    InjectRequest,
    Measures,
    OccupancyGrid,
    PeopleTrace,
    RunResult,
    RunStatus,
    Trace,
)

MESSAGES: dict[str, type[Message]] = {
    message.NAME: message
    for message in (
        Scan,
        Odometry,
        People,
        Belief,
        Particles,
        Mission,
        MissionCommand,
        Readiness,
        Decision,
        Twist,
        Scene,
        CandidateSet,
        Tree,
        CycleReport,
        Memory,
        GenerateRequest,
        GenerateReply,
        EvaluateRequest,
        Scores,
        OccupancyGrid,
        InjectRequest,
        RunStatus,
        RunResult,
        ServiceStatus,
        Reject,
    )
}
"""Every message by its name in the encoding string, which is also its CDDL rule."""

__all__ = [
    "MESSAGES",
    "NO_PARENT",
    "Belief",
    "Cancel",
    "CandidateSet",
    "CandidateShard",
    "ChangeGoal",
    "Clock",
    "Contact",
    "Crowd",
    "CycleReport",
    "Cycles",
    "Decision",
    "Disc",
    "EvaluateRequest",
    "Evaluated",
    "Finish",
    "Footprint",
    "GenerateReply",
    "GenerateRequest",
    "Health",
    "InjectRequest",
    "LaserModel",
    "Measures",
    "Memory",
    "Message",
    "Mission",
    "MissionCommand",
    "MissionOrder",
    "OccupancyGrid",
    "Odometry",
    "OdometryNoise",
    "Particles",
    "Pause",
    "People",
    "PeopleTrace",
    "Place",
    "Polygon",
    "Pose",
    "Previous",
    "Readiness",
    "Record",
    "Reject",
    "Resume",
    "RobotModel",
    "RunResult",
    "RunStatus",
    "Scan",
    "Scene",
    "Scores",
    "ServiceStatus",
    "SetMission",
    "TermReport",
    "TermTime",
    "Timings",
    "Trace",
    "Tree",
    "Twist",
]
