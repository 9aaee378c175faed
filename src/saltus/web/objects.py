"""The WebAssembly of a page, as LLVM writes it: one module of a kernel, and one of a structure's
functions, which share their memory.

A kernel is compiled once and kept in the cache of compiled code; a structure's functions are
compiled anew for each page, in a tenth of a second. The text of a kernel is written in a process of
its own: numba must not optimise it for this machine.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from llvmlite import binding

from saltus.errors import SaltusError
from saltus.flow import PortableKernel
from saltus.taylor import (
    C_FUNCTIONS,
    WrittenFunction,
    digest,
    elementary,
    elementary_texts,
    functions_of,
    kept_bytes,
    llvm_of,
    llvm_text,
    made_elsewhere,
    portable_text,
    source_of,
)

TARGET = "wasm32-unknown-unknown"
# all browsers of the last years have them
FEATURES = "+bulk-memory,+sign-ext,+nontrapping-fptoint,+mutable-globals"
END = "end_of_data"  # the last variable of a module
# What a kernel has for the page and for the functions of a structure; `advance` runs it.
KERNEL_FUNCTIONS = ["advance", "rewind", "sqrt", *C_FUNCTIONS]
# Bytes that the data of a kernel may take: behind them lie the data of a structure's functions.
KERNEL_DATA = 1 << 16
# What numba's code calls besides: memory that is never given back, but used again by the next call,
# and a root.
RUNTIME = """
@heap = global i32 0
define void @rewind(i32 %to) {
  store i32 %to, ptr @heap
  ret void
}
define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %from = load i32, ptr @heap
  %bytes = trunc i64 %size to i32
  %begin = add i32 %from, 64
  %ahead = add i32 %bytes, 127
  %reach = add i32 %begin, %ahead
  %end = and i32 %reach, -64
  store i32 %end, ptr @heap
  %pages = call i32 @llvm.wasm.memory.size.i32(i32 0)
  %have = shl i32 %pages, 16
  %more = icmp ugt i32 %end, %have
  br i1 %more, label %grow, label %done
grow:
  %least = sub i32 %end, %have
  %wanted = lshr i32 %least, 16
  %some = add i32 %wanted, 64
  %grown = call i32 @llvm.wasm.memory.grow.i32(i32 0, i32 %some)
  %failed = icmp slt i32 %grown, 0
  br i1 %failed, label %none, label %done
none:
  ret ptr null
done:
  %info = inttoptr i32 %from to ptr
  %data = inttoptr i32 %begin to ptr
  %place = getelementptr {i64, ptr, ptr, ptr, i64}, ptr %info, i32 0, i32 3
  store ptr %data, ptr %place
  ret ptr %info
}
define { i64, i1 } @product_of_sizes(i64 %a, i64 %b) {
  %product = mul i64 %a, %b
  %made = insertvalue { i64, i1 } { i64 0, i1 false }, i64 %product, 0
  ret { i64, i1 } %made
}
declare i32 @llvm.wasm.memory.size.i32(i32)
declare i32 @llvm.wasm.memory.grow.i32(i32, i32)
declare double @llvm.sqrt.f64(double)
define double @sqrt(double %x) {
  %root = call double @llvm.sqrt.f64(double %x)
  ret double %root
}
"""


def machine() -> Any:
    """LLVM's machine for the page."""
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    try:
        target = binding.Target.from_triple(TARGET)
    except RuntimeError as error:
        raise SaltusError(f"LLVM of this llvmlite cannot compile for browsers: {error}") from None
    return target.create_target_machine(cpu="generic", features=FEATURES, opt=3, reloc="static")


def module(
    texts: list[str], names: list[str], *, room: int = 0, imports: Iterable[str] = ()
) -> bytes:
    """The WebAssembly of LLVM's texts together, with the functions of these names.

    LLVM writes a module that imports its memory, its table of functions and its stack pointer, and
    that exports nothing. Its data begin at address 0 with one word of 4 bytes for each name, the
    function's place in the table, and one more, the address at which the data end. Then follow
    `room` bytes that the module does not use.

    Raises
    ------
    SaltusError
        A function is neither in the texts nor among the imports.
    """
    target = machine()

    def parsed(text: str) -> Any:
        part = binding.parse_assembly(text)
        part.triple = TARGET
        part.data_layout = str(target.target_data)
        part.verify()
        return part

    first, *others = map(_for_page, texts)
    code = parsed(first)
    for text in others:
        code.link_in(parsed(text))
    _hide(code, names)
    options = binding.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    builder = binding.create_pass_builder(target, options)
    builder.getModulePassManager().run(code, builder)
    lacking = [
        function.name
        for function in code.functions
        if function.is_declaration
        and not function.name.startswith("llvm.")
        and function.name not in imports
    ]
    if lacking:
        raise SaltusError(f"a page has no function {lacking[0][:60]!r}, which these equations need")
    # Variables keep their order: the words come first, and the end last.
    words = ", ".join(f"ptr @{name}" for name in (*names, END))
    declared = [f"declare void @{name}()" for name in names]
    head = [
        f"@words = global [{len(names) + 1} x ptr] [{words}]",
        f"@room = global [{room} x i8] zeroinitializer",
        f"@{END} = external global i64",
    ]
    whole = parsed("\n".join(head + declared))
    whole.link_in(code)
    whole.link_in(parsed(f"@{END} = global i64 0"))
    made: bytes = target.emit_object(whole)
    return made


