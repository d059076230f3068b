"""A deployment of real processes, and a small scenario that takes seconds."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from contract import ROOT

from curionav.datasets import locate
from curionav.errors import DatasetError

READY_TIMEOUT = 60.0
STOP_TIMEOUT = 20.0
RUN_TIMEOUT = 120.0
"""For a run in lockstep, on a busy machine."""

_PREAMBLE = """
import sys, time
sys.path.insert(0, sys.argv[3])
import curionav
from live import hall
from pathlib import Path
endpoint, directory = sys.argv[1], Path(sys.argv[2])
scenario = curionav.Scenario.from_dict(hall(directory), directory)
slowly = dict(clock="realtime", time_scale=0.2)
def here(*ignored): print("here", flush=True)
"""


def program() -> Path:
    """The built `curionav`; skips the test if there is none."""
    path = Path(os.environ.get("CURIONAV_BIN", ROOT / "target" / "release" / "curionav"))
    if not path.is_file():
        pytest.skip(f"no program at {path}: build it with `cargo build --release` or set CURIONAV_BIN")
    return path


def dataset_file(file: str) -> Path:
    """The path of ``NAME/FILE`` of a dataset. Without it the test is skipped; with CURIONAV_REQUIRE_DATA=1 it fails."""
    try:
        return locate(f"dataset:{file}")
    except DatasetError as error:
        if os.environ.get("CURIONAV_REQUIRE_DATA") == "1":
            pytest.fail(f"CURIONAV_REQUIRE_DATA=1, but {error}")
        pytest.skip(str(error))


def downloaded_file(file: str) -> Path:
    """As `dataset_file`, for datasets that CURIONAV_REQUIRE_DATA does not ask for."""
    try:
        return locate(f"dataset:{file}")
    except DatasetError as error:
        pytest.skip(str(error))


@dataclass
class Up:
    """A deployment that is up."""

    endpoint: str
    process: subprocess.Popen[str]
    pids: dict[str, int]

    def stop(self) -> int:
        """Ends it as Ctrl-C does; gives its exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(STOP_TIMEOUT)


@contextmanager
def deployment(directory: Path, *arguments: str, **fields: str) -> Iterator[Up]:
    """Starts `curionav up` on a free port, with more arguments, and ends it."""
    file = directory / "deployment.toml"
    file.write_text("port = 0\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in fields.items()))
    process = subprocess.Popen(
        [program(), "up", file, "--port", "0", *arguments],
        stdout=subprocess.PIPE,
        stderr=None,
        text=True,
        cwd=directory,
    )
    assert process.stdout is not None
    watchdog = threading.Timer(READY_TIMEOUT, process.kill)
    watchdog.start()
    try:
        line = process.stdout.readline()
        watchdog.cancel()
        assert line, "the deployment ended, or was not up in time"
        ready: dict[str, Any] = json.loads(line)
        assert ready["ready"] == "deployment"
        pids = {entry["name"]: entry["pid"] for entry in ready["processes"]}
        yield Up(ready["endpoints"][0], process, pids)
    finally:
        watchdog.cancel()
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(STOP_TIMEOUT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        process.stdout.close()


def interrupted(code: str, up: Up, directory: Path) -> None:
    """Runs a program and presses Ctrl-C once it calls ``here()``: it ends soon, by a ``KeyboardInterrupt``.

    Further names it finds: ``curionav``, the deployment's ``endpoint``, the ``scenario`` of `hall`, and ``slowly``, how
    to inject it so that it does not end by itself.
    """
    arguments = [sys.executable, "-c", _PREAMBLE + code, up.endpoint, str(directory), str(Path(__file__).parent)]
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "here\n", "it did not get there"
            started = time.monotonic()
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=20)
        finally:
            process.kill()
    assert time.monotonic() - started < 10.0
    assert "KeyboardInterrupt" in errors
    assert process.returncode != 0


def hall(directory: Path) -> dict[str, Any]:
    """A scenario in an empty hall of 12 m x 6 m with one walker; its map lies in ``directory / "maps"``.

    Whole numbers on purpose where floats are meant.
    """
    maps = directory / "maps"
    maps.mkdir(exist_ok=True)
    width, height = 120, 60
    rows = [
        bytes(0 if x in (0, width - 1) or y in (0, height - 1) else 254 for x in range(width)) for y in range(height)
    ]
    (maps / "hall.pgm").write_bytes(f"P5\n{width} {height}\n255\n".encode() + b"".join(rows))
    (maps / "hall.yaml").write_text(
        "image: hall.pgm  # beside this file\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return {
        "name": "hall",
        "map": {"file": "maps/hall.yaml"},
        "robot": {"start": [2, 3, 0], "goal": [6, 3]},
        "clock": {"time_limit_s": 30},
        # Far enough to see the end wall: without it nothing tells how far along the hall the robot is.
        "laser": {"range_max": 12},
        "walkers": [{"route": [[8, 1], [8, 5]], "speed": 1}],
    }
