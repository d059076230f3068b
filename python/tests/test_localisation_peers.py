"""The harness that compares localisers: its figures, its protocol, and what becomes of peers that fail."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import carmen_log
import peer_program
import pytest
from contract import ROOT
from live import program
from plane_pose import Pose
from robot_log import Laser, Log, Reading
from tracking import Covariance, End, Estimate, Track

HARNESS = ROOT / "python" / "benchmarks" / "localisation_peers.py"

# Five scans a metre apart; the references go a fifth to the left of odometry.
OWN = """
import json
print(json.dumps(dict(
    scans=5, references=5, length_m=4.0, ends_at=[4.0, 0.9, 0.0], updates=5, updates_per_second=50.0,
    localizer=dict(median_m=0.1, p95_m=0.2, at_end_m=0.1), consistency=dict(mean=2.0, share_within_95=0.8),
    wrongly_converged=0.0,
)))
"""
# 9 m off, and not yet sure; then sure, and off by as many tenths of a metre as scans have come.
GOOD = """
import sys
map, log, start, seed, particles = sys.argv[1:]
cells = open(map).read().split()
assert cells[:2] == ["4", "3"] and cells[5:9] == ["0", "100", "-1", "0"], cells
assert start == {start!r} and seed in ("1", "2") and particles == "default"
laser, *scans = open(log).read().splitlines()
assert laser.split()[0] == "laser" and len(laser.split()) == 6
for k, scan in enumerate(scans):
    stamp, x, y, heading, count, *ranges = map_ = scan.split()
    assert len(ranges) == int(count) == 3 and ranges[1] == "nan"
    off = 9.0 if k == 0 else 0.1 * k
    print(stamp, float(x), 0.2 * k + off, heading, 0.04, 0.0, 0.04, 0.01, int(k > 0))
