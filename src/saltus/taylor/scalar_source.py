"""From a trace to the source of its kernel: Taylor recurrences and the contact's functions, as plain loops, see `lowered.py`.

A node of degree 0 in the time is a scalar; every other node is a row of the workspace `w`, whose column k is its k-th Taylor
coefficient. With u = sum u_k tau^k the recurrences are the classical ones, each from the differential equation that its
function obeys; for instance s = sin u, c = cos u: k s_k = sum_{j=1..k} j u_j c_{k-j}, k c_k = -sum_{j=1..k} j u_j s_{k-j}.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from saltus.taylor.event_derivatives import tangent_source
from saltus.taylor.graph import Expr, ordered, substitute
from saltus.taylor.tracing import Trace

CONTEXT = "env, piece"  # what every generated function may read: parameters, constants, records and their current piece
UNPACK = "    p, c, breaks, table = env"
INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**"}
COMPARE = {"greater": ">", "less": "<", "greater_equal": ">=", "less_equal": "<="}
STEEP = ("exp", "sinh", "cosh", "tanh")  # may bend sharply far from where they are expanded, below rounding there
PAIRS = {"sin": "cos", "cos": "sin", "sinh": "cosh", "cosh": "sinh"}


class Emitter:
    """The source of the functions that one trace needs; `source()` is deterministic, so its text is the structure's key."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.constants: dict[Expr, int] = {}
        self.most_rows = 1

    def source(self) -> str:
        """`series`, `contact_series`, `reset`, `contact_damping`, `tangent`, `geometry` and `constants`, and their sizes."""
        trace = self.trace
        functions = [
            self._series(),
            self._contact_series(),
            self._pointwise("RESET", "reset", "t, origin, v0, side", [trace.next_side, trace.velocity_after]),
            self._pointwise("CONTACT_DAMPING", "contact_damping", "t, origin, side", [trace.contact_damping]),
            tangent_source(self),
            self._geometry(),
        ]
        sizes = {
            "DOF": len(trace.acceleration),
            "OWN": trace.dof,
            "COLUMNS": trace.columns,
            "STOPS": len(trace.margins),
            "ROWS": self.most_rows,
            "SIDES": trace.sides,
            "STEEP": int(any(n.op in STEEP and n.degree is None for n in ordered(trace.acceleration))),
            "CONSTANT_COUNT": max(1, len(self.constants)),
        }
        head = [f"{name} = {value!r}" for name, value in sizes.items()]
        return "\n".join([*head, "", "", *functions, self._constants()])

    # --- scalars -------------------------------------------------------------------------------------------------------

    def _is_constant(self, node: Expr) -> bool:
        return node.degree == 0 and not any(n.op in ("side", "origin") for n in ordered([node]))

    def _constants(self) -> str:
        """The function that fills the table `c` from the parameters `p`, once for a motion."""
        names = {node: f"c[{i}]" for node, i in self.constants.items()}
        lines = ["@lowered_jit(CONSTANTS, fused=False, python=True)", "def constants(p, c):"]
        for node in ordered(list(self.constants)):
            if node.op in ("number", "parameter"):
                continue
            if node not in names:  # an operand of a constant that nothing else needs
                names[node] = f"x{len(names)}"
            lines.append(f"    {names[node]} = {_scalar(node, lambda n: names.get(n) or _leaf(n))}")
        return "\n".join([*lines, "    return", ""])

    def _constant(self, node: Expr) -> str:
        if node.op in ("number", "parameter"):
            return _leaf(node)
        return f"c[{self.constants.setdefault(node, len(self.constants))}]"

    def _geometry(self) -> str:
        """The function that gives the coordinate at contact and the gap's rate there on both sides."""
        point, rate = self.trace.contact, self.trace.gap_rate
        lines = ["@lowered_jit(GEOMETRY, python=True)", "def geometry(env, out):", UNPACK]
        if point is not None and rate is not None:
            sides = [substitute(rate, {Expr("side"): s}) for s in (1.0, -1.0)]
            lines += [f"    out[{i}] = {self._constant(root)}" for i, root in enumerate([point, *sides])]
        return "\n".join([*lines, "", ""])

    def _pointwise(self, signature: str, name: str, arguments: str, roots: list[Expr | None]) -> str:
        """A function of one instant that returns the values of `roots`."""
        decorator = f"@lowered_jit({signature}, fused=False)"
        head = f"def {name}({arguments + ', ' if arguments else ''}{CONTEXT}):"
        if roots[0] is None:
            return "\n".join([decorator, head, f"    return {', '.join(['0.0'] * len(roots))}", "", ""])
        lines, results = self.statements([r for r in roots if r is not None], lambda node: f"{node.op[0].replace('c', 'q')}0")
        return "\n".join([decorator, head, UNPACK, *(f"    {x}" for x in lines), f"    return {', '.join(results)}", "", ""])

    def statements(self, roots: list[Expr], place: Callable[[Expr], str], first: int = 0) -> tuple[list[str], list[str]]:
        """What computes `roots` at one instant, and their values' texts; `place` is the text of a coordinate or a velocity.

        The names of its statements are numbered from `first`: numba is slow where a name is used twice.
        """
        names: dict[Expr, str] = {}

        def ref(node: Expr) -> str:
            if self._is_constant(node):
                return self._constant(node)
            return place(node) if node.op in ("coordinate", "velocity") else names.get(node) or _leaf(node)

        lines = []
        for node in ordered(roots):
            if not self._is_constant(node) and node.args:
                names[node] = f"x{first + len(names)}"
                lines.append(f"{names[node]} = {_scalar(node, ref)}")
        return lines, [ref(root) for root in roots]

    # --- series --------------------------------------------------------------------------------------------------------

    def _series(self) -> str:
        """The Taylor coefficients of the coordinates, velocities, accelerations, the gap and the margins from one state."""
        trace = self.trace
        writer = _SeriesWriter(self)
        others = [*([trace.gap] if trace.gap is not None else []), *trace.margins.values()]
        writer.plan([*trace.acceleration, *others])
        for root in trace.acceleration:
            writer.add(root)
        for i, root in enumerate(trace.acceleration):
            writer.store(f"a[{i}, k]", root)
        for root in others:
            writer.add(root)
        if trace.gap is not None:
            writer.store("g[k]", trace.gap)
        for j, margin in enumerate(trace.margins.values()):
            writer.store(f"m[{j}, k]", margin)
        for i in range(len(trace.acceleration)):
            writer.both(f"q[{i}, k + 1] = v[{i}, k] / (k + 1)")
            writer.both(f"v[{i}, k + 1] = a[{i}, k] / (k + 1)")
        return writer.function("SERIES", f"def series(t, origin, side, {CONTEXT}, q, v, a, g, m, w, order):")

    def _contact_series(self) -> str:
        """The Taylor coefficients in the time of the gap's second derivative at rest at contact."""
        writer = _SeriesWriter(self)
        root = self.trace.contact_acceleration
        if root is not None:
            writer.plan([root])
            writer.add(root)
            writer.store("b[k]", root)
        return writer.function("CONTACT_SERIES", f"def contact_series(t, origin, side, {CONTEXT}, b, w, order):")


