"""Why a cycle was decided as it was, from its report: in words, and as a table of candidates and their costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from .messages import CycleReport, TermReport


@dataclass(frozen=True)
class Candidate:
    """One row of the table: a candidate by its ``id``, with what each metric adds to its cost.

    ``cost`` is ``None`` if a term has not scored it, and so are the entries of ``terms`` and ``raw`` of such a term.
    ``remark`` is ``chosen``, ``next``, or why it was rejected; empty if it was only dearer.
    """

    id: int
    cost: float | None
    terms: dict[str, float | None]
    raw: dict[str, float | None]
    remark: str


@dataclass(frozen=True)
class WhatIf:
    """With the weight of ``metric`` ``doubled``, ``halved`` or set to ``zero``, ``candidate`` would have been taken."""

    metric: str
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

        def rank(i: int) -> tuple[bool, bool, bool, float, int]:
            return report.chosen != i, bool(report.rejected[i]), bool(self._lacking(i)), float(report.total[i]), i

        return [self._candidate(i) for i in sorted(range(report.candidates.count), key=rank)]

    def what_if(self) -> list[WhatIf]:
        """What other weights would have led to; empty if no candidate was followed or the arbiter is older."""
        found = []
        for term in self.report.terms:
            for change, weight, index in (
                ("doubled", term.weight * 2.0, term.doubled),
                ("halved", term.weight / 2.0, term.halved),
                ("set to zero", 0.0, term.without),
            ):
                if index is not None:
                    found.append(WhatIf(term.metric, change, weight, self._id(index), index == self.report.chosen))
        return found

    def alone(self) -> dict[str, int]:
        """By metric: the candidate that this term alone would have chosen."""
        return {term.metric: self._id(term.alone) for term in self.report.terms if term.alone is not None}

    def __str__(self) -> str:
        return "\n".join([*self._words(), *self._table()])

    def _id(self, index: int) -> int:
        return int(self.report.candidates.id[index])

    def _lacking(self, index: int) -> set[str]:
        """The metrics that have not scored a candidate."""
        return {term.metric for term in self.report.terms if term.missing is not None and index in term.missing}

    def _candidate(self, index: int) -> Candidate:
        report = self.report
        scored = [term for term in report.terms if len(term.raw)]
        lacking = self._lacking(index)

        def column(term: TermReport, raw: bool) -> float | None:
            array = term.raw if raw else term.cost
            return None if array is None or not len(array) or term.metric in lacking else float(array[index])

        remark = {report.chosen: "chosen", report.runner_up: "next"}.get(index, report.rejected[index])
        return Candidate(
            id=self._id(index),
            cost=None if lacking else float(report.total[index]),
            terms={term.metric: column(term, raw=False) for term in scored},
            raw={term.metric: column(term, raw=True) for term in scored},
            remark=remark,
        )

    def _words(self) -> Iterator[str]:
        report, decision = self.report, self.report.decision
        did = decision.action if report.chosen is None else f"follow candidate {self._id(report.chosen)}"
        yield f"Robot {report.robot}, cycle {report.seq} at {decision.stamp:.1f} s: {did} ({decision.reason})."
        reasons = Counter(reason for reason in report.rejected if reason)
        left = report.candidates.count - sum(reasons.values())
        rejected = "".join(f"; {count} {reason}" for reason, count in reasons.most_common(4))
        yield f"Of {report.candidates.count} candidates {left} were left to compare{rejected}."
        if report.runner_up is not None and report.margin is not None:
            how = "dearer" if report.margin >= 0.0 else "cheaper"
            yield f"Candidate {self._id(report.runner_up)} would have been next, {abs(report.margin):.4f} {how}."
        for metric, candidate in self.alone().items():
            yield f"- {metric} alone would have chosen candidate {candidate}."
        same = []
        for case in self.what_if():
            if case.same:
                same.append(f"{case.metric} {case.change}")
            else:
                yield f"With the weight of {case.metric} {case.change} it would have taken candidate {case.candidate}."
        if same:
            yield f"It would have taken the same with the weight of {', '.join(same)}."
        yield f"Degraded: {'; '.join(decision.degraded)}." if decision.degraded else "Nothing was degraded."

    def _table(self) -> Iterator[str]:
        metrics = [term.metric for term in self.report.terms if len(term.raw)]
        yield "  ".join(f"{name:>10}" for name in ("candidate", "cost", *metrics))
        rows = self.candidates()
        for row in rows[: self.top] if self.top else rows:
            numbers = [row.cost, *(row.terms[metric] for metric in metrics)]
            cells = [f"{row.id:>10}", *("" if n is None else f"{n:.4f}" for n in numbers)]
            yield "  ".join([*(f"{cell:>10}" for cell in cells), row.remark]).rstrip()
