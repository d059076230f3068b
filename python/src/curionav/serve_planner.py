"""A planner of one's own for the robots of a deployment: a service in a process of its own."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

from .closable import Closable
from .errors import ConnectionFailed, PlannerError

_START = 90.0
"""How long a service may take to be ready, seconds: it may load a learned policy first."""
_STOP = 5.0
"""How long it may take to end, seconds."""


class PlannerServer(Closable):
    """A planner that robots may ask; made by `serve_planner`. A context manager that ends it.

    Attributes:
        role: What it serves, and the ``generator`` of the profiles that ask it: ``own-`` and the planner's name.
        instance: Its name among the replicas of the role.
    """

    def __init__(self, process: subprocess.Popen[str], role: str, instance: str) -> None:
        self._process = process
        self.role = role
        self.instance = instance

    def close(self) -> None:
        """Ends the service and its planner. Does nothing the second time."""
        if self._process.poll() is not None:
            return
        if self._process.stdin is not None:
            # It is supervised: the end of its input is its end.
            self._process.stdin.close()
        try:
            self._process.wait(_STOP)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def is_running(self) -> bool:
        """Whether it still serves."""
        return self._process.poll() is None


def serve_planner(
    planner: str | os.PathLike[str],
    connect: str = "tcp/127.0.0.1:7447",
    *,
    instance: str = "a",
    namespace: str | None = None,
    secure: str | os.PathLike[str] | None = None,
    program: str | os.PathLike[str] = "curionav",
) -> PlannerServer:
    """Serves a planner for robots whose profile names it, until it is closed.

    Such a profile is what ``curionav run --planner mine.py:policy --connect ...`` gives a robot.

    Args:
        planner: A name in a Python file, such as ``mine.py:policy``, or a program.
        connect: The deployment's router.
        instance: Its name among the replicas of this planner.
        namespace: Of the deployment.
        secure: A folder of certificates with that of ``own-NAME.INSTANCE``.
        program: The program ``curionav``.

    Raises:
        PlannerError: There is no such planner, or it cannot be used.
        ConnectionFailed: The router cannot be reached.
    """
    command = [_found(program), "planner", os.fspath(planner), "--connect", connect, "--instance", instance]
    command += [] if namespace is None else ["--namespace", namespace]
    command += [] if secure is None else ["--secure", os.fspath(secure)]
    process = subprocess.Popen(
        [*command, "--supervised"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "CURIONAV_PYTHON": os.environ.get("CURIONAV_PYTHON", sys.executable)},
    )
    timer = threading.Timer(_START, process.kill)
    timer.start()
    try:
        line = process.stdout.readline() if process.stdout is not None else ""
    finally:
        timer.cancel()
    if not line:
        said = process.communicate()[1].strip().splitlines()
        why = re.sub(r"^error: ", "", said[-1]) if said else f"it was not ready within {_START:g} s"
        raise (ConnectionFailed if process.returncode == 3 else _planner_error(planner))(why)
    # What it logs from now on must not fill a pipe that is not read.
    threading.Thread(target=_drain, args=(process.stderr,), daemon=True).start()
    role, _, name = json.loads(line)["ready"].partition(" ")
    return PlannerServer(process, role, name)


def _planner_error(planner: str | os.PathLike[str]) -> Any:
    return lambda why: PlannerError(os.fspath(planner), why)


def _drain(stream: Any) -> None:
    for line in stream:
        sys.stderr.write(line)


def _found(program: str | os.PathLike[str]) -> str:
    """The program: that beside this interpreter, as ``pip`` puts it there, before any other."""
    beside = Path(sys.executable).parent / program
    return str(beside) if beside.is_file() else os.fspath(program)
