"""The check that the files of a store are as they were written: metadata by their digests, chunks by their own checksums."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from saltus.checks import LIMITS, free_memory
from saltus.sweep import store_files as files
from saltus.sweep.chunk_grid import ChunkGrid, Index

BYTES_AT_ONCE = 256e6  # bytes of chunks that are read together, which is faster than reading them one by one


def damaged_chunks(path: Path, arrays: Any, chunks: ChunkGrid, extra: dict[str, int]) -> Iterator[tuple[str, Index]]:
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
        array, found = arrays[name], files.chunks_of(path, name, chunks.grid, count).there
        for i, row in enumerate(found):
            there: list[Index] = [(i, *map(int, index)) for index in np.argwhere(row)]
            if not there:
                continue
            rows = chunks.slices(there[0])[0]
            if row.all() and _row_size(array, rows) < BYTES_AT_ONCE and _can_be_read(array, (rows,)):
                continue
            yield from ((name, index) for index in there if not _can_be_read(array, chunks.slices(index)))


def _row_size(array: Any, rows: slice) -> float:
    """The size of some rows in bytes, according to the array's metadata."""
    return float(float(rows.stop - rows.start) * math.prod(map(float, array.shape[1:])) * array.dtype.itemsize)


def _can_be_read(array: Any, cut: tuple[slice, ...]) -> bool:
    if math.prod(map(float, array.chunks)) * array.dtype.itemsize > LIMITS.memory * free_memory():
        return False  # a size that a damaged file gives must not be allocated
    try:
        array[cut]
    except Exception:  # errors may come from Zarr, from its codecs or from the system
        return False
    return True
