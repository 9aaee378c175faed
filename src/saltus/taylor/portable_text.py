"""LLVM's text of kernels for another processor: for pages, and for cards.

It is written in a process of its own: numba must not optimise it for this machine. LLVM then
compiles it for its target, together with the functions of a structure and with the elementary
functions of `elementary.py`, which stand for those of the C library.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from saltus.errors import SaltusError
from saltus.taylor import elementary
from saltus.taylor.kernels import compiled_part
from saltus.taylor.private_numba import jit, llvm_of

C_FUNCTIONS = {
    **dict.fromkeys(("sin", "cos", "exp", "log", "sinh", "cosh", "tanh", "atan"), 1),
    "pow": 2,
    "numba_nextafter": 2,
}
# The process that writes the text of a kernel does not optimise it, and knows neither this
# machine's processor nor the order in which Python's sets happen to be: the text is the same on
# every machine.
WRITER = {
    "NUMBA_OPT": "0",
    "NUMBA_LLVM_REFPRUNE_PASS": "0",
    "NUMBA_CPU_NAME": "generic",
    "NUMBA_CPU_FEATURES": "",
    "PYTHONHASHSEED": "0",
}


def made_elsewhere(call: str, what: str, more: Mapping[str, str] | None = None) -> bytes:
    """What a new process of this kind writes to the file `path` in `call`, two statements of
    Python.

    Raises
    ------
    SaltusError
        It has failed.
    """
    with tempfile.TemporaryDirectory(prefix="saltus-text-") as folder:
        path = Path(folder) / "made"
        done = subprocess.run(
            [sys.executable, "-c", f"path = {str(path)!r}; {call}"],
            env=os.environ | WRITER | dict(more or {}),
            capture_output=True,
            text=True,
        )
        if done.returncode or not path.exists():
            last = (done.stderr.strip().splitlines() or ["it gave no reason"])[-1]
            raise SaltusError(f"{what} could not be compiled: {last:.200}")
        return path.read_bytes()


def functions_of(source: str) -> list[tuple[Any, Any]]:
    """The functions of a kernel's source that are called from outside, with their signatures."""
    made: list[tuple[Any, Any]] = []

    def cached_jit(signature: Any, **options: Any) -> Any:
        def decorated(function: Any) -> Any:
            made.append((function, signature))
            return jit(function)  # others of the source may call it

        return decorated

    module = ModuleType("saltus_page")
    vars(module)["cached_jit"] = cached_jit
    exec(
        compile(source.replace("import cached_jit, ", "import "), "saltus_page", "exec"),
        vars(module),
    )
    return made


def elementary_texts() -> Iterator[tuple[str, str]]:
    """LLVM's text of each elementary function, and that of the function of the C library's name
    which calls it.
    """
    space: dict[str, Any] = dict(vars(elementary))
    source = "from saltus.taylor.private_numba import jit\n" + compiled_part(elementary)
    exec(compile(source, "saltus_elementary", "exec"), space)
    from numba import types

    for name, count in C_FUNCTIONS.items():
        function = space[f"{name.removeprefix('numba_')}_function"]
        text, inner = llvm_of(function.py_func, types.float64(*[types.float64] * count))
        values = ", ".join(f"double %x{i}" for i in range(count))
        yield (
            text,
            f"""
declare i32 @"{inner}"(ptr, ptr, {", ".join(["double"] * count)})
define double @{name}({values}) {{
  %result = alloca double
  %problem = alloca ptr
  %status = call i32 @"{inner}"(ptr %result, ptr %problem, {values})
  %value = load double, ptr %result
  ret double %value
}}""",
        )
