"""Files of a store: complete or not there, found by name, and locked while a run writes."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from saltus.sweep.chunk_grid import Index

METADATA = "zarr.json"
FAILURES = ".failures.json"
PART = ".part"
STALE = 60.0  # s; a store is made in much less, so what was begun earlier was left by a killed run
LOCK_PATIENCE = 1.0  # s to wait for a lock: a process that only looks whether there is one holds it for a moment


def write_durably(path: Path, content: bytes) -> None:
    """Write a file so that whoever finds it finds all of it, after a kill or a power failure too.

    It is written beside its place, brought to the disk, and moved there. If that fails nothing is left.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{secrets.token_hex(6)}{PART}")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def chunk_file(root: Path, variable: str, index: Index, extra: int) -> Path:
    """Where Zarr's default encoding keeps a chunk of a variable with `extra` dimensions beside the grid's axes."""
    return root.joinpath(variable, "c", *map(str, index), *("0" for _ in range(extra)))


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
    for part in path.rglob(f".*{PART}"):
        with contextlib.suppress(OSError):
            part.unlink()
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
        while (got := _lock(file)) is False and time.monotonic() < deadline:
            time.sleep(0.05)
        yield got


def in_use(path: Path) -> bool | None:
    """Whether a run has the lock of the store at `path`; None where that cannot be told."""
    try:
        with (path / METADATA).open("rb") as file:
            got = _lock(file, shared=True)
    except OSError:
        return None
    return None if got is None else not got


def _lock(file: IO[bytes], shared: bool = False) -> bool | None:
    """Try to lock an open file until it is closed: whether it could, None where there are no locks."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True
