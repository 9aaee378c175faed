"""From a trace to straight-line code for lanes: the Taylor recurrences of `emit.py`, every coefficient a vector register.

Loops over coefficients are unrolled while LLVM's instructions are written, one operation for all lanes at once; that makes
the series some twice as fast as loops, and it compiles in a second because numba sees three calls only. A trace reaches
the generated file as tapes: lists of nodes, operands before what uses them, each (operation, operands or value).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from saltus.flow.emit import Emitter
from saltus.flow.graph import Expr, substitute
from saltus.flow.lanes.layout import FIRST_PLACE, HIGHEST_ORDER, NEW_SIDE, NEW_TIME, NOW, ORIGIN, SIDE_NOW, STRIDE
from saltus.flow.lanes.vector import LONG, VECTOR, WIDTH, Vec, slot_pointer
from saltus.flow.tangent import saltation
from saltus.flow.trace import RECORD_WIDTH, Trace

LOWEST_ORDER = 8  # at which `lane_series` may end
Tape = list[tuple[Any, ...]]


@dataclass(frozen=True)
class Slots:
    """Where everything lies in the memory of a group of lanes, in slots of one vector (see `driver.py`)."""

    rows: int  # coordinates, those of the sensitivities included
    own: int  # the model's
    parameters: int
    constants: int
    records: int
    stops: int

    @property
    def places(self) -> dict[str, int]:
        """The first slot of each part, and the `end` of them all."""
        sizes = {
            "position": self.rows,
            "velocity": self.rows,
            "new_position": self.rows,
            "new_velocity": self.rows,
            "after_position": self.rows,
            "after_velocity": self.rows,
            "parameters": self.parameters,
            "constants": self.constants,
            "records": self.records * RECORD_WIDTH,
            "position_series": self.rows * STRIDE,
            "velocity_series": self.rows * STRIDE,
            "acceleration_series": self.own * STRIDE,
            "margin_series": self.stops * STRIDE,
        }
        places, slot = {}, FIRST_PLACE
        for name, size in sizes.items():
            places[name], slot = slot, slot + size
        return {**places, "end": slot}


# --- tapes -----------------------------------------------------------------------------------------------------------------


def tape(roots: Sequence[Expr], constants: dict[Expr, int]) -> tuple[Tape, list[int]]:
    """The nodes below the roots as a tape, and the places of the roots on it; what `constants` knows is not opened."""
    listed: Tape = []
    place: dict[int, int] = {}

    def visit(root: Expr) -> None:
        stack = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if id(node) in place:
                continue
            if node in constants:
                entry: tuple[Any, ...] = ("constant", constants[node])
            elif not node.args:
                entry = (node.op,) if node.value is None else (node.op, node.value)
            elif ready:
                entry = (node.op, *(place[id(a)] for a in node.args))
            else:
                stack.append((node, True))
                stack.extend((a, False) for a in reversed(node.args))
                continue
            place[id(node)] = len(listed)
            listed.append(entry)

    for root in roots:
        visit(root)
    return listed, [place[id(root)] for root in roots]


def source(trace: Trace, emitter: Emitter) -> str:
    """The functions of a structure for lanes; `emitter` has written its scalar ones and knows its constants."""
    rows = len(trace.acceleration)
    pulls = {Expr("acceleration", (), i): a for i, a in enumerate(trace.acceleration[: trace.dof])}
    margins = [substitute(margin, pulls) for margin in trace.margins.values()]
    slots = Slots(
        rows, trace.dof, max(1, len(trace.parameters)), max(1, len(emitter.constants)), len(trace.records), len(margins)
    )
    impact = [] if trace.next_side is None else [trace.next_side, *impact_roots(trace)]
    series = tape([*trace.acceleration, *margins], emitter.constants)
    reset = tape(impact, emitter.constants)
    acceleration = tape(trace.acceleration, emitter.constants)
    lines = [
        f"SLOTS = Slots{(slots.rows, slots.own, slots.parameters, slots.constants, slots.records, slots.stops)!r}",
        *(f"{name} = {_listing(*listed)}" for name, listed in (("SERIES", series), ("IMPACT", reset), ("FIELD", acceleration))),
        "_series, _impact, _field = write_series(SLOTS, *SERIES), write_impact(SLOTS, *IMPACT), write_field(SLOTS, *FIELD)",
    ]
    for name, arguments in (("series", "m, order"), ("impact", "m"), ("field", "m")):
        lines += ["", "", f"@cached_jit(LANE_{name.upper()})", f"def lane_{name}({arguments}):", f"    _{name}({arguments})"]
    return "\n".join([*lines, ""])


def impact_roots(trace: Trace) -> list[Expr]:
    """Positions and velocities after an impact in terms of those before it, with those of the tangent's columns."""
    assert trace.contact is not None
    assert trace.velocity_after is not None
    if not trace.columns:
        return [trace.contact, trace.velocity_after]
    jumps = saltation(trace)
    return [trace.contact, *jumps.coordinate, trace.velocity_after, *jumps.velocity]


