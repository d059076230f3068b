"""report.html as its readers see it."""

from __future__ import annotations

import numpy as np
from bench_rows import bench, row, rows

from curionav.report import density, short
from curionav.report.charts import outline, thinned
from curionav.report.claims import Judged
from curionav.report.figures import Course, draw
from curionav.report.page import FIGURES_BYTES, Page, render
from curionav.report.summary import Bench

PAPERS = ["curiosity", "cpc-only", "cnc-only"]
CLAIM = Judged(claim="`a` wins", found="it <did> not", about="TD (%)")


def made(planners: list[str]) -> Bench:
    runs = rows("env2-s2", planners, lambda p, seed: 0.1 * p + 0.001 * seed)
    return bench(runs, planners, {"env2-s2": 0})


def test_the_page_needs_nothing_else_and_marks_the_papers_slips() -> None:
    page = render(made(PAPERS), [CLAIM])
    assert "<script" not in page and "<link" not in page and "src=" not in page
    # 35.00 m of the paper cannot be.
    assert "35.00\u00b10.96<sup>a</sup>" in page and "above the robot&#39;s top speed" in page
    assert page.startswith("<!DOCTYPE html>\n") and page.endswith("</html>\n")
    assert "0 of 1 hold" in page and "<code>a</code> wins" in page and "&lt;did&gt;" in page
    assert "How people are known: tracked." in page and "seeds 1 to 10" in page and "30 runs" in page
    first = page.split("How the runs ended")[0]
    assert "TD 3 of 3" in first, "the paper's order is on the first page"


def test_scenes_are_told_apart_by_kind_where_there_are_several() -> None:
    places = {"door-1": 0, "door-2": 0, "hall-1": 1}
    runs = [run for scene in places for run in rows(scene, ["a", "b"], lambda _p, _s: 0.1)]
    for run in runs:
        run["outcome"] = "timeout" if run["scenario"] == "door-2" else "reached"
    page = render(bench(runs, ["a", "b"], places), [])
    cells = "".join(f'<td>{done}</td><td class="sd">{failed}</td>' for done, failed in KINDS)
    assert page.count(cells) == 2
    assert "in the paper</h2>" not in page
    assert "By kind of scene" not in render(made(["a", "b"]), [])


def test_all_overlaps_stand_beside_the_collisions_and_social_measures_have_a_table() -> None:
    planners = ["a", "b"]
    runs = rows("hall-1", planners, lambda _p, _s: 0.1)
    for run in runs:
        if run["planner"] == "b":
            run["measures"]["collisions"] = 1
            run["social"] |= {"overlaps_standing_behind": 2.0, "overlaps_moving_ahead": 1.0, "group_intrusions": 3.0}
    page = render(bench(runs, planners, {"hall-1": 0}), [])
    # Ten runs: collisions, then standing ahead, beside and behind, then moving.
    cells = "".join(f"<td>{number}</td>" for number in (10, 0, 0, 20, 10, 0, 0))
    assert cells in page.split("All overlaps of bodies")[1].split("</table>")[0]
    social = page.split("Social navigation</h2>")[1].split("</table>")[0]
    assert "<td>3.00</td>" in social and "group intrusions, mean" in social


KINDS = [("10 of 20", "10, 0, 0"), ("10 of 10", "0, 0, 0")]


def test_the_first_lines_say_how_it_went_and_how_far_that_reaches() -> None:
    planners = ["curiosity", "cpc-only", "distance-only"]
    places = {"void-1": 0, "room-1": 1, "room-2": 2}
    runs = [run for scene in places for run in rows(scene, planners, lambda p, _: 0.2 - 0.1 * p)]
    for run in runs:
        # Everything ends well but for `curiosity` in eight of ten runs in the void and in one of a room.
        fails = run["seed"] > 2 if run["scenario"] == "void-1" else run["scenario"] == "room-1" and run["seed"] == 1
        if fails and run["planner"] == "curiosity":
            run["outcome"] = "timeout"
        run["measures"]["time_s"] = 30.0 if run["planner"] == "cpc-only" else 40.0
    assert short.sentences(Page(bench(runs, planners, places), [CLAIM])) == [
        "`curiosity` reached the goal without a collision in 21 of 30 runs (95 %, if runs were independent: 52 to 83 "
        "%). Of the other 2 planners, 2 did so more often and 0 as often; the most is 30 of `cpc-only`. By the paired "
        "tests below, with p < 0.01, it can be told from chance for 0 of them, and with so few places that differ no "
        "result could be.",
        "Of its 9 failures, 8 are in scenes of the kind void, where it has 2 of 10 runs and the others 10 "
        "(`cpc-only`) to 10 (`cpc-only`). Without these, its worst, it has 19 of 20, and 2 of the others have more.",
        "In pairs of runs in which both arrived, 1 of the others took less time than it on the mean (0 with p < "
        "0.01); `cpc-only` arrived 10.0 s sooner (21 pairs, mean over 3 places).",
        "It was nearer than 1.5 m to people for 8.0 s per run (mean of all runs, also of those that failed); 2 of the "
        "others for less, and the least of the others is 0.0 s (`distance-only`).",
        "Of 1 claim written down before, 0 hold: 0 of 1 about TD (%) of the run.",
        "All scenes are in 3 places. That is too few to show anything for other places, however many runs there are: "
        "all of this holds for these places.",
    ]


