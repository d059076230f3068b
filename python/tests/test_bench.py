"""`curionav bench` calls this package at its end."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from contract import ROOT
from live import program

CLAIM = '[[claim]]\nplanner = "curiosity"\nkind = "bound"\nmeasure = "{}"\nat_{} = 1.0\n'


@pytest.mark.live
def test_a_bench_ends_with_a_report_and_the_verdicts_of_its_claims(tmp_path: Path) -> None:
    holds = tmp_path / "holds.toml"
    holds.write_text(CLAIM.format("success", "least"))
    fails = tmp_path / "fails.toml"
    fails.write_text(CLAIM.format("time_s", "most"))
    command = [str(program()), "bench", "--scenarios", "scenarios/quickstart.toml", "--planners", "curiosity,cnc-only"]
    command += ["--repeats", "2", "--first-seed", "1001", "--out", str(tmp_path / "bench"), "--check"]
    environment = {**os.environ, "CURIONAV_PYTHON": sys.executable}
    for files, status, verdicts in [([holds], 0, [1, 0]), ([fails], 1, [0, 1]), ([holds, fails], 1, [1, 1])]:
        done = subprocess.run(
            [*command, ",".join(map(str, files))],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert done.returncode == status, done.stderr
        begins = [sum(line.startswith(word) for line in done.stdout.splitlines()) for word in ("holds: ", "does not h")]
        assert begins == verdicts
    report = (tmp_path / "bench" / "report.html").read_text()
    assert report.endswith("</html>\n") and 'class="w c0"' in report and 'class="track"' in report
