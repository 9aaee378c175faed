"""One open layer under constant loads, as a one-sided oscillator: the basis of the closed forms
here.

Here are its energies, and the amplitudes beyond which a motion is no longer one of the real
mechanism.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import Numbers
from saltus.errors import ParameterError
from saltus.systems import Constant, Metainterface, System, finite_array, parameter_table
from saltus.theory.arguments import check_shapes, check_side, numbers


@dataclass(frozen=True, slots=True)
class Layer:
    """The layer open on one side, in its opening x = s theta >= 0 (`gov_eqn_theta_long` under
    constant loads):

        mass x'' + damping x' + stiffness x = outward sin(beta0 + x) + vertical cos(beta0 + x)

    with the powers P taken: mass (1+m)^P, damping c^P C, stiffness k^P, outward s (1+h)^P H,
    vertical (1+v)^P V.

    Attributes
    ----------
    side
        +1 for the lower layer, -1 for the upper one.
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    mass
        (1+m)^P.
    damping
        c^P C.
    stiffness
        k^P.
    outward
        s (1+h)^P H.
    vertical
        (1+v)^P V.

    Examples
    --------
    >>> saltus.theory.open_layer(tristable, 1).mass
    1.0
    """

    side: int
    beta0: float
    mass: float
    damping: float
    stiffness: float
    outward: float
    vertical: float

    @property
    def kinematic_limit(self) -> float:
        """The largest opening of the mechanism, 2 (pi - beta0) (errata 20), rad."""
        return 2 * (math.pi - self.beta0)

    @property
    def scale(self) -> float:
        """The size of the moments, stiffness + hypot(H, V), against which rounding is judged."""
        return self.stiffness + math.hypot(self.outward, self.vertical)

    def push(self, x: Any) -> Any:
        """The outward moment of the loads at the opening x.

        Parameters
        ----------
        x
            The opening of the layer, rad; any shape.
        """
        return self.outward * np.sin(self.beta0 + x) + self.vertical * np.cos(self.beta0 + x)

    def potential(self, x: Any) -> Any:
        """P (`pot_balance0`), zero at x = 0; the differences of sines are written as products,
        which are exact for small x.

        Parameters
        ----------
        x
            The opening of the layer, rad; any shape.
        """
        half = np.sin(x / 2)
        middle = self.beta0 + x / 2
        work = 2 * half * (self.outward * np.sin(middle) + self.vertical * np.cos(middle))
        return self.stiffness * x * x / 2 - work

    def slope(self, x: Any) -> Any:
        """dP/dx, the moment that closes the layer.

        Parameters
        ----------
        x
            The opening of the layer, rad; any shape.
        """
        return self.stiffness * x - self.push(x)

    def curvature(self, x: Any) -> Any:
        """d2P/dx2; at x = 0 the stiffness kappa of the linearised equation.

        Parameters
        ----------
        x
            The opening of the layer, rad; any shape.
        """
        return (
            self.stiffness
            - self.outward * np.cos(self.beta0 + x)
            + self.vertical * np.sin(self.beta0 + x)
        )

    def eigenvalues(self, curvature: float) -> tuple[complex, complex]:
        """The eigenvalues of the motion linearised at an equilibrium with d2P/dx2 = `curvature`,
        the faster growing one first.

        Parameters
        ----------
        curvature
            d2P/dx2.
        """
        root = cmath.sqrt(self.damping**2 - 4 * self.mass * curvature)
        return (-self.damping + root) / (2 * self.mass), (-self.damping - root) / (2 * self.mass)

    def inflections(self) -> list[float]:
        """The openings inside the kinematic limit where d2P/dx2 = 0, in closed form, increasing."""
        force = math.hypot(self.outward, self.vertical)
        if force <= self.stiffness:
            return []
        angle = math.atan2(self.outward, self.vertical)  # push = force cos(beta0 + x - angle)
        dip = math.asin(self.stiffness / force)
        bases = (angle - dip - self.beta0, angle + math.pi + dip - self.beta0)
        found = {base + 2 * math.pi * n for base in bases for n in range(-2, 3)}
        return sorted(x for x in found if 1e-14 < x < self.kinematic_limit)


def open_layer(system: System, side: int) -> Layer:
    """The layer of a metainterface that is open on `side` (+1 the lower one, -1 the upper one),
    under constant loads.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    side
        +1 for the lower layer, -1 for the upper one.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> saltus.theory.open_layer(tristable, 1).mass
    1.0
    """
    check_side(side)
    model = metainterface(system)
    forces = constant_loads(system)
    lower = side > 0
    across = forces.get("horizontal", 0.0) + lower * forces.get("lower_horizontal", 0.0)
    along = forces.get("vertical", 0.0) + lower * forces.get("lower_vertical", 0.0)
    return Layer(
        side=side,
        beta0=model.beta0,
        mass=1 + lower * model.mass_ratio,
        damping=model.damping * (model.dissipation_ratio if lower else 1.0),
        stiffness=model.stiffness_ratio if lower else 1.0,
        outward=side * across,
        vertical=along,
    )


def layers(system: System) -> tuple[Layer, Layer]:
    """The lower layer (theta > 0) and the upper one (theta < 0).

    Parameters
    ----------
    system
        A metainterface under constant loads.

    Examples
    --------
    >>> lower, upper = saltus.theory.layers(tristable)
    >>> lower.mass, upper.mass
    (1.0, 1.0)
    """
    return open_layer(system, 1), open_layer(system, -1)


def metainterface(system: System) -> Metainterface:
    """The system's model, refused unless it is an exact `Metainterface`."""
    model = system.model
    if not isinstance(model, Metainterface):
        raise ParameterError(
            f"this closed form is for a Metainterface, got a {type(model).__name__}", "system"
        )
    if model.smoothing is not None:
        raise ParameterError(
            "this closed form is for the exact sign of theta; drop the model's smoothing",
            "model.smoothing",
        )
    return model


