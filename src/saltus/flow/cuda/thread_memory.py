"""The memory of a thread, and LLVM's text of the function that gives it to the lanes' driver.

The driver takes a `LaneGroup` (`lanes/memory.py`). What a structure and a call fix in it (sizes,
the functions, the places of the parts) are constants of the text. So LLVM removes what a structure
does not have, and calls through addresses become code. What moves is in the thread's own memory;
what a motion keeps from one launch to the next is a row of `kept`, and everything else is an array
that a `Request` names.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types

from saltus.flow.lanes.memory import END, FLAGS, JOB, ROW, Code, Control, Helpers, LaneGroup
from saltus.taylor.lane_memory import LanesType
from saltus.taylor.private_numba import value_type
from saltus.taylor.vectors import DOUBLE, INDEX, LONG

WORD = 8  # bytes
NAMES = {  # of the functions in the text, by their places in the group
    "code": ("lane_series", "lane_impact", "lane_field", "constants", "geometry"),
    "helpers": ("first_root_of", "turning_range", "scalar_motion"),
    "kernel": ("advance", "series", "contact_series", "reset", "contact_damping", "tangent"),
}
ROOM = ("polynomial", "gap")  # of which a motion keeps nothing
FUNCTIONS = [name for names in NAMES.values() for name in names]


class Request(NamedTuple):
    """What a launch is asked for: words of 8 bytes, of which most are addresses of arrays."""

    count: Any  # motions that go on
    going: Any  # their numbers
    flags: Any  # of each motion, and the calls of the scalar kernel in its last launch
    kept: Any  # the rows of all motions, see `kept_fields`
    states: Any  # from here on the arrays of `Work`
    jobs: Any
    parameters: Any
    breaks: Any
    table: Any
    last: Any
    ends: Any
    rates: Any
    samples: Any
    records: Any  # rows of the tables: one, or one for each motion
    pieces: Any  # breakpoints in a row
    samples_kept: Any  # forcing periods
    most_periods: Any  # of this launch
    most_calls: Any
    settings: Any  # the numbers of `LaneSettings` one after the other


FLAG_WORDS = FLAGS.itemsize // WORD


def kept_fields(group: LaneGroup, series_at: int) -> dict[str, int]:
    """The arrays of a group that a motion keeps from one launch to the next besides its flags, and
    their words; of the memory, its slots before the series.
    """
    names = ["constants_of", "geometry"] + ["stroboscopic", "agreements"] * group.sizes.settle
    sizes = {name: getattr(group, name)[0].size for name in names}
    return {"memory": series_at, "rows": ROW.itemsize // WORD} | sizes


def _word(builder: Any, place: Any, number: int) -> Any:
    """The place of a word behind LLVM's pointer to an array, or to its first word."""
    array = isinstance(place, ir.AllocaInstr)
    return builder.gep(place, [INDEX(0), INDEX(number)] if array else [LONG(number)])


