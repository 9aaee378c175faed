"""The text of the lanes for one motion, as numba writes it: once for all models, kept on disk."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from llvmlite import binding

from saltus.flow.cuda import thread
from saltus.flow.cuda.thread_memory import NONE, ONE_CONTACT, SEVERAL
from saltus.flow.kernel.memory import ContactsFunctions, OneContactFunctions
from saltus.flow.lane_steps.memory import Code, Helpers
from saltus.flow.programs.compiled import contacts_text, one_contact_text
from saltus.flow.programs.compiled_lanes import driver_text, helpers_text
from saltus.taylor import (
    compiled_part,
    digest,
    elementary,
    elementary_texts,
    functions_of,
    kept_bytes,
    llvm_of,
    made_elsewhere,
    numba_types,
    portable_text,
    private_numba,
    source_of,
)
from saltus.taylor.private_numba import by_value

ONE_LANE = {"SALTUS_LANES": "1"}
SEPARATOR = "\n; --- next text ---\n"


def linked_functions(several: bool) -> dict[tuple[str, str], str]:
    """The functions that are called by their names in the text, by the named tuples that hold them
    and their fields.
    """
    names = SEVERAL if several else ONE_CONTACT
    kinds: dict[Any, tuple[str, ...]] = {
        Code: names["code"],
        Helpers: names["helpers"],
        OneContactFunctions: (*ONE_CONTACT["kernel"][:-1], NONE, ONE_CONTACT["kernel"][-1]),
        ContactsFunctions: SEVERAL["kernel"],
    }
    return {
        (kind.__name__, field): name
        for kind, functions in kinds.items()
        for field, name in zip(kind._fields, functions, strict=False)
        if name != NONE
    }


def kernel_texts(several: bool) -> list[str]:
    """LLVM's texts of all that the thread of a motion needs but the functions of its structure:
    `run_thread`, the helpers of the lanes and `advance` under their own names, with the elementary
    functions under those of the C library.
    """
    modules = (thread, elementary, portable_text, private_numba, numba_types, sys.modules[__name__])
    sources = [*_sources(several).values(), *(source_of(module) for module in modules)]
    call = f"from saltus.flow.cuda import kernel_text; kernel_text.write({several!r}, path)"
    made = kept_bytes(
        f"thread_{digest(*sources, repr(binding.llvm_version_info))}.ll",
        lambda: made_elsewhere(call, "the kernel for a card", ONE_LANE),
    )
    return made.decode().split(SEPARATOR)


def _sources(several: bool) -> dict[str, str]:
    """The sources of the kernel, by one of the functions of each."""
    return {
        "run_thread": driver_text(several) + compiled_part(thread),
        "scalar_motion": helpers_text(several),
        "advance": contacts_text() if several else one_contact_text(),
    }


def write(several: bool, path: str) -> None:
    """Write the texts to a file; called in a process of its own."""
    numba_types.LINKED |= linked_functions(several)
    texts = list[str]()
    for source in _sources(several).values():
        for function, signature in functions_of(source):
            if function.__name__ != "run_lanes":
                text, inner = llvm_of(function, signature)
                texts += [_by_words(text), by_value(function.__name__, inner, signature)]
    texts += [part for pair in elementary_texts() for part in pair]
    Path(path).write_text(SEPARATOR.join(texts))


def _by_words(text: str) -> str:
    """LLVM's text that reads and writes whole words: a card would take byte after byte of a record,
    which numba takes to lie anywhere, and of an array that is made zero.
    """
    whole = ("  store double ", "  store i64 ", "= load double,", "= load i64,")
    lines = [
        line.replace(", align 1", ", align 8") if any(each in line for each in whole) else line
        for line in text.split("\n")
    ]
    call = "call void @{}("
    text = "\n".join(lines).replace(call.format("llvm.memset.p0.i64"), call.format("zero_words"))
    return f"{text}\ndeclare void @zero_words(ptr, i8, i64, i1)\n"
