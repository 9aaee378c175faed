"""The one way in which kernels are compiled, and the one file that uses parts of numba that are not
public.

Kernels are compiled with numba, without Python's exceptions for division and with fused
multiply-adds. Of numba's public interface, `njit` with its documented options and `cfunc` are used
here, and the extension interface in `numba_types.py`. The following parts are not public. If a
version of numba lacks one, or has it with other arguments, everything is compiled in numba's plain
way instead (`be_plain`), with the same results; tests change each of them. All are in numba 0.60 to
0.68. What each buys, in seconds of one slow core with numba 0.68.1:

* A compiler for functions that others of a kernel call, which become parts of its machine code and
  get none of their own
  (`_linked_only`). The kernel of one contact compiles in 11 s, not 19 s, that of several contacts
  in 33 s, not 80 s, and all kernels together in 2 minutes, not 4. No method of numba is replaced
  for it.
* A dispatcher's `get_call_template`, through which calls are typed without the literal numbers in
  them; a function would be
  compiled once more for each of these numbers. All kernels together compile in 124 s, not 147 s.
* `FunctionCache`, its `_load_overload`, and `rtsys`, with which compiled code is loaded from disk
  without the registries of all
  that numba could compile: 0.25 s, not 2.0 s, at every start. `IndexDataCacheFile`, whose files get
  a digest, buys safety.
* The option `_nrt`, which turns reference counting off where no array is made.
* A compile result's `entry_point`: a call with five functions as arguments takes 0.2 us, not 11 us,
  and a Ctrl-C within it is not
  lost. Its `library`, which gives a function's address; `cfunc` gives the same, but compiles once
  more.

One part is needed: `AttributeTemplate`, without which the fields of a named tuple cannot be
attributes of its `Reference`.
"""

from __future__ import annotations

import importlib
import io
import os
import pickle
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from llvmlite import ir
from numba import cfunc, njit, types
from numba.extending import infer_getattr

from saltus.taylor.cache import undamaged, with_digest
from saltus.taylor.numba_types import Pointer, Reference, field_type, function_type
from saltus.taylor.shipped import shipped_code

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz"}}
# For functions that only compiled code calls: numba writes no wrappers. If they also make no
# arrays, it counts no references, which would cost more than the work between two calls.
WITHIN: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
LEAN: dict[str, Any] = {"_nrt": False} | WITHIN

_plain = threading.Event()


def be_plain() -> None:
    """Use nothing private from now on."""
    _plain.set()


def is_plain() -> bool:
    """Whether a private part was found to be another than expected."""
    return _plain.is_set()


def _private(module: str, name: str) -> Any:
    """A private name of numba.

    Raises
    ------
    AttributeError
        This version does not have it.
    """
    try:
        return getattr(importlib.import_module(module), name)
    except ImportError as error:
        raise AttributeError(str(error)) from error


def _njit(within: bool = False, **options: Any) -> Callable[[Any], Any]:
    """numba's `njit` with saltus's options and, unless numba is used plainly, the given ones."""

    def decorated(function: Any) -> Any:
        if is_plain():
            return njit(
                **OPTIONS
                | {name: value for name, value in options.items() if not name.startswith("_")}
            )(function)
        more = {"pipeline_class": _linked_only()} if within else {}
        dispatcher = njit(**OPTIONS | options | more)(function)
        template = dispatcher.get_call_template
        dispatcher.get_call_template = lambda args, kws: template(*_without_values(args, kws))
        return dispatcher

    return decorated


def _without_values(args: Any, kws: Any) -> tuple[Any, Any]:
    """The types of a call's arguments with literal numbers made general: numba would compile anew
    for each literal.
    """
    return tuple(map(types.unliteral, args)), {
        name: types.unliteral(kind) for name, kind in kws.items()
    }


