"""A curve of special points in two parameters: its points, its norm, what it ends with, and its dataset."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError
from saltus.orbits.codimension import CodimensionTwo
from saltus.orbits.conditions import Condition, Judgement, Slow, corrected, matrix
from saltus.orbits.newton import Solution
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.problem import Problem

if TYPE_CHECKING:
    import xarray

CLOSED = "closes"


@dataclass(frozen=True, eq=False)
class Plane:
    """The curve's problem along two parameters, with a norm that depends neither on the number of impacts nor on units."""

    problem: Problem
    scales: tuple[float, float]  # of the parameters

    @cached_property
    def weights(self) -> np.ndarray:
        """Of the unknowns and the parameters in the norm."""
        n = self.problem.size
        return np.append(np.full(n, (2.0 / n) ** 0.5), 1.0 / np.array(self.scales))

    def norm(self, step: np.ndarray) -> float:
        """The length of a step."""
        return float(np.linalg.norm(self.weights * step))


@dataclass(frozen=True, eq=False)
class LocusPoint:
    """A point of a curve of special points, and the direction in which the curve is followed there."""

    curve: Plane
    condition: Condition
    solution: Solution
    judged: Judgement
    tangent: np.ndarray  # to (unknowns, parameters), of length 1

    @cached_property
    def place(self) -> np.ndarray:
        """The unknowns and the parameters."""
        return np.append(self.solution.unknowns, self.solution.values)

    @cached_property
    def orbit(self) -> PeriodicOrbit:
        """The orbit; along a grazing with the impacts without speed that the signature on its other side has."""
        return PeriodicOrbit(self.curve.problem, self.solution)

    @property
    def residual(self) -> float:
        """The largest residual of the orbit's equations and of the curve's condition."""
        return max(self.solution.residual, abs(self.judged.value))

    @property
    def touching(self) -> list[int]:
        """The impacts without speed that a grazing consists of: a pair that meets, or one that turns the motion round."""
        if not isinstance(self.condition, Slow):
            return []
        i, sides = self.condition.index, self.orbit.signature.sides
        return [i] if self.orbit.signature.along()[i] == sides[i] else [i, (i + 1) % len(sides)]

    def near(self, guess: np.ndarray, along: np.ndarray) -> LocusPoint | None:
        """The point of the curve near a guess, in the hyperplane through it normal to a direction."""
        normal = along / self.curve.norm(along) * self.curve.weights**2
        found = corrected(self.curve.problem, self.condition, guess, normal)
        return None if found is None else self._point(*found, normal)

    def at(self, guess: np.ndarray, index: int) -> LocusPoint | None:
        """The point of the curve near a guess at the guess's own value of one parameter."""
        normal = np.zeros(guess.size)
        normal[index - 2] = 1.0 / self.curve.scales[index]
        found = corrected(self.curve.problem, self.condition, guess, normal)
        return None if found is None else self._point(*found, self.tangent * self.curve.weights**2)

    def _point(self, solution: Solution, judged: Judgement, normal: np.ndarray) -> LocusPoint | None:
        try:
            tangent = np.linalg.solve(matrix(solution, judged, normal), np.append(np.zeros(normal.size - 1), 1.0))
        except np.linalg.LinAlgError:
            return None
        length = self.curve.norm(tangent)
        if not 0.0 < length < np.inf:
            return None
        return LocusPoint(self.curve, self.condition.moved(judged), solution, judged, tangent / length)

    def turned(self) -> LocusPoint:
        """The same point, followed the other way."""
        return LocusPoint(self.curve, self.condition, self.solution, self.judged, -self.tangent)


@dataclass(frozen=True, eq=False)
class Locus:
    """A curve of special points in two parameters: its points in order, its codimension-two points, and why it ends."""

    kind: str  # LP, PD, BPC or GR
    paths: tuple[str, str]
    points: tuple[LocusPoint, ...]
    special: tuple[CodimensionTwo, ...]
    ends: tuple[str, str]

    @property
    def orbits(self) -> list[PeriodicOrbit]:
        """The orbits, in order."""
        return [point.orbit for point in self.points]

    @cached_property
    def parameters(self) -> np.ndarray:
        """Both parameters along the curve, (n, 2)."""
        return np.array([point.solution.values for point in self.points])

    @property
    def closed(self) -> bool:
        """Whether it is a loop."""
        return self.ends == (CLOSED, CLOSED)

    def at(self, path: str, value: float) -> list[PeriodicOrbit]:
        """All orbits of the curve at a value of one of its parameters, solved there.

        Raises:
            ParameterError: a path that is not one of the two.
        """
        if path not in self.paths:
            raise ParameterError(f"{path!r} is not a parameter of this curve; it has {self.paths[0]!r} and {self.paths[1]!r}")
        index, found = self.paths.index(path), []
        for a, b in zip(self.points, self.points[1:], strict=False):
            start, end = a.solution.values[index], b.solution.values[index]
            if start == end or (start - value) * (end - value) > 0.0 or end == value:
                continue
            guess = a.place + (value - start) / (end - start) * (b.place - a.place)
            guess[index - 2] = value
            point = a.at(guess, index)
            found += [] if point is None else [point.orbit]
        if self.points and self.points[-1].solution.values[index] == value:
            found.append(self.points[-1].orbit)
        return found

    def to_xarray(self) -> xarray.Dataset:
        """The curve along `point`, its codimension-two points along `special`.

        `parameter` is (point, path); angles in radians; `unknowns` and `sides` are those of `problem.py`.
        """
        import xarray

        import saltus

        orbits, system = self.orbits, self.points[0].curve.problem.system
        signature = orbits[0].signature
        data: dict[str, Any] = {
            "parameter": (("point", "path"), self.parameters),
            "amplitude": ("point", np.array([o.amplitude for o in orbits]), {"long_name": "max abs of the first coordinate"}),
            "residual": ("point", np.array([p.residual for p in self.points])),
            "multiplier_real": (("point", "multiplier"), np.array([o.multipliers.real for o in orbits])),
            "multiplier_imag": (("point", "multiplier"), np.array([o.multipliers.imag for o in orbits])),
            "unknowns": (("point", "unknown"), np.array([o.solution.unknowns for o in orbits])),
            "special_kind": ("special", np.array([s.kind for s in self.special], dtype="U8")),
            "special_parameter": (("special", "path"), np.array([s.parameters for s in self.special]).reshape(-1, 2)),
            "special_bracket": (("special", "path"), np.array([s.evidence.bracket for s in self.special]).reshape(-1, 2)),
            "special_residual": ("special", np.array([s.evidence.residual for s in self.special])),
        }
        attributes = {
            "kind": self.kind,
            "ends": list(self.ends),
            "closed": int(self.closed),
            "sides": list(signature.sides) or [0],
            "side": signature.side,
            "period": signature.period,
            "symmetric": int(signature.symmetric),
            "system": system.to_json(),
            "saltus": saltus.__version__,
            "tol": self.points[0].curve.problem.tol,
        }
        return xarray.Dataset(data, coords={"path": list(self.paths)}, attrs=attributes)

    def __repr__(self) -> str:
        (low, bottom), (high, top) = self.parameters.min(axis=0), self.parameters.max(axis=0)
        kinds = ", ".join(f"{s.kind} ({s.parameters[0]:.6g}, {s.parameters[1]:.6g})" for s in self.special)
        return (
            f"Locus({self.kind}, {self.paths[0]} {low:.6g} to {high:.6g}, {self.paths[1]} {bottom:.6g} to {top:.6g}, "
            f"{len(self.points)} points, special: {kinds or 'none'}; ends: {self.ends[0]} | {self.ends[1]})"
        )
