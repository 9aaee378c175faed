"""The Taylor recurrences of `emit.py` on tapes, every coefficient a vector register (see `straight.py`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from saltus.flow.lanes.layout import NOW
from saltus.flow.lanes.vector import Vec
from saltus.flow.lanes.writer import Tape, Writer, add, dot, multiply, subtract
from saltus.flow.trace import RECORD_WIDTH


class Series(Writer):
    """The Taylor coefficients of all nodes of a tape, order by order; None stands for a coefficient that is zero."""

    def expand(self, nodes: Tape) -> list[list[Any]]:
        """An empty series for each node; coefficients are appended by `advance`."""
        self.nodes = nodes
        self.series: list[list[Any]] = [[] for _ in nodes]
        self.scaled: dict[int, list[Any]] = {}  # j u_j, for the functions of u
        self.inverse: dict[int, Vec] = {}  # 1 / u_0, for the quotients by u
        self.twin: dict[int, list[Any]] = {}  # cos beside sin, 1 - tanh^2 beside tanh
        self.positions: dict[int, list[Any]] = {}
        self.velocities: dict[int, list[Any]] = {}
        return self.series

    def advance(self, k: int) -> None:
        """Append coefficient k to every node's series."""
        for i, node in enumerate(self.nodes):
            op = node[0]
            if op in ("coordinate", "velocity"):
                self.series[i].append((self.positions if op == "coordinate" else self.velocities)[node[1]][k])
            elif op == "time":
                self.series[i].append(self.load(NOW) if k == 0 else 1.0 if k == 1 else None)
            elif op == "record":
                first = self.at["records"] + node[1] * RECORD_WIDTH
                self.series[i].append(self.load(first + k) if k < RECORD_WIDTH else None)
            elif op in ("number", "parameter", "constant", "side", "origin"):
                self.series[i].append(self.known(node) if k == 0 else None)
            elif all(len(self.series[j]) > k and self.series[j][k] is None for j in node[1:]) and self._still(node):
                self.series[i].append(None)
            else:
                self.series[i].append(RECURRENCES[op](self, i, node[1:], k))

    def _still(self, node: tuple[Any, ...]) -> bool:
        """Whether all operands have been constant from order 1 on, so that what is made of them is."""
        return all(all(c is None for c in self.series[j][1:]) for j in node[1:])

    def times_order(self, i: int, k: int) -> list[Any]:
        """j u_j for j = 0..k, of node i."""
        row = self.scaled.setdefault(i, [])
        while len(row) <= k:
            j = len(row)
            row.append(multiply(float(j), self.series[i][j]) if j else None)
        return row

    def by(self, i: int) -> Vec:
        """1 / u_0 of node i."""
        if i not in self.inverse:
            self.inverse[i] = 1.0 / self.series[i][0]
        return self.inverse[i]


def _product(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    a, b = w.series[args[0]], w.series[args[1]]
    if args[0] != args[1]:
        return dot([(a[j], b[k - j]) for j in range(k + 1)])
    half = dot([(a[j], a[k - j]) for j in range((k + 1) // 2)])  # a square: every product but the middle one occurs twice
    middle = a[k // 2] if k % 2 == 0 else None
    return dot([(middle, middle)], multiply(2.0, half))


def _quotient(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    a, b, d = w.series[args[0]], w.series[args[1]], w.series[i]
    below = dot([(b[j], d[k - j]) for j in range(1, k + 1)])
    above = subtract(a[k], below)
    bottom = b[0] if isinstance(b[0], Vec) else None
    return multiply(above, w.by(args[1]) if bottom is not None else 1.0 / b[0])


def _derivative(w: Series, u: int, other: list[Any], k: int) -> Any:
    """(1/k) sum_{j=1..k} j u_j other_{k-j}: a series whose derivative is u' times another one."""
    ju = w.times_order(u, k)
    return multiply(1.0 / k, dot([(ju[j], other[k - j]) for j in range(1, k + 1)]))


def _sine(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    """sin or cos of u: whichever comes first on the tape makes both."""
    op, u = w.nodes[i][0], args[0]
    known = w.twin.get(-1 - u)
    if known is None or len(known) <= k:
        s, c = w.twin.setdefault(u, []), w.twin.setdefault(-1 - u, [])
        if k == 0:
            first = w.series[u][0].sin_cos()
        else:
            cosine, sine = _derivative(w, u, c, k), _derivative(w, u, s, k)
            first = cosine, (None if sine is None else -sine)
        s.append(first[0])
        c.append(first[1])
    return (w.twin[u] if op == "sin" else w.twin[-1 - u])[k]


def _hyperbolic(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    """sinh or cosh of u, each with the other as its twin."""
    op, u = w.nodes[i][0], args[0]
    other = "cosh" if op == "sinh" else "sinh"
    twin = w.twin.setdefault(i, [])
    if k == 0:
        twin.append(w.series[u][0].lane_by_lane(other))
        return w.series[u][0].lane_by_lane(op)
    result, beside = _derivative(w, u, twin, k), _derivative(w, u, w.series[i], k)
    twin.append(beside)
    return result


def _exponential(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    return w.series[args[0]][0].lane_by_lane("exp") if k == 0 else _derivative(w, args[0], w.series[i], k)


def _hyperbolic_tangent(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    square = w.twin.setdefault(i, [])  # 1 - tanh^2
    if k == 0:
        value = w.series[args[0]][0].lane_by_lane("tanh")
        square.append(1.0 - value * value)
        return value
    value = _derivative(w, args[0], square, k)
    row = [*w.series[i], value]
    total = dot([(row[j], row[k - j]) for j in range(k + 1)])
    square.append(None if total is None else -total)
    return value


def _logarithm(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u = w.series[args[0]]
    if k == 0:
        return u[0].lane_by_lane("log")
    own = w.times_order(i, k - 1)
    below = multiply(1.0 / k, dot([(own[j], u[k - j]) for j in range(1, k)]))
    return multiply(subtract(u[k], below), w.by(args[0]))


def _square_root(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u, r = w.series[args[0]][k], w.series[i]
    if k == 0:
        return u.sqrt()
    above = subtract(u, dot([(r[j], r[k - j]) for j in range(1, k)]))
    return multiply(multiply(0.5, w.by(i)), above)


def _power(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u, p, r = w.series[args[0]], w.series[args[1]][0], w.series[i]
    if k == 0:
        return u[0].lane_by_lane("pow", p)
    terms = [(multiply(p * float(j) - float(k - j), u[j]), r[k - j]) for j in range(1, k + 1)]
    return multiply(multiply(1.0 / k, w.by(args[0])), dot(terms))


RECURRENCES: dict[str, Callable[[Series, int, Sequence[int], int], Any]] = {
    "add": lambda w, i, args, k: add(w.series[args[0]][k], w.series[args[1]][k]),
    "sub": lambda w, i, args, k: subtract(w.series[args[0]][k], w.series[args[1]][k]),
    "mul": _product,
    "div": _quotient,
    "sin": _sine,
    "cos": _sine,
    "sinh": _hyperbolic,
    "cosh": _hyperbolic,
    "tanh": _hyperbolic_tangent,
    "exp": _exponential,
    "log": _logarithm,
    "sqrt": _square_root,
    "pow": _power,
}
