"""Chains of cells of the metainterface: cells with two layers, and springs between the masses of neighbouring cells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from saltus.checks import check_count, settle_numbers
from saltus.systems.contact_model import MOST_CONTACTS, Contact, ContactModel
from saltus.systems.load import Load
from saltus.systems.metainterface import LayeredCell
from saltus.systems.model import Count, MarginKind
from saltus.systems.two_layer import TwoLayer


@dataclass(frozen=True, slots=True, kw_only=True)
class CellChain(LayeredCell, ContactModel):
    """Cells side by side, each a `TwoLayer` with the same numbers and loads.

    Long horizontal springs join each mass to that of the same layer in the neighbouring cell: with the displacements

        u_1 = cos(beta0) - cos(beta0 + theta_1),    u_2 = u_1 + cos(beta0 - theta_2) - cos(beta0)

    of the lower and the upper mass of a cell, in units of l, the energy of the springs per K2 is kappa / 2 times the sum of the
    squares of the differences of u_j between neighbouring cells. Coordinates are theta_1 >= 0 (`lower_1`, `lower_2`, ...) and
    theta_2 <= 0 (`upper_1`, ...); each has a contact of the same name. An impact passes its speed on within its cell only.

    Parameters
    ----------
    beta0
        The angle of the undeformed cell, rad, in (0, pi).
    cells
        How many cells there are, from 1 to 32. It is part of the structure, as the classes of a system's parts are: its equations
        are compiled for each number of cells, and nothing is computed along it.
    coupling
        kappa, the stiffness of a spring times length squared, over K2; at least 0.
    damping
        C, the damping of the upper layer, at least 0.
    stiffness_ratio
        k = K1 / K2, above 0.
    mass_ratio
        m = M1 / M2, at least 0.
    dissipation_ratio
        c = C1 / C2, at least 0.

    Raises
    ------
    ParameterError
        A number outside its range, or a number of cells that is not whole.

    Examples
    --------
    >>> saltus.CellChain(beta0=1.4, cells=3, coupling=0.5).coordinates
    ('lower_1', 'upper_1', 'lower_2', 'upper_2', 'lower_3', 'upper_3')
    """

    cells: int = 2
    coupling: float = 0.1  # kappa = stiffness of a spring times length squared, over K2; at least 0

    singularity: ClassVar[str] = "massless_hinge"
    transfers: ClassVar[bool] = True

    def __post_init__(self) -> None:
        LayeredCell.__post_init__(self)
        settle_numbers(self, "coupling", at_least=0.0)
        check_count("cells", self.cells, at_least=1, at_most=MOST_CONTACTS // 2)
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
        size, one = 2 * self.cells, self.cell()
        matrix: list[list[Any]] = [[0.0] * size for _ in range(size)]
        for i in range(0, size, 2):
            block = one.mass_matrix(theta[i : i + 2])
            matrix[i][i : i + 2], matrix[i + 1][i : i + 2] = list(block[0]), list(block[1])
        return matrix

    def displacements(self, theta: Any) -> list[tuple[Any, Any]]:
        """(u_1, u_2) of each cell.

        Parameters
        ----------
        theta
            The angles of all layers, radians, in the order of `coordinates`.
        """
        base, found = np.cos(self.beta0), []
        for i in range(0, 2 * self.cells, 2):
            lower = base - np.cos(self.beta0 + theta[i])
            found.append((lower, lower + np.cos(self.beta0 - theta[i + 1]) - base))
        return found

    def force(self, t: Any, theta: Any, velocity: Any, load: Load) -> tuple[Any, ...]:
        """The forces of each cell, and those of the springs between the cells."""
        one, u, forces = self.cell(), self.displacements(theta), []
        for i in range(self.cells):
            angles, rates = theta[2 * i : 2 * i + 2], velocity[2 * i : 2 * i + 2]
            lower, upper = one.force(t, angles, rates, load)
            beside = [u[j] for j in (i - 1, i + 1) if 0 <= j < self.cells]
            first, second = (self.coupling * sum(other[j] - u[i][j] for other in beside) for j in (0, 1))
            forces += [
                lower + (first + second) * np.sin(self.beta0 + angles[0]),
                upper + second * np.sin(self.beta0 - angles[1]),
            ]
        return tuple(forces)

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Load) -> Any:
        """The sum of the cells' energies, per K2."""
        one, size = self.cell(), 2 * self.cells
        return sum(one.kinetic_energy(t, theta[i : i + 2], velocity[i : i + 2], side, load) for i in range(0, size, 2))

    def potential_energy(self, theta: Any) -> Any:
        """Pi / K2 of all springs, those between the cells included.

        Parameters
        ----------
        theta
            The angles of all layers, radians, in the order of `coordinates`.
        """
        one, u, size = self.cell(), self.displacements(theta), 2 * self.cells
        between = sum((a[j] - b[j]) * (a[j] - b[j]) for a, b in pairwise(u) for j in (0, 1))
        return sum(one.potential_energy(theta[i : i + 2]) for i in range(0, size, 2)) + self.coupling * between / 2

    def margins(self, t: Any, theta: Any, velocity: Any, acceleration: Any, side: Any, load: Load) -> dict[str, Any]:
        """The distance of each layer from the kinematic limit (errata 19, 20), where the motion stops."""
        signs = (1, -1) * self.cells
        angles = zip(self.coordinates, signs, theta, strict=True)
        return {f"{name}_kinematic_limit": 2 * (math.pi - self.beta0) - sign * angle for name, sign, angle in angles}

    def margin_kind(self, margin: str) -> MarginKind:
        """All margins are limits."""
        return MarginKind.LIMIT


@cache
def _names(cells: int) -> tuple[str, ...]:
    return tuple(f"{layer}_{cell}" for cell in range(1, cells + 1) for layer in ("lower", "upper"))


@cache
def _contacts_at(coordinates: tuple[str, ...]) -> tuple[Contact, ...]:
    names = zip(coordinates, (1, -1) * (len(coordinates) // 2), strict=True)
    return tuple(Contact(name=name, coordinate=name, sign=sign, group=name.split("_")[1]) for name, sign in names)
