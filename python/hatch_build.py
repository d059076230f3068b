"""Puts the program `curionav` into a wheel: `deploy/package` sets the variables that this hook reads.

Without `CURIONAV_DIST` a wheel, and always an editable installation, has only the Python packages.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class ProgramHook(BuildHookInterface[Any]):
    """Adds what stands in the folder `CURIONAV_DIST`, which is laid out as the published archive."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds the program as a script, and beside the wheel's metadata the licences of what is inside."""
        folder = os.environ.get("CURIONAV_DIST")
        if not folder or version == "editable":
            return
        dist = Path(folder).resolve()
        program = dist / "bin" / "curionav"
        if not program.is_file():
            raise FileNotFoundError(f"CURIONAV_DIST: there is no {program}; `deploy/package` builds it")
        build_data["shared_scripts"][str(program)] = "curionav"
        for name in ("LICENSE", "THIRD-PARTY.txt"):
            build_data["extra_metadata"][str(dist / name)] = name
        build_data["pure_python"] = False
        # Any Python 3; without a platform's name, only machines like this one.
        platform = os.environ.get("CURIONAV_WHEEL_PLATFORM") or f"linux_{os.uname().machine}"
        build_data["tag"] = f"py3-none-{platform}"
