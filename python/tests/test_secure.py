"""Deployments over TLS: certificates decide what a connection may do."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from live import Up, deployment, hall, program

import curionav
from curionav.errors import ConnectionFailed


@pytest.fixture(scope="module")
def up(directory: Path) -> Iterator[Up]:
    """A deployment over TLS, with its certificates in ``directory / "pki"``."""
    with deployment(directory, "--secure", str(directory / "pki")) as running:
        assert running.endpoint.startswith("tls/")
        yield running


@curionav.evaluator("comfort")
def comfort(_scene: curionav.Scene, candidates: curionav.CandidateSet) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Any cost."""
    return np.zeros(candidates.count)


def test_a_scenario_is_run_over_tls_and_other_certificates_are_needed_for_more(up: Up, directory: Path) -> None:
    with curionav.connect(up.endpoint, secure=directory / "pki") as connection:
        assert all(service.status is not None for service in connection.status())
        run = connection.inject(curionav.Scenario.from_dict(hall(directory), directory))
        assert run.wait().outcome == "reached"
        with pytest.raises(ConnectionFailed, match=r"certificate='comfort.NAME'"):
            connection.serve(comfort)
    with (
        curionav.connect(up.endpoint, secure=directory / "pki", certificate="viewer") as viewer,
        pytest.raises(ConnectionFailed, match=r"certificate='crowd.world'"),
    ):
        viewer.crowd("world")


def test_missing_and_foreign_certificates_and_plain_endpoints_are_refused_with_the_reason(
    up: Up, directory: Path
) -> None:
    own, other = directory / "pki", directory / "other"
    with pytest.raises(ConnectionFailed, match=r"nobody.pem: is missing; .*curionav secure issue"):
        curionav.connect(up.endpoint, secure=own, certificate="nobody")
    for arguments in (["init", str(other)], ["issue", str(other), "viewer"]):
        subprocess.run([program(), "secure", *arguments], check=True, stdout=subprocess.DEVNULL)
    with pytest.raises(ConnectionFailed, match="the router's certificate is not trusted"):
        curionav.connect(up.endpoint, secure=other, certificate="viewer", timeout=1.0)
    shutil.copy(own / "ca.pem", other / "ca.pem")
    with pytest.raises(ConnectionFailed, match="`viewer` is not accepted"):
        curionav.connect(up.endpoint, secure=other, certificate="viewer", timeout=1.0)
    with pytest.raises(ConnectionFailed, match="over tls alone"):
        curionav.connect(up.endpoint.replace("tls/", "tcp/"), secure=own)


def test_a_key_that_systemd_hands_out_is_used(up: Up, directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine, handed = directory / "machine", directory / "handed"
    for folder, files in ((machine, ("ca.pem", "viewer.pem")), (handed, ("viewer.key",))):
        folder.mkdir()
        for file in files:
            shutil.copy(directory / "pki" / file, folder)
    with pytest.raises(ConnectionFailed, match=r"viewer.key: is missing"):
        curionav.connect(up.endpoint, secure=machine, certificate="viewer")
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(handed))
    with curionav.connect(up.endpoint, secure=machine, certificate="viewer") as viewer:
        assert viewer.status()
