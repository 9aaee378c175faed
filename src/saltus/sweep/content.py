"""What a function computes with, as digests by name: its code, the values that it closes over, its
defaults, the globals that it names, and what these depend on.

Functions and classes of installed packages are known by their names. Of a value that cannot be
digested, such as an open file, nobody can say whether it has changed.
"""

from __future__ import annotations

import dataclasses
import dis
import functools
import hashlib
import sys
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np

from saltus.errors import ParameterError, shown

ATOMS = (type(None), bool, int, float, complex, str, bytes, bytearray, range, type(...))
# of a class: what Python adds, and what says nothing about what its methods do
UNREAD = {
    *("__dict__", "__weakref__", "__doc__", "__module__", "__qualname__", "__annotations__"),
    *("__firstlineno__", "__static_attributes__", "_abc_impl", "__hash__", "__slotnames__"),
    *("__annotate__", "__annotate_func__", "__annotations_cache__", "__match_args__"),
}


def contents_of(function: Callable[..., Any]) -> dict[str, str]:
    """The digests of what a function computes with, by the names that a sentence gives them.

    Raises
    ------
    ParameterError
        Something of it cannot be digested; the error names it.
    """
    digests = Digests()
    return {name: digests.of(value, name).hex() for name, value in _parts(function)}


def _parts(function: Any, before: str = "") -> Iterator[tuple[str, Any]]:
    """What a function computes with, by name."""
    if isinstance(function, functools.partial):
        for number, value in enumerate(function.args):
            yield f"{before}argument {number}", value
        for name, value in function.keywords.items():
            yield f"{before}argument {name}", value
        yield from _parts(function.func, before)
    elif isinstance(function, types.MethodType):
        yield f"{before}object", function.__self__
        yield from _parts(function.__func__, before)
    elif isinstance(function, types.FunctionType) and not is_installed(function.__module__):
        yield f"{before}text", function.__code__
        for name, value in _read_by(function).items():
            yield f"{before}{name}", value
    else:
        yield f"{before}text", function


def _read_by(function: types.FunctionType) -> dict[str, Any]:
    """The values that a function reads from outside, by name."""
    found: dict[str, Any] = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            found[f"value {name}"] = cell.cell_contents
        except ValueError:  # it is given a value later
            found[f"value {name}"] = Empty
    for number, value in enumerate(function.__defaults__ or ()):
        found[f"default {number}"] = value
    for name, value in (function.__kwdefaults__ or {}).items():
        found[f"default {name}"] = value
    space = function.__globals__
    named, attributes = _names_in(function.__code__)
    for name in sorted(named & space.keys()):
        value = space[name]
        found[f"global {name}"] = value
        if isinstance(value, types.ModuleType):
            found |= dict(_of_module(value, attributes, f"global {name}"))
    return found


def _of_module(
    module: types.ModuleType, attributes: Iterable[str], before: str
) -> Iterator[tuple[str, Any]]:
    """What a function reads of a module of the user's own, by name."""
    if is_installed(module.__name__):
        return
    for name in sorted(set(attributes) & vars(module).keys()):
        value = vars(module)[name]
        yield f"{before}.{name}", value
        if isinstance(value, types.ModuleType) and value is not module:
            yield from _of_module(value, set(attributes) - {name}, f"{before}.{name}")


def _names_in(code: types.CodeType) -> tuple[set[str], set[str]]:
    """The globals that code names, and the attributes, with those of the functions inside of it."""
    named: set[str] = set()
    attributes: set[str] = set()
    for step in dis.get_instructions(code):
        if step.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
            named.add(str(step.argval))
        elif step.opname in ("LOAD_ATTR", "LOAD_METHOD", "IMPORT_FROM"):
            attributes.add(str(step.argval))
    for inner in code.co_consts:
        if isinstance(inner, types.CodeType):
            more = _names_in(inner)
            named |= more[0]
            attributes |= more[1]
    return named, attributes


@functools.cache
def is_installed(module: str | None) -> bool:
    """Whether a module belongs to Python or to an installed package, or is of saltus."""
    root = (module or "__main__").partition(".")[0]
    if root in sys.stdlib_module_names or root == "saltus":
        return root != "__main__"
    file = getattr(sys.modules.get(root), "__file__", None)
    return (
        file is not None and {"site-packages", "dist-packages"} & {*PurePath(file).parts} != set()
    )


class Empty:
    """The value of a name that has none yet."""


