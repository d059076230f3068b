"""Errors of a track against references, by the rules of `crates/lab/src/localize/drive.rs` and `summary.rs`."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from plane_pose import Pose, wrap_angle
from robot_log import Log

LOST_M = 1.0
"""Farther off than this the robot is elsewhere, metres."""
QUANTILE = 7.814_727_903_251_178
"""The normalised squared error of three dimensions is below it 19 times in twenty."""


@dataclass(frozen=True)
class Covariance:
    """Of x, y and heading, m2 and rad2; nothing ties the heading to the position."""

    xx: float
    xy: float
    yy: float
    heading: float

    def normalised(self, estimate: Pose, truth: Pose) -> float:
        """The normalised squared error; infinite if the covariance is not positive definite, which no belief is."""
        determinant = self.xx * self.yy - self.xy * self.xy
        if min(self.xx, determinant, self.heading) <= 0.0:
            return math.inf
        x = estimate.x - truth.x
        y = estimate.y - truth.y
        turned = wrap_angle(estimate.heading - truth.heading)
        position = (self.yy * x * x - 2.0 * self.xy * x * y + self.xx * y * y) / determinant
        return position + turned * turned / self.heading


@dataclass(frozen=True)
class Estimate:
    """What a filter says at a scan. A filter may have no covariance, and no opinion on whether it has converged."""

    pose: Pose
    covariance: Covariance | None = None
    converged: bool | None = None


@dataclass(frozen=True)
class Figures:
    """How well a program did on one drive with one seed. What cannot be known is nothing."""

    ends_at: Pose
    right: bool | None
    median_m: float | None
    p95_m: float | None
    nees: float | None
    share_within_95: float | None
    wrongly_converged: float | None
    updates: int
    seconds: float
    """Wall time that the filter took for the whole drive."""

    def updates_per_second(self) -> float:
        """Of the filter alone."""
        return self.updates / max(self.seconds, 1e-9)


@dataclass(frozen=True)
class End:
    """Where a drive without references is known to end, and how far off is right, metres."""

    x: float
    y: float
    within_m: float = 2.0

    def is_met_by(self, pose: Pose) -> bool:
        """Whether a track that ends there ends right."""
        return math.hypot(pose.x - self.x, pose.y - self.y) <= self.within_m


@dataclass(frozen=True)
class Track:
    """What a filter says at each scan of a log, and how long its updates took."""

    estimates: Sequence[Estimate]
    updates: int
    seconds: float

    def figures(self, log: Log, end: End | None) -> Figures:
        """Errors count from the scan at which the filter first had converged, if it says so, as ours do.

        A covariance that is not positive definite counts as outside of its region. It has no part in the mean.
        """
        converged = [bool(estimate.converged) for estimate in self.estimates]
        since = converged.index(True) if True in converged else 0
        pairs = list(zip(self.estimates, log.readings, strict=True))
        referred = [Referred(estimate, one.reference) for estimate, one in pairs[since:] if one.reference is not None]
        errors = sorted(one.metres() for one in referred)
        normalised = [error for one in referred if (error := one.normalised()) is not None]
        finite = [error for error in normalised if math.isfinite(error)]
        ends_at = self.estimates[-1].pose
        right = end.is_met_by(ends_at) if end else None
        if referred:
            right = referred[-1].metres() <= LOST_M
        return Figures(
            ends_at=ends_at,
            right=right,
            median_m=statistics.median(errors) if errors else None,
            p95_m=errors[min(len(errors) * 95 // 100, len(errors) - 1)] if errors else None,
            nees=statistics.fmean(finite) if finite else None,
            share_within_95=sum(error <= QUANTILE for error in normalised) / len(normalised) if normalised else None,
            wrongly_converged=self._wrongly_converged(log),
            updates=self.updates,
            seconds=self.seconds,
        )

    def _wrongly_converged(self, log: Log) -> float | None:
        """The share of all scans with a reference at which the filter was sure of another place."""
        referred = 0
        wrong = 0
        for estimate, reading in zip(self.estimates, log.readings, strict=True):
            if reading.reference is None or estimate.converged is None:
                continue
            referred += 1
            wrong += estimate.converged and estimate.pose.distance(reading.reference) > LOST_M
        return wrong / referred if referred else None


@dataclass(frozen=True)
class Referred:
    """An estimate, and where the robot was."""

    estimate: Estimate
    reference: Pose

    def metres(self) -> float:
        """How far off the estimate is."""
        return self.estimate.pose.distance(self.reference)

    def normalised(self) -> float | None:
        """The normalised squared error, if there is a covariance."""
        covariance = self.estimate.covariance
        return covariance.normalised(self.estimate.pose, self.reference) if covariance else None
