"""The metainterface with both of its layers: two coordinates, two contacts (paper, `eomnl`); and
chains of such cells, with springs between the masses of neighbouring cells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from saltus.number_ranges import number_range
from saltus.systems.catalogue.metainterface import LayeredCell
from saltus.systems.contracts.contact_model import MOST_CONTACTS, Contact, ContactModel, reactions
from saltus.systems.contracts.model import IMAGE_ROUNDING, Count, MarginKind
from saltus.systems.loads.load import Load, reversed_load
from saltus.systems.loads.signals import vanishes

CONTACTS = (
    Contact(name="lower", coordinate="theta_1"),
    Contact(name="upper", coordinate="theta_2", sign=-1),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoLayer(LayeredCell, ContactModel):
    """The metainterface with theta_1 >= 0 of the lower and theta_2 <= 0 of the upper layer (paper,
    `eomnl`).

        M(theta) theta'' + C theta' + D(theta) theta'^2 + K theta = f(theta, tau),   S = 2 beta0 +
        theta_1 - theta_2, M = [[1+m, -cos S], [-cos S, 1]],  C = C diag(c, 1),  D = [[0, -sin S],
        [sin S, 0]],  K = diag(k, 1), f_1 = [(1+h) H - (1+m) zeta''] sin(beta0 + theta_1) + [(1+v) V
        - (1+m) nu''] cos(beta0 + theta_1), f_2 = [H - zeta''] sin(beta0 - theta_2) - [V - nu'']
        cos(beta0 - theta_2).

    A layer that is closed stays at theta_j = 0 while its contact pushes. Impacts follow the
    system's law (`NewtonImpact`), and contacts are treated exactly, whichever layers are open. With
    m = 0 the mass matrix is singular where sin S = 0, that is beta_1 + beta_2 = pi: a motion with
    both layers open ends there, as nothing determines how the massless lower mass moves.

    Angles and velocities are pairs (lower, upper) of numbers or arrays; matrices have the shape (2,
    2), or (2, 2, ...) for arrays. Energies are per K2. The load channels are those of
    `Metainterface`.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    damping
        C, the damping of the upper layer, at least 0.
    stiffness_ratio
        k = K1 / K2, above 0.
    mass_ratio
        m = M1 / M2, at least 0.
    dissipation_ratio
        c = C1 / C2, at least 0.

    Examples
    --------
    >>> both = saltus.System(model=saltus.TwoLayer(beta0=1.4), load=saltus.Load(vertical=-0.1))
    >>> saltus.simulate(both, theta_1=0.2, theta_2=0.0, duration=1.0).closed
    ('upper',)
    """

    coordinates: ClassVar[tuple[str, ...]] = ("theta_1", "theta_2")
    units: ClassVar[tuple[str, ...]] = ("rad", "rad")
    margin_kinds: ClassVar[dict[str, MarginKind]] = {
        **dict.fromkeys(("lower_line_limit", "upper_line_limit"), MarginKind.LANDMARK),
        **dict.fromkeys(("lower_kinematic_limit", "upper_kinematic_limit"), MarginKind.LIMIT),
    }
    stops: ClassVar[tuple[str, ...]] = ("lower_kinematic_limit", "upper_kinematic_limit")
    singularity: ClassVar[str] = "massless_hinge"
    transfers: ClassVar[bool] = True

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The contact of the lower layer, theta_1 >= 0, and that of the upper layer, theta_2 <=
        0.
        """
        return CONTACTS

    @property
    def contact(self) -> Any:
        """Both layers closed."""
        return (0.0, 0.0)

    @property
    def images(self) -> tuple[str, ...]:
        """The mirror swaps the layers."""
        return self.coordinates[::-1]

    def mirror(self, load: Load) -> Load | None:
        """The load with its horizontal channels reversed, for m = 0, k = c = 1 and no loads on the
        lower mass; None otherwise.
        """
        lower = any(
            not vanishes(signal)
            for name, signal in load.channels.items()
            if name.startswith("lower_")
        )
        if (
            lower
            or self.mass_ratio != 0.0
            or not math.isclose(self.stiffness_ratio, 1.0, rel_tol=IMAGE_ROUNDING)
            or not math.isclose(self.dissipation_ratio, 1.0, rel_tol=IMAGE_ROUNDING)
        ):
            return None
        return reversed_load(load, "horizontal")

    def mass_matrix(self, theta: Any) -> Any:
        """M(theta)."""
        coupling = -np.cos(self._sum(theta))
        return _matrix(1 + self.mass_ratio + 0 * coupling, coupling, coupling, 1 + 0 * coupling)

    def damping_matrix(self) -> Any:
        """C = C diag(c, 1)."""
        return _matrix(self.damping * self.dissipation_ratio, 0, 0, self.damping)

    def velocity_matrix(self, theta: Any) -> Any:
        """D(theta), which multiplies the squares of the velocities.

        Parameters
        ----------
        theta
            theta_1 and theta_2, rad.
        """
        coupling = np.sin(self._sum(theta))
        return _matrix(0 * coupling, -coupling, coupling, 0 * coupling)

    def stiffness_matrix(self) -> Any:
        """K = diag(k, 1)."""
        return _matrix(self.stiffness_ratio, 0, 0, 1)

    def load_vector(self, t: Any, theta: Any, load: Load) -> tuple[Any, Any]:
        """f(theta, tau): the loads and the ground's accelerations.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            theta_1 and theta_2, rad.
        load
            The load.
        """
        zeta = load.ground_horizontal.acceleration(t)
        nu = load.ground_vertical.acceleration(t)
        return self._push(t, theta, load, zeta, nu)

    def linear_stiffness_matrix(self, t: Any, load: Load) -> Any:
        """K0(tau) = diag(kappa_1, kappa_2), the stiffness less the linear part of f, at theta = 0.

        kappa_1 = k - cos(beta0) [(1+h) H - (1+m) zeta''] + sin(beta0) [(1+v) V - (1+m) nu''] and
        kappa_2 = 1 + cos(beta0) [H - zeta''] + sin(beta0) [V - nu''].
        M0 and f0 are `mass_matrix` and `load_vector` at `contact`; C is unchanged.

        Parameters
        ----------
        t
            The dimensionless time tau.
        load
            The load.
        """
        zeta = load.ground_horizontal.acceleration(t)
        nu = load.ground_vertical.acceleration(t)
        (across_1, along_1), (across_2, along_2) = self._loads(t, load, zeta, nu)
        sine = np.sin(self.beta0)
        cosine = np.cos(self.beta0)
        kappa_1 = self.stiffness_ratio - across_1 * cosine + along_1 * sine
        kappa_2 = 1 + across_2 * cosine + along_2 * sine
        return _matrix(kappa_1, 0 * kappa_1, 0 * kappa_2, kappa_2)

    def force(self, t: Any, theta: Any, velocity: Any, load: Load) -> tuple[Any, Any]:
        """r = f - C theta' - D theta'^2 - K theta, the moments that accelerate the layers."""
        twist = np.sin(self._sum(theta))
        push = self.load_vector(t, theta, load)
        viscous = self.damping * self.dissipation_ratio * velocity[0]
        return (
            push[0]
            - viscous
            - self.stiffness_ratio * theta[0]
            + twist * (velocity[1] * velocity[1]),
            push[1] - self.damping * velocity[1] - theta[1] - twist * (velocity[0] * velocity[0]),
        )

    def constraint_reactions(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, load: Load
    ) -> tuple[Any, Any]:
        """(R_1, R_2) = M theta'' + C theta' + D theta'^2 + K theta - f, the reactions of the
        contacts (erratum 21).

        Both vanish in free motion. A closed layer (theta_j = theta_j' = theta_j'' = 0) stays closed
        while R_1 >= 0 or R_2 <= 0.

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            theta_1 and theta_2, rad.
        velocity
            The rates of theta_1 and theta_2.
        acceleration
            Their second derivatives.
        load
            The load.
        """
        first, second = reactions(self, t, theta, velocity, acceleration, load)
        return first, -second

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """T / K2 of `kin_eng`, with the velocities of both masses in the inertial frame."""
        lower = self.beta0 + theta[0]
        upper = self.beta0 - theta[1]
        x_1 = load.ground_horizontal.velocity(t) + np.sin(lower) * velocity[0]
        y_1 = load.ground_vertical.velocity(t) + np.cos(lower) * velocity[0]
        x_2 = x_1 + np.sin(upper) * velocity[1]
        y_2 = y_1 - np.cos(upper) * velocity[1]
        return (self.mass_ratio * (x_1 * x_1 + y_1 * y_1) + x_2 * x_2 + y_2 * y_2) / 2

    def potential_energy(self, theta: Any) -> Any:
        """Pi / K2 = (k theta_1^2 + theta_2^2) / 2 of the springs (`pot_eng_beta`).

        Parameters
        ----------
        theta
            theta_1 and theta_2, rad.
        """
        return (self.stiffness_ratio * theta[0] * theta[0] + theta[1] * theta[1]) / 2

    def dissipation(self, velocity: Any) -> Any:
        """R / K2 = C (c theta_1'^2 + theta_2'^2) / 2 (`Rayleigh`).

        Parameters
        ----------
        velocity
            The rates of theta_1 and theta_2.
        """
        return (
            self.damping
            * (self.dissipation_ratio * velocity[0] * velocity[0] + velocity[1] * velocity[1])
            / 2
        )

    def generalised_forces(self, t: Any, theta: Any, load: Load) -> tuple[Any, Any]:
        """Q_j / K2 of the loads alone, without the ground (`ext_forces_beta`).

        Parameters
        ----------
        t
            The dimensionless time tau.
        theta
            theta_1 and theta_2, rad.
        load
            The load.
        """
        return self._push(t, theta, load, 0.0, 0.0)

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load
    ) -> dict[str, Any]:
        """The distance of each layer from the straight line and from the kinematic limit (errata
        19, 20).
        """
        opening = math.pi - self.beta0
        return {
            "lower_line_limit": opening - theta[0],
            "upper_line_limit": opening + theta[1],
            "lower_kinematic_limit": 2 * opening - theta[0],
            "upper_kinematic_limit": 2 * opening + theta[1],
        }

    def _sum(self, theta: Any) -> Any:
        """S = beta_1 + beta_2."""
        return 2 * self.beta0 + theta[0] - theta[1]

    def _loads(
        self, t: Any, load: Load, zeta: Any, nu: Any
    ) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
        """(1+h)^P H - (1+m)^P zeta'' and (1+v)^P V - (1+m)^P nu'' with P = 1 for the lower, P = 0
        for the upper layer.
        """
        mass = 1 + self.mass_ratio
        across = load.horizontal(t)
        along = load.vertical(t)
        lower = (
            across + load.lower_horizontal(t) - mass * zeta,
            along + load.lower_vertical(t) - mass * nu,
        )
        return lower, (across - zeta, along - nu)

    def _push(self, t: Any, theta: Any, load: Load, zeta: Any, nu: Any) -> tuple[Any, Any]:
        (across_1, along_1), (across_2, along_2) = self._loads(t, load, zeta, nu)
        lower = self.beta0 + theta[0]
        upper = self.beta0 - theta[1]
        return (
            across_1 * np.sin(lower) + along_1 * np.cos(lower),
            across_2 * np.sin(upper) - along_2 * np.cos(upper),
        )


