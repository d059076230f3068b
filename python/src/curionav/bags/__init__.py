"""Bags of ROS 1 and ROS 2 become logs and maps of curionav, and recordings of curionav become bags.

`write_log` and `write_map` read a bag. `write_bag` writes one. ``python -m curionav.bags --help`` has the same as
commands. The package needs the extra ``bags``: ``pip install 'curionav[bags]'``.
"""

from .bag import BagError
from .grid import WrittenMap, write_map
from .recorded import WrittenBag, write_bag
from .robot_log import Written, write_log
from .topics import Choice

__all__ = ["BagError", "Choice", "Written", "WrittenBag", "WrittenMap", "write_bag", "write_log", "write_map"]
