"""The parts of a system in a study: the classes that `type` names, of saltus or the user's own, and the signals of loads."""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import math
import stat
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from saltus.checks import LIMITS, free_memory
from saltus.config.readers import Keys, Source, read, read_number, read_table, read_text, readers_of, show
from saltus.errors import ParameterError, near
from saltus.systems import IMPACTS, MODELS, ImpactLaw, Model, Record, register, signal_class

EXAMPLES = {"model": "Metainterface", "impact": "VelocityReduction"}


def read_part(source: Source, kind: str, data: Any) -> dict[str, Any]:
    """The model or the impact law (`kind`) of a study as `System.from_dict` takes it: `type` and the fields of that class."""
    if not isinstance(data, dict):
        source.refuse((kind,), f"{kind} must be a table of keys and values, got {show(data)}")
    if "type" not in data:
        source.refuse((kind,), f'{kind}.type is missing; it names the {kind}, such as type = "{EXAMPLES[kind]}"')
    cls = find_class(source, kind, read(source, (kind, "type"), data["type"], read_text))
    values = {key: value for key, value in data.items() if key != "type"}
    return {"type": cls.__name__, **read_table(source, (kind,), values, readers_of(cls))}


def find_class(source: Source, kind: str, name: str) -> type:
    """The class that `model.type` or `impact.type` names: `Metainterface`, `my_model.py:Duffing` or `module:Class`."""
    keys, known = (kind, "type"), MODELS if kind == "model" else IMPACTS
    if ":" not in name:
        if name in known:
            return known[name]
        source.refuse(keys, f'{kind}.type "{name}" is not known; {near(name, known)} (one of your own is "file.py:Class")')
    place, _, attribute = name.rpartition(":")
    if not place.endswith(".py") and not all(part.isidentifier() for part in place.split(".")):
        source.refuse(
            keys, f"{kind}.type: {show(place)} is no Python file, such as my_model.py, and no module, such as my.module"
        )
    module = _from_file(source, kind, place) if place.endswith(".py") else _installed(source, kind, place)
    cls: Any = getattr(module, attribute, None)
    wanted: Any = Model if kind == "model" else ImpactLaw
    if cls is None:
        classes = [n for n, c in vars(module).items() if isinstance(c, type) and issubclass(c, wanted) and c is not wanted]
        source.refuse(keys, f'{kind}.type: {place} has no class "{attribute}"; {near(attribute, classes)}')
    if not (isinstance(cls, type) and issubclass(cls, wanted) and dataclasses.is_dataclass(cls)):
        source.refuse(
            keys, f"{kind}.type: {attribute} in {place} must be a dataclass that inherits saltus.systems.{wanted.__name__}"
        )
    builtin = known.get(cls.__name__)
    if builtin is not None and builtin is not cls and builtin.__module__.startswith("saltus."):
        source.refuse(
            keys, f"{kind}.type: {place} calls its class {cls.__name__}, which saltus has already; give it another name"
        )
    owned: Any = cls  # narrowed above to a dataclass, which is not what `register` asks for
    register(owned)
    return cls


def _from_file(source: Source, kind: str, place: str) -> ModuleType:
    """The module in a Python file, relative to the study; run anew each time."""
    path = (source.path.parent / Path(place)).resolve()
    if not path.is_file():
        source.refuse((kind, "type"), f"{kind}.type: there is no file {place}; paths are relative to the study file")
    spec = importlib.util.spec_from_file_location(f"saltus_study_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ParameterError(f"{path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses and pickle look it up there
    try:
        spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # the user's own code may raise anything, and may end in an exit
        source.refuse((kind, "type"), f"{kind}.type: {place} cannot be imported{_where(error, str(path))}: {_what(error)}")
    return module


def _installed(source: Source, kind: str, place: str) -> ModuleType:
    try:
        return importlib.import_module(place)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # the user's own code may raise anything, and may end in an exit
        source.refuse((kind, "type"), f"{kind}.type: module {place!r} cannot be imported: {_what(error)}")


def _what(error: BaseException) -> str:
    message = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {' '.join(message.split())}"


def _where(error: BaseException, path: str) -> str:
    """The line of the user's file at which importing failed."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return f" (its line {error.lineno})"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    return f" (its line {lines[-1]})" if lines else ""


COLUMNS = "a record has two columns, time and value, and other formats must be written so"
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
                source.refuse(keys, f"{where}: line {number} must be two finite numbers, got {show(line.strip())}; {COLUMNS}")
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
