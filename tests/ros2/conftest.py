"""What the tests with real ROS 2 have in common. `environment.py` sets up the Python that runs them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def _note_skipped(report: pytest.TestReport | pytest.CollectReport) -> None:
    """Adds a line to the list of skipped tests that `tests/run` prints."""
    file = os.environ.get("CURIONAV_SKIPPED")
    if file and report.skipped and isinstance(report.longrepr, tuple) and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2].removeprefix("Skipped: ").replace("\n", " ")
        with Path(file).open("a") as lines:
            lines.write(f"{report.nodeid}: {reason}\n")


def need(*files: Path) -> None:
    """Leaves out the tests of a module where a file is missing; with CURIONAV_REQUIRE_ROS2=1 they fail."""
    for file in files:
        if not file.is_file():
            if os.environ.get("CURIONAV_REQUIRE_ROS2") == "1":
                pytest.fail(f"CURIONAV_REQUIRE_ROS2=1, but there is no {file}")
            pytest.skip(f"no {file}: see CONTRIBUTING.md", allow_module_level=True)


pytest_runtest_logreport = _note_skipped
pytest_collectreport = _note_skipped
