"""A curve of special points in two parameters: its equations, its points, its ends, and its
dataset.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import with_answers
from saltus.continuation import Corrected, Course, Units
from saltus.errors import ParameterError
from saltus.flow import unit_of
from saltus.orbits.beyond.conditions import Condition, ConditionValue, Slow
from saltus.orbits.beyond.orbit_curve import OrbitCurve, OrbitPoint
from saltus.orbits.beyond.special_point import SpecialPoint
from saltus.orbits.beyond.vanishing import Vanishing
from saltus.orbits.branches.branch import multiplier_columns, solution_columns
from saltus.orbits.contract.equations import OrbitEvaluation, Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.result import Result, provenance
from saltus.systems import driven_displacement

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Conditioned:
    """The equations of an orbit and the condition of its special point, evaluated at one place."""

    evaluation: OrbitEvaluation
    condition_value: ConditionValue

    @property
    def residual(self) -> np.ndarray:
        """The residual of the orbit's equations, and the condition's value."""
        return np.append(self.evaluation.residual, self.condition_value.value)

    def derivatives(self) -> np.ndarray:
        """The derivatives to the unknowns and the parameters."""
        return np.vstack([self.evaluation.derivatives(), self.condition_value.gradient])


@dataclass(frozen=True, eq=False)
class SpecialCurvePoint(OrbitPoint):
    """A point of a curve of special points.

    On a curve of grazings, the orbit's signature has the impacts without speed.
    """

    condition_value: ConditionValue

    @property
    def condition(self) -> Condition | Vanishing:
        """The condition with which the next point is computed."""
        condition: Condition | Vanishing = self.curve.condition
        return condition

    @property
    def residual(self) -> float:
        """The largest residual of the orbit's equations and of the curve's condition."""
        last = float(self.curve.units.residuals[-1])
        return max(self.solution.residual, abs(self.condition_value.value) / last)

    @property
    def touching(self) -> list[int]:
        """The impacts without speed of a grazing: a pair that coincides, or, at a wall, a single
        one.
        """
        if not isinstance(self.condition, Slow):
            return []
        i = self.condition.index
        sides = self.orbit.signature.sides
        return [i] if self.orbit.signature.along()[i] == sides[i] else [i, (i + 1) % len(sides)]


@dataclass(frozen=True, eq=False, kw_only=True)
class ConditionedCurve(OrbitCurve):
    """The orbits at which a condition holds, along two parameters. At each point the vectors that
    border the condition are renewed."""

    condition: Condition | Vanishing

    @property
    def units(self) -> Units:
        """Those of the orbit's equations, and behind them that of the condition: a speed, or 1."""
        known = self.equations.units
        last = self.equations.natural.speed if isinstance(self.condition, Slow) else 1.0
        terms = np.append(np.broadcast_to(known.terms, np.shape(known.residuals)), 1.0)
        residuals = np.append(known.residuals, last)
        return Units(known.unknowns, residuals, known.bounded, terms=terms)

    def evaluate(self, place: np.ndarray, thorough: bool) -> Conditioned | None:
        """The orbit's equations and the condition."""
        n = self.equations.size
        evaluation = super().evaluate(place, thorough)
        value = (
            None
            if evaluation is None
            else self.condition.evaluate(
                Solution(place[:n], place[n:], evaluation, 0, self.equations.units)
            )
        )
        return None if value is None else Conditioned(evaluation, value)

    def residual(self, place: np.ndarray) -> np.ndarray | None:
        """None: the condition needs the derivatives."""
        return None

    def solve(self, guess: np.ndarray, direction: np.ndarray) -> Any:
        """The point near a guess in the hyperplane through it normal to a direction, which may be
        of any length.
        """
        return super().solve(guess, direction / self.norm(direction))

    def point_at(self, found: Corrected[Any], tangent: np.ndarray) -> SpecialCurvePoint:
        value = found.evaluation.condition_value
        curve = replace(self, condition=self.condition.moved(value))
        return SpecialCurvePoint(
            curve, found.place, tangent, found.iterations, found.evaluation.evaluation, value
        )

    def joins(self, other: Any) -> bool:
        """Whether two points lie on one curve: always, as the condition is the same whatever
        vectors border it.
        """
        return True

    def along_condition(self, orbit: PeriodicOrbit) -> SpecialCurvePoint | None:
        """The point of the curve near an orbit that nearly fulfils the condition; None if Newton's
        method does not find it.
        """
        known = self.known(orbit.solution.unknowns, orbit.solution.values)
        if known is None:
            return None
        first = self.along_kernel(known)
        exact: SpecialCurvePoint | None = self.solve(first.place, first.tangent)
        return exact


