"""The viewer's page in a real browser, rendered in software."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live import deployment, hall

pytest.importorskip("rerun", reason="no rerun-sdk; pip install './python[viewer-test]'")
pytest.importorskip("mcap", reason="no mcap; pip install './python[viewer-test]'")
sync_api = pytest.importorskip("playwright.sync_api", reason="no playwright; pip install './python[viewer-test]'")
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium")
if CHROMIUM is None:
    pytest.skip("no chromium; `apt-get install chromium`, or set CHROMIUM", allow_module_level=True)

import drive  # noqa: E402
from PIL import Image  # noqa: E402

import curionav  # noqa: E402
from curionav import Scenario  # noqa: E402
from curionav_view import colours  # noqa: E402

FLAGS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader",
]  # fmt: skip
START_TIMEOUT = 60.0
FRAME_TIMEOUT = 240.0
"""A busy machine without a graphics card takes its time."""

Pixels = np.ndarray[Any, np.dtype[np.int16]]


@contextmanager
def served(*arguments: object) -> Iterator[str]:
    """Address of the page of a viewer."""
    process = subprocess.Popen(
        [sys.executable, "-m", "curionav_view", *map(str, arguments), "--web", "--no-browser", "--port", "0",
         "--web-port", "0"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        found = re.search(r"http://\S+", process.stderr.readline())
        assert found, "no address was printed"
        yield found.group()
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stderr.close()


@contextmanager
def opened(address: str) -> Iterator[Any]:
    """A tab of a browser with the page."""
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=FLAGS)
        try:
            tab = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme="dark")
            tab.goto(address, timeout=START_TIMEOUT * 1000)
            yield tab
        finally:
            browser.close()


def near(pixels: Pixels, colour: tuple[int, ...], by: int = 40) -> int:
    """Pixels that are about of this colour; shading and anti-aliasing change it a little."""
    return int((np.abs(pixels - np.array(colour[:3])).max(axis=-1) < by).sum())


def wait_for(tab: Any, look: Callable[[Pixels], dict[str, int]], directory: Path) -> None:
    """Waits until everything looked for is there: more than twenty pixels of it."""
    deadline = time.monotonic() + FRAME_TIMEOUT
    while True:
        tab.wait_for_timeout(1000)
        shot = tab.screenshot(timeout=START_TIMEOUT * 1000)
        picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), np.int16)
        seen = look(picture)
        if len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000 and all(count > 20 for count in seen.values()):
            return
        if time.monotonic() > deadline:
            (directory / "page.png").write_bytes(shot)
            pytest.fail(f"the scene is not there: {seen}; see {directory / 'page.png'}")


def scene(picture: Pixels) -> Pixels:
    """The left part: the surroundings of the robot."""
    return picture[50:480, :570]


def test_the_page_shows_a_recording(tmp_path: Path) -> None:
    def look(picture: Pixels) -> dict[str, int]:
        return {
            "decided trajectory": near(scene(picture), colours.ACTIONS["follow"]),
            "cheapest candidate": near(scene(picture), (253, 231, 37)),
            "person": near(scene(picture), colours.PERSON),
            "plots": near(picture[:, 950:], colours.SERIES["uncertainty"]),
        }

    file = drive.record(tmp_path / "drive.mcap", drive.drive(30))
    with served(file) as address, opened(address) as tab:
        wait_for(tab, look, tmp_path)


@pytest.mark.live
def test_the_page_shows_a_run_that_was_over_before_and_then_the_next(tmp_path: Path) -> None:
    def late(picture: Pixels) -> dict[str, int]:
        return {
            "wall": near(scene(picture), colours.WALL, 12),
            "way": near(scene(picture), colours.BELIEF),
            "plots": near(picture[:, 950:], colours.SERIES["speed"]),
        }

    def running(picture: Pixels) -> dict[str, int]:
        # A result knows neither.
        return {
            "laser": near(scene(picture), colours.SCAN),
            "plots": near(picture[:, 950:], colours.SERIES["uncertainty"]),
        }

    with deployment(tmp_path) as up, curionav.connect(up.endpoint) as connection:
        scenario = Scenario.from_dict(hall(tmp_path), tmp_path)
        with connection.inject(scenario, seed=3) as run:
            run.wait(120.0)
        with served("--connect", up.endpoint) as address, opened(address) as tab:
            wait_for(tab, late, tmp_path)
            with connection.inject(scenario, seed=4) as run:
                run.wait(120.0)
            wait_for(tab, running, tmp_path)
