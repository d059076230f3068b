"""The command ``python -m curionav.bags``."""

from __future__ import annotations

import argparse
import importlib.util
import logging
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CurionavError
from .planar import Pose2

if TYPE_CHECKING:
    from .robot_log import Written

_NEEDED = ("rosbags", "mcap")
"""What the extra brings."""

_EPILOG = """\
examples:
  python -m curionav.bags to-log monday.bag monday.log           # then: curionav localize monday.log --map ...
  python -m curionav.bags map monday.bag monday.yaml             # the map that is in the bag
  python -m curionav.bags people monday.bag monday.people.csv    # annotated people, for `curionav track`
  python -m curionav.bags from-recording drive.mcap drive_bag    # then: ros2 bag play drive_bag

A bag is a directory of rosbag2 (MCAP or SQLite), one of its files (.mcap, .db3), or a .bag of ROS 1.

status: 0 done; 2 bad input; 3 not installed.
"""

_TO_LOG = """\
Writes the scans and the odometry of a bag as a log of the Carmen toolkit, for `curionav localize` and
`curionav map build`. Where the bag says where the robot was on the map, that goes into a second log,
OUT.reference.log, which both commands take with --reference.

Read are sensor_msgs/LaserScan, nav_msgs/Odometry or transforms, and transforms from the robot to its laser.
Each scan gets the odometry of its own time, between the messages around it. Messages count by the stamp of
their header.
"""

_TO_LOG_EPILOG = """\
examples:
  python -m curionav.bags to-log monday.bag monday.log
  python -m curionav.bags to-log tour tour.log --scan /front/scan --odom /tf --reference /amcl_pose
  python -m curionav.bags to-log old.bag old.log --laser 0.2,0,0     # the bag has no transforms

  curionav map build monday.log --reference monday.reference.log --every 2 --out monday.yaml
  curionav localize monday.log --reference monday.reference.log --map monday.yaml
"""

_PEOPLE = """\
Writes the people who are annotated in a bag as a table with the columns stamp_s, x, y and id, for `--annotations`
of `curionav track`. x and y are in the frame of the robot, so `--annotations-frame robot` goes with it.

Read is leg_tracker/Person, as in the bags of leg_tracker_benchmarks: a place in the frame of the scanner, recorded
after the scan that it is of. Give the same options as to `to-log`.
"""

_PEOPLE_EPILOG = """\
examples:
  python -m curionav.bags people lobby.bag lobby.people.csv

  curionav track lobby.log --map lobby.yaml --reference lobby.reference.log \\
      --annotations lobby.people.csv --annotations-frame robot
"""