print("updates 5 seconds 0.5")
"""
DIES = "import sys; print('one line'); sys.exit('it had begun well\\nits wheels came off')"
RUBBISH = "import sys; print('hello', file=sys.stderr); print('to the left\\nupdates 1 seconds 1')"


@dataclass(frozen=True)
class Told:
    """What the harness printed."""

    status: int
    out: str
    err: str


def script(path: Path, text: str) -> Path:
    path.write_text(f"#!{sys.executable}\n{text}")
    path.chmod(0o755)
    return path


def written(folder: Path, peers: dict[str, str], *more: str) -> Told:
    """What the harness says of a tiny drive and these peers."""
    lines = []
    for k in range(5):
        poses = f"{float(k)} {0.2 * k} 0 {float(k)} 0 0"
        lines.append(f"FLASER 3 1.5 0 40 {poses} {10 + k} host {10 + k}")
    (folder / "a.log").write_text("\n".join(lines))
    (folder / "a.pgm").write_bytes(b"P5\n4 3\n255\n" + bytes([254, 254, 254, 254] * 2 + [254, 0, 205, 254]))
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "a.yaml").write_text(f"image: a.pgm\nresolution: 0.5\norigin: [-1.0, 2.0, 0.0]\n{thresholds}")
    (folder / "drives.toml").write_text('[[drive]]\nname = "A"\nlog = "a.log"\nmap = "a.yaml"\n')
    command = [sys.executable, str(HARNESS), str(folder / "drives.toml"), *more]
    command += ["--program", str(script(folder / "own", OWN)), "--csv", str(folder / "out.csv")]
    for name, text in peers.items():
        command += ["--peer", f"{name}={script(folder / name, text)}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    return Told(done.returncode, done.stdout, done.stderr)


def test_a_peer_stands_beside_ours_with_errors_that_can_be_worked_out(tmp_path: Path) -> None:
    told = written(tmp_path, {"good": GOOD.replace("{start!r}", "'0.0,0.0,0.0'")}, "--seeds", "2")
    assert told.status == 0, told.err
    # Of 0.1, 0.2, 0.3 and 0.4 m, whose squares over 0.04 m2 are 0.25, 1, 2.25 and 4.
    assert told.out.splitlines()[2:] == [
        "| A | curionav | 2 of 2 | 0.10, 0.20 | 2.0 | 80 % | 0.0 | 50 | 0.1 |",
        "| A | good | 2 of 2 | 0.25, 0.40 | 1.9 | 100 % | 0.0 | 10 | 0.5 |",
    ]
    with (tmp_path / "out.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["program"], row["seed"]) for row in rows] == [
        ("curionav", "1"),
        ("good", "1"),
        ("curionav", "2"),
        ("good", "2"),
    ]
    assert float(rows[1]["nees"]) == pytest.approx(1.875)
    assert float(rows[1]["ends_at_y"]) == pytest.approx(1.2)


def test_from_anywhere_a_peer_is_told_so(tmp_path: Path) -> None:
    told = written(tmp_path, {"good": GOOD.replace("{start!r}", "'anywhere'")}, "--global-start")
    assert told.status == 0, told.err


def test_without_a_peer_the_rows_are_ours_and_a_notice_says_so(tmp_path: Path) -> None:
    told = written(tmp_path, {})
    assert told.status == 0
    assert [line.split(" | ")[1] for line in told.out.splitlines()[2:]] == ["curionav"]
    assert "no peer to compare with" in told.err
    told = written(tmp_path, {}, "--peer", f"amcl={tmp_path / 'amcl'}")
    assert told.status == 0
    assert f"amcl: there is no program {tmp_path / 'amcl'}; it is left out" in told.err


def test_a_peer_that_fails_is_named_and_the_others_go_on(tmp_path: Path) -> None:
    good = GOOD.replace("{start!r}", "'0.0,0.0,0.0'")
    told = written(tmp_path, {"dies": DIES, "rubbish": RUBBISH, "good": good})
    assert told.status == 1
    assert [line.split(" | ")[1] for line in told.out.splitlines()[2:]] == ["curionav", "good"]
    dies, rubbish = told.err.splitlines()[-2:]
    assert dies == "dies failed on A, seed 1: it ended with status 1; its last words: its wheels came off"
    assert rubbish == "rubbish failed on A, seed 1: it printed 1 poses for 5 scans; its last words: hello"


def test_lines_that_are_no_poses_are_refused() -> None:
    log = Log([Reading(1.0, [1.0], Laser(Pose(), 0.1, 30.0), Pose())])
    good = "updates 1 seconds 0.1"
    assert peer_program.parse_track(f"1.0 2 3 0\n{good}", log).estimates == [Estimate(Pose(2.0, 3.0, 0.0))]
    for line in ["", "1.0 2 3", "1.0 2 3 nan", "1.5 2 3 0", "1.0 2 3 x", "1.0 2 3 0 1 1"]:
        with pytest.raises(ValueError, match="line 1 is no pose"):
            peer_program.parse_track(f"{line}\n{good}", log)
    with pytest.raises(ValueError, match="its last line"):
        peer_program.parse_track("1.0 2 3 0", log)


def test_a_sure_pose_elsewhere_is_wrong_and_a_covariance_of_nothing_is_outside() -> None:
    laser = Laser(Pose(), 0.1, 30.0)
    log = Log([Reading(float(k), [1.0], laser, Pose(), Pose(0.0, 0.0, 0.0)) for k in range(4)])
    honest = Covariance(1.0, 0.0, 1.0, 1.0)
    collapsed = Covariance(-1e-9, 0.0, 1.0, 1.0)
    poses = [Pose(2.0, 0.0, 0.0), Pose(2.0, 0.0, 0.0), Pose(1.0, 0.0, 2.0 * math.pi), Pose()]
    estimates = [
        Estimate(poses[0], honest, False),
        Estimate(poses[1], honest, True),
        Estimate(poses[2], honest, True),
        Estimate(poses[3], collapsed, True),
    ]
    figures = Track(estimates, 4, 1.0).figures(log, None)
    assert figures.wrongly_converged == 0.25
    assert figures.right and figures.median_m == 1.0 and figures.p95_m == 2.0
    # Of 4, 1, and a collapsed one.
    assert figures.nees == pytest.approx(2.5) and figures.share_within_95 == pytest.approx(2.0 / 3.0)


def test_without_references_a_run_is_right_where_the_drive_is_known_to_end() -> None:
    log = Log([Reading(0.0, [1.0], Laser(Pose(), 0.1, 30.0), Pose())])
    for x, right in [(1.9, True), (2.1, False)]:
        figures = Track([Estimate(Pose(x, 0.0, 0.0))], 1, 1.0).figures(log, End(0.0, 0.0))
        assert figures.right is right and figures.median_m is None and figures.wrongly_converged is None


@pytest.mark.live
def test_errors_are_those_that_the_program_prints(tmp_path: Path) -> None:
    """A robot drives a circle in an empty room; odometry turns 8 % too far."""
    room = (6.0, 4.0)
    lines = []
    odometry = Pose()
    for k in range(120):
        angle = 0.05 * k
        truth = Pose(1.2 * math.sin(angle), -1.2 * math.cos(angle), angle)
        if k:
            odometry = odometry.compose(Pose(0.06, 0.0, 0.054))
        ranges = " ".join(f"{_range(truth, math.pi * (beam / 60.0 - 0.5), room):.3f}" for beam in range(61))
        pose = f"{truth.x} {truth.y} {truth.heading} {odometry.x} {odometry.y} {odometry.heading}"
        lines.append(f"FLASER 61 {ranges} {pose} {1e6 + 0.2 * k} host {1e6 + 0.2 * k}")
    path = tmp_path / "circle.log"
    path.write_text("\n".join(lines))
    rows = [b"\0" * 60, *[b"\0" + b"\xfe" * 58 + b"\0"] * 38, b"\0" * 60]
    (tmp_path / "room.pgm").write_bytes(b"P5\n60 40\n255\n" + b"".join(rows))
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    description = tmp_path / "room.yaml"
    description.write_text(f"image: room.pgm\nresolution: 0.1\norigin: [-3.0, -2.0, 0.0]\n{thresholds}")
    command = [str(program()), "localize", str(path), "--map", str(description), "--json"]
    command += ["--out", str(tmp_path / "tracks.svg")]
    said = json.loads(subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout)
    log = carmen_log.read(path, None, carmen_log.Scanner())
    assert (said["scans"], said["references"]) == (len(log.readings), len(log.references())) == (120, 120)
    assert said["length_m"] == pytest.approx(log.length())
    first = log.readings[0]
    assert first.reference is not None
    since = said["converged_after_s"] or 0.0
    alone = [
        Estimate(
            first.reference.compose(first.odometry.relative(one.odometry)),
            converged=one.stamp - first.stamp >= since - 1e-6,
        )
        for one in log.readings
    ]
    figures = Track(alone, 1, 1.0).figures(log, None)
    assert figures.median_m == pytest.approx(said["odometry_alone"]["median_m"])
    assert figures.p95_m == pytest.approx(said["odometry_alone"]["p95_m"])


def _range(at: Pose, bearing: float, room: tuple[float, float]) -> float:
    """Metres to the wall of a room around the origin."""
    cos = math.cos(at.heading + bearing)
    sin = math.sin(at.heading + bearing)
    to_x = (math.copysign(room[0] / 2.0 - 0.05, cos) - at.x) / cos if cos else math.inf
    to_y = (math.copysign(room[1] / 2.0 - 0.05, sin) - at.y) / sin if sin else math.inf
    return min(to_x, to_y)