class _SeriesWriter:
    """Collects the statements of one series: scalars first, then the coefficient 0 of every row, then the recurrences."""

    def __init__(self, emitter: Emitter) -> None:
        self.emitter = emitter
        self.scalars: list[str] = []
        self.first: list[str] = []
        self.later: list[str] = []
        self.names: dict[Expr, str] = {}
        self.rows = 0
        self.convolved: set[Expr] = set()  # nodes whose earlier coefficients are needed again

    def function(self, signature: str, head: str) -> str:
        self.emitter.most_rows = max(self.emitter.most_rows, self.rows)
        indent = [f"    {line}" for line in [*self.scalars, "k = 0", *self.first]]
        loop = ["    for k in range(1, order + 1):", *(f"        {line}" for line in self.later)] if self.later else []
        return "\n".join([f"@lowered_jit({signature})", head, UNPACK, *indent, *loop, "", ""])

    def both(self, line: str) -> None:
        self.first.append(line)
        self.later.append(line)

    def store(self, target: str, root: Expr) -> None:
        """Copy the coefficients of a root to an output."""
        self.first.append(f"{target} = {self.coefficient(root, '0')}")
        self.later.append(f"{target} = {'0.0' if root.degree == 0 else self.coefficient(root, 'k')}")

    def coefficient(self, node: Expr, k: str) -> str:
        """The text of a coefficient: a row's column k, or a scalar (which has a coefficient 0 only)."""
        if node.degree == 0:
            return self.emitter._constant(node) if self.emitter._is_constant(node) else self.names.get(node) or _leaf(node)
        if node.op in ("coordinate", "velocity", "acceleration"):
            return f"{node.op[0].replace('c', 'q')}[{node.value}, {k}]"
        name = self.names[node]
        return f"{name}, {k}]" if name.startswith("w[") else name

    def add(self, root: Expr) -> None:
        """Emit what a root needs; call `plan` with all roots first."""
        for node in ordered([root]):
            if node in self.names or node.op in ("coordinate", "velocity", "acceleration"):
                continue
            if node.degree == 0:
                self._add_scalar(node)
            else:
                self._add_row(node)

    def plan(self, roots: list[Expr]) -> None:
        """Find the nodes that need a row: a sum, or a product with a scalar, that no convolution reads is a local variable."""
        for node in ordered(roots):
            series = [a for a in node.args if a.degree != 0]
            if node.op not in ("add", "sub", "mul", "div") or (node.op == "mul" and len(series) == 2):
                self.convolved.update(series)
            elif node.op == "div" and node.args[1].degree != 0:
                self.convolved.update((node, node.args[1]))

    def _add_scalar(self, node: Expr) -> None:
        if node.args and not self.emitter._is_constant(node):
            self.names[node] = f"s{len(self.names)}"
            self.scalars.append(f"{self.names[node]} = {_scalar(node, lambda n: self.coefficient(n, '0'))}")

    def _row(self) -> str:
        self.rows += 1
        return f"w[{self.rows - 1}"

    def _add_row(self, node: Expr) -> None:
        if node.op in PAIRS:
            self._pair(node)
            return
        local = node.op in ("add", "sub", "mul", "div") and node not in self.convolved
        self.names[node] = f"y{len(self.names)}" if local else self._row()
        if node.op == "time":
            self.first.append(f"{self.names[node]}, 0] = t")
            self.later.append(f"{self.names[node]}, k] = 1.0 if k == 1 else 0.0")
        elif node.op == "record":
            self.first.append(
                f"expand_record(table[{node.value}, piece], anchor(breaks, piece), t + origin, {self.names[node]}])"
            )
            self.later.append(f"if k >= {(node.degree or 0) + 1}: {self.names[node]}, k] = 0.0")
        else:
            RECURRENCES[node.op](self, node)

    def _pair(self, node: Expr) -> None:
        """sin with cos, or sinh with cosh: each needs the other."""
        u, sign = node.args[0], "-" if node.op in ("sin", "cos") else ""
        first = node.op if node.op.startswith("sin") else PAIRS[node.op]
        s, c = Expr(first, (u,)), Expr(PAIRS[first], (u,))
        self.names[s], self.names[c] = self._row(), self._row()
        u0 = self.coefficient(u, "0")
        self.first += [f"{self.names[s]}, 0] = math.{first}({u0})", f"{self.names[c]}, 0] = math.{PAIRS[first]}({u0})"]
        self._sum(s, self._bounded(u, low=1), f"j * {self.coefficient(u, 'j')} * {self.names[c]}, k - j]", "", " / k")
        self._sum(c, self._bounded(u, low=1), f"j * {self.coefficient(u, 'j')} * {self.names[s]}, k - j]", sign, " / k")

    def _bounded(self, u: Expr, low: int = 0, other: Expr | None = None, high: str = "k + 1") -> str:
        """The range of j over which u_j other_{k-j} can be non-zero."""
        top = high if u.degree is None else f"min({high}, {u.degree + 1})"
        bottom = str(low) if other is None or other.degree is None else f"max({low}, k - {other.degree})"
        return f"range({bottom}, {top})"

    def _sum(self, node: Expr, span: str, term: str, before: str = "", after: str = "") -> None:
        self.later += ["x = 0.0", f"for j in {span}:", f"    x += {term}", f"{self.coefficient(node, 'k')} = {before}x{after}"]


