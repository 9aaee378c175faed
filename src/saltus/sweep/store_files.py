"""Files of a store: complete or not there, found by name, and locked while a run writes; and those
of a memo.

A file of a memo is JSON and the bytes of arrays, with a checksum; reading it makes numbers and
texts, and runs nothing.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
import shutil
import signal
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.files import PART, STALE, checked_content, lock, parsed_json, write_durably
from saltus.sweep.chunks import Index

METADATA = "zarr.json"
FAILURES = ".failures.json"
# the digests of the files that are written when the store is made: all but the chunks
CHECKSUMS = ".checksums.json"
# sizes and times are read of so many chunks of a variable; the others are only listed
ASKED_ONE_BY_ONE = 100_000
# how long to wait for a lock, s: a process that only checks whether there is one holds it briefly
LOCK_PATIENCE = 1.0


def write_checksums(root: Path) -> None:
    """Write down the SHA-256 of every file below the new store at `root`."""
    found = {
        str(file.relative_to(root)): _sha256(file)
        for file in sorted(root.rglob("*"))
        if file.is_file()
    }
    write_durably(root / CHECKSUMS, json.dumps(found, indent=1).encode())


def damaged_files(root: Path) -> list[str]:
    """The files other than chunks that are missing or have changed since the store at `root` was
    made.
    """
    try:
        known = checksums(root)
    except (OSError, ValueError):
        return [CHECKSUMS]
    return [name for name, kept in known.items() if _sha256(root / name) != kept]


def checksums(root: Path) -> dict[str, str]:
    """The digests of the files that were written when the store at `root` was made.

    Raises
    ------
    OSError
        They cannot be read.
    ValueError
        They cannot be read.
    """
    if not (root / CHECKSUMS).is_file():  # a pipe may have no end
        raise FileNotFoundError
    known = parsed_json((root / CHECKSUMS).read_bytes())
    if (
        not isinstance(known, dict)
        or METADATA not in known
        or not all(isinstance(text, str) for text in known.values())
    ):
        raise ValueError
    return known


def _sha256(file: Path) -> str | None:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else None
    except (OSError, ValueError):
        return None


def chunk_name(variable: str, index: Index, extra: int) -> str:
    """The path in a store, by Zarr's default encoding, of a chunk of a variable with `extra`
    dimensions after the grid's axes.
    """
    return "/".join((variable, "c", *map(str, index), *("0" for _ in range(extra))))


def chunk_file(root: Path, variable: str, index: Index, extra: int) -> Path:
    """The file of a chunk in the store at `root`."""
    return root / chunk_name(variable, index, extra)


@dataclass
class Found:
    """Files of a store: their number, their size in bytes, when the last one was written (0.0:
    none), and the chunks there.
    """

    there: np.ndarray  # (chunks along each axis), bool
    count: int = 0
    bytes: float = 0.0
    updated: float = 0.0

    def add(self, path: str) -> bool:
        """Add a file after asking the system about it; False for devices and pipes, which may have
        no end.
        """
        try:
            found = os.stat(path)
        except OSError:  # a half-written file that was moved to its place in the meantime
            return False
        if not stat.S_ISREG(found.st_mode):
            return False
        self.count += 1
        self.bytes += found.st_size
        self.updated = max(self.updated, found.st_mtime)
        return True


def chunks_of(root: Path, variable: str, grid: tuple[int, ...], extra: int) -> Found:
    """The chunks of a variable with `extra` dimensions beside the grid's axes that have a file in
    the store at `root`.

    If there are more than `ASKED_ONE_BY_ONE` chunks only their folders are read, in a sixth of the
    time: the size is then estimated from the first ones, and the time of the last write is that of
    the folders.
    """
    found = Found(np.zeros(grid, dtype=bool))
    inner = "/0" * extra
    further = 0
    names = [{str(i): i for i in range(n)} for n in grid]

    def look(folder: str, there: np.ndarray) -> None:
        nonlocal further
        places = names[-there.ndim]
        before = further
        with contextlib.suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                place = places.get(entry.name)
                if place is None:
                    continue
                if there.ndim > 1:
                    look(entry.path, there[place])
                elif inner or found.count < ASKED_ONE_BY_ONE:
                    there[place] = found.add(entry.path + inner)
                elif entry.is_file():
                    there[place] = True
                    further += 1
            if further > before and there.ndim == 1:
                found.updated = max(found.updated, os.stat(folder).st_mtime)

    look(str(root / variable / "c"), found.there)
    found.bytes *= 1.0 + further / max(found.count, 1)
    return found


def other_files(root: Path, variables: Iterable[str]) -> Found:
    """The files below `root` other than chunks of its variables: metadata, coordinates, parts."""
    found = Found(np.empty(0))
    chunks = {str(root / variable / "c") for variable in variables}
    folders = [str(root)]
    while folders:
        with contextlib.suppress(OSError), os.scandir(folders.pop()) as entries:
            for entry in entries:
                if not entry.is_dir(follow_symlinks=False):
                    found.add(entry.path)
                elif entry.path not in chunks:
                    folders.append(entry.path)
    return found


def begin(path: Path) -> Path:
    """A new folder beside `path`, in which a store can be made unseen."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{secrets.token_hex(6)}{PART}")
    part.mkdir()
    return part


