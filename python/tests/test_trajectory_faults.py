"""What is told of files of trajectories that are wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import curionav.trajectories as tr
from curionav import FileError
from curionav.trajectories import Tracks
from curionav.trajectories.__main__ import main

ENTRY = {"timestamp": 0.0, "robot": {"x": 0.0, "y": 0.0}, "people": []}
CROWDED = {**ENTRY, "timestamp": -1.0, "people": [{"id": -1, "x": 0.0, "y": 0.0}]}


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("t.txt", "# framerate: 10\n# x/m\n1 0 1.0\n", "line 3: has 3 columns; write id, frame, x and y"),
        ("t.txt", "# framerate: 10\n# x/m\n1 0 1.0 z\n", "line 3: y is 'z', not a finite number"),
        ("t.txt", "# framerate: 10\n# x/m\n1 0 nan 0\n", "line 3: x is 'nan', not a finite number"),
        ("t.txt", "# framerate: 10\n# x/m\n1.5 0 1 0\n", "line 3: 1.5 is no id"),
        ("t.txt", "# framerate: 10\n# x/m\n1 0.5 1 0\n", "line 3: 0.5 is no frame"),
        ("t.txt", "# framerate: 10\n# x/m\n1 0 1 0\n1 0 2 0\n", "line 4: person 1 is already at frame 0 in line 3"),
        ("t.txt", "# framerate: 10\n# x/m\n", "there are no rows"),
        ("t.txt", "# x/m\n1 0 1 0\n", "does not say its frame_rate; give frame_rate= or --frame-rate, or add"),
        ("t.txt", "# framerate: 10\n1 0 1 0\n", "does not say its unit; give unit= or --unit, or add a line"),
        ("t.txt", "# framerate: 0\n# x/m\n1 0 1 0\n", "the frame rate 0 must be above 0"),
        ("t.ndjson", '{"track": {"f": 0, "p": 1, "x": 0}}', "line 1: track.y is 'None', not a finite number"),
        ("t.ndjson", "{", "line 1: is no JSON"),
        ("t.ndjson", '{"tracks": 1}', 'line 1: is neither {"scene"'),
        (
            "t.ndjson",
            '{"track": {"f": 0, "p": 1, "x": 0, "y": 0}}',
            "its scenes have no `fps`; give frame_rate= or --frame-rate",
        ),
        ("t.json", "{", "line 1: this is no JSON"),
        ("t.json", json.dumps({"sequence": [ENTRY]}), "has no `sequence` of two entries"),
        ("t.json", json.dumps({"sequence": [ENTRY, ENTRY]}), "sequence[1].timestamp is not after the one before"),
        ("t.json", json.dumps({"sequence": [ENTRY, {"timestamp": 1}]}), "sequence[1]: `x` is 'None'"),
        (
            "t.json",
            json.dumps({"sequence": [CROWDED, ENTRY]}),
            "sequence[0].people: -1 is no id; ids are whole numbers",
        ),
    ],
)
def test_a_fault_is_told_with_file_line_and_mend(tmp_path: Path, name: str, text: str, told: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    read = {"t.txt": tr.read_pedpy, "t.ndjson": tr.read_trajnet, "t.json": tr.read_socnav}[name]
    with pytest.raises(FileError) as error:
        read(file)
    assert str(error.value).startswith(f"{file}")
    assert told in str(error.value)


def test_a_rate_that_contradicts_the_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text("# framerate: 10\n# x/m\n1 0 1 0\n")
    with pytest.raises(FileError, match="says that its frame_rate is 10, but 25 was given"):
        tr.read_pedpy(tmp_path / "t.txt", 25)
    assert tr.read_pedpy(tmp_path / "t.txt", 10, "m").frame_rate == 10.0


@pytest.mark.parametrize(
    "wrong",
    [{"frame_rate": 0.0}, {"x": np.array([np.nan, 0.0])}, {"id": np.array([-1, 1])}, {"frame": np.array([0])},
     {"id": np.array([1, 1]), "frame": np.array([4, 4])}],
)  # fmt: skip
def test_tracks_cannot_be_wrong(wrong: dict[str, Any]) -> None:
    good: dict[str, Any] = {
        "frame_rate": 1.0, "id": np.array([1, 2]), "frame": np.array([0, 0]), "x": np.zeros(2), "y": np.zeros(2),
    }  # fmt: skip
    Tracks(**good)
    with pytest.raises(ValueError, match=r"must|negative|twice"):
        Tracks(**{**good, **wrong})


def test_the_command_says_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "no.txt"), str(tmp_path / "out"), "--format", "trajnet"]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path / 'no.txt'}: cannot be read: No such file or directory\n"
    (tmp_path / "t.txt").write_text("1 0 0 0\n")
    assert main([str(tmp_path / "t.txt"), str(tmp_path / "out"), "--format", "socnav"]) == 2
    assert "holds people alone" in capsys.readouterr().err
    (tmp_path / "t.txt").write_text("# framerate: 10\n# robot: id 1\n# x/m\n1 0 0 0\n")
    assert main([str(tmp_path / "t.txt"), str(tmp_path / "out"), "--format", "recorded"]) == 2
    assert "would hold nobody" in capsys.readouterr().err
    (tmp_path / "t.json").write_text(json.dumps({"sequence": [ENTRY, {**ENTRY, "timestamp": 1.0}]}))
    assert main([str(tmp_path / "t.json"), str(tmp_path / "out"), "--format", "pedpy", "--frame-rate", "-1"]) == 2
    assert "the frame rate -1 must be above 0" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
