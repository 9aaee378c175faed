"""This tree beside another commit: both computed in turn, by their processor time.

    make bench BENCH="--against COMMIT"        or        python benchmarks/against.py COMMIT
    [--rounds N] [--only TASK ...]

Each tree computes in a process of its own, with the same Python and packages; the tasks are those
of `tasks/trees.py`. Within a round every task is computed by one tree and at once by the other one,
and the next round begins with the other. The least time of many rounds is what a tree needs when
nothing disturbs it. Two runs of one tree (COMMIT is HEAD, and nothing is changed) tell how far
ratios are to be believed.
"""

from __future__ import annotations

import argparse
import compileall
import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from report import number, table
from tasks.trees import PROCESSES, TASKS

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
BOUND = 1.03  # a ratio above it is a task that has become slower


class Tree:
    """A process that computes tasks with the sources of one tree."""

    def __init__(self, sources: Path) -> None:
        """Start it."""
        self.environment = os.environ | {"PYTHONPATH": str(sources)}
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "tasks" / "trees.py"), str(sources)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=self.environment,
        )  # fmt: skip

    def seconds(self, task: str) -> float:
        """The processor time of a task, or from the start to the end of a process of its own."""
        if task in PROCESSES:
            before = _children()
            subprocess.run(
                [sys.executable, *PROCESSES[task]],
                env=self.environment,
                check=True,
                stdout=subprocess.DEVNULL,
            )
            return _children() - before
        _pipe(self.process.stdin).write(task + "\n")
        _pipe(self.process.stdin).flush()
        line = _pipe(self.process.stdout).readline()
        if not line:
            raise RuntimeError(f"{task} failed in {self.environment['PYTHONPATH']}")
        return float(json.loads(line))

    def end(self) -> None:
        """No more tasks."""
        _pipe(self.process.stdin).close()
        self.process.wait()


def _pipe(stream: IO[str] | None) -> IO[str]:
    assert stream is not None
    return stream


def _children() -> float:
    times = os.times()
    return times.children_user + times.children_system


@contextlib.contextmanager
def sources_of(commit: str) -> Iterator[Path]:
    """The sources of a commit in a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(
            ["git", "archive", commit, "src"], cwd=ROOT, check=True, capture_output=True
        ).stdout
        subprocess.run(["tar", "x", "-C", folder], input=packed, check=True)
        sources = Path(folder) / "src"
        for folder_of_sources in (sources, ROOT / "src"):  # as an installation has them
            compileall.compile_dir(folder_of_sources, quiet=2)
        yield sources


def measured(
    before: Tree, now: Tree, tasks: list[str], rounds: int
) -> dict[str, tuple[list[float], list[float]]]:
    """The seconds of each task in every round, of the other commit and of this tree."""
    found: dict[str, tuple[list[float], list[float]]] = {task: ([], []) for task in tasks}
    for task in tasks:  # what is compiled and filled once
        for tree in (before, now):
            tree.seconds(task)
    for n in range(rounds):
        for task in tasks:
            order = (0, 1) if n % 2 == 0 else (1, 0)
            for i in order:
                found[task][i].append((before, now)[i].seconds(task))
    return found


def told(found: dict[str, tuple[list[float], list[float]]]) -> str:
    """The least seconds of both, and their ratio, as a table."""
    rows = []
    for task, (before, now) in found.items():
        ratio = min(now) / min(before)
        rows.append(
            [
                task,
                number(min(before)),
                number(min(now)),
                f"{ratio:.3f}" + (" slower" if ratio > BOUND else ""),
            ]
        )
    return table(["task", "s before", "s now", "now / before"], rows)


def beside_commit(commit: str, rounds: int, only: list[str] | None = None) -> dict[str, Any]:
    """Measure, print, and give the times."""
    with sources_of(commit) as sources:
        before, now = Tree(sources), Tree(ROOT / "src")
        try:
            found = measured(before, now, only or [*TASKS, *PROCESSES], rounds)
        finally:
            before.end()
            now.end()
    print(told(found), flush=True)
    return found


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--only", nargs="+", choices=[*TASKS, *PROCESSES])
    chosen = parser.parse_args()
    beside_commit(chosen.commit, chosen.rounds, chosen.only)


if __name__ == "__main__":
    main()
