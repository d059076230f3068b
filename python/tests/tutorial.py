"""A tutorial as a shell script: its files are written and its commands run, in the order of the page.

A block with a language and a title, such as ``python title="draw.py"``, is a file. A block ``sh`` is run; with a title
it is another terminal: it goes on, and the page goes on once it has printed a line. A comment above a block of commands
says what the test does instead: ``<!-- tested with ARGUMENTS -->`` adds arguments to its last command,
``<!-- tested by FILE -->`` leaves it to the tests in that file, and ``<!-- tested to fail -->`` wants each to fail.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from contract import ROOT

PAGES = ROOT / "docs" / "tutorials"

_BLOCK = re.compile(
    r"^(?:<!-- tested (?P<how>with|by|to) (?P<what>[^\n]*) -->\n)?"
    r'```(?P<language>\w+)(?: title="(?P<title>[^"\n]*)")?\n'
    r"(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)

_PRELUDE = """\
set -e
terminal() {
    # Runs a file of commands beside the page, and waits until it prints a line.
    bash -e "$1" >"$1.log" 2>&1 &
    while [ ! -s "$1.log" ]; do
        kill -0 $! || { echo "$1 has ended without a word"; exit 1; }
        sleep 0.1
    done
    cat "$1.log"
}
"""


@dataclass(frozen=True)
class Block:
    """A block between fences."""

    language: str
    title: str | None
    text: str
    added: str | None
    """Arguments that the test adds."""
    elsewhere: str | None
    """The file of what tests it instead."""
    fails: bool
    """Whether each command is to fail."""


def blocks(page: Path) -> list[Block]:
    """The blocks of a page, in order."""
    found = []
    for match in _BLOCK.finditer(page.read_text()):
        what = {match["how"]: match["what"]}
        fails = what.get("to") == "fail"
        found.append(Block(match["language"], match["title"], match["text"], what.get("with"), what.get("by"), fails))
    return found


def script(page: Path) -> str:
    """What does everything that the page says."""
    lines = [_PRELUDE]
    for number, block in enumerate(blocks(page)):
        text = block.text if block.added is None else f"{block.text.rstrip()} {block.added}\n"
        if block.elsewhere is not None:
            assert (ROOT / block.elsewhere).is_file(), f"{page.name}: there is no {block.elsewhere}"
            lines.append(f"echo '-- block {number}: {block.elsewhere} tests it'\n")
        elif block.language != "sh":
            assert block.title is not None, f"{page.name}: a block of {block.language} has no title: what file is it?"
            lines.append(f"mkdir -p {shlex.quote(str(Path(block.title).parent))}\n")
            lines.append(f"cat >{shlex.quote(block.title)} <<'END OF FILE'\n{text}END OF FILE\n")
        elif block.title is not None:
            lines.append(f"cat >terminal-{number} <<'END OF FILE'\n{text}END OF FILE\nterminal terminal-{number}\n")
        else:
            lines += [f"echo {shlex.quote('$ ' + line)}\n{checked(line, block.fails)}\n" for line in text.splitlines()]
    return "".join(lines)


def checked(line: str, fails: bool) -> str:
    """A command that ends the script if it fails, or if it should and does not."""
    return f"if {line}; then echo 'it should have failed'; exit 1; fi" if fails else line