def constant_loads(system: System) -> dict[str, float]:
    """The value of each force channel; a constant displacement of the ground has no effect.

    Raises
    ------
    ParameterError
        A channel that varies in time.
    """
    for name, signal in system.load.channels.items():
        if not isinstance(signal, Constant):
            raise ParameterError(
                f"this closed form is for constant loads, but load.{name} varies in time; give "
                "it as a number",
                f"load.{name}",
            )
    return {
        name: s.value
        for name, s in system.load.channels.items()
        if isinstance(s, Constant) and "ground" not in name
    }


def potential_energy(system: System, theta: Numbers) -> Any:
    """P(theta) of `pot_balance0`, constant H and loads on the lower mass included, zero at theta =
    0; any shape, over K2:

        P = k^P theta^2 / 2 + V [sin(beta0) - sin(beta0 + abs(theta))] + s H [cos(beta0 +
        abs(theta)) - cos(beta0)]

    where V, H stand for (1+v)^P V, (1+h)^P H, and s for the sign of theta.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta
        The coordinate, rad; any shape.

    Raises
    ------
    ParameterError
        Another model, a smoothed sign, or a load that varies in time.

    Examples
    --------
    >>> float(saltus.theory.potential_energy(tristable, 0.0))
    0.0
    """
    return _by_side(system, theta, Layer.potential, odd=False)


def potential_slope(system: System, theta: Numbers) -> Any:
    """dP/dtheta, minus the moment on the open layer; at theta = 0 the mean of its two one-sided
    values. Any shape.

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta
        The coordinate, rad; any shape.

    Examples
    --------
    >>> state = saltus.theory.equilibria(tristable)[0]
    >>> round(abs(float(saltus.theory.potential_slope(tristable, state.theta))), 12)
    0.0
    """
    return _by_side(system, theta, Layer.slope, odd=True)


def total_energy(
    system: System, theta: Numbers, velocity: Numbers, side: Numbers | None = None
) -> Any:
    """E = T + P over K2, with the kinetic energy of the moving layer, (1+m)^P theta'^2 / 2 on a
    ground at rest (`kin_eng`).

    Parameters
    ----------
    system
        A metainterface under constant loads.
    theta, velocity
        Numbers or arrays that broadcast, rad and rad per unit of tau. The energy is nan where they
        are, as between the curves of a portrait.
    side
        +1 or -1 of the same shape; the sign of theta if not given.

    Raises
    ------
    ParameterError
        theta = 0 without `side` where the layers' masses differ: the moving mass is then not known.

    Examples
    --------
    >>> round(float(saltus.theory.total_energy(tristable, 0.0, 0.2)), 12)  # 0.2^2 / 2, at the contact
    0.02
    """
    theta = np.asarray(theta, dtype=float)
    velocity = np.asarray(velocity, dtype=float)
    sides = {} if side is None else {"side": numbers("side", side, at_least=-1.0, at_most=1.0)}
    check_shapes(theta=theta, velocity=velocity, **sides)
    lower, upper = layers(system)
    if side is None:
        if lower.mass != upper.mass and np.any((theta == 0) & (velocity != 0)):
            raise ParameterError(
                "side must be given where theta is 0, since the layers' masses differ; it says "
                "which one moves",
                "side",
            )
        side = np.where(theta < 0, -1, 1)
    kinetic = system.model.kinetic_energy(0.0, theta, velocity, np.asarray(side), system.load)
    energy = kinetic + potential_energy(system, theta)
    return energy if np.ndim(energy) else float(energy)


def _by_side(system: System, theta: Any, function: Any, odd: bool) -> Any:
    theta = np.asarray(theta, dtype=float)
    size = np.abs(theta)
    lower, upper = (function(layer, size) for layer in layers(system))
    value = np.where(theta > 0, lower, -upper if odd else upper)
    if odd:
        value = np.where(theta == 0, (lower - upper) / 2, value)
    return value if value.ndim else float(value)


@dataclass(frozen=True)
class AmplitudeLimit:
    """An amplitude beyond which a motion is not one of the real mechanism.

    Attributes
    ----------
    name
        The name of the margin.
    value
        The limit, rad; an array if it varies with a parameter that is given as an array.
    meaning
        The meaning of the limit, in words.

    Examples
    --------
    >>> saltus.theory.amplitude_limits(system)[0].name
    'line'
    """

    name: str
    value: Any
    meaning: str


def amplitude_limits(
    system: System, parameters: Mapping[str, Any] | None = None
) -> tuple[AmplitudeLimit, ...]:
    """The limits of the metainterface (erratum 20), pi - beta0 and 2 (pi - beta0); none are known
    for other models.

    Parameters
    ----------
    system
        What moves.
    parameters
        Values, by dotted path, that replace those of the system; numbers or arrays.

    Raises
    ------
    ParameterError
        A path that leads to no number of the system, or values that are no finite numbers.

    Examples
    --------
    >>> [round(float(limit.value), 9) for limit in saltus.theory.amplitude_limits(system)]  # 100 and 200 degrees
    [1.745329252, 3.490658504]
    """
    if not isinstance(system.model, Metainterface):
        return ()
    table = parameter_table(system, parameters)
    values = {path: finite_array(path, given) for path, given in table.items()}
    straight = math.pi - values.get("model.beta0", system.model.beta0)
    return (
        AmplitudeLimit("line", straight, "the straight line, pi - beta0"),
        AmplitudeLimit("kinematic", 2 * straight, "2 (pi - beta0), where the slider closes again"),
    )