def finish(part: Path, path: Path) -> None:
    """Move the folder `part` to `path` in one step, or drop it if another run was first."""
    try:
        os.rename(part, path)
    except OSError:
        shutil.rmtree(part, ignore_errors=True)
        if not (path / METADATA).exists():
            raise


def sweep_up(path: Path) -> None:
    """Remove the half-written files of killed runs, in the store at `path` and beside it.

    The caller holds the lock.
    """
    for part in list(path.rglob(f".*{PART}")):  # no other process writes here without the lock
        with contextlib.suppress(OSError):
            shutil.rmtree(part) if part.is_dir() else part.unlink()
    for part in path.parent.glob(f".{path.name}.*{PART}"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > STALE:
                shutil.rmtree(part)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[bool | None]:
    """Lock the store at `path` for one run; yields whether this succeeded, None if there are no
    locks or it is read-only.

    The lock is on the store's metadata file, which is never written again. It is released when the
    process ends, however it ends.
    """
    try:
        file = (path / METADATA).open("r+b")
    except OSError:
        yield None
        return
    with file:
        deadline = time.monotonic() + LOCK_PATIENCE
        while (got := lock(file)) is False and time.monotonic() < deadline:
            time.sleep(0.05)
        yield got


def in_use(path: Path) -> bool | None:
    """Whether a run holds the lock of the store at `path`; None if the file system cannot tell."""
    try:
        with (path / METADATA).open("rb") as file:
            got = lock(file, shared=True)
    except OSError:
        return None
    return None if got is None else not got


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[Callable[[], None]]:
    """A context in which Ctrl-C raises nothing at once; the function that it yields raises
    KeyboardInterrupt if there was one.

    Python would raise it wherever the main thread happens to be: in a destructor of another
    library, where it is lost, or while a lock is being taken. Outside the main thread signals do
    not arrive, and the context changes nothing.
    """
    seen: list[int] = []

    def raise_if_interrupted() -> None:
        if seen:
            raise KeyboardInterrupt

    def remember(number: int, _: Any) -> None:
        seen.append(number)

    try:
        before = signal.signal(signal.SIGINT, remember)
    except ValueError:
        yield raise_if_interrupted
        return
    try:
        yield raise_if_interrupted
    finally:
        signal.signal(signal.SIGINT, before)


# of a store: where its memo is, and how the files of it end
FOLDER = "parts"
SUFFIX = ".memo"


def files_of(store: Path) -> list[Path]:
    """The files of a memo in a store."""
    return sorted((store / FOLDER).glob(f"*{SUFFIX}"))


def memo_status(store: Path, verify: bool = False) -> tuple[dict[str, int], list[str]]:
    """How many chunks of each kind the memo in a store has; with `verify` all are read, and those
    that are damaged are named.
    """
    counts = dict[str, int]()
    damaged = []
    for file in files_of(store):
        kind = file.name.rpartition("_")[0]
        counts[kind] = counts.get(kind, 0) + 1
        try:
            if verify:
                unpacked(checked_content(file))
        except (ParameterError, ValueError):
            damaged.append(f"{FOLDER}/{file.name}")
    return counts, damaged


def packed(value: Any) -> bytes:
    """A value of what JSON has and of arrays as bytes: a line of JSON, then the bytes of the arrays
    in their order.
    """
    arrays: list[np.ndarray] = []

    def plain(part: Any) -> Any:
        if isinstance(part, (np.ndarray, np.void)):
            part = np.asarray(part)
            arrays.append(np.ascontiguousarray(part))
            return {"array": [np.lib.format.dtype_to_descr(part.dtype), list(part.shape)]}
        if isinstance(part, Mapping):
            return {"dict": {name: plain(each) for name, each in part.items()}}
        if isinstance(part, (list, tuple)):
            return [plain(each) for each in part]
        return part.item() if isinstance(part, np.generic) else part

    line = json.dumps(plain(value)).encode()
    return b"".join((line, b"\n", *(array.tobytes() for array in arrays)))


def unpacked(content: bytes) -> Any:
    """The value that `packed` has written.

    Raises
    ------
    ValueError
        The bytes are of anything else.
    """
    line, _, rest = content.partition(b"\n")
    at = 0

    def full(part: Any) -> Any:
        nonlocal at
        if isinstance(part, list):
            return [full(each) for each in part]
        if not isinstance(part, dict):
            return part
        if "dict" in part:
            return {name: full(each) for name, each in part["dict"].items()}
        descr, shape = part["array"]
        dtype = np.lib.format.descr_to_dtype(_fields(descr))
        count = int(np.prod(shape, dtype=object))
        array = (
            np.frombuffer(rest, dtype, count, at).reshape(shape)
            if count
            else np.zeros(shape, dtype)
        )
        at += count * dtype.itemsize
        return array.copy()

    try:
        return full(json.loads(line))
    except (AttributeError, KeyError, OverflowError, RecursionError, TypeError) as error:
        raise ValueError(f"this is not a file of results ({type(error).__name__})") from error


def _fields(descr: Any) -> Any:
    """The description of a type of arrays, in which JSON has made lists of tuples."""
    if isinstance(descr, str):
        return descr
    return [
        (name, _fields(inner), *(tuple(shape) for shape in more)) for name, inner, *more in descr
    ]
