"""Key expressions of the contract, built from checked names (``schemas/README.md`` has the table).

Keys are relative to the session's namespace, if it has one. ``@v1`` is a verbatim chunk: no wildcard matches it by
accident.
"""

from __future__ import annotations

import re

ROOT = "curionav/@v1"
"""What every key begins with."""

_IDENTITY_PARTS = 4
"""Names in the longest identity: role, world, robot and instance."""

_NAME = re.compile(r"[a-z0-9_-]{1,64}", re.ASCII)


def is_name(name: str) -> bool:
    """Whether ``name`` can be one chunk of a key: 1 to 64 of ``a-z 0-9 _ -``."""
    return _NAME.fullmatch(name) is not None


def _chunk(name: str) -> str:
    if not is_name(name):
        raise ValueError(f"name {name[:64]!r} must be 1 to 64 of the characters a-z, 0-9, `_` and `-`")
    return name


def robot(name: str, stream: str) -> str:
    """Stream of a robot.

    ``scan``, ``odom``, ``people``, ``belief``, ``particles``, ``mission``, ``decision``, ``cmd``, ``report``,
    ``memory``, ``lease``.
    """
    return f"{ROOT}/robot/{_chunk(name)}/{_chunk(stream)}"


def _identity(by: str) -> str:
    if commander(f"/{by}") is None:
        raise ValueError(f"{by[:64]!r} must be one to four names with dots between them, such as 'operator.ward3'")
    return by


def mission_command(name: str, by: str) -> str:
    """Where the driver takes what ``by`` commands about a robot's mission.

    ``by`` is a name as certificates have it, such as ``operator.ward3``. The router lets each certificate command
    under its own name alone.
    """
    return f"{robot(name, 'mission')}/command/{_identity(by)}"


def pause(name: str, by: str) -> str:
    """Where the base and the drivers of a robot are paused by ``by``."""
    return f"{robot(name, 'pause')}/{_identity(by)}"


def commander(key: str) -> str | None:
    """Who commands, as the last chunk of a command's key says; ``None`` if that is no name."""
    by = key.rpartition("/")[2]
    parts = by.split(".")
    return by if len(parts) <= _IDENTITY_PARTS and all(map(is_name, parts)) else None


def world(name: str, channel: str) -> str:
    """Channel of a simulated world: ``scenario``, ``check``, ``robot``, ``people``, ``run``."""
    return f"{ROOT}/world/{_chunk(name)}/{_chunk(channel)}"


def grid(identity: bytes) -> str:
    """Where the map with this hash (32 bytes) can be asked for."""
    return f"{ROOT}/map/{identity.hex()}"


def question(term: str, instance: str, asker: str) -> str:
    """Where one evaluator of a term takes the questions of the robot ``asker``."""
    return f"{ROOT}/evaluate/{_chunk(term)}/{_chunk(instance)}/{_chunk(asker)}"


def questions(term: str, instance: str) -> str:
    """Where one evaluator of a term takes the questions of every robot."""
    return f"{ROOT}/evaluate/{_chunk(term)}/{_chunk(instance)}/*"


def asker(key: str) -> str | None:
    """The robot that a question's key names; ``None`` if its last chunk is not a plain name."""
    name = key.rpartition("/")[2]
    return name if is_name(name) else None


def live(role: str, instance: str) -> str:
    """The liveliness token of a service, declared after its queryable."""
    return f"{ROOT}/live/{_chunk(role)}/{_chunk(instance)}"


def status(role: str, instance: str) -> str:
    """Where a service answers with its ``ServiceStatus``."""
    return f"{ROOT}/status/{_chunk(role)}/{_chunk(instance)}"


def every_live() -> str:
    """The liveliness tokens of all services."""
    return f"{ROOT}/live/*/*"


def service_of(key: str) -> tuple[str, str] | None:
    """(role, instance) of a liveliness token's key; ``None`` if it is no such key."""
    prefix, _, names = key.partition("/live/")
    role, _, instance = names.partition("/")
    return (role, instance) if prefix == ROOT and is_name(role) and is_name(instance) else None
