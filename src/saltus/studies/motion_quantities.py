"""Quantities of many motions whose states at phase 0 a study has kept: each is followed once more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from saltus.errors import MotionError
from saltus.flow import Extreme, Quantity, extremes_of, quantity_of, simulate
from saltus.systems import System, arguments_of

DRIVEN = ("amplitude", "highest", "lowest")


def quantities_of_motions(
    system: System,
    parameters: Mapping[str, np.ndarray],
    states: np.ndarray,
    periods: np.ndarray,
    own: Sequence[Quantity] = (),
) -> dict[str, tuple[np.ndarray, dict[str, str]]]:
    """The quantities of motions over one of their periods, by name, each with its unit and text:
    those of a model with several coordinates, whose lanes keep the extrema of all of them alone,
    and those of the user's own. Nan where a motion cannot be followed.

    Parameters
    ----------
    system
        What moves.
    parameters
        The values of parameters by their dotted paths, (n,).
    states
        The states at phase 0, (n, d).
    periods
        The forcing periods of each, (n,).
    own
        Quantities of the user's own.
    """
    several = len(system.model.coordinates) > 1
    extremes: list[Extreme | Quantity] = []
    if several:
        extremes = [*(quantity_of(system, name) for name in DRIVEN), *extremes_of(system)]
    asked = [*extremes, *own]
    if not asked:
        return {}
    found = np.full((len(asked), len(states)), np.nan)
    for i, (state, period) in enumerate(zip(states, periods.tolist(), strict=True)):
        here = system.with_({path: float(values[i]) for path, values in parameters.items()})
        try:
            motion = simulate(here, **arguments_of(here, state), periods=max(int(period), 1))
        except MotionError:
            continue
        found[:, i] = [quantity.of(motion) for quantity in asked]
    return {
        quantity.name: (values, attributes_of(quantity))
        for quantity, values in zip(asked, found, strict=True)
    }


def attributes_of(quantity: Any) -> dict[str, str]:
    """The unit and the text of a quantity, as a variable has them."""
    return {"units": str(quantity.unit), "long_name": str(quantity.text)}
