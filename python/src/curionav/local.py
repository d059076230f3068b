"""A deployment on this machine that lasts as long as a block."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sysconfig
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .deployment import Deployment, connect
from .errors import ConnectionFailed

_END = 20.0
"""Services that are asked to end have done so within it, seconds."""


@contextmanager
def local(program: str | os.PathLike[str] | None = None, *, timeout: float = 60.0) -> Iterator[Deployment]:
    """Starts `curionav up` on a free port, connects to it, and ends it with the block.

    >>> with curionav.local() as deployment:                                # doctest: +SKIP
    ...     print(deployment.inject("scenarios/quickstart.toml").wait().measures)

    Args:
        program: The program; by default what the environment's ``CURIONAV_BIN`` names, or else ``curionav`` beside
            this Python, or else on the path.
        timeout: How long the services may take to start, s.

    Raises:
        ConnectionFailed: There is no program, or it does not start in time; what it says is on standard error.
    """
    with tempfile.TemporaryDirectory(prefix="curionav-") as folder, _up(_found(program), folder, timeout) as endpoint:
        deployment = connect(endpoint)
        try:
            yield deployment
        finally:
            deployment.close()


def _found(program: str | os.PathLike[str] | None) -> Path:
    beside = Path(sysconfig.get_path("scripts"), "curionav")
    named = program or os.environ.get("CURIONAV_BIN") or (beside if beside.is_file() else shutil.which("curionav"))
    if named is None or not Path(named).is_file():
        raise ConnectionFailed(
            f"there is no program {named or '`curionav`'}; install a wheel that has it, or in a checkout build it with "
            "`cargo build --release` and set CURIONAV_BIN to target/release/curionav"
        )
    return Path(named).resolve()


@contextmanager
def _up(program: Path, folder: str, timeout: float) -> Iterator[str]:
    """The endpoint of a deployment of its own."""
    process = subprocess.Popen([program, "up", "--port", "0"], stdout=subprocess.PIPE, text=True, cwd=folder)
    assert process.stdout is not None
    watchdog = threading.Timer(timeout, process.kill)
    watchdog.start()
    try:
        line = process.stdout.readline()
        watchdog.cancel()
        if not line:
            raise ConnectionFailed(f"{program} up ended, or was not up within {timeout:g} s")
        yield json.loads(line)["endpoints"][0]
    finally:
        watchdog.cancel()
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(_END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        process.stdout.close()
