"""All sentences come from one table, and Rust makes the same ones of it."""

from __future__ import annotations

import json
from typing import Any, get_args

import cbor2
import pytest
from contract import ROOT, SCHEMAS

import curionav
from curionav.messages import (
    CborFault,
    CommandReason,
    CycleReport,
    Decision,
    Degradation,
    Mission,
    MissionEnd,
    PreviousState,
    Reason,
    Refusal,
    Reject,
    Rejection,
    Twist,
)
from curionav.words import families, say, say_all

SENTENCES: list[dict[str, Any]] = cbor2.loads((SCHEMAS / "golden" / "sentences.cbor").read_bytes())


def test_the_table_is_the_one_of_the_contract() -> None:
    ours = ROOT / "python" / "src" / "curionav" / "words.toml"
    assert ours.resolve() == SCHEMAS / "words.toml"


@pytest.mark.parametrize("sentence", SENTENCES, ids=lambda s: f"{s['family']}-{code(s['reason'])}")
def test_a_sentence_is_the_same_as_in_rust(sentence: dict[str, Any]) -> None:
    assert say(sentence["family"], sentence["reason"]) == sentence["said"]


def code(reason: Any) -> str:
    found: str = reason if isinstance(reason, str) else reason["code"]
    return found


def test_every_code_of_the_table_has_a_sentence_there() -> None:
    shown: dict[str, set[str]] = {}
    for sentence in SENTENCES:
        shown.setdefault(sentence["family"], set()).add(code(sentence["reason"]))
    # Codes of several candidates are those of one; sentences of an explanation are no codes of the contract.
    ours = {family: families()[family] for family in ("explanation", "evaluated", "person", "term_meaning")}
    assert shown | {"rejections": shown["rejection"]} | ours == families()


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (1.0, "1"),
        (-0.0, "-0"),
        (0.1, "0.1"),
        (2.5, "2.5"),
        (1e-4, "0.0001"),
        (1e-5, "1e-5"),
        (1.5e-7, "1.5e-7"),
        (1e-12, "1e-12"),
        (123456789012345.0, "123456789012345"),
        (1e15, "1000000000000000"),
        (1e16, "1e16"),
        (1.25e20, "1.25e20"),
        (100.0, "100"),
    ],
)
def test_a_number_has_the_shortest_form_as_in_rust(number: float, said: str) -> None:
    assert say("refusal", {"code": "not_positive", "found": number}) == f"{said} is not greater than 0"


def test_a_code_without_words_is_its_own_word() -> None:
    assert say("reason", "of_next_year") == say("reason", {"code": "of_next_year", "x": 1}) == "of_next_year"
    assert say("no_such_family", {"code": "arrived"}) == "arrived"
    assert say_all("degradation", []) == ""
    told = say_all("degradation", [{"code": "cut_short"}, {"code": "not_evaluated", "term": "smooth"}])
    assert told == "a tree was cut short by the budget; `smooth` was not evaluated"


CODED: dict[str, Any] = {
    "reason": Reason,
    "previous": PreviousState,
    "rejection": Rejection,
    "degradation": Degradation,
    "end": MissionEnd,
    "refusal": Refusal,
}
"""Families whose codes have parameters, by what a field may hold."""


@pytest.mark.parametrize("family", CODED)
def test_the_messages_know_every_code_with_its_parameters(family: str) -> None:
    (coded,) = CODED[family].__metadata__
    assert set(coded.codes) == families()[family]
    for sentence in (s for s in SENTENCES if s["family"] == family):
        read = coded.take(sentence["reason"], curionav.field_types.Scope({}))
        assert coded.give(read, curionav.field_types.Scope({})) == sentence["reason"]
        assert say(family, read) == sentence["said"]


def test_the_messages_know_every_code_without_parameters() -> None:
    assert set(get_args(CborFault)) == families()["fault"]
    assert set(get_args(CommandReason)) == families()["command_reason"]


def test_the_reasons_of_golden_messages_can_be_said() -> None:
    golden = SCHEMAS / "golden"
    decision = Decision.decode((golden / "decision.cbor").read_bytes())
    report = CycleReport.decode((golden / "cycle_report.explained.cbor").read_bytes())
    twist = Twist.decode((golden / "twist.cbor").read_bytes())
    refused = Mission.decode((golden / "mission.refused.cbor").read_bytes())
    reject = Reject.decode((golden / "reject.cbor").read_bytes())
    said = [
        say("reason", decision.reason),
        *(say("rejection", why) for why in report.rejected if why),
        say("command_reason", twist.reason),
        say("end", refused.end),
        say("refusal", reject.why),
    ]
    for sentence in said:
        assert " " in sentence or sentence in ("tracking", "arrived"), said
        assert "{" not in sentence
    # A refusal inside a reason is said with its field.
    assert refused.end is not None
    assert f"{refused.end['reject'].field}: " in say("end", refused.end)


def test_the_table_and_the_profiles_are_shipped() -> None:
    built_in = json.loads((ROOT / "python" / "src" / "curionav" / "profiles.json").read_text())
    assert built_in == curionav.profiles.BUILT_IN