class Digests:
    """Digests of values; a value that holds itself is known by its depth."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[Any, bytes]] = {}  # with the value, so that its id is kept
        self._open: dict[int, int] = {}

    def of(self, value: Any, name: str) -> bytes:
        """The digest of a value that a sentence calls `name`.

        Raises
        ------
        ParameterError
            It cannot be digested.
        """
        if type(value) in ATOMS:
            return _digest(type(value).__name__.encode(), repr(value).encode())
        if id(value) in self._known:
            return self._known[id(value)][1]
        if id(value) in self._open:
            return _digest(b"itself", str(len(self._open) - self._open[id(value)]).encode())
        self._open[id(value)] = len(self._open)
        try:
            found = _digest(*self._pieces(value, name))
        except RecursionError:
            raise _refusal(value, name) from None
        finally:
            del self._open[id(value)]
        self._known[id(value)] = (value, found)
        return found

    def _pieces(self, value: Any, name: str) -> Iterator[bytes]:
        """The bytes of which the digest of a value is made."""

        def of(part: Any) -> bytes:
            return self.of(part, name)

        kind = type(value)
        yield f"{kind.__module__}.{kind.__qualname__}".encode()
        if kind in (tuple, list):
            yield from map(of, value)
        elif kind in (set, frozenset):
            yield from sorted(map(of, value))
        elif kind is dict or isinstance(value, types.MappingProxyType):
            yield from sorted(of(key) + of(entry) for key, entry in value.items())
        elif isinstance(value, np.ndarray) and value.dtype != object:
            yield from (value.dtype.str.encode(), str(value.shape).encode(), value.tobytes())
            if isinstance(value, np.ma.MaskedArray):
                yield of(np.ma.getmaskarray(value))
        elif isinstance(value, np.ndarray):
            yield from (of(value.shape), of(value.ravel().tolist()))
        elif isinstance(value, np.generic):
            yield from (value.dtype.str.encode(), value.tobytes())
        elif isinstance(value, (np.ufunc, np.dtype, PurePath)):
            yield str(value).encode()
        elif isinstance(value, Enum):
            yield from (of(kind), value.name.encode())
        elif isinstance(value, types.CodeType):
            yield from self._code(value, name)
        elif isinstance(value, types.ModuleType):
            yield value.__name__.encode()
        elif isinstance(value, types.BuiltinMethodType) and not isinstance(
            value.__self__, (types.ModuleType, type(None))
        ):
            yield from (value.__name__.encode(), of(value.__self__))
        elif isinstance(value, (functools.partial, types.MethodType, types.FunctionType)):
            yield from self._function(value)
        elif hasattr(value, "__wrapped__") and callable(value):  # of functools.cache
            yield of(value.__wrapped__)
        elif isinstance(value, type):
            yield from self._class(value, name)
        elif isinstance(value, (property, classmethod, staticmethod, functools.cached_property)):
            names = ("fget", "fset", "fdel", "func", "__func__")
            yield from (of(getattr(value, each, None)) for each in names)
        else:
            yield from self._object(value, name)

    def _code(self, code: types.CodeType, name: str) -> Iterator[bytes]:
        yield code.co_code
        yield getattr(code, "co_exceptiontable", b"")
        counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        yield repr(counts).encode()
        names = (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars)
        yield repr(names).encode()
        yield from (self.of(constant, name) for constant in code.co_consts)

    def _function(self, function: Any) -> Iterator[bytes]:
        """The pieces of a function, of a partial call or of a bound method."""
        for part, value in _parts(function):
            yield part.encode()
            if value is function:  # of an installed package
                yield f"{function.__module__}.{function.__qualname__}".encode()
            else:
                yield self.of(value, part)

    def _class(self, kind: type, name: str) -> Iterator[bytes]:
        """The pieces of a class: its name if it is installed, else all that it has, too."""
        yield f"{kind.__module__}.{kind.__qualname__}".encode()
        if is_installed(kind.__module__):
            return
        yield from (self.of(base, name) for base in kind.__bases__)
        for own, value in sorted(vars(kind).items()):
            slot = isinstance(value, (types.MemberDescriptorType, types.GetSetDescriptorType))
            if own not in UNREAD and not slot:
                yield own.encode()
                yield self.of(value, name)

    def _object(self, value: Any, name: str) -> Iterator[bytes]:
        """The pieces of any other object: of saltus's own its table, else what pickle would
        keep.
        """
        kind = type(value)
        yield self.of(kind, name)
        own = kind.__module__.startswith("saltus.")
        if own and hasattr(value, "to_json") and hasattr(value, "model"):
            yield self.of(type(value.model), name)
            yield from (self.of(getattr(value, part), name) for part in ("model", "load", "impact"))
            return
        if own and hasattr(value, "to_table"):  # its other numbers follow from these
            yield self.of(value.to_table(), name)
            return
        if own and dataclasses.is_dataclass(value):
            for field in dataclasses.fields(value):
                yield field.name.encode()
                yield self.of(getattr(value, field.name), name)
            return
        try:
            reduced = value.__reduce_ex__(4)
        except Exception:
            raise _refusal(value, name) from None
        if isinstance(reduced, str):
            yield reduced.encode()
            return
        make, given, *more = reduced
        yield from (self.of(make, name), self.of(given, name))
        for part in more:
            plain = list(part) if isinstance(part, Iterator) else part
            yield self.of(dict(plain) if isinstance(plain, Mapping) else plain, name)


def _refusal(value: Any, name: str) -> ParameterError:
    return ParameterError(
        f"the function cannot be kept apart from others in a store, as its {name} holds "
        f"{shown(value, 40)}, which cannot be digested: pass that in another way, or leave store "
        "out",
        "function",
    )


def _digest(*pieces: bytes) -> bytes:
    found = hashlib.sha256()
    for piece in pieces:
        found.update(len(piece).to_bytes(8, "little"))
        found.update(piece)
    return found.digest()
