"""The parts of a system in a study: the classes that `type` names, of saltus or the user's own, and
the signals of loads.
"""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import sys
import traceback
from collections.abc import Mapping
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from saltus.config.readers import (
    READERS,
    Keys,
    Source,
    read,
    read_number,
    read_table,
    read_text,
    readers_of,
    show,
)
from saltus.errors import ParameterError, near
from saltus.systems import IMPACTS, MODELS, ImpactLaw, Model, Record, register, signal_class

EXAMPLES = {"model": "Metainterface", "impact": "VelocityReduction"}


def read_part(source: Source, kind: str, data: Any) -> dict[str, Any]:
    """The model or the impact law (`kind`) of a study as `System.from_dict` takes it: `type` and
    the fields of that class.
    """
    if not isinstance(data, dict):
        source.refuse((kind,), f"{kind} must be a table of keys and values, got {show(data)}")
    if "type" not in data:
        source.refuse(
            (kind,),
            f'{kind}.type is missing; it names the {kind}, such as type = "{EXAMPLES[kind]}"',
        )
    cls = find_class(source, kind, read(source, (kind, "type"), data["type"], read_text))
    values = {key: value for key, value in data.items() if key != "type"}
    if isinstance(values.get("file"), str):  # of the matrices of a structure
        values["file"] = str(source.path.parent / values["file"])
    return {"type": cls.__name__, **read_table(source, (kind,), values, readers_of(cls))}


def find_class(source: Source, kind: str, name: str) -> type:
    """The class that `model.type` or `impact.type` names: `Metainterface`, `my_model.py:Duffing` or
    `module:Class`.
    """
    keys = (kind, "type")
    known = MODELS if kind == "model" else IMPACTS
    if ":" not in name:
        if name in known:
            found: type = known[name]
            return found
        source.refuse(
            keys,
            f'{kind}.type "{name}" is not known; {near(name, known)} (one of your own is '
            '"file.py:Class")',
        )
    place, _, attribute = name.rpartition(":")
    if not place.endswith(".py") and not all(part.isidentifier() for part in place.split(".")):
        source.refuse(
            keys,
            f"{kind}.type: {show(place)} is no Python file, such as my_model.py, and no module, "
            "such as my.module",
        )
    module = (
        _from_file(source, kind, place)
        if place.endswith(".py")
        else _installed(source, kind, place)
    )
    cls: Any = getattr(module, attribute, None)
    wanted: Any = Model if kind == "model" else ImpactLaw
    if cls is None:
        classes = [
            n
            for n, c in vars(module).items()
            if isinstance(c, type) and issubclass(c, wanted) and c is not wanted
        ]
        source.refuse(
            keys, f'{kind}.type: {place} has no class "{attribute}"; {near(attribute, classes)}'
        )
    if not (isinstance(cls, type) and issubclass(cls, wanted) and dataclasses.is_dataclass(cls)):
        source.refuse(
            keys,
            f"{kind}.type: {attribute} in {place} must be a dataclass that inherits "
            f"saltus.systems.{wanted.__name__}",
        )
    builtin = known.get(cls.__name__)
    if builtin is not None and builtin is not cls and builtin.__module__.startswith("saltus."):
        source.refuse(
            keys,
            f"{kind}.type: {place} calls its class {cls.__name__}, which saltus has already; "
            "give it another name",
        )
    owned: Any = cls  # narrowed above to a dataclass, which is not what `register` asks for
    register(owned)
    return cls


class _FromText(SourceFileLoader):
    """Compiles a file from its text each time.

    Python's own bytecode cache takes a file of the same length for unchanged within a second, so
    an edit from 1.0 to 1.7 could go unseen.
    """

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


def _from_file(source: Source, kind: str, place: str) -> ModuleType:
    """The module in a Python file, relative to the study; run anew each time."""
    path = (source.path.parent / Path(place)).resolve()
    if not path.is_file():
        source.refuse(
            (kind, "type"),
            f"{kind}.type: there is no file {place}; paths are relative to the study file",
        )
    name = f"saltus_study_{path.stem}"
    loader = _FromText(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None:
        raise ParameterError(f"{path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses and pickle look it up there
    try:
        loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # the user's own code may raise anything, and may end in an exit
        source.refuse(
            (kind, "type"),
            f"{kind}.type: {place} cannot be imported{_where(error, str(path))}: {_what(error)}",
        )
    return module


def _installed(source: Source, kind: str, place: str) -> ModuleType:
    try:
        return importlib.import_module(place)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # the user's own code may raise anything, and may end in an exit
        source.refuse(
            (kind, "type"), f"{kind}.type: module {place!r} cannot be imported: {_what(error)}"
        )


def _what(error: BaseException) -> str:
    message = error.msg if isinstance(error, SyntaxError) else str(error)
    return f"{type(error).__name__}: {' '.join(message.split())}"


def _where(error: BaseException, path: str) -> str:
    """The line of the user's file at which importing failed."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return f" (its line {error.lineno})"
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == path
    ]
    return f" (its line {lines[-1]})" if lines else ""


# of a file, besides the fields of a Record
RECORD_KEYS = {"units": str, "baseline": int, "component": int, "time_scale": float}


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
    return read_table(
        source, keys, data, readers_of(cls) | ({"type": read_text} if "type" in data else {})
    )


def _record(source: Source, keys: Keys, data: Mapping[str, Any]) -> dict[str, Any]:
    """A record whose samples are in a file."""
    for name in ("time", "value", "source"):
        if name in data:
            source.refuse(
                (*keys, name), f"{'.'.join(keys)} has both file and {name}; keep one of them"
            )
    readers = {name: READERS[kind] for name, kind in RECORD_KEYS.items()}
    values = read_table(source, keys, data, {**readers_of(Record), **readers, "file": read_text})
    name = values.pop("file")
    scale = values.pop("scale", 1.0)
    try:
        record = Record.read(source.path.parent / name, source=name, **values)
    except ParameterError as error:
        beside = (
            "; paths are relative to the study file"
            if str(error).endswith("does not exist")
            else ""
        )
        joined = "." if error.parameter and str(error).startswith(error.parameter) else ": "
        source.refuse(
            (*keys, error.parameter or "file"), f"{'.'.join(keys)}{joined}{error}{beside}"
        )
    return {
        "time": record.time,
        "value": record.value,
        "quantity": record.quantity,
        "scale": scale,
        "source": name,
        **({"interpolation": record.interpolation} if record.interpolation else {}),
    }
