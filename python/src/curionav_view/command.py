"""The program `curionav-view`."""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import signal
import sys
import threading
import time
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from curionav.errors import CurionavError
from curionav.keys import is_name
from curionav.messages import Mission

if TYPE_CHECKING:
    from .output import Output, Wanted

_NEEDED = {"rerun": "rerun-sdk", "mcap": "mcap"}

_DESCRIPTION = """\
Shows what a curionav robot senses, believes, considers and decides, in Rerun (https://rerun.io).

Live, with a deployment up (`curionav up`), or from a recording (`curionav record`, `curionav run --record`):
the map, the laser, where the robot believes it is, people and the density of crowds, every candidate
coloured by its cost, the decision in words, and plots of uncertainty, distance to people, speed and the
time a cycle takes. Move the time line to go back; double-click a view to fill the window with it.
"""

_EPILOG = """\
examples:
  curionav-view                                   live from tcp/127.0.0.1:7447, in a window
  curionav-view --web                             the same in a browser
  curionav-view --connect tcp/10.0.0.5:7447 --robot r2 --save r2.rrd
  curionav-view out.mcap                          a recording
  curionav-view out.mcap --save out.rrd           converts it; `rerun out.rrd` shows it

The page of --web is for this machine only. From another one: ssh -L 9090:127.0.0.1:9090
-L 9876:127.0.0.1:9876 HOST, and the printed address there.

status: 0 shown, or ended by Ctrl-C; 1 the connection or the recording failed; 2 bad input or nothing to show it on;
3 not installed.
"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="curionav-view",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("recording", nargs="?", type=Path, metavar="RECORDING.mcap", help="show this instead of live")
    live = parser.add_argument_group("what to listen to")
    live.add_argument("--connect", metavar="ENDPOINT", help="router, such as tcp/10.0.0.5:7447 (tcp/127.0.0.1:7447)")
    live.add_argument("--namespace", metavar="NS", help="prefix of the deployment's keys, if it has one")
    live.add_argument("--config", metavar="FILE", help="Zenoh configuration (json5), or ZENOH_CONFIG names it")
    live.add_argument("--secure", metavar="DIR", help="folder of certificates, as `curionav secure` makes it: use TLS")
    live.add_argument("--as", dest="certificate", metavar="NAME", default="viewer", help="its certificate (viewer)")
    live.add_argument("--robot", metavar="NAME", help="which robot (live: robot; recording: its only one)")
    live.add_argument("--world", metavar="NAME", default="world", help="simulated world, for the end of runs (world)")
    live.add_argument("--once", action="store_true", help="end with the run under way, or the next if there is none")
    parser.add_argument("--supervised", action="store_true", help=argparse.SUPPRESS)  # end when standard input closes
    where = parser.add_argument_group("where to show it")
    where.add_argument(
        "--spawn", action="store_true", help="a window on this screen: without --web or --save the default"
    )
    where.add_argument("--web", action="store_true", help="a page for the browser, on this machine only")
    where.add_argument(
        "--save", type=Path, metavar="FILE.rrd", help="write a file for `rerun`; a further run: FILE-2.rrd"
    )
    where.add_argument("--no-browser", action="store_true", help="with --web: do not open the browser, only say where")
    where.add_argument("--port", type=_port, default=9876, help="Rerun's port; another if it is taken (9876)")
    where.add_argument("--web-port", type=_port, default=9090, help="port of the page; another if it is taken (9090)")
    where.add_argument("--memory", default="1GiB", metavar="SIZE", help="kept to look back at; the oldest goes (1GiB)")
    return parser


def _port(text: str) -> int:
    port = int(text)
    if not 0 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"{text} is no port: 0 (any free one) to 65535")
    return port


def main(arguments: list[str] | None = None) -> int:
    """Runs the program; gives its exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.spawn and options.web:
        parser.error("--spawn and --web: choose one")
    for name in ("robot", "world"):
        value = getattr(options, name)
        if value is not None and not is_name(value):
            parser.error(f"--{name} {value!r}: a name is 1 to 64 of the characters a-z, 0-9, `_` and `-`")
    missing = [package for module, package in _NEEDED.items() if importlib.util.find_spec(module) is None]
    if missing:
        _say(f"not installed: {', '.join(missing)}; `pip install {' '.join(missing)}` brings them")
        return 3
    try:
        with _interruptible():
            if options.supervised:
                threading.Thread(target=_end_with_supervisor, daemon=True).start()
            return _show(options)
    except KeyboardInterrupt:
        return 0


