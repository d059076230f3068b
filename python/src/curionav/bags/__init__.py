"""Bags of ROS 1 and ROS 2 become logs and maps of curionav, and recordings of curionav become bags.

`robot_log.write_log` and `grid.write_map` read a bag. `recorded.write_bag` writes one. ``python -m curionav.bags
--help`` has the same as commands. These modules need the extra ``bags``; this one imports none of them, so that the
command can say what is not installed.
"""
