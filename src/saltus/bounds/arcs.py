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

from saltus.bounds.balls import EPS, UP, Ball, product
from saltus.bounds.krawczyk import Centre, NotProved, centre_at, newton
from saltus.bounds.shooting import Enclosure, Shooting


@dataclass(frozen=True)
class ArcSettings:
    """How a box along a curve is looked for."""

    newton: int = 1  # steps: the prediction is off by the square of the length
    tries: int = 3  # radii, each from the last result
    wide: float = 0.3  # the first radius, as a share of the way along the curve
    least_weight: float = 1e-2  # of a component's radius
    least_radius: float = 1e-13  # in natural scales
    # A defect |I - A J| beyond which wider radii cannot help.
    hopeless: float = 50.0


SETTINGS = ArcSettings()


@dataclass(frozen=True)
class Tube:
    """The points middle + tangent s +- radius for |s| <= half.

    Attributes
    ----------
    middle, tangent, radius
        The tube, (unknowns,); the parameter is the last one.
    row
        c, whose product with the distance from the middle is s.
    half
        Half of its length.
    """

    middle: np.ndarray
    tangent: np.ndarray
    radius: np.ndarray
    row: np.ndarray
    half: float

    @property
    def hull(self) -> Ball:
        """A box that contains the tube."""
        return Ball(self.middle, (np.abs(self.tangent) * self.half + self.radius) * UP)

    @property
    def pin(self) -> tuple[np.ndarray, float]:
        """The equation of the hyperplane through its middle."""
        return self.row, float(self.row @ self.middle)

    def at(self, s: float) -> np.ndarray:
        """The middle of the tube at s."""
        return np.asarray(self.middle + self.tangent * s)

    def holds(self, zero: Ball) -> bool:
        """Whether an enclosed zero lies in the interior of the tube."""
        s = float(self.row @ (zero.middle - self.middle))
        spread = float(np.abs(self.row) @ zero.radius) * UP
        # What rounding leaves in s, and in the hyperplane through the middle.
        sizes = float(np.abs(self.row) @ (np.abs(zero.middle) + 2.0 * np.abs(self.middle)))
        spread += 2.0 * (len(self.row) + 2) * EPS * sizes
        # The tube at all s of the zero's own spread.
        room = self.radius - np.abs(self.tangent) * spread * UP
        return (abs(s) + spread) * UP < self.half and zero.inside(self.at(s), room)


@dataclass(frozen=True)
class ProvedArc:
    """A tube in which there is exactly one zero for every |s| <= half.

    `turn` is the sign of d parameter / ds if it is the same on the whole tube, else 0; `enclosure`
    are the equations over it.
    """

    tube: Tube
    turn: int
    enclosure: Enclosure


def arc_along(shooting: Shooting, x: np.ndarray, row: np.ndarray, half: float) -> ProvedArc | None:
    """The tube of this length around the zero near x, or None where it is not proved."""
    shooting.pins = [(row, float(row @ x))]
    centre = newton(shooting, x, SETTINGS.newton)
    if isinstance(centre, NotProved):
        return None
    scales = shooting.scales
    tangent = centre.inverse[:, -1]
    weights = scales * np.maximum(centre.weights / centre.weights.max(), SETTINGS.least_weight)
    way = float((np.abs(tangent) / scales).max()) * half
    radius = SETTINGS.wide * way * weights + SETTINGS.least_radius * scales
    for _ in range(SETTINGS.tries):
        image = _Image(centre, Tube(centre.x, tangent, radius, row, half))
        if image.proved is not None or not image.hopeful:
            return image.proved
        radius = 1.5 * image.reach
    return None


def verified_arc(shooting: Shooting, tube: Tube) -> ProvedArc | None:
    """A tube that is said to be proved: verified anew, without a search."""
    shooting.pins = [tube.pin]
    centre = centre_at(shooting, tube.middle)
    return None if isinstance(centre, NotProved) else _Image(centre, tube).proved


class _Image:
    """The operator's image of a tube: its radii `reach`, what is `proved` by it, and whether a wider
    tube is `hopeful`.
    """

    def __init__(self, centre: Centre, tube: Tube) -> None:
        shooting = centre.shooting
        box = tube.hull
        enclosure = shooting.enclose(box)
        self.proved: ProvedArc | None = None
        self.hopeful = False
        if not enclosure.proved:
            return
        jacobian = shooting.system_rows(enclosure, box)[1]
        defect, drift = drift_of(centre.inverse, jacobian, tube.tangent)
        y = centre.step + drift * tube.half * UP
        self.reach = (y + defect @ tube.radius * (1.0 + 1e-12)) * UP
        if (self.reach < tube.radius).all():
            turn = turn_of(defect, drift, tube.tangent, shooting.scales)
            self.proved = ProvedArc(tube, turn, enclosure)
        worst = float((defect @ shooting.scales / shooting.scales).max())
        self.hopeful = worst < SETTINGS.hopeless


def drift_of(
    inverse: np.ndarray, jacobian: Ball, tangent: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """|I - A J| and |A (J t - e)|, the latter from A (J t - e) = (t - A e) - (I - A J) t."""
    defect = Ball(np.eye(len(inverse))) - product(Ball(inverse), jacobian)
    off = (Ball(tangent) - inverse[:, -1]).column - product(defect, Ball(tangent[:, None]))
    return defect.magnitude, off.magnitude[:, 0]


def turn_of(defect: np.ndarray, drift: np.ndarray, tangent: np.ndarray, scales: np.ndarray) -> int:
    """The sign of d parameter / ds, from J X' = e over the tube; 0 if it is not certain.

    With E = |I - A J| and C = |A (e - J t)|, |X' - t| <= C + E w max(C / w) / (1 - max(E w / w))
    for every w > 0; w are the natural scales of the unknowns.
    """
    rows = (defect @ scales) * (1.0 + 1e-12) * UP
    norm = float((rows / scales).max()) * UP
    if not norm < 1.0:
        return 0
    error = (drift[-1] + rows[-1] * (float((drift / scales).max()) * UP / (1.0 - norm))) * UP * UP
    return 0 if abs(tangent[-1]) <= error else int(np.sign(tangent[-1]))
