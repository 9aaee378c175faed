"""How fast a motion contracts areas of states: the determinant of the flow, from its impacts and the time spent on each side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.bounds import Interval, Leaves, enclose, reads
from saltus.flow import EventKind, Motion
from saltus.systems import System
from saltus.taylor import Expr, differentiate, substitute, trace

VELOCITY = Expr("velocity", (), 0)


class Contraction:
    """ln det of the flow's derivative along a motion of a system with one coordinate.

    ln det Phi = sum over impacts of ln(R_v v+ / v-) + sum over sides s of (da/dv)_s T_s, where R(v-) is the law of impact and T_s
    the time on the side; for the metainterface (da/dv)_s = -C c^P / (1 + m)^P, and R_v v+ / v- = e^2 (numerics.md, section 5).
    It is independent of the derivatives that are carried along the motion.
    """

    def __init__(self, system: System) -> None:
        traced = trace(system)
        self._leaves = Leaves([Interval(value) for value in system.parameters.values()], [])
        sides = system.model.sides or (1,)
        damping = {s: substitute(differentiate(traced.acceleration[0], VELOCITY), {Expr("side"): float(s)}) for s in sides}
        after = traced.velocity_after
        self._slopes = {}
        if after is not None:
            self._slopes = {s: differentiate(substitute(after, {Expr("side"): float(s)}), VELOCITY) for s in sides}
        known = not any(reads(d, "time", "coordinate", "velocity", "record") for d in damping.values())
        known &= not any(reads(slope, "record") for slope in self._slopes.values())
        single = len(system.model.coordinates) == 1 and not system.model.held
        self.known = known and single  # whether da/dv is constant on each side
        linear = {s: d for s, d in self._slopes.items() if not reads(d, "time", "velocity", "record")}
        self._factors = {s: _middle(enclose([d], self._leaves)[0]) for s, d in linear.items()}
        self._rates = {s: _middle(enclose([d], self._leaves)[0]) for s, d in damping.items()} if self.known else {}

    def along(self, motion: Motion) -> float:
        """ln det from the start of a motion to its end; -inf if it rests in between, NaN if da/dv is not constant on a side."""
        if not self.known:
            return float("nan")
        if len(motion.events.of(EventKind.REST)):
            return float("-inf")
        impacts = motion.impacts
        bounds = np.concatenate([[motion.start], impacts.time, [motion.time]])
        sides = np.append(impacts.side, motion.side)
        total = sum(rate * np.diff(bounds)[sides == side].sum() for side, rate in self._rates.items())
        for side in set(impacts.side.tolist()):
            here = impacts.side == side
            before, after = impacts.velocity_before[here], impacts.velocity_after[here]
            with np.errstate(divide="ignore"):
                total += np.log(np.abs(self._slope(int(side), impacts.time[here], before) * after / before)).sum()
        return float(total)

    def _slope(self, side: int, time: np.ndarray, before: np.ndarray) -> Any:
        """R_v at impacts with these velocities."""
        if side in self._factors:
            return self._factors[side]
        (slope,) = enclose([self._slopes[side]], Leaves(self._leaves.parameters, [], Interval(time), speed=Interval(before)))
        return _middle(slope)


def impact_factor(system: System, parameters: Mapping[str, np.ndarray]) -> np.ndarray:
    """The product over the sides of abs(dv+/dv-) of impacts without speed, for arrays of parameters: if it is below 1, impacts
    lead to rest.

    Its shape is () or that of the arrays; it is NaN if the impact law has no slope there, and 0 if contacts or frictions hold a
    coordinate.
    """
    traced = trace(system)
    if traced.velocity_after is None:
        return np.zeros(()) if system.model.held else np.ones(())
    values = [Interval(np.asarray(parameters.get(path, value), dtype=float)) for path, value in system.parameters.items()]
    product = np.ones(())
    for side in system.model.sides:
        slope = differentiate(substitute(traced.velocity_after, {Expr("side"): float(side)}), VELOCITY)
        product = product * np.abs(_middle(enclose([slope], Leaves(values, []))[0]))
    return product


def _middle(bounds: Interval) -> np.ndarray:
    """The value of an expression of exact numbers, whose bounds differ by rounding only."""
    middle: np.ndarray = 0.5 * (bounds.lo + bounds.hi)
    return middle
