"""An evaluator as a function: what it takes, what it may give, and what is found out before work depends on it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from contract import golden

import curionav
from curionav.evaluation import Evaluator, part
from curionav.fair_queue import FairQueue
from curionav.messages import CandidateSet, EvaluateRequest, Scene


def request() -> EvaluateRequest:
    return EvaluateRequest.decode(golden("evaluate_request"))


def warm_up() -> EvaluateRequest:
    asked = request()
    candidates = asked.candidates
    none = {name: getattr(candidates, name)[:0] for name in ("id", "x", "y", "heading", "v", "omega")}
    return dataclasses.replace(asked, candidates=dataclasses.replace(candidates, count=0, **none))


@curionav.evaluator("tempo")
def tempo(scene: Scene, candidates: CandidateSet) -> Any:
    """Lack of speed."""
    return np.abs(1.0 - candidates.v).sum(axis=1)


def test_an_evaluator_is_still_its_function() -> None:
    asked = request()
    assert tempo.term == "tempo"
    assert tempo.__doc__ == "Lack of speed."
    assert np.array_equal(tempo(asked.scene, asked.all_columns("tempo")), tempo.costs(asked))
    assert tempo.trial(warm_up()).shape == (0,)


def test_a_column_that_a_question_leaves_out_is_refused_by_name() -> None:
    positions = EvaluateRequest.decode(golden("evaluate_request.positions"))
    assert np.array_equal(positions.candidates.x, request().candidates.x)
    assert positions.candidates.v is None
    with pytest.raises(curionav.DecodeError, match=r"candidates\.heading.*is missing, and the term `tempo` reads it"):
        tempo.costs(positions)


def test_a_third_parameter_gets_the_whole_request() -> None:
    @curionav.evaluator("detour")
    def detour(scene: Scene, candidates: CandidateSet, request: EvaluateRequest) -> Any:
        return np.hypot(candidates.x - request.goal_x, candidates.y - request.goal_y).sum(axis=1)

    assert detour.costs(request()).shape == (request().candidates.count,)
    detour.trial(warm_up())


@pytest.mark.parametrize("term", ["", "Tempo", "a/b", "x" * 65, "cnc", "cpc", "distance", "risk"])
def test_a_name_that_cannot_be_a_term_is_refused_at_once(term: str) -> None:
    with pytest.raises(ValueError, match="term"):
        curionav.evaluator(term)(lambda scene, candidates: candidates.v.sum(axis=1))


@pytest.mark.parametrize(
    "function", [lambda: 0, lambda scene: 0, lambda a, b, c, d: 0, lambda scene, candidates, *, goal: 0]
)
def test_a_function_with_other_parameters_is_refused_at_once(function: Any) -> None:
    with pytest.raises(TypeError, match="scene, candidates"):
        curionav.evaluator("tempo")(function)


def test_a_parameter_with_a_default_is_its_own() -> None:
    @curionav.evaluator("tempo")
    def weighted(scene: Scene, candidates: CandidateSet, wanted: float = 0.8) -> Any:
        return np.abs(wanted - candidates.v).sum(axis=1)

    weighted.trial(warm_up())


def gives(cost: Any) -> Evaluator:
    return Evaluator("bad", lambda scene, candidates: cost(candidates.count))


@pytest.mark.parametrize(
    ("cost", "reason"),
    [
        (lambda n: np.zeros(n + 1), r"shape \(\d+,\), expected"),
        (lambda n: np.zeros((n, 1)), "shape"),
        (lambda n: 1.0, "shape"),
        (lambda n: None, "shape|numbers"),
        (lambda n: ["a"] * n, "numbers"),
        (lambda n: np.full(n, np.nan), r"cost\[0\] is nan"),
        (lambda n: np.full(n, np.inf), r"cost\[0\] is inf"),
        (lambda n: np.full(n, -0.5), r"cost\[0\] is -0.5"),
        (lambda n: 1 / 0, "ZeroDivisionError"),
    ],
)
def test_costs_that_are_none_are_refused_with_the_reason(cost: Any, reason: str) -> None:
    with pytest.raises(curionav.EvaluatorError, match=reason):
        gives(cost).costs(request())
    with pytest.raises(curionav.EvaluatorError, match=reason):
        gives(cost).trial(warm_up())


def test_an_exception_is_told_with_its_place() -> None:
    def broken(scene: Scene, candidates: CandidateSet) -> Any:
        raise KeyError("weights")

    with pytest.raises(curionav.EvaluatorError, match=r"KeyError: 'weights' \(line \d+ of broken\)"):
        Evaluator("bad", broken).costs(request())


def test_a_forgotten_name_is_told_at_once() -> None:
    with pytest.raises(TypeError, match="give the term a name"):
        curionav.evaluator(lambda scene, candidates: candidates.v.sum(axis=1))  # type: ignore[arg-type]


def test_a_function_that_writes_to_what_it_is_given_is_found_out() -> None:
    def shifted(scene: Scene, candidates: CandidateSet) -> Any:
        candidates.x[:] -= 1.0
        return abs(candidates.x).sum(axis=1)

    with pytest.raises(curionav.EvaluatorError, match="read-only"):
        Evaluator("shifted", shifted).trial(warm_up())


def test_costs_scaled_within_the_batch_are_found_out() -> None:
    ranked = Evaluator("ranked", lambda scene, candidates: candidates.v.sum(axis=1).argsort().argsort().astype(float))
    with pytest.raises(curionav.EvaluatorError, match="neighbours"):
        ranked.trial(warm_up())


def test_a_function_that_forgets_that_there_may_be_no_people_is_found_out() -> None:
    def nearest(scene: Scene, candidates: CandidateSet) -> Any:
        return 1.0 / np.hypot(candidates.x[..., None] - scene.people.x, 0.0).min(axis=(1, 2))

    with pytest.raises(curionav.EvaluatorError, match="ValueError"):
        Evaluator("nearest", nearest).trial(warm_up())


def test_a_part_is_one_candidate() -> None:
    candidates = request().all_columns("tempo")
    last = part(candidates, candidates.count - 1)
    assert last.count == 1
    assert np.array_equal(last.x[0], candidates.x[-1])


def test_robots_are_served_in_turn_each_in_its_own_order() -> None:
    queue = FairQueue[int](16, 100)
    for robot, item in [("a", 1), ("a", 2), ("a", 3), ("b", 4), ("c", 5), ("b", 6)]:
        assert queue.push(robot, item, 1) == []
    assert [queue.pop() for _ in range(6)] == [1, 4, 5, 2, 6, 3]
    queue.end()
    assert queue.pop() is None
    assert queue.push("a", 7, 1) == [7]


def test_a_full_queue_refuses_the_robot_that_has_more_than_a_share() -> None:
    # The same as the services' own queue: crates/runtime/src/fair_queue.rs.
    queue = FairQueue[int](4, 100)
    assert [queue.push("greedy", item, 1) for item in range(5)] == [[], [], [], [], [4]]
    assert queue.push("modest", 5, 1) == [3]
    assert queue.push("modest", 6, 1) == [2]
    assert queue.push("modest", 7, 1) == [7]
    assert queue.push("greedy", 8, 1) == [8]
    assert queue.push("third", 9, 1) == [1]
    assert len(queue) == 4


def test_a_queue_that_is_full_of_bytes_refuses_the_robot_that_has_most_of_them() -> None:
    # The same as the services' own queue: crates/runtime/src/fair_queue.rs.
    queue = FairQueue[int](100, 100)
    for robot, item, size in [("l", 1, 40), ("l", 2, 40), ("s", 3, 10)]:
        assert queue.push(robot, item, size) == []
    assert queue.push("other", 4, 90) == [4]
    assert queue.push("s", 5, 20) == [2]
    assert queue.push("l", 6, 1000) == [6]
    assert [queue.pop() for _ in range(3)] == [1, 3, 5]