@contextlib.contextmanager
def _interruptible() -> Iterator[None]:
    """SIGTERM ends it as Ctrl-C does; what was started is ended on the way out.

    From then on SIGTERM is ignored: the program that started this one may hear the same Ctrl-C and end it as well, and
    that would leave Rerun's program behind. Another Ctrl-C is not ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = [(number, signal.signal(number, end)) for number in (signal.SIGINT, signal.SIGTERM)]
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGTERM) is end:
            for number, handler in before:
                signal.signal(number, handler)


def _end_with_supervisor() -> None:
    """Ends this program once its standard input, into which nothing is written, closes."""
    # Not by `sys.stdin`: a thread that waits in it would abort the program when it ends by itself.
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


def _show(options: argparse.Namespace) -> int:
    # Here, so that --help and the message about what is missing do without them.
    from .output import NoOutput, Output, Wanted  # noqa: PLC0415

    wanted = Wanted(
        spawn=options.spawn or not (options.web or options.save),
        web=options.web,
        save=options.save,
        port=options.port,
        web_port=options.web_port,
        memory=options.memory,
    )
    try:
        with Output(wanted) as output:
            if output.page is not None:
                _say(f"open {output.page}")
                if not options.no_browser:
                    webbrowser.open(output.page)
            if options.recording is not None:
                _replay(options, output, wanted)
            else:
                _follow(options, output)
            output.check()
    except NoOutput as error:
        _say(str(error))
        return 2
    except CurionavError as error:
        _say(str(error))
        return 1
    return 0


def _replay(options: argparse.Namespace, output: Output, wanted: Wanted) -> None:
    from curionav import recording  # noqa: PLC0415

    from .scene_logger import SceneLogger  # noqa: PLC0415

    scene_logger: SceneLogger | None = None
    run: int | None = None
    count = 0
    for message in recording.messages(options.recording, options.robot):
        started = message.run if isinstance(message, Mission) else None
        if scene_logger is None or (started is not None and run is not None and started != run):
            grid = scene_logger.grid if scene_logger is not None else None
            scene_logger = SceneLogger(output.recording(options.recording.stem, live=False))
            if grid is not None:
                scene_logger.draw(grid)
        run = started if started is not None else run
        scene_logger.draw(message)
        count += 1
    output.finish()
    output.check()
    _say(f"{count} messages of {options.recording} are shown" + (f", saved in {wanted.save}" if wanted.save else ""))
    while (wanted.spawn or wanted.web) and output.alive():
        time.sleep(0.2)


def _follow(options: argparse.Namespace, output: Output) -> None:
    from .live import Live, Source  # noqa: PLC0415
    from .scene_logger import SceneLogger  # noqa: PLC0415

    source = Source(
        options.connect,
        options.namespace,
        options.config,
        robot=options.robot or "robot",
        world=options.world,
        secure=options.secure,
        certificate=options.certificate,
    )
    live = Live(
        source,
        lambda name: SceneLogger(output.recording(name)),
        _say,
        # Files are for runs.
        (lambda name: SceneLogger(output.recording(name, saved=False))) if output.is_watched else None,
    )
    try:
        live.follow(output.alive, options.once)
    finally:
        live.close()
        if live.lost:
            _say(f"{live.lost} messages came faster than they could be drawn and were left out")


def _say(text: str) -> None:
    print(f"curionav-view: {text}", file=sys.stderr, flush=True)  # noqa: T201
