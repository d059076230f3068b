"""Why a cycle was decided as it was, from its report: in words, and as a table of candidates and their costs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from .array import F64
from .messages import CycleReport, TermReport
from .words import UNSEEN, families, say, say_all

IN_PLACE = 1.0
"""Seconds in one place from which on that is said."""


@dataclass(frozen=True)
class Candidate:
    """One row of the table: a candidate by its ``id``, with what each term adds to its cost.

    ``cost`` is ``None`` if an active term has not scored it, and so are the entries of ``terms`` and ``raw`` of a term
    that has not. ``remark`` is ``chosen``, ``next``, or why it was rejected; empty if it was only more expensive.
    """

    id: int
    cost: float | None
    terms: dict[str, float | None]
    raw: dict[str, float | None]
    remark: str


@dataclass(frozen=True)
class WhatIf:
    """With the weight of ``term`` ``doubled``, ``halved`` or ``set to zero``, ``candidate`` would have been taken."""

    term: str
    change: str
    weight: float
    candidate: int
    same: bool


class Explanation:
    """Why a cycle was decided as it was; ``print`` it.

    The arbiter has computed in the cycle itself what other weights would have led to, collisions included.

    Attributes:
        report: The cycle.
        top: Candidates in the printed table; 0 for all.
    """

    def __init__(self, report: CycleReport, top: int = 10) -> None:
        self.report = report
        self.top = top

    def candidates(self) -> list[Candidate]:
        """Every candidate: the chosen one, those that ran, those rejected; each by cost, those without one last."""
        report = self.report

        def rank(i: int) -> tuple[bool, bool, float, int]:
            total = float(report.total[i])
            return report.chosen != i, report.rejected[i] is not None, math.inf if math.isnan(total) else total, i

        return [self._candidate(i) for i in sorted(range(report.candidates.count), key=rank)]

    def what_if(self) -> list[WhatIf]:
        """What other weights would have led to; empty if no candidate was followed."""
        found = []
        for term in self.report.terms:
            for change, weight, index in (
                ("doubled", term.weight * 2.0, term.doubled),
                ("halved", term.weight / 2.0, term.halved),
                ("set to zero", 0.0, term.without),
            ):
                if index is not None:
                    found.append(WhatIf(term.term, change, weight, self._id(index), index == self.report.chosen))
        return found

    def alone(self) -> dict[str, int]:
        """By term: the candidate that this term alone would have chosen."""
        return {term.term: self._id(term.alone) for term in self.report.terms if term.alone is not None}

    def __str__(self) -> str:
        return "\n".join([*self._words(), *self._table()])

    def _id(self, index: int) -> int:
        return int(self.report.candidates.id[index])

    def _candidate(self, index: int) -> Candidate:
        report = self.report

        def number(of: F64) -> float | None:
            return None if math.isnan(of[index]) else float(of[index])

        why = report.rejected[index]
        remark = {report.chosen: "chosen", report.runner_up: "next"}.get(index, say("rejection", why) if why else "")
        scored = [term for term in report.terms if len(term.scored)]
        return Candidate(
            id=self._id(index),
            cost=number(report.total),
            terms={term.term: number(term.cost) for term in scored},
            raw={term.term: number(term.raw) for term in scored},
            remark=remark,
        )

    def _words(self) -> Iterator[str]:
        yield from self._decided()
        yield from self._costs()
        for term in self.report.terms:
            if term.active:
                yield self._wish(term)
                yield from self._meaning(term)
        for term in self.report.terms:
            if not term.active:
                yield _line("idle", term=term.term, weight=term.weight, scale=term.scale)
        same = []
        weights = {term.term: term.weight for term in self.report.terms}
        for case in self.what_if():
            if case.same:
                same.append(f"{case.term} {case.change}")
                continue
            other = {"weight": weights[case.term], "other": case.weight, "candidate": case.candidate}
            yield _line("otherwise", term=case.term, change=case.change, **other)
        if same:
            yield _line("same", changes=same)
        degraded = say_all("degradation", self.report.decision.degraded)
        yield _line("degraded", degraded=degraded) if degraded else _line("healthy")

    def _decided(self) -> Iterator[str]:
        """What was decided, of how many candidates, and what the driver made of the decisions before."""
        report, decision, count = self.report, self.report.decision, self.report.candidates.count
        chosen = "none" if report.chosen is None else self._id(report.chosen)
        when = {"robot": report.robot, "cycle": report.seq, "stamp": decision.stamp}
        yield _line(decision.action, candidate=chosen, reason=decision.reason, **when)
        sure = "unsure" if decision.uncertain else "sure"
        unseen = unseen_away(report)
        people = len(report.scene.people.id) - (unseen is not None)
        yield _line(sure, uncertainty=decision.uncertainty, people=people)
        codes = Counter(why["code"] for why in report.rejected if why is not None)
        rejected = "".join(f"; {codes[code]} {say('rejections', code)}" for code in sorted(codes))
        yield _line("compared", count=count, left=count - codes.total(), rejected=rejected)
        if unseen is not None:
            yield _line("unseen", person=UNSEEN, distance=unseen)
        if report.scene.in_place_s >= IN_PLACE:
            yield _line("in_place", time=report.scene.in_place_s)
        if report.scene.impatient:
            yield _line("impatient")
        if report.driven is not None and report.driven.reason != "tracking":
            time = report.scene.stamp - report.driven.since
            yield _line("driven", time=time, command_reason=report.driven.reason)

    def _costs(self) -> Iterator[str]:
        """What the chosen candidate costs, by how much it leads, and what each term makes of its cost."""
        report = self.report
        if report.chosen is None:
            return
        total = float(report.total[report.chosen])
        if report.runner_up is None or report.margin is None:
            yield _line("only", total=total)
        else:
            code = "next" if report.margin >= 0.0 else "passed_over"
            yield _line(code, total=total, candidate=self._id(report.runner_up), margin=abs(report.margin))
        shares = {term.term: float(term.cost[report.chosen]) for term in report.terms}
        parts = [f"{term} {cost:.4f}" for term, cost in shares.items() if not math.isnan(cost)]
        if parts:
            yield _line("shares", shares=" + ".join(parts))

    def _wish(self, term: TermReport) -> str:
        """Which candidate a term alone would have chosen."""
        count = self.report.candidates.count - len(term.scored)
        facts = {"term": term.term, "weight": term.weight, "scale": term.scale, "evaluated": term.evaluated}
        facts["missing"] = f", {count} not at all" if count else ""
        if term.alone is None:
            return _line("no_wish", **facts)
        same = term.alone == self.report.chosen
        return _line("wish", **facts, wish="the same" if same else f"candidate {self._id(term.alone)}")

    def _meaning(self, term: TermReport) -> Iterator[str]:
        """What the raw cost of the chosen candidate says, if the table has words for the term."""
        said = meaning(self.report, term)
        if said is not None:
            yield _line("meaning", term_meaning=said)

    def _table(self) -> Iterator[str]:
        terms = [term.term for term in self.report.terms if len(term.scored)]
        yield "  ".join(f"{name:>10}" for name in ("candidate", "cost", *terms))
        rows = self.candidates()
        for row in rows[: self.top] if self.top else rows:
            numbers = [row.cost, *(row.terms[term] for term in terms)]
            cells = [f"{row.id:>10}", *("" if n is None else f"{n:.4f}" for n in numbers)]
            yield "  ".join([*(f"{cell:>10}" for cell in cells), row.remark]).rstrip()


def meaning(report: CycleReport, term: TermReport) -> dict[str, Any] | None:
    """What the raw cost of the chosen candidate says, for the family ``term_meaning``.

    Returns:
        The code with its parameters; ``None`` without words for the term, or if it has not scored the candidate.
    """
    chosen = report.chosen
    if chosen is None or term.term not in families()["term_meaning"] or math.isnan(term.raw[chosen]):
        return None
    raw, steps = float(term.raw[chosen]), max(report.candidates.steps, 1)
    return {"code": term.term, "mean": raw / steps, "percent": 100.0 * raw}


def unseen_away(report: CycleReport) -> float | None:
    """Metres to what only the driver sees; ``None`` if the scene has nothing of the kind."""
    people, belief = report.scene.people, report.scene.belief
    for i, person in enumerate(people.id):
        if person == UNSEEN:
            return math.hypot(people.x[i] - belief.x, people.y[i] - belief.y)
    return None


def _line(code: str, **parameters: Any) -> str:
    """A sentence of the family ``explanation`` of the table of words, as the command line says it too."""
    return say("explanation", {"code": code, **parameters})