@cache
def _linked_only() -> Any:
    """numba's compiler for functions that others of a kernel call: they become parts of its machine
    code and get none.

    numba would optimise each by itself, with all that it calls, and make machine code of it.
    """
    lowering = _private("numba.core.typed_passes", "NativeLowering")

    class Linked(_private("numba.core.codegen", "JITCodeLibrary")):  # type: ignore[misc]
        def _optimize_final_module(self) -> None:
            pass

        def _finalize_final_module(self) -> None:
            self._finalized = True

    # as `NativeLowering`
    @_private("numba.core.compiler_machinery", "register_pass")(
        mutates_CFG=True, analysis_only=False
    )
    class Linking(lowering):  # type: ignore[misc,valid-type]
        _name = "saltus_linking"

        def run_pass(self, state: Any) -> bool:
            """Write the function into a library that is only linked; others find it by a key that
            nothing else has.
            """
            state.library, state.flags.no_compile = (
                Linked(state.targetctx.codegen(), state.func_id.func_qualname),
                True,
            )
            mutated: bool = super().run_pass(state)
            key = list[None]().append
            state.targetctx.insert_user_function(key, state.cr.fndesc, [state.library])
            state.cr = state.cr._replace(cfunc=key)
            return mutated

    class Compiler(_private("numba.core.compiler", "CompilerBase")):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            """numba's own passes with another last step."""
            made = _private("numba.core.compiler", "DefaultPassBuilder").define_nopython_pipeline(
                self.state
            )
            made.passes = [
                (Linking if each is lowering else each, description)
                for each, description in made.passes
            ]
            return [made]

    return Compiler


jit = _njit(_nrt=True, within=True, **WITHIN)
lean_jit = _njit(within=True, **LEAN)
# for functions that every step of the lanes calls
inline_jit = _njit(within=True, **LEAN, forceinline=True)


def llvm_of(function: Any, signature: Any) -> tuple[str, str]:
    """LLVM's text of a function with all that it calls, without machine code, and the function's
    name in it.

    For another processor the text is needed as numba writes it, before any optimisation folds the
    size of this one's pointers into it: so in a process with NUMBA_OPT=0, which must not have
    compiled anything else before.
    """
    dispatcher = jit(function)
    dispatcher.compile(signature)
    (result,) = dispatcher.overloads.values()
    with _private("numba.core.compiler_lock", "global_compiler_lock"):
        result.library._ensure_finalized()
    return _without_places(result.library.get_llvm_str()), result.fndesc.llvm_func_name


# what numba writes of an exception: its pickled bytes, their digest, and their number
_PICKLED = re.compile(
    r'(@\.const\.pickledata\.\S+ = internal constant )\[\d+ x i8\] c"(?:[^"\\]|\\..)*"'
)
_PICKLED_LENGTH = re.compile(
    r"(@\.const\.picklebuf\.\S+ = internal constant \{ ptr, i32, ptr, ptr, i32 \} \{ ptr \S+ i32 )\d+"
)


# their names end with the same digest
_PICKLED_NAME = re.compile(r"(@\.const\.pickle(?:data|buf)\.)([0-9a-f]{40})")


def _without_places(text: str) -> str:
    """LLVM's text without the contents of exceptions, which name the folders of this machine, and
    without their digests. What is not Python never reads them, and knows an exception by its
    status.
    """
    text = _PICKLED.sub(r"\1[1 x i8] zeroinitializer", text)
    text = _PICKLED_LENGTH.sub(r"\g<1>1", text)
    digests = dict.fromkeys(match[2] for match in _PICKLED_NAME.finditer(text))
    numbers = {digest: number for number, digest in enumerate(digests)}
    return _PICKLED_NAME.sub(lambda match: f"{match[1]}{numbers[match[2]]}", text)


def value_type(kind: Any) -> Any:
    """LLVM's type of a value of one of numba's types."""
    return _context().get_value_type(kind)


def _context() -> Any:
    return _private("numba.core.registry", "cpu_target").target_context


def by_value(name: str, inner: str, signature: Any) -> str:
    """LLVM's text of a function `name` that takes and returns values as they are. It calls a
    function of this signature that `llvm_of` has written under the name `inner`, which must not
    fail.
    """
    context = _context()
    module = context.create_module(name)
    convention = context.call_conv
    callee = ir.Function(
        module, convention.get_function_type(signature.return_type, signature.args), inner
    )
    kinds = [value_type(kind) for kind in signature.args]
    function = ir.Function(module, ir.FunctionType(value_type(signature.return_type), kinds), name)
    builder = ir.IRBuilder(function.append_basic_block())
    _, result = convention.call_function(
        builder, callee, signature.return_type, signature.args, function.args
    )
    builder.ret(result)
    return str(module)


