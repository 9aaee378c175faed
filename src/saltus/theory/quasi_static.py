"""Quasi-static loading: the monostable domain of the undeformed state, the border of a chart by it,
and static angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Numbers, check_number
from saltus.errors import ParameterError
from saltus.result import Result
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.theory.layer import open_layer
from saltus.theory.loaded_equilibria import zeros_of_slope

if TYPE_CHECKING:
    import xarray
from saltus.theory.arguments import check_shapes, numbers


def critical_horizontal(beta0: float, vertical: Numbers, swing: float = 0.0) -> Any:
    """Hcr = abs(cot(beta0)) sqrt(V^2 - swing^2), the least amplitude at which the undeformed state
    is lost, any shape of V.

    Without a swing this is the paper's QSB line, abs(V / tan(beta0)). Under load (iii), where V +
    swing cos(tau) goes with Hhat sin(tau), it is the ellipse that touches the border V cos(beta0) =
    -abs(H) sin(beta0) (errata 35): the largest of tan(beta0) Hhat sin(tau) + swing cos(tau) is
    sqrt((tan(beta0) Hhat)^2 + swing^2), which must reach abs(V).

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        V, or its mean where it swings; any shape.
    swing
        The amplitude of V, for load (iii).

    Raises
    ------
    ParameterError
        V cos(beta0) > 0, where the undeformed state is unstable for every H; a swing larger than V.

    Examples
    --------
    >>> round(float(saltus.theory.critical_horizontal(np.pi / 4, -0.5)), 12)  # abs(V) / tan(beta0)
    0.5
    """
    _check_angle(beta0)
    vertical = numbers("vertical", vertical)
    if np.any(vertical * math.cos(beta0) > 0):
        raise ParameterError(
            "V cos(beta0) must not be above 0, or theta = 0 is unstable for every H; got V = "
            f"{vertical!r}",
            "vertical",
        )
    check_number("swing", swing)
    if np.any(np.abs(vertical) < abs(swing)):
        raise ParameterError(
            "swing must be at most abs(V), or theta = 0 is lost without a horizontal load; got "
            f"{swing!r}",
            "swing",
        )
    least = vertical**2 - swing**2
    return np.abs(np.sqrt(least) / math.tan(beta0))[()]


def fold_curve(beta0: float, opening: Numbers) -> tuple[Any, Any]:
    """The loads (H, V) at which two deformed equilibria of a symmetric system (k = 1) meet at theta
    = x >= 0, any shape:

        H = x sin(beta0 + x) + cos(beta0 + x),   V = x cos(beta0 + x) - sin(beta0 + x)

    These solve P' = x - H sin(beta0 + x) - V cos(beta0 + x) = 0 and P'' = 0, which are linear in H
    and V. The curve leaves the line V cos(beta0) = -H sin(beta0) at x = 0, V = -sin(beta0), tangent
    to it. Its mirror is H -> -H.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    opening
        x, rad; any shape.

    Raises
    ------
    ParameterError
        An opening out of [0, pi - beta0]; at pi - beta0 the curve has a cusp, and beyond it bounds
        nothing new.

    Examples
    --------
    >>> horizontal, vertical = saltus.theory.fold_curve(1.4, 0.1)
    >>> load = saltus.Load(horizontal=horizontal, vertical=vertical)
    >>> static = saltus.System(model=saltus.Metainterface(beta0=1.4), load=load)
    >>> round(abs(float(saltus.theory.potential_slope(static, 0.1))), 12)  # an equilibrium
    0.0
    """
    _check_angle(beta0)
    opening = numbers("opening", opening)
    if np.any((opening < 0) | (opening > math.pi - beta0)):
        raise ParameterError(
            f"the opening must lie in [0, {math.pi - beta0:.6g}] rad, the straight line", "opening"
        )
    angle = beta0 + opening
    return (opening * np.sin(angle) + np.cos(angle))[()], (opening * np.cos(angle) - np.sin(angle))[
        ()
    ]


def subcritical_vertical(beta0: float) -> float:
    """V = -sin(beta0), below which the buckling at Hcr is subcritical (errata 23), for beta0 <
    pi/2.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).

    Examples
    --------
    >>> round(float(saltus.theory.subcritical_vertical(np.pi / 6)), 12)  # -sin(beta0)
    -0.5
    """
    _check_angle(beta0, math.pi / 2)
    return -math.sin(beta0)


def unloaded_fold(beta0: float) -> tuple[float, float]:
    """The V below which deformed equilibria exist without any H (k = 1, beta0 < pi/2, errata 23),
    and their theta there:

    x = -cot(beta0 + x),   V = -1 / sin(beta0 + x),   the point H = 0 of `fold_curve`

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).

    Examples
    --------
    >>> len(saltus.theory.unloaded_fold(1.4))
    2
    """
    from scipy.optimize import brentq

    _check_angle(beta0, math.pi / 2)
    opening = float(
        brentq(
            lambda x: fold_curve(beta0, x)[0],
            math.pi / 2 - beta0,
            math.pi - beta0,
            xtol=1e-15,
            rtol=1e-15,
        )
    )
    return -1 / math.sin(beta0 + opening), opening


def fold_horizontal(beta0: float, vertical: Numbers) -> Any:
    """The abs(H) above which deformed equilibria exist for V <= -sin(beta0), any shape of V (k = 1,
    beta0 < pi/2, errata 23).

    It is the H of `fold_curve` at this V, found by bisection, as V falls with the opening, dV/dx =
    -x sin(beta0 + x) < 0. It is 0 below `unloaded_fold`, where the equilibria exist without any H,
    and never above Hcr.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    vertical
        The constant load V.

    Raises
    ------
    ParameterError
        V above -sin(beta0): the buckling is then supercritical and Hcr itself is the border.

    Examples
    --------
    >>> horizontal, vertical = saltus.theory.fold_curve(1.4, 0.1)
    >>> round(float(saltus.theory.fold_horizontal(1.4, vertical) / abs(horizontal)), 9)
    1.0
    """
    _check_angle(beta0, math.pi / 2)
    vertical = numbers("vertical", vertical)
    if np.any(vertical > -math.sin(beta0)):
        largest = -math.sin(beta0)
        raise ParameterError(
            f"a fold needs V <= -sin(beta0) = {largest:.6g}, above which Hcr is the border; got "
            f"V = {vertical!r}",
            "vertical",
        )
    low = np.zeros_like(vertical)
    high = np.full_like(vertical, unloaded_fold(beta0)[1])
    for _ in range(60):
        middle = (low + high) / 2
        above = fold_curve(beta0, middle)[1] > vertical
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.maximum(fold_curve(beta0, (low + high) / 2)[0], 0.0)[()]


def is_monostable(beta0: float, horizontal: Numbers, vertical: Numbers) -> Any:
    """Whether the undeformed state is the only equilibrium of a symmetric system (k = 1) under
    constant H and V (errata 23).

    True where V cos(beta0) < -abs(H) sin(beta0), the domain of Fig. 8, and, if V < -sin(beta0) with
    beta0 < pi/2, abs(H) is also below the fold of equilibria. It suffices to consider the layer
    that H pushes open, before the straight line: the push on the other layer at beta0 + x is that
    on this one at 2 pi - beta0 - x, so that any other equilibrium implies one of this layer at a
    smaller opening. Broadcasts; arrays of bool.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    horizontal
        The constant load H.
    vertical
        The constant load V.

    Examples
    --------
    >>> bool(saltus.theory.is_monostable(1.4, 0.0, -0.5))
    True
    """
    _check_angle(beta0)
    size, vertical = np.abs(numbers("horizontal", horizontal)), numbers("vertical", vertical)
    check_shapes(horizontal=size, vertical=vertical)
    held = vertical * math.cos(beta0) < -size * math.sin(beta0)
    if beta0 < math.pi / 2:
        subcritical = vertical <= -math.sin(beta0)
        held = held & (
            ~subcritical | (size < fold_horizontal(beta0, np.minimum(vertical, -math.sin(beta0))))
        )
    return held[()]


def static_angle(beta0: float, horizontal: float, vertical: float) -> float:
    """theta_st, the equilibrium that replaces the undeformed state as H grows beyond Hcr to its
    amplitude, V constant (k = 1).

    The smallest positive zero of P', stable because the loads push open at contact.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    horizontal
        The amplitude H.
    vertical
        The constant load V.

    Raises
    ------
    ParameterError
        abs(H) <= Hcr, where the undeformed state is stable and theta_st does not exist; no
        equilibrium before the kinematic limit.

    Examples
    --------
    >>> theta = saltus.theory.static_angle(1.4, 0.2, -0.5)
    >>> static = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(horizontal=0.2, vertical=-0.5))
    >>> round(abs(float(saltus.theory.potential_slope(static, theta))), 9)
    0.0
    """
    size = abs(horizontal)
    critical = critical_horizontal(beta0, vertical)
    if size <= critical:
        raise ParameterError(
            f"abs(H) = {size:.6g} must exceed Hcr = {critical:.6g} for theta_st to exist",
            "horizontal",
        )
    system = System(model=Metainterface(beta0=beta0), load=Load(horizontal=size, vertical=vertical))
    angle = next(zeros_of_slope(open_layer(system, 1)), None)
    if angle is None:
        raise ParameterError(
            f"no equilibrium before the kinematic limit under H = {size!r}, V = {vertical!r}",
            "horizontal",
        )
    return angle


def equivalent_angle(beta0: float, ground_amplitude: Numbers) -> Any:
    """theta_eq = arccos(cos(beta0) - zetahat) - beta0, the opening whose horizontal displacement is
    zetahat, any shape.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    ground_amplitude
        zetahat, the amplitude of the ground; any shape.

    Raises
    ------
    ParameterError
        zetahat out of [0, 1 + cos(beta0)], the largest displacement (`max_disp_condition`).

    Examples
    --------
    >>> float(saltus.theory.equivalent_angle(1.4, 0.0))  # on a ground that does not move
    0.0
    """
    _check_angle(beta0)
    amplitude = numbers("ground_amplitude", ground_amplitude)
    largest = 1 + math.cos(beta0)
    if not np.all((amplitude >= 0) & (amplitude <= largest)):
        raise ParameterError(
            f"zetahat must lie in [0, {largest:.6g}], that is 1 + cos(beta0), got "
            f"{ground_amplitude!r}",
            "ground_amplitude",
        )
    return (np.arccos(np.maximum(math.cos(beta0) - amplitude, -1.0)) - beta0)[()]


def _check_angle(beta0: float, below: float = math.pi) -> None:
    check_number("beta0", beta0, above=0.0, below=below, unit="rad")


# the two parameters in whose plane the closed forms hold
LOAD_PLANE = ("load.horizontal.amplitude", "load.vertical")


@dataclass(frozen=True, eq=False)
class QuasiStaticBorder(Result):
    """Both parts of the border over the vertical load V; the true border is the lower one (erratum
    23).

    Attributes
    ----------
    vertical
        V, (n,).
    critical
        Hhat at which the undeformed state is lost: the paper's border.
    fold
        Hhat at the fold of deformed equilibria, nan where there is none.
    subcritical_below
        The V below which the fold comes first.

    Examples
    --------
    >>> plane = ("load.horizontal.amplitude", "load.vertical")
    >>> border = saltus.theory.quasi_static_border(system, plane, -1.0)
    >>> bool(np.allclose(border.critical, np.abs(border.vertical) / np.tan(system.model.beta0)))
    True
    """

    vertical: np.ndarray
    critical: np.ndarray
    fold: np.ndarray
    subcritical_below: float

    @property
    def true(self) -> np.ndarray:
        """The true border: the lower one of `critical` and `fold`."""
        return np.asarray(np.fmin(self.critical, self.fold))

    def to_xarray(self) -> xarray.Dataset:
        """The border as a Dataset along `vertical`."""
        import xarray as xr

        data = {
            "critical": (
                self.critical,
                "Hhat at which the undeformed state is lost (the paper's border)",
            ),
            "fold": (self.fold, "Hhat at the fold of deformed equilibria (erratum 23)"),
            "true": (self.true, "the lesser of both: the quasi-static border"),
        }
        variables = {
            name: ("vertical", values, {"units": "1", "long_name": text})
            for name, (values, text) in data.items()
        }
        axis = {"vertical": ("vertical", self.vertical, {"units": "1", "long_name": "V"})}
        return xr.Dataset(variables, axis, {"subcritical_below": self.subcritical_below})


def quasi_static_border(
    system: System, plane: tuple[str, ...], lowest: float
) -> QuasiStaticBorder | None:
    """The border over V from `lowest` to 0, or None where no closed form is known.

    It is known for the metainterface with k = 1 and beta0 below 90 degrees, under H = Hhat sin and
    a constant V < 0 alone, in the plane of Hhat and V.

    Parameters
    ----------
    system
        A metainterface under load (i).
    plane
        The dotted paths of the parameters along both axes, the horizontal one first.
    lowest
        The least V.

    Examples
    --------
    >>> plane = ("load.horizontal.amplitude", "load.vertical")
    >>> border = saltus.theory.quasi_static_border(system, plane, -1.0)
    >>> float(border.vertical.min())
    -1.0
    """
    check_number("lowest", lowest)
    model = system.model
    channels = system.load.channels
    if tuple(plane) != LOAD_PLANE or not isinstance(model, Metainterface):
        return None
    horizontal = channels.get("horizontal")
    known = (
        (model.stiffness_ratio, model.smoothing) == (1.0, None)
        and model.beta0 < math.pi / 2
        and set(channels) == {"horizontal", "vertical"}
        and isinstance(horizontal, Harmonic)
        and horizontal.mean == 0.0
        and lowest < 0.0
    )
    return border_over(model.beta0, lowest) if known else None


def border_over(beta0: float, lowest: float) -> QuasiStaticBorder:
    """The border of the metainterface with k = 1 over V from `lowest` to 0."""
    start = subcritical_vertical(beta0)
    end = unloaded_fold(beta0)[0]
    # dense near V = start, where the fold leaves as a power 3/2
    bend = end + (start - end) * np.linspace(0.0, 1.0, 101) ** 0.5
    ends = [
        np.linspace(lowest, end, 21),
        bend,
        np.linspace(end, start, 101),
        np.linspace(start, 0.0, 21),
    ]
    vertical = np.unique(np.concatenate(ends))
    vertical = vertical[vertical >= lowest]
    fold = np.full_like(vertical, np.nan)
    fold[vertical <= start] = fold_horizontal(beta0, vertical[vertical <= start])
    # deformed equilibria exist without any horizontal load; this removes the rounding of 0
    fold[vertical <= end] = 0.0
    return QuasiStaticBorder(vertical, critical_horizontal(beta0, vertical), fold, start)
