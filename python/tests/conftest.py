"""What all tests have in common."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from live import Up, deployment, hall

import curionav
from curionav import Scenario

# A shell without job control has what it starts in the background ignore Ctrl-C, and so do its children: tests that
# interrupt programs would wait for nothing.
signal.signal(signal.SIGINT, signal.default_int_handler)


def _note_skipped(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Adds a line to the list of skipped tests that `tests/run` prints."""
    file = os.environ.get("CURIONAV_SKIPPED")
    if file and report.skipped and isinstance(report.longrepr, tuple) and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2].removeprefix("Skipped: ").replace("\n", " ")
        with Path(file).open("a") as lines:
            lines.write(f"{report.nodeid}: {reason}\n")


pytest_runtest_logreport = _note_skipped
pytest_collectreport = _note_skipped


@pytest.fixture(scope="module")
def directory(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the tests of a module keep the files of their deployment."""
    return tmp_path_factory.mktemp(request.module.__name__)


@pytest.fixture(scope="module")
def up(directory: Path) -> Iterator[Up]:
    """A deployment that the tests of a module share."""
    with deployment(directory) as running:
        yield running


@pytest.fixture
def connected(up: Up) -> Iterator[curionav.Deployment]:
    with curionav.connect(up.endpoint) as connection:
        yield connection


@pytest.fixture
def scenario(directory: Path) -> Scenario:
    return Scenario.from_dict(hall(directory), directory)
