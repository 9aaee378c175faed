"""The state of a sweep, read from the files of its store alone."""

from __future__ import annotations

import datetime
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from saltus.checks import LIMITS, answered
from saltus.errors import ParameterError
from saltus.files import parsed_json
from saltus.sweep import store_files as files
from saltus.sweep.chunks import ChunkGrid, Failure, Index
from saltus.sweep.store_files import memo_status

CODECS = {"bytes", "zstd", "crc32c"}  # as a store is made
NAMED = 3  # damaged files that a sentence names


@dataclass(frozen=True)
class StoreStatus:
    """The state of a sweep, from its store.

    A failed chunk is one that raised an error when it was last tried. The size of stores with more
    than 100 000 chunks is estimated (`estimated`). A chunk with a damaged file is not done.

    Attributes
    ----------
    path
        The folder.
    kind
        The kind of its result, such as "basins".
    function
        The name of the function that computes a chunk.
    sizes
        The length of each dimension by its name.
    done
        The number of chunks that are complete.
    total
        The number of all chunks.
    failures
        The chunks that failed.
    bytes
        The size of its files.
    started
        When the store was made.
    updated
        When its last chunk was written; None if there is none yet.
    running
        Whether a run on this machine is writing to it now; None if the file system has no locks.
    damaged
        The files that differ from what was written, if this was checked.
    remembered
        What the memo of a search in this store has: the number of chunks of each kind.

    Examples
    --------
    >>> import dataclasses
    >>> "done" in [field.name for field in dataclasses.fields(saltus.sweep.StoreStatus)]
    True
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
    damaged: tuple[str, ...] = ()
    remembered: Mapping[str, int] = field(default_factory=dict)

    @property
    def failed(self) -> int:
        """The number of chunks that failed."""
        return len(self.failures)

    @property
    def estimated(self) -> bool:
        """Whether `bytes` is an estimate, because the system was not asked for the size of every
        file.
        """
        return self.total > files.ASKED_ONE_BY_ONE

    @property
    def complete(self) -> bool:
        """Whether every chunk is there."""
        return self.done == self.total


@answered
def status(path: Path | str, *, verify: bool = False) -> StoreStatus:
    """The state of the sweep whose store is at `path`; with `verify` all of it is read, and damaged
    files are found.

    Parameters
    ----------
    path
        The folder.
    verify
        Whether every file is read and compared with its checksum.

    Raises
    ------
    ParameterError
        There is no store of a sweep at `path`, or its metadata are damaged.

    Examples
    --------
    >>> saltus.sweep.status("nowhere.zarr")
    Traceback (most recent call last):
        ...
    saltus.errors.ParameterError: there is no store at nowhere.zarr
    """
    path = Path(path)
    plan = read_plan(path)
    chunks = grid_of(plan)
    variables = {name: len(variable["extra"]) for name, variable in plan["variables"].items()}
    damaged = list(files.damaged_files(path)) if verify else []
    broken = _broken_chunks(path, chunks, variables) if verify and not damaged else {}
    found = [files.chunks_of(path, name, chunks.grid, extra) for name, extra in variables.items()]
    done = np.logical_and.reduce([each.there for each in found])
    for index in broken.values():
        done[index] = False
    updated = max(each.updated for each in found)
    remembered, unreadable = memo_status(path, verify)
    return StoreStatus(
        path=path,
        kind=str(plan["attrs"].get("kind") or plan["attrs"].get("title") or "sweep"),
        function=plan["function"],
        sizes=dict(chunks.sizes),
        done=int(done.sum()),
        total=chunks.total,
        failures=tuple(failure for failure in _failures(path) if _is_missing(done, failure.index)),
        bytes=round(sum(each.bytes for each in (*found, files.other_files(path, variables)))),
        started=_moment(os.path.getmtime(path / files.METADATA)),
        updated=_moment(updated) if updated else None,
        running=files.in_use(path),
        damaged=(*(damaged or broken), *unreadable),
        remembered=remembered,
    )


def _is_missing(done: np.ndarray, index: Index) -> bool:
    """Whether a chunk with this index exists and is not done; the index is from a list of failures,
    which may be damaged.
    """
    return (
        len(index) == done.ndim
        and all(0 <= i < n for i, n in zip(index, done.shape, strict=True))
        and not done[index]
    )


def damage(found: StoreStatus) -> str:
    """The damage of a store, as the beginning of a sentence."""
    count = len(found.damaged)
    named = ", ".join(found.damaged[:NAMED]) + (
        f" and {count - NAMED} more" if count > NAMED else ""
    )
    return f"{found.path} has {count} damaged or missing file{'s' * (count > 1)} ({named})"


def _broken_chunks(path: Path, chunks: ChunkGrid, extra: dict[str, int]) -> dict[str, Index]:
    """The files of chunks that cannot be read, each with its chunk."""
    import zarr

    try:
        arrays: Any = zarr.open_group(str(path), mode="r", zarr_format=3)
        broken = list(damaged_chunks(path, arrays, chunks, extra))
    except (AttributeError, KeyError, NotImplementedError, TypeError, ValueError) as error:
        raise ParameterError(
            f"{path} cannot be read as a Zarr store ({type(error).__name__}: {error!s:.80})", "path"
        ) from None
    return {files.chunk_name(name, index, extra[name]): index for name, index in broken}


def read_plan(path: Path) -> dict[str, Any]:
    """The plan that the store at `path` was made for, as JSON.

    Raises
    ------
    ParameterError
        At `path` there is nothing, no store, or the store of something else than a sweep; or its
        metadata are damaged, or are not those of its plan.
    """
    if not os.path.exists(path):  # also False for a name that is too long
        raise ParameterError(f"there is no store at {path}", "path")
    if not path.is_dir():
        raise ParameterError(f"{path} is a file; the store of a sweep is a folder", "path")
    metadata = path / files.METADATA
    if not metadata.is_file():
        raise ParameterError(f"{path} is not a store: it has no {files.METADATA}", "path")
    damaged = [
        name for name in (files.METADATA, files.CHECKSUMS) if name in files.damaged_files(path)
    ]
    try:
        group = parsed_json(metadata.read_bytes())
    except (OSError, RecursionError, ValueError) as error:
        raise ParameterError(f"{metadata} cannot be read ({error!s:.80})", "path") from error
    try:
        plan = parsed_json(group["attributes"]["plan"])
        plan = {
            key: plan[key]
            for key in ("function", "arguments", "order", "axes", "chunk", "variables", "attrs")
        }
        grid_of(plan)
    except (RecursionError, KeyError, TypeError, ValueError, AttributeError):
        raise ParameterError(
            f"{path} is a Zarr store, but not of a sweep: it keeps no plan", "path"
        ) from None
    if damaged:
        raise ParameterError(
            f"{path / damaged[0]} is damaged; run the sweep again, or remove the store and begin "
            "anew",
            "path",
        )
    _check_codecs(path, group)
    return plan


def _check_codecs(path: Path, group: dict[str, Any]) -> None:
    """Refuse arrays that are not read by the codecs of saltus alone: Zarr's older format may hold
    pickles, which run code.
    """
    arrays = group.get("consolidated_metadata", {}).get("metadata", {}).values()
    known = all(
        array.get("zarr_format") == 3 and {codec["name"] for codec in array["codecs"]} <= CODECS
        for array in arrays
    )
    if group.get("zarr_format") != 3 or not known:
        raise ParameterError(
            f"{path} is not a store of saltus: it has codecs of other programs", "path"
        )


def grid_of(plan: dict[str, Any]) -> ChunkGrid:
    """The division into chunks of the grid of a plan that was read from a file.

    Raises
    ------
    KeyError
        No plan can have such a grid.
    TypeError
        No plan can have such a grid.
    ValueError
        No plan can have such a grid.
    AttributeError
        No plan can have such a grid.
    """
    sizes = {str(name): plan["axes"][name]["size"] for name in plan["order"]}
    return ChunkGrid(sizes, {name: plan["chunk"][name] for name in sizes})


def damaged_chunks(
    path: Path, arrays: Any, chunks: ChunkGrid, extra: dict[str, int]
) -> Iterator[tuple[str, Index]]:
    """The (variable, chunk) of every chunk in the store at `path` that is there and cannot be read.

    Parameters
    ----------
    path
        The path of the store.
    arrays
        Zarr's array of each variable.
    chunks
        The division of the grid into chunks.
    extra
        The number of dimensions of each variable beside the grid's axes.
    """
    for name, count in extra.items():
        array = arrays[name]
        found = files.chunks_of(path, name, chunks.grid, count).there
        for i, row in enumerate(found):
            there: list[Index] = [(i, *map(int, index)) for index in np.argwhere(row)]
            if not there:
                continue
            rows = chunks.slices(there[0])[0]
            if (
                row.all()
                and _row_size(array, rows) < LIMITS.any_machine
                and _can_be_read(array, (rows,))
            ):
                continue
            yield from (
                (name, index) for index in there if not _can_be_read(array, chunks.slices(index))
            )


def _row_size(array: Any, rows: slice) -> float:
    """The size of some rows in bytes, according to the array's metadata."""
    return float(
        float(rows.stop - rows.start)
        * math.prod(map(float, array.shape[1:]))
        * array.dtype.itemsize
    )


def _can_be_read(array: Any, cut: tuple[slice, ...]) -> bool:
    try:
        array[cut]
    except Exception:  # errors may come from Zarr, from its codecs or from the system
        return False
    return True


def _failures(path: Path) -> tuple[Failure, ...]:
    if not (path / files.FAILURES).is_file():  # a pipe may have no end
        return ()
    try:
        entries = parsed_json((path / files.FAILURES).read_text(encoding="utf-8"))
        failures = [
            Failure(
                tuple(map(int, e["index"])), str(e["place"]), str(e["error"]), int(e["attempts"])
            )
            for e in entries
        ]
    except (
        OSError,
        RecursionError,
        KeyError,
        TypeError,
        ValueError,
    ):  # a damaged list loses no result
        return ()
    return tuple(sorted(failures, key=lambda failure: failure.index))  # workers fail in any order


def _moment(seconds: float) -> datetime.datetime:
    return datetime.datetime.fromtimestamp(seconds).astimezone()
