"""Runs a peer: a program with a localiser of its own that speaks the protocol of `localisation_peers.py`."""

from __future__ import annotations

import math
import subprocess
from dataclasses import dataclass
from pathlib import Path

from plane_pose import Pose
from robot_log import Log
from tracking import Covariance, Estimate, Track

ANYWHERE = "anywhere"
OWN_NUMBER = "default"
"""Of particles."""


class PeerError(Exception):
    """A peer ended badly or printed what is no track."""


@dataclass(frozen=True)
class Task:
    """What a peer is given: files of map and log, a start, a seed, and the greatest number of particles."""

    map: Path
    log: Path
    start: Pose | None
    seed: int
    particles: int | None

    def arguments(self) -> list[str]:
        """As the protocol has them."""
        start = self.start and f"{self.start.x!r},{self.start.y!r},{self.start.heading!r}"
        particles = OWN_NUMBER if self.particles is None else str(self.particles)
        return [str(self.map), str(self.log), start or ANYWHERE, str(self.seed), particles]


def log_text(log: Log) -> str:
    """The log as the protocol has it; raises `ValueError` if the laser changes on the way."""
    laser = log.readings[0].laser
    mounted = laser.mounted
    lines = [f"laser {mounted.x!r} {mounted.y!r} {mounted.heading!r} {laser.step!r} {laser.range_max!r}"]
    for reading in log.readings:
        if reading.laser != laser:
            raise ValueError("the laser changes within the log, which peers are not told")
        odometry = reading.odometry
        ranges = " ".join(format(number, ".7g") for number in reading.ranges)
        at = f"{reading.stamp!r} {odometry.x!r} {odometry.y!r} {odometry.heading!r}"
        lines.append(f"{at} {len(reading.ranges)} {ranges}")
    return "\n".join([*lines, ""])


def run_peer(program: Path, task: Task, log: Log, timeout_s: float) -> Track:
    """The track of a peer; raises `PeerError` with the last line that it wrote to standard error."""
    try:
        done = subprocess.run(
            [str(program.resolve()), *task.arguments()],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired as expired:
        raise PeerError(f"it was not done after {timeout_s:g} s") from expired
    except OSError as error:
        raise PeerError(f"it cannot be started: {error}") from error
    said = done.stderr.strip().splitlines()
    last = f"; its last words: {said[-1]}" if said else "; it said nothing on standard error"
    if done.returncode != 0:
        raise PeerError(f"it ended with status {done.returncode}{last}")
    try:
        return parse_track(done.stdout, log)
    except ValueError as error:
        raise PeerError(f"{error}{last}") from error


def parse_track(text: str, log: Log) -> Track:
    """What a peer printed; raises `ValueError` if it is not a line for each scan and the line of times."""
    *lines, times = text.splitlines() or [""]
    match times.split():
        case ["updates", updates, "seconds", seconds]:
            if len(lines) != len(log.readings):
                raise ValueError(f"it printed {len(lines)} poses for {len(log.readings)} scans")
        case _:
            raise ValueError(f"its last line is no `updates N seconds S`: {times:.60}")
    pairs = enumerate(zip(lines, log.readings, strict=True), 1)
    estimates = [_estimate(line, number, reading.stamp) for number, (line, reading) in pairs]
    return Track(estimates, int(updates), float(seconds))


def _estimate(line: str, number: int, stamp: float) -> Estimate:
    try:
        numbers = [float(word) for word in line.split()]
        good = len(numbers) in {4, 8, 9} and all(map(math.isfinite, numbers)) and abs(numbers[0] - stamp) < 1e-3
    except ValueError:
        good = False
    if not good:
        raise ValueError(f"line {number} is no pose at {stamp!r}: {line:.60}")
    covariance = Covariance(*numbers[4:8]) if len(numbers) > 4 else None
    converged = numbers[8] != 0.0 if len(numbers) > 8 else None
    return Estimate(Pose(*numbers[1:4]), covariance, converged)
