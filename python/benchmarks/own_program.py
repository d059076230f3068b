"""Runs `curionav localize` on a drive, and reads what it prints for programs."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drives import Drive
from peer_program import PeerError
from plane_pose import Pose
from robot_log import Log
from tracking import LOST_M, Figures

NAME = "curionav"
_TARGET = Path(__file__).resolve().parents[2] / "target" / "release" / NAME
_DONE_OR_LOST = (0, 1)


def find_program() -> Path | None:
    """`CURIONAV_BIN`, the program that was built last, or the one on the path."""
    named = os.environ.get("CURIONAV_BIN")
    on_path = shutil.which(NAME)
    candidates = [Path(one) for one in (named, _TARGET, on_path) if one]
    return next((path for path in candidates if path.is_file()), None)


@dataclass(frozen=True)
class OwnTask:
    """A drive with a seed, and the greatest number of particles if not the program's own."""

    drive: Drive
    anywhere: bool
    seed: int
    particles: int | None
    folder: Path
    """Where files may be written."""


def run_own(program: Path, task: OwnTask, log: Log, timeout_s: float) -> Figures:
    """The program's own figures; raises `PeerError` if it fails, or has read another log than the peers are given."""
    command = [str(program), "localize", *task.drive.arguments(task.anywhere), "--seed", str(task.seed), "--json"]
    command += ["--out", str(task.folder / "tracks.svg")]
    if task.particles is not None:
        params = task.folder / "localizer.toml"
        params.write_text(f"particles_max = {task.particles}\nparticles_min = {min(300, task.particles)}\n")
        command += ["--localizer", str(params)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
    except (subprocess.TimeoutExpired, OSError) as error:
        raise PeerError(f"it did not end: {error}") from error
    if done.returncode not in _DONE_OR_LOST:
        last = done.stderr.strip().splitlines() or ["nothing"]
        raise PeerError(f"it ended with status {done.returncode}; its last words: {last[-1]}")
    said = json.loads(done.stdout)
    _same_log(said, log)
    return _figures(said, task.drive)


def _same_log(said: dict[str, Any], log: Log) -> None:
    """Whether the harness and the program read the same scans, odometry and references."""
    own = (said["scans"], said["references"])
    given = (len(log.readings), len(log.references()))
    same_length = math.isclose(said["length_m"], log.length(), rel_tol=1e-6, abs_tol=1e-6)
    if own != given or not same_length:
        told = f"{own[0]} scans, {own[1]} references and {said['length_m']:.3f} m"
        raise PeerError(f"it read {told}; peers are given {given[0]}, {given[1]} and {log.length():.3f} m")


def _figures(said: dict[str, Any], drive: Drive) -> Figures:
    errors = said["localizer"]
    honest = said["consistency"]
    ends_at = Pose(*said["ends_at"])
    right = drive.end.is_met_by(ends_at) if drive.end else None
    if errors:
        right = errors["at_end_m"] <= LOST_M
    return Figures(
        ends_at=ends_at,
        right=right,
        median_m=errors["median_m"] if errors else None,
        p95_m=errors["p95_m"] if errors else None,
        nees=honest["mean"] if honest else None,
        share_within_95=honest["share_within_95"] if honest else None,
        wrongly_converged=said["wrongly_converged"],
        updates=said["updates"],
        seconds=said["updates"] / said["updates_per_second"],
    )
