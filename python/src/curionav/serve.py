"""Serves the evaluators of a Python file: ``python -m curionav.serve FILE --connect ENDPOINT --replicas N``.

Every replica is a process of its own. One that ends by itself is started again; Ctrl-C, or the end of this process
in any way, ends them all.
"""

from __future__ import annotations

import argparse
import logging
import runpy
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from .deployment import connect
from .errors import CurionavError
from .evaluation import Evaluator
from .session import DEFAULT_ENDPOINT

_RESTARTS_A_MINUTE = 5
_STOP_TIMEOUT = 5.0
"""How long a replica may take to end, seconds."""
_LOOK_PERIOD = 0.2
_WAKE_PERIOD = 1.0
"""Length of the pieces a wait is cut into, so that Ctrl-C gets through on every system, seconds."""

_log = logging.getLogger("curionav")


def main(arguments: list[str] | None = None) -> int:
    """Exit status: 0 ended on request, 2 bad input, 3 no deployment or too many restarts."""
    parser = argparse.ArgumentParser(
        prog="python -m curionav.serve", description="Serves the evaluators that a Python file defines."
    )
    parser.add_argument("file", help="Python file with functions decorated with @curionav.evaluator")
    parser.add_argument("--connect", metavar="ENDPOINT", help=f"router of the deployment; default: {DEFAULT_ENDPOINT}")
    parser.add_argument("--namespace", help="key prefix of the deployment")
    parser.add_argument("--config", help="Zenoh configuration file to start from")
    parser.add_argument("--secure", metavar="DIR", help="folder of certificates: connect over TLS; needs --instance")
    parser.add_argument("--instance", metavar="NAME", help="name of the replica; of several NAME-0, NAME-1, ...")
    parser.add_argument("--replicas", type=int, default=1, help="processes; default: 1")
    parser.add_argument("--slots", type=int, default=1, help="questions a replica computes at once; default: 1")
    parser.add_argument("--queue", type=int, default=16, help="questions that may wait for each; default: 16")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    given = sys.argv[1:] if arguments is None else arguments
    options = parser.parse_args(given)
    if options.secure is not None and options.instance is None:
        parser.error("--secure needs --instance: certificates are named TERM.INSTANCE")
    if options.replicas < 1 or options.slots < 1 or options.queue < 1:
        parser.error("replicas, slots and queue must be at least 1")
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        if options.replicas > 1:
            _load(options.file)
            return _supervise([*given, "--replicas", "1", "--child"], options.replicas, options.instance)
        return _serve(options)
    except KeyboardInterrupt:
        return 0
    except _BadFileError as error:
        print(error, file=sys.stderr)  # noqa: T201 - a program's message to its user
        return 2
    except CurionavError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 3


class _BadFileError(Exception):
    """The file cannot be served."""


def _load(file: str) -> list[Evaluator]:
    """The evaluators a file defines, each once."""
    directory = str(Path(file).resolve().parent)
    if directory not in sys.path:
        sys.path.insert(0, directory)
    try:
        names = runpy.run_path(file, run_name="curionav_served")
    except Exception as error:
        raise _BadFileError(f"{file}: {type(error).__name__}: {error}") from error
    found = {id(value): value for value in names.values() if isinstance(value, Evaluator)}
    if not found:
        raise _BadFileError(f"{file}: no function in it is decorated with @curionav.evaluator")
    return list(found.values())


def _serve(options: argparse.Namespace) -> int:
    """One replica of each evaluator, until it is told to end."""
    evaluators = _load(options.file)
    with ExitStack() as servers:
        ended = threading.Event()
        deployment = None
        for evaluator in evaluators:
            # Each term has a certificate, and so a connection, of its own.
            if deployment is None or options.secure is not None:
                certificate = f"{evaluator.term}.{options.instance}"
                given = (options.connect, options.namespace, options.config)
                deployment = connect(*given, secure=options.secure, certificate=certificate)
                servers.enter_context(deployment)
            server = deployment.serve(evaluator, options.instance, slots=options.slots, queue=options.queue)
            servers.enter_context(server)
            _log.info("serving %s as %s", server.term, server.instance)
        if options.child:
            # Its end of the pipe closes with the parent, however that one ends.
            threading.Thread(target=_until_end_of_input, args=(ended,), daemon=True).start()
        while not ended.wait(_WAKE_PERIOD):
            pass
    return 0


def _until_end_of_input(ended: threading.Event) -> None:
    sys.stdin.read()
    ended.set()


def _supervise(arguments: list[str], replicas: int, instance: str | None) -> int:
    """Keeps ``replicas`` processes going, named after ``instance`` if there is such a name."""

    def start(index: int) -> subprocess.Popen[bytes]:
        name = [] if instance is None else ["--instance", f"{instance}-{index}"]
        return subprocess.Popen([sys.executable, "-m", "curionav.serve", *arguments, *name], stdin=subprocess.PIPE)

    children: list[subprocess.Popen[bytes]] = []
    restarts: list[float] = []
    try:
        while len(children) < replicas:
            children.append(start(len(children)))
        while True:
            for index, child in enumerate(children):
                status = child.poll()
                if status is None:
                    continue
                restarts = [at for at in restarts if time.monotonic() - at < 60.0]
                if status in {2, 3} or len(restarts) >= _RESTARTS_A_MINUTE:
                    _log.error("a replica ended with status %d and is not started again", status)
                    return status if status in {2, 3} else 3
                _log.warning("a replica ended with status %d: starting another", status)
                restarts.append(time.monotonic())
                children[index] = start(index)
            time.sleep(_LOOK_PERIOD)
    finally:
        _stop(children)


def _stop(children: list[subprocess.Popen[bytes]]) -> None:
    for child in children:
        if child.stdin is not None:
            child.stdin.close()
    deadline = time.monotonic() + _STOP_TIMEOUT
    for child in children:
        try:
            child.wait(max(0.1, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


if __name__ == "__main__":
    sys.exit(main())