def _listing(nodes: Tape, roots: list[int]) -> str:
    body = "".join(f"    {node!r},\n".replace("nan", "float('nan')") for node in nodes)
    return f"([\n{body}], {roots!r})"


# --- one instant -----------------------------------------------------------------------------------------------------------


class Writer:
    """Writes LLVM's code for tapes on the memory of a group of lanes."""

    def __init__(self, slots: Slots, context: Any, builder: Any, array_type: Any, array: Any, fused: bool = True) -> None:
        self.at, self.builder, self.fused = slots.places, builder, fused
        self._base = slot_pointer(context, builder, array_type, array, ir.Constant(LONG, 0))

    def load(self, slot: int) -> Vec:
        """The vector in a slot."""
        loaded = self.builder.load(self.builder.gep(self._base, [ir.Constant(LONG, slot)]))
        loaded.align = 8
        return Vec(self.builder, loaded, self.fused)

    def store(self, slot: int, vector: Vec | float) -> None:
        """Put a vector, or one number, into a slot."""
        value = vector.value if isinstance(vector, Vec) else ir.Constant(VECTOR, [vector] * VECTOR.count)
        self.builder.store(value, self.builder.gep(self._base, [ir.Constant(LONG, slot)])).align = 8

    def known(self, node: tuple[Any, ...]) -> Vec | float | None:
        """A leaf that does not change along a step: a number, a parameter, a constant, the side, the time's origin."""
        if node[0] == "number":
            return float(node[1])
        if node[0] in ("parameter", "constant"):
            return self.load(self.at[f"{node[0]}s"] + node[1])
        return {"side": self.load, "origin": self.load}[node[0]](SIDE_NOW if node[0] == "side" else ORIGIN)

    def instant(self, nodes: Tape) -> list[Any]:
        """The values of all nodes at the new time, with the new positions and velocities."""
        values: list[Any] = []
        for node in nodes:
            op, where = node[0], node[1] if len(node) > 1 else 0
            if op == "time":
                values.append(self.load(NEW_TIME))
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
        since, value = self.load(NEW_TIME) - self.load(NOW), self.load(first + RECORD_WIDTH - 1)
        for power in range(RECORD_WIDTH - 2, -1, -1):
            value = value.fma(since, self.load(first + power))
        return value


def operation(op: str, args: list[Any], splat: Callable[[float], Vec]) -> Any:
    """An operation at one instant, on vectors and numbers; comparisons give masks. `splat` makes a vector of a number."""
    a, b = args[0], args[-1]
    signs = {"greater": ">", "less": "<", "greater_equal": ">=", "less_equal": "<="}
    if op in ("add", "sub", "mul", "div"):
        return {"add": _add, "sub": _subtract, "mul": _multiply, "div": lambda a, b: a / b}[op](a, b)
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


def _add(a: Any, b: Any) -> Any:
    return b if a is None else a if b is None else a + b


def _subtract(a: Any, b: Any) -> Any:
    return a if b is None else -b if a is None else a - b


def _multiply(a: Any, b: Any) -> Any:
    if a is None or b is None:
        return None
    for x, y in ((a, b), (b, a)):
        if not isinstance(x, Vec) and x in (1.0, -1.0):
            return y if x == 1.0 else -y
    return a * b


def _dot(pairs: list[tuple[Any, Any]], start: Any = None) -> Any:
    """start + the sum of the products; None stands for zero."""
    for a, b in pairs:
        if a is not None and b is not None:
            start = _multiply(a, b) if start is None else (a.fma(b, start) if isinstance(a, Vec) else b.fma(a, start))
    return start


# --- series ----------------------------------------------------------------------------------------------------------------


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
            row.append(_multiply(float(j), self.series[i][j]) if j else None)
        return row

    def by(self, i: int) -> Vec:
        """1 / u_0 of node i."""
        if i not in self.inverse:
            self.inverse[i] = 1.0 / self.series[i][0]
        return self.inverse[i]


