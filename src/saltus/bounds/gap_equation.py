"""One side of a contact as an equation of its gap, w'' = A(t, w, u) with u = w', and bounds of A and its derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.bounds.adiabatic_invariant import Box, Side
from saltus.bounds.intervals import SLACK, Interval, enclose
from saltus.taylor import Expr, Trace, differentiate, ordered, substitute

OPENING, SPEED, TIME = Expr("coordinate", (), 0), Expr("velocity", (), 0), Expr("time")
STRETCH = Expr("stretch")  # the unit of the gap on one side


@dataclass(frozen=True)
class Leaves:
    """The ranges of the leaves of the graph."""

    parameters: list[Interval]
    records: list[Interval]
    time: Interval = Interval(0.0)  # noqa: RUF009  (never changed)
    opening: Interval = Interval(0.0)  # noqa: RUF009
    speed: Interval = Interval(0.0)  # noqa: RUF009
    stretch: Interval = Interval(1.0)  # noqa: RUF009

    def __call__(self, node: Expr) -> Interval:
        if node.op in ("parameter", "record"):
            return (self.parameters if node.op == "parameter" else self.records)[int(node.value)]
        return {"time": self.time, "coordinate": self.opening, "velocity": self.speed, "stretch": self.stretch}[node.op]

    def only(self, chosen: np.ndarray) -> Leaves:
        """The parameter sets at the chosen indices."""

        def take(x: Interval) -> Interval:
            return Interval(x.lo[:, chosen], x.hi[:, chosen]) if x.lo.ndim else x

        parameters = [take(p) for p in self.parameters]
        return replace(self, parameters=parameters, time=take(self.time), stretch=take(self.stretch))


class Opening:
    """The expressions of one side: A(t, w, u) of the stretched gap, and its derivatives."""

    def __init__(self, traced: Trace, side: int) -> None:
        assert traced.gap_rate is not None
        leaf = {Expr("side"): float(side)}
        unit = STRETCH / substitute(traced.gap_rate, leaf)
        state = {OPENING: traced.contact + unit * OPENING, SPEED: unit * SPEED}
        self.a = substitute(traced.acceleration[0], {**leaf, **state}) / unit
        self.a_t, self.a_w, self.a_u = (differentiate(self.a, x) for x in (TIME, OPENING, SPEED))
        a_uu, a_wu = differentiate(self.a_u, SPEED), differentiate(self.a_w, SPEED)
        self.box = [self.a_w, differentiate(self.a_w, OPENING)]
        self.edge = [a_uu, a_wu, differentiate(a_uu, SPEED)]
        self.jets = [
            _rates(_at_contact(-self.a), 3),
            _rates(_at_contact(-self.a_u), 2),
            _rates(_at_contact(self.a_w), 1),
            _rates(_at_contact(a_uu), 1),
        ]

    def bounds(self, leaves: Leaves) -> Side:
        """Over the cells of the time, at the contact."""
        flat = iter(enclose([e for jet in self.jets for e in jet], leaves))
        return Side(*([next(flat) for _ in jet] for jet in self.jets))

    def boxed(self, leaves: Leaves, pull: Any, v: Any) -> Box:
        """Over the cells of the time and all states with u^2 / 2 + alpha w <= v^2 / 2."""
        around = replace(leaves, speed=Interval(-v, v))
        inside = replace(around, opening=Interval(np.zeros_like(pull), (1 + SLACK) * v * v / (2 * pull)))
        (w, ww), (uu, wu, uuu) = enclose(self.box, inside), enclose(self.edge, around)
        return Box(w, ww, uu, wu, uuu)


def _at_contact(root: Expr) -> Expr:
    return substitute(root, {OPENING: 0.0, SPEED: 0.0})


def _rates(root: Expr, order: int) -> list[Expr]:
    """An expression and its derivatives in the time."""
    jet = [root]
    for _ in range(order):
        jet.append(differentiate(jet[-1], TIME))
    return jet


def reads(root: Expr, *ops: str) -> bool:
    """Whether an expression contains one of the given operations."""
    return any(node.op in ops for node in ordered([root]))
