"""Files of a store: complete or not there, found by name, and locked while a run writes."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import secrets
import shutil
import stat
import time
from collections.abc import Iterator
from pathlib import Path

from saltus.files import PART, STALE, lock, write_durably
from saltus.sweep.chunk_grid import Index

METADATA = "zarr.json"
FAILURES = ".failures.json"
CHECKSUMS = ".checksums.json"  # of the files that are written once, when the store is made: all but the chunks
LOCK_PATIENCE = 1.0  # s to wait for a lock: a process that only looks whether there is one holds it for a moment


def write_checksums(root: Path) -> None:
    """Write down the SHA-256 of every file below the new store at `root`."""
    found = {str(file.relative_to(root)): _sha256(file) for file in sorted(root.rglob("*")) if file.is_file()}
    write_durably(root / CHECKSUMS, json.dumps(found, indent=1).encode())


def damaged_files(root: Path) -> list[str]:
    """The files, chunks left out, that are missing or are not what they were when the store at `root` was made."""
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
    known = json.loads((root / CHECKSUMS).read_bytes())
    if not isinstance(known, dict) or METADATA not in known or not all(isinstance(text, str) for text in known.values()):
        raise ValueError
    return known


def _sha256(file: Path) -> str | None:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else None
    except (OSError, ValueError):
        return None


def chunk_name(variable: str, index: Index, extra: int) -> str:
    """Where in a store Zarr's default encoding keeps a chunk of a variable with `extra` dimensions beside the grid's axes."""
    return "/".join((variable, "c", *map(str, index), *("0" for _ in range(extra))))


def chunk_file(root: Path, variable: str, index: Index, extra: int) -> Path:
    """The file of a chunk in the store at `root`."""
    return root / chunk_name(variable, index, extra)


def all_files(root: Path) -> dict[str, os.stat_result]:
    """The files below `root`, by their names from there: devices and pipes, which may have no end, are none.

    To look through the folders takes a hundredth of the time of asking for each of a million chunks.
    """
    found = {}
    for folder, _, names in os.walk(root):
        inner = Path(folder).relative_to(root).as_posix()
        for name in names:
            with contextlib.suppress(OSError):  # written beside its place, and moved there meanwhile
                entry = os.stat(os.path.join(folder, name))
                if stat.S_ISREG(entry.st_mode):
                    found[name if inner == "." else f"{inner}/{name}"] = entry
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
    """Remove what killed runs left half-written, in the store at `path` and beside it. The caller has the lock."""
    for part in list(path.rglob(f".*{PART}")):  # only who has the lock writes here
        with contextlib.suppress(OSError):
            shutil.rmtree(part) if part.is_dir() else part.unlink()
    for part in path.parent.glob(f".{path.name}.*{PART}"):
        with contextlib.suppress(OSError):
            if time.time() - part.stat().st_mtime > STALE:
                shutil.rmtree(part)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[bool | None]:
    """Lock the store at `path` for one run; yields whether it could, None where there are no locks or it is read-only.

    The lock is on the store's metadata, a file that is never written again. It ends with the process, however that ends.
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
    """Whether a run has the lock of the store at `path`; None where that cannot be told."""
    try:
        with (path / METADATA).open("rb") as file:
            got = lock(file, shared=True)
    except OSError:
        return None
    return None if got is None else not got
