"""A proof that the flow of a system with one coordinate never enlarges areas of the state plane."""

from __future__ import annotations

import numpy as np

from saltus.bounds.gap_equation import Leaves, reads
from saltus.bounds.intervals import Interval, enclose
from saltus.systems import System
from saltus.taylor import Expr, Trace, differentiate, substitute, trace

PERIOD_CELLS = 4096  # number of intervals into which the forcing period is divided
EVERYWHERE = Interval(-1e300, 1e300)
VELOCITY = Expr("velocity", (), 0)


def area_contraction(system: System) -> float | None:
    """The least rate -da/dv at which areas of the state plane shrink, over all sides, times and states; None if they may grow.

    Along a motion an area changes by the factor exp(integral of da/dv), and by e^2 at each impact v+ = e v-. If -da/dv >= 0
    everywhere and no impact raises the speed, the product of an orbit's two multipliers is at most 1, and a complex pair never
    leaves the unit circle: there is no Neimark-Sacker bifurcation (errata 22). The rate is bounded by interval arithmetic, so
    that None does not mean that areas do grow.
    """
    if not system.model.has_state_plane:
        return None
    traced = trace(system)
    leaves = _leaves_over_a_period(system)
    slopes = [_on_side(s, differentiate(traced.acceleration[0], VELOCITY)) for s in _sides(traced)]
    anywhere = Leaves(leaves.parameters, [EVERYWHERE] * len(traced.records), leaves.time, EVERYWHERE, EVERYWHERE)
    least = min(float(np.min(-bounds.hi)) for bounds in enclose(slopes, anywhere))
    return least + 0.0 if least >= 0.0 and _loses(traced, leaves) else None


def largest_pushes(system: System, acceleration: Expr) -> list[np.ndarray]:
    """Upper bounds of an acceleration at the contact on the sides +1 and -1, in cells over a forcing period."""
    return [bounds.hi for bounds in enclose([_on_side(side, acceleration) for side in (1, -1)], _leaves_over_a_period(system))]


def _leaves_over_a_period(system: System) -> Leaves:
    """The numbers of a system, and the time in cells over its forcing period, as the leaves of its trace."""
    return Leaves([Interval(value) for value in system.parameters.values()], [], time=_cells(system))


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
    """Whether no impact can raise the speed, because the law is linear in the speed with factors of at most 1."""
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
