"""A scenario and everything it names, ready to be sent."""

from __future__ import annotations

import copy
import math
import os
import re
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import yaml

from . import built_in_scenarios
from .datasets import locate
from .errors import DatasetError, ScenarioError
from .field_types import Fault, plain
from .profiles import DEFAULT, Planner, changed, complete, read_toml

_SENDABLE = re.compile(r"""(?![. ])[^\x00-\x1f\x7f-\x9f/\\:~*?"<>|]+(?<![. ])""")
"""A file name the services accept: see `check_file_name` of ``schemas/src/world.rs``."""
_NAME_BYTES = 255
"""Longest such name."""


class Scenario:
    """A scenario as in a scenario file.

    Attributes:
        data: The scenario's tables; change them as you like before injecting it. Positions are in m, map frame,
            headings in rad.
        base: Directory that relative names of files start from.
        file: The file that it was read from, if it was.
    """

    def __init__(self, data: dict[str, Any], base: str | Path = ".", file: Path | None = None) -> None:
        self.data = data
        self.base = Path(base)
        self.file = file

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scenario:
        """Reads a scenario file (TOML), or a scenario that comes with the package.

        Args:
            path: The file, or a name such as ``quickstart`` or ``dense/plaza-hrvo-02``, which has no ending.

        Raises:
            ScenarioError: The file cannot be read or is not TOML, or no scenario has this name.
        """
        path = Path(path) if Path(path).suffix or Path(path).is_file() else built_in_scenarios.find(os.fspath(path))
        return cls(read_toml(path, ""), path.parent, path)

    @classmethod
    def from_dict(cls, data: dict[str, Any], base: str | Path = ".") -> Scenario:
        """A scenario from tables made in Python; they are copied. ``base`` is where the names of files start from."""
        return cls(copy.deepcopy(data), base)

    def with_term(self, term: str, weight: float = 1.0, scale: float = 1.0, when: str = "always") -> Scenario:
        """The scenario with one more term in its planner's profile, in place of one of the same name.

        Args:
            term: Name of the term, such as that of an `Evaluator`.
            weight: How much it counts; 0 takes the term out.
            scale: The cost per state of a candidate, in the term's unit, that counts as one: a candidate adds
                ``weight * cost / (scale * states)``.
            when: ``always``, or ``uncertain``: only while the robot is unsure where it is.
        """
        changed = self._copy()
        terms = changed.data.setdefault("profile", {}).setdefault("terms", {})
        terms[term] = {"scale": float(scale), "weight": float(weight), "when": when}
        return changed

    def with_live_people(self, patience_s: float = 10.0) -> Scenario:
        """The scenario with people who are played from outside, beside those it has.

        Args:
            patience_s: How long a run waits for them before it is given up, s of wall time.
        """
        changed = self._copy()
        changed.data.setdefault("people", {}).update(kind="live", live_patience_s=float(patience_s))
        return changed

    def with_perception(self, known: Literal["truth", "robot-frame", "tracked", "tracked-all-round"]) -> Scenario:
        """The scenario with people who are known in another way.

        Args:
            known: ``truth``: without error, on the map; ``robot-frame``: without error, as seen from the robot, so that
                they are as far off on the map as the robot's belief; ``tracked``: by the service ``tracker``, from the
                laser alone; ``tracked-all-round``: the same with a laser that sees all around, its beams as far apart.
        """
        changed = self._copy()
        perception = changed.data.setdefault("perception", {})
        tracked = known in ("tracked", "tracked-all-round")
        perception["source"] = "tracker" if tracked else "truth"
        if not tracked:
            perception["frame"] = "robot" if known == "robot-frame" else "map"
        if known == "tracked-all-round":
            # As `LaserModel::all_round` of the services does, with their defaults. They refuse a laser that cannot be.
            laser = changed.data["laser"] = changed._table("laser")
            fov, beams = laser.get("fov", math.pi), laser.get("beams", 181)
            if 0.0 < fov < math.tau - 1e-9:
                laser.update(fov=math.tau, beams=round(max(beams - 1, 1) * math.tau / fov))
        return changed

    def _copy(self) -> Scenario:
        return Scenario(copy.deepcopy(self.data), self.base, self.file)

    def profile(self, planner: Planner | None = None) -> dict[str, Any]:
        """The whole planner profile: the one of this name, by default the scenario's own, with its ``[profile]``.

        Args:
            planner: The name of a built-in profile, a profile file (``.toml``), or tables as in such a file.

        Raises:
            ScenarioError: There is no such profile, or its file cannot be read.
        """
        if planner is not None:
            chosen = complete(planner, Path(), "planner")
        else:
            chosen = complete(self._table("planner").get("profile", DEFAULT), self.base, "planner.profile")
        return changed(chosen, self._table("profile"))

    def _table(self, name: str) -> dict[str, Any]:
        table = self.data.get(name, {})
        if not isinstance(table, dict):
            raise ScenarioError(name, f"must be a table, found {type(table).__name__}")
        return table

    def files(self) -> dict[str, bytes]:
        """Content of every file the scenario names, by the name it is sent under.

        Raises:
            ScenarioError: A file is missing, or the map's description names no image.
        """
        return self.packed()[1]

    def packed(self) -> tuple[dict[str, Any], dict[str, bytes]]:
        """The tables and the files as they are sent: names of files have lost their directories.

        The table ``profile`` is not among them: `profile` makes a whole profile of it.

        Raises:
            ScenarioError: A file is missing, or a value has no form on the wire.
        """
        data = copy.deepcopy(self.data)
        data.pop("profile", None)
        files: dict[str, bytes] = {}
        # What is missing here is the services' to refuse: they name the field.
        for name, key in (("map", "file"), ("map", "keepout"), ("map", "speed"), ("world", "file")):
            table = data.get(name)
            if isinstance(table, dict) and isinstance(table.get(key), str):
                table[key] = self._pack_map(f"{name}.{key}", table[key], files)
        recordings = data.get("recorded", [])
        sent: dict[Path, str] = {}
        for index, recorded in enumerate(recordings if isinstance(recordings, list) else []):
            if isinstance(recorded, dict) and isinstance(recorded.get("file"), str):
                field = f"recorded[{index}].file"
                path = self._located(field, recorded["file"])
                if path not in sent:
                    sent[path] = _free_name(path.name, index, files)
                    files[sent[path]] = _read(field, path)
                recorded["file"] = sent[path]
        try:
            return plain(data), files
        except Fault as fault:
            raise ScenarioError(fault.path, fault.reason) from None

    def _located(self, field: str, file: str) -> Path:
        try:
            return locate(file, self.base)
        except DatasetError as error:
            raise ScenarioError(field, str(error)) from error

    def _pack_map(self, field: str, file: str, files: dict[str, bytes]) -> str:
        path = self._located(field, file)
        description = _read(field, path)
        image = _image_of(field, path, description)
        # The services look for the image under the name its description gives, so it cannot be renamed.
        name = PurePosixPath(image).name
        if not _is_sendable(name):
            raise ScenarioError(field, f"the image `{name}` needs a name that is valid on every system")
        pixels = _read(f"{field}: image", path.parent / image)
        if files.get(name, pixels) != pixels:
            raise ScenarioError(field, f"the image `{name}` has the name of another file; rename one of them")
        files[name] = pixels
        sent = path.name if files.get(path.name) == description else _free_name(path.name, 0, files)
        files[sent] = description
        return sent


def _read(field: str, path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ScenarioError(field, f"cannot read {path}: {error.strerror}") from error


def _image_of(field: str, path: Path, description: bytes) -> str:
    """The image that a map's description names. What else it says is the services' to check."""
    try:
        tables = yaml.safe_load(description.decode("utf-8-sig", "replace"))
    except yaml.YAMLError as error:
        raise ScenarioError(field, f"{path} is not YAML: {' '.join(str(error).split())}") from error
    image = tables.get("image") if isinstance(tables, dict) else None
    if not isinstance(image, str) or not image:
        raise ScenarioError(field, f"{path} names no image; it needs a line such as `image: map.pgm`")
    return image


def _is_sendable(name: str) -> bool:
    return len(name.encode()) <= _NAME_BYTES and _SENDABLE.fullmatch(name) is not None


def _free_name(name: str, index: int, taken: dict[str, bytes]) -> str:
    """``name`` made of characters the services accept, with ``index`` before it if it is taken."""
    if not _is_sendable(name):
        name = f"file-{re.sub(r'[^A-Za-z0-9_.-]', '_', name).rstrip('.')}"
    while name in taken:
        name = f"{index}-{name}"
    return name
