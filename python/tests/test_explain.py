"""Explanations say what the report says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from contract import golden

from curionav.explain import Explanation
from curionav.messages import CycleReport, Twist
from curionav.words import UNSEEN


def report(name: str) -> CycleReport:
    return CycleReport.decode(golden(name))


def test_words_and_table_say_what_the_report_says() -> None:
    explanation = Explanation(report("cycle_report.explained"))
    text = str(explanation)
    for line in (
        "Robot r1, cycle 14 at 4.2 s: follow candidate 9 (least cost).",
        "Of 3 candidates 2 were left to compare; 1 lack a score.",
        "It costs 0.8800. Candidate 12 would have been next, 0.0400 more expensive.",
        "Its cost is cnc 0.1400 + cpc 0.7400.",
        "- cnc (weight 1, scale 0.5; scored by its pool) alone would have chosen candidate 12.",
        "- cpc (weight 1, scale 0.5; scored in the arbiter, 1 not at all) alone would have chosen the same.",
        "- distance (weight 1, scale 0.5) did not count: its condition did not hold.",
        "With the weight of cnc doubled (1 to 2) it would have taken candidate 12.",
        "With the weight of cpc set to zero (1 to 0) it would have taken candidate 12.",
        "It would have taken the same with the weight of cnc halved, cnc set to zero, cpc doubled.",
        "Degraded: `cpc` was evaluated by the arbiter.",
    ):
        assert line in text.splitlines()
    rows = explanation.candidates()
    assert [(row.id, row.remark) for row in rows] == [(9, "chosen"), (12, "next"), (4, "not scored by `cpc`")]
    assert rows[0].terms == {"cnc": 0.14, "cpc": 0.74}
    assert (rows[2].cost, rows[2].raw["cpc"], rows[2].raw["cnc"]) == (None, None, 0.11)


def test_what_a_term_has_not_scored_comes_after_what_was_rejected_with_a_cost() -> None:
    explained = report("cycle_report.explained")
    wall = {"code": "hits_wall", "after_s": 1.0}
    crashed = replace(explained, rejected=[why or wall for why in explained.rejected])
    rows = Explanation(crashed).candidates()
    assert [(row.id, row.cost is None) for row in rows] == [(9, False), (12, False), (4, True)]


def test_candidates_rejected_for_one_reason_are_counted_together_whatever_its_figures() -> None:
    explained = report("cycle_report.explained")
    walls: list[dict[str, Any] | None] = [{"code": "hits_wall", "after_s": 0.1 * i} for i in range(3)]
    assert "Of 3 candidates 0 were left to compare; 3 run into walls." in str(
        Explanation(replace(explained, rejected=walls))
    )


def test_what_the_driver_does_is_said_with_how_long_it_has_done_it() -> None:
    explained = report("cycle_report.explained")
    twist = Twist(lease=1, epoch=1, seq=2, tick=3, stamp=4.0, v=0.1, omega=0.0, reason="too_close", since=3.2)
    line = "For 1.0 s the driver has done this: braking: something is too close."
    assert line in str(Explanation(replace(explained, driven=twist))).splitlines()
    assert "the driver" not in str(Explanation(replace(explained, driven=None)))


def test_what_is_special_about_this_projects_planner_is_said_in_words() -> None:
    explained = report("cycle_report.explained")
    scene, chosen = explained.scene, explained.chosen
    assert chosen is not None
    people = replace(
        scene.people,
        id=np.append(scene.people.id, np.uint32(UNSEEN)),
        x=np.append(scene.people.x, scene.belief.x + 0.3),
        y=np.append(scene.people.y, scene.belief.y + 0.4),
        vx=np.append(scene.people.vx, 0.0),
        vy=np.append(scene.people.vy, 0.0),
    )
    risk, beyond = explained.terms[0].raw.copy(), explained.terms[1].raw.copy()
    risk[chosen], beyond[chosen] = 0.032, 3.0
    terms = [
        replace(explained.terms[0], term="collision-risk", raw=risk),
        replace(explained.terms[1], term="information-to-go", raw=beyond),
        *explained.terms[2:],
    ]
    hits: dict[str, Any] = {"code": "hits_person", "person": UNSEEN, "after_s": 1.26}
    text = str(
        Explanation(
            replace(
                explained,
                scene=replace(scene, people=people, in_place_s=4.04, impatient=True),
                terms=terms,
                rejected=[hits if why else None for why in explained.rejected],
            )
        )
    )
    mean = 3.0 / explained.candidates.steps
    for line in (
        f"; {len(scene.people.id)} people are near.",
        "It also keeps clear of something unseen that the driver braked for, 0.5 m away.",
        "It has stayed in one place for 4.0 s.",
        "For a while, terms with `gives_way` count",
        "  Of the chosen candidate it says that the robot touches a person with a chance of 3.2 %.",
        f"  Of the chosen candidate it says that the way beyond it counts {mean:.2f} m longer,",
        "runs into something unseen that the driver braked for after 1.3 s",
    ):
        assert line in text, text
    assert str(UNSEEN) not in text


def test_a_report_without_what_ifs_is_no_reason_to_guess() -> None:
    explanation = Explanation(report("cycle_report"))
    assert explanation.what_if() == []
    assert explanation.alone() == {}
    assert "would have taken" not in str(explanation)
