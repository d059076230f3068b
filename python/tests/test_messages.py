"""What is not a message is refused, and the refusal names the field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cbor2
import numpy as np
import pytest
from contract import golden, validator

from curionav import DecodeError, EncodeError
from curionav.messages import (
    CycleReport,
    Decision,
    InjectRequest,
    MissionCommand,
    People,
    Pose,
    Reject,
    RunStatus,
    Scan,
    Scores,
    Tree,
)

Change = Callable[[dict[str, Any]], object]


def tables(name: str) -> dict[str, Any]:
    """A golden message, to be spoilt."""
    message: dict[str, Any] = cbor2.loads(golden(name))
    return message


def f64(*values: float) -> cbor2.CBORTag:
    return cbor2.CBORTag(86, np.array(values, "<f8").tobytes())


def u32(*values: int) -> cbor2.CBORTag:
    return cbor2.CBORTag(70, np.array(values, "<u4").tobytes())


def put(path: str, value: object) -> Change:
    """Puts a value at a path of names and indices."""

    def change(message: Any) -> None:
        *parents, last = [int(p) if p.isdigit() else p for p in path.split(".")]
        for parent in parents:
            message = message[parent]
        message[last] = value

    return change


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (lambda m: m.pop("scene"), "scene"),
        (lambda m: m["scene"]["belief"].pop("health"), "scene.belief.health"),
        (put("seq", -1), "seq"),
        (put("seq", 1.0), "seq"),
        (put("robot", "R 1"), "robot"),
        (put("map", b"short"), "map"),
        (put("scene.stamp", 4), "scene.stamp"),
        (put("scene.stamp", float("nan")), "scene.stamp"),
        (put("scene.belief.health.scan_fit", 1.5), "scene.belief.health.scan_fit"),
        (put("scene.people.x", f64(1.0)), "scene.people.x"),
        (put("scene.people.x", f64(1.0, float("inf"))), "scene.people.x[1]"),
        (put("scene.people.x", b"12345678"), "scene.people.x"),
        (put("scene.people.x", cbor2.CBORTag(85, b"12345678")), "scene.people.x"),
        (put("scene.people.x", cbor2.CBORTag(86, b"1234567")), "scene.people.x"),
        (put("scene.people.frame", "robot"), "scene.people.frame"),
        (put("scene.belief.covariance", f64(*[-1.0] * 9)), "scene.belief.covariance"),
        (put("candidates.count", 2**31), "candidates.count"),
        (put("candidates.count", 1), "candidates.id"),
        (put("candidates.dt", 0.0), "candidates.dt"),
        (put("terms.0.raw", f64(1.0)), "terms[0].raw"),
        (put("terms.0.scored", u32(1, 0)), "terms[0].scored"),
        (put("terms.0.scored", u32(0, 4095)), "terms[0].scored"),
        (put("scored", u32(0, 0)), "scored"),
        (put("total", f64(float("nan"), 1.0)), "total[0]"),
        (put("terms.0.evaluated", "elsewhere"), "terms[0].evaluated"),
        (put("terms", {}), "terms"),
        (put("rejected", [{"candidate": 4095, "why": {"code": "slow"}}]), "rejected[0].candidate"),
        (put("rejected", [{"candidate": 1, "why": {"code": "slow"}}] * 2), "rejected[1].candidate"),
        (put("rejected", [{"candidate": 1, "why": {"code": "ugly"}}]), "rejected[0].why.code"),
        (put("rejected", [{"candidate": 1, "why": {"code": "hits_wall"}}]), "rejected[0].why.after_s"),
        (put("rejected", [{"candidate": 1}]), "rejected[0]"),
        (put("chosen", 4095), "chosen"),
        (put("decision.action", "go"), "decision.action"),
        (put("decision.reason", "least_cost"), "decision.reason"),
        (put("decision.reason", {"code": "ugly"}), "decision.reason.code"),
        (
            put("decision.reason", {"code": "none_free", "previous": {"code": "strayed"}}),
            "decision.reason.previous.distance_m",
        ),
        (put("decision.degraded", [{"code": "not_evaluated", "term": "R 1"}]), "decision.degraded[0].term"),
        (put("decision.arrived", 1), "decision.arrived"),
    ],
)
def test_a_bad_field_is_named(change: Change, field: str) -> None:
    message = tables("cycle_report")
    change(message)
    with pytest.raises(DecodeError) as error:
        CycleReport.decode(cbor2.dumps(message))
    assert error.value.field == field
    assert error.value.message == "cycle_report"
    assert field in str(error.value)


def test_only_a_stop_comes_without_a_trajectory() -> None:
    message = tables("decision.stop")
    assert Decision.decode(cbor2.dumps(message)).x.shape == (0,)
    with pytest.raises(DecodeError) as error:
        Decision.decode(cbor2.dumps({**message, "action": "hold"}))
    assert (error.value.field, error.value.why) == ("x", {"code": "too_few", "found": 0, "least": 1})


def test_a_tree_leads_to_a_root() -> None:
    tree = Tree.decode(golden("tree"))
    root = 2**32 - 1
    two = Tree.decode(golden("tree.two_roots"))
    assert two.parent.tolist() == [root, 0, root]
    assert two.columns["omega"].tolist() == [-0.1, 0, 0]

    def with_parents(*parents: int) -> Tree:
        return replace(tree, parent=np.array(parents, np.uint32), columns={})

    for good in [(), (root,), (root, 0, 0, 2), (1, 2, root), (root, root, 1)]:
        assert Tree.decode(with_parents(*good).encode()).parent.tolist() == list(good)
    for bad in [(0,), (1, 0), (root, 2, 3, 1), (root, 5), (1, 2, 1)]:
        with pytest.raises(EncodeError, match="parent"):
            with_parents(*bad).encode()


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xa1",
        b"\x00",
        b"\xbf\xff",
        b"\x9b" + b"\xff" * 8,
        b"\x5b" + b"\xff" * 8,
        b"\x81" * 10_000,
        b"\xa2" + b"\x63run\x01" * 2,
        golden("run_status") + b"\x00",
        golden("run_status")[:-1],
    ],
)
def test_what_is_not_one_whole_item_is_refused(data: bytes) -> None:
    with pytest.raises(DecodeError):
        RunStatus.decode(data)


def test_no_flipped_or_missing_byte_raises_anything_but_a_decode_error() -> None:
    whole = golden("cycle_report")
    seed = 7
    random = np.random.default_rng(seed)
    refused = 0
    for _ in range(3000):
        data = bytearray(whole)
        for at in random.integers(0, len(data), 2):
            data[at] = random.integers(0, 256)
        try:
            CycleReport.decode(bytes(data[: len(data) - int(random.integers(0, 2))]))
        except DecodeError:
            refused += 1
    assert refused > 1000, f"seed {seed}"


def test_a_message_over_its_limit_is_not_parsed() -> None:
    with pytest.raises(DecodeError, match="exceed the limit"):
        Scores.decode(b"\xff" * (Scores.MAX_BYTES + 1))


def test_the_encoding_is_that_of_the_message_and_the_version() -> None:
    data = golden("scores")
    Scores.decode(data, "application/cbor;curionav.scores.v1")
    for other in ["application/cbor;curionav.scores.v2", "application/cbor;curionav.scan.v1", "text/plain"]:
        with pytest.raises(DecodeError, match="encoding"):
            Scores.decode(data, other)


def test_a_refusal_of_a_later_version_reads_as_unknown() -> None:
    later = Reject.decode(cbor2.dumps({"field": "x", "why": {"code": "from_the_future", "found": 3}}))
    assert later == Reject(field="x", why={"code": "unknown"})


def test_a_refusal_says_in_codes_what_is_wrong_with_the_bytes() -> None:
    whole = golden("run_status")
    for data, encoding, why in [
        (whole + b"\x00", None, {"code": "malformed", "offset": len(whole), "fault": "trailing_bytes"}),
        (whole[:-1], None, {"code": "malformed", "offset": len(whole) - 1, "fault": "cut_short"}),
        (whole, "text/plain", {"code": "wrong_encoding", "found": "text/plain", "expected": RunStatus.encoding()}),
        (bytes(RunStatus.MAX_BYTES + 1), None,
         {"code": "oversize", "found": RunStatus.MAX_BYTES + 1, "most": RunStatus.MAX_BYTES}),
    ]:  # fmt: skip
        with pytest.raises(DecodeError) as error:
            RunStatus.decode(data, encoding)
        assert error.value.why == why
        validator("reject").validate_cbor(Reject(field=None, why=error.value.why).encode())


def test_numbers_and_scored_candidates_fit_together() -> None:
    report = CycleReport.decode(golden("cycle_report.explained"))
    for scored, total in [(report.scored[:-1], report.total), (report.scored, np.zeros(report.candidates.count))]:
        with pytest.raises(EncodeError) as error:
            replace(report, scored=scored, total=total).encode()
        assert error.value.field == "total"
    with pytest.raises(EncodeError) as error:
        replace(report, rejected=[]).encode()
    assert error.value.field == "rejected"


def test_an_unknown_kind_of_request_is_refused() -> None:
    with pytest.raises(DecodeError) as error:
        MissionCommand.decode(cbor2.dumps({"kind": "fly"}))
    assert error.value.field == "kind"


def people(**changes: Any) -> People:
    fields: dict[str, Any] = {
        "tick": 1,
        "stamp": 1,
        "frame": "map",
        "radius": 0.25,
        "id": [7, 8],
        "x": [1, 2],
        "y": np.array([3, 4]),
        "vx": np.zeros(2, np.float32),
        "vy": np.zeros(4)[::2],
    }
    return People(**{**fields, **changes})


def test_whole_numbers_are_written_as_the_floats_they_stand_for() -> None:
    data = people().encode()
    validator("people").validate_cbor(data)
    assert isinstance(cbor2.loads(data)["stamp"], float)
    assert People.decode(data).x.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"x": [1.0]}, "x"),
        ({"x": [1.0, np.nan]}, "x[1]"),
        ({"x": [[1.0, 2.0]]}, "x"),
        ({"x": ["a", "b"]}, "x"),
        ({"id": [0.5, 1.0]}, "id"),
        ({"id": [-1, 1]}, "id"),
        ({"stamp": True}, "stamp"),
        ({"stamp": None}, "stamp"),
        ({"tick": 1.0}, "tick"),
        ({"radius": -1.0}, "radius"),
    ],
)
def test_what_a_reader_would_refuse_is_not_sent(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(EncodeError) as error:
        people(**changes).encode()
    assert error.value.field == field


def test_numpy_values_in_free_form_parameters_become_plain_numbers() -> None:
    scenario = {"a": np.float32(0.5), "b": np.arange(3), "c": (1, [True])}
    request = InjectRequest(scenario=scenario, files={}, profile={}, clock="lockstep", time_scale=1)
    data = request.encode()
    validator("inject_request").validate_cbor(data)
    assert InjectRequest.decode(data).scenario == {"a": 0.5, "b": [0, 1, 2], "c": [1, [True]]}
    with pytest.raises(EncodeError) as error:
        replace(request, scenario={"a": [{"b": object()}]}).encode()
    assert error.value.field == "scenario.a[0].b"


def scan(beams: int = 181, step: float = np.pi / 180, **changed: Any) -> Scan:
    """A scan of a laser that says what it sees."""
    fields = {"range_min": 0.1, "range_max": 10.0, "laser": Pose(x=0.2, y=0.0, heading=0.0), **changed}
    ranges = fields.pop("ranges", np.full(beams, 3.0))
    return Scan(tick=0, stamp=0.0, angle_min=-1.5, angle_increment=step, ranges=ranges, **fields)


def test_a_scan_that_contradicts_itself_is_refused_with_the_numbers() -> None:
    for good in (scan(1, 0.0), scan(361), scan(361, -np.pi / 180), scan(range_min=None)):
        assert Scan.decode(good.encode()).range_min == good.range_min
    far = Pose(x=1e6, y=0.0, heading=0.0)
    contradictory: list[tuple[Callable[[], Scan], str]] = [
        (lambda: scan(181, 0.0), "181 beams that are 0 rad apart sweep 0 rad"),
        (lambda: scan(361, 1.0), "361 beams that are 1 rad apart sweep 360 rad"),
        (lambda: scan(laser=far), "laser.distance: 1000000 is not within 0 to 5"),
        (lambda: scan(range_min=10.0), "range_min: 10 is not within 0 to 10"),
        (lambda: scan(2, ranges=np.array([np.inf, 1.0])), "ranges[0]"),
        (lambda: scan(2, ranges=np.array([1.0, -1.0])), "ranges[1]"),
    ]
    for bad, said in contradictory:
        with pytest.raises(EncodeError) as error:
            bad().encode()
        assert said in str(error.value)


def test_a_range_that_is_no_number_says_nothing() -> None:
    sent = scan(6, 0.1, ranges=np.array([np.nan, 0.0, 0.05, 3.0, 10.0, 25.0]))
    read = Scan.decode(sent.encode())
    assert np.isnan(read.ranges[0]) and read.met().tolist() == [False, False, True, True, False, False]
