"""Compiled code on disk: generated source files in the user's cache directory, each with numba's compiled code beside it.

A file's name is a digest of its whole source and of the compiler's options, so that a change of either makes a new file. A file
is put into its place in one step, so that processes that compile at the same time do not disturb each other. Code from the cache
is run only if the folder belongs to the user and the file is as it was written: a source is compared with the wanted text, and
compiled code, Python's and numba's, with its digest. Damaged files are made again, with a remark.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import logging
import marshal
import os
import re
import shutil
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator
from enum import IntEnum
from functools import cache
from importlib.abc import InspectLoader
from importlib.util import MAGIC_NUMBER
from pathlib import Path
from types import CodeType, ModuleType
from typing import cast

from saltus.files import lock
from saltus.taylor import private_numba, references

NOBODY = 65534  # the user to whom, inside a container, the files of the superuser outside belong
MARKER = "# --- compiled from here on"
log = logging.getLogger("saltus.cache")
_loading = threading.RLock()  # A module is in `sys.modules` while it is still being executed: other threads wait for it.


def cache_directory() -> Path:
    """The folder of compiled code: SALTUS_CACHE_DIR, or the user's cache directory, or a temporary one if neither can be used.

    As code in it is run, it must be a real folder (no link) that belongs to the user, and to which nobody else can write.
    """
    wanted = Path(os.environ.get("SALTUS_CACHE_DIR") or _user_cache()) / "kernels"
    user = os.getuid() if hasattr(os, "getuid") else "user"
    for folder in (wanted, Path(tempfile.gettempdir()) / f"saltus-kernels-{user}"):
        problem = _problem(folder)
        if problem is None:
            return folder
        if (folder, problem) not in _remarked:
            _remarked.add((folder, problem))
            log.warning("compiled code is not kept in %s: %s", folder, problem)
    return _own_folder()


_remarked: set[tuple[Path, str]] = set()


def _user_cache() -> str:
    from platformdirs import user_cache_dir

    return user_cache_dir("saltus", appauthor=False)


@cache
def _own_folder() -> Path:
    """A folder for this process alone, which is removed at its end."""
    folder = tempfile.mkdtemp(prefix="saltus-kernels-")  # a new name, which nobody else can have prepared
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _problem(folder: Path) -> str | None:
    """The reason why code must not be kept in a folder, or None; the folder is made if it does not exist."""
    try:
        folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if any(_replaceable(above.stat()) for above in folder.resolve().parents):
            return "other users may put another folder in its place"
        for part in (folder, folder / "__pycache__"):  # the second is numba's, which would let the user's group write to it
            with contextlib.suppress(FileExistsError):
                part.mkdir(mode=0o700)
            found = _shared(part.lstat())
            if found:
                return found
    except OSError as error:
        return f"it cannot be made ({(error.strerror or str(error)).lower()})"
    return None if os.access(folder, os.W_OK) else "it cannot be written to"


def _replaceable(found: os.stat_result) -> bool:
    """Whether others may rename files in a folder: by its owner, and by who may write to it unless it is a temporary
    directory."""
    if not hasattr(os, "getuid"):
        return False
    if found.st_uid not in (0, os.getuid(), NOBODY):
        return True
    by_group = found.st_mode & stat.S_IWGRP and not _is_own_group(found.st_gid)
    return bool(found.st_mode & stat.S_IWOTH or by_group) and not found.st_mode & stat.S_ISVTX


def _is_own_group(number: int) -> bool:
    """Whether a group has no other members than the user, whose name it has, or the superuser."""
    import grp
    import pwd

    try:
        group, name = grp.getgrgid(number), pwd.getpwuid(os.getuid()).pw_name
    except KeyError:  # the group has no name, and its members are unknown
        return False
    return (number == 0 or group.gr_name == name) and set(group.gr_mem) <= {name}


def _shared(found: os.stat_result) -> str | None:
    """The reason why a folder is not the user's alone, or None."""
    if not stat.S_ISDIR(found.st_mode):
        return "it is a link or a file"
    if not hasattr(os, "getuid"):
        return None
    if found.st_uid != os.getuid():
        return "it belongs to another user"
    return "other users may write to it" if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else None


@cache
def source_of(module: ModuleType) -> str:
    """The text of a module, from its loader, since `inspect` would search all modules first."""
    return str(cast(InspectLoader, module.__loader__).get_source(module.__name__))


@cache
def compiled_part(module: ModuleType) -> str:
    """The compiled part of a source file: the text below its marker, with members of `IntEnum`s replaced by their numbers."""
    numbers = {
        f"{name}.{member.name}": str(int(member))
        for name, kind in vars(module).items()
        if isinstance(kind, type) and issubclass(kind, IntEnum)
        for member in kind
    }
    text = "\n" + source_of(module).split(MARKER, 1)[1].split("\n", 1)[1]
    return re.sub(r"\b[A-Z]\w*\.[A-Z_]+\b", lambda found: numbers.get(found[0], found[0]), text)


def digest(*texts: str) -> str:
    """A name for texts that changes with any of them."""
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:20]


def module_name(kind: str, text: str) -> str:
    """The name of a generated source's module, with a digest of all that its compiled code depends on."""
    return f"saltus_{kind}_{digest(text, source_of(private_numba), source_of(references))}"


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
            with contextlib.nullcontext() if _holds(path, text) and is_compiled(name) else _alone(path):
                if not _holds(path, text):
                    if path.exists():
                        log.warning("%s is damaged; it is written again", path)
                    _write(path, text.encode())
                _execute(name, path, text)
        return sys.modules[name]


@contextlib.contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Let other processes that need the same source wait and then load the code that this one has compiled; if files cannot be
    locked, they compile it too. The lock is on a file beside the source, because the source itself may be replaced."""
    with path.with_suffix(".lock").open("ab") as file:
        lock(file, wait=True)
        yield


def _holds(path: Path, text: str) -> bool:
    """Whether a file has this text."""
    try:
        return path.is_file() and path.read_bytes() == text.encode()
    except OSError:
        return False


def _execute(name: str, path: Path, text: str) -> None:
    """Make a module of a source that is also in a file, beside which numba keeps the compiled code."""
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module  # numba finds the functions of a cached module through here
    try:
        with private_numba.pointers():
            exec(_bytecode(path, text), vars(module))
    except BaseException:  # interrupted while compiling: the next call starts afresh
        del sys.modules[name]
        raise


def _bytecode(path: Path, text: str) -> CodeType:
    """A source's bytecode, which is kept beside numba's code: parsing the text would take longer than loading numba's code."""
    file = path.parent / "__pycache__" / f"{path.stem}.{MAGIC_NUMBER.hex()}.bytecode"
    content = private_numba.undamaged(str(file))
    if content is not None:
        kept: CodeType = marshal.loads(content)
        if kept.co_filename == str(path):  # the folder has not been moved
            return kept
    code = compile(text, str(path), "exec")
    with contextlib.suppress(OSError):
        _write(file, private_numba.with_digest(marshal.dumps(code)))
    return code


def _write(path: Path, content: bytes) -> None:
    """Write a file into its place in one step. All files get the same time, because numba uses code that it has kept only for a
    source with the same time."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.utime(temporary, (0, 0))
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
