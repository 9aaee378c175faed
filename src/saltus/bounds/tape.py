"""Expressions of the traced graph as tapes, on which the compiled ball arithmetic runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from types import ModuleType

import numpy as np

from saltus.bounds import ball_kernel
from saltus.bounds.ball_kernel import Op
from saltus.bounds.balls import Ball
from saltus.errors import TraceError
from saltus.taylor import Expr, compiled_part, load_module, number, ordered

# y' = z u' for y = f(u): the node z of each function whose series runs through another one.
PARTNERS: dict[str, Callable[[Expr, Expr], Expr]] = {
    "sin": lambda y, u: Expr("cos", (u,)),
    "cos": lambda y, u: Expr("sin", (u,)),
    "sinh": lambda y, u: Expr("cosh", (u,)),
    "cosh": lambda y, u: Expr("sinh", (u,)),
    "tanh": lambda y, u: number(1.0) - y * y,
    "atan": lambda y, u: number(1.0) / (number(1.0) + u * u),
}
_HEADER = f"""import math

import numpy as np

from saltus.taylor.private_numba import cached_jit, jit

BALL_STEPS = {ball_kernel.BALL_STEPS!r}
BALL_VALUES = {ball_kernel.BALL_VALUES!r}
BALL_SERIES = {ball_kernel.BALL_SERIES!r}
BALL_GAPS = {ball_kernel.BALL_GAPS!r}
"""


@cache
def load_balls() -> ModuleType:
    """The module of the compiled ball arithmetic."""
    return load_module("balls", _HEADER + compiled_part(ball_kernel))


class Tape:
    """The nodes of some expressions in the order in which they are computed.

    Raises
    ------
    TraceError
        A node that has no ball arithmetic, such as a record.
    """

    def __init__(self, roots: Sequence[Expr]) -> None:
        nodes = _with_partners(list(roots))
        place = {id(node): i for i, node in enumerate(nodes)}
        unknown = sorted({node.op for node in nodes} - {op.name.lower() for op in Op})
        if unknown:
            raise TraceError(f"there is no ball arithmetic for {', '.join(unknown)}")
        rows = [_row(node, place) for node in nodes]
        self.nodes = np.array(rows, dtype=np.int64).reshape(-1, 4)
        self.numbers = np.array(
            [float(node.value) if node.op == "number" else 0.0 for node in nodes]
        )
        constant: list[bool] = []
        for node in nodes:
            below = [constant[place[id(operand)]] for operand in node.args]
            constant.append(all(below) if below else node.op in ("number", "parameter"))
        self.constant = np.array(constant, dtype=np.bool_)
        self.roots = np.array([place[id(root)] for root in roots], dtype=np.int64)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The arguments with which the compiled functions begin."""
        return self.nodes, self.numbers, self.constant, self.roots

    def values(self, parameters: Ball, time: Ball, positions: Ball, velocities: Ball) -> Ball:
        """Balls of the roots at instants, (instants, roots).

        `parameters` are (instants, parameters), `time` (instants,), states (instants, coordinates).
        """
        middle, radius = load_balls().ball_values(
            *self.arrays,
            *_pair(parameters),
            *_pair(time),
            *_pair(positions),
            *_pair(velocities),
        )
        return Ball(middle, radius)


class Steps:
    """Validated steps, one after another or side by side.

    `coefficients` are those of all coordinates, that of the remainder last, (steps, coordinates,
    order + 2); `ends` their values, velocities and accelerations, (steps, coordinates, 3).
    """

    def __init__(
        self, tape: Tape, order: int, parameters: Ball, begin: Ball, length: Ball, state: Ball
    ) -> None:
        made = load_balls().ball_steps(
            *tape.arrays, order, *_pair(parameters), *_pair(begin), *_pair(length), *_pair(state)
        )
        self.proved = made[0]
        self.coefficients = Ball(made[1], made[2])
        self.ends = Ball(made[3], made[4])


def _with_partners(roots: list[Expr]) -> list[Expr]:
    """The nodes below some roots and below the partners of their functions."""
    partners: list[Expr] = []
    while True:
        nodes = ordered([*roots, *partners])
        inside = set(map(id, nodes))
        wanted = [PARTNERS[n.op](n, n.args[0]) for n in nodes if n.op in PARTNERS]
        missing = [partner for partner in wanted if id(partner) not in inside]
        if not missing:
            return nodes
        partners += missing


def _row(node: Expr, place: dict[int, int]) -> list[int]:
    """The operation and the operands of a node."""
    code = int(Op[node.op.upper()])
    operands = [place[id(operand)] for operand in node.args]
    if node.op in PARTNERS:
        operands.append(place[id(PARTNERS[node.op](node, node.args[0]))])
    elif node.op == "where":
        operands = [operands[1], operands[2], operands[0]]
    elif node.op in ("parameter", "coordinate", "velocity"):
        operands = [int(node.value)]
    return [code, *operands, *[-1] * (3 - len(operands))]


def _pair(ball: Ball) -> tuple[np.ndarray, np.ndarray]:
    return np.ascontiguousarray(ball.middle), np.ascontiguousarray(ball.radius)
