"""Conditions of special orbits that are a quantity of the orbit alone, with derivatives by central
differences.

They are a gap, a speed or a reaction of an orbit with several contacts, and the modulus of a
complex pair of multipliers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.orbits.beyond.conditions import ConditionValue
from saltus.orbits.contract.equations import FARTHEST, OrbitEquations, Solution, Witness
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES

# Steps of the central differences, in natural units and as a share of the parameters' scales: their
# error is its square plus rounding divided by it.
SHIFT = 1e-5
# A pair of multipliers whose modulus differs from 1 by more than this is not the one of an NS
# nearby.
NEAR_CIRCLE = 0.5
Quantity = Callable[[Solution], float | None]


@dataclass(frozen=True, eq=False)
class Vanishing:
    """The condition that a quantity of an orbit, in natural units, is 0."""

    equations: OrbitEquations
    scales: tuple[float, ...]  # of the parameters
    quantity: Quantity
    number: int = -1  # of the witness, see `OrbitEquations.witnesses`; -1 for no such
    # The numbers of all witnesses that vanish with it, as the reaction after an impact and the
    # duration of the rest that follows: rounding decides which of them is the smaller one.
    together: frozenset[int] = frozenset()

    def moved(self, at: ConditionValue) -> Vanishing:
        """The condition does not depend on the point."""
        return self

    def evaluate(self, solution: Solution) -> ConditionValue | None:
        """The quantity and its derivatives, or None where it has none."""
        value = self._at(solution.unknowns, solution.values)
        if value is None:
            return None
        n = self.equations.size
        place = np.append(solution.unknowns, solution.values)
        steps = SHIFT * np.append(self.equations.units.unknowns * np.ones(n), self.scales)
        gradient = np.empty(len(place))
        for i, step in enumerate(steps):
            beside = []
            for sign in (1.0, -1.0):
                moved = place.copy()
                moved[i] += sign * step
                beside.append(self._at(moved[:n], moved[n:]))
            if beside[0] is None or beside[1] is None:
                return None
            gradient[i] = (beside[0] - beside[1]) / (2.0 * step)
        return ConditionValue(value, gradient, np.empty(0), np.empty(0))

    def _at(self, unknowns: np.ndarray, values: np.ndarray) -> float | None:
        evaluation = self.equations.evaluate(unknowns, values, with_extremes=True)
        if evaluation is None:
            return None
        found = self.quantity(Solution(unknowns, values, evaluation, 0, self.equations.units))
        return None if found is None or not np.isfinite(found) else found


def pair_on_circle(orbit: PeriodicOrbit, scales: tuple[float, ...]) -> Vanishing:
    """The condition that the complex pair of multipliers nearest to the unit circle at an orbit has
    the modulus 1; among several pairs it is known by its angle there.
    """
    equations = orbit.equations
    pairs = orbit.multipliers[orbit.multipliers.imag > 0.0]
    angle = float(np.angle(pairs[np.argmin(np.abs(np.abs(pairs) - 1.0))]))

    def outside(solution: Solution) -> float | None:
        values = PeriodicOrbit(equations, solution).multipliers
        upper = values[values.imag > 0.0]
        near = upper[np.abs(np.abs(upper) - 1.0) < NEAR_CIRCLE]
        if not near.size:
            return None
        return float(np.abs(near[np.argmin(np.abs(np.angle(near) - angle))]) - 1.0)

    return Vanishing(equations, scales, outside)


def witness_vanishes(orbit: PeriodicOrbit, scales: tuple[float, ...], number: int) -> Vanishing:
    """The condition that one of the witnesses of a change of an orbit's events, which takes place
    at this orbit, is 0.
    """
    equations = orbit.equations
    known = equations.witnesses(orbit.solution)
    together = {i for i in range(len(known)) if abs(known[i].value) < TOLERANCES.switching}

    def quantity(solution: Solution) -> float | None:
        return equations.witnesses(solution)[number].value

    return Vanishing(equations, scales, quantity, number, frozenset({number, *together}))


def other_room(point: Any) -> float:
    """How far the orbit of a point of a curve of changes is from another one: the least of the
    other witnesses, at most `FARTHEST`.
    """
    return min(FARTHEST, *(witness.value for witness in other_witnesses(point)))


def other_witnesses(point: Any) -> list[Witness]:
    """The witnesses of other changes than the one whose curve a point belongs to."""
    known = point.orbit.equations.witnesses(point.solution)
    return [known[i] for i in range(len(known)) if i not in point.condition.together]
