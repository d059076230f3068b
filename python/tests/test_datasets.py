"""Datasets are downloaded whole or not at all, and found by one variable. A local server stands for the publishers."""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

import pooch
import pytest
from contract import ROOT
from live import dataset_file, downloaded_file

from curionav import Scenario, ScenarioError
from curionav.datasets import download, faults, folder, locate
from curionav.datasets.__main__ import main
from curionav.datasets.catalogue import DATASETS, Dataset, DatasetFile
from curionav.errors import DatasetError

CONTENT = {"hall.yaml": b"image: hall.pgm\n", "image/hall.pgm": bytes(range(256)) * 400}


class Publisher(BaseHTTPRequestHandler):
    """Serves CONTENT below any first folder; below ``/short`` it breaks off in the middle of a file."""

    asked: ClassVar[list[str]] = []

    def do_GET(self) -> None:
        self.asked.append(self.path)
        _, kind, name = self.path.split("/", 2)
        content = CONTENT.get(name)
        if content is None:
            self.send_error(404)
            return
        self.send_response(200)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content[: len(content) // 2] if kind == "short" else content)

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def publisher() -> Iterator[str]:
    Publisher.asked.clear()
    with ThreadingHTTPServer(("127.0.0.1", 0), Publisher) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of datasets."""
    monkeypatch.setenv("CURIONAV_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def halls(base: str, names: tuple[str, ...] = tuple(CONTENT), **changed: bytes) -> Dataset:
    """A dataset of files below ``base``; ``changed`` are contents that its checksums expect instead of CONTENT."""
    expected = {name: changed.get(Path(name).stem, CONTENT.get(name, b"")) for name in names}
    files = [
        DatasetFile(name, f"{base}/{name}", len(content), hashlib.sha256(content).hexdigest())
        for name, content in expected.items()
    ]
    return Dataset("halls", "two halls", "CC0-1.0, by their builders", "example.org/halls", tuple(files))


def everything_below(directory: Path) -> dict[str, bytes]:
    paths = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_bytes() for path in paths}


def test_a_dataset_is_downloaded_once_with_its_licence_shown(
    publisher: str, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue = [halls(f"{publisher}/good")]
    assert main(["halls"], catalogue) == 0
    printed = capsys.readouterr().out
    assert "licence: CC0-1.0, by their builders" in printed
    assert "downloaded image/hall.pgm" in printed
    assert everything_below(data) == {f"halls/{name}": content for name, content in CONTENT.items()}
    assert (data / "halls/image/hall.pgm").stat().st_mode & 0o444 == 0o444, "all services may read it"
    assert Publisher.asked == ["/good/hall.yaml", "/good/image/hall.pgm"]
    assert main(["all"], catalogue) == 0
    assert len(Publisher.asked) == 2, "what is right is not downloaded again"
    assert "licence: CC0-1.0" in capsys.readouterr().out


@pytest.mark.usefixtures("data")
def test_another_folder_is_used_and_named(publisher: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    catalogue, elsewhere = [halls(f"{publisher}/good")], tmp_path / "elsewhere"
    assert main(["halls", "--to", str(elsewhere)], catalogue) == 0
    assert f"set CURIONAV_DATA={elsewhere}" in capsys.readouterr().out
    assert main(["--check"], catalogue) == 1
    assert main(["--check", "--to", str(elsewhere)], catalogue) == 0


def test_a_file_with_another_checksum_is_not_kept(
    publisher: str, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue = [halls(f"{publisher}/good", hall=b"as it was")]
    assert main(["halls"], catalogue) == 1
    assert "/good/hall.yaml has another content than expected" in capsys.readouterr().err
    assert everything_below(data) == {}


def test_a_broken_download_leaves_nothing_and_is_made_good_by_the_next(
    publisher: str, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["halls"], [halls(f"{publisher}/short")]) == 1
    assert "cannot download" in capsys.readouterr().err
    assert everything_below(data) == {}
    assert main(["halls"], [halls(f"{publisher}/good")]) == 0


def test_a_download_goes_on_where_an_earlier_one_stopped(publisher: str, data: Path) -> None:
    with pytest.raises(DatasetError, match="404"):
        download(halls(f"{publisher}/good", ("hall.yaml", "none.pgm")), data)
    assert download(halls(f"{publisher}/good"), data) == ["image/hall.pgm"]


def test_a_changed_file_is_told_and_downloaded_again(
    publisher: str, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    catalogue = [halls(f"{publisher}/good")]
    download(catalogue[0], data)
    (data / "halls" / "hall.yaml").write_text("image: other.pgm\n")
    (data / "halls" / "image" / "hall.pgm").unlink()
    assert main(["--check"], catalogue) == 1
    printed = capsys.readouterr().out
    assert "halls/hall.yaml: another content\n" in printed
    assert "halls/image/hall.pgm: missing\n" in printed
    assert "`python -m curionav.datasets halls`" in printed
    assert main(["halls"], catalogue) == 0
    assert faults(catalogue[0], data) == {}


def test_without_a_network_the_address_is_named(publisher: str, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    silent = "http://127.0.0.1:9/good"  # the discard port: nothing listens there
    assert main(["halls"], [halls(silent)]) == 1
    assert f"cannot download {silent}/hall.yaml: " in capsys.readouterr().err
    assert everything_below(data) == {}


def test_a_folder_that_cannot_be_written_is_named_with_the_mend(
    publisher: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # A file in place of a folder is not writable even for the superuser.
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file", tmp_path / "file" / "below"):
        assert main(["halls", "--to", str(target)], [halls(f"{publisher}/good")]) == 1
        error = capsys.readouterr().err
        assert str(target) in error
        assert "--to" in error


def test_without_pooch_the_error_says_what_to_install(
    publisher: str, data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pooch", None)
    with pytest.raises(DatasetError, match="pip install 'pooch"):
        download(halls(publisher), data)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hals"], "there is no dataset `hals`; there are halls"),
        ([], "name a dataset, or give --list"),
        (["--check", "halls", "nonsense"], "there is no dataset `nonsense`"),
    ],
)
def test_bad_arguments_are_answered_with_what_there_is(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments, [halls("")])
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_the_help_and_the_list_teach(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    printed = capsys.readouterr().out
    for word in ("CURIONAV_DATA", str(data), "SHA-256", "--check", "--to", "dataset:NAME/FILE", "examples:"):
        assert word in printed
    assert main(["--list"]) == 0
    printed = capsys.readouterr().out
    for dataset in DATASETS:
        assert f"{dataset.name} ({dataset.size / 1e6:.1f} MB): " in printed
        assert f"licence: {dataset.licence}\n" in printed


def test_the_command_says_what_there_is_and_nothing_else() -> None:
    command = [sys.executable, "-W", "error", "-m", "curionav.datasets", "--list", "maps_real_slam"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.startswith("maps_real_slam (1.5 MB): ")
    assert done.stderr == ""


def test_every_file_is_published_at_a_fixed_commit_under_one_name() -> None:
    pinned = re.compile(r"https://raw\.githubusercontent\.com/[\w.-]+/[\w.-]+/[0-9a-f]{40}/[\w./-]+")
    assert len({dataset.name for dataset in DATASETS}) == len(DATASETS)
    for dataset in DATASETS:
        assert len({file.path for file in dataset.files}) == len(dataset.files)
        for file in dataset.files:
            assert pinned.fullmatch(file.url), file.url
            assert re.fullmatch(r"[0-9a-f]{64}", file.sha256), file.path
            assert Path(file.path).name == file.url.rsplit("/", 1)[1]


# No test reads the logs of Radish, so they need not be at hand.
@pytest.mark.parametrize(
    "dataset", [dataset for dataset in DATASETS if dataset.name != "lidar_radish"], ids=lambda dataset: dataset.name
)
def test_the_catalogue_is_that_of_the_published_files(dataset: Dataset) -> None:
    found = downloaded_file if dataset.name == "peds_eth" else dataset_file
    paths = {file.path: found(f"{dataset.name}/{file.path}") for file in dataset.files}
    assert {path: real.stat().st_size for path, real in paths.items()} == {f.path: f.size for f in dataset.files}
    assert faults(dataset, folder()) == {}


def test_every_file_that_the_project_names_is_in_the_catalogue() -> None:
    known = {f"dataset:{dataset.name}/{file.path}" for dataset in DATASETS for file in dataset.files}
    named = set()
    for path in [*(ROOT / "scenarios").glob("**/*.toml"), *(ROOT / "python" / "examples").glob("*.py")]:
        named |= set(re.findall(r'"(dataset:[^"]+)"', path.read_text()))
    assert len(named) >= 4
    assert named <= known


def test_the_page_of_datasets_lists_them_all() -> None:
    rows = re.findall(
        r"^\| `(\w+)` \| .* \| ([\d.]+ MB) \|$", (ROOT / "docs" / "datasets.md").read_text(), re.MULTILINE
    )
    assert rows == [(dataset.name, f"{dataset.size / 1e6:.1f} MB") for dataset in DATASETS]


def test_the_default_folder_is_the_users_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CURIONAV_DATA", "")
    for cache in (str(tmp_path), ""):
        monkeypatch.setenv("XDG_CACHE_HOME", cache)
        assert folder() == pooch.os_cache("curionav")
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert folder().is_absolute()


def test_a_scenario_finds_its_files_by_the_variable(publisher: str, data: Path, tmp_path: Path) -> None:
    scenario = Scenario.from_dict({"map": {"file": "dataset:halls/map/hall.yaml"}}, tmp_path)
    with pytest.raises(ScenarioError, match=re.escape("`python -m curionav.datasets halls` downloads it")) as error:
        scenario.packed()
    assert error.value.field == "map.file"
    (data / "halls" / "map").mkdir(parents=True)
    (data / "halls" / "map" / "hall.yaml").write_bytes(CONTENT["hall.yaml"])
    (data / "halls" / "map" / "hall.pgm").write_bytes(b"P5")
    tables, files = scenario.packed()
    assert tables["map"]["file"] == "hall.yaml"
    assert set(files) == {"hall.yaml", "hall.pgm"}


@pytest.mark.parametrize(
    "file", ["halls", "halls/", "/etc/passwd", "../a.yaml", "halls/../../a", "halls/./a", "halls/..\\a", ""]
)
def test_a_reference_cannot_leave_the_folder(file: str) -> None:
    with pytest.raises(DatasetError, match="NAME/FILE"):
        locate(f"dataset:{file}")


def test_a_name_without_the_prefix_is_a_path(tmp_path: Path) -> None:
    assert locate("maps/hall.yaml", tmp_path) == tmp_path / "maps" / "hall.yaml"
    assert locate("maps/hall.yaml") == Path("maps/hall.yaml")
