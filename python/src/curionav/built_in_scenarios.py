"""The scenarios that come with the package, by their names: `quickstart`, `dense/plaza-hrvo-02`."""

from __future__ import annotations

from pathlib import Path

from .errors import ScenarioError

_PACKAGE = Path(__file__).resolve().parent
_OTHER = frozenset({"arms", "claims", "tuned", "tuning"})
"""Folders of profiles and of claims, which stand beside the suites in a checkout."""


def _folder() -> Path:
    """That of a wheel, or else that of a checkout."""
    own = _PACKAGE / "scenarios"
    return own if own.is_dir() else _PACKAGE.parent.parent.parent / "scenarios"


def names() -> list[str]:
    """All names in order; what each scenario is like stands in its file, under ``description``."""
    folder = _folder()
    files = (path.relative_to(folder) for path in folder.rglob("*.toml"))
    return sorted(file.with_suffix("").as_posix() for file in files if file.parts[0] not in _OTHER)


def find(name: str) -> Path:
    """The file of a scenario.

    Raises:
        ScenarioError: None has this name.
    """
    known = names()
    if name in known:
        return _folder() / f"{name}.toml"
    suite = name.partition("/")[0] + "/"
    near = [other for other in known if other.startswith(suite)] or [other for other in known if "/" not in other]
    raise ScenarioError("", f"there is no scenario `{name}`; give a file (.toml), or a name such as {', '.join(near)}")
