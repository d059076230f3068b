"""The viewer's page in a real browser, rendered in software."""

from __future__ import annotations

import io
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rerun", reason="skipped: no rerun-sdk; pip install './python[viewer-test]'")
pytest.importorskip("mcap", reason="skipped: no mcap; pip install './python[viewer-test]'")
sync_api = pytest.importorskip(
    "playwright.sync_api", reason="skipped: no playwright; pip install './python[viewer-test]'"
)
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium")
if CHROMIUM is None:
    pytest.skip("skipped: no chromium; `apt-get install chromium`, or set CHROMIUM", allow_module_level=True)

import drive  # noqa: E402
from PIL import Image  # noqa: E402

from curionav_view import colours  # noqa: E402

FLAGS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader",
]  # fmt: skip
START_TIMEOUT = 60.0
FRAME_TIMEOUT = 240.0
"""A busy machine without a graphics card takes its time."""


@pytest.fixture
def page(tmp_path: Path) -> Iterator[str]:
    """Address of a page with a made-up drive."""
    file = drive.record(tmp_path / "drive.mcap", drive.drive(30))
    process = subprocess.Popen(
        [sys.executable, "-m", "curionav_view", file, "--web", "--no-browser", "--port", "0", "--web-port", "0"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        found = re.search(r"http://\S+", process.stderr.readline())
        assert found, "no address was printed"
        assert "are shown" in process.stderr.readline()
        yield found.group()
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stderr.close()


def near(pixels: np.ndarray[tuple[int, int, int], np.dtype[np.int16]], colour: tuple[int, ...]) -> int:
    """Pixels that are about of this colour; shading and anti-aliasing change it a little."""
    return int((np.abs(pixels - np.array(colour[:3])).max(axis=-1) < 40).sum())


def test_the_page_shows_the_scene(page: str, tmp_path: Path) -> None:
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=FLAGS)
        try:
            tab = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme="dark")
            tab.goto(page, timeout=START_TIMEOUT * 1000)
            deadline = time.monotonic() + FRAME_TIMEOUT
            while True:
                tab.wait_for_timeout(2000)
                shot = tab.screenshot(timeout=START_TIMEOUT * 1000)
                picture = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), np.int16)
                # The left part is the surroundings of the robot.
                scene = picture[50:480, :570]
                seen = {
                    "shades": len(np.unique(picture.reshape(-1, 3), axis=0)),
                    "decided trajectory": near(scene, colours.ACTIONS["follow"]),
                    "cheapest candidate": near(scene, (253, 231, 37)),
                    "person": near(scene, colours.PERSON),
                    "plots": near(picture[:, 950:], colours.SERIES["uncertainty"]),
                }
                if seen["shades"] > 1000 and all(count > 20 for count in seen.values()):
                    break
                if time.monotonic() > deadline:
                    (tmp_path / "page.png").write_bytes(shot)
                    pytest.fail(f"the scene is not there: {seen}; see {tmp_path / 'page.png'}")
        finally:
            browser.close()
