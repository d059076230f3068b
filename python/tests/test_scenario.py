"""A scenario travels with everything it names."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from contract import ROOT, validator
from live import dataset_file, hall

from curionav import Scenario, ScenarioError
from curionav.messages import InjectRequest


def recorded(file: str) -> dict[str, Any]:
    return {"file": file, "format": "text", "fps": 25}


def test_map_image_and_recordings_are_sent_by_names_without_directories(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    (tmp_path / "a" / "walk.txt").write_text("first")
    (tmp_path / "b" / "walk.txt").write_text("second")
    data = hall(tmp_path) | {"recorded": [recorded("a/walk.txt"), recorded("b/walk.txt"), recorded("a/walk.txt")]}
    tables, files = Scenario.from_dict(data, tmp_path).packed()
    assert tables["map"]["file"] == "hall.yaml"
    assert [r["file"] for r in tables["recorded"]] == ["walk.txt", "1-walk.txt", "walk.txt"]
    assert files["walk.txt"] == b"first"
    assert files["1-walk.txt"] == b"second"
    assert files["hall.pgm"].startswith(b"P5")
    assert len(files) == 4
    assert data["map"]["file"] == "maps/hall.yaml", "packing leaves the scenario as it was"


def test_a_map_and_a_recording_of_one_name_stay_apart(tmp_path: Path) -> None:
    data = hall(tmp_path) | {"recorded": [recorded("hall.pgm")]}
    (tmp_path / "hall.pgm").write_text("a recording")
    tables, files = Scenario.from_dict(data, tmp_path).packed()
    assert files[tables["recorded"][0]["file"]] == b"a recording"
    assert files["hall.pgm"].startswith(b"P5")


def test_masks_and_the_true_map_are_sent_as_the_map_is(tmp_path: Path) -> None:
    data = hall(tmp_path)
    for folder, pixels in (("keepout", b"P5 1 1 255 \x00"), ("truth", b"P5 1 1 255 \xff")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{folder}.pgm").write_bytes(pixels)
        (tmp_path / folder / "hall.yaml").write_text(f"image: {folder}.pgm\n")
    data["map"]["keepout"] = "keepout/hall.yaml"
    data["map"]["speed"] = "keepout/hall.yaml"
    data["world"] = {"file": "truth/hall.yaml"}
    tables, files = Scenario.from_dict(data, tmp_path).packed()
    names = [tables["map"][key] for key in ("file", "keepout", "speed")] + [tables["world"]["file"]]
    images = [files[name].decode() for name in names]
    assert "hall.pgm" in images[0]
    assert images[1:] == ["image: keepout.pgm\n"] * 2 + ["image: truth.pgm\n"]
    assert files["truth.pgm"].endswith(b"\xff")
    assert len(set(names)) == 4
    # An image cannot be renamed.
    (tmp_path / "truth" / "hall.pgm").write_bytes(b"P5 1 1 255 \x00")
    (tmp_path / "truth" / "hall.yaml").write_text("image: hall.pgm\n")
    with pytest.raises(ScenarioError, match=r"world\.file.*rename one of them"):
        Scenario.from_dict(data, tmp_path).packed()


def test_names_the_services_refuse_are_replaced(tmp_path: Path) -> None:
    data = hall(tmp_path)
    (tmp_path / ".höhle!.yaml").write_bytes((tmp_path / "maps" / "hall.yaml").read_bytes())
    (tmp_path / "hall.pgm").write_bytes((tmp_path / "maps" / "hall.pgm").read_bytes())
    tables, files = Scenario.from_dict(data | {"map": {"file": ".höhle!.yaml"}}, tmp_path).packed()
    assert tables["map"]["file"] == "file-.h_hle_.yaml"
    assert set(files) == {"file-.h_hle_.yaml", "hall.pgm"}


@pytest.mark.parametrize("name", ["büro_地図.pgm", "hall (2) [new].pgm", "l'étage & 1,5.pgm"])
def test_images_may_have_names_of_any_language(tmp_path: Path, name: str) -> None:
    data = hall(tmp_path)
    (tmp_path / "maps" / name).write_bytes((tmp_path / "maps" / "hall.pgm").read_bytes())
    (tmp_path / "maps" / "hall.yaml").write_text(f'image: "{name}"\n', encoding="utf-8")
    assert set(Scenario.from_dict(data, tmp_path).files()) == {name, "hall.yaml"}


@pytest.mark.parametrize("name", ["a:b.pgm", "what?.pgm", "x" * 256, "a\\\\b.pgm"])
def test_an_image_whose_name_no_service_takes_is_refused(tmp_path: Path, name: str) -> None:
    data = hall(tmp_path)
    (tmp_path / "maps" / "hall.yaml").write_text(f'image: "{name}"\n')
    with pytest.raises(ScenarioError, match="valid on every system") as error:
        Scenario.from_dict(data, tmp_path).files()
    assert error.value.field == "map.file"


def test_marks_of_editors_are_read_over(tmp_path: Path) -> None:
    data = hall(tmp_path)
    description = tmp_path / "maps" / "hall.yaml"
    description.write_text(description.read_text(), encoding="utf-8-sig")
    assert "hall.pgm" in Scenario.from_dict(data, tmp_path).files()
    (tmp_path / "marked.toml").write_text('name = "marked"\n', encoding="utf-8-sig")
    assert Scenario.load(tmp_path / "marked.toml").data == {"name": "marked"}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("image: [a\n", "is not YAML"),
        ("- image: hall.pgm\n", "names no image"),
        ("image: 3\n", "names no image"),
        ("# image: hall.pgm\n", "names no image"),
    ],
)
def test_a_description_is_read_as_yaml(tmp_path: Path, text: str, reason: str) -> None:
    data = hall(tmp_path)
    (tmp_path / "maps" / "hall.yaml").write_text(text)
    with pytest.raises(ScenarioError, match=reason):
        Scenario.from_dict(data, tmp_path).files()


@pytest.mark.parametrize(
    "line",
    [
        "image: hall.pgm",
        "image:   'hall.pgm'  # it",
        'image: "hall.pgm"',
        "image: ./hall.pgm",
        "image : hall.pgm",
        "image:\n  hall.pgm",
        '"image": !!str hall.pgm',
        "image: >-\n  hall.pgm",
    ],
)
def test_the_image_is_found_however_its_line_is_written(tmp_path: Path, line: str) -> None:
    data = hall(tmp_path)
    (tmp_path / "maps" / "hall.yaml").write_text(f"resolution: 0.1\n{line}\norigin: [0, 0, 0]\n")
    assert set(Scenario.from_dict(data, tmp_path).files()) == {"hall.pgm", "hall.yaml"}


def test_a_missing_file_is_named_with_its_field(tmp_path: Path) -> None:
    data = hall(tmp_path)
    changes: list[tuple[dict[str, Any], str]] = [
        ({"map": {"file": "none.yaml"}}, "map.file"),
        ({"recorded": [recorded("none.txt")]}, "recorded[0].file"),
    ]
    for change, field in changes:
        with pytest.raises(ScenarioError, match="none") as error:
            Scenario.from_dict(data | change, tmp_path).packed()
        assert error.value.field == field
    (tmp_path / "maps" / "hall.pgm").unlink()
    with pytest.raises(ScenarioError, match=r"hall\.pgm") as error:
        Scenario.from_dict(data, tmp_path).packed()
    assert error.value.field == "map.file: image"
    (tmp_path / "maps" / "hall.yaml").write_text("resolution: 0.1\n")
    with pytest.raises(ScenarioError, match="names no image"):
        Scenario.from_dict(data, tmp_path).packed()


def test_a_value_without_a_form_on_the_wire_is_named(tmp_path: Path) -> None:
    data = hall(tmp_path)
    data["robot"]["goal"] = [6, object()]
    with pytest.raises(ScenarioError) as error:
        Scenario.from_dict(data, tmp_path).packed()
    assert error.value.field == "robot.goal[1]"


# Beside the scenarios lie planners and claims for the bench.
OTHERS = ("arms", "claims", "tuning")
SCENARIOS = [p for p in (ROOT / "scenarios").glob("**/*.toml") if p.parent.name not in OTHERS]


@pytest.mark.parametrize("path", sorted(SCENARIOS), ids=lambda path: path.stem)
def test_scenario_files_load_and_keep_to_the_contract(path: Path) -> None:
    for file in re.findall(r'"dataset:([^"]+)"', path.read_text()):
        dataset_file(file)
    scenario = Scenario.load(path)
    tables, files = scenario.packed()
    request = InjectRequest(
        scenario=tables, files=files, profile=scenario.profile(), seed=1, clock="lockstep", time_scale=1.0
    )
    validator("inject_request").validate_cbor(request.encode())


def test_a_scenario_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text("name =")
    with pytest.raises(ScenarioError, match=r"bad\.toml"):
        Scenario.load(bad)
    with pytest.raises(ScenarioError, match="cannot read"):
        Scenario.load(tmp_path / "none.toml")
