"""Puts into a wheel the scenarios and what Rust builds: the extension module, and the program if it is at hand.

The module is built by Cargo from the checkout that this folder is in. `deploy/package` has built both before, and sets
the variables that this hook reads: `CURIONAV_DIST`, a folder laid out as the published archive, and
`CURIONAV_WHEEL_PLATFORM`. Without Cargo the wheel has only the Python packages, which then run nothing in process.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

MODULE = "curionav_native.abi3.so"
"""The extension module as Python finds it, in the archive's folder `lib` and in the wheel."""


NO_SCENARIOS = {"README.md", "arms", "claims", "tuned", "tuning"}
"""What stands beside the scenarios in the checkout."""


class RustHook(BuildHookInterface[Any]):
    """Adds scenarios, the extension module, and what stands in the folder `CURIONAV_DIST`."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds scenarios, module and program, and beside the wheel's metadata the licences of what is inside."""
        if version != "editable":
            self._add_scenarios(build_data)
        folder = os.environ.get("CURIONAV_DIST")
        dist = None if not folder or version == "editable" else Path(folder).resolve()
        module = self._built() if dist is None else dist / "lib" / MODULE
        if module is None:
            self.app.display_warning("no Cargo, or no checkout: no extension module, and nothing runs in process")
            return
        if not module.is_file():
            raise FileNotFoundError(f"there is no {module}; `deploy/package` builds it")
        include = "force_include_editable" if version == "editable" else "force_include"
        build_data[include][str(module)] = MODULE
        if dist is not None:
            self._add_program(dist, build_data)
        build_data["pure_python"] = False
        # Any CPython from 3.11 on; without a platform's name, only machines like this one.
        platform = os.environ.get("CURIONAV_WHEEL_PLATFORM") or f"linux_{os.uname().machine}"
        build_data["tag"] = f"cp311-abi3-{platform}"

    def _built(self) -> Path | None:
        """The module, built now; nothing on a machine without Cargo, or where the module's source is missing."""
        cargo = shutil.which("cargo")
        checkout = Path(self.root).resolve().parent
        if cargo is None or not (checkout / "python" / "native" / "Cargo.toml").is_file():
            return None
        target = checkout / (os.environ.get("CARGO_TARGET_DIR") or "target") / "native"
        command = [cargo, "build", "--release", "--locked", "--manifest-path", "python/native/Cargo.toml"]
        # In the checkout Cargo finds what the module needs of the environment: `.cargo/config.toml`.
        subprocess.run([*command, "--target-dir", target], cwd=checkout, check=True)
        return target / "release" / "libcurionav_native.so"

    def _add_scenarios(self, build_data: dict[str, Any]) -> None:
        """Adds the scenarios of the checkout. An editable installation finds them where they are."""
        scenarios = Path(self.root).resolve().parent / "scenarios"
        for part in sorted(scenarios.iterdir()) if scenarios.is_dir() else []:
            if part.name not in NO_SCENARIOS:
                build_data["force_include"][str(part)] = f"curionav/scenarios/{part.name}"

    @staticmethod
    def _add_program(dist: Path, build_data: dict[str, Any]) -> None:
        program = dist / "bin" / "curionav"
        if not program.is_file():
            raise FileNotFoundError(f"CURIONAV_DIST: there is no {program}; `deploy/package` builds it")
        build_data["shared_scripts"][str(program)] = "curionav"
        for name in ("LICENSE", "THIRD-PARTY.txt"):
            build_data["extra_metadata"][str(dist / name)] = name
