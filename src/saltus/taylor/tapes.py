"""Tapes: the nodes of expressions as a list, operands before the nodes that use them.

A node is a tuple of its operation and its operands' places on the tape, or of a leaf's kind and its index or value. In a tape
for series an elementary function names, besides its argument, the series of its slope and a factor of it (see `rules.py`). The
slope may come after the function on the tape, because only its coefficients of lower orders are needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from saltus.taylor.graph import Expr, ordered
from saltus.taylor.rules import FUNCTIONS

Node = tuple[Any, ...]
Constants = dict[Expr, int]


@dataclass(frozen=True)
class Tape:
    """Nodes, and the places of the roots among them."""

    nodes: list[Node]
    roots: list[int]


def shared_constants(roots: Sequence[Expr]) -> Constants:
    """The largest parts of the roots that depend on parameters alone; they are computed once for a motion and kept in a table."""
    fixed: dict[int, bool] = {}
    table: Constants = {}
    for node in ordered(list(roots)):
        fixed[id(node)] = all(fixed[id(a)] for a in node.args) if node.args else node.op in ("number", "parameter")
        if not fixed[id(node)]:
            _enter(table, [a for a in node.args if fixed[id(a)]])
    _enter(table, [root for root in roots if fixed[id(root)]])
    return table


def _enter(table: Constants, nodes: list[Expr]) -> None:
    for node in nodes:
        if node.args:
            table.setdefault(node, len(table))


def tape(roots: Sequence[Expr], known: Constants | None = None, series: bool = False) -> Tape:
    """The tape of the roots; parts that are in the table `known` are leaves of it. For series it has the slopes of functions
    too."""
    nodes: list[Node] = []
    place: dict[int, int] = {}
    known, waiting = known or {}, list(reversed(roots))
    while waiting:
        for node in _below(waiting.pop(), place, known):
            place[id(node)] = len(nodes)
            rule = FUNCTIONS.get(node.op)
            if node in known:
                nodes.append(("constant", known[node]))
            elif not node.args:
                nodes.append((node.op,) if node.value is None else (node.op, node.value))
            elif series and rule is not None and rule.recurrence is None and node.degree != 0:
                slope, factor = _factored(rule.slope(node.args[0], node))
                waiting.insert(0, slope)
                nodes.append((node.op, place[id(node.args[0])], slope, factor))
            else:
                nodes.append((node.op, *(place[id(a)] for a in node.args)))
    placed = [tuple(place[id(part)] if isinstance(part, Expr) else part for part in node) for node in nodes]
    return Tape(placed, [place[id(root)] for root in roots])


def _below(root: Expr, placed: dict[int, int], known: Constants) -> list[Expr]:
    """The nodes below a root that are not on the tape yet, operands first; parts that are known are leaves."""
    found: dict[int, Expr] = {}
    stack = [(root, False)]
    while stack:
        node, ready = stack.pop()
        if id(node) in placed or id(node) in found:
            continue
        if ready or node in known or not node.args:
            found[id(node)] = node
        else:
            stack.append((node, True))
            stack.extend((a, False) for a in reversed(node.args))
    return list(found.values())


def _factored(slope: Expr) -> tuple[Expr, float]:
    """A slope as a number times an expression that the tape may have anyway; for a cosine, -1 times the sine."""
    if slope.op == "mul" and slope.args[0].op == "number":
        return slope.args[1], slope.args[0].value
    return slope, 1.0
