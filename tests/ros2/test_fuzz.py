"""A short form of the attack in `fuzz.py`."""

from __future__ import annotations

import os
from pathlib import Path

from conftest import need
from fuzz import fuzz
from rig import PROGRAM

need(PROGRAM)


def test_hostile_bytes_neither_end_the_gateway_nor_pass_through_it(tmp_path: Path) -> None:
    seed = int(os.environ.get("CURIONAV_SEED", "1"))
    done = fuzz(tmp_path, float(os.environ.get("CURIONAV_FUZZ_S", "20")), seed)
    print(f"seed {seed}: {dict(done)}")
    assert done["/r1/cmd_vel"] > 0
    assert done["/diagnostics"] > 0