def name_attributes(kind: type, of: Callable[[Any, str], Any]) -> None:
    """Let values of a type have attributes: `of` gives the type of one by its name, or None."""

    class Attributes(_private("numba.core.typing.templates", "AttributeTemplate")):  # type: ignore[misc]
        key = kind

        def generic_resolve(self, value: Any, attr: str) -> Any:
            """The type of an attribute, or None."""
            return of(value, attr)

    infer_getattr(Attributes)


name_attributes(Reference, field_type)


# --- compiled at once, and kept on disk --------------------------------------


@cache
def _kept() -> Any:
    """A class for a cache on disk that is read without the registries of all that numba could
    compile.
    """
    runtime = _private("numba.core.runtime", "rtsys")
    base = _private("numba.core.caching", "FunctionCache")

    class Kept(base):  # type: ignore[misc,valid-type]
        def __init__(self, py_func: Any) -> None:
            super().__init__(py_func)
            # Beside the source, in a folder of the user's own: numba's settings could name any
            # other folder.
            self._cache_path = os.path.join(
                os.path.dirname(py_func.__code__.co_filename), "__pycache__"
            )
            stamp = self._impl.locator.get_source_stamp()
            self._cache_file = _with_digests()(self._cache_path, self._impl.filename_base, stamp)

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            """The code for a signature, which came with a wheel or was compiled here, or None."""
            # numba cannot count references to arrays before this
            runtime.initialize(target_context)
            shipped = shipped_code(self._impl.filename_base)
            if shipped is not None:
                return self._impl.rebuild(target_context, pickle.loads(shipped))
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)

    return Kept


@cache
def _with_digests() -> Any:
    """A class for numba's files of compiled code that appends a digest of their bytes, behind the
    part that numba reads.
    """
    base = _private("numba.core.caching", "IndexDataCacheFile")
    for name in ("_open_for_write", "_load_index", "_load_data"):
        getattr(base, name)

    class CheckedFile(base):  # type: ignore[misc,valid-type]
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
                # numba then compiles it again, as if the file were missing
                raise OSError("damaged")
            return super()._load_data(name)

    return CheckedFile


def _compiled(signature: Any, **options: Any) -> Callable[[Any], Any]:
    def compiled(function: Any) -> Any:
        dispatcher = _njit(**options)(function)
        if is_plain():
            dispatcher.enable_caching()
        else:
            dispatcher._cache = _kept()(function)
        dispatcher.compile(signature)
        dispatcher.disable_compile()
        return dispatcher

    return compiled


def cached_jit(signature: Any, nogil: bool = False) -> Callable[[Any], Any]:
    """Compile for one signature at once, and keep the result on disk; if asked, without Python's
    lock.
    """
    return _compiled(signature, nogil=nogil)


def pointed_jit(signature: Any) -> Callable[[Any], Any]:
    """As `cached_jit`, for a function that makes no array and is called through pointers alone."""
    return _compiled(signature, _nrt=False, no_cpython_wrapper=True)


# --- calls -------------------------------------------------------------------


def entry_point(function: Any) -> Callable[..., Any]:
    """A compiled function of one signature without numba's dispatch on the types of its
    arguments.
    """
    try:
        (result,) = function.overloads.values()
        entry: Callable[..., Any] = result.entry_point
    except (AttributeError, TypeError, ValueError):
        return function  # type: ignore[no-any-return]
    return entry


def pointer(function: Any) -> Pointer:
    """A compiled function as an argument of a `function_type` for another one."""
    (signature,) = function.nopython_signatures
    try:
        result = function.get_compile_result(signature)
        address = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)
    except (AttributeError, TypeError):
        address = _called_from_c(function).address
    return Pointer.to(address, function_type(signature))


@cache
def _called_from_c(function: Any) -> Any:
    """numba's documented form of a function with an address; it compiles the function once more."""
    return cfunc(function.nopython_signatures[0], **OPTIONS)(function.py_func)
