"""The package as its users' tools see it: typed, linted, and with examples in its documentation that are true."""

from __future__ import annotations

import doctest
import importlib
import pkgutil
import re
import subprocess
import sys
import tokenize
from pathlib import Path

import pytest

import curionav

PYTHON = Path(__file__).resolve().parents[1]
EXAMPLE_LINES_MAX = 60
TALKS = ["inject_scenario", "live_crowd", "own_evaluator", "fault_injection"]


@pytest.mark.parametrize(
    "command",
    [
        ["mypy", "--no-incremental", "--cache-dir=/dev/null"],
        ["ruff", "check", "--no-cache", "."],
        ["ruff", "format", "--no-cache", "--check", "."],
    ],
    ids=lambda command: "-".join(command[:2]),
)
def test_the_tools_find_nothing(command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=PYTHON, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_examples_in_the_documentation_are_true() -> None:
    tried = 0
    for module in pkgutil.walk_packages(curionav.__path__, "curionav."):
        results = doctest.testmod(importlib.import_module(module.name))
        assert results.failed == 0, module.name
        tried += results.attempted
    assert tried > 4


@pytest.mark.parametrize("name", TALKS)
def test_an_example_fits_on_a_slide(name: str) -> None:
    lines = (PYTHON / "examples" / f"{name}.py").read_text().splitlines()
    assert len(lines) <= EXAMPLE_LINES_MAX


def test_only_four_packages_are_needed() -> None:
    project = (PYTHON / "pyproject.toml").read_text()
    needed = re.search(r"^dependencies = \[(.*?)^\]", project, re.MULTILINE | re.DOTALL)
    assert needed is not None
    assert re.findall(r'^  "([a-z0-9-]+)', needed[1], re.MULTILINE) == ["eclipse-zenoh", "numpy", "cbor2", "pyyaml"]
    # What is LGPL, or huge, is for examples and for the viewer, a package beside this one.
    imported = set()
    for file in (PYTHON / "src" / "curionav").rglob("*.py"):
        with tokenize.open(file) as text:
            imported |= set(re.findall(r"^\s*(?:import|from) ([a-z0-9_]+)", text.read(), re.MULTILINE))
    assert not imported & {"jupedsim", "shapely", "vtk", "rerun"}