def _matrix(a: Any, b: Any, c: Any, d: Any) -> Any:
    return np.array([[a, b], [c, d]])


@dataclass(frozen=True, slots=True, kw_only=True)
class CellChain(LayeredCell, ContactModel):
    """Cells side by side, each a `TwoLayer` with the same numbers and loads.

    Long horizontal springs join each mass to that of the same layer in the neighbouring cell: with
    the displacements

        u_1 = cos(beta0) - cos(beta0 + theta_1),    u_2 = u_1 + cos(beta0 - theta_2) - cos(beta0)

    of the lower and the upper mass of a cell, in units of l. The energy of the springs per K2 is a
    sum over neighbouring cells, kappa / 2 times the square of the difference of u_j. Coordinates
    are theta_1 >= 0 (`lower_1`, `lower_2`, ...) and theta_2 <= 0 (`upper_1`, ...); each has a
    contact of the same name. An impact passes its speed on within its cell only.

    Parameters
    ----------
    beta0, damping, stiffness_ratio, mass_ratio, dissipation_ratio
        As for `TwoLayer`, the same in all cells.
    cells
        How many cells there are, from 1 to 32. It is part of the structure, as the classes of a
        system's parts are: its equations are compiled for each number of cells, and nothing is
        computed along it.
    coupling
        kappa, the stiffness of a spring times length squared, over K2; at least 0.

    Raises
    ------
    ParameterError
        A number outside its range, or a number of cells that is not whole.

    Examples
    --------
    >>> saltus.CellChain(beta0=1.4, cells=3, coupling=0.5).coordinates
    ('lower_1', 'upper_1', 'lower_2', 'upper_2', 'lower_3', 'upper_3')
    """

    cells: int = field(
        default=2, metadata=number_range(at_least=1, at_most=MOST_CONTACTS // 2, whole=True)
    )
    # kappa = stiffness of a spring times length squared, over K2
    coupling: float = field(default=0.1, metadata=number_range(at_least=0.0))

    singularity: ClassVar[str] = "massless_hinge"
    transfers: ClassVar[bool] = True

    def __post_init__(self) -> None:
        LayeredCell.__post_init__(self)
        object.__setattr__(self, "cells", Count(self.cells))

    @property
    def coordinates(self) -> tuple[str, ...]:  # type: ignore[override]  # a class whose numbers say how many it has
        """The angles of the lower and of the upper layer of each cell."""
        return _names(self.cells)

    @property
    def stops(self) -> tuple[str, ...]:  # type: ignore[override]
        """All margins: no layer has positions beyond its kinematic limit."""
        return tuple(f"{name}_kinematic_limit" for name in self.coordinates)

    def unit_of(self, coordinate: str) -> str:
        """Radians."""
        return "rad"

    @property
    def contact(self) -> Any:
        """All layers closed."""
        return (0.0,) * (2 * self.cells)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """Two contacts for each cell, in the order of the coordinates."""
        return _contacts_at(self.coordinates)

    def cell(self) -> TwoLayer:
        """One cell by itself, made without checks, as its numbers may be symbols."""
        cell = object.__new__(TwoLayer)
        for name, value in self.cell_numbers.items():
            object.__setattr__(cell, name, value)
        return cell

    def mass_matrix(self, theta: Any) -> Any:
        """The mass matrices of the cells, as blocks on the diagonal."""
        size = 2 * self.cells
        one = self.cell()
        matrix: list[list[Any]] = [[0.0] * size for _ in range(size)]
        for i in range(0, size, 2):
            block = one.mass_matrix(theta[i : i + 2])
            matrix[i][i : i + 2] = list(block[0])
            matrix[i + 1][i : i + 2] = list(block[1])
        return matrix

    def displacements(self, theta: Any) -> list[tuple[Any, Any]]:
        """(u_1, u_2) of each cell.

        Parameters
        ----------
        theta
            The angles of all layers, radians, in the order of `coordinates`.
        """
        base = np.cos(self.beta0)
        found = []
        for i in range(0, 2 * self.cells, 2):
            lower = base - np.cos(self.beta0 + theta[i])
            found.append((lower, lower + np.cos(self.beta0 - theta[i + 1]) - base))
        return found

    def force(self, t: Any, theta: Any, velocity: Any, load: Load) -> tuple[Any, ...]:
        """The forces of each cell, and those of the springs between the cells."""
        one = self.cell()
        u = self.displacements(theta)
        forces = []
        for i in range(self.cells):
            angles = theta[2 * i : 2 * i + 2]
            rates = velocity[2 * i : 2 * i + 2]
            lower, upper = one.force(t, angles, rates, load)
            beside = [u[j] for j in (i - 1, i + 1) if 0 <= j < self.cells]
            first, second = (
                self.coupling * sum(other[j] - u[i][j] for other in beside) for j in (0, 1)
            )
            forces += [
                lower + (first + second) * np.sin(self.beta0 + angles[0]),
                upper + second * np.sin(self.beta0 - angles[1]),
            ]
        return tuple(forces)

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """The sum of the cells' energies, per K2."""
        one = self.cell()
        size = 2 * self.cells
        return sum(
            one.kinetic_energy(t, theta[i : i + 2], velocity[i : i + 2], side, load)
            for i in range(0, size, 2)
        )

    def potential_energy(self, theta: Any) -> Any:
        """Pi / K2 of all springs, those between the cells included.

        Parameters
        ----------
        theta
            The angles of all layers, radians, in the order of `coordinates`.
        """
        one = self.cell()
        u = self.displacements(theta)
        size = 2 * self.cells
        between = sum((a[j] - b[j]) * (a[j] - b[j]) for a, b in pairwise(u) for j in (0, 1))
        return (
            sum(one.potential_energy(theta[i : i + 2]) for i in range(0, size, 2))
            + self.coupling * between / 2
        )

    def margins(
        self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load
    ) -> dict[str, Any]:
        """The distance of each layer from the kinematic limit (errata 19, 20), where the motion
        stops.
        """
        signs = (1, -1) * self.cells
        angles = zip(self.coordinates, signs, theta, strict=True)
        return {
            f"{name}_kinematic_limit": 2 * (math.pi - self.beta0) - sign * angle
            for name, sign, angle in angles
        }

    def margin_kind(self, margin: str) -> MarginKind:
        """All margins are limits."""
        return MarginKind.LIMIT


@cache
def _names(cells: int) -> tuple[str, ...]:
    return tuple(f"{layer}_{cell}" for cell in range(1, cells + 1) for layer in ("lower", "upper"))


@cache
def _contacts_at(coordinates: tuple[str, ...]) -> tuple[Contact, ...]:
    names = zip(coordinates, (1, -1) * (len(coordinates) // 2), strict=True)
    return tuple(
        Contact(name=name, coordinate=name, sign=sign, group=name.split("_")[1])
        for name, sign in names
    )
