"""`python -m curionav_view` is `curionav-view`."""

from __future__ import annotations

import sys

from .command import main

sys.exit(main())
