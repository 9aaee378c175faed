"""The unit cell: geometry and kinematics of one layer, and of both for drawing (paper, section
"Mechanical model").
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from saltus.checks import Numbers, check_number, with_answers
from saltus.errors import ParameterError, shown
from saltus.number_ranges import settle_numbers
from saltus.systems.catalogue.metainterface import BETWEEN_0_AND_PI, Metainterface
from saltus.systems.catalogue.si_units import PhysicalCell
from saltus.systems.catalogue.two_layer import TwoLayer

if TYPE_CHECKING:
    import xarray

ANGLE_ROUNDING = 1e-12  # an angle past a limit by no more than this is rounded onto it


@with_answers
@dataclass(frozen=True, slots=True, kw_only=True)
class UnitCell:
    """Two articulated parallelograms, each with a slider amid its diagonal (paper, `gen_conf` to
    `max_disp_condition`).

    In every layer base, inclined bar (length 1, in units of l) and diagonal form a triangle: `beta`
    is the angle between the base and the bar, and `alpha` the one between the base and the line
    joining the ends of the diagonal. `phi` is the misalignment between that line and the two halves
    of the diagonal, which stay parallel and slide past each other at mid-span.

    A difference angle `theta` is a number or an array of any shape, rad: theta >= 0 is theta_1 of
    the lower layer, theta <= 0 is theta_2 of the upper one (`theta_conditions`), as in the reduced
    model. Lengths are in units of l.

    With `physical`, a `PhysicalCell` of SI data, the cell makes its models (`metainterface`,
    `two_layer`); `physical.units` converts times, forces and displacements.

    Parameters
    ----------
    alpha0
        The angle between the base and the diagonal in the undeformed cell, rad.
    beta0
        The angle between the base and the inclined bar in the undeformed cell, rad.
    physical
        The cell's data in SI units, if its models are to be made.

    Raises
    ------
    ParameterError
        Angles outside alpha0 > 0, 0 < beta0 < pi, alpha0 + beta0 < pi (`restangle`).

    Examples
    --------
    >>> cell = saltus.UnitCell(alpha0=0.3, beta0=1.4)
    >>> float(cell.theta(cell.phi(0.1)))
    0.10000000000000009
    """

    alpha0: float = field(metadata=BETWEEN_0_AND_PI)
    beta0: float = field(metadata=BETWEEN_0_AND_PI)
    physical: PhysicalCell | None = None

    def __post_init__(self) -> None:
        settle_numbers(self)
        if self.alpha0 + self.beta0 >= math.pi:
            raise ParameterError(
                f"alpha0 + beta0 must lie below pi rad, got {self.alpha0!r} + {self.beta0!r}",
                "alpha0",
            )
        if not isinstance(self.physical, PhysicalCell | None):
            raise ParameterError(
                f"physical must be a PhysicalCell or None, got {shown(self.physical)}", "physical"
            )

    @property
    def lambda_(self) -> float:
        """lambda = sin(beta0) / (2 sin(alpha0)), the length of half the diagonal
        (`psi_lambda_chi`).
        """
        return math.sin(self.beta0) / (2 * math.sin(self.alpha0))

    @property
    def psi(self) -> float:
        """psi = sin(beta0)^2 / (2 sin(alpha0) sin(alpha0 + beta0)) = 2 lambda^2 / base
        (`psi_lambda_chi`).
        """
        return math.sin(self.beta0) ** 2 / (
            2 * math.sin(self.alpha0) * math.sin(self.alpha0 + self.beta0)
        )

    @property
    def chi(self) -> float:
        """chi = sin(2 alpha0 + beta0) / (2 sin(alpha0 + beta0)) (`psi_lambda_chi`, erratum 1)."""
        return math.sin(2 * self.alpha0 + self.beta0) / (2 * math.sin(self.alpha0 + self.beta0))

    @property
    def base(self) -> float:
        """Length of the horizontal edges, sin(alpha0 + beta0) / sin(alpha0), by the law of
        sines.
        """
        return math.sin(self.alpha0 + self.beta0) / math.sin(self.alpha0)

    @property
    def line_limit(self) -> float:
        """abs(theta) at which a layer becomes a line segment, pi - beta0 (`line_cond` with n = 1,
        erratum 19), rad.
        """
        return math.pi - self.beta0

    @property
    def kinematic_limit(self) -> float:
        """abs(theta) at which the slider closes again, 2 (pi - beta0), from cos(beta_j) <=
        cos(beta0) (erratum 20), rad.
        """
        return 2 * (math.pi - self.beta0)

    @property
    def max_displacement(self) -> float:
        """The bound 1 + cos(beta0) of abs(xi), reached on the line (`max_disp_condition`)."""
        return 1 + math.cos(self.beta0)

    @property
    def max_misalignment(self) -> float:
        """The largest abs(phi), arctan sqrt((1 + cos(beta0)) / psi), reached on the line, rad."""
        return math.atan(math.sqrt((1 + math.cos(self.beta0)) / self.psi))

    def line_condition(self, n: int = 1) -> float:
        """n pi - beta0, rad (`line_cond`).

        Parameters
        ----------
        n
            Which of the multiples of pi.

        Raises
        ------
        ParameterError
            n >= 2, which lies past the kinematic limit (erratum 20).
        """
        if n != 1:
            raise ParameterError(
                "only n = 1 of the line conditions can be reached before the kinematic limit, "
                f"got n = {n!r}",
                "n",
            )
        return self.line_limit

    def beta(self, theta: Numbers) -> Any:
        """beta_j = beta0 + abs(theta_j) (erratum 2), rad.

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        """
        return self.beta0 + np.abs(theta)

    def phi(self, theta: Numbers) -> Any:
        """abs(phi_j) from cos(beta_j) = cos(beta0) - psi tan(phi_j)^2 (`gen_conf`), rad.

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.

        Raises
        ------
        ParameterError
            abs(theta) past the kinematic limit.
        """
        return np.arctan(np.sqrt(self._lowering(theta) / self.psi))

    def theta(self, phi: Numbers, *, layer: int = 1, past_line: bool = False) -> Any:
        """theta_j = -(-1)^j (beta_j(phi_j) - beta0) (`gen_conf`, erratum 2), rad; `past_line` takes
        beta_j > pi.

        Parameters
        ----------
        phi
            The misalignment, rad; any shape.
        layer
            1 for the lower layer, 2 for the upper one.
        past_line
            Whether the layer has gone past the straight line, beta_j > pi.

        Raises
        ------
        ParameterError
            abs(phi) above `max_misalignment`, or a layer other than 1 and 2.
        """
        if layer not in (1, 2):
            raise ParameterError(f"layer must be 1 (lower) or 2 (upper), got {layer!r}", "layer")
        beta = self.beta_of_phi(phi)
        beta = 2 * math.pi - beta if past_line else beta
        return -((-1) ** layer) * (beta - self.beta0)

    def alpha(self, theta: Numbers) -> Any:
        """alpha_j of theta_j (`configalpha`, errata 1 and 3), rad; past the line it is the
        diagonal's angle below the base.

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        """
        lowering = self._lowering(theta)
        cosine = np.sqrt(self.psi / (lowering + self.psi)) * (
            lowering + 2 * self.lambda_ * self.chi + self.psi
        )
        return np.arccos(np.clip(cosine / (2 * self.lambda_), -1, 1))

    def alpha_of_phi(self, phi: Numbers) -> Any:
        """arccos(psi / (2 lambda cos(phi)) + chi cos(phi)) (`gen_conf`), rad.

        Parameters
        ----------
        phi
            The misalignment, rad; any shape.
        """
        self._check_phi(phi)
        cosine = np.cos(phi)
        return np.arccos(np.clip(self.psi / (2 * self.lambda_ * cosine) + self.chi * cosine, -1, 1))

    def beta_of_phi(self, phi: Numbers) -> Any:
        """arccos(cos(beta0) - psi tan(phi)^2), from beta0 to pi (`gen_conf`), rad.

        Parameters
        ----------
        phi
            The misalignment, rad; any shape.
        """
        self._check_phi(phi)
        return np.arccos(np.clip(math.cos(self.beta0) - self.psi * np.tan(phi) ** 2, -1, 1))

    def xi(self, theta: Numbers) -> Any:
        """Relative horizontal displacement, sgn(theta) (cos(beta0) - cos(beta_j)) (`configdbeta`,
        erratum 2).

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        """
        return np.sign(np.multiply(1.0, theta)) * (math.cos(self.beta0) - np.cos(self.beta(theta)))

    def eta(self, theta: Numbers) -> Any:
        """Height of the layer, sin(beta_j) (`configdbeta`).

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        """
        return np.sin(self.beta(theta))

    def phi_velocity(self, theta: Numbers, velocity: Numbers) -> Any:
        """Rate of abs(phi_j) at theta and theta': abs(theta)' sin(beta_j) cos(phi_j)^3 / (2 psi
        sin(phi_j)).

        At an impact, theta -> 0 with theta' finite, it diverges like abs(theta)' sqrt(sin(beta0) /
        (4 psi abs(theta))) (`fundamentalproperty`, `fundamentalvelocity`): there the result is an
        infinity of its sign, or 0 for theta' = 0.

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        velocity
            theta', per unit of tau; it broadcasts.
        """
        phi = self.phi(theta)
        rate = np.where(np.less(theta, 0), -1.0, 1.0) * np.asarray(velocity)
        slope = np.sin(self.beta(theta)) * np.cos(phi) ** 3 / (2 * self.psi)
        closed = np.sin(phi) == 0
        moving = np.where(closed & (np.asarray(rate) != 0), np.copysign(np.inf, rate * slope), 0.0)
        return np.where(closed, moving, rate * slope / np.where(closed, 1.0, np.sin(phi)))[()]

    def small_phi(self, theta: Numbers) -> Any:
        """abs(phi) = sqrt(abs(theta) sin(beta0) / psi), the leading term of `phi` for theta -> 0
        (`fundamentalproperty`), rad.

        Parameters
        ----------
        theta
            The difference angle, rad; any shape.
        """
        return np.sqrt(np.abs(theta) * math.sin(self.beta0) / self.psi)

    def layout(
        self, theta_1: float = 0.0, theta_2: float = 0.0, *, misaligned: tuple[int, int] = (1, 1)
    ) -> CellLayout:
        """The positions of all hinges, sliders and masses, in units of l from the lower left hinge.

        Parameters
        ----------
        theta_1
            The opening of the lower layer, rad, at least 0.
        theta_2
            The opening of the upper layer, rad, at most 0.
        misaligned
            The signs of phi_1 and phi_2.

        Raises
        ------
        ParameterError
            theta_1 < 0 or theta_2 > 0 (`theta_conditions`), or either past the kinematic limit.
        """
        if not (
            isinstance(misaligned, tuple | list)
            and len(misaligned) == 2
            and set(misaligned) <= {1, -1}
        ):
            raise ParameterError(
                f"misaligned must be two signs, 1 or -1, got {shown(misaligned)}", "misaligned"
            )
        limit = self.kinematic_limit + ANGLE_ROUNDING
        check_number("theta_1", theta_1, at_least=0.0, at_most=limit, unit="rad")
        check_number("theta_2", theta_2, at_least=-limit, at_most=0.0, unit="rad")
        phi = (float(self.phi(theta_1)) * misaligned[0], float(self.phi(theta_2)) * misaligned[1])
        return CellLayout.build(
            self.base, self.lambda_, (self.beta(theta_1), self.beta(theta_2)), phi
        )

    def to_xarray(self) -> xarray.Dataset:
        """The undeformed cell as a dataset, which `saltus.plot` draws; `layout(theta_1, theta_2)`
        has one of each state.
        """
        return self.layout().to_xarray()

    def metainterface(self) -> Metainterface:
        """The reduced model of this cell; needs `physical`."""
        return self._data().metainterface(self.beta0)

    def two_layer(self) -> TwoLayer:
        """The two-layer model of this cell; needs `physical`."""
        return self._data().two_layer(self.beta0)

    def _data(self) -> PhysicalCell:
        if self.physical is None:
            raise ParameterError(
                "this UnitCell has no SI data; make it with physical=PhysicalCell(length=..., ...)"
            )
        return self.physical

    def _lowering(self, theta: Any) -> Any:
        """cos(beta0) - cos(beta_j), as a product so that it keeps its digits near theta = 0."""
        size = np.abs(theta)
        if np.any(size > self.kinematic_limit + ANGLE_ROUNDING):
            worst = float(np.max(size))
            raise ParameterError(
                "abs(theta) must not pass the kinematic limit 2 (pi - beta0) = "
                f"{self.kinematic_limit:.6g} rad, got {worst!r}",
                "theta",
            )
        return np.maximum(2 * np.sin(self.beta0 + size / 2) * np.sin(size / 2), 0.0)

    def _check_phi(self, phi: Any) -> None:
        if not np.all(np.abs(phi) <= self.max_misalignment + ANGLE_ROUNDING):
            worst = float(np.max(np.abs(phi)))
            raise ParameterError(
                f"abs(phi) must lie in [0, {self.max_misalignment:.6g}] rad in this cell, got "
                f"{worst!r}",
                "phi",
            )


Point = NDArray[np.float64]
Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class CellLayout:
    """Points (x, y) of shape (2,), in units of l, in the frame of the base with its origin at the
    lower left hinge.

    The masses sit amid the top edge of each layer, at (x_j, y_j) of `displ_ratio2`. The inclined
    bars lean to the left in the lower layer and to the right in the upper one (for beta < pi/2).
    The diagonal of layer j joins `diagonals[j - 1]`; its halves end at `slider_j_in` and
    `slider_j_out`, whose distance is the transverse jump of the slider.

    The rotational springs of the paper's points A and B measure the angle beta_j. It is the same at
    opposite corners of a layer, and the paper does not say which corners it means: here A is the
    lower right hinge and B the upper right one.
    """

    points: dict[str, Point]  # of every hinge, slider and mass, by name

    bars: ClassVar[tuple[Pair, ...]] = (
        ("lower_left", "lower_right"),
        ("lower_left", "middle_left"),
        ("lower_right", "middle_right"),
        ("middle_left", "middle_right"),
        ("middle_left", "upper_left"),
        ("middle_right", "upper_right"),
        ("upper_left", "upper_right"),
        ("lower_left", "slider_1_in"),
        ("slider_1_out", "middle_right"),
        ("middle_right", "slider_2_in"),
        ("slider_2_out", "upper_left"),
    )
    diagonals: ClassVar[tuple[Pair, Pair]] = (
        ("lower_left", "middle_right"),
        ("middle_right", "upper_left"),
    )
    sliders: ClassVar[tuple[Pair, Pair]] = (
        ("slider_1_in", "slider_1_out"),
        ("slider_2_in", "slider_2_out"),
    )
    springs: ClassVar[dict[str, str]] = {"A": "lower_right", "B": "upper_right"}

    @classmethod
    def build(
        cls, base: float, half_diagonal: float, beta: tuple[float, float], phi: tuple[float, float]
    ) -> CellLayout:
        """The layout for edges of length `base`, half diagonals of length lambda, and the angles of
        both layers (rad).
        """
        edge = np.array([base, 0.0])
        rise = [
            np.array([lean * np.cos(b), np.sin(b)]) for lean, b in zip((-1, 1), beta, strict=True)
        ]
        left = [np.zeros(2), rise[0], rise[0] + rise[1]]
        right = [corner + edge for corner in left]
        slider_1 = _slider(left[0], right[1], half_diagonal, phi[0])
        slider_2 = _slider(right[1], left[2], half_diagonal, phi[1])
        points: dict[str, Point] = {}
        for row, at_left, at_right in zip(("lower", "middle", "upper"), left, right, strict=True):
            points |= {f"{row}_left": at_left, f"{row}_right": at_right}
        points |= {"slider_1_in": slider_1[0], "slider_1_out": slider_1[1]}
        points |= {"slider_2_in": slider_2[0], "slider_2_out": slider_2[1]}
        points |= {"mass_1": left[1] + edge / 2, "mass_2": left[2] + edge / 2}
        return cls(points)

    def to_xarray(self) -> xarray.Dataset:
        """The points and the names of the parts that join them, as `saltus.plot` draws them."""
        import xarray

        parts = {
            "position": (("point", "axis"), np.array(list(self.points.values())), {"units": "l"}),
            "bar": (("bar", "end"), np.array(self.bars)),
            "slider": (("slider_number", "end"), np.array(self.sliders)),
            "spring": ("spring_number", list(self.springs.values())),
        }
        return xarray.Dataset(
            parts, {"point": list(self.points)}, {"kind": "cell", "title": "a unit cell of saltus"}
        )

    def segment(self, pair: Pair) -> Point:
        """The two ends of a pair of names, as rows, shape (2, 2)."""
        return np.array([self.points[pair[0]], self.points[pair[1]]])


def _slider(start: Point, end: Point, half: float, phi: float) -> tuple[Point, Point]:
    """The ends of the two halves of a diagonal, each turned by phi against the line from `start` to
    `end`.
    """
    line = (end - start) / np.hypot(*(end - start))
    turned = np.array(
        [
            np.cos(phi) * line[0] - np.sin(phi) * line[1],
            np.sin(phi) * line[0] + np.cos(phi) * line[1],
        ]
    )
    return start + half * turned, end - half * turned