def without_condition(point: SpecialCurvePoint) -> OrbitPoint:
    """A point as an orbit alone, on the surface of orbits along both parameters."""
    return OrbitPoint(
        point.curve.with_equations(point.orbit.equations),
        point.place,
        point.tangent,
        point.iterations,
        point.evaluation,
    )


@with_answers
@dataclass(frozen=True, eq=False)
class SpecialCurve(Result, Course[SpecialCurvePoint, SpecialPoint]):
    """A curve of special points in two parameters: its points in order, its codimension-two points,
    and why it ends.

    Attributes
    ----------
    points
        The points in order, each with its `orbit` and its parameters.
    special
        The codimension-two points, each a `SpecialPoint`.
    ends
        Why the curve ends at its first point and at its last one.
    missed
        The points that were noticed on the way and could not be located, each with its reason.
    kind
        The kind of its points: LP, PD, BPC, NS, GR or SW.
    paths
        The dotted paths of both parameters.

    Examples
    --------
    >>> fold = next(point for point in branch.special if point.kind == "LP")
    >>> curve = saltus.continue_special(fold, "load.vertical", (-0.51, -0.49), most_points=10)
    >>> str(curve.kind)
    'LP'
    """

    kind: str
    paths: tuple[str, str]

    @property
    def orbits(self) -> list[PeriodicOrbit]:
        """The orbits, in order."""
        return [point.orbit for point in self.points]

    def at(self, path: str, value: float) -> list[PeriodicOrbit]:
        """All orbits of the curve at a value of one of its parameters, solved there.

        Parameters
        ----------
        path
            The parameter's dotted path.
        value
            Its value.

        Raises
        ------
        ParameterError
            `path` is not one of the two parameters.
        """
        if path not in self.paths:
            raise ParameterError(
                f"{path!r} is not a parameter of this curve; it has {self.paths[0]!r} and"
                f" {self.paths[1]!r}",
                "path",
            )
        return [point.orbit for point in self.solved_at(value, self.paths.index(path) - 2)]

    def to_xarray(self) -> xarray.Dataset:
        """The curve along `point`, its codimension-two points along `special`.

        `parameter` is (point, path); the signature and the `unknowns` of each orbit are as in
        `Branch.to_xarray`.
        """
        import xarray

        orbits = self.orbits
        equations = self.orbits[0].equations
        name = driven_displacement(equations.given)
        angle = {"units": unit_of(equations.given, name), "long_name": f"max abs({name})"}
        data: dict[str, Any] = {
            "parameter": (("point", "path"), self.parameters),
            "amplitude": ("point", np.array([o.amplitude for o in orbits]), angle),
            "residual": ("point", np.array([p.residual for p in self.points])),
            **multiplier_columns(orbits),
            **solution_columns(orbits),
            "special_kind": ("special", np.array([s.kind for s in self.special], dtype="U8")),
            "special_parameter": (
                ("special", "path"),
                np.array([s.parameters for s in self.special]).reshape(-1, 2),
            ),
            "special_bracket": (
                ("special", "path"),
                np.array([s.evidence.brackets for s in self.special]).reshape(-1, 2),
            ),
            "special_residual": ("special", np.array([s.evidence.residual for s in self.special])),
        }
        attributes: dict[str, Any] = {
            "kind": str(self.kind),
            "ends": [str(end) for end in self.ends],
            "end_reasons": [end.reason.code for end in self.ends],
            "closed": int(self.closed),
        }
        known = provenance(equations.given, tol=equations.tol, **attributes)
        return xarray.Dataset(data, coords={"path": list(self.paths)}, attrs=known)

    def __repr__(self) -> str:
        low, bottom = self.parameters.min(axis=0)
        high, top = self.parameters.max(axis=0)
        kinds = ", ".join(
            f"{s.kind} ({s.parameters[0]:.6g}, {s.parameters[1]:.6g})" for s in self.special
        )
        return (
            f"SpecialCurve({self.kind}, {self.paths[0]} {low:.6g} to {high:.6g}, {self.paths[1]}"
            f" {bottom:.6g} to {top:.6g}, {len(self.points)} points, special: {kinds or 'none'};"
            f" ends: {self.ends[0]} | {self.ends[1]})"
        )
