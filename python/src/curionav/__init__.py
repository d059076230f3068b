"""Drive a running curionav deployment from Python.

>>> import curionav
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
    Rejected,
    RunFailed,
    ScenarioError,
)
from .evaluation import Evaluator, evaluator
from .messages import (
    CandidateSet,
    Clock,
    CycleReport,
    Decision,
    EvaluateRequest,
    Mission,
    OccupancyGrid,
    People,
    RunStatus,
    Scene,
)
from .result import Result
from .run import Run
from .scenario import Scenario
from .serving import EvaluatorServer
from .words import say, say_all

__all__ = [
    "BaseLease",
    "CandidateSet",
    "Clock",
    "ConnectionFailed",
    "Crowd",
    "CrowdStep",
    "CurionavError",
    "CycleReport",
    "Decision",
    "DecodeError",
    "Deployment",
    "EncodeError",
    "EvaluateRequest",
    "Evaluator",
    "EvaluatorError",
    "EvaluatorServer",
    "FileError",
    "IncompleteResult",
    "MessageError",
    "MissingExtra",
    "Mission",
    "NoAnswer",
    "OccupancyGrid",
    "People",
    "Rejected",
    "Result",
    "Run",
    "RunFailed",
    "RunStatus",
    "Scenario",
    "ScenarioError",
    "Scene",
    "Service",
    "connect",
    "evaluator",
    "say",
    "say_all",
]
