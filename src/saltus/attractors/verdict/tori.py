"""Whether a system can move quasi-periodically at all (errata 22)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.attractors.stroboscopic_section import check_periodic
from saltus.bounds import Interval, Leaves, enclose, reads
from saltus.systems import System, check_system
from saltus.taylor import Expr, Trace, differentiate, substitute, trace

PERIOD_CELLS = 4096  # number of intervals into which the forcing period is divided
EVERYWHERE = Interval(-1e300, 1e300)
VELOCITY = Expr("velocity", (), 0)


def excludes_tori(system: System) -> str | None:
    """Why a system with one coordinate has no quasi-periodic motion, as a sentence; None where it may have one (errata 22).

    Under one forcing frequency a quasi-periodic motion lies on closed curves that the stroboscopic map P (or, where a curve is
    mapped to another one, a power of it) carries onto themselves. There is none where

    * P is continuous on the plane of states, in which the states before and after an impact are one point. It is, unless the
      contact pushes away on both sides at one instant, where motions beside the state of rest are torn apart: for equal layers,
      where V cos(beta0) > 0. Bounces from one wall tear nothing apart, and a system without contact has no corner;
    * and P shrinks areas: da/dv < 0 on every side, and no impact raises the speed.

    For then P maps the curve onto itself and, being continuous, the area within onto at least itself; and it has less to give.
    Both are checked by interval bounds over all of the forcing period and all states. Sufficient, not necessary: a load of which
    the bounds do not decide is one that may have tori.

    Raises:
        ParameterError: what is no system; a load by records.
    """
    check_system(system, "excludes_tori")
    check_periodic(system)
    if len(system.model.coordinates) > 1:
        return None
    traced = trace(system)
    leaves = Leaves([Interval(value) for value in system.parameters.values()], [], time=_cells(system))
    rate = _slowest_contraction(traced, leaves)
    continuous = None if rate is None or not _loses(traced, leaves) else _continuous(system, traced, leaves)
    if continuous is None:
        return None
    if system.load.period is None:
        return f"under constant loads a motion of one coordinate has no room for a torus, and {continuous} and areas shrink"
    left = math.exp(-rate * system.load.period)
    return (
        f"the stroboscopic map is continuous, as {continuous}, and it shrinks areas, in a forcing period to at most {left:.3g} "
        "of what they were, so that it has no invariant closed curve (errata 22)"
    )


def _cells(system: System) -> Interval:
    period = system.load.period
    if period is None:
        return EVERYWHERE
    edges = np.linspace(0.0, period, PERIOD_CELLS + 1)
    return Interval(edges[:-1] * (1 - 1e-12), edges[1:] * (1 + 1e-12))


def _on(side: int, root: Expr) -> Expr:
    return substitute(root, {Expr("side"): float(side)})


def _sides(traced: Trace) -> tuple[int, ...]:
    return (1, -1)[: traced.sides] or (1,)


def _slowest_contraction(traced: Trace, leaves: Leaves) -> Any:
    """The least -da/dv over all sides, times and states; None if it may be 0 or below."""
    slopes = [_on(s, differentiate(traced.acceleration[0], VELOCITY)) for s in _sides(traced)]
    anywhere = Leaves(leaves.parameters, [], leaves.time, EVERYWHERE, EVERYWHERE)
    least = min(float(np.min(-bounds.hi)) for bounds in enclose(slopes, anywhere))
    return least if least > 0.0 else None


def _loses(traced: Trace, leaves: Leaves) -> bool:
    """Whether no impact can raise the speed: the law is linear in it, with factors of at most 1."""
    if traced.velocity_after is None:
        return True
    for side in _sides(traced):
        after = _on(side, traced.velocity_after)
        slope = differentiate(after, VELOCITY)
        if reads(slope, "velocity", "time", "record"):
            return False
        at_rest, factor = enclose([substitute(after, {VELOCITY: 0.0}), slope], leaves)
        if not (np.max(at_rest.magnitude()) == 0.0 and np.max(factor.magnitude()) <= 1.0 + 1e-14):
            return False
    return True


def _continuous(system: System, traced: Trace, leaves: Leaves) -> str | None:
    """Why motions that begin close together stay so for a while; None where the contact may push away on both sides."""
    if traced.sides == 0:
        return "the motion has no contact"
    if traced.sides == 1:
        return "a bounce from one wall joins its states before and after without a gap"
    assert traced.contact_acceleration is not None
    pushes = enclose([_on(s, traced.contact_acceleration) for s in _sides(traced)], leaves)
    if not np.all(np.minimum(*(push.hi for push in pushes)) < 0.0):
        return None
    if np.all(np.maximum(*(push.hi for push in pushes)) < 0.0):
        return "the load presses on the contact from both sides at all times"
    return "the load never pushes away from the contact on both sides at once"
