"""Siconos as a program: the Python that has it, the equations compiled for it, and its answers."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from peers.peer import AbsentError

HERE = Path(__file__).parent
INSTALL = "apt-get install python3-siconos gcc"
LIMIT = 1800.0  # seconds for all motions


def interpreter() -> str:
    """The Python that can import Siconos: Debian's package is for Debian's own, which need not be
    the first one on the path.
    """
    named = [os.environ["SICONOS_PYTHON"]] if "SICONOS_PYTHON" in os.environ else []
    found = [
        shutil.which("python3", path=folder) for folder in (os.environ.get("PATH", ""), "/usr/bin")
    ]
    for python in dict.fromkeys([*named, *filter(None, found)]):
        done = subprocess.run(
            [python, "-c", "import siconos.kernel"], capture_output=True, cwd=tempfile.gettempdir()
        )
        if done.returncode == 0:
            return python
    raise AbsentError(
        f"no Python here has Siconos: {INSTALL}, or name one that has it in SICONOS_PYTHON"
    )


def compiled(folder: Path) -> str:
    """The equations as a library that Siconos loads, by its name without the ending.

    Raises AbsentError without a compiler.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise AbsentError(f"Siconos needs a C compiler for the equations: {INSTALL}")
    library = folder / "layers"
    command = [
        compiler,
        "-O2",
        "-shared",
        "-fPIC",
        str(HERE / "layers.c"),
        "-o",
        f"{library}.so",
        "-lm",
    ]
    subprocess.run(command, check=True, capture_output=True)
    return str(library)


def march(tasks: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Siconos' answers to tasks such as `Case.task` gives.

    Raises AbsentError where it, or a compiler, is not installed.
    """
    python = interpreter()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        library, asked, answers = compiled(folder), folder / "tasks.json", folder / "answers.json"
        asked.write_text(json.dumps(tasks))
        command = [python, str(HERE / "march.py"), library, str(asked), str(answers)]
        threads = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        subprocess.run(
            command, check=True, capture_output=True, cwd=place, env=threads, timeout=LIMIT
        )
        found: list[dict[str, Any]] = json.loads(answers.read_text())
    return found


def version() -> str:
    """What Debian calls the installed version, where it is Debian's."""
    if shutil.which("dpkg-query") is None:
        return "version unknown"
    done = subprocess.run(
        ["dpkg-query", "-W", "-f=${Version}", "python3-siconos"], capture_output=True, text=True
    )
    return done.stdout.strip() or "version unknown"
