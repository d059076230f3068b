"""The examples, and the code of the README, as a newcomer runs them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from contract import ROOT
from live import Up, dataset_file, program

pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(not (ROOT / "scenarios").is_dir(), reason="no scenarios beside the package"),
]

PYTHON = ROOT / "python"
TIMEOUT = 240.0


def run(up: Up, name: str, *arguments: str) -> str:
    file = str(PYTHON / "examples" / f"{name}.py")
    command = [sys.executable, file, "--connect", up.endpoint, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_injecting_and_watching(up: Up) -> None:
    printed = run(up, "inject_scenario", str(ROOT / "scenarios" / "quickstart.toml"), "--seed", "1001")
    assert "candidates, cheapest" in printed
    assert "reached" in printed


def test_ones_own_evaluator_changes_the_side_on_which_people_are_passed(up: Up) -> None:
    printed = run(up, "own_evaluator", "--seed", "1001")
    assert re.search(r"^without the term: reached, passes \d\.\d\d m left$", printed, re.MULTILINE), printed
    assert re.search(r"^with +the term: reached, passes \d\.\d\d m right$", printed, re.MULTILINE), printed
    apart = re.search(r"up to (\d+\.\d+) m apart", printed)
    assert apart is not None
    assert float(apart[1]) > 1.0


def test_faults_are_seen_and_survived(up: Up) -> None:
    printed = run(up, "fault_injection", "--speed", "3")
    for since in (3, 11):
        assert re.search(rf"^ *{since}\.\d s  (hold|stop) .*`smooth` was not evaluated", printed, re.MULTILINE), printed
    assert "'failed'" in printed
    assert "reached" in printed


def test_a_recording_as_a_live_crowd(up: Up) -> None:
    dataset_file("peds_eth_ucy/zara01/obsmat.txt")
    printed = run(up, "live_crowd", "--seed", "1001")
    assert re.search(r"^(reached|timeout): \d+ people, the nearest came to", printed, re.MULTILINE), printed


def test_jupedsim_as_a_live_crowd(up: Up) -> None:
    pytest.importorskip("jupedsim", reason="JuPedSim is not installed: pip install './python[examples]'")
    dataset_file("maps_nav2_turtlebot/depot.yaml")
    printed = run(up, "jupedsim_crowd", "--seed", "1001")
    assert re.search(r"^reached: 0 collisions, nearest", printed, re.MULTILINE), printed


def test_a_picture_of_a_run(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="pip install './python[frames]'")
    pytest.importorskip("pandas", reason="pip install './python[frames]'")
    picture = tmp_path / "run.png"
    command = [sys.executable, str(PYTHON / "examples" / "plot_run.py"), "scenarios/quickstart.toml", str(picture)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=TIMEOUT, check=False, cwd=ROOT,
        env={**os.environ, "CURIONAV_BIN": str(program())},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout == "reached: 136 ticks, 4 people\n"
    assert picture.read_bytes().startswith(b"\x89PNG")


def blocks() -> list[str]:
    text = (PYTHON / "README.md").read_text()
    return re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("number", range(len(blocks())))
def test_the_code_of_the_readme_runs(up: Up, tmp_path: Path, number: int) -> None:
    if "to_pandas" in blocks()[number]:
        pytest.importorskip("matplotlib", reason="pip install './python[frames]'")
        pytest.importorskip("pandas", reason="pip install './python[frames]'")
    # The README connects to where a deployment listens by default; a configuration file says otherwise.
    config = tmp_path / "client.json5"
    config.write_text(
        f'{{ mode: "client", connect: {{ endpoints: ["{up.endpoint}"] }}, '
        "scouting: { multicast: { enabled: false } } }"
    )
    file = tmp_path / "readme.py"
    file.write_text(blocks()[number])
    done = subprocess.run(
        [sys.executable, file], capture_output=True, text=True, timeout=TIMEOUT, check=False, cwd=ROOT,
        env={**os.environ, "ZENOH_CONFIG": str(config)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    if "smooth" in blocks()[number]:
        turned = [float(rate) for rate in re.findall(r"reached (\d\.\d+) rad/s", done.stdout)]
        assert len(turned) == 2, done.stdout
        assert turned[1] < turned[0], "what the README says of it"
