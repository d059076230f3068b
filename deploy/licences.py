#!/usr/bin/env python3
"""Lists what is inside the program: `python deploy/licences.py > crates/cli/licences.txt` after a change of Cargo.lock.

With `--texts` it also prints the licence files of every crate, each text once: this is the file THIRD-PARTY.txt that
goes with a binary. It reads the crates' sources, which Cargo keeps after a build.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGETS = ("x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu")
"""For which programs are published."""
MANIFESTS = ("crates/cli/Cargo.toml", "python/native/Cargo.toml")
"""The program, and the extension module of the Python package."""
FILES = ("licen", "copying", "notice", "copyright", "unlicense")
"""How the names of files about a licence begin."""


def cargo(*arguments: str) -> str:
    command = ["cargo", *arguments, "--locked", "--offline"]
    return subprocess.run(
        command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True
    ).stdout


def linked() -> dict[tuple[str, str], str]:
    """(name, version) of every crate of others that is linked into program or module, with its licence."""
    found = {}
    for manifest, target in itertools.product(MANIFESTS, TARGETS):
        tree = cargo(
            "tree", "--manifest-path", manifest, "--edges", "normal", "--prefix", "none",
            "--target", target, "--format", "{p}|{l}",
        )  # fmt: skip
        for line in tree.splitlines():
            package, licence = line.removesuffix(" (*)").split("|")
            name, version = package.split(" ")[:2]
            if name.startswith("curionav"):
                continue
            if not licence:
                sys.exit(f"{name} {version} names no licence")
            found[name, version.removeprefix("v")] = licence.strip()
    return dict(sorted(found.items()))


def texts(crates: dict[tuple[str, str], str]) -> dict[str, list[str]]:
    """Every licence text, with the crates that have it."""
    folders = {}
    for manifest, target in itertools.product(MANIFESTS, TARGETS):
        metadata = cargo(
            "metadata",
            "--manifest-path",
            manifest,
            "--format-version",
            "1",
            "--filter-platform",
            target,
        )
        for package in json.loads(metadata)["packages"]:
            folders[package["name"], package["version"]] = Path(
                package["manifest_path"]
            ).parent
    users = defaultdict(list)
    for crate in crates:
        folder = folders[crate]
        files = [
            file
            for file in sorted(folder.iterdir())
            if file.name.lower().startswith(FILES) and file.is_file()
        ]
        for file in files:
            users[file.read_text(errors="replace").strip()].append(" ".join(crate))
        if not files:
            users[
                "(The crate holds no licence file; its manifest names the licence above.)"
            ].append(" ".join(crate))
    return dict(sorted(users.items(), key=lambda item: item[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--texts",
        action="store_true",
        help="print the licence files of every crate, too",
    )
    options = parser.parse_args()
    crates = linked()
    for (name, version), licence in crates.items():
        print(name, version, licence)
    if options.texts:
        for text, users in texts(crates).items():
            print(f"\n{'=' * 80}\n{', '.join(users)}\n{'-' * 80}\n{text}")


if __name__ == "__main__":
    main()
