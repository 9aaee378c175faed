"""Plans to sweep, stores to compare, and processes that can be killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from saltus.sweep import Plan, Variable

HERE = Path(__file__).parent


def _heed_interrupts():
    """A process started from a background job ignores SIGINT unless told otherwise."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture(scope="session")
def waves_plan():
    """Make a plan over a grid of 7 x 5 points in 4 x 2 chunks, the last of which are smaller, with
    other entries as named.
    """

    def make(function="waves", arguments=None, **others):
        entries = {
            "function": f"sweep_toys:{function}",
            "arguments": arguments or {"hole": 0.1},
            "axes": {"x": np.linspace(0.0, 1.0, 7), "y": np.linspace(0.0, 2.0, 5)},
            "chunk": {"x": 2, "y": 3},
            "variables": {
                "height": Variable(dtype="f8", attrs={"units": "m"}),
                "count": Variable(dtype="i4", extra=(("k", 3),), fill=-1),
            },
            "attrs": {"kind": "waves", "seed": 0},
        }
        return Plan(**entries | others)

    return make


@pytest.fixture(scope="session")
def tree():
    """The files below a folder by their paths, with their bytes."""

    def read(folder):
        return {
            str(file.relative_to(folder)): file.read_bytes()
            for file in Path(folder).rglob("*")
            if file.is_file()
        }

    return read


@pytest.fixture
def script():
    """Start `sweep_script.py` with arguments, in a group of its own; whatever is left is killed at
    the end.
    """
    processes = []

    def start(*arguments, before=()):
        command = [*before, sys.executable, str(HERE / "sweep_script.py"), *map(str, arguments)]
        options = {
            "stdout": subprocess.PIPE,
            "stderr": subprocess.PIPE,
            "text": True,
            "start_new_session": True,
        }
        processes.append(subprocess.Popen(command, preexec_fn=_heed_interrupts, **options))
        return processes[-1]

    yield start
    for process in processes:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
