"""Claims are read with care and judged by their figures."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from bench_rows import rows

from curionav.report import claim_files
from curionav.report.claims import Judged, judge
from curionav.report.comparison import Comparison
from curionav.report.measures import Row

PLANNERS = ["curiosity", "cpc-only", "cnc-only"]
SCENARIOS = ["env1-s1", "env1-s2"]
BEST = '[[claim]]\nkind = "best"\nplanner = "curiosity"\nmeasure = "td"\n'
BETTER = '[[claim]]\nkind = "better"\nplanner = "curiosity"\nthan = "cpc-only"\nmeasure = "td"\n'
BOUND = '[[claim]]\nkind = "bound"\nplanner = "curiosity"\nmeasure = "td"\nat_most = 0.041\n'
SUCCESS = '[[claim]]\nkind = "success"\nplanner = "curiosity"\nat_least = 1.0\n'
OFTEN = '[[claim]]\nkind = "as-often"\nplanner = "curiosity"\n'


def judged(text: str, runs: list[Row]) -> list[Judged]:
    return judge(tomllib.loads(text)["claim"], Comparison(PLANNERS, SCENARIOS, [0, 1], runs), 10)


def holds(text: str, runs: list[Row]) -> bool:
    return judged(text, runs)[0].holds


def both(td: Callable[[int, int], float]) -> list[Row]:
    """Runs in two scenarios; TD by planner and seed."""
    return [run for scenario in SCENARIOS for run in rows(scenario, PLANNERS, td)]


def good() -> list[Row]:
    return both(lambda p, seed: 0.1 * p + 0.001 * seed)


def test_each_kind_of_claim_is_judged_by_its_figures() -> None:
    bad = both(lambda p, _: 0.3 - 0.1 * p)
    assert holds(BEST, good()) and not holds(BEST, bad)
    assert holds(BOUND, good()) and not holds(BOUND, bad)
    assert judged(BOUND, bad)[0].found == "in 0; not env1-s1: 30.00 %; env1-s2: 30.00 %"
    near = BOUND.replace("curiosity", "cpc-only").replace("0.041", "25.0") + "of_best = true\n"
    assert holds(near, good()) and not holds(near.replace("25.0", "1.0"), good())
    hit = good()
    hit[0]["measures"]["collisions"] = 2
    assert holds(SUCCESS, good()) and not holds(SUCCESS, hit)
    assert holds(OFTEN, good()) and not holds(OFTEN, hit)
    assert not holds(f'{OFTEN}than = "cnc-only"', hit)
    assert judged(f'{OFTEN}than = "cpc-only"', hit)[0].found == "19 of 20 runs, against 20 of `cpc-only`"
    assert holds(OFTEN.replace("curiosity", "cpc-only"), hit)


def test_a_tie_is_no_win_unless_the_claim_says_so() -> None:
    tied = both(lambda _, seed: 0.001 * seed)
    assert not holds(BEST, tied)
    assert holds(f"{BEST}or_tied = true", tied)
    assert not holds(BETTER, tied)


@pytest.mark.parametrize("claim", [SUCCESS, OFTEN, BOUND, BEST])
def test_runs_that_are_missing_make_a_claim_fail(claim: str) -> None:
    fewer = [run for run in good() if run["scenario"] == "env1-s1"]
    assert holds(claim, good()) and not holds(claim, fewer) and not holds(claim, [])
    assert judged(f"{BETTER}p = 0.5", [])[0].found == "no pair of runs"


def test_places_are_the_units_and_every_test_of_the_file_counts() -> None:
    # Two places can have no p below 0.5, however many runs each has.
    assert not holds(BETTER, good()) and holds(f"{BETTER}p = 0.6\n", good())
    assert judged(BETTER, good())[0].verdict == "cannot be shown"
    # Two tests: 2 * 0.5.
    two = judged(f"{BETTER}p = 0.6\n" * 2, good())
    assert all(not one.holds and "p = 1.0000 by Holm of 2 places" in one.found for one in two)
    assert judged(BETTER, good())[0].found.endswith(
        "so in 2 of 2 scenarios that differ; p = 0.5000 by Holm of 2 places, which can give no p below 0.5; "
        "p < 0.0001 of the runs in these; in seconds \u22122.50 s, \u22122.50 to \u22122.50"
    )


def test_a_claim_about_a_share_of_the_run_has_the_seconds_beside_it() -> None:
    # A third as much of a run that takes ten times as long.
    slow = both(lambda p, _: [0.1, 0.3, 0.5][p])
    for run in slow:
        run["measures"]["time_s"] = 100.0 if run["planner"] == "curiosity" else 10.0
    assert judged(BETTER, slow)[0].found.endswith("; in seconds +7.00 s, 7.00 to 7.00")
    best = judged(BEST, slow)[0]
    assert best.holds
    found = "; by the seconds in 0; not env1-s1: 10.00 s against 3.00 s of `cpc-only`; env1-s2: 10.00 s against "
    assert best.found == f"in 2{found}3.00 s of `cpc-only`"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SUCCESS.replace("curiosity", "x"), ":1: claim 1: the planner `x` is not run; it is one of curiosity, cpc"),
        (SUCCESS.replace("1.0", "90"), "`at_least` is a share of the runs, 0 to 1"),
        (SUCCESS.replace("1.0", '"all"'), "`at_least` must be a number, not 'all'"),
        (OFTEN + BEST.replace('"td"', '"tdd"'), ":4: claim 2: `tdd` is no measure; it is one of success, rmse_m"),
        (BOUND.replace("at_most = 0.041", ""), "give `at_most`, `at_least` or both"),
        (f"{BEST}scenarios = 14", "`scenarios` must be 1 to 13, the number of scenarios that are run"),
        (f"{BEST}scenarios = true", "`scenarios` must be a whole number, not True"),
        (f"{BETTER}p = 1.0", "`p` is a probability below 1"),
        (f"{BEST}tied = true", "`tied` is no field of the kind `best`, which has planner, measure, or_tied, scenarios"),
        ('[[claim]]\nkind = "best"\nplanner = "curiosity"', "`measure` is missing; the kind `best` needs planner, m"),
        ('[[claim]]\nkind = "won"', "`won` is no kind of claim; it is one of success, as-often"),
        ("[[claim]]", "`kind` is missing; it is one of success"),
        ('[[claims]]\nkind = "won"', "has tables `[[claim]]` and nothing else, not `claims`"),
        ("[[claim]\n", "(at line 1"),
    ],
)
def test_a_wrong_claim_is_refused_with_file_line_field_and_mend(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "claims.toml"
    file.write_text(text)
    with pytest.raises(ValueError) as refused:
        claim_files.read(file, claim_files.Known(PLANNERS, 13))
    assert str(refused.value).startswith(str(file)) and words in str(refused.value)
