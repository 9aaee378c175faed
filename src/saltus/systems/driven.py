"""The displacement that the load of a system drives: what pictures and amplitudes show where a model
has several coordinates.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.systems.contracts.contact_model import mass_and_force
from saltus.systems.contracts.model import first_of_largest
from saltus.systems.loads.load import DeclaredLoad, Load
from saltus.systems.system import System
from saltus.systems.system_units import instants_of, natural_units

ROUNDING = 1e-12  # so much of the forces is


def driven_displacement(system: System) -> str:
    """The coordinate, or the named point of a `Structure`, that the load drives.

    It is the one on which the load does most at once: with the largest F_i / sqrt(M_ii), where F is
    what the load adds to the forces in the mean of squares, and M the mass matrix. This share does
    not depend on the units of the coordinates. What varies with time counts, or without it what is
    constant. Of equal ones a coordinate that no contact holds comes first, then the first by name.

    Parameters
    ----------
    system
        The system, in its own coordinates.
    """
    found: str = system._remembered(driven_displacement, lambda: _driven(system))
    return found


def driven_displacements(system: System) -> tuple[str, ...]:
    """The displacement that the load drives, and the one that the mirror of the model swaps with it:
    both have the same meaning, as the layers of a unit cell do, and a motion and its mirror image
    the same amplitude.

    Parameters
    ----------
    system
        The system, in its own coordinates.
    """
    name = driven_displacement(system)
    model = system.model
    if name not in model.coordinates:
        return (name,)
    image = model.images[model.coordinates.index(name)]
    return tuple(each for each in model.coordinates if each in (name, image))


def _driven(system: System) -> str:
    model = system.model
    names = tuple(model.coordinates)
    if len(names) == 1:
        return names[0]
    own = model.shown_coordinate(system.load)
    return own if own is not None else first_of_largest(names, _shares(system), _held(model))


def _held(model: Any) -> set[str]:
    """The coordinates along which contacts hold; of a distance none is known."""
    held = set[str]()
    for contact in model.contacts:
        if contact.coordinate is None:
            continue
        along = contact.coordinate
        held |= {along} if isinstance(along, str) else set(dict(along))
    return held


def _shares(system: System) -> np.ndarray:
    """The share of each coordinate, (n,): F_i / sqrt(M_ii) of what varies, or else of what is
    constant, where all coordinates are 0 or else at their natural units; 0 where nothing acts.
    """
    model = system.model
    names = model.coordinates
    silent = Load(frequency=system.load.frequency)
    nothing = np.zeros(len(names))
    instants = instants_of(system.load).tolist()
    second_order = np.array([name in model.moving for name in names])
    for place in (nothing, natural_units(system).lengths):
        forces = _forces(model, system.load, place, instants)
        without = _forces(model, silent, place, instants)
        if forces is None or without is None:
            continue
        masses, pushes = forces
        pushes = pushes - without[1]
        pushes = pushes / np.sqrt(masses)
        for part in (pushes - pushes.mean(axis=0), pushes):
            shares = np.sqrt((part**2).mean(axis=0))
            # what rounding leaves of a constant is no variation
            shares = np.where(shares > ROUNDING * np.abs(pushes).max(), shares, 0.0)
            for own in (np.where(second_order, shares, 0.0), shares):
                if own.any():
                    return np.asarray(own)
    return nothing


def _forces(
    model: Any, load: Load, place: np.ndarray, instants: list[float]
) -> tuple[np.ndarray, np.ndarray] | None:
    """The diagonal of the mass matrix (n,), and the forces at rest (instants, n) at a place; None
    where the model has none there.
    """
    known = DeclaredLoad(load, model)
    still = (0.0,) * len(place)
    at = tuple(place.tolist())
    masses = np.ones(len(place))
    rows = []
    with np.errstate(all="ignore"):
        for t in instants:
            try:
                if hasattr(model, "mass_matrix"):
                    mass, force = mass_and_force(model, t, at, still, known)
                    masses = np.abs([float(mass[i][i]) for i in range(len(mass))])
                    force = list(force)
                else:
                    force = list(model.acceleration(t, at, still, model.every_side[0], known))
                rows.append([float(each) for each in force])
            except Exception:  # a user's own code may raise anything
                return None
    pushes = np.array(rows)
    if pushes.shape[1] != len(place) or len(masses) != len(place):
        return None
    sound = np.isfinite(pushes).all() and np.isfinite(masses).all() and (masses > 0.0).all()
    return (masses, pushes) if sound else None
