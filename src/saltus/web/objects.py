"""Object files for WebAssembly, of the kernels and of a structure's functions, made by LLVM and
linked in Python.

A kernel is compiled once and kept in the cache of compiled code; a structure's functions are
compiled anew for each page, in some tenths of a second. The text of a kernel is written in a
process of its own: numba must not optimise it for this machine.
"""

from __future__ import annotations

import re
import sys
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


def object_code(texts: list[str], public: list[str]) -> bytes:
    """The object file of LLVM's texts together, of which only the public functions are seen from
    outside.
    """
    target = machine()
    whole: Any = None
    for text in texts:
        part = binding.parse_assembly(_for_page(text))
        part.triple = TARGET
        part.data_layout = str(target.target_data)
        part.verify()
        if whole is None:
            whole = part
        else:
            whole.link_in(part)
    for each in (*whole.functions, *whole.global_variables):
        if not each.is_declaration and not each.name.startswith("llvm."):
            each.linkage = "external" if each.name in public else "internal"
    options = binding.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    builder = binding.create_pass_builder(target, options)
    builder.getModulePassManager().run(whole, builder)
    made: bytes = target.emit_object(whole)
    return made


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


def kernel_object(several: bool) -> bytes:
    """The object file of a kernel, with the elementary functions: from the cache, or made."""
    sources = [
        PortableKernel(several).source,
        source_of(elementary),
        source_of(portable_text),
        source_of(sys.modules[__name__]),
    ]
    return kept_bytes(
        f"page_{digest(*sources, binding.llvm_version_info.__repr__())}.o",
        lambda: _made_elsewhere(several),
    )


def _made_elsewhere(several: bool) -> bytes:
    """A kernel's object file, made by a new process."""
    call = f"from saltus.web import objects; objects.make_kernel({several!r}, path)"
    return made_elsewhere(call, "the kernel for a page")


def make_kernel(several: bool, path: str) -> None:
    """Write a kernel's object file; called in a process of its own."""
    motion = PortableKernel(several)
    texts = [RUNTIME]
    for function, signature in functions_of(motion.source):
        text, name = llvm_of(function, signature)
        texts += [text, advance_text(name, motion.arguments)]
    texts += [part for text in elementary_texts() for part in text]
    Path(path).write_bytes(object_code(texts, ["advance", "rewind", "sqrt", *C_FUNCTIONS]))


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


def structure_object(functions: list[WrittenFunction]) -> bytes:
    """The object file of a structure's functions; WebAssembly has no fused multiply-adds, with
    which series divide faster.
    """
    functions = [replace(each, arithmetic=each.arithmetic.unfused()) for each in functions]
    return object_code([llvm_text(functions)], [function.name for function in functions])
