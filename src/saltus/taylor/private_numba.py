"""The one way in which saltus compiles: numba, without Python's exceptions for division, and with fused multiply-adds.

The kernel is compiled once and calls the functions of a structure through pointers, so their types are fixed here.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba import njit, types
from numba.core.caching import FunctionCache
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.core.runtime import rtsys

OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract", "nsz"}}
jit: Callable[[Any], Any] = njit(**OPTIONS | {"_nrt": True})
# For functions that make no array and that only compiled code may call: numba then counts no references, which would cost more
# than the work between two calls, and writes no wrappers.
_LEAN: Any = {"_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, **OPTIONS}
lean_jit: Callable[[Any], Any] = njit(**_LEAN)
inline_jit: Callable[[Any], Any] = njit(**_LEAN, forceinline=True)  # for what every step of the lanes calls


class _Kept(FunctionCache):
    """Compiled code on disk, loaded without the registries of all that numba could compile: they take longer than all else."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The code for a signature, or None."""
        rtsys.initialize(target_context)  # without which arrays cannot be counted
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def _kept(signature: Any, options: Any) -> Callable[[Any], Any]:
    def compiled(function: Any) -> Any:
        dispatcher = njit(**options)(function)
        dispatcher._cache = _Kept(function)
        dispatcher.compile(signature)
        dispatcher.disable_compile()
        return dispatcher

    return compiled


def cached_jit(signature: Any, nogil: bool = False) -> Callable[[Any], Any]:
    """Compile for one signature at once, and keep the result on disk; if asked, without Python's lock."""
    return _kept(signature, OPTIONS | {"nogil": nogil})


def pointed_jit(signature: Any, fused: bool = True, python: bool = False) -> Callable[[Any], Any]:
    """The same for a function that makes no array and is called through pointers, or, if asked, from Python too.

    Not fused, it has no fused multiply-adds: a law that takes the difference of two equal products must get 0, not the rounding
    of one of them.
    """
    return _kept(signature, {"_nrt": False, "no_cpython_wrapper": not python, **OPTIONS} | ({} if fused else {"fastmath": False}))


class Pointer(types.WrapperAddressProtocol):
    """A compiled function as an argument for another one; its address is looked up once, not at every call."""

    def __init__(self, function: Any) -> None:
        (self._signature,) = function.nopython_signatures
        result = function.get_compile_result(self._signature)
        self._address = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        return int(self._address)

    def signature(self) -> Any:
        """The function's numba signature."""
        return self._signature


def not_here(signature: Any, **options: Any) -> Callable[[Any], Any]:
    """Stands for `cached_jit` where a text is only read or imported for its constants, and compiled elsewhere."""
    return lambda function: function


_f, _i = types.float64, types.int64
_f1, _f2, _f3 = (types.Array(_f, n, "C") for n in (1, 2, 3))
_i1, _i2 = (types.Array(_i, n, "C") for n in (1, 2))
ENV = types.Tuple((_f1, _f1, _f1, _f3))  # parameters, constants, record breakpoints, record table

CONSTANTS = types.void(_f1, _f1)
GEOMETRY = types.void(ENV, _f1)
SERIES = types.void(_f, _f, _f, ENV, _i, _f2, _f2, _f2, _f1, _f2, _f2, _i)
CONTACT_SERIES = types.void(_f, _f, _f, ENV, _i, _f1, _f2, _i)
RESET = types.UniTuple(_f, 2)(_f, _f, _f, _f, ENV, _i)
CONTACT_DAMPING = _f(_f, _f, _f, ENV, _i)
TANGENT = types.void(_i, _i, _f, _f, _f, ENV, _i, _f1)


@contextmanager
def pointers() -> Iterator[None]:
    """Within it numba does not remark that calls through pointers are experimental; the tests run every kernel through them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        yield


with pointers():
    _functions = [types.FunctionType(s) for s in (SERIES, CONTACT_SERIES, RESET, CONTACT_DAMPING, TANGENT)]
    MODEL = types.Tuple((*_functions[:4], _f1, _functions[4]))
STEP_BUFFERS, EVENT_BUFFERS = types.Tuple((_i2, _f2, _f3)), types.Tuple((_i2, _f2))
ADVANCE = _i(_i1, _f1, _f1, ENV, MODEL, STEP_BUFFERS, EVENT_BUFFERS)
SEGMENTS = _i(_i1, _f1, ENV, MODEL, _f2, _i2, _f2, _f2, _f3, _f2)
IMPACT_EQUATIONS = types.void(_f2, _f1, _f1, _f, _i, _f2, _f3, _f2, _f3, _f3, _f3)
