"""``python -m curionav.report DIR [--check FILE ...]``: the figures of a bench as JSON."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .summary import Bench


def main() -> int:
    """Exit status: 0 every claim holds, 1 one does not, 2 bad input."""
    parser = argparse.ArgumentParser(prog="python -m curionav.report", description="The figures of a bench as JSON.")
    parser.add_argument("folder", metavar="DIR", type=Path, help="what `curionav bench --out` wrote")
    parser.add_argument("--check", metavar="FILE", type=Path, nargs="+", default=[], help="claims to judge (.toml)")
    options = parser.parse_args()
    try:
        figures = Bench.read(options.folder).figures(options.check)
    except (OSError, ValueError, KeyError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    sys.stdout.write(json.dumps(figures, indent=2, ensure_ascii=False) + "\n")
    return 0 if all(claim["holds"] for claim in figures["claims"]) else 1


if __name__ == "__main__":
    sys.exit(main())
