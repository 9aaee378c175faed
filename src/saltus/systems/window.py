"""Windows: boxes of the state space, in which motions begin and basins are drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.checks import LIMITS, as_numbers
from saltus.errors import ParameterError, shown
from saltus.systems.system import System

HALF_WIDTH = 1.5  # the half width of the default window: about the size of the motions in the paper

Box = tuple[tuple[float, float], ...]  # bounds of each coordinate, then of each velocity


class Window(Box):
    """A box of the state space: the bounds of each coordinate, then of each velocity; a rectangle for one coordinate."""

    __slots__ = ()

    @property
    def centre(self) -> np.ndarray:
        """Its middle, (d,) for d state variables."""
        return np.asarray(np.asarray(self).mean(axis=1))

    @property
    def half(self) -> np.ndarray:
        """Its half widths, (d,)."""
        return 0.5 * np.diff(np.asarray(self), axis=1)[:, 0]

    def scaled(self, states: np.ndarray) -> np.ndarray:
        """States (..., d) in half widths from the middle."""
        return np.asarray((states - self.centre) / self.half)


def check_window(window: Any, system: System) -> Window:
    """A window of the states; for None the default window, with half widths 1.5 around the contact, or around 0 without one.

    With several contacts the default window ends at these. With several coordinates both bounds of a state variable may be equal;
    it then has one value.

    Raises
    ------
    ParameterError
        Anything but a pair of bounds for each coordinate and each velocity; a window beyond the contacts.
    """
    names = system.model.coordinates
    if window is None:
        return _default_window(system)
    bounds = as_numbers(window, "window")
    single = len(names) == 1
    sound = bounds.shape == (2 * len(names), 2) and (np.abs(bounds) <= LIMITS.value).all()
    if not sound or not ((bounds[:, 0] < bounds[:, 1]) if single else (bounds[:, 0] <= bounds[:, 1])).all():
        meant = "((least, largest coordinate), (least, largest velocity))"
        if not single:
            meant = f"{2 * len(names)} pairs (least, largest), of {', '.join(names)}, then of their velocities,"
        raise ParameterError(f"window must be {meant}, got {shown(window)}", "window")
    for contact in system.model.contacts:
        low, high = bounds[names.index(contact.coordinate)]
        if max(contact.gap(low), contact.gap(high)) < 0.0:
            raise ParameterError(
                f"window must reach to where {contact.coordinate} can be, and all of ({low:g}, {high:g}) is beyond the contact "
                f"{contact.name} at {contact.position:g}",
                "window",
            )
    return Window(map(tuple, bounds.tolist()))


def _default_window(system: System) -> Window:
    """The window with half widths 1.5 around the contact, or around 0 without one, cut off at the contacts."""
    model = system.model
    if model.sides:
        middle = float(model.contact)
        return Window(((middle - HALF_WIDTH, middle + HALF_WIDTH), (-HALF_WIDTH, HALF_WIDTH)))
    bounds = {name: [-HALF_WIDTH, HALF_WIDTH] for name in model.coordinates}
    for contact in model.contacts:
        at, pair = float(contact.position), bounds[contact.coordinate]
        alone = sum(other.coordinate == contact.coordinate for other in model.contacts) == 1
        pair[:] = sorted((at, at + contact.sign * HALF_WIDTH)) if alone else pair
        pair[contact.sign < 0] = at
    return Window([*((low, high) for low, high in bounds.values()), *[(-HALF_WIDTH, HALF_WIDTH)] * len(bounds)])
