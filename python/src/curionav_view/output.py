"""Where the picture goes: a viewer on this screen, a page for browsers, a file; each started here ends with us."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import IO
from urllib.parse import quote

import rerun as rr

from curionav.closable import Closable
from curionav.errors import CurionavError

APPLICATION = "curionav"
"""Rerun keeps one layout an application."""
HOST = "127.0.0.1"
"""Only this machine sees the page: what is shown may be private."""
_LIVE_TICK, _STORED_TICK = timedelta(seconds=0.2), timedelta(seconds=5.0)
"""How long what was drawn may wait for company: a viewer takes in a few large pieces sooner than many small ones."""
_START_TIMEOUT = 20.0
_STOP_TIMEOUT = 3.0
_FLUSH = 1.0
_INSTEAD = "--web shows it in a browser, --save FILE.rrd writes a file for `rerun FILE.rrd`"


class NoOutput(CurionavError):  # noqa: N818 - reads as what it is
    """There is nowhere to show it: no screen, no free port, or no viewer."""


@dataclass(frozen=True)
class Wanted:
    """What the command line asked for: a native viewer, a page, a file, or a file beside one of them."""

    spawn: bool = True
    web: bool = False
    save: Path | None = None
    port: int = 9876
    web_port: int = 9090
    memory: str = "1GiB"


class Output(Closable):
    """Opens recordings, one for each run, all in the same viewer; a context manager that ends what it has started."""

    def __init__(self, wanted: Wanted) -> None:
        self._wanted = wanted
        self._viewer: subprocess.Popen[bytes] | None = None
        self._complaints: IO[bytes] | None = None
        self._open: rr.RecordingStream | None = None
        self._files = 0
        self.page: str | None = None
        if wanted.spawn and not wanted.web and not has_display():
            raise NoOutput(f"there is no display here (neither DISPLAY nor WAYLAND_DISPLAY is set): {_INSTEAD}")
        if wanted.save is not None and not wanted.save.absolute().parent.is_dir():
            raise NoOutput(f"there is no directory {wanted.save.absolute().parent} to save into")
        self._port = _free(wanted.port) if wanted.spawn or wanted.web else None
        try:
            if self._port is not None:
                self._start(self._port)
        except BaseException:
            self.close()
            raise

    def _start(self, port: int) -> None:
        arguments = ["--bind", HOST, "--port", str(port)]
        if self._wanted.web:
            page_port = _free(self._wanted.web_port, other=port)
            arguments += ["--serve-web", "--web-viewer-port", str(page_port)]
            arguments += ["--server-memory-limit", self._wanted.memory]
            source = quote(f"rerun+http://{HOST}:{port}/proxy", safe="")
            self.page = f"http://{HOST}:{page_port}/?url={source}"
        else:
            arguments += ["--hide-welcome-screen", "--expect-data-soon", "--memory-limit", self._wanted.memory]
        self._complaints = tempfile.TemporaryFile()  # noqa: SIM115 - read when the viewer has ended
        # A group of its own: Ctrl-C reaches us first, and what was logged is sent before the viewer ends.
        self._viewer = subprocess.Popen(
            [sys.executable, "-m", "rerun_cli", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._complaints,
            start_new_session=True,
        )
        for waited in (port, page_port) if self._wanted.web else (port,):
            self._wait_for(waited)

    def _wait_for(self, port: int) -> None:
        deadline = time.monotonic() + _START_TIMEOUT
        while True:
            with contextlib.suppress(OSError), socket.create_connection((HOST, port), 1.0):
                return
            self.check()
            if not self.alive() or time.monotonic() > deadline:
                raise NoOutput(f"the viewer did not start: try `rerun` by itself to see why; {_INSTEAD}")
            time.sleep(0.05)

    @property
    def is_watched(self) -> bool:
        """Whether there is a viewer or a page, and not only a file."""
        return self._port is not None

    def recording(self, name: str, live: bool = True, saved: bool = True) -> rr.RecordingStream:
        """A new recording, which takes the place of the one before it.

        One that is not ``live`` is sent in large pieces; one that is not to be ``saved`` goes into no file.
        """
        self.finish()
        batches = rr.ChunkBatcherConfig(flush_tick=_LIVE_TICK if live else _STORED_TICK)
        recording = rr.RecordingStream(APPLICATION, batcher_config=batches)
        sinks: list[rr.GrpcSink | rr.FileSink] = []
        if self._port is not None:
            sinks.append(rr.GrpcSink(f"rerun+http://{HOST}:{self._port}/proxy"))
        if self._wanted.save is not None and saved:
            sinks.append(rr.FileSink(self._file(self._wanted.save)))
        recording.set_sinks(*sinks)
        recording.send_recording_name(name)
        self._open = recording
        return recording

    def _file(self, path: Path) -> str:
        """The file asked for, and for further runs others beside it."""
        self._files += 1
        return str(path if self._files == 1 else path.with_stem(f"{path.stem}-{self._files}"))

    def alive(self) -> bool:
        """Whether a viewer is still open."""
        return self._viewer is None or self._viewer.poll() is None

    def check(self) -> None:
        """Raises NoOutput if the viewer has failed; one whose window was closed has not."""
        code = self._viewer.poll() if self._viewer is not None else None
        if code is None:
            return
        errors: list[str] = []
        if self._complaints is not None:
            self._complaints.seek(0)
            said = self._complaints.read().decode(errors="replace")
            errors = [line for line in said.splitlines() if line.startswith("Error:")]
        # Rerun's program says that it has failed, and not by its status.
        if code or errors:
            why = f" ({errors[-1][:200]})" if errors else f" with status {code}"
            raise NoOutput(f"the viewer ended{why}: {_INSTEAD}")

    def finish(self) -> None:
        """Sends or writes what is still on its way; without a viewer it waits for nothing."""
        recording, self._open = self._open, None
        if recording is None:
            return
        while True:
            try:
                # By pieces: Rerun waits for ever for a viewer that has ended, and hears no Ctrl-C meanwhile.
                recording.flush(timeout_sec=_FLUSH)
            except RuntimeError:
                self.check()
                if self.alive():
                    continue
            break
        recording.disconnect()

    def close(self) -> None:
        """Completes the file and ends the viewer. Does nothing the second time."""
        if self.alive():
            self.finish()
        self._open = None
        viewer, self._viewer = self._viewer, None
        complaints, self._complaints = self._complaints, None
        if complaints is not None:
            complaints.close()
        if viewer is None:
            return
        for way in (signal.SIGTERM, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(viewer.pid, way)
            with contextlib.suppress(subprocess.TimeoutExpired):
                viewer.wait(_STOP_TIMEOUT)
                break


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY"))


def _free(port: int, other: int | None = None) -> int:
    """The port if it is free, else one that is."""
    for wanted in (port, 0, 0, 0):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((HOST, wanted))
            found: int = probe.getsockname()[1]
            if found != other:
                return found
    raise NoOutput(f"neither port {port} nor any other is free on {HOST}")
