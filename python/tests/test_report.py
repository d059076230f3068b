"""The figures of `curionav.report` are those that `curionav bench` wrote of the same runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from curionav.report.summary import Bench

DATA = Path(__file__).parent / "data" / "bench"
PUBLISHED = Path(__file__).resolve().parents[2] / "crates" / "lab" / "src" / "bench" / "published.csv"
SUITES = ["paper", "open", "rooms", "dense"]


def near(value: Any) -> Any:
    """The value with its numbers to twelve digits: the program reads its journal's last digit with less care."""
    if isinstance(value, dict):
        return {key: near(part) for key, part in value.items()}
    if isinstance(value, list):
        return [near(part) for part in value]
    return pytest.approx(value, rel=1e-12, abs=1e-12) if isinstance(value, float) else value


@pytest.mark.parametrize("suite", SUITES)
def test_every_figure_is_that_of_the_program(suite: str) -> None:
    told = json.loads((DATA / suite / "summary.json").read_text())
    found = Bench.read(DATA / suite).figures([DATA / "claims.toml"])
    for key in ["tests", "order", "claims"]:
        assert found[key] == told[key], key
    assert len(found["cells"]) == len(told["cells"]) > 0
    for cell, expected in zip(found["cells"], told["cells"], strict=True):
        assert cell == near(expected)


def test_the_papers_numbers_are_those_of_the_program() -> None:
    own = Path(__file__).resolve().parents[1] / "src" / "curionav" / "report" / "published.csv"
    assert own.read_text() == PUBLISHED.read_text()