def _hide(code: Any, public: list[str]) -> None:
    """Let only the public functions be seen from outside."""
    for part in (*code.functions, *code.global_variables):
        if not part.is_declaration and not part.name.startswith("llvm."):
            part.linkage = "external" if part.name in public else "internal"


def _for_page(text: str) -> str:
    """LLVM's text without what belongs to this machine, and without counts of references, as
    nothing is given back.
    """
    text = re.sub(r"^target (datalayout|triple) = .*$", "", text, flags=re.M)
    text = re.sub(r"= common (local_unnamed_addr )?global", "= internal global", text)
    # it would need numbers of 128 bits
    text = text.replace("@llvm.smul.with.overflow.i64", "@product_of_sizes")
    counts = r"^(define linkonce_odr void @NRT_(?:incref|decref)\(ptr[^{]*)\{.*?^\}"
    return re.sub(counts, lambda found: found[1] + "{\n  ret void\n}", text, flags=re.M | re.S)


# --- the kernels -------------------------------------------------------------


def kernel_code(several: bool) -> bytes:
    """The module of a kernel, with the elementary functions: from the cache, or made."""
    sources = [
        PortableKernel(several).source,
        source_of(elementary),
        source_of(portable_text),
        source_of(sys.modules[llvm_of.__module__]),
        source_of(sys.modules[__name__]),
    ]
    return kept_bytes(
        f"page_{digest(*sources, binding.llvm_version_info.__repr__())}.wasm",
        lambda: _made_elsewhere(several),
    )


def _made_elsewhere(several: bool) -> bytes:
    """A kernel's module, made by a new process."""
    call = f"from saltus.web import objects; objects.make_kernel({several!r}, path)"
    return made_elsewhere(call, "the kernel for a page")


def make_kernel(several: bool, path: str) -> None:
    """Write a kernel's module; called in a process of its own."""
    motion = PortableKernel(several)
    texts = [RUNTIME]
    for function, signature in functions_of(motion.source):
        text, name = llvm_of(function, signature)
        texts += [text, advance_text(name, motion.arguments)]
    texts += [part for text in elementary_texts() for part in text]
    Path(path).write_bytes(module(texts, KERNEL_FUNCTIONS))


def advance_text(inner: str, arguments: list[dict[str, Any]]) -> str:
    """LLVM's text of `advance(request)`, which calls the kernel with the arrays that a request
    describes.

    The request has, for each argument, the address of an array and its lengths, or a place in the
    table of functions, in words of 8 bytes.
    """
    lines = list[str]()
    values = list[str]()
    place = 0

    def word(at: int) -> str:
        lines.append(
            f"  %p{at} = getelementptr i64, ptr %request, i32 {at}\n  %w{at} = load i64, ptr %p{at}"
        )
        return f"%w{at}"

    for argument in arguments:
        address = word(place)
        count = argument["dimensions"]
        if argument["kind"] == "function":
            values.append(f"i64 {address}")
            place += 1
            continue
        lengths = [word(place + 1 + i) for i in range(count)]
        lines.append(f"  %a{place} = inttoptr i64 {address} to ptr")
        size = str(argument["size"])
        strides = [str(argument["size"])]
        for i in range(count - 1, -1, -1):
            lines.append(f"  %s{place}_{i} = mul i64 {strides[0]}, {lengths[i]}")
            strides.insert(0, f"%s{place}_{i}")
        lines.append(f"  %n{place} = udiv i64 {strides[0]}, {size}")
        values += ["ptr null", "ptr null", f"i64 %n{place}", f"i64 {size}", f"ptr %a{place}"]
        values += [f"i64 {each}" for each in (*lengths, *strides[1:])]
        place += 1 + count
    kinds = ", ".join(value.split()[0] for value in values)
    body = "\n".join(lines)
    return f"""
declare i32 @"{inner}"(ptr, ptr, {kinds})
define i32 @advance(ptr %request) {{
{body}
  %result = alloca i64
  %problem = alloca ptr
  %failed = call i32 @"{inner}"(ptr %result, ptr %problem, {", ".join(values)})
  %status = load i64, ptr %result
  %short = trunc i64 %status to i32
  %bad = icmp ne i32 %failed, 0
  %value = select i1 %bad, i32 -1, i32 %short
  ret i32 %value
}}"""


# --- a structure's functions -------------------------------------------------


def structure_code(functions: list[WrittenFunction]) -> bytes:
    """The module of a structure's functions; WebAssembly has no fused multiply-adds, with which
    series divide faster.
    """
    functions = [replace(each, arithmetic=each.arithmetic.unfused()) for each in functions]
    names = [function.name for function in functions]
    return module([llvm_text(functions)], names, room=KERNEL_DATA, imports=KERNEL_FUNCTIONS)
