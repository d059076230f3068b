"""The figures of `curionav.report`: those of stored benches to the last word, and by hand."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from bench_rows import bench, row, rows

from curionav.report import statistics
from curionav.report.comparison import Comparison, Order, published
from curionav.report.measures import (
    CLEARANCE,
    LENGTH,
    MD,
    NT,
    PAPER,
    RMSE,
    SUCCESS,
    TD,
    TIME,
    VEL,
    blame,
    overlaps,
    tally,
)
from curionav.report.words import SLIPS

DATA = Path(__file__).parent / "data" / "bench"
SUITES = ["paper", "open", "rooms", "dense"]
AFTER_CLAIMS = "What to know before believing it"


def near(value: Any) -> Any:
    """The value with its numbers to twelve digits: who stored them had read the journal's last digit with less care."""
    if isinstance(value, dict):
        return {key: near(part) for key, part in value.items()}
    if isinstance(value, list):
        return [near(part) for part in value]
    return pytest.approx(value, rel=1e-12, abs=1e-12) if isinstance(value, float) else value


def told(page: str) -> list[str]:
    """The rows of all tables of a report, and the sentences before them."""
    first, title, rest = page.partition(AFTER_CLAIMS)
    page = first + title + re.sub(r"<li>.*?</li>", "", rest, flags=re.DOTALL)
    parts = re.findall(r"<(?:tr|li)>(.*?)(?=<(?:tr|li)>|</(?:tbody|thead|ul)>)", page, re.DOTALL)
    return [" ".join(html.unescape(re.sub(r"<[^>]*>", " ", part)).split()) for part in parts]


