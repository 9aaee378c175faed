"""The quasi-static border of a stability chart: the border of the loads under which rest is the only equilibrium."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from saltus.result import Result
from saltus.systems import Harmonic, Metainterface, System
from saltus.theory.quasi_static import critical_horizontal, fold_horizontal, subcritical_vertical, unloaded_fold

if TYPE_CHECKING:
    import xarray

LOAD_PLANE = ("load.horizontal.amplitude", "load.vertical")  # the two parameters in whose plane the closed forms hold


@dataclass(frozen=True, eq=False)
class QuasiStaticBorder(Result):
    """Both parts of the border over the vertical load V; the true border is the lower one (erratum 23).

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
            "critical": (self.critical, "Hhat at which the undeformed state is lost (the paper's border)"),
            "fold": (self.fold, "Hhat at the fold of deformed equilibria (erratum 23)"),
            "true": (self.true, "the lesser of both: the quasi-static border"),
        }
        variables = {name: ("vertical", values, {"units": "1", "long_name": text}) for name, (values, text) in data.items()}
        axis = {"vertical": ("vertical", self.vertical, {"units": "1", "long_name": "V"})}
        return xr.Dataset(variables, axis, {"subcritical_below": self.subcritical_below})


def quasi_static_border(system: System, plane: tuple[str, ...], lowest: float) -> QuasiStaticBorder | None:
    """The border over V from `lowest` to 0, or None where no closed form is known.

    It is known for the metainterface with k = 1 and beta0 below 90 degrees, under H = Hhat sin and a constant V < 0 alone, in
    the plane of Hhat and V.

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
    model, channels = system.model, system.load.channels
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
    start, end = subcritical_vertical(beta0), unloaded_fold(beta0)[0]
    bend = end + (start - end) * np.linspace(0.0, 1.0, 101) ** 0.5  # dense near V = start, where the fold leaves as a power 3/2
    ends = [np.linspace(lowest, end, 21), bend, np.linspace(end, start, 101), np.linspace(start, 0.0, 21)]
    vertical = np.unique(np.concatenate(ends))
    vertical = vertical[vertical >= lowest]
    fold = np.full_like(vertical, np.nan)
    fold[vertical <= start] = fold_horizontal(beta0, vertical[vertical <= start])
    fold[vertical <= end] = 0.0  # deformed equilibria exist without any horizontal load; this removes the rounding of 0
    return QuasiStaticBorder(vertical, critical_horizontal(beta0, vertical), fold, start)
