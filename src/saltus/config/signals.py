"""The [load] table: a base frequency, and for each channel a number, a harmonic, a record, a pulse, or a list of them."""

from __future__ import annotations

import math
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from saltus.checks import LIMITS, free_memory
from saltus.config.readers import read, read_number, read_table, read_text, readers_of, show
from saltus.config.source import Keys, Source
from saltus.errors import ParameterError
from saltus.systems import Record, signal_class

RECORD_MEMORY = 20  # bytes that a character of a record takes, about, while it is read: as text, in lines, in pairs of numbers


def read_load(source: Source, data: Any) -> dict[str, Any]:
    """The load of a study as `System.from_dict` takes it, its records read from their files."""
    if not isinstance(data, Mapping):
        source.refuse(("load",), f"load must be a table of keys and values, got {show(data)}")
    for name in data:
        if not name.isidentifier() or name.startswith("__"):
            source.refuse(("load", name), f"load has no channel {show(name)[len('the text ') :]}")
    return {name: _signal(source, ("load", name), value) for name, value in data.items()}


def _signal(source: Source, keys: Keys, data: Any) -> Any:
    """The signal of one channel."""
    if isinstance(data, list) and keys != ("load", "frequency"):
        return [_signal(source, (*keys, str(i)), item) for i, item in enumerate(data)]
    if not isinstance(data, Mapping) or keys == ("load", "frequency"):
        return read(source, keys, data, read_number)
    if "file" in data:
        return _record(source, keys, data)
    try:
        cls = signal_class(data, ".".join(keys))
    except ParameterError as error:
        source.refuse((*keys, "type"), str(error))
    return read_table(source, keys, data, readers_of(cls) | ({"type": read_text} if "type" in data else {}))


def _record(source: Source, keys: Keys, data: Mapping[str, Any]) -> dict[str, Any]:
    """A record whose samples are in a file."""
    for name in ("time", "value", "source"):
        if name in data:
            source.refuse((*keys, name), f"{'.'.join(keys)} has both file and {name}; keep one of them")
    values = read_table(source, keys, data, {**readers_of(Record), "file": read_text})
    name = values.pop("file")
    time, value = read_samples(source, (*keys, "file"), name)
    return {**values, "time": time, "value": value, "source": name}


def read_samples(source: Source, keys: Keys, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times and values from the first two columns of the text file `name`, relative to the study.

    Columns are parted by commas, semicolons, tabs or spaces; one line of headings, blank lines and lines that begin with # are
    skipped. Returns two arrays of shape (samples,).

    Raises
    ------
    ParameterError
        No such file, a line that is not two finite numbers, times that do not increase (with the line).
    """
    where = f"{'.'.join(keys)} {name!r}"
    path = source.path.parent / Path(name)
    try:
        found, problem = path.stat(), ""
        if not stat.S_ISREG(found.st_mode):  # reading a device or a pipe may never end
            problem = "is no file"
        elif RECORD_MEMORY * found.st_size > LIMITS.memory * free_memory():
            problem = f"has {found.st_size} bytes, more than fits into the free memory"
        text = "" if problem else path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        problem = "does not exist; paths are relative to the study file"
    except UnicodeDecodeError:
        problem = "is not a text file; a record has two columns, time and value"
    except (OSError, ValueError) as error:
        problem = f"cannot be read ({getattr(error, 'strerror', None) or error!s:.120})"
    if problem:
        source.refuse(keys, f"{where} {problem}")
    rows: list[tuple[float, float]] = []
    headed = False
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        row = _row(line)
        if row is None:
            if rows or headed:
                source.refuse(keys, f"{where}: line {number} must be two finite numbers, got {show(line.strip())}")
            headed = True
            continue
        if rows and row[0] <= rows[-1][0]:
            source.refuse(
                keys, f"{where}: times must increase, but line {number} has {row[0]:g} after {rows[-1][0]:g}; sort the file"
            )
        rows.append(row)
    time, value = np.array(rows, dtype=float).reshape(-1, 2).T
    return time, value


def _row(line: str) -> tuple[float, float] | None:
    """The first two numbers of a line, or None. With commas there must be exactly two cells, as commas may be decimal ones."""
    separator = next((s for s in ";,\t" if s in line), None)
    cells = [cell.strip().strip('"') for cell in line.split(separator)]
    try:
        time, value = (float(cell) for cell in (cells if separator == "," else cells[:2]))
    except ValueError:
        return None
    written = "".join(cells[:2])
    plain = written.isascii() and "_" not in written  # Python would read 1_0 as ten, and digits of other scripts
    return (time, value) if plain and math.isfinite(time) and math.isfinite(value) else None