_FROM_RECORDING = """\
Writes a recording of `curionav record` or `run --record` as a bag of ROS 2 with storage MCAP, for
`ros2 bag play`, Foxglove and rosbags: /scan, /odom, /tf, /tf_static, /map, /cmd_vel, /plan, /people (markers)
and /amcl_pose (the belief). Of a simulated robot, /ground_truth says where it truly was.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 done, 2 bad input, 3 a package is not installed."""
    missing = [package for package in _NEEDED if importlib.util.find_spec(package) is None]
    options = _parser().parse_args(arguments)
    if missing:
        print(f"not installed: {', '.join(missing)}; `pip install {' '.join(missing)}` brings them", file=sys.stderr)
        return 3
    logging.basicConfig(format="%(message)s")
    run = {"to-log": _to_log, "map": _map, "people": _people, "from-recording": _from_recording}[options.command]
    try:
        run(options)
    except (CurionavError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="python -m curionav.bags",
        description="Turns bags of ROS 1 and ROS 2 into logs and maps of curionav, and recordings into bags.",
        epilog=_EPILOG,
        formatter_class=raw,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    log = commands.add_parser(
        "to-log", help="a drive as a log", description=_TO_LOG, epilog=_TO_LOG_EPILOG, formatter_class=raw
    )
    log.add_argument("bag", type=Path, metavar="BAG", help="directory or file")
    log.add_argument("out", type=Path, metavar="OUT.log", help="where the log goes")
    _add_drive_options(log)
    log.add_argument(
        "--reference",
        metavar="TOPIC",
        help="where the robot was on the map: a topic of PoseStamped, PoseWithCovarianceStamped or Odometry, /tf, or "
        "none (a topic named ground_truth, else /tf, else amcl_pose)",
    )
    log.add_argument("--map-frame", metavar="FRAME", default="map", help="frame of the map in transforms (map)")

    grid = commands.add_parser(
        "map",
        help="a map as files of map_server",
        description="Writes the last nav_msgs/OccupancyGrid of a bag as OUT.yaml and OUT.pgm.",
    )
    grid.add_argument("bag", type=Path, metavar="BAG", help="directory or file")
    grid.add_argument("out", type=Path, metavar="OUT.yaml", help="where the description goes; the image lies beside it")
    grid.add_argument("--topic", metavar="TOPIC", help="the map (the only topic of OccupancyGrid, or /map)")

    people = commands.add_parser(
        "people",
        help="annotated people as a table",
        description=_PEOPLE,
        epilog=_PEOPLE_EPILOG,
        formatter_class=raw,
    )
    people.add_argument("bag", type=Path, metavar="BAG", help="directory or file")
    people.add_argument("out", type=Path, metavar="OUT.csv", help="where the table goes")
    people.add_argument("--topic", metavar="TOPIC", help="the annotations (the only topic of leg_tracker/Person)")
    _add_drive_options(people)

    bag = commands.add_parser(
        "from-recording", help="a recording as a bag of ROS 2", description=_FROM_RECORDING, formatter_class=raw
    )
    bag.add_argument("recording", type=Path, metavar="DRIVE.mcap", help="the recording")
    bag.add_argument("out", type=Path, metavar="OUT", help="directory that becomes the bag; it must not exist yet")
    bag.add_argument("--robot", metavar="NAME", help="which robot (the only one)")
    return parser


def _add_drive_options(command: argparse.ArgumentParser) -> None:
    """What says where scans and odometry are, and where the scanner sits."""
    command.add_argument("--scan", metavar="TOPIC", help="scans (the only topic of LaserScan, or /scan)")
    command.add_argument(
        "--odom", metavar="TOPIC", help="odometry, or /tf (the only topic of Odometry, or /odom, or /tf)"
    )
    command.add_argument("--odom-frame", metavar="FRAME", help="frame of odometry (as odometry says, or odom)")
    command.add_argument("--base-frame", metavar="FRAME", help="frame of the robot (as odometry says)")
    command.add_argument(
        "--laser",
        type=_pose,
        metavar="X,Y,HEADING",
        help="where the laser sits on the robot, m and rad (as transforms say); write --laser=-0.1,0,0 with a minus",
    )


def _pose(text: str) -> Pose2:
    try:
        x, y, heading = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError("give three numbers with commas between them, such as 0.2,0,0") from None
    return Pose2(x, y, heading)


def _to_log(options: argparse.Namespace) -> None:
    from .robot_log import write_log  # noqa: PLC0415 - once it is sure that rosbags is there
    from .topics import Choice  # noqa: PLC0415

    choice = Choice(
        scan=options.scan,
        odometry=options.odom,
        reference=options.reference,
        map_frame=options.map_frame,
        odometry_frame=options.odom_frame,
        base_frame=options.base_frame,
        laser=options.laser,
    )
    written = write_log(options.bag, options.out, choice)
    mount = written.mount
    print(f"{written.log}: {written.scans} scans of `{written.scan_topic}`, odometry by {written.odometry_from}")
    print(f"the laser sits at {mount.x:.3f},{mount.y:.3f},{mount.heading:.3f} on the robot (m, m, rad)")
    if written.scans_left_out:
        print(f"left out: {written.scans_left_out} scans without odometry within a second")
    for note in written.notes:
        print(f"left out: {note}")
    if written.reference_log is not None:
        print(f"{written.reference_log}: {written.references} references by {written.reference_from}")
    else:
        print("references: none; nothing in the bag says where the robot was on the map")
    print(f"next: {_next_command(written)}")


def _next_command(written: Written) -> str:
    from .robot_log import USUAL_RANGE  # noqa: PLC0415

    start = f"--reference {written.reference_log}" if written.reference_log is not None else "--global"
    far = f" --range-max {written.range_max:g}" if written.range_max > USUAL_RANGE else ""
    return f"curionav localize {written.log} --map MAP.yaml {start}{far}"


def _map(options: argparse.Namespace) -> None:
    from .grid import write_map  # noqa: PLC0415

    written = write_map(options.bag, options.out, options.topic)
    size = f"{written.width} x {written.height} cells of {written.resolution:g} m"
    print(f"{options.out}: {size}, from `{written.topic}`")


def _people(options: argparse.Namespace) -> None:
    from .annotations import write_people  # noqa: PLC0415
    from .topics import Choice  # noqa: PLC0415

    choice = Choice(
        scan=options.scan,
        odometry=options.odom,
        odometry_frame=options.odom_frame,
        base_frame=options.base_frame,
        laser=options.laser,
    )
    written = write_people(options.bag, options.out, choice, options.topic)
    print(f"{written.table}: {written.people} people in {written.scans} scans, from `{written.topic}`")
    if written.before_scans:
        print(f"left out: {written.before_scans} annotations before the first scan")
    print(f"next: curionav track LOG --map MAP.yaml --annotations {written.table} --annotations-frame robot")


def _from_recording(options: argparse.Namespace) -> None:
    from .recorded import write_bag  # noqa: PLC0415

    written = write_bag(options.recording, options.out, options.robot)
    print(f"{written.path}: {', '.join(f'{topic} ({count})' for topic, count in sorted(written.counts.items()))}")


if __name__ == "__main__":
    sys.exit(main())
