"""The memory of a thread, and LLVM's text of the function that gives it to the lanes' driver.

The driver takes a `LaneGroup` (`lane_steps/memory.py`). What a structure and a call fix in it (sizes,
the functions, the places of the parts) are constants of the text. So LLVM removes what a structure
does not have, and calls through addresses become code. What moves is in the thread's own memory;
what a motion keeps from one launch to the next is a row of `kept`, and everything else is an array
that a `Request` names.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types

from saltus.flow.lane_steps.memory import END, FLAGS, JOB, ROW, Code, Control, Helpers, LaneGroup
from saltus.taylor.lane_memory import LanesType
from saltus.taylor.private_numba import value_type
from saltus.taylor.vectors import DOUBLE, INDEX, LONG

WORD = 8  # bytes
CODE = ("lane_series", "lane_impact", "lane_field", "constants")
HELPERS = ("first_root_of", "turning_range", "scalar_motion")
NONE = ""  # no function
ONE_CONTACT = {  # the functions in the text by their places in the group
    "code": (*CODE, "geometry", NONE),
    "helpers": (*HELPERS, NONE, "advance"),
    "kernel": ("series", "contact_series", "reset", "contact_damping", "tangent"),
}
SEVERAL = {
    "code": (*CODE, "matrices", "lane_one_free"),
    "helpers": (*HELPERS, "contacts_impact", "advance"),
    "kernel": ("series", "matrices", "matrix_slopes", "tangent", "load_series"),
}
# A motion keeps nothing of these from one launch to the next.
ROOM = ("polynomial", "gap", "impact_space")


class Request(NamedTuple):
    """What a launch is asked for: words of 8 bytes, of which most are addresses of arrays."""

    count: Any  # motions that go on
    going: Any  # their numbers
    flags: Any  # of each motion, and the calls of the scalar kernel in its last launch
    kept: Any  # the rows of all motions, see `kept_fields`
    first_row: Any  # of a motion that begins
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
KEPT = ("constants_of", "geometry", "contact_rows")


def kept_fields(group: LaneGroup, series_at: int) -> dict[str, int]:
    """The arrays of a group that a motion keeps from one launch to the next besides its flags, and
    their words; of the memory, its slots before the series.
    """
    names = [*KEPT, *["stroboscopic", "agreements"] * group.sizes.settle]
    sizes = {name: getattr(group, name)[0].size for name in names}
    return {"memory": series_at, "rows": ROW.itemsize // WORD} | sizes


def first_row(group: LaneGroup, fields: dict[str, int]) -> np.ndarray:
    """What a motion keeps (`kept_fields`) before its first launch."""
    row = np.zeros(sum(fields.values()), dtype=np.int64)
    at = 0
    for name, size in fields.items():
        if name in KEPT:
            row[at : at + size] = _words_of(getattr(group, name)[0])
        at += size
    return row


def _words_of(array: np.ndarray) -> np.ndarray:
    """The numbers of an array as words."""
    return np.ascontiguousarray(array).ravel().view(np.int64)


def _arrays(value: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """The arrays in a field of a group, by their names."""
    if isinstance(value, np.ndarray):
        yield name, value
    elif isinstance(value, tuple):
        names = getattr(value, "_fields", None) or map(str, range(len(value)))
        for inner, part in zip(names, value, strict=True):
            yield from _arrays(part, f"{name}.{inner}")


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
        self.first_row = first_row(group, self.fields)
        self._end = end
        self._module = ir.Module("thread")
        self._builder: Any = None
        self._request: Any = None
        self._words: dict[str, Any] = {}
        self._arrays: dict[str, tuple[Any, tuple[Any, ...]]] = {}
        self._setting = count()
        several = group.impact_space is not None
        self._spaces = {
            name: array for field in ROOM for name, array in _arrays(getattr(group, field), field)
        }
        self._names = SEVERAL if several else ONE_CONTACT
        names = dict.fromkeys(
            name for part in self._names.values() for name in part if name != NONE
        )
        self._functions = {
            name: ir.Function(self._module, ir.FunctionType(ir.VoidType(), []), name)
            for name in names
        }
        self._kind = LanesType.tuples[
            f"lanes of {'several contacts' if several else 'one contact'}"
        ]
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
        room = {
            name: b.alloca(ir.ArrayType(LONG, max(1, array.nbytes // WORD)))
            for name, array in self._spaces.items()
        }
        control = b.alloca(ir.ArrayType(LONG, len(Control)))
        b.call(ir.Function(self._module, ir.FunctionType(ir.VoidType(), []), "begin_arena"), [])
        for name, place in room.items():
            self._clear(place, self._spaces[name].nbytes)
        b.branch(head)
        b.position_at_end(head)
        turn = b.phi(LONG)
        turn.add_incoming(first, entry)
        b.cbranch(b.icmp_signed("<", turn, self._words["count"]), body, end)
        b.position_at_end(body)
        going = b.inttoptr(self._words["going"], words)
        motion = b.load(b.gep(going, [turn]))
        kept = b.gep(
            b.inttoptr(self._words["kept"], words), [b.mul(motion, LONG(self.first_row.size))]
        )
        flags = b.gep(
            b.inttoptr(self._words["flags"], words), [b.mul(motion, LONG(FLAG_WORDS + 1))]
        )
        with b.if_then(b.icmp_signed("==", b.load(flags), LONG(0))):  # it holds no motion yet
            self._begin(kept)
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

    def _begin(self, kept: Any) -> None:
        """Fill what a motion keeps before its first launch."""
        b = self._builder
        given = b.inttoptr(self._words["first_row"], LONG.as_pointer())
        self._clear(kept, WORD * self.first_row.size)
        at = 0
        for name, size in self.fields.items():
            if name in KEPT:
                start = b.gep(given, [LONG(at)]), b.gep(kept, [LONG(at)])
                self._copy([(*start, size)])
            at += size

    def _clear(self, place: Any, size: int) -> None:
        """Fill so many bytes with zeros."""
        b = self._builder
        kinds = [LONG.as_pointer(), ir.IntType(8), LONG, ir.IntType(1)]
        clear = self._module.globals.get("zero_words") or ir.Function(
            self._module, ir.FunctionType(ir.VoidType(), kinds), "zero_words"
        )
        first = _word(b, place, 0)
        b.call(clear, [first, kinds[1](0), LONG(size), kinds[3](0)])

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
            if name in self._spaces:
                shape = self._spaces[name].shape
            else:
                shape = lengths.get(name) or (1, *getattr(group, name).shape[1:])
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
        """An array of numbers that a structure fixes, as a constant of the text."""
        numbers = _words_of(given).tolist() or [0]
        kind = ir.ArrayType(LONG, len(numbers))
        table = ir.GlobalVariable(self._module, kind, f"numbers.{name}")
        table.linkage = "internal"
        table.global_constant = True
        table.initializer = ir.Constant(kind, numbers)
        return table, tuple(map(LONG, given.shape))

    def _function(self, path: tuple[str, ...]) -> str:
        """The name of the function at a place in the group."""
        part, *inner = path
        names = self._names[part]
        if part == "code":
            return names[Code._fields.index(inner[0])]
        if part == "helpers":
            return names[Helpers._fields.index(inner[0])]
        return inner[1] if inner[1] in names else names[int(inner[1])]
