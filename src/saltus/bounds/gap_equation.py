"""One side of a contact as an equation of its gap, w'' = A(t, w, u) with u = w', and bounds of A
and its derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.bounds.adiabatic_invariant import Box, Side
from saltus.bounds.intervals import SLACK, Interval, enclose
from saltus.systems import System
from saltus.taylor import Expr, Trace, differentiate, ordered, substitute, trace

OPENING = Expr("coordinate", (), 0)
SPEED = Expr("velocity", (), 0)
TIME = Expr("time")
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
        return {
            "time": self.time,
            "coordinate": self.opening,
            "velocity": self.speed,
            "stretch": self.stretch,
        }[node.op]

    def only(self, chosen: np.ndarray) -> Leaves:
        """The parameter sets at the chosen indices."""

        def take(x: Interval) -> Interval:
            return Interval(x.lo[:, chosen], x.hi[:, chosen]) if x.lo.ndim else x

        parameters = [take(p) for p in self.parameters]
        return replace(
            self, parameters=parameters, time=take(self.time), stretch=take(self.stretch)
        )


class Opening:
    """The expressions of one side: A(t, w, u) of the stretched gap, and its derivatives."""

    def __init__(self, traced: Trace, side: int) -> None:
        assert traced.gap_rate is not None
        leaf = {Expr("side"): float(side)}
        unit = STRETCH / substitute(traced.gap_rate, leaf)
        state = {OPENING: traced.contact + unit * OPENING, SPEED: unit * SPEED}
        self.a = substitute(traced.acceleration[0], {**leaf, **state}) / unit
        self.a_t, self.a_w, self.a_u = (differentiate(self.a, x) for x in (TIME, OPENING, SPEED))
        a_uu = differentiate(self.a_u, SPEED)
        a_wu = differentiate(self.a_w, SPEED)
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
        inside = replace(
            around, opening=Interval(np.zeros_like(pull), (1 + SLACK) * v * v / (2 * pull))
        )
        (w, ww) = enclose(self.box, inside)
        (uu, wu, uuu) = enclose(self.edge, around)
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


# --- areas: the flow of a system with one coordinate may never enlarge them ---

PERIOD_CELLS = 4096  # number of intervals into which the forcing period is divided
EVERYWHERE = Interval(-1e300, 1e300)
VELOCITY = Expr("velocity", (), 0)


def area_contraction(system: System) -> float | None:
    """The least rate -da/dv at which areas of the state plane shrink, over all sides, times and
    states; None if they may grow.

    Along a motion an area changes by the factor exp(integral of da/dv), and by e^2 at each impact
    v+ = e v-. Let -da/dv >= 0 everywhere, and let no impact raise the speed. The product of an
    orbit's two multipliers is then at most 1, and a complex pair never leaves the unit circle:
    there is no Neimark-Sacker bifurcation (errata 22). The rate is bounded by interval arithmetic,
    so that None does not mean that areas do grow.
    """
    if not system.model.has_state_plane:
        return None
    traced = trace(system)
    leaves = _leaves_over_a_period(system)
    slopes = [_on_side(s, differentiate(traced.acceleration[0], VELOCITY)) for s in _sides(traced)]
    anywhere = Leaves(
        leaves.parameters, [EVERYWHERE] * len(traced.records), leaves.time, EVERYWHERE, EVERYWHERE
    )
    least = min(float(np.min(-bounds.hi)) for bounds in enclose(slopes, anywhere))
    return least + 0.0 if least >= 0.0 and _loses(traced, leaves) else None


def largest_pushes(system: System, acceleration: Expr) -> list[np.ndarray]:
    """Upper bounds of an acceleration at the contact on the sides +1 and -1, in cells over a
    forcing period.
    """
    return [
        bounds.hi
        for bounds in enclose(
            [_on_side(side, acceleration) for side in (1, -1)], _leaves_over_a_period(system)
        )
    ]


def _leaves_over_a_period(system: System) -> Leaves:
    """The numbers of a system, and the time in cells over its forcing period, as the leaves of its
    trace.
    """
    return Leaves(
        [Interval(value) for value in system.parameters.values()], [], time=_cells(system)
    )


def _on_side(side: int, root: Expr) -> Expr:
    """An expression on one side."""
    return substitute(root, {Expr("side"): float(side)})


def _cells(system: System) -> Interval:
    period = system.load.period
    if period is None:
        return EVERYWHERE
    edges = np.linspace(0.0, period, PERIOD_CELLS + 1)
    return Interval(edges[:-1] * (1 - 1e-12), edges[1:] * (1 + 1e-12))


def _sides(traced: Trace) -> tuple[int, ...]:
    return (1, -1)[: traced.side_count] or (1,)


def _loses(traced: Trace, leaves: Leaves) -> bool:
    """Whether no impact can raise the speed, because the law is linear in the speed with factors of
    at most 1.
    """
    if traced.velocity_after is None:
        return True
    for side in _sides(traced):
        after = _on_side(side, traced.velocity_after)
        slope = differentiate(after, VELOCITY)
        if reads(slope, "velocity", "time", "record"):
            return False
        at_rest, factor = enclose([substitute(after, {VELOCITY: 0.0}), slope], leaves)
        if not (np.max(at_rest.magnitude()) == 0.0 and np.max(factor.magnitude()) <= 1.0 + 1e-14):
            return False
    return True
