"""LLVM's code for tapes at one instant: each node a number, or a vector of numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.taylor.graph import LEAVES
from saltus.taylor.memory import Memory
from saltus.taylor.rules import FUNCTIONS
from saltus.taylor.tapes import Tape
from saltus.taylor.vectors import Vec, add, multiply, subtract

ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {"add": add, "sub": subtract, "mul": multiply, "div": lambda a, b: a / b}
SIGNS = {"greater": ">", "less": "<", "greater_equal": ">=", "less_equal": "<="}
MIRRORED = str.maketrans("<>", "><")


def instant(memory: Memory, tape: Tape) -> list[Vec | float]:
    """The roots' numbers at the time and state that the leaves have."""
    values: list[Any] = []
    for node in tape.nodes:
        if node[0] in (*LEAVES, "constant"):
            values.append(memory.leaf(node))
        else:
            values.append(_operation(memory, node[0], [values[i] for i in node[1:]]))
    return [values[root] for root in tape.roots]


def _operation(memory: Memory, op: str, args: list[Any]) -> Any:
    """An operation on numbers; comparisons give masks."""

    def lifted(x: Any) -> Vec:
        return x if isinstance(x, Vec) else memory.arithmetic.number(memory.builder, x)

    a, b = args[0], args[-1]
    if op in ARITHMETIC:
        return ARITHMETIC[op](a, b)
    if op in SIGNS:
        return a.compare(SIGNS[op], b) if isinstance(a, Vec) else b.compare(SIGNS[op].translate(MIRRORED), a)
    if op == "where":
        return lifted(args[1]).select(a, b)
    if op in ("maximum", "minimum"):
        return lifted(b).select(lifted(b).compare(">" if op == "maximum" else "<", a), a)
    assert op in FUNCTIONS or op == "pow"
    return lifted(a).function(op, *args[1:])
