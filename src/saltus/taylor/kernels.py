"""Kernels: functions that numba compiles, from the text of several files, into modules that are
kept on disk.

A file that contains functions of a kernel has a line `MARKER`, below which it is compiled. The text
there becomes a part of generated modules (`compiled_part`), because numba's cache does not see
changes of functions in other files. Their header imports the decorators from `private_numba.py`,
which compile. The decorators here, which such a file imports itself, have the same names and
compile nothing: imported directly, the file gives its constants, and its functions in plain Python.
"""

from __future__ import annotations

import contextlib
import logging
import marshal
import re
import sys
from collections.abc import Callable
from enum import IntEnum
from functools import cache
from importlib.util import MAGIC_NUMBER
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from saltus.checks import LIMITS
from saltus.progress import say
from saltus.taylor import numba_types, private_numba
from saltus.taylor.cache import (
    alone,
    cache_directory,
    digest,
    loading,
    source_of,
    undamaged,
    with_digest,
    write,
)
from saltus.taylor.shipped import is_shipped

MARKER = "# --- compiled from here on"
log = logging.getLogger("saltus.cache")


def jit(function: Any) -> Any:
    """A function that others of its kernel call."""
    return function


lean_jit = inline_jit = jit


def cached_jit(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """A function of one signature that is called from outside its kernel."""
    return jit


def by_reference(given: Any) -> Any:
    """A tuple that functions are given by its address."""
    return given


@cache
def compiled_part(module: ModuleType) -> str:
    """The compiled part of a source file: the text below its marker, with members of `IntEnum`s
    replaced by their numbers.
    """
    numbers = {
        f"{name}.{member.name}": str(int(member))
        for name, kind in vars(module).items()
        if isinstance(kind, type) and issubclass(kind, IntEnum)
        for member in kind
    }
    text = "\n" + source_of(module).split(MARKER, 1)[1].split("\n", 1)[1]
    return re.sub(r"\b[A-Z]\w*\.[A-Z_]+\b", lambda found: numbers.get(found[0], found[0]), text)


def module_name(kind: str, text: str) -> str:
    """The name of a generated source's module, with a digest of all that its compiled code depends
    on.
    """
    way = "plain" if private_numba.is_plain() else "quick"
    return f"saltus_{kind}_{digest(text, source_of(private_numba), source_of(numba_types), way)}"


def is_compiled(name: str) -> bool:
    """Whether a module's compiled code is on disk, in the cache or as a part of a wheel."""
    stem = name.removeprefix("saltus_")
    return is_shipped(stem) or any((cache_directory() / "__pycache__").glob(f"{stem}.*.nbi"))


def load_module(kind: str, text: str) -> ModuleType:
    """The module of a generated source: loaded, or written and compiled first.

    If a private part of numba is another than expected, everything is compiled in numba's plain way
    from then on.
    """
    with loading:
        try:
            return _loaded(module_name(kind, text), text)
        except OSError:
            raise
        except Exception as error:  # numba wraps what it meets in errors of its own
            if private_numba.is_plain():
                raise
            private_numba.be_plain()
            try:
                made = _loaded(module_name(kind, text), text)
            except Exception:
                raise error from None  # which has another reason, then
            log.warning(
                "numba is used in its plain way, which compiles for longer: %s",
                str(error).splitlines()[0],
            )
            return made


def _loaded(name: str, text: str) -> ModuleType:
    if name not in sys.modules:
        path = cache_directory() / f"{name.removeprefix('saltus_')}.py"
        with contextlib.nullcontext() if _holds(path, text) and is_compiled(name) else alone(path):
            if not _holds(path, text):
                if path.exists():
                    log.warning("%s is damaged; it is written again", path)
                write(path, text.encode())
            if not is_compiled(name):
                kind = name.removeprefix("saltus_").rpartition("_")[0]
                say(f"compiling the kernel {kind!r}, once for all models (up to half a minute)")
            _execute(name, path, text)
    return sys.modules[name]


def told_before(traced: Any, kind: str, text: str) -> str:
    """LLVM's text of a trace, which is said to be compiled if that takes more than a moment."""
    seconds = len(text) / LIMITS.letters
    columns = "the sensitivities of " * bool(traced.columns)
    if seconds > LIMITS.unsaid:
        model = f"{traced.model}, a model of {traced.dof} coordinate{'s' * (traced.dof > 1)}"
        say(
            f"compiling {'ensembles of ' * (kind == 'lane')}{columns}{model} (some {seconds:.0f} "
            "s, once)"
        )
    return text


def _holds(path: Path, text: str) -> bool:
    """Whether a file has this text."""
    try:
        return path.is_file() and path.read_bytes() == text.encode()
    except OSError:
        return False


def _execute(name: str, path: Path, text: str) -> None:
    """Make a module of a source that is also in a file, beside which numba keeps the compiled
    code.
    """
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # numba finds the functions of a cached module through here
    try:
        exec(_bytecode(path, text), vars(module))
    except BaseException:  # interrupted while compiling: the next call starts afresh
        del sys.modules[name]
        raise


def _bytecode(path: Path, text: str) -> CodeType:
    """A source's bytecode, which is kept beside numba's code: parsing the text would take longer
    than loading numba's code.
    """
    file = path.parent / "__pycache__" / f"{path.stem}.{MAGIC_NUMBER.hex()}.bytecode"
    content = undamaged(str(file))
    if content is not None:
        kept: CodeType = marshal.loads(content)
        if kept.co_filename == str(path):  # the folder has not been moved
            return kept
    code = compile(text, str(path), "exec")
    with contextlib.suppress(OSError):
        write(file, with_digest(marshal.dumps(code)))
    return code