class ThreadText:
    """Writes the function `follow(request, first, step)`: every `step`-th motion, from `first` on,
    goes on as far as the request allows.
    """

    def __init__(self, group: LaneGroup, places: Any, end: int) -> None:
        """`places` are the parts of the memory for one lane, and `end` its slots."""
        self.group = group
        self.fields = kept_fields(group, places.positions)
        self.kept = sum(self.fields.values())
        self._end = end
        self._module = ir.Module("thread")
        self._builder: Any = None
        self._request: Any = None
        self._words: dict[str, Any] = {}
        self._arrays: dict[str, tuple[Any, tuple[Any, ...]]] = {}
        self._setting = count()
        self._functions = {
            name: ir.Function(self._module, ir.FunctionType(ir.VoidType(), []), name)
            for name in FUNCTIONS
        }
        self._kind = LanesType.tuples["lanes of one contact"]
        run = ir.FunctionType(value_type(types.none), [value_type(self._kind)])
        self._run = ir.Function(self._module, run, "run_thread")
        self._write()

    def __str__(self) -> str:
        return str(self._module)

    # --- the loop over motions -----------------------------------------------

    def _write(self) -> None:
        words = LONG.as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [words, LONG, LONG])
        function = ir.Function(self._module, kind, "follow")
        self._request, first, step = function.args
        entry = function.append_basic_block("entry")
        head, body, end = (function.append_basic_block(name) for name in ("head", "body", "end"))
        b = self._builder = ir.IRBuilder(entry)
        self._words = {
            name: b.load(b.gep(self._request, [LONG(i)])) for i, name in enumerate(Request._fields)
        }
        # in the thread's own memory, so that LLVM may keep it in registers
        own = b.alloca(ir.ArrayType(LONG, self._end)), b.alloca(ir.ArrayType(LONG, FLAG_WORDS))
        room = {name: b.alloca(ir.ArrayType(LONG, getattr(self.group, name).size)) for name in ROOM}
        control = b.alloca(ir.ArrayType(LONG, len(Control)))
        b.call(ir.Function(self._module, ir.FunctionType(ir.VoidType(), []), "begin_arena"), [])
        b.branch(head)
        b.position_at_end(head)
        turn = b.phi(LONG)
        turn.add_incoming(first, entry)
        b.cbranch(b.icmp_signed("<", turn, self._words["count"]), body, end)
        b.position_at_end(body)
        going = b.inttoptr(self._words["going"], words)
        motion = b.load(b.gep(going, [turn]))
        kept = b.gep(b.inttoptr(self._words["kept"], words), [b.mul(motion, LONG(self.kept))])
        flags = b.gep(
            b.inttoptr(self._words["flags"], words), [b.mul(motion, LONG(FLAG_WORDS + 1))]
        )
        rows = ((own[0], kept, self.fields["memory"]), (own[1], flags, FLAG_WORDS))
        self._place(
            motion, kept, room | {"memory": own[0], "flags": own[1], "work.control": control}
        )
        self._copy((row, place, size) for place, row, size in rows)
        limits = (self._words["most_periods"], LONG(0), self._words["most_calls"], LONG(0))
        for i, value in enumerate(limits):
            b.store(value, b.gep(control, [INDEX(0), INDEX(i)]))
        b.call(self._run, [self._value(self._kind, self.group, ())])
        self._copy(rows)
        calls = b.load(b.gep(control, [INDEX(0), INDEX(int(Control.CALLS))]))
        b.store(calls, b.gep(flags, [LONG(FLAG_WORDS)]))
        turn.add_incoming(b.add(turn, step), b.block)
        b.branch(head)
        b.position_at_end(end)
        b.ret_void()

    def _copy(self, rows: Iterable[tuple[Any, Any, int]]) -> None:
        """Copy from one place to another, word by word: a loop would become a call that copies
        bytes.
        """
        b = self._builder
        for source, target, size in rows:
            for i in range(size):
                b.store(b.load(_word(b, source, i)), _word(b, target, i))

    def _place(self, motion: Any, kept: Any, own: dict[str, Any]) -> None:
        """Where each array of the group is, with its lengths."""
        b = self._builder
        group = self.group
        at = 0
        places = {}
        for name, size in self.fields.items():
            places[name] = b.gep(kept, [LONG(at)])
            at += size
        places |= own
        lengths = {"memory": (self._end,), "work.control": (len(Control),)}
        for name, place in places.items():
            shape = lengths.get(name) or (1, *getattr(group, name).shape[1:])
            shape = getattr(group, name).shape if name in ROOM else shape
            self._arrays[name] = place, tuple(map(LONG, shape))
        if not group.sizes.settle:
            self._arrays["stroboscopic"] = kept, (LONG(1), LONG(0), LONG(0))
            self._arrays["agreements"] = kept, (LONG(1), LONG(0))
        work = group.work
        size = LONG(work.states.shape[1])
        numbers = LONG(work.parameters.shape[1])
        one = LONG(1)
        self._of_motion("states", motion, (size,))
        self._of_motion("jobs", motion, (), JOB.itemsize // WORD)
        self._of_motion("parameters", motion, (numbers,))
        self._of_motion("last", motion, (size,))
        self._of_motion("ends", motion, (), END.itemsize // WORD)
        self._of_motion("rates", motion, (LONG(work.rates.shape[1]),))
        self._of_motion(
            "samples", motion, (self._words["samples_kept"], LONG(work.samples.shape[2]))
        )
        alone = b.icmp_signed("==", self._words["records"], one)
        row = b.select(alone, LONG(0), motion)
        pieces = self._words["pieces"]
        self._of_motion("breaks", row, (pieces,), name="work.tables.0")
        shape = (LONG(group.sizes.records), b.add(pieces, one), LONG(work.tables[1].shape[3]))
        self._of_motion("table", row, shape, name="work.tables.1")

    def _of_motion(
        self, word: str, row: Any, shape: tuple[Any, ...], words: int = 1, name: str = ""
    ) -> None:
        """Name the row of an array of the request as an array of one row."""
        b = self._builder
        size = LONG(words)
        for length in shape:
            size = b.mul(size, length)
        first = b.inttoptr(self._words[word], LONG.as_pointer())
        self._arrays[name or f"work.{word}"] = b.gep(first, [b.mul(row, size)]), (LONG(1), *shape)

    # --- the group -----------------------------------------------------------

    def _value(self, kind: Any, given: Any, path: tuple[str, ...]) -> Any:
        """LLVM's value of a part of the group."""
        b = self._builder
        if hasattr(kind, "types"):
            fields = getattr(kind, "fields", None) or tuple(map(str, range(len(kind))))
            made = ir.Constant(value_type(kind), ir.Undefined)
            for i, (name, each) in enumerate(zip(fields, kind.types, strict=True)):
                made = b.insert_value(made, self._value(each, given[i], (*path, name)), i)
            return made
        if isinstance(kind, types.Array):
            return self._array(kind, given, ".".join(path))
        if isinstance(kind, types.Float):
            settings = b.inttoptr(self._words["settings"], DOUBLE.as_pointer())
            return b.load(b.gep(settings, [LONG(next(self._setting))]))
        if isinstance(kind, types.Integer):
            return self._words["samples_kept"] if path == ("sizes", "kept") else LONG(int(given))
        if kind == types.none:
            return ir.Constant(value_type(kind), ir.Undefined)
        return b.ptrtoint(self._functions[self._function(path)], LONG)

    def _array(self, kind: Any, given: np.ndarray, name: str) -> Any:
        """LLVM's value of an array as numba has it: its lengths, and what follows from them."""
        b = self._builder
        place, shape = self._arrays.get(name) or self._constants(given, name)
        llvm = value_type(kind)
        size = kind.dtype.size if isinstance(kind.dtype, types.Record) else WORD
        strides = [LONG(size)]
        for length in reversed(shape):
            strides.insert(0, b.mul(strides[0], length))
        made = ir.Constant(llvm, ir.Undefined)
        nothing = [ir.Constant(llvm.elements[i], None) for i in range(2)]
        items = b.sdiv(strides[0], LONG(size))
        data = b.bitcast(place, llvm.elements[4])
        for i, part in enumerate((*nothing, items, LONG(size), data)):
            made = b.insert_value(made, part, i)
        for i, (length, stride) in enumerate(zip(shape, strides[1:], strict=True)):
            made = b.insert_value(made, length, [5, i])
            made = b.insert_value(made, stride, [6, i])
        return made

    def _constants(self, given: np.ndarray, name: str) -> tuple[Any, tuple[Any, ...]]:
        """An array of whole numbers that a structure fixes, as a constant of the text."""
        numbers = np.ascontiguousarray(given, dtype=np.int64).ravel().tolist() or [0]
        kind = ir.ArrayType(LONG, len(numbers))
        table = ir.GlobalVariable(self._module, kind, f"numbers.{name}")
        table.linkage = "internal"
        table.global_constant = True
        table.initializer = ir.Constant(kind, numbers)
        return table, tuple(map(LONG, given.shape))

    def _function(self, path: tuple[str, ...]) -> str:
        """The name of the function at a place in the group."""
        part, *inner = path
        names = NAMES[part]
        if part == "kernel":
            return names[0] if inner == ["0"] else names[1 + int(inner[1])]
        fields = (Code if part == "code" else Helpers)._fields
        return names[fields.index(inner[0])]
