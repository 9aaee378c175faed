"""Compiled code on disk: the folder that it is kept in, and files that are read only as they were
written.

A file's name has a digest of all that its content depends on, so that a change of it makes a new
file. A file is put into its place in one step, and of processes that want the same one a single one
makes it. Code from the cache is run only if the folder belongs to the user and the file is as it
was written: compiled code, Python's, numba's and LLVM's, is compared with its digest. Damaged files
are made again, with a remark. Within a process traces are known by the key of their structure.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import logging
import os
import shutil
import stat
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import is_dataclass
from functools import cache
from importlib.abc import InspectLoader
from pathlib import Path
from types import CodeType, FunctionType, ModuleType, NoneType, SimpleNamespace
from typing import Any, NamedTuple, cast

import numpy as np

from saltus.errors import ParameterError
from saltus.files import lock
from saltus.systems import Record, System, children, is_number

NOBODY = 65534  # the user to whom, inside a container, the files of the superuser outside belong
DIGEST = hashlib.sha256().digest_size  # bytes
# of values that a model's methods read from elsewhere: how far into containers they are compared
DEEPEST = 4
RUN_BY_PYTHON = frozenset({"__post_init__", "__getattr__", "__getattribute__", "__call__"})
PLAIN = frozenset({float, int, bool, str, complex, NoneType})
# Code is known while it is still being loaded or compiled: other threads wait for it.
loading = threading.RLock()
log = logging.getLogger("saltus.cache")


def cache_directory() -> Path:
    """The folder of compiled code: SALTUS_CACHE_DIR, or the user's cache directory, or a temporary
    one if neither can be used.

    As code in it is run, it must be a real folder (no link) that belongs to the user, and to which
    nobody else can write.
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
    # a new name, which nobody else can have prepared
    folder = tempfile.mkdtemp(prefix="saltus-kernels-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


def _problem(folder: Path) -> str | None:
    """The reason why code must not be kept in a folder, or None; the folder is made if it does not
    exist.
    """
    try:
        folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if any(_replaceable(above.stat()) for above in folder.resolve().parents):
            return "other users may put another folder in its place"
        # the second is numba's, which would let the user's group write to it
        for part in (folder, folder / "__pycache__"):
            with contextlib.suppress(FileExistsError):
                part.mkdir(mode=0o700)
            found = _shared(part.lstat())
            if found:
                return found
    except OSError as error:
        return f"it cannot be made ({(error.strerror or str(error)).lower()})"
    return None if os.access(folder, os.W_OK) else "it cannot be written to"


def _replaceable(found: os.stat_result) -> bool:
    """Whether others may rename files in a folder: by its owner, and by who may write to it unless
    it is a temporary directory."""
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
        group = grp.getgrgid(number)
        name = pwd.getpwuid(os.getuid()).pw_name
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


def digest(*texts: str) -> str:
    """A name for texts that changes with any of them."""
    return hashlib.sha256("".join(texts).encode()).hexdigest()[:20]


# --- files -------------------------------------------------------------------


def kept_bytes(name: str, make: Callable[[], bytes]) -> bytes:
    """The content of a file of the cache: read, or made and written first."""
    path = cache_directory() / name
    with loading:
        content = undamaged(str(path))
        if content is None:
            with alone(path):
                content = undamaged(str(path))  # another process may have made it meanwhile
                if content is None:
                    content = make()
                    with contextlib.suppress(OSError):
                        write(path, with_digest(content))
    return content


def with_digest(content: bytes) -> bytes:
    """The content of a file of compiled code: the code, followed by the digest of its bytes."""
    return content + hashlib.sha256(content).digest()


def without_digest(content: bytes) -> bytes | None:
    """The code in the content of a file, or None where the digest is another one."""
    code = content[:-DIGEST]
    return code if with_digest(code) == content else None


def undamaged(path: str) -> bytes | None:
    """The code in a file, without its digest, or None; a damaged file, a link or another user's
    file is removed, with a remark.

    The owner is checked because anybody can compute a digest: a file of another user, or a link,
    was planted while others could write to the folder.
    """
    try:
        found = os.lstat(path)
        own = stat.S_ISREG(found.st_mode) and (
            not hasattr(os, "getuid") or found.st_uid == os.getuid()
        )
        content = Path(path).read_bytes() if own else b""
    except OSError:
        return None
    code = without_digest(content) if own else None
    if code is not None:
        return code
    log.warning("%s is %s; it is compiled again", path, "damaged" if own else "not the user's own")
    with contextlib.suppress(OSError):
        os.unlink(path)
    return None


@contextlib.contextmanager
def alone(path: Path) -> Iterator[None]:
    """Let other processes that need the same file wait and then load the code that this one has
    compiled; if files cannot be locked, they compile it too. The lock is on a file beside it,
    because the file itself may be replaced."""
    with path.with_suffix(".lock").open("ab") as file:
        lock(file, wait=True)
        yield


def write(path: Path, content: bytes) -> None:
    """Write a file into its place in one step. All files get the same time, because numba uses code
    that it has kept only for a source with the same time."""
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


# --- the key of a structure --------------------------------------------------


def structure_key(system: System) -> Any:
    """A key of a system's structure, under which traces are kept: the types of its parts, the
    values that these read from their modules, and all of their fields that are no numbers. If these
    values have changed, the system remembers nothing."""
    spaces, read, key = system._remembered(
        "structure", lambda: ((s := tuple(_spaces(system))), _values(s), _key(system))
    )
    if _values(spaces) == read:
        return key
    vars(system).pop("_memory", None)
    return structure_key(system)


def _spaces(node: Any) -> Iterator[tuple[Mapping[str, Any], str]]:
    parts: dict[str, Any] = {} if isinstance(node, Record) else children(node)
    yield from _outside(type(node))
    for part in parts.values():
        if type(part) is not float:
            yield from _spaces(part)


def _values(spaces: tuple[tuple[Mapping[str, Any], str], ...]) -> tuple[Any, ...]:
    return tuple(_content(space.get(name)) for space, name in spaces)


class _Itself:
    """An object that equals itself alone, whatever its class says of equality."""

    def __init__(self, value: Any) -> None:
        self.value = value  # kept, so that no other object takes its place in memory

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and other.value is self.value

    def __hash__(self) -> int:
        return id(self.value)


def _content(value: Any, depth: int = 0) -> Any:
    """What a trace may contain of a value that methods read: numbers and texts, what containers,
    arrays and simple objects hold, and else which object it is.
    """
    kind = type(value)
    equality: Any = kind.__eq__
    if kind in PLAIN or equality is object.__eq__:
        return value
    if depth == DEEPEST:
        return _Itself(value)
    if kind in (tuple, list):
        return kind, tuple([_content(entry, depth + 1) for entry in value])
    if kind is dict:
        return kind, tuple([(key, _content(entry, depth + 1)) for key, entry in value.items()])
    if isinstance(value, (np.ndarray, np.generic)) and value.dtype != object:
        return kind, value.shape, value.dtype.str, value.tobytes()
    if kind is SimpleNamespace or _may_change(kind):
        return kind, _content(vars(value), depth + 1)
    return _Itself(value)


def _may_change(kind: type) -> bool:
    """Whether objects of a class are dataclasses whose fields can be replaced."""
    return is_dataclass(kind) and not kind.__dataclass_params__.frozen  # type: ignore[attr-defined]


def _key(node: Any) -> Any:
    kind: Any
    # its samples and its scale are numbers; the file that they came from does not matter
    if isinstance(node, Record):
        return Record, node.quantity
    parts = children(node)
    kind = type(node)
    if hasattr(kind, "structure_key"):  # of what holds numbers that are no fields
        return node.structure_key
    if parts:
        named = [
            (name, float if type(part) is float else _key(part)) for name, part in parts.items()
        ]
        return kind, _values(_outside(kind)), tuple(named)
    if is_number(node):
        return float
    if isinstance(node, np.ndarray):
        return node.shape, node.dtype.str, node.tobytes()
    if kind.__hash__ is None:
        raise ParameterError(
            f"a field of a model must be a number, an array or a tuple, got a "
            f"{kind.__name__}, {node!r}"
        )
    outside = _outside(kind)
    return (node, _values(outside)) if outside else node


class _Read(NamedTuple):
    """The names that the methods of a class read, and the functions in which they were found."""

    spaces: tuple[tuple[Mapping[str, Any], str], ...]
    functions: tuple[tuple[Mapping[str, Any], str, FunctionType], ...]


class _Cells(Mapping[str, Any]):
    """The values that a function closes over, by name."""

    def __init__(self, function: FunctionType) -> None:
        cells = function.__closure__ or ()
        self._cells = dict(zip(function.__code__.co_freevars, cells, strict=True))

    def __getitem__(self, name: str) -> Any:
        try:
            return self._cells[name].cell_contents
        except ValueError:  # it is given a value later
            return None

    def __iter__(self) -> Iterator[str]:
        return iter(self._cells)

    def __len__(self) -> int:
        return len(self._cells)


_read: dict[type, _Read] = {}  # of the classes of users


def _outside(cls: type) -> tuple[tuple[Mapping[str, Any], str], ...]:
    """The names and namespaces of values that the methods of a user's class read from its module or
    class; a trace contains these values. They are looked for again where a function that reads
    them was replaced.
    """
    read = _read.get(cls)
    if read is None or any(space.get(name) is not f for space, name, f in read.functions):
        read = _read[cls] = _names_read(cls)
    return read.spaces


def _names_read(cls: type) -> _Read:
    spaces: dict[tuple[int, str], tuple[Mapping[str, Any], str]] = {}
    functions: list[tuple[Mapping[str, Any], str, FunctionType]] = []
    waiting = list[Any]()
    seen: set[int] = set()
    own = _package_of(cls.__module__)

    def never_changes(module: str | None) -> bool:
        return _package_of(module) != own and _is_installed(module)

    def note(space: Mapping[str, Any], name: str) -> None:
        value = space[name]
        if (id(space), name) in spaces:
            return
        spaces[id(space), name] = space, name
        if isinstance(value, FunctionType):
            functions.append((space, name, value))
        waiting.append(value)

    for owner in cls.__mro__:
        if owner.__module__.partition(".")[0] in ("saltus", "builtins"):
            continue
        attributes = vars(owner)
        for name in attributes:
            # what else Python adds to a class says nothing about what its methods do
            if not name.startswith("__") or name in RUN_BY_PYTHON:
                note(attributes, name)
    while waiting:
        value = waiting.pop()
        function = getattr(value, "fget", None) or getattr(value, "__func__", value)
        if (
            not isinstance(function, FunctionType)
            or id(function) in seen
            or never_changes(function.__module__)
        ):
            continue
        seen.add(id(function))
        cells = _Cells(function)
        for name in cells:
            note(cells, name)
        space = function.__globals__
        names = _names_in(function.__code__)
        for name in names & space.keys():
            value = space[name]
            if not isinstance(value, ModuleType):
                note(space, name)
            elif not never_changes(value.__name__):
                for attribute in names & vars(value).keys():
                    note(vars(value), attribute)
    return _Read(tuple(spaces.values()), tuple(functions))


def _names_in(code: CodeType) -> set[str]:
    """The names of globals and of attributes in code, and in that of functions inside of it."""
    inner = [part for part in code.co_consts if isinstance(part, CodeType)]
    return set(code.co_names).union(*map(_names_in, inner))


def _package_of(module: str | None) -> str:
    return (module or "__main__").partition(".")[0]


@cache
def _is_installed(module: str | None) -> bool:
    """Whether a module is of saltus, of Python or of an installed package."""
    root = _package_of(module)
    if root == "__main__":
        return False
    if root in sys.stdlib_module_names or root == "saltus":
        return True
    file = getattr(sys.modules.get(root), "__file__", None)
    return file is not None and not {"site-packages", "dist-packages"}.isdisjoint(Path(file).parts)
