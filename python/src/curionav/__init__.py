"""Run curionav in process, or drive a running deployment.

>>> import curionav
>>> print(curionav.run("quickstart").measures)                              # doctest: +SKIP
>>> with curionav.connect("tcp/127.0.0.1:7447") as deployment:            # doctest: +SKIP
...     with deployment.inject("scenarios/quickstart.toml", seed=1) as run:
...         for report in run:
...             print(report.scene.stamp, report.decision.action, report.total.min())
...         print(run.wait().measures)

Units are SI and radians, poses are in the map frame. The messages are in `curionav.messages`.
"""

from __future__ import annotations

from .base import BaseLease
from .crowd import Crowd, CrowdStep
from .deployment import Deployment, Service, connect
from .errors import (
    ConnectionFailed,
    CurionavError,
    DecodeError,
    EncodeError,
    EvaluatorError,
    FileError,
    IncompleteResult,
    MessageError,
    MissingExtra,
    NoAnswer,
    PlannerError,
    Rejected,
    RunFailed,
    ScenarioError,
)
from .evaluation import Evaluator, evaluator
from .in_process import Localizer, PeopleTracker, Plan, Planner, World, load_map, run
from .injected_run import Run
from .local import local
from .messages import (
    Belief,
    CandidateSet,
    Clock,
    CycleReport,
    Decision,
    EvaluateRequest,
    LaserModel,
    Mission,
    OccupancyGrid,
    Odometry,
    OdometryNoise,
    People,
    RobotModel,
    RunStatus,
    Scan,
    Scene,
)
from .planner import Candidates, Drive, OwnPlanner, Situation, Task, planner
from .result import Result
from .scenario import Scenario
from .serve_planner import PlannerServer, serve_planner
from .serving import EvaluatorServer
from .words import say, say_all

__all__ = [
    "BaseLease",
    "Belief",
    "CandidateSet",
    "Candidates",
    "Clock",
    "ConnectionFailed",
    "Crowd",
    "CrowdStep",
    "CurionavError",
    "CycleReport",
    "Decision",
    "DecodeError",
    "Deployment",
    "Drive",
    "EncodeError",
    "EvaluateRequest",
    "Evaluator",
    "EvaluatorError",
    "EvaluatorServer",
    "FileError",
    "IncompleteResult",
    "LaserModel",
    "Localizer",
    "MessageError",
    "MissingExtra",
    "Mission",
    "NoAnswer",
    "OccupancyGrid",
    "Odometry",
    "OdometryNoise",
    "OwnPlanner",
    "People",
    "PeopleTracker",
    "Plan",
    "Planner",
    "PlannerError",
    "PlannerServer",
    "Rejected",
    "Result",
    "RobotModel",
    "Run",
    "RunFailed",
    "RunStatus",
    "Scan",
    "Scenario",
    "ScenarioError",
    "Scene",
    "Service",
    "Situation",
    "Task",
    "World",
    "connect",
    "evaluator",
    "load_map",
    "local",
    "planner",
    "run",
    "say",
    "say_all",
    "serve_planner",
]
