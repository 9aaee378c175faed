"""What closed forms refuse in their arguments: anything but finite numbers within the range in
which a formula has a meaning.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.checks import LIMITS, check_memory, check_number
from saltus.errors import ParameterError, shown


def numbers(name: str, values: Any, **bounds: Any) -> np.ndarray:
    """A number or an array of them, each finite and within the bounds of `check_number`.

    Raises
    ------
    ParameterError
        The error has the name, the range and the first value outside it.
    """
    if np.ma.is_masked(values):
        raise ParameterError(f"{name} must be numbers, and some of them are masked", name)
    if isinstance(values, np.ndarray):
        size = values.size
    else:
        size = len(values) if hasattr(values, "__len__") else 1
    if size > LIMITS.count:
        raise ParameterError(f"{name} must be at most {LIMITS.count} numbers, got {size}", name)
    check_memory(name, 8.0 * size, f"{size} numbers")
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "fiu":
            raise TypeError
        array = array.astype(float)
    except (TypeError, ValueError, OverflowError):
        if np.ndim(values) == 0 or isinstance(values, str):
            check_number(name, values, **bounds)
        raise ParameterError(
            f"{name} must be a number or an array of numbers, got {shown(values)}", name
        ) from None
    least = bounds.get("at_least", -np.inf)
    most = bounds.get("at_most", np.inf)
    inside = (
        (array > bounds.get("above", -np.inf))
        & (array < bounds.get("below", np.inf))
        & (array >= least)
        & (array <= most)
    )
    if not inside.all():
        check_number(name, float(array[~inside].flat[0]), **bounds)
    return array


def check_side(side: Any) -> None:
    """Refuse anything but +1, the lower layer, and -1, the upper one.

    Raises
    ------
    ParameterError
        The error has the value.
    """
    if (
        isinstance(side, bool)
        or not isinstance(side, (int, float, np.integer, np.floating))
        or side not in (1, -1)
    ):
        raise ParameterError(
            f"side must be +1 for the lower layer or -1 for the upper one, got {shown(side)}",
            "side",
        )


def check_shapes(**arrays: Any) -> None:
    """Refuse arrays that do not broadcast.

    Raises
    ------
    ParameterError
        The error has the shapes.
    """
    try:
        np.broadcast_shapes(*(np.shape(array) for array in arrays.values()))
    except ValueError:
        shapes = " and ".join(f"{name} {np.shape(array)}" for name, array in arrays.items())
        raise ParameterError(
            f"the shapes of {shapes} do not fit one another", next(iter(arrays))
        ) from None
