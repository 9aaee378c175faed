"""The scalar kernels in plain Python, from the text that is compiled: slow, and open to a debugger.

Files and lines are those of the kernels' sources. So a debugger stops in them and shows them.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba import types

from saltus.flow.programs.compiled import (
    CONTACTS_PARTS,
    KERNEL_HEADER,
    ONE_CONTACT_PARTS,
)
from saltus.taylor import MARKER, compiled_part, members_of, result_count, source_of

# An entry of the kernel returns to Python after so many passes of its loop.
PASSES = 1


class Words:
    """A named tuple by its fields and those of the tuples and records in it, as `Reference` is in
    compiled code.
    """

    __slots__ = ("_owners", "_tuple")

    def __init__(self, given: Any) -> None:
        object.__setattr__(self, "_tuple", given)
        object.__setattr__(self, "_owners", dict(_owners(given)))

    def __getattr__(self, name: str) -> Any:
        try:
            owner = self._owners[name]
        except KeyError:
            raise AttributeError(name) from None
        if isinstance(owner, np.void):
            number = owner[name]
            return int(number) if isinstance(number, np.integer) else number
        value = getattr(owner, name)
        return Words(value) if hasattr(value, "_fields") else value

    def __setattr__(self, name: str, value: Any) -> None:
        self._owners[name][name] = value

    def __getitem__(self, index: int) -> Any:
        return self._tuple[index]

    def __len__(self) -> int:
        return len(self._tuple)

    def __dir__(self) -> list[str]:
        return sorted(self._owners)


def _owners(given: Any) -> Iterator[tuple[str, Any]]:
    """Each field of a named tuple, and of the tuples and records in it, with what has it."""
    for name, value in zip(given._fields, given, strict=True):
        if isinstance(value, np.void):
            yield from ((field, value) for field in value.dtype.names or ())
        elif hasattr(value, "_fields"):
            yield from _owners(value)
        yield name, given


class PlainKernel:
    """The functions of a kernel, in plain Python.

    Attributes
    ----------
    functions
        All of its functions and constants, by their names.
    motion
        The memory of the motion that was last advanced, in words; None before.
    """

    def __init__(self, several: bool) -> None:
        self.motion: Words | None = None
        self.functions: dict[str, Any] = {}
        exec(KERNEL_HEADER, self.functions)
        self.functions |= {
            "jit": _as_it_is,
            "lean_jit": _as_it_is,
            "inline_jit": _as_it_is,
            "cached_jit": lambda signature, **options: _as_it_is,
            "by_reference": self._words,
            "math": MATH,
        }
        for module in CONTACTS_PARTS if several else ONE_CONTACT_PARTS:
            above = source_of(module).split(MARKER, 1)[0].count("\n")
            text = "\n" * above + compiled_part(module)
            exec(compile(text, str(module.__file__), "exec"), self.functions)
        self.functions["BATCH"] = PASSES

    def _words(self, given: Any) -> Words:
        words = Words(given)
        if "mode" in words._owners:
            self.motion = words
        return words

    def advance(
        self, numbers: Any, state: Any, env: Any, functions: Any, rows: Any, buffers: Any
    ) -> int:
        """`advance` of `programs/loop.py`."""
        callable_functions = type(functions)(*map(_callable, functions))
        with np.errstate(all="ignore"):
            status: int = self.functions["advance"](
                numbers.view(np.recarray), state, env, callable_functions, rows, buffers
            )
        return status


def _as_it_is(function: Any) -> Any:
    """A function that is not compiled."""
    return function


def _as_compiled(function: Callable[..., float]) -> Callable[..., Any]:
    """A function of `math` that gives what compiled code gives where Python's raises."""

    def call(*given: float) -> Any:
        try:
            return np.float64(function(*given))
        except OverflowError:
            return np.float64(math.inf)
        except ValueError:
            return np.float64(-math.inf if function is math.log and given[0] == 0.0 else math.nan)

    return call


MATH = SimpleNamespace(
    pi=math.pi,
    nan=math.nan,
    isfinite=math.isfinite,
    isnan=math.isnan,
    ceil=math.ceil,
    **{
        name: _as_compiled(getattr(math, name))
        for name in ("copysign", "cos", "exp", "log", "sin", "sqrt")
    },
)


def _callable(given: Any) -> Any:
    """A function of a structure that is called from Python; other values as they are."""
    kind = getattr(given, "kind", None)
    return given if kind is None else _called_at(int(given), kind.signature)


@cache
def _called_at(address: int, signature: Any) -> Callable[..., Any]:
    """The function at an address that is written for LLVM, with the arguments of compiled code."""
    count = result_count(signature)
    result = ctypes.c_double if count == 1 else None
    arguments = [part for kind in signature.args for part in _c_types(kind)]
    if count > 1:
        arguments.append(ctypes.c_void_p)
    function = ctypes.CFUNCTYPE(result, *arguments)(address)

    def call(*given: Any) -> Any:
        numbers = [
            part
            for kind, value in zip(signature.args, given, strict=True)
            for part in _parts(kind, value)
        ]
        if count < 2:
            return function(*numbers)
        results = np.empty(count)
        function(*numbers, results.ctypes.data)
        return tuple(results.tolist())

    return call


def _c_types(kind: Any) -> list[Any]:
    """The types in C of the parts of an argument."""
    if isinstance(kind, types.BaseTuple):
        return [part for inner in members_of(kind) for part in _c_types(inner)]
    if isinstance(kind, types.Array):
        return [ctypes.c_void_p, *[ctypes.c_int64] * (kind.ndim - 1)]
    return [ctypes.c_double if isinstance(kind, types.Float) else ctypes.c_int64]


def _parts(kind: Any, value: Any) -> list[Any]:
    """The parts of an argument: an array is its address and all of its lengths but the first."""
    if isinstance(kind, types.BaseTuple):
        return [
            part
            for inner, own in zip(members_of(kind), value, strict=True)
            for part in _parts(inner, own)
        ]
    if isinstance(kind, types.Array):
        assert value.flags.c_contiguous
        return [value.ctypes.data, *value.shape[1:]]
    return [float(value) if isinstance(kind, types.Float) else int(value)]
