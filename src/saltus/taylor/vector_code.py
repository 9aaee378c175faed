"""LLVM's code for tapes at one instant: every node of a trace a vector register (see `emit.py`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from llvmlite import ir

from saltus.taylor.memory_layout import LaneSlot
from saltus.taylor.tracing import RECORD_WIDTH
from saltus.taylor.vectors import LONG, VECTOR, WIDTH, Vec, slot_pointer

if TYPE_CHECKING:
    from saltus.taylor.vector_functions import Slots

Tape = list[tuple[Any, ...]]


class Writer:
    """Writes LLVM's code for tapes on the memory of a group of lanes."""

    def __init__(self, slots: Slots, context: Any, builder: Any, array_type: Any, array: Any, fused: bool = True) -> None:
        self.at, self.builder, self.fused = slots.places, builder, fused
        self._base = slot_pointer(context, builder, array_type, array, ir.Constant(LONG, 0))

    def pointer(self, slot: int) -> Any:
        """LLVM's pointer to a slot."""
        return self.builder.gep(self._base, [ir.Constant(LONG, slot)])

    def load(self, slot: int) -> Vec:
        """The vector in a slot."""
        loaded = self.builder.load(self.pointer(slot))
        loaded.align = 8
        return Vec(self.builder, loaded, self.fused)

    def store(self, slot: int, vector: Vec | float) -> None:
        """Put a vector, or one number, into a slot."""
        value = vector.value if isinstance(vector, Vec) else ir.Constant(VECTOR, [vector] * VECTOR.count)
        self.builder.store(value, self.pointer(slot)).align = 8

    def known(self, node: tuple[Any, ...]) -> Vec | float | None:
        """A leaf that does not change along a step: a number, a parameter, a constant, the side, the time's origin."""
        if node[0] == "number":
            return float(node[1])
        if node[0] in ("parameter", "constant"):
            return self.load(self.at[f"{node[0]}s"] + node[1])
        return {"side": self.load, "origin": self.load}[node[0]](LaneSlot.SIDE if node[0] == "side" else LaneSlot.ORIGIN)

    def instant(self, nodes: Tape) -> list[Any]:
        """The values of all nodes at the new time, with the new positions and velocities."""
        values: list[Any] = []
        for node in nodes:
            op, where = node[0], node[1] if len(node) > 1 else 0
            if op == "time":
                values.append(self.load(LaneSlot.NEW_TIME))
            elif op in ("coordinate", "velocity"):
                name = "new_position" if op == "coordinate" else "new_velocity"
                values.append(self.load(self.at[name] + where))
            elif op == "record":
                values.append(self._record(where))
            elif len(node) < 2 or op in ("number", "parameter", "constant"):
                values.append(self.known(node))
            else:
                values.append(operation(op, [values[i] for i in node[1:]], self.number))
        return values

    def number(self, value: float) -> Vec:
        """One number in all lanes."""
        return Vec(self.builder, ir.Constant(VECTOR, [value] * WIDTH), self.fused)

    def _record(self, row: int) -> Vec:
        """A record's piece at the new time, from its expansion at the start of the step."""
        first = self.at["records"] + row * RECORD_WIDTH
        since, value = self.load(LaneSlot.NEW_TIME) - self.load(LaneSlot.NOW), self.load(first + RECORD_WIDTH - 1)
        for power in range(RECORD_WIDTH - 2, -1, -1):
            value = value.fma(since, self.load(first + power))
        return value


def operation(op: str, args: list[Any], splat: Callable[[float], Vec]) -> Any:
    """An operation at one instant, on vectors and numbers; comparisons give masks. `splat` makes a vector of a number."""
    a, b = args[0], args[-1]
    signs = {"greater": ">", "less": "<", "greater_equal": ">=", "less_equal": "<="}
    if op in ("add", "sub", "mul", "div"):
        return {"add": add, "sub": subtract, "mul": multiply, "div": lambda a, b: a / b}[op](a, b)
    if op in signs:
        return a.compare(signs[op], b) if isinstance(a, Vec) else b.compare(signs[op].translate(MIRRORED), a)
    if op == "where":
        return (args[1] if isinstance(args[1], Vec) else splat(args[1])).select(a, args[2])
    if op in ("maximum", "minimum"):
        a = a if isinstance(a, Vec) else splat(a)
        return a.select(a.compare(">" if op == "maximum" else "<", b), b)
    if op in ("sin", "cos"):
        return a.sin_cos()[op == "cos"]
    return a.sqrt() if op == "sqrt" else a.lane_by_lane(op, *args[1:])


MIRRORED = str.maketrans("<>", "><")


def add(a: Any, b: Any) -> Any:
    """a + b, where None is zero."""
    return b if a is None else a if b is None else a + b


def subtract(a: Any, b: Any) -> Any:
    """a - b, where None is zero."""
    return a if b is None else negative(b) if a is None else a - b


def negative(a: Any) -> Any:
    """-a, where None is zero."""
    return None if a is None else -a


def multiply(a: Any, b: Any) -> Any:
    """a b, where None is zero and a factor of one costs nothing."""
    if a is None or b is None:
        return None
    for x, y in ((a, b), (b, a)):
        if not isinstance(x, Vec) and x in (1.0, -1.0):
            return y if x == 1.0 else -y
    return a * b


def dot(pairs: list[tuple[Any, Any]], start: Any = None) -> Any:
    """start + the sum of the products; None stands for zero."""
    for a, b in pairs:
        if a is not None and b is not None:
            start = multiply(a, b) if start is None else (a.fma(b, start) if isinstance(a, Vec) else b.fma(a, start))
    return start
