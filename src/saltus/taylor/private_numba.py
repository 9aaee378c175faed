"""The one way in which saltus compiles, and the one file that uses parts of numba that are not public.

saltus compiles with numba, without Python's exceptions for division and with fused multiply-adds. Tested with numba 0.60.0 and
0.68.1 (see tests/taylor/test_private_numba.py); pyproject.toml allows these and all versions between.

numba's public interface is used as documented: `njit` and its options, `types`, the first-class function types, and the extension
interface (`intrinsic`, `register_model`, `lower_builtin`, `type_callable`). The following parts are not public; for each there is
a fallback if a version of numba lacks it:

* the option `_nrt`, which turns reference counting off. Without it references are counted, which costs time.
* `FunctionCache`, its `_load_overload` and `rtsys`, with which compiled code is loaded from disk without the registries of all
  that numba could compile, and `IndexDataCacheFile`, whose files get a digest. Without them numba's own `cache=True` is used.
* the methods of `CPUContext` and `JITCodeLibrary` that run after a function has been compiled. They are replaced so that machine
  code is made only of functions that are called from outside. Without them it is made of all, which takes twice as long.
* a dispatcher's `get_call_template`, through which calls are typed without the literal numbers in them. Without it a function is
  compiled once more for each of these numbers.
* `FunctionModel` and a compile result's `library` and `entry_point`, with which a function's address is looked up once and passed
  as a number, and calls skip numba's dispatch. Without them numba looks it up by Python code at every call, where a Ctrl-C is
  lost.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import logging
import os
import stat
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

from numba import njit, types
from numba.extending import NativeValue, intrinsic, lower_builtin, models, register_model, type_callable, typeof_impl, unbox


def _private(module: str, name: str) -> Any:
    """A private name of numba, or None if this version does not have it."""
    try:
        return getattr(importlib.import_module(module), name, None)
    except ImportError:
        return None


CPU_OPTIONS = _private("numba.core.cpu", "CPUTargetOptions")
FUNCTION_CACHE = _private("numba.core.caching", "FunctionCache")
CACHE_FILE = _private("numba.core.caching", "IndexDataCacheFile")
RUNTIME = _private("numba.core.runtime", "rtsys")
CONTEXT = _private("numba.core.cpu", "CPUContext")
LIBRARY = _private("numba.core.codegen", "JITCodeLibrary")
MAKE_FUNCTION = _private("numba._dynfunc", "make_function")
FUNCTION_MODEL = _private("numba.experimental.function_type", "FunctionModel")
EXPERIMENTAL = _private("numba.core.errors", "NumbaExperimentalFeatureWarning")

DIGEST = hashlib.sha256().digest_size  # bytes
COMPILING = threading.RLock()  # held while methods of numba are replaced: two threads would restore each other's replacements

log = logging.getLogger("saltus.cache")

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz"}}
# For functions that only compiled code calls: numba writes no wrappers. If they also make no arrays, it counts no references,
# which would cost more than the work between two calls.
WITHIN: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
LEAN: dict[str, Any] = {"_nrt": False} | WITHIN


def _njit(**options: Any) -> Callable[[Any], Any]:
    """numba's `njit` with saltus's options and those of the given ones that this numba knows."""
    known = {name: value for name, value in options.items() if not name.startswith("_") or hasattr(CPU_OPTIONS, name)}

    def decorated(function: Any) -> Any:
        dispatcher = njit(**OPTIONS | known)(function)
        template = getattr(dispatcher, "get_call_template", None)
        if template is not None:
            dispatcher.get_call_template = lambda args, kws: template(*_without_values(args, kws))
        return dispatcher

    return decorated


def _without_values(args: Any, kws: Any) -> tuple[Any, Any]:
    """The types of a call's arguments with literal numbers made general: numba would compile anew for each literal."""
    return tuple(map(types.unliteral, args)), {name: types.unliteral(kind) for name, kind in kws.items()}


jit = _njit(_nrt=True, **WITHIN)
lean_jit = _njit(**LEAN)
inline_jit = _njit(**LEAN, forceinline=True)  # for functions that every step of the lanes calls


# --- compiled at once, and kept on disk ------------------------------------------------------------------------------------


def _kept(function: Any) -> Any:
    """A cache on disk that is read without the registries of all that numba could compile; None if this numba has another
    cache."""
    methods = ("_open_for_write", "_load_index", "_load_data")
    if RUNTIME is None or not hasattr(FUNCTION_CACHE, "_load_overload") or not all(hasattr(CACHE_FILE, m) for m in methods):
        return None

    class Kept(FUNCTION_CACHE):  # type: ignore[misc,valid-type]
        def __init__(self, py_func: Any) -> None:
            super().__init__(py_func)
            # Beside the source, in a folder of the user's own: numba's settings could name any other folder.
            self._cache_path = os.path.join(os.path.dirname(py_func.__code__.co_filename), "__pycache__")
            stamp = self._impl.locator.get_source_stamp()
            self._cache_file = _with_digests()(self._cache_path, self._impl.filename_base, stamp)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            """The code for a signature, or None."""
            RUNTIME.initialize(target_context)  # numba cannot count references to arrays before this
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)

    return Kept(function)


