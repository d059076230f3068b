"""The documentation site."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from contract import ROOT

pytest.importorskip("zensical", reason="no zensical; pip install './python[site]'")
pytest.importorskip("curionav_native", reason="no extension module; pip install ./python with Cargo")
pytestmark = pytest.mark.skipif(not (ROOT / "docs").is_dir(), reason="no documents beside the package")


def test_the_site_is_built_and_no_link_leads_nowhere(tmp_path: Path) -> None:
    built = subprocess.run(
        [sys.executable, ROOT / "docs" / "build", "--pages", "--out", tmp_path],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stdout + built.stderr
    pages = {path.parent.name for path in (tmp_path / "html" / "docs" / "tutorials").glob("*/index.html")}
    assert pages == {path.stem for path in (ROOT / "docs" / "tutorials").glob("*.md")}
    notebook = tmp_path / "html" / "python" / "notebooks" / "first_run"
    assert "reached" in (notebook / "index.html").read_text()
    pictures = [*tmp_path.glob("html/**/*.gif"), *tmp_path.glob("html/python/notebooks/**/*.png")]
    assert len(pictures) >= 6
