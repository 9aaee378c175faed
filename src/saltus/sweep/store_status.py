"""How far a sweep is, read from the files of its store alone."""

from __future__ import annotations

import datetime
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from saltus.errors import ParameterError
from saltus.sweep import store_files as files
from saltus.sweep.chunk_grid import ChunkGrid
from saltus.sweep.chunk_results import Failure


@dataclass(frozen=True)
class StoreStatus:
    """How far a sweep is.

    `done` and `failed` count chunks, of `total`; a failed chunk is one that raised when it was last tried. `bytes` is the size of
    the store's files. `started` is when the store was made, `updated` when the last chunk was written (None: none yet).
    `running` is whether a run on this machine is writing to it, None where the file system has no locks.
    """

    path: Path
    kind: str
    function: str
    sizes: dict[str, int]
    done: int
    total: int
    failures: tuple[Failure, ...]
    bytes: int
    started: datetime.datetime
    updated: datetime.datetime | None
    running: bool | None

    @property
    def failed(self) -> int:
        """The number of chunks that failed."""
        return len(self.failures)

    @property
    def complete(self) -> bool:
        """Whether every chunk is there."""
        return self.done == self.total


def status(path: Path | str) -> StoreStatus:
    """How far the sweep is whose store is at `path`.

    Raises:
        ParameterError: there is no store of a sweep at `path`.
    """
    path = Path(path)
    plan = read_plan(path)
    chunks = ChunkGrid({name: plan["axes"][name]["size"] for name in plan["order"]}, plan["chunk"])
    variables = {name: len(variable["extra"]) for name, variable in plan["variables"].items()}
    missing, updated = set(), 0.0
    for index in chunks.indices():
        times = [_written(files.chunk_file(path, name, index, extra)) for name, extra in variables.items()]
        if not all(times):
            missing.add(index)
        updated = max(updated, *times)
    return StoreStatus(
        path=path,
        kind=str(plan["attrs"].get("kind") or plan["attrs"].get("title") or "sweep"),
        function=plan["function"],
        sizes=dict(chunks.sizes),
        done=chunks.total - len(missing),
        total=chunks.total,
        failures=tuple(failure for failure in _failures(path) if failure.index in missing),
        bytes=_size(path),
        started=_moment(os.path.getmtime(path / files.METADATA)),
        updated=_moment(updated) if updated else None,
        running=files.in_use(path),
    )


def read_plan(path: Path) -> dict[str, Any]:
    """The plan that the store at `path` was made for, as JSON.

    Raises:
        ParameterError: there is nothing at `path`, or no store, or one that is not of a sweep.
    """
    if not path.exists():
        raise ParameterError(f"there is no store at {path}")
    if not path.is_dir():
        raise ParameterError(f"{path} is a file; the store of a sweep is a folder")
    try:
        group = json.loads((path / files.METADATA).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ParameterError(f"{path} is not a store: it has no {files.METADATA}") from None
    except (OSError, ValueError) as error:
        raise ParameterError(f"{path / files.METADATA} cannot be read ({error})") from error
    try:
        plan = json.loads(group["attributes"]["plan"])
        return {key: plan[key] for key in ("function", "arguments", "order", "axes", "chunk", "variables", "attrs")}
    except (KeyError, TypeError, ValueError):
        raise ParameterError(f"{path} is a Zarr store, but not of a sweep: it keeps no plan") from None


def _written(file: Path) -> float:
    """When a file was written, 0.0 if it is not there."""
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _failures(path: Path) -> tuple[Failure, ...]:
    try:
        entries = json.loads((path / files.FAILURES).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ()
    failures = (Failure(tuple(e["index"]), e["place"], e["error"], e["attempts"]) for e in entries)
    return tuple(sorted(failures, key=lambda failure: failure.index))  # workers fail in any order


def _size(path: Path) -> int:
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            try:
                total += os.path.getsize(os.path.join(folder, name))
            except OSError:  # written beside its place, and moved there meanwhile
                continue
    return total


def _moment(seconds: float) -> datetime.datetime:
    return datetime.datetime.fromtimestamp(seconds).astimezone()
