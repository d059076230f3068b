"""A planner profile travels whole, with what the scenario changes in it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from contract import ROOT
from live import hall

from curionav import Scenario, ScenarioError
from curionav.profiles import BUILT_IN

FILES = ROOT / "crates" / "planning" / "profiles"


def scenario(directory: Path, **changes: Any) -> Scenario:
    return Scenario.from_dict(hall(directory) | changes, directory)


def paths(table: dict[str, Any], below: str = "") -> dict[str, Any]:
    """The values of a table by their dotted paths."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        found |= paths(value, f"{below}{key}.") if isinstance(value, dict) else {f"{below}{key}": value}
    return found


def test_the_built_in_profiles_are_those_of_the_services() -> None:
    if not FILES.is_dir():
        pytest.skip("no sources of the services beside the package")
    assert set(BUILT_IN) == {path.stem for path in FILES.glob("*.toml")}
    default = paths(BUILT_IN["curiosity"])
    for name, profile in BUILT_IN.items():
        written = tomllib.loads((FILES / f"{name}.toml").read_text())
        whole = paths(profile)
        assert paths(written).items() <= whole.items(), name
        assert set(profile["terms"]) == set(written["terms"]), name
        # What a file leaves out has the value of the default profile.
        for path, value in default.items():
            if path not in paths(written) and not path.startswith("terms."):
                assert whole[path] == value, (name, path)


def test_a_scenario_has_the_profile_it_names_and_the_default_otherwise(tmp_path: Path) -> None:
    assert scenario(tmp_path).profile() == BUILT_IN["curionav"]
    named = scenario(tmp_path, planner={"profile": "risk-rrt"})
    assert named.profile() == BUILT_IN["risk-rrt"]
    assert named.profile("cpc-only") == BUILT_IN["cpc-only"]


def test_a_scenario_changes_single_fields_and_leaves_its_tables_as_they_were(tmp_path: Path) -> None:
    changes = {"generation": {"tree": {"iterations": 5, "eta": 2}}, "terms": {"cnc": {"weight": 3}}}
    before = paths(BUILT_IN["curionav"])
    changed = scenario(tmp_path, profile=changes)
    profile = changed.profile()
    assert {path: v for path, v in paths(profile).items() if before[path] != v} == {
        "generation.tree.iterations": 5,
        "generation.tree.eta": 2.0,
        "terms.cnc.weight": 3.0,
    }
    # On the wire a whole number is another type than a float.
    tree = profile["generation"]["tree"]
    assert (type(tree["iterations"]), type(tree["eta"])) == (int, float)
    assert type(profile["terms"]["cnc"]["weight"]) is float
    assert changed.data["profile"] == changes
    assert "profile" not in changed.packed()[0]
    assert paths(BUILT_IN["curionav"]) == before


def test_a_further_term_joins_those_of_the_profile(tmp_path: Path) -> None:
    profile = scenario(tmp_path, profile={"terms": {"comfort": {"scale": 1}}}).profile()
    assert profile["terms"].keys() == BUILT_IN["curionav"]["terms"].keys() | {"comfort"}
    assert profile["terms"]["comfort"] == {"scale": 1.0, "weight": 1.0, "when": "always", "gives_way": False}
    assert scenario(tmp_path).with_term("comfort", 2.0).profile()["terms"]["comfort"]["weight"] == 2.0


def test_a_profile_of_ones_own_is_completed_but_for_its_terms(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('name = "mine"\nsteps = 20\n[terms.distance]\nscale = 2\n[goal]\narrive_distance = 1\n')
    tables: dict[str, Any] = {
        "name": "mine", "steps": 20, "terms": {"distance": {"scale": 2}}, "goal": {"arrive_distance": 1}
    }  # fmt: skip
    for profile in (scenario(tmp_path).profile(file), scenario(tmp_path).profile(str(file)),
                    scenario(tmp_path).profile(tables),
                    scenario(tmp_path, planner={"profile": "mine.toml"}).profile()):  # fmt: skip
        distance = {"scale": 2.0, "weight": 1.0, "when": "always", "gives_way": False}
        assert profile["terms"] == {"distance": distance}
        assert (profile["name"], profile["steps"]) == ("mine", 20)
        assert profile["goal"] == BUILT_IN["curiosity"]["goal"] | {"arrive_distance": 1.0}
        assert profile["hold"] == BUILT_IN["curiosity"]["hold"]


@pytest.mark.parametrize(
    ("planner", "field", "reason"),
    [
        ("no-such-planner", "planner", "use one of curiosity, "),
        ("none.toml", "planner", "cannot read none.toml"),
        (None, "planner.profile", "`other` is not known here"),
    ],
)
def test_a_planner_that_is_not_there_is_named(tmp_path: Path, planner: str | None, field: str, reason: str) -> None:
    with pytest.raises(ScenarioError, match=reason) as error:
        scenario(tmp_path, planner={"profile": "other"}).profile(planner)
    assert error.value.field == field


@pytest.mark.parametrize("name", ["planner", "profile"])
def test_a_table_that_is_none_is_named(tmp_path: Path, name: str) -> None:
    with pytest.raises(ScenarioError, match="must be a table") as error:
        scenario(tmp_path, **{name: "curiosity"}).profile()
    assert error.value.field == name