@cache
def _with_digests() -> Any:
    """A class for numba's files of compiled code that appends a digest of their bytes, behind the part that numba reads."""

    class CheckedFile(CACHE_FILE):  # type: ignore[misc,valid-type]
        @contextmanager
        def _open_for_write(self, filepath: str) -> Iterator[Any]:
            content = io.BytesIO()
            yield content
            with super()._open_for_write(filepath) as file:
                file.write(with_digest(content.getvalue()))

        def _load_index(self) -> Any:
            return {} if undamaged(self._index_path) is None else super()._load_index()

        def _load_data(self, name: str) -> Any:
            if undamaged(self._data_path(name)) is None:
                raise OSError("damaged")  # numba then compiles it again, as if the file were missing
            return super()._load_data(name)

    return CheckedFile


def with_digest(content: bytes) -> bytes:
    """The content of a file of compiled code: the code, followed by the digest of its bytes."""
    return content + hashlib.sha256(content).digest()


def undamaged(path: str) -> bytes | None:
    """The code in a file, without its digest, or None; a damaged file, a link or another user's file is removed, with a remark.

    The owner is checked because anybody can compute a digest: a file of another user, or a link, was planted while others could
    write to the folder.
    """
    try:
        found = os.lstat(path)
        own = stat.S_ISREG(found.st_mode) and (not hasattr(os, "getuid") or found.st_uid == os.getuid())
        content = Path(path).read_bytes() if own else b""
    except OSError:
        return None
    if own and with_digest(content[:-DIGEST]) == content:
        return content[:-DIGEST]
    log.warning("%s is %s; it is compiled again", path, "damaged" if own else "not the user's own")
    with suppress(OSError):
        os.unlink(path)
    return None


def _compiled(signature: Any, **options: Any) -> Callable[[Any], Any]:
    def compiled(function: Any) -> Any:
        dispatcher = _njit(**options)(function)
        kept = _kept(function)
        if kept is None:
            dispatcher.enable_caching()
        else:
            dispatcher._cache = kept
        with COMPILING, _machine_code_of(function):
            dispatcher.compile(signature)
        dispatcher.disable_compile()
        return dispatcher

    return compiled


@contextmanager
def _machine_code_of(outer: Any) -> Iterator[None]:
    """A context in which machine code is made of this function only, which then contains all functions that it calls.

    numba would optimise each called function by itself, and make machine code of it as if it were called from Python as well.
    """
    parts = [(CONTEXT, "get_executable"), (LIBRARY, "_optimize_final_module"), (LIBRARY, "_finalize_final_module")]
    if MAKE_FUNCTION is None or not all(hasattr(*part) for part in parts):
        yield
        return
    emit, optimise, finish = (getattr(*part) for part in parts)
    inner: dict[Any, tuple[str, Any]] = {}  # by library: the environments of functions that are only linked
    mine = threading.get_ident()

    def get_executable(self: Any, library: Any, described: Any, environment: Any) -> Any:
        if threading.get_ident() != mine:
            return emit(self, library, described, environment)
        if described.qualname == outer.__qualname__:
            made = emit(self, library, described, environment)
            for name, own in inner.values():
                if library.codegen._engine.is_symbol_defined(name):
                    library.codegen.set_env(name, own)
            return made
        inner[library] = self.get_env_name(described), environment
        return MAKE_FUNCTION(described.lookup_module(), described.qualname, "", 0, environment, (library,))

    def optimize(self: Any) -> None:
        if self not in inner:
            optimise(self)

    def finalize(self: Any) -> None:
        if self not in inner:
            finish(self)
        self._finalized = True

    before = [(owner, name, vars(owner).get(name)) for owner, name in parts]
    try:
        for (owner, name), new in zip(parts, (get_executable, optimize, finalize), strict=True):
            setattr(owner, name, new)
        yield
    finally:
        for owner, name, old in before:
            delattr(owner, name) if old is None else setattr(owner, name, old)


def cached_jit(signature: Any, nogil: bool = False) -> Callable[[Any], Any]:
    """Compile for one signature at once, and keep the result on disk; if asked, without Python's lock."""
    return _compiled(signature, nogil=nogil)


def pointed_jit(signature: Any, python: bool = False) -> Callable[[Any], Any]:
    """As `cached_jit`, for a function that makes no array and is called through pointers, or, if asked, from Python too."""
    return _compiled(signature, _nrt=False, no_cpython_wrapper=not python)


# --- calls -----------------------------------------------------------------------------------------------------------------


@contextmanager
def pointers() -> Iterator[None]:
    """A context without numba's warning that calls through pointers are experimental; the tests run every kernel through them."""
    with warnings.catch_warnings():
        if EXPERIMENTAL is not None:
            warnings.simplefilter("ignore", EXPERIMENTAL)
        yield


