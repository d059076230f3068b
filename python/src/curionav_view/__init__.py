"""Watch curionav in Rerun: live over Zenoh, or from a recording (the program `curionav-view`).

Everything that touches a message is `Story`: one method a message, which draws it. `live` and `recording` feed it,
`output` says where the drawing goes, `layout` how it is arranged.
"""

from __future__ import annotations
