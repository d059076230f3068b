"""Compares `curionav localize` with other localisers on recorded lidar.

    python localisation_peers.py DRIVES.toml --seeds 5 --peer nav2_amcl=./nav2_amcl --csv out.csv
    python localisation_peers.py LOG --map MAP.yaml --global-start

Every program has the same scans, odometry, map, start, seeds and, with `--particles`, greatest number of particles. The
programs take turns, so that other work on the machine disturbs all alike. A file of drives has tables `[[drive]]` with
`name`, `log`, `map` and, if need be, `reference`, `start`, `laser`, `range_max`, `odometry_noise` and `end`. The last
is where a log without references is known to end: a run is right within 2 m of it.

A peer is any program that is started as

    PROGRAM MAP LOG START SEED PARTICLES

- MAP is text. The first line is `width height resolution x y`: cells, metres, and the lower left corner. A line for
  each row of cells follows, the lowest first: 0 is free, 100 is occupied, -1 is unknown.
- LOG is text. The first line is `laser x y heading step range_max`. A beam k points along heading + k step, seen from
  the robot; ranges of range_max or more met nothing. A line `stamp odom_x odom_y odom_theta n ranges...` follows for
  each scan. Odometry is composed from its increments, so it never begins anew. A range `nan` says nothing.
- START is `x,y,theta`, or `anywhere`. A given start is right to 0.5 m and 15 degrees (standard deviations).
- SEED is a whole number. PARTICLES is the greatest number of particles, or `default` for the program's own.

It prints a line for each scan, `stamp x y theta cxx cxy cyy ctt converged`: the pose on the map, its covariance in m2
and rad2, and 1 or 0. Lines may end before `converged`, or before the covariance. The last line is `updates N seconds
S`: how often the filter was updated, and the wall time that all scans took, without reading and printing. Errors count
from the scan at which a program first calls itself converged; if it never does, from the first scan.

A peer that fails is named at the end with the last line that it wrote to standard error. The others go on. The exit
status is 0 if every run succeeded, 1 if one failed, and 2 for bad input.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import carmen_log
from comparison_table import Row, markdown, write_csv
from drives import Drive, pose, read_drives
from occupancy_map import OccupancyMap
from own_program import NAME, OwnTask, find_program, run_own
from peer_program import PeerError, Task, log_text, run_peer
from robot_log import Log
from tracking import Figures


@dataclass(frozen=True)
class Peer:
    """Another program, and what its rows are called."""

    name: str
    program: Path


@dataclass(frozen=True)
class Campaign:
    """What is done with every drive."""

    own: Path
    peers: list[Peer]
    seeds: range
    anywhere: bool
    particles: int | None
    timeout_s: float


@dataclass(frozen=True)
class Given:
    """A drive with its log, and the folder for what peers are given."""

    drive: Drive
    log: Log
    folder: Path

    def map_text(self) -> Path:
        """The map, as the protocol has it."""
        return self.folder / "map.txt"

    def log_text(self) -> Path:
        """The log, as the protocol has it."""
        return self.folder / "log.txt"


@dataclass(frozen=True)
class Failure:
    """A run without figures."""

    drive: str
    program: str
    seed: int
    why: str


@dataclass
class Outcome:
    """What all runs gave."""

    rows: list[Row]
    failures: list[Failure]


def peer(text: str) -> Peer:
    """`NAME=PROGRAM`."""
    name, equals, program = text.partition("=")
    if not equals or not name or not program:
        raise ValueError("give a name and a program, such as amcl=./amcl")
    return Peer(name, Path(program))


def compare(drive: Drive, campaign: Campaign, outcome: Outcome) -> None:
    """Runs all programs on a drive, seed by seed."""
    scanner = carmen_log.Scanner(drive.range_max, drive.laser)
    log = carmen_log.read(drive.log, drive.reference, scanner)
    with tempfile.TemporaryDirectory() as name:
        given = Given(drive, log, Path(name))
        given.map_text().write_text(OccupancyMap.read(drive.map).text())
        given.log_text().write_text(log_text(log))
        for seed in campaign.seeds:
            for program, run in _runs(given, campaign, seed).items():
                try:
                    outcome.rows.append(Row(drive.name, program, seed, run()))
                except PeerError as error:
                    outcome.failures.append(Failure(drive.name, program, seed, str(error)))
                print(f"{drive.name}, seed {seed}: {program} is done", file=sys.stderr)


def _runs(given: Given, campaign: Campaign, seed: int) -> dict[str, Callable[[], Figures]]:
    """What is to be run with a seed, in this order."""
    own = OwnTask(given.drive, campaign.anywhere, seed, campaign.particles, given.folder)
    start = given.drive.start or next(iter(given.log.references()), None)
    if start is None and not campaign.anywhere:
        raise ValueError(f"{given.drive.name}: the log has no references: give a start or --global-start")
    start = None if campaign.anywhere else start
    task = Task(given.map_text(), given.log_text(), start, seed, campaign.particles)
    runs: dict[str, Callable[[], Figures]] = {NAME: partial(run_own, campaign.own, own, given.log, campaign.timeout_s)}
    for one in campaign.peers:
        runs[one.name] = partial(_peer_figures, one, task, given, campaign.timeout_s)
    return runs


def _peer_figures(one: Peer, task: Task, given: Given, timeout_s: float) -> Figures:
    return run_peer(one.program, task, given.log, timeout_s).figures(given.log, given.drive.end)


def _given_drives(options: argparse.Namespace) -> list[Drive]:
    drives = []
    for path in options.drives:
        if path.suffix == ".toml":
            drives += read_drives(path, options.folder)
        elif options.map is None:
            raise ValueError(f"{path}: a log needs --map")
        else:
            where = {"reference": options.reference, "start": options.start, "laser": options.laser}
            drives.append(Drive(path.stem, path, options.map, **where, range_max=options.range_max))
    return [drive for drive in drives if not options.only or drive.name in options.only]


def _present(drives: list[Drive], peers: list[Peer]) -> tuple[list[Drive], list[Peer]]:
    """Those whose files are there; says which are not."""
    for drive in drives:
        for path in drive.missing():
            print(f"{drive.name}: there is no {path}; the drive is left out", file=sys.stderr)
    for one in peers:
        if not one.program.is_file():
            print(f"{one.name}: there is no program {one.program}; it is left out", file=sys.stderr)
    there = [one for one in peers if one.program.is_file()]
    if not there:
        print(f"no peer to compare with: the rows are those of {NAME} alone; see --peer", file=sys.stderr)
    return [drive for drive in drives if not drive.missing()], there


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("drives", nargs="+", type=Path, metavar="DRIVES.toml|LOG", help="files of drives, or logs")
    parser.add_argument("--folder", type=Path, help="where paths in files of drives start; default: where the file is")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="of the drives, these alone")
    parser.add_argument("--map", type=Path, metavar="MAP.yaml", help="the map of a log")
    parser.add_argument("--reference", type=Path, metavar="LOG", help="a log whose poses are the references")
    parser.add_argument("--start", type=pose, metavar="X,Y,HEADING", help="default: where the first reference is")
    parser.add_argument("--laser", type=pose, metavar="X,Y,HEADING", help="where the laser sits on the robot")
    parser.add_argument("--range-max", type=float, default=30.0, metavar="M", help="ranges from here on met nothing")
    parser.add_argument("--global-start", action="store_true", help="start anywhere on the map")
    parser.add_argument(
        "--peer", type=peer, action="append", default=[], metavar="NAME=PROGRAM", help="may be repeated"
    )
    parser.add_argument("--program", type=Path, default=find_program(), help="curionav; default: the one built last")
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    parser.add_argument("--seeds", type=int, default=1, metavar="N", help="so many seeds, from --seed on")
    parser.add_argument("--particles", type=int, metavar="N", help="greatest number; default: each program's own")
    parser.add_argument("--timeout", type=float, default=3600.0, metavar="S", help="for each run")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="a line for each run")
    return parser


def main() -> int:
    """Prints the table, and what failed."""
    parser = _parser()
    options = parser.parse_args()
    if options.program is None or not options.program.is_file():
        parser.error("there is no program curionav: build it, or give --program")
    try:
        drives, peers = _present(_given_drives(options), options.peer)
        seeds = range(options.seed, options.seed + options.seeds)
        campaign = Campaign(options.program, peers, seeds, options.global_start, options.particles, options.timeout)
        outcome = Outcome([], [])
        for drive in drives:
            compare(drive, campaign, outcome)
            if options.csv:
                write_csv(options.csv, outcome.rows, "anywhere" if options.global_start else "given")
    except (OSError, ValueError) as error:
        parser.error(str(error))
    print(markdown(outcome.rows))
    for failure in outcome.failures:
        print(f"{failure.program} failed on {failure.drive}, seed {failure.seed}: {failure.why}", file=sys.stderr)
    return 1 if outcome.failures else 0


if __name__ == "__main__":
    sys.exit(main())