def entry_point(function: Any) -> Callable[..., Any]:
    """A compiled function of one signature without numba's dispatch on the types of its arguments."""
    (result,) = function.overloads.values()
    entry: Callable[..., Any] = getattr(result, "entry_point", function)
    return entry


def pointer(function: Any) -> Any:
    """A compiled function as an argument of a `function_type` for another one."""
    if FUNCTION_MODEL is None:
        return function
    (signature,) = function.nopython_signatures
    result = function.get_compile_result(signature)
    address = Pointer(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))
    address.signature = signature
    return address


def function_type(signature: Any) -> types.FunctionType:
    """The type of arguments that are functions of this signature."""
    return (types.FunctionType if FUNCTION_MODEL is None else PointedFunction)(signature)


class Pointer(int):
    """The address of a compiled function."""

    signature: Any


class PointedFunction(types.FunctionType):
    """A function that is given by its address."""


def _address(kind: PointedFunction, given: Any, boundary: Any) -> NativeValue:
    """A `Pointer` in compiled code."""
    made = boundary.context.make_helper(boundary.builder, kind)  # all of its members are 0
    address = boundary.pyapi.long_as_voidptr(given)
    try:
        made.c_addr = address
    except KeyError:
        made.addr = address  # its name in numba 0.60
    return NativeValue(made._getvalue())


if FUNCTION_MODEL is not None:
    register_model(PointedFunction)(FUNCTION_MODEL)
    typeof_impl.register(Pointer)(lambda given, context: function_type(given.signature))
    unbox(PointedFunction)(_address)


# --- code that is written for LLVM -----------------------------------------------------------------------------------------


class Array:
    """A C-contiguous array in code that is written for LLVM: where its first element is, and its lengths."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        made = context.make_array(kind)(context, builder, value)
        self.data = made.data
        self.shape = tuple(builder.extract_value(made.shape, i) for i in range(kind.ndim))


def _argument(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """An argument of numba's as LLVM's number, an `Array`, or a tuple of them."""
    if isinstance(kind, types.Array):
        return Array(context, builder, kind, value)
    if isinstance(kind, types.BaseTuple):
        parts = [builder.extract_value(value, i) for i in range(len(kind))]
        return tuple(_argument(context, builder, each, part) for each, part in zip(kind, parts, strict=True))  # type: ignore[call-overload]
    return value


def written(write: Callable[..., list[Any]], results: int) -> Any:
    """A function of compiled code that takes one tuple; `write(builder, *arguments)` writes LLVM's code and gives the results."""
    double = types.float64
    kind = (types.void, double)[results] if results < 2 else types.UniTuple(double, results)

    @intrinsic
    def function(typing: Any, arguments: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            values = write(builder, *_argument(context, builder, signature.args[0], args[0]))
            if results > 1:
                return context.make_tuple(builder, kind, values)
            return values[0] if results else context.get_dummy_value()

        return kind(arguments), code

    return function


def inlined(result: Any, write: Callable[..., Any], count: int) -> Any:
    """A function of compiled code of `count` arguments; `write(builder, types, *arguments)` gives LLVM's value of its result."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        given = [_argument(context, builder, kind, value) for kind, value in zip(signature.args, args, strict=True)]
        value = write(builder, signature.args, *given)
        return context.get_dummy_value() if result == types.void else value

    if count == 1:
        return intrinsic(lambda typing, a: (result(a), code))
    if count == 2:
        return intrinsic(lambda typing, a, b: (result(a, b), code))
    if count == 3:
        return intrinsic(lambda typing, a, b, c: (result(a, b, c), code))
    return intrinsic(lambda typing, a, b, c, d: (result(a, b, c, d), code))


def register_type(kind: type, llvm: Any) -> None:
    """Let numba keep values of one of its types in an LLVM type."""

    class Model(models.PrimitiveModel):
        def __init__(self, manager: Any, each: Any) -> None:
            super().__init__(manager, each, llvm)  # type: ignore[no-untyped-call]

    register_model(kind)(Model)


def operator_meaning(symbol: Any, kind: type, result: Any, write: Callable[..., Any], count: int = 2) -> None:
    """Let Python's operator mean `write` where a value of this type is among its operands; the others may be numbers.

    numba's `overload` would compile a function for every pair of types.
    """

    def fits(*given: Any) -> Any:
        own = [isinstance(each, kind) for each in given]
        fit = any(own) and all(o or isinstance(each, types.Number) for o, each in zip(own, given, strict=True))
        return result if fit else None

    @type_callable(symbol)
    def typer(context: Any) -> Any:
        return {1: lambda a: fits(a), 2: lambda a, b: fits(a, b)}[count]

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return write(builder, signature.args, *args)

    for kinds in product((kind, types.Number), repeat=count):
        if kind in kinds:
            lower_builtin(symbol, *kinds)(code)