def _linear(writer: _SeriesWriter, node: Expr) -> None:
    a, b = node.args
    sign = INFIX[node.op]
    writer.first.append(f"{writer.coefficient(node, '0')} = {writer.coefficient(a, '0')} {sign} {writer.coefficient(b, '0')}")
    left = "" if a.degree == 0 else writer.coefficient(a, "k")
    right = "" if b.degree == 0 else f" {sign} {writer.coefficient(b, 'k')}"
    writer.later.append(f"{writer.coefficient(node, 'k')} = {left}{right}")


def _product(writer: _SeriesWriter, node: Expr) -> None:
    a, b = node.args
    writer.first.append(f"{writer.coefficient(node, '0')} = {writer.coefficient(a, '0')} * {writer.coefficient(b, '0')}")
    if a.degree == 0 or b.degree == 0:
        factor, series = (a, b) if a.degree == 0 else (b, a)
        writer.later.append(
            f"{writer.coefficient(node, 'k')} = {writer.coefficient(factor, '0')} * {writer.coefficient(series, 'k')}"
        )
    else:
        span = writer._bounded(a, other=b)
        writer._sum(node, span, f"{writer.coefficient(a, 'j')} * {writer.coefficient(b, 'k - j')}")


def _quotient(writer: _SeriesWriter, node: Expr) -> None:
    a, b = node.args
    bottom = writer.coefficient(b, "0")
    writer.first.append(f"{writer.coefficient(node, '0')} = {writer.coefficient(a, '0')} / {bottom}")
    top = "0.0" if a.degree == 0 else writer.coefficient(a, "k")
    if b.degree == 0:
        writer.later.append(f"{writer.coefficient(node, 'k')} = {top} / {bottom}")
    else:
        term = f"{writer.coefficient(b, 'j')} * {writer.names[node]}, k - j]"
        writer._sum(node, writer._bounded(b, low=1), term, f"({top} - ", f") / {bottom}")


