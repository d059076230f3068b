"""The tables of docs/benchmark.md, from what a benchmark wrote."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from contract import ROOT

SCRIPT = ROOT / "python" / "benchmarks" / "suite_tables.py"
RESULTS = """planner,outcome,success,collisions,rmse_m,td,md_m,time_s,cycles,first_choice
mine,reached,1,0,0.1,0.0,2.0,20,60,60
mine,reached,0,2,0.2,0.1,1.0,30,90,81
mine,timeout,0,0,0.6,0.2,,120,50,5
other,lost,0,0,0.5,0.0,,60,0,0
"""


def test_a_planner_has_a_row_of_what_its_runs_came_to(tmp_path: Path) -> None:
    (tmp_path / "results.csv").write_text(RESULTS)
    printed = subprocess.run([sys.executable, SCRIPT, tmp_path], check=True, capture_output=True, text=True).stdout
    assert printed.splitlines()[4:6] == [
        "| `mine` | 1 of 3 | 1 | 1 | 0 | 0.30 / 0.20 | 10.0 | 1.50 | 25.0 / 25.0 | 73 |",
        "| `other` | 0 of 1 | 0 | 0 | 1 | 0.50 / 0.50 | 0.0 |  |  /  |  |",
    ]
