"""The code of a thread, linked and compiled by LLVM for a target: a card, or this processor."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from llvmlite import binding

from saltus.flow.cuda.kernel_text import kernel_texts
from saltus.flow.cuda.thread_memory import ThreadText
from saltus.flow.lane_steps.memory import LaneGroup
from saltus.flow.programs.compiled import structure_functions
from saltus.flow.programs.compiled_lanes import lane_functions
from saltus.flow.programs.lane_threads import Lanes
from saltus.taylor import (
    SeriesOf,
    Trace,
    WrittenFunction,
    digest,
    kept_bytes,
    llvm_text,
    made_for,
    source_of,
)
from saltus.taylor.vectors import Arithmetic

CARD = "nvptx64-nvidia-cuda"
OLDEST = "sm_80"
VERSION = "+ptx75"
BLOCK = 128  # threads that start together
# Blocks of them that one processor of the card holds at once: the driver then gives a thread at
# most 255 registers. Three took 1.7 times as long on an H200, whose caches their memory leaves.
BLOCKS = 2
# Functions that become part of the loop over steps, in which LLVM then knows the numbers of the
# group: those whose names say that they take lanes, and the structure's own for lanes. The scalar
# kernel, for rare events, is left as it is.
TAKE_LANES = ("lanes_20of", "LaneGroup")
OF_A_LANE = ("lane_", "run_thread", "first_root_of", "turning_range", "scalar_motion", "follow")
# LLVM's own functions for which a card has no code, by the names of those that stand for them
MATHEMATICS = {f"llvm.{name}.f64": name for name in ("sin", "cos", "exp", "log", "pow")}
# What numba's code calls besides. Arrays are taken from a stack of the thread, and given back when
# nobody counts them: first a header (the place of the array below, and numba's own five words).
RUNTIME = """
@arenas = external global i64
@arena_size = external global i64
declare ptr @arena()
declare void @llvm.trap()
define void @begin_arena() {
  %arena = call ptr @arena()
  %last = getelementptr i64, ptr %arena, i64 1
  store i64 64, ptr %arena
  store i64 0, ptr %last
  ret void
}
define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) noinline {
  %arena = call ptr @arena()
  %top = load i64, ptr %arena
  %some = add i64 %size, 127
  %whole = and i64 %some, -64
  %next = add i64 %top, %whole
  %most = load i64, ptr @arena_size
  %full = icmp ugt i64 %next, %most
  br i1 %full, label %overflow, label %take
overflow:
  call void @llvm.trap()
  unreachable
take:
  %own = getelementptr i8, ptr %arena, i64 %top
  %info = getelementptr i8, ptr %own, i64 8
  %data = getelementptr i8, ptr %own, i64 64
  %last = getelementptr i64, ptr %arena, i64 1
  %below = load i64, ptr %last
  store i64 %below, ptr %own
  store i64 %top, ptr %last
  store i64 %next, ptr %arena
  store i64 1, ptr %info
  %place = getelementptr i64, ptr %info, i64 3
  store ptr %data, ptr %place
  ret ptr %info
}
define void @NRT_incref(ptr %info) alwaysinline {
  %none = icmp eq ptr %info, null
  br i1 %none, label %end, label %count
count:
  %old = load i64, ptr %info
  %new = add i64 %old, 1
  store i64 %new, ptr %info
  br label %end
end:
  ret void
}
define void @NRT_decref(ptr %info) noinline {
  %none = icmp eq ptr %info, null
  br i1 %none, label %end, label %count
count:
  %old = load i64, ptr %info
  %new = sub i64 %old, 1
  store i64 %new, ptr %info
  %free = icmp eq i64 %new, 0
  br i1 %free, label %begin, label %end
begin:
  %arena = call ptr @arena()
  %last = getelementptr i64, ptr %arena, i64 1
  br label %pop
pop:
  %top = load i64, ptr %last
  %empty = icmp eq i64 %top, 0
  br i1 %empty, label %end, label %look
look:
  %own = getelementptr i8, ptr %arena, i64 %top
  %counted = getelementptr i8, ptr %own, i64 8
  %users = load i64, ptr %counted
  %unused = icmp eq i64 %users, 0
  br i1 %unused, label %back, label %end
back:
  store i64 %top, ptr %arena
  %below = load i64, ptr %own
  store i64 %below, ptr %last
  br label %pop
end:
  ret void
}
define void @zero_words(ptr %to, i8 %value, i64 %size, i1 %volatile) noinline {
  %words = lshr i64 %size, 3
  br label %loop
loop:
  %i = phi i64 [0, %0], [%next, %body]
  %more = icmp slt i64 %i, %words
  br i1 %more, label %body, label %end
body:
  %place = getelementptr i64, ptr %to, i64 %i
  store i64 0, ptr %place
  %next = add i64 %i, 1
  br label %loop
end:
  ret void
}
declare double @llvm.ceil.f64(double)
define double @ceil(double %x) alwaysinline {
  %whole = call double @llvm.ceil.f64(double %x)
  ret double %whole
}
declare double @llvm.sqrt.f64(double)
define double @sqrt(double %x) alwaysinline {
  %root = call double @llvm.sqrt.f64(double %x)
  ret double %root
}
"""
ARENA = """
@arenas = global i64 0
@arena_size = global i64 0
define ptr @arena() alwaysinline {{
  {thread}
  %size = load i64, ptr @arena_size
  %behind = mul i64 %thread, %size
  %first = load i64, ptr @arenas
  %place = add i64 %first, %behind
  %arena = inttoptr i64 %place to ptr
  ret ptr %arena
}}
"""
RESIDENT = f"""
!nvvm.annotations = !{{!0}}
!0 = !{{ptr @follow_all, !"maxntidx", i32 {BLOCK}, !"minctasm", i32 {BLOCKS}}}
"""
ENTRIES = {
    "host": ARENA.format(thread="%thread = add i64 0, 0"),
    "card": ARENA.format(thread="%thread = call i64 @thread_number()")
    + """
