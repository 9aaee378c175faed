"""Pieces of curves of zeros, proved as a whole: boxes along the arclength, through folds.

The parameter is an unknown, and a row c . (x - x0) = s says how far along the curve a zero lies.
For all |s| <= half there is exactly one zero in x0 + t s +- r if Y + Z r < r with

    Y = |A F(x0)| + |A (J(X) t - e)| half,     Z = |I - A J(X)|,     X = x0 +- (|t| half + r),

where e is the unit vector of this row.
Two boxes are glued where a zero that is enclosed in both lies in the interior of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.bounds.balls import UP, Ball, product
from saltus.bounds.krawczyk import natural_weights
from saltus.bounds.shooting import Enclosure, Shooting


@dataclass(frozen=True)
class ArcSettings:
    """How a box along a curve is looked for."""

    newton: int = 3
    tries: int = 3  # radii, each from the last result
    wide: float = 0.3  # the first radius, as a share of the way along the curve
    least_weight: float = 1e-2  # of a component's radius
    least_radius: float = 1e-13  # in natural scales
    # A defect |I - A J| beyond which wider radii cannot help.
    hopeless: float = 50.0


SETTINGS = ArcSettings()


@dataclass(frozen=True)
class ArcBox:
    """For every |s| <= half there is exactly one zero in middle + tangent s +- radius.

    Attributes
    ----------
    middle, tangent, radius
        The tube, (unknowns,); the parameter is the last one.
    row
        c, whose product with the distance from the middle is s.
    half
        Half of its length.
    turn
        The sign of d parameter / ds if it is the same on the whole box, else 0.
    enclosure
        The equations over it.
    """

    middle: np.ndarray
    tangent: np.ndarray
    radius: np.ndarray
    row: np.ndarray
    half: float
    turn: int
    enclosure: Enclosure

    @property
    def hull(self) -> Ball:
        """A box that contains the tube."""
        return Ball(self.middle, (np.abs(self.tangent) * self.half + self.radius) * UP)

    def at(self, s: float) -> np.ndarray:
        """The middle of the tube at s."""
        return np.asarray(self.middle + self.tangent * s)

    def holds(self, zero: Ball) -> bool:
        """Whether an enclosed zero lies in the interior of the tube."""
        s = float(self.row @ (zero.middle - self.middle))
        spread = float(np.abs(self.row) @ zero.radius) * UP
        # The tube at all s of the zero's own spread.
        room = self.radius - np.abs(self.tangent) * spread * UP
        return abs(s) + spread < self.half * UP and zero.inside(self.at(s), room)


def arc_box(shooting: Shooting, x: np.ndarray, row: np.ndarray, half: float) -> ArcBox | None:
    """The box of this length around the zero near x, or None where it is not proved."""
    near = _zero_on(shooting, x, row)
    if near is None:
        return None
    x, inverse, residual = near
    tangent = inverse[:, -1]
    unit = np.zeros(len(x))
    unit[-1] = 1.0
    y0 = product(Ball(inverse), residual.column).magnitude[:, 0]
    weights = natural_weights(shooting, inverse)
    weights = shooting.scales * np.maximum(weights / weights.max(), SETTINGS.least_weight)
    way = float((np.abs(tangent) / shooting.scales).max()) * half
    radius = SETTINGS.wide * way * weights + SETTINGS.least_radius * shooting.scales
    for _ in range(SETTINGS.tries):
        box = Ball(x, (np.abs(tangent) * half + radius) * UP)
        enclosure = shooting.enclose(box)
        if not enclosure.proved:
            return None
        jacobian = shooting.system_rows(enclosure, box)[1]
        drift = product(jacobian, Ball(tangent[:, None])) - Ball(unit[:, None])
        y = y0 + product(Ball(inverse), drift).magnitude[:, 0] * half * UP
        z = (Ball(np.eye(len(x))) - product(Ball(inverse), jacobian)).magnitude
        reach = (y + z @ radius * (1.0 + 1e-12)) * UP
        if (reach < radius).all():
            turn = _turn(inverse, jacobian, tangent, unit, shooting.scales)
            return ArcBox(x, tangent, radius, row, half, turn, enclosure)
        if not (z @ shooting.scales / shooting.scales).max() < SETTINGS.hopeless:
            return None
        radius = 1.5 * reach
    return None


def _zero_on(
    shooting: Shooting, x: np.ndarray, row: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Ball] | None:
    """The zero near x on its hyperplane, with the inverse Jacobian and the residual there."""
    shooting.pins = [(row, float(row @ x))]
    for step in range(SETTINGS.newton):
        enclosure = shooting.enclose(Ball(x))
        if not enclosure.proved:
            return None
        residual, jacobian = shooting.system_rows(enclosure, Ball(x))
        nearly = shooting.nearly_inverse(jacobian.middle)
        if nearly is None:
            return None
        inverse = nearly
        if step < SETTINGS.newton - 1:
            x = x - inverse @ residual.middle
    return x, inverse, residual


def _turn(
    inverse: np.ndarray, jacobian: Ball, tangent: np.ndarray, unit: np.ndarray, scales: np.ndarray
) -> int:
    """The sign of d parameter / ds, from J X' = e over the box; 0 if it is not certain.

    With E = |I - A J| and C = |A (e - J t)|, |X' - t| <= C + E w max(C / w) / (1 - max(E w / w))
    for every w > 0; w are the natural scales of the unknowns.
    """
    off = product(
        Ball(inverse), Ball(unit[:, None]) - product(jacobian, Ball(tangent[:, None]))
    ).magnitude[:, 0]
    z = (Ball(np.eye(len(unit))) - product(Ball(inverse), jacobian)).magnitude
    rows = (z @ scales) * (1.0 + 1e-12) * UP
    norm = float((rows / scales).max()) * UP
    if not norm < 1.0:
        return 0
    error = (off[-1] + rows[-1] * (float((off / scales).max()) * UP / (1.0 - norm))) * UP * UP
    return 0 if abs(tangent[-1]) <= error else int(np.sign(tangent[-1]))
