"""The files of a memo: JSON and the bytes of arrays, with a checksum; reading them makes numbers and texts, and runs nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.files import checked_content

FOLDER, SUFFIX = "parts", ".memo"  # of a store: where its memo is, and how the files of it end


def files_of(store: Path) -> list[Path]:
    """The files of a memo in a store."""
    return sorted((store / FOLDER).glob(f"*{SUFFIX}"))


def memo_status(store: Path, verify: bool = False) -> tuple[dict[str, int], list[str]]:
    """How many chunks of each kind the memo in a store has; with `verify` all are read, and those that are damaged are named."""
    counts, damaged = dict[str, int](), []
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
    """A value of what JSON has and of arrays as bytes: a line of JSON, then the bytes of the arrays in their order."""
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
        array = np.frombuffer(rest, dtype, count, at).reshape(shape) if count else np.zeros(shape, dtype)
        at += count * dtype.itemsize
        return array.copy()

    try:
        return full(json.loads(line))
    except (AttributeError, KeyError, OverflowError, RecursionError, TypeError) as error:
        raise ValueError(f"this is no file of results ({type(error).__name__})") from error


def _fields(descr: Any) -> Any:
    """The description of a type of arrays, in which JSON has made lists of tuples."""
    if isinstance(descr, str):
        return descr
    return [(name, _fields(inner), *(tuple(shape) for shape in more)) for name, inner, *more in descr]