def _sqrt(writer: _SeriesWriter, node: Expr) -> None:
    u, name = node.args[0], writer.names[node]
    writer.first.append(f"{name}, 0] = math.sqrt({writer.coefficient(u, '0')})")
    writer._sum(
        node, "range(1, k)", f"{name}, j] * {name}, k - j]", f"({writer.coefficient(u, 'k')} - ", f") / (2.0 * {name}, 0])"
    )


def _exp(writer: _SeriesWriter, node: Expr) -> None:
    u = node.args[0]
    writer.first.append(f"{writer.names[node]}, 0] = math.exp({writer.coefficient(u, '0')})")
    term = f"j * {writer.coefficient(u, 'j')} * {writer.names[node]}, k - j]"
    writer._sum(node, writer._bounded(u, low=1), term, "", " / k")


def _log(writer: _SeriesWriter, node: Expr) -> None:
    u, name = node.args[0], writer.names[node]
    writer.first.append(f"{name}, 0] = math.log({writer.coefficient(u, '0')})")
    term = f"j * {name}, j] * {writer.coefficient(u, 'k - j')}"
    span = writer._bounded(Expr("coordinate"), low=1, other=u, high="k")
    writer._sum(node, span, term, f"({writer.coefficient(u, 'k')} - ", f" / k) / {writer.coefficient(u, '0')}")


def _pow(writer: _SeriesWriter, node: Expr) -> None:
    u, exponent = node.args
    p, name = writer.coefficient(exponent, "0"), writer.names[node]
    writer.first.append(f"{name}, 0] = {writer.coefficient(u, '0')} ** {p}")
    term = f"({p} * j - (k - j)) * {writer.coefficient(u, 'j')} * {name}, k - j]"
    writer._sum(node, writer._bounded(u, low=1), term, "", f" / (k * {writer.coefficient(u, '0')})")


def _tanh(writer: _SeriesWriter, node: Expr) -> None:
    u, name, square = node.args[0], writer.names[node], writer._row()
    writer.first += [f"{name}, 0] = math.tanh({writer.coefficient(u, '0')})", f"{square}, 0] = 1.0 - {name}, 0] * {name}, 0]"]
    writer._sum(node, writer._bounded(u, low=1), f"j * {writer.coefficient(u, 'j')} * {square}, k - j]", "", " / k")
    writer.later += ["x = 0.0", "for j in range(k + 1):", f"    x -= {name}, j] * {name}, k - j]", f"{square}, k] = x"]


RECURRENCES: dict[str, Callable[[_SeriesWriter, Expr], None]] = {
    "add": _linear,
    "sub": _linear,
    "mul": _product,
    "div": _quotient,
    "sqrt": _sqrt,
    "exp": _exp,
    "log": _log,
    "pow": _pow,
    "tanh": _tanh,
}


def _leaf(node: Expr) -> str:
    """The text of a leaf in a function of one instant."""
    texts = {"parameter": f"p[{node.value}]", "time": "t", "origin": "origin", "side": "side"}
    if node.op == "number":
        sign = "-" if node.value < 0 else ""
        return f"({node.value!r})" if math.isfinite(node.value) else f"({sign}math.{abs(node.value)!r})"
    if node.op == "record":
        return f"record_value(table[{node.value}, piece], anchor(breaks, piece), t + origin)"
    return texts[node.op]


def _scalar(node: Expr, ref: Callable[[Expr], str]) -> str:
    """The text of an operation on numbers."""
    args = [ref(a) for a in node.args]
    if node.op in INFIX or node.op in COMPARE:
        return f"{args[0]} {INFIX.get(node.op) or COMPARE[node.op]} {args[1]}"
    if node.op == "where":
        return f"{args[1]} if {args[0]} else {args[2]}"
    if node.op in ("maximum", "minimum"):
        return f"{node.op[:3]}({args[0]}, {args[1]})"
    return f"math.{node.op}({args[0]})"
