"""``python -m curionav.report DIR [--check FILE ...]``: report.html and summary.json of a bench, and its verdicts."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from . import claim_files
from .claims import judge
from .summary import Bench

try:
    from .page import render
except ModuleNotFoundError as missing:
    sys.exit(f"error: {missing}; `pip install './python[report]'` brings it")


def main() -> int:
    """Exit status: 0 every claim holds, 1 one does not, 2 bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m curionav.report", description="Write report.html and summary.json into DIR and judge claims."
    )
    parser.add_argument("folder", metavar="DIR", type=Path, help="what `curionav bench --out` wrote")
    parser.add_argument(
        "--check", metavar="FILE", type=Path, nargs="+", help="claims to judge (.toml); default: those of the bench"
    )
    parser.add_argument("--check-only", action="store_true", help="read the claims and stop")
    options = parser.parse_args()
    try:
        return _report(options.folder, options.check, options.check_only)
    except (OSError, ValueError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 2


def _report(folder: Path, check: list[Path] | None, check_only: bool) -> int:
    file = folder / "bench.json"
    if not file.is_file():
        raise ValueError(f"there is no {file}: `curionav bench --out {folder}` writes it")
    made = json.loads(file.read_text(encoding="utf-8"))
    known = claim_files.Known([planner["name"] for planner in made["planners"]], len(made["scenarios"]))
    wanted = [Path(file) for file in made["claims"]] if check is None else check
    files = [claim_files.read(file, known) for file in wanted]
    if check_only:
        return 0
    bench = Bench.read(folder)
    judged = [one for claims in files for one in judge(claims, bench.comparison, made["repeats"])]
    figures = json.dumps(bench.figures(judged), indent=2, ensure_ascii=False)
    (folder / "summary.json").write_text(figures + "\n", encoding="utf-8")
    (folder / "report.html").write_text(render(bench, judged), encoding="utf-8")
    for one in judged:
        sys.stdout.write(f"{one.verdict}: {one.claim} ({one.found})\n")
    sys.stdout.write(f"Report and data: {folder / 'report.html'}\n")
    return 0 if all(one.holds for one in judged) else 1


if __name__ == "__main__":
    sys.exit(main())