@pytest.mark.parametrize("suite", SUITES)
def test_every_figure_and_verdict_of_a_stored_bench_comes_out_again(tmp_path: Path, suite: str) -> None:
    folder = tmp_path / suite
    shutil.copytree(DATA / suite, folder)
    expected = json.loads((folder / "summary.json").read_text())
    command = [sys.executable, "-m", "curionav.report", str(folder)]
    done = subprocess.run(command, cwd=DATA, capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (1, ""), "some claims do not hold"
    verdicts = [line.partition(":")[0] for line in done.stdout.splitlines()]
    assert verdicts.count("holds") == sum(claim["holds"] for claim in expected["claims"])
    assert len(verdicts) == len(expected["claims"]) + 1
    found = json.loads((folder / "summary.json").read_text())
    for key in expected:
        assert found[key] == (near(expected[key]) if key in {"cells", "timing"} else expected[key]), key
    assert told((folder / "report.html").read_text()) == (DATA / suite / "report.txt").read_text().splitlines()


def test_runs_that_gave_up_have_a_column_if_there_are_any(tmp_path: Path) -> None:
    folder = tmp_path / "rooms"
    shutil.copytree(DATA / "rooms", folder)
    journal = folder / "journal.jsonl"
    first, rest = journal.read_text().split("\n", 1)
    given_up = first.replace('"outcome":"reached"', '"outcome":"no_way"')
    assert given_up != first
    journal.write_text(f"{given_up}\n{rest}")
    command = [sys.executable, "-m", "curionav.report", str(folder)]
    subprocess.run(command, cwd=DATA, capture_output=True, timeout=300, check=False)
    page = (folder / "report.html").read_text()
    assert "<th>no way</th>" in page and "No way: obstacles" in page
    summary = json.loads((folder / "summary.json").read_text())
    assert sum(cell["runs"]["no_way"] for cell in summary["cells"]) == 1


def test_people_in_view_have_a_table_if_any_run_tells_them_apart(tmp_path: Path) -> None:
    folder = tmp_path / "rooms"
    shutil.copytree(DATA / "rooms", folder)
    journal = folder / "journal.jsonl"
    told_apart = journal.read_text().replace('"nt":', '"td_in_view":0.0125,"md_in_view_m":3.21,"nt":')
    journal.write_text(told_apart)
    command = [sys.executable, "-m", "curionav.report", str(folder)]
    subprocess.run(command, cwd=DATA, capture_output=True, timeout=300, check=False)
    page = (folder / "report.html").read_text()
    assert "<th>TD in view (%), mean</th><th>TD (%), mean</th>" in page
    assert "<td>1.25</td>" in page and "<td>3.21</td>" in page
    stored = json.loads((DATA / "rooms" / "summary.json").read_text())
    assert json.loads((folder / "summary.json").read_text()) == near(stored), "nothing else changes"


def compared(runs: list[dict[str, Any]], planners: list[str], places: dict[str, int]) -> Comparison:
    return bench(runs, planners, places).comparison


def test_pairs_share_scenario_and_seed() -> None:
    # The first is better by 0.01 in every pair, though the seeds differ by far more.
    runs = rows("x", ["a", "b"], lambda p, seed: 0.05 * seed + 0.01 * p)
    comparison = compared([run for run in runs if run["planner"] == "a" or run["seed"] > 1], ["a", "b"], {"x": 0})
    paired = comparison.paired(TD, 0, 1)
    assert paired is not None and comparison.paired(TD, 0, 1, 0) is not None
    assert paired.pairs == 9 and paired.difference == pytest.approx(-0.01) and paired.p < 0.01
    spread = comparison.spread(TD, 0, 0)
    assert spread is not None and spread.mean == pytest.approx(0.275) and spread.low < spread.mean < spread.high


def test_scenes_in_one_place_are_one_sample_of_places() -> None:
    # Nine scenes of one hall in which the first is better by 0.3, and one of another in which it is worse by 0.1.
    scenes = [f"s{scene}" for scene in range(10)]
    runs = [run for scene in scenes[:9] for run in rows(scene, ["a", "b"], lambda p, _: 0.5 + 0.3 * p)]
    runs += rows("s9", ["a", "b"], lambda p, _: 0.5 - 0.1 * p)
    apart = compared(runs, ["a", "b"], dict(zip(scenes, range(10), strict=True))).paired(TD, 0, 1)
    assert apart is not None and (apart.units, apart.unit) == (10, "place") and apart.p < 0.01
    # (0.3 - 0.1) / 2 = 0.1 in two places, which agree on nothing.
    halls = compared(runs, ["a", "b"], {scene: int(scene == "s9") for scene in scenes}).paired(TD, 0, 1)
    assert halls is not None and halls.difference == pytest.approx(-0.1) and halls.low < -0.29 and halls.high > 0.09
    assert (halls.units, halls.p, halls.agree, halls.differ) == (2, 1.0, 9, 10)
    # In a single place scenes are what there is.
    one = compared(runs, ["a", "b"], dict.fromkeys(scenes, 0)).paired(TD, 0, 1)
    assert one is not None and (one.units, one.unit) == (10, "scenario")


def test_rounding_is_no_difference_and_the_other_way_round_has_the_same_bounds() -> None:
    # 0.1 + 0.2 is not 0.3 to the last bit: zeros and ties would be neither.
    by = [0.0, 0.1 + 0.2 - 0.3, 0.0, 0.1, -0.1, 0.3 - 0.2, 0.0, 0.0, 0.0, 0.0]
    runs = rows("x", ["a", "b"], lambda p, seed: 0.5 if p else 0.5 + by[seed - 1])
    comparison = compared(runs, ["a", "b"], {"x": 0})
    there = comparison.paired(TD, 0, 1)
    back = comparison.paired(TD, 1, 0)
    assert there is not None and back is not None
    # Ranks 2, 2 and 2, one of them against: both tails of two or more of three.
    assert (there.nonzero, there.units, there.p) == (3, 10, 1.0)
    assert (there.low, there.high, there.difference) == (-back.high, -back.low, -back.difference)


def test_success_is_compared_as_other_measures_are() -> None:
    runs = rows("x", ["a", "b"], lambda _p, _s: 0.0)
    for run in runs:
        run["outcome"] = "timeout" if run["planner"] == "b" and run["seed"] > 4 else "reached"
    paired = compared(runs, ["a", "b"], {"x": 0}).paired(SUCCESS, 0, 1)
    # Six of ten seeds differ, all in one direction: 2 / 2^6.
    assert paired is not None and (paired.difference, paired.p, paired.pairs) == (0.6, 0.03125, 10)
    assert SUCCESS.prefers(1.0, 0.4) and MD.prefers(2.0, 1.0) and VEL.prefers(0.9, 0.8)
    assert not RMSE.prefers(0.3, 0.2) and not TD.prefers(0.1, 0.1)


def test_a_run_that_did_not_arrive_has_no_length_but_counts_otherwise() -> None:
    runs = rows("x", ["a"], lambda _p, _s: 0.0)
    runs[0]["outcome"] = "timeout"
    comparison = compared(runs, ["a"], {"x": 0})
    spreads = [comparison.spread(measure, 0, 0) for measure in (LENGTH, TD)]
    assert [spread.runs for spread in spreads if spread] == [9, 10]


def test_the_order_is_compared_where_the_paper_has_one() -> None:
    # Env1 S1 prints TD 0, 2.28, 6.78 % for these; here the last two are swapped.
    planners = ["curiosity", "cpc-only", "cnc-only"]
    comparison = compared(rows("env1-s1", planners, lambda p, _: [0.0, 0.3, 0.2][p]), planners, {"env1-s1": 0})
    assert comparison.order(TD, 0) == Order(agree=2, tied=0, pairs=3)
    assert comparison.is_best(TD, 0, 0) and not comparison.is_best(TD, 0, 2)
    assert all(comparison.is_best(RMSE, 0, p) for p in range(3)), "all tied"


def test_a_run_with_a_collision_arrived_but_is_no_success() -> None:
    runs = [row("a", "b", seed) for seed in (1, 2, 3)]
    runs[0]["measures"]["collisions"] = 3
    runs[1]["cycles"]["other_choice"] = {"no_candidates": 9}
    runs[2]["outcome"] = "lost"
    counts = tally(runs)
    assert [counts[key] for key in ("runs", "success", "reached", "lost", "collided", "contacts")] == [3, 1, 2, 1, 1, 3]
    assert [counts[key] for key in ("cycles", "first_choices", "other_free", "no_candidates", "untold")] == [
        3 * 83, 3 * 70, 2 * 13, 9, 4,
    ]  # fmt: skip


def test_who_is_faster_towards_the_other_walks_into_the_other() -> None:
    speeds = [(1, 0.5, 0.4), (1, 0.3, 0.4), (1, -0.1, 0.4), (None, 0.2, 0.0)]
    contacts = [{"person": person, "robot_mps": own, "person_mps": other} for person, own, other in speeds]
    assert blame([{"contacts": contacts}]) == {"walls": 1, "robot": 1, "person": 1, "run_down": 1}


def test_overlaps_are_added_up_over_runs_and_older_runs_have_none() -> None:
    told = {"social": {"overlaps_standing_behind": 2.0, "overlaps_moving_ahead": 1.0, "spl": 1.0}}
    counts = overlaps([told, told, {"social": {}}, {}])
    assert counts == {
        "overlaps_standing_ahead": 0, "overlaps_standing_beside": 0, "overlaps_standing_behind": 4,
        "overlaps_moving_ahead": 2, "overlaps_moving_beside": 0, "overlaps_moving_behind": 0,
    }  # fmt: skip


def test_values_are_shown_with_their_units_and_zero_has_no_sign() -> None:
    assert [TD.show(0.0412), LENGTH.show(40.0), TD.show(-1e-9)] == ["4.12", "40.00", "0.00"]
    assert [TD.show_with_unit(0.05), NT.show_with_unit(1.0)] == ["5.00 %", "1.0"]
    assert CLEARANCE.show(-0.25) == "\u22120.25"


PLANNERS = ["curiosity", "cpc-only", "cnc-only", "risk-rrt", "bi-risk-rrt"]
SCENARIOS = [f"env{hall}-s{scene}" for hall in range(1, 5) for scene in range(1, 4)] + ["env3-sx"]


def test_the_papers_cells_are_where_it_has_them_and_per_cents_are_fractions() -> None:
    cell = published(TD, "curiosity", "env2-s3")
    assert cell is not None and [cell.mean, cell.sd] == pytest.approx([0.0404, 0.012])
    cells = [(NT, "risk-rrt", "env2-s1"), (LENGTH, "bi-risk-rrt", "env4-s2"), (VEL, "transient-goal", "env4-s3")]
    assert [found.mean for cell in cells if (found := published(*cell))] == [10.0, 40.93, 0.69]
    assert published(TIME, "human-space", "env4-s3") is None
    assert published(TD, "distance-only", "env4-s2") is None
    assert published(CLEARANCE, "curiosity", "env4-s2") is None


def test_exactly_the_marked_speeds_of_the_paper_disagree_with_length_and_time() -> None:
    disagree = 0
    for planner in PLANNERS:
        for scenario in SCENARIOS:
            cells = [published(measure, planner, scenario) for measure in PAPER]
            assert all(cell is not None and cell.slip in {"", *SLIPS} for cell in cells)
            vel, length, time = (cell for cell in cells[6:] if cell is not None)
            is_off = abs(length.mean / time.mean / vel.mean - 1.0) > 0.05
            assert is_off == bool(vel.slip or length.slip), (planner, scenario)
            disagree += is_off
    assert disagree == 8


def test_a_share_that_was_always_found_is_not_certain() -> None:
    # All of ten: from 1 / (1 + 1.96^2 / 10) = 0.7225; half of a hundred: 0.4038 to 0.5962.
    assert statistics.share_interval(10, 10) == pytest.approx((0.7225, 1.0), abs=1e-4)
    assert statistics.share_interval(50, 100) == pytest.approx((0.4038, 0.5962), abs=1e-4)
    assert statistics.share_interval(0, 0) is None


def test_spread_is_that_of_a_sample() -> None:
    # Mean 5, squares 9 + 1 + 1 + 9 = 20, over 3.
    assert statistics.standard_deviation([2.0, 4.0, 6.0, 8.0]) == pytest.approx((20.0 / 3.0) ** 0.5)
    assert statistics.standard_deviation([3.0]) == 0.0 and statistics.standard_deviation([]) is None
    assert [statistics.median(values) for values in ([3.0, 1.0, 99.0], [4.0, 1.0, 2.0, 99.0], [])] == [3.0, 3.0, None]


def test_many_runs_of_few_scenes_do_not_make_a_mean_certain() -> None:
    # Ten runs in each of four scenes that differ: what counts is the spread of the scenes.
    scenes = [[scene + 0.001 * run for run in range(10)] for scene in range(4)]

    def width(places: list[list[list[float]]]) -> float:
        low, high = statistics.cluster_interval(places, 3) or (0.0, 0.0)
        return high - low

    # The deviation of the mean: sqrt(1.25 / 4) = 0.56 by scene, sqrt(1.25 / 40) = 0.18 by run.
    by_scene = width([scenes])
    assert by_scene > 1.8 and width([[[value for scene in scenes for value in scene]]]) < 0.8
    # As two places of two scenes each, 0.5 and 2.5: sqrt(1 / 2 + 0.25 / 4) = 0.75.
    assert width([scenes[:2], scenes[2:]]) > 1.1 * by_scene
    assert statistics.cluster_interval([[], [[], [2.0]]], 1) == (2.0, 2.0)
    assert statistics.mean_interval([0.3, 0.3, 0.3], 1) == (0.3, 0.3) and statistics.mean_interval([], 1) is None


def test_a_signed_rank_test_agrees_with_textbook_and_scipy() -> None:
    # Depression scores of nine patients (Hollander and Wolfe); R gives V = 40, p = 0.03906.
    before = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
    after = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]
    differences = [b - a for b, a in zip(before, after, strict=True)]
    assert statistics.signed_rank(differences) == pytest.approx(0.0390625)
    # Ties and zeros, as counting every sign gives it.
    tied = [1.0, 1.0, 2.0, -2.0, 3.0, -1.0, 4.0, 4.0, -5.0, 0.0, 0.0, 6.0]
    assert statistics.signed_rank(tied) == pytest.approx(0.23828125)
    # 396 of 400 differences are not zero; SciPy gives 7.992403732131257e-10 for the same.
    many = [((i * 37) % 101 - 40) / 10.0 for i in range(400)]
    assert statistics.signed_rank(many) == pytest.approx(7.992403732131257e-10, rel=1e-9)
    assert statistics.signed_rank([0.0, 0.0]) == 1.0 and statistics.signed_rank([]) is None
