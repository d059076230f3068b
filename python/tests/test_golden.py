"""Rust and Python read and write the same bytes."""

from __future__ import annotations

import runpy
from pathlib import Path

import cbor2
import numpy as np
import pytest
from contract import ROOT, SCHEMAS, golden, golden_files, validator

from curionav.messages import MESSAGES, CycleReport, MissionCommand, OccupancyGrid, Polygon, SetMission

GOLDEN = golden_files()
by_file = pytest.mark.parametrize(("path", "rule"), GOLDEN, ids=[path.name for path, _ in GOLDEN])


def test_every_golden_file_is_in_the_index_and_every_message_has_one() -> None:
    others = {SCHEMAS / "golden" / "sentences.cbor"}
    assert {path for path, _ in GOLDEN} == set((SCHEMAS / "golden").glob("*.cbor")) - others
    assert {rule for _, rule in GOLDEN} == set(MESSAGES)


def test_the_classes_are_what_the_generator_makes_of_the_cddl() -> None:
    generate = runpy.run_path(str(ROOT / "python" / "generate_messages.py"))["generate"]
    written = ROOT / "python" / "src" / "curionav" / "messages.py"
    assert written.read_text("utf-8") == generate(), "run python/generate_messages.py"


@by_file
def test_golden_bytes_decode_and_survive_being_encoded_again(path: Path, rule: str) -> None:
    message = MESSAGES[rule].decode(path.read_bytes(), f"application/cbor;curionav.{rule}.v1")
    again = MESSAGES[rule].decode(message.encode())
    assert again == message


@by_file
def test_both_sides_write_the_same_values(path: Path, rule: str) -> None:
    # Float widths may differ, the items may not.
    ours = cbor2.loads(MESSAGES[rule].decode(path.read_bytes()).encode())
    theirs = cbor2.loads(path.read_bytes())
    assert ours == theirs


@by_file
def test_both_sides_keep_to_the_cddl(path: Path, rule: str) -> None:
    validator(rule).validate_cbor(path.read_bytes())
    validator(rule).validate_cbor(MESSAGES[rule].decode(path.read_bytes()).encode())


@by_file
def test_keys_a_reader_does_not_know_are_passed_over(path: Path, rule: str) -> None:
    message = cbor2.loads(path.read_bytes())
    message["of_a_later_version"] = [1, {"a": cbor2.CBORTag(86, b"")}]
    assert MESSAGES[rule].decode(cbor2.dumps(message)) == MESSAGES[rule].decode(path.read_bytes())


def test_arrays_have_their_shapes_and_are_views_of_the_bytes() -> None:
    report = CycleReport.decode(golden("cycle_report"))
    candidates = report.candidates
    assert candidates.x.shape == (candidates.count, candidates.steps)
    assert candidates.x.dtype == np.float64
    assert not candidates.x.flags.owndata
    assert report.scene.belief.covariance.shape == (3, 3)
    assert report.total.shape == (candidates.count,)
    assert report.decision.x.ndim == 1


def test_a_candidate_without_a_score_has_none_here_and_is_absent_on_the_wire() -> None:
    report = CycleReport.decode(golden("cycle_report.explained"))
    wire = cbor2.loads(golden("cycle_report.explained"))
    count = report.candidates.count
    lacking = set(range(count)) - set(report.scored.tolist())
    assert lacking, "the golden report has a candidate without a total"
    for ours, theirs, scored in [
        (report.total, wire["total"], report.scored),
        *((term.raw, wire["terms"][i]["raw"], term.scored) for i, term in enumerate(report.terms)),
        *((term.cost, wire["terms"][i]["cost"], term.scored) for i, term in enumerate(report.terms)),
    ]:
        assert ours.shape == (count,)
        assert not ours.flags.writeable
        assert np.flatnonzero(~np.isnan(ours)).tolist() == scored.tolist()
        assert ours[scored].tolist() == np.frombuffer(theirs.value, "<f8").tolist()
    rejected = {entry["candidate"]: entry["why"] for entry in wire["rejected"]}
    assert report.rejected == [rejected.get(index) for index in range(count)]


def test_variants_are_told_apart_by_their_kind() -> None:
    command = MissionCommand.decode(golden("mission_command"))
    assert isinstance(command, SetMission)
    assert isinstance(command.order.robot_model.footprint, Polygon)
    assert command.order.profile["name"] == "paper"


def test_a_map_is_named_by_its_content() -> None:
    for name in ("occupancy_grid", "occupancy_grid.zones"):
        grid = OccupancyGrid.decode(golden(name))
        assert grid.identity() == grid.map
