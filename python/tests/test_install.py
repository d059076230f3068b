"""What is published: the wheel with the program, and that a newcomer gets through the tutorials with nothing else."""

from __future__ import annotations

import contextlib
import functools
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import tutorial
from contract import ROOT
from live import program

pytest.importorskip("hatchling", reason="no hatchling; pip install './python[test]'")
pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(not (ROOT / "docs").is_dir(), reason="no documents beside the package"),
]

TIMEOUT = 900.0
"""For all of a page on a busy machine, s."""
FIRST = tutorial.PAGES / "first-run.md"
STARTS = ROOT / "docs" / "start"
PAGES = sorted(set(tutorial.PAGES.glob("*.md")) - {FIRST}) + sorted(STARTS.glob("*.md"))


@dataclass(frozen=True)
class Newcomer:
    """How far a user without a checkout has got: the wheels at hand, and an environment for the next page."""

    folder: Path
    environment: dict[str, str]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel with the program that has been built."""
    folder = tmp_path_factory.mktemp("wheel")
    (folder / "dist" / "bin").mkdir(parents=True)
    shutil.copy(program(), folder / "dist" / "bin" / "curionav")
    (folder / "dist" / "lib").mkdir()
    module = pytest.importorskip("curionav_native", reason="no extension module; pip install ./python with Cargo")
    shutil.copy(module.__file__, folder / "dist" / "lib" / "curionav_native.abi3.so")
    shutil.copy(ROOT / "LICENSE", folder / "dist")
    shutil.copy(ROOT / "crates" / "cli" / "licences.txt", folder / "dist" / "THIRD-PARTY.txt")
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder,
         ROOT / "python"],
        env={**os.environ, "CURIONAV_DIST": str(folder / "dist")}, check=True,
    )  # fmt: skip
    (built,) = folder.glob("*.whl")
    return built


@functools.cache
def own_network() -> tuple[str, ...]:
    """What runs a file of commands on a network of loopback alone, since the pages name ports; else plainly."""
    for unshare in (["unshare", "--net"], ["unshare", "--map-root-user", "--net"]):
        command = (*unshare, "bash", "-c", 'ip link set lo up && exec bash "$0"')
        with contextlib.suppress(FileNotFoundError):
            if subprocess.run([*command, "/dev/null"], capture_output=True, check=False).returncode == 0:
                return command
    return ("bash",)


def play(page: Path, folder: Path, environment: dict[str, str]) -> str:
    """Does what the page says; gives what was printed."""
    file = folder / f"{page.stem}.sh"
    file.write_text(tutorial.script(page))
    with (folder / f"{page.stem}.log").open("w+") as log:
        process = subprocess.Popen(
            [*own_network(), file], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
            start_new_session=True,
        )  # fmt: skip
        try:
            status = process.wait(TIMEOUT)
        finally:
            end_group(process.pid)
        log.seek(0)
        printed = log.read()
    assert status == 0, f"{page.name}:\n{printed}"
    return printed


def end_group(group: int) -> None:
    """Ends what a page has started in its other terminals, and waits for it."""
    for way in (signal.SIGTERM, signal.SIGKILL):
        # Once: a second signal would interrupt those that are cleaning up.
        with contextlib.suppress(ProcessLookupError):
            os.killpg(group, way)
        deadline = time.monotonic() + 20.0
        while time.monotonic() < deadline:
            try:
                os.killpg(group, 0)
            except ProcessLookupError:
                return
            time.sleep(0.1)


@pytest.fixture(scope="module")
def newcomer(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Newcomer]:
    """The first page done, literally; `pip` finds our wheel alone, and the packages it needs are those of the tests."""
    folder = tmp_path_factory.mktemp("newcomer")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("CURIONAV_", "PIP_"))}
    environment |= {
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(wheel.parent),
        "PIP_NO_DEPS": "1",
        "PIP_IGNORE_INSTALLED": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        "PYTHONPATH": sysconfig.get_path("purelib"),
        # What the demo opens its page with.
        "BROWSER": "true",
        "DISPLAY": "",
        "WAYLAND_DISPLAY": "",
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    }
    (folder / "first").mkdir()
    shutil.copy(wheel, folder / "first")
    play(FIRST, folder / "first", environment)
    installed = folder / "first" / "venv" / "bin"
    yield Newcomer(folder, {**environment, "PATH": os.pathsep.join([str(installed), os.environ["PATH"]])})


def test_the_wheel_holds_the_program_for_this_machine_and_the_licences(wheel: Path) -> None:
    assert re.fullmatch(rf"curionav-[\d.]+-cp311-abi3-linux_{os.uname().machine}\.whl", wheel.name), wheel.name
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (script,) = [name for name in names if name.endswith(".data/scripts/curionav")]
        assert archive.read(script) == program().read_bytes()
    packages = (r"curionav/__init__\.py", r"curionav_native\.abi3\.so", r"curionav_view/command\.py")
    for wanted in (*packages, r".*/LICENSE", r".*/THIRD-PARTY\.txt"):
        assert any(re.fullmatch(wanted, name) for name in names), wanted


def test_program_and_package_have_one_version() -> None:
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    assert tomllib.loads((ROOT / "python" / "pyproject.toml").read_text())["project"]["version"] == cargo
    shown = subprocess.run([program(), "--version"], capture_output=True, text=True, check=True).stdout
    assert shown == f"curionav {cargo}\n"


def test_the_list_of_what_is_inside_is_up_to_date() -> None:
    if shutil.which("cargo") is None:
        pytest.skip("no cargo to list the crates with")
    listed = subprocess.run(
        [sys.executable, ROOT / "deploy" / "licences.py"], capture_output=True, text=True, check=False
    )
    assert listed.returncode == 0, listed.stderr
    committed = (ROOT / "crates" / "cli" / "licences.txt").read_text()
    assert listed.stdout == committed, "run: python deploy/licences.py > crates/cli/licences.txt"


def test_the_crate_for_the_registry_has_the_licence_itself() -> None:
    # A link would be packed as it is.
    assert (ROOT / "crates" / "planning" / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_the_first_page_leaves_a_picture(newcomer: Newcomer) -> None:
    assert "<svg" in (newcomer.folder / "first" / "first" / "run.svg").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_runs_as_it_is_written(newcomer: Newcomer, page: Path) -> None:
    folder = newcomer.folder / page.stem
    folder.mkdir()
    play(page, folder, newcomer.environment)
