"""Results from files, as frames of pandas and as pictures."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT, golden
from live import program

import curionav
from curionav import Result
from curionav.messages import Cycles, Measures, OccupancyGrid, Pose, RunResult

FRAMES = "pip install './python[frames]'"
pytest.importorskip("mcap", reason=FRAMES)
pytest.importorskip("pandas", reason=FRAMES)
mpl = pytest.importorskip("matplotlib", reason=FRAMES)

import drive  # noqa: E402

mpl.use("agg")
GOLDEN = RunResult.decode(golden("run_result"))


def plain(record: Cycles | Measures) -> dict[str, Any]:
    return dataclasses.asdict(record)


def folder_of(result: RunResult, folder: Path) -> Path:
    """What `curionav run --out` writes of it."""
    summary = {
        "scenario": result.scenario,
        "planner": result.planner,
        "seed": result.seed,
        "outcome": result.outcome,
        "metrics": plain(result.measures),
        "cycles": {name: value for name, value in plain(result.cycles).items() if value is not None},
        "real_time_factor": result.real_time_factor,
        "decisions_sha256": result.decisions_sha256,
        "contacts": [
            {name: value for name, value in dataclasses.asdict(contact).items() if value is not None}
            for contact in result.contacts or []
        ],
        "social": result.social,
    }
    (folder / "metrics.json").write_text(json.dumps(summary, indent=2))
    rows = [",".join(map(repr, row)) for row in result.trace.values.tolist()]
    (folder / "trajectory.csv").write_text("\n".join([",".join(result.trace.columns), *rows]) + "\n")
    return folder


def test_people_are_a_row_for_each_tick_at_which_they_are_present() -> None:
    frame = Result.of(GOLDEN).people_to_pandas()
    assert list(frame.columns) == ["time_s", "id", "x", "y"]
    # Person 7 is there at both ticks, person 11 at the second alone.
    expected = [(0.0, 7, 3.0, 1.0), (0.1, 7, 2.95, 1.01), (0.1, 11, 4.1, -0.7)]
    assert np.allclose(frame.to_numpy(), expected, atol=1e-6)


def test_a_frame_has_the_columns_of_the_trace() -> None:
    frame = Result.of(GOLDEN).to_pandas()
    assert list(frame.columns) == GOLDEN.trace.columns
    assert np.array_equal(frame.to_numpy(), GOLDEN.trace.values)


def test_a_folder_gives_the_result_without_people(tmp_path: Path) -> None:
    result = Result.load(folder_of(GOLDEN, tmp_path))
    whole = Result.of(GOLDEN)
    for field in ("scenario", "seed", "outcome", "measures", "contacts", "social", "cycles", "decisions_sha256"):
        assert getattr(result, field) == getattr(whole, field), field
    assert result.to_pandas().equals(whole.to_pandas())
    assert result.people_to_pandas().empty
    assert result.grid is None


def test_printed_json_gives_the_measures_alone(tmp_path: Path) -> None:
    printed = folder_of(GOLDEN, tmp_path).joinpath("metrics.json").rename(tmp_path / "run.json")
    result = Result.load(printed)
    assert result.measures == GOLDEN.measures
    assert result.to_pandas().empty
    with pytest.raises(curionav.IncompleteResult, match="no trace"):
        result.plot()


def test_a_recording_gives_mission_and_map_too(tmp_path: Path) -> None:
    result = Result.load(drive.record(tmp_path / "run.mcap", drive.drive(20)))
    assert result.scenario == "made-up"
    assert result.order is not None
    assert result.grid is not None
    assert result.grid.identity() == result.order.map
    assert result.people_to_pandas()["id"].nunique() == 5


@pytest.mark.parametrize(
    ("files", "named"),
    [
        ({}, r"metrics\.json: cannot be read: No such file"),
        ({"metrics.json": "{\n]"}, r"metrics\.json, line 2: this is no JSON"),
        ({"metrics.json": "[]"}, r"metrics\.json: this JSON is no result of a run; give the folder"),
        ({"trajectory.csv": "a,b\n1,2\n3,x\n"}, r"trajectory\.csv, line 3: could not convert string to float: 'x'"),
        ({"trajectory.csv": "a,b\n1\n"}, r"trajectory\.csv, line 2: has 1 numbers, but the first line names 2"),
    ],
)
def test_a_fault_is_told_with_file_and_line(tmp_path: Path, files: dict[str, str], named: str) -> None:
    if "trajectory.csv" in files:
        folder_of(GOLDEN, tmp_path)
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(curionav.FileError, match=named):
        Result.load(tmp_path)


def test_a_measure_out_of_range_is_named(tmp_path: Path) -> None:
    file = folder_of(GOLDEN, tmp_path) / "metrics.json"
    file.write_text(file.read_text().replace('"seed": 17', '"seed": "x"'))
    with pytest.raises(curionav.FileError, match=r"metrics\.json: seed: "):
        Result.load(tmp_path)


def test_what_is_no_recording_is_told(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_text("nothing")
    with pytest.raises(curionav.FileError, match=r"no\.mcap: this is no recording"):
        Result.load(tmp_path / "no.mcap")
    cut = drive.record(tmp_path / "cut.mcap", drive.drive(5))
    cut.write_bytes(cut.read_bytes()[:-200])
    with pytest.raises(curionav.FileError, match=r"cut\.mcap: "):
        Result.load(cut)


def test_a_missing_library_is_told_with_the_extra_that_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(curionav.MissingExtra, match=r"pandas is not installed; `pip install 'curionav\[frames\]'`"):
        Result.of(GOLDEN).to_pandas()
    with pytest.raises(ImportError):
        Result.of(GOLDEN).people_to_pandas()


def made_up(**changes: Any) -> Result:
    (_, status), *_ = [(key, message) for key, message in drive.drive(20) if key.endswith("/run")]
    assert isinstance(status, curionav.RunStatus)
    assert status.result is not None
    return dataclasses.replace(Result.of(status.result), **changes)


def test_a_picture_has_axes_in_metres_and_everything_in_its_place() -> None:
    contacts = [curionav.messages.Contact(time_s=0.55, person=1, robot_mps=0.1, person_mps=0.2)]
    result = made_up(contacts=contacts)
    axes = result.plot()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x in m", "y in m")
    assert axes.get_aspect() == 1.0
    assert axes.get_title() == "made-up, curiosity, seed 1: reached after 5.0 s"
    lines = {str(line.get_label()): line for line in axes.get_lines()}
    assert np.array_equal(lines["robot, dots every 2 s"].get_xdata(), result.trace["true_x"])
    assert np.array_equal(lines["believed way"].get_ydata(), result.trace["belief_y"])
    # Half way between the ticks at 0.5 s and 0.6 s.
    assert lines["contact"].get_xdata() == pytest.approx(result.trace["true_x"][5:7].mean())
    (left, right), x = axes.get_xlim(), result.trace["true_x"]
    assert left <= x.min() - 1.4
    assert right >= x.max() + 1.4
    again = result.plot(axes)
    assert again is axes


def test_a_clip_is_as_long_as_the_run_and_something_moves_in_it(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason=FRAMES)
    trace = made_up().trace
    result = made_up(trace=trace | {"true_heading": np.zeros_like(trace["time_s"])})
    file = tmp_path / "run.gif"
    result.clip(file, speed=2.0, frames_per_second=5.0)
    with image.open(file) as clip:
        # A frame each 0.4 s of the run, and its end.
        time_s = result.trace["time_s"]
        assert clip.n_frames == np.ceil((time_s[-1] - time_s[0]) / 0.4) + 1
        assert clip.info["duration"] == 200
        first = np.asarray(clip.convert("L"), np.int32)
        clip.seek(clip.n_frames - 1)
        assert (np.abs(first - np.asarray(clip.convert("L"), np.int32)) > 50).mean() > 0.001
    with pytest.raises(ValueError, match="positive"):
        result.clip(file, speed=0.0)


def test_a_map_lies_where_its_origin_says() -> None:
    grid = OccupancyGrid(
        width=4, height=2, resolution=0.5, origin=Pose(x=-1.0, y=2.0, heading=np.pi / 2),
        cells=np.array([[0, 0, 0, 100], [-1, 0, 0, 0]], np.int8), map=bytes(32),
    )  # fmt: skip
    axes = made_up(grid=grid).plot()
    (image,) = axes.get_images()
    turned = image.get_transform() - axes.transData
    # The far end of the first row of cells, 2 m along x of the map, is 2 m along y of the frame.
    assert turned.transform((2.0, 0.0)) == pytest.approx((-1.0, 4.0))
    grey = np.asarray(image.get_array())
    assert grey[0, 3] < grey[1, 0] < grey[0, 0] == 1.0


@pytest.mark.live
def test_folder_and_recording_of_one_run_of_the_program_agree(tmp_path: Path) -> None:
    recording, folder = tmp_path / "run.mcap", tmp_path / "out"
    scenario = ROOT / "scenarios" / "quickstart.toml"
    command: list[str | Path] = [program(), "run", scenario, "--json", "--out", folder, "--record", recording]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=120, check=True)
    printed = tmp_path / "run.json"
    printed.write_text(done.stdout)
    whole, written, summary = Result.load(recording), Result.load(folder), Result.load(printed)
    assert whole.to_pandas().equals(written.to_pandas())
    assert whole.measures == written.measures == summary.measures
    assert whole.social == written.social
    assert whole.decisions_sha256 == summary.decisions_sha256
    people = whole.people_to_pandas()
    # Everyone is there all the time, and the nearest comes as near as the measure says; positions travel as f32.
    assert len(people) == 4 * len(whole.trace["time_s"])
    robot = whole.to_pandas()[["time_s", "true_x", "true_y"]]
    both = people.merge(robot, on="time_s")
    nearest = np.hypot(both["x"] - both["true_x"], both["y"] - both["true_y"]).min()
    assert nearest == pytest.approx(whole.measures.md_m, abs=1e-5)
