"""`curionav demo`: with the viewer, and without one."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from live import program

pytestmark = pytest.mark.live

TIMEOUT = 180.0
"""For a run in half a minute of real time, on a busy machine, s."""


@contextmanager
def demo(folder: Path, *arguments: str, viewer: bool) -> Iterator[subprocess.Popen[str]]:
    """The program beside a viewer, or where there is none."""
    here = folder / "bin"
    here.mkdir()
    shutil.copy(program(), here / "curionav")
    if viewer:
        (here / "curionav-view").write_text(f'#!/bin/sh\nexec {sys.executable} -m curionav_view "$@"\n')
        (here / "curionav-view").chmod(0o755)
    environment = {**os.environ, "PATH": f"{here}:/usr/bin:/bin", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    with subprocess.Popen(
        [here / "curionav", "demo", *arguments], cwd=folder, env=environment, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    ) as process:  # fmt: skip
        try:
            yield process
        finally:
            process.kill()


def test_without_a_viewer_it_says_what_to_install_and_draws_the_run(tmp_path: Path) -> None:
    with demo(tmp_path, "--speed", "20", viewer=False) as process:
        printed, complaints = process.communicate(timeout=TIMEOUT)
    assert process.returncode in (0, 1), complaints  # a slow machine may not keep the speed
    assert "its extra `viewer`" in complaints
    assert "<svg" in (tmp_path / "curionav-demo" / "run.svg").read_text()
    assert "quickstart" in printed


def test_a_viewer_that_lacks_rerun_says_so_and_the_run_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['rerun'] = None\n")
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("PYTHONPATH", str(tmp_path))
        with demo(tmp_path, "--speed", "20", viewer=True) as process:
            _, complaints = process.communicate(timeout=TIMEOUT)
    assert "not installed: rerun-sdk; `pip install rerun-sdk`" in complaints
    assert (tmp_path / "curionav-demo" / "run.svg").is_file()


def test_the_viewer_listens_before_the_robot_starts_and_ends_with_the_run(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="no rerun-sdk; pip install './python[viewer-test]'")
    with demo(tmp_path, "--speed", "5", "--no-browser", "--once", viewer=True) as process:
        printed, complaints = process.communicate(timeout=TIMEOUT)
    assert process.returncode in (0, 1), complaints
    assert re.search(r"open http://127\.0\.0\.1:\d+/", complaints), complaints
    # It says this of a run that it has followed to its end.
    assert "the mission is" in complaints
    assert "Fatal Python error" not in complaints
    assert "quickstart" in printed
    assert not (tmp_path / "curionav-demo").exists()


def test_it_ends_when_asked_to_with_its_viewer(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="no rerun-sdk; pip install './python[viewer-test]'")
    with demo(tmp_path, "--speed", "20", "--no-browser", viewer=True) as process:
        assert process.stderr is not None
        while "press Ctrl-C" not in (line := process.stderr.readline()):
            assert line, "it has ended"
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(3.0)  # the viewer stays
        process.send_signal(signal.SIGTERM)
        # Its errors are read to their end: the viewer has the same pipe, and has ended, too.
        process.communicate(timeout=TIMEOUT)