declare i32 @llvm.nvvm.read.ptx.sreg.tid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
declare i32 @llvm.nvvm.read.ptx.sreg.nctaid.x()
define i64 @thread_number() alwaysinline {
  %t = call i32 @llvm.nvvm.read.ptx.sreg.tid.x()
  %n = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %c = call i32 @llvm.nvvm.read.ptx.sreg.ctaid.x()
  %b = mul i32 %c, %n
  %k = add i32 %b, %t
  %thread = zext i32 %k to i64
  ret i64 %thread
}
declare void @follow(ptr, i64, i64)
define ptx_kernel void @follow_all(ptr %request) {
  %first = call i64 @thread_number()
  %n = call i32 @llvm.nvvm.read.ptx.sreg.ntid.x()
  %m = call i32 @llvm.nvvm.read.ptx.sreg.nctaid.x()
  %all = mul i32 %m, %n
  %step = zext i32 %all to i64
  call void @follow(ptr %request, i64 %first, i64 %step)
  ret void
}
"""
    + RESIDENT,
}


def machine(card: bool) -> Any:
    """LLVM's machine for a target."""
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    if card:
        target = binding.Target.from_triple(CARD)
        return target.create_target_machine(cpu=OLDEST, features=VERSION, opt=3)
    target = binding.Target.from_triple(binding.get_process_triple())
    features = binding.get_host_cpu_features().flatten()
    return target.create_target_machine(
        cpu=binding.get_host_cpu_name(), features=features, opt=3, jit=True
    )


def structure_text(trace: Trace, order: int) -> str:
    """LLVM's text of a structure's functions for one motion and for a lane alone, whose series have
    this order: with all orders written out, registers hold them.
    """
    one = Arithmetic(1)
    lane = [replace(each, arithmetic=one) for each in lane_functions(trace)]
    if not trace.several:
        lane = [_written_out(each, order) for each in lane]
    return llvm_text([*structure_functions(trace), *lane])


def _written_out(function: WrittenFunction, order: int) -> WrittenFunction:
    """A function with all orders of its series written out."""
    content = function.content
    if not isinstance(content, SeriesOf):
        return function
    return replace(function, content=content._replace(rows=replace(content.rows, orders=order)))


@dataclass(frozen=True)
class ThreadCode:
    """The code of a thread for a target, an object file or PTX, and what it keeps of a motion."""

    code: bytes
    first_row: np.ndarray  # words of a motion before its first launch


def thread_code(lanes: Lanes, group: LaneGroup, card: bool) -> ThreadCode:
    """The code of a thread of these lanes, from the cache or made."""
    entry = ThreadText(group, lanes.plan.places, lanes.plan.end)
    texts = [RUNTIME, ENTRIES["card" if card else "host"], str(entry)]
    texts += [structure_text(lanes.program.trace, group.sizes.order), *kernel_texts(lanes.several)]
    made_by = source_of(sys.modules[__name__]), repr(binding.llvm_version_info), made_for()
    name = f"thread_{digest(*texts, *made_by)}.{'ptx' if card else 'o'}"
    return ThreadCode(kept_bytes(name, lambda: _compiled(texts, card)), entry.first_row)


def _compiled(texts: Sequence[str], card: bool) -> bytes:
    target = machine(card)
    module = linked(texts, target, "follow_all" if card else "follow")
    if card:
        return str(target.emit_assembly(module)).encode()
    return bytes(target.emit_object(module))


def linked(texts: Sequence[str], target: Any, entry: str) -> Any:
    """LLVM's module of these texts for a target, optimised, of which `entry` is called."""
    whole: Any = None
    for text in texts:
        part = binding.parse_assembly(text)
        part.triple = target.triple
        part.data_layout = str(target.target_data)
        for each in part.functions:
            if each.name in MATHEMATICS:
                each.name = MATHEMATICS[each.name]
        part.verify()
        if whole is None:
            whole = part
        else:
            whole.link_in(part)
    _optimise(whole, target, (entry, "arenas", "arena_size"))
    return whole


def _optimise(whole: Any, target: Any, public: tuple[str, ...]) -> None:
    """Make one body of all functions, in which the constants of the group are known everywhere."""
    for each in (*whole.functions, *whole.global_variables):
        if not each.is_declaration and not each.name.startswith("llvm."):
            each.linkage = "external" if each.name in public else "internal"
    for each in whole.functions:
        inline = each.name.startswith(OF_A_LANE) or any(part in each.name for part in TAKE_LANES)
        if inline and not each.is_declaration:
            each.add_function_attribute("alwaysinline")
    options = binding.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    # calls through addresses become calls of functions in the first pass, and code in the second
    for _ in range(2):
        builder = binding.create_pass_builder(target, options)
        builder.getModulePassManager().run(whole, builder)
