"""Why a cycle was decided as it was, from its report: in words, and as a table of candidates and their costs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from .array import F64
from .messages import CycleReport, Twist
from .words import say, say_all


@dataclass(frozen=True)
class Candidate:
    """One row of the table: a candidate by its ``id``, with what each term adds to its cost.

    ``cost`` is ``None`` if an active term has not scored it, and so are the entries of ``terms`` and ``raw`` of a term
    that has not. ``remark`` is ``chosen``, ``next``, or why it was rejected; empty if it was only dearer.
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
        report, decision = self.report, self.report.decision
        did = decision.action if report.chosen is None else f"follow candidate {self._id(report.chosen)}"
        why = say("reason", decision.reason)
        yield f"Robot {report.robot}, cycle {report.seq} at {decision.stamp:.1f} s: {did} ({why})."
        if report.driven is not None:
            yield f"Before it, {driven(report.driven)}."
        codes = Counter(why["code"] for why in report.rejected if why is not None)
        left = report.candidates.count - codes.total()
        rejected = "".join(f"; {count} {say('rejections', code)}" for code, count in codes.most_common())
        yield f"Of {report.candidates.count} candidates {left} were left to compare{rejected}."
        if report.runner_up is not None and report.margin is not None:
            how = "dearer" if report.margin >= 0.0 else "cheaper"
            yield f"Candidate {self._id(report.runner_up)} would have been next, {abs(report.margin):.4f} {how}."
        for term, candidate in self.alone().items():
            yield f"- {term} alone would have chosen candidate {candidate}."
        same = []
        for case in self.what_if():
            if case.same:
                same.append(f"{case.term} {case.change}")
            else:
                yield f"With the weight of {case.term} {case.change} it would have taken candidate {case.candidate}."
        if same:
            yield f"It would have taken the same with the weight of {', '.join(same)}."
        degraded = say_all("degradation", decision.degraded)
        yield f"Degraded: {degraded}." if degraded else "Nothing was degraded."

    def _table(self) -> Iterator[str]:
        terms = [term.term for term in self.report.terms if len(term.scored)]
        yield "  ".join(f"{name:>10}" for name in ("candidate", "cost", *terms))
        rows = self.candidates()
        for row in rows[: self.top] if self.top else rows:
            numbers = [row.cost, *(row.terms[term] for term in terms)]
            cells = [f"{row.id:>10}", *("" if n is None else f"{n:.4f}" for n in numbers)]
            yield "  ".join([*(f"{cell:>10}" for cell in cells), row.remark]).rstrip()


def driven(twist: Twist) -> str:
    """What the driver does with the decisions, in words."""
    reason = say("command_reason", twist.reason)
    return f"the driver commanded {twist.v:.2f} m/s and {twist.omega:.2f} rad/s ({reason}, since {twist.since:.1f} s)"