def _product(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    a, b = w.series[args[0]], w.series[args[1]]
    if args[0] != args[1]:
        return _dot([(a[j], b[k - j]) for j in range(k + 1)])
    half = _dot([(a[j], a[k - j]) for j in range((k + 1) // 2)])  # a square: every product but the middle one occurs twice
    middle = a[k // 2] if k % 2 == 0 else None
    return _dot([(middle, middle)], _multiply(2.0, half))


def _quotient(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    a, b, d = w.series[args[0]], w.series[args[1]], w.series[i]
    below = _dot([(b[j], d[k - j]) for j in range(1, k + 1)])
    above = _subtract(a[k], below)
    bottom = b[0] if isinstance(b[0], Vec) else None
    return _multiply(above, w.by(args[1]) if bottom is not None else 1.0 / b[0])


def _derivative(w: Series, u: int, other: list[Any], k: int) -> Any:
    """(1/k) sum_{j=1..k} j u_j other_{k-j}: a series whose derivative is u' times another one."""
    ju = w.times_order(u, k)
    return _multiply(1.0 / k, _dot([(ju[j], other[k - j]) for j in range(1, k + 1)]))


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
    total = _dot([(row[j], row[k - j]) for j in range(k + 1)])
    square.append(None if total is None else -total)
    return value


def _logarithm(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u = w.series[args[0]]
    if k == 0:
        return u[0].lane_by_lane("log")
    own = w.times_order(i, k - 1)
    below = _multiply(1.0 / k, _dot([(own[j], u[k - j]) for j in range(1, k)]))
    return _multiply(_subtract(u[k], below), w.by(args[0]))


def _square_root(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u, r = w.series[args[0]][k], w.series[i]
    if k == 0:
        return u.sqrt()
    above = _subtract(u, _dot([(r[j], r[k - j]) for j in range(1, k)]))
    return _multiply(_multiply(0.5, w.by(i)), above)


def _power(w: Series, i: int, args: Sequence[int], k: int) -> Any:
    u, p, r = w.series[args[0]], w.series[args[1]][0], w.series[i]
    if k == 0:
        return u[0].lane_by_lane("pow", p)
    terms = [(_multiply(p * float(j) - float(k - j), u[j]), r[k - j]) for j in range(1, k + 1)]
    return _multiply(_multiply(1.0 / k, w.by(args[0])), _dot(terms))


RECURRENCES: dict[str, Callable[[Series, int, Sequence[int], int], Any]] = {
    "add": lambda w, i, args, k: _add(w.series[args[0]][k], w.series[args[1]][k]),
    "sub": lambda w, i, args, k: _subtract(w.series[args[0]][k], w.series[args[1]][k]),
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


# --- the three functions ------------------------------------------------------------------------------------------------------


def write_series(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_series(m, order)`: the series of positions and velocities from the state, and of the margins.

    Coefficients 0..order of positions and velocities, 0..order - 1 of the margins; order 1, or LOWEST_ORDER to HIGHEST_ORDER.
    """

    @intrinsic
    def series(typing: Any, m: Any, order: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            w = Series(slots, context, builder, signature.args[0], args[0])
            end = builder.append_basic_block("end")
            _write_orders(w, slots, nodes, roots, args[1], end)
            builder.branch(end)
            builder.position_at_end(end)
            return context.get_dummy_value()

        return types.void(m, types.int64), code

    return series


def _write_orders(w: Series, slots: Slots, nodes: Tape, roots: list[int], order: Any, end: Any) -> None:
    w.expand(nodes)
    for row in range(slots.rows):
        w.positions[row] = [w.load(w.at["position"] + row)]
        w.velocities[row] = [w.load(w.at["velocity"] + row)]
        w.store(w.at["position_series"] + row * STRIDE, w.positions[row][0])
        w.store(w.at["velocity_series"] + row * STRIDE, w.velocities[row][0])
    for k in range(HIGHEST_ORDER):
        w.advance(k)
        for row in range(slots.rows):
            q, v = w.positions[row], w.velocities[row]
            q.append(_multiply(1.0 / (k + 1), v[k]))
            v.append(_multiply(1.0 / (k + 1), w.series[roots[row]][k]))
            for name, value in (("position_series", q[k + 1]), ("velocity_series", v[k + 1])):
                w.store(w.at[name] + row * STRIDE + k + 1, 0.0 if value is None else value)
            if row < slots.own:
                pull = w.series[roots[row]][k]
                w.store(w.at["acceleration_series"] + row * STRIDE + k, 0.0 if pull is None else pull)
        for stop, root in enumerate(roots[slots.rows :]):
            value = w.series[root][k]
            w.store(w.at["margin_series"] + stop * STRIDE + k, 0.0 if value is None else value)
        if k + 1 == 1 or LOWEST_ORDER <= k + 1 < HIGHEST_ORDER:
            following = w.builder.append_basic_block(f"order{k + 2}")
            reached = w.builder.icmp_signed("==", order, ir.Constant(LONG, k + 1))
            w.builder.cbranch(reached, end, following)
            w.builder.position_at_end(following)


def write_impact(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_impact(m)`: the side, positions and velocities after an impact at the new state."""
    places = slots.places
    targets = [
        NEW_SIDE,
        *range(places["after_position"], places["after_position"] + slots.rows),
        *range(places["after_velocity"], places["after_velocity"] + slots.rows),
    ]
    return _write_instant(slots, nodes, list(zip(targets, roots, strict=False)))


def write_field(slots: Slots, nodes: Tape, roots: list[int]) -> Any:
    """Compiled code for `lane_field(m)`: the accelerations at the new state, put where velocities after an impact would be."""
    first = slots.places["after_velocity"]
    return _write_instant(slots, nodes, [(first + row, root) for row, root in enumerate(roots)])


def _write_instant(slots: Slots, nodes: Tape, stores: list[tuple[int, int]]) -> Any:
    @intrinsic
    def instant(typing: Any, m: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            w = Writer(slots, context, builder, signature.args[0], args[0], fused=False)
            values = w.instant(nodes)
            for slot, root in stores:
                w.store(slot, values[root])
            return context.get_dummy_value()

        return types.void(m), code

    return instant
