"""Explanations say what the report says."""

from __future__ import annotations

from dataclasses import replace

from contract import golden

from curionav.explain import Explanation
from curionav.messages import CycleReport


def report(name: str) -> CycleReport:
    return CycleReport.decode(golden(name))


def test_words_and_table_say_what_the_report_says() -> None:
    explanation = Explanation(report("cycle_report.explained"))
    text = str(explanation)
    for line in (
        "Robot r1, cycle 14 at 4.2 s: follow candidate 9 (least cost).",
        "Of 3 candidates 2 were left to compare; 1 not scored by `cpc`.",
        "Candidate 12 would have been next, 0.0400 dearer.",
        "- cnc alone would have chosen candidate 12.",
        "With the weight of cnc doubled it would have taken candidate 12.",
        "It would have taken the same with the weight of cnc halved, cnc set to zero, cpc doubled.",
    ):
        assert line in text.splitlines()
    rows = explanation.candidates()
    assert [(row.id, row.remark) for row in rows] == [(9, "chosen"), (12, "next"), (4, "not scored by `cpc`")]
    assert rows[0].terms == {"cnc": 0.14, "cpc": 0.74}
    assert (rows[2].cost, rows[2].raw["cpc"], rows[2].raw["cnc"]) == (None, None, 0.11)


def test_what_a_term_has_not_scored_comes_after_what_was_rejected_with_a_cost() -> None:
    # Their totals are 0: by cost alone they would lead the rejected.
    explained = report("cycle_report.explained")
    crashed = replace(explained, rejected=[why or "hits a wall" for why in explained.rejected])
    rows = Explanation(crashed).candidates()
    assert [(row.id, row.cost is None) for row in rows] == [(9, False), (12, False), (4, True)]
    assert explained.total[explained.candidates.id == 4] == 0.0


def test_a_report_of_an_older_arbiter_is_no_reason_to_guess() -> None:
    explanation = Explanation(report("cycle_report"))
    assert explanation.what_if() == []
    assert explanation.alone() == {}
    assert "would have taken" not in str(explanation)
