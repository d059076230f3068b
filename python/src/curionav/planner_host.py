"""Runs a planner of a Python file: ``python -m curionav.planner_host mine.py policy``, which curionav starts.

A question is a line of standard input, its answer a line of standard output, both JSON; ``docs/own-planner.md``
describes them. What the planner prints goes to standard error.
"""

from __future__ import annotations

import json
import os
import queue
import random
import runpy
import sys
import threading
import traceback
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from .errors import PlannerError
from .planner import OwnPlanner, Task, read_situation, read_task


class Host:
    """A planner and what it was last told of its run."""

    def __init__(self, planner: OwnPlanner) -> None:
        self._planner = planner
        self._maps: dict[str, np.ndarray[Any, Any]] = {}
        self._task: Task | None = None

    def answer(self, line: dict[str, Any]) -> dict[str, Any]:
        """The answer to a line."""
        try:
            match line["ask"]:
                case "hello":
                    return self._planner.hello()
                case "begin":
                    self._task = read_task(line, self._maps)
                    random.seed(self._task.seed)
                    np.random.seed(self._task.seed % 2**32)
                    self._planner.reset(self._task)
                    return {}
                case "decide" if self._task is not None:
                    return self._planner.answer(read_situation(line, self._task))
                case other:
                    return {"error": f"unexpected question `{other}`"}
        except PlannerError as error:
            return {"error": str(error)}
        except Exception as error:
            return {"error": f"raised {type(error).__name__}: {error}{_place(error)}"}


def load(file: Path, name: str) -> OwnPlanner:
    """The planner called ``name`` in a Python file.

    Raises:
        PlannerError: The file cannot be run, has no such name, or it is no planner.
    """
    # As if the file were run: it may import what lies beside it.
    sys.path.insert(0, str(file.parent))
    try:
        module = runpy.run_path(str(file), run_name=file.stem)
    except Exception as error:
        raise PlannerError(file.name, f"raised {type(error).__name__}: {error}{_place(error)}") from error
    found = module.get(name)
    if found is None:
        planners = sorted(key for key, value in module.items() if isinstance(value, OwnPlanner))
        has = f"it has {', '.join(planners)}" if planners else "it has no planner"
        raise PlannerError(file.name, f"there is no `{name}` in it; {has}")
    if not isinstance(found, OwnPlanner):
        raise PlannerError(
            file.name,
            f'`{name}` is a {type(found).__name__} and no planner; decorate it with @curionav.planner("NAME")',
        )
    return found


def _place(error: Exception) -> str:
    """Where in the user's code an exception came from: its last line outside of this package."""
    here = str(Path(__file__).parent)
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(here)]
    frames = [frame for frame in frames if not frame.filename.startswith("<")]
    return f" (line {frames[-1].lineno} of {Path(frames[-1].filename).name})" if frames else ""


def _read(lines: queue.SimpleQueue[str]) -> None:
    """Hands on the questions. At their end the process ends, whatever the planner is at."""
    for line in sys.stdin:
        lines.put(line)
    os._exit(0)


def _own_standard_output() -> TextIO:
    """Standard output for answers alone: what the planner prints from now on goes to standard error."""
    sys.stdout.flush()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return answers


def main(arguments: list[str]) -> int:
    """Answers until standard input ends."""
    if len(arguments) != 2:
        sys.stderr.write("usage: python -m curionav.planner_host FILE.py NAME\n")
        return 2
    answers = _own_standard_output()
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    host: Host | None = None
    fault = ""
    try:
        host = Host(load(Path(arguments[0]), arguments[1]))
    except PlannerError as error:
        fault = str(error)
    while True:
        line = json.loads(lines.get())
        answer = {"error": fault} if host is None else host.answer(line)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
