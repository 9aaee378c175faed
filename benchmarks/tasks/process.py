"""Running child.py: its answer, or what became of it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

CHILD = Path(__file__).resolve().parent.parent / "child.py"


def run_child(
    *arguments: str, limit: float, environment: dict[str, str] | None = None
) -> dict[str, Any]:
    """The child's answer with the wall time of the whole process; or `fails`, with the reason."""
    start = time.perf_counter()
    try:
        done = subprocess.run(
            [sys.executable, str(CHILD), *arguments],
            capture_output=True, text=True, timeout=limit, env=os.environ | (environment or {}),
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return {"fails": f"no answer in {limit:g} s"}
    wall = time.perf_counter() - start
    answers = [line for line in done.stdout.splitlines() if line.startswith("answer ")]
    if done.returncode or not answers:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return {"fails": last[:200]}
    return json.loads(answers[-1].removeprefix("answer ")) | {"wall": wall}