def test_names_cannot_break_the_page() -> None:
    page = render(made(["<img src=x>", "b&c"]), [])
    assert "<img" not in page and "b&amp;c" in page


def test_one_planner_alone_is_a_page_too() -> None:
    assert "Table III" in render(made(["curiosity"]), [])


def at_densities(successes: list[int], people_per_m2: list[float]) -> density.Densities | None:
    """Two scenes at each of three densities; planner `a` succeeds in so many of ten runs at each."""
    places = {f"s{scene}": scene for scene in range(6)}
    runs = [row(scene, "a", seed) for scene in places for seed in range(5)]
    for run in runs:
        run["outcome"] = "lost" if 2 * run["seed"] >= successes[int(run["scenario"][1]) // 2] else "reached"
    return density.Densities.of(bench(runs, ["a"], places).comparison, people_per_m2)


SIX = [0.1, 0.1004, 0.2, 0.1996, 0.4, 0.4]


def test_half_is_met_between_two_densities_or_beyond_all_of_them() -> None:
    found = at_densities([10, 8, 2], SIX)
    assert found is not None
    assert found.levels == [0.1, 0.2, 0.4]
    assert [runs["success"] for runs in found.tallies[0]] == [10, 8, 2] and found.tallies[0][1]["runs"] == 10
    # From 0.8 at 0.2 to 0.2 at 0.4.
    halves = [at_densities(successes, SIX) for successes in ([10, 8, 2], [4, 8, 8], [10, 8, 6])]
    assert [found.half(0) for found in halves if found] == ["0.30", "below 0.1", "above 0.4"]


def test_a_density_with_one_scene_says_nothing_of_densities() -> None:
    assert at_densities([10, 8, 2], [0.1, 0.1, 0.2, 0.2, 0.4, 0.5]) is None
    assert at_densities([10, 8, 2], [0.1] * 6) is None


def test_a_picture_of_many_long_runs_stays_small() -> None:
    random = np.random.default_rng(1)
    runs = [row("hall", f"planner-{p}", seed) for p in range(13) for seed in range(1, 11)]
    for run in runs:
        run["way"] = np.cumsum(random.normal(0.1, 0.2, (120, 2)), axis=0).round(2).tolist()
    crowd = bench(runs, [f"planner-{p}" for p in range(13)], {"hall": 0})
    picture = Page(crowd, []).figure(0)
    assert picture.count('<path class="f c') == 13 and picture.count('<path class="w c') == 13
    # 105 of these are 1.7 MB.
    scenario = crowd.made["scenarios"][0]
    courses = [Course([np.array(run["way"]) for run in runs[10 * p : 10 * p + 10]], None, None) for p in range(13)]
    assert len(draw(scenario, courses, FIGURES_BYTES // 105)) <= FIGURES_BYTES // 105 < len(picture)


def test_a_way_is_drawn_with_the_points_that_it_needs() -> None:
    way = np.array([[0.0, 0.0], [5.0, 0.2], [10.0, 0.0], [10.0, -6.4], [10.3, -6.4]])
    assert thinned(way, 1.0).tolist() == [[0.0, 0.0], [10.0, 0.0], [10.3, -6.4]]
    assert outline(way, 1.0) == "M0 0l10 0 0-6"
    assert outline(way[:1]) == "M0 0l0 0"
