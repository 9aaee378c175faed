"""Compiled code on disk: generated source files in the user's cache directory, each with numba's compiled code beside it.

Numbers never compile anything. A file's name is a digest of all of its source and of the compiler's options, so that a change
of either makes a new file. A file appears in one move, so that processes that compile at the same time do not disturb each other.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import re
import sys
import tempfile
import threading
from enum import IntEnum
from pathlib import Path
from types import ModuleType

from saltus.taylor import private_numba

MARKER = "# --- compiled from here on"
_loading = threading.RLock()  # A module is in `sys.modules` while it is still being executed: other threads wait for it.


def cache_directory() -> Path:
    """Where compiled code is kept: SALTUS_CACHE_DIR, or the user's cache directory, or a temporary one if that is read-only."""
    from platformdirs import user_cache_dir

    wanted = Path(os.environ.get("SALTUS_CACHE_DIR") or user_cache_dir("saltus", appauthor=False)) / "kernels"
    try:
        wanted.mkdir(parents=True, exist_ok=True)
        if os.access(wanted, os.W_OK):
            return wanted
    except OSError:
        pass
    fallback = Path(tempfile.gettempdir()) / f"saltus-kernels-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    fallback.mkdir(parents=True, exist_ok=True)
    return fallback


def compiled_part(module: ModuleType) -> str:
    """The compiled part of a source file: what stands below its marker, with members of `IntEnum`s written as their numbers."""
    numbers = {
        f"{name}.{member.name}": str(int(member))
        for name, kind in vars(module).items()
        if isinstance(kind, type) and issubclass(kind, IntEnum)
        for member in kind
    }
    text = "\n" + inspect.getsource(module).split(MARKER, 1)[1].split("\n", 1)[1]
    return re.sub(r"\b[A-Z]\w*\.[A-Z_]+\b", lambda found: numbers.get(found[0], found[0]), text)


def digest(*texts: str) -> str:
    """A name for texts that changes with any of them."""
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:20]


def module_name(kind: str, text: str) -> str:
    """The name of a generated source's module, with a digest of all that its compiled code depends on."""
    return f"saltus_{kind}_{digest(text, inspect.getsource(private_numba))}"


def is_compiled(name: str) -> bool:
    """Whether a module's compiled code is on disk."""
    stem = name.removeprefix("saltus_")
    return any((cache_directory() / "__pycache__").glob(f"{stem}.*.nbi"))


def load_module(kind: str, text: str) -> ModuleType:
    """The module of a generated source: loaded, or written and compiled first."""
    name = module_name(kind, text)
    with _loading:
        if name not in sys.modules:
            path = cache_directory() / f"{name.removeprefix('saltus_')}.py"
            if not path.exists():
                _write(path, text)
            _execute(name, path)
        return sys.modules[name]


def _execute(name: str, path: Path) -> None:
    """Make a module of a source file."""
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # numba finds the functions of a cached module through here
    try:
        with private_numba.pointers():
            spec.loader.exec_module(module)
    except BaseException:  # interrupted while compiling: the next call starts afresh
        del sys.modules[name]
        raise


def _write(path: Path, text: str) -> None:
    """Write a file that appears in one move; all have the same time, as numba trusts what it kept for a file of the same time."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w") as file:
        file.write(text)
    os.utime(temporary, (0, 0))
    os.replace(temporary, path)
