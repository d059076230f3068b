"""Watch curionav in Rerun: live over Zenoh, or from a recording (the program `curionav-view`).

`SceneLogger` draws messages, with one method per message. `live` and `curionav.recording` feed it, `output` says where
the drawing goes, and `layout` how it is arranged.
"""

from __future__ import annotations
