"""Bands of chaos along a parameter, as results: what was tried, the bands, and the special points at their edges."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

REACH = 0.005  # largest distance, as a share of the range, at which a special point belongs to the edge of a band
AT_BOUND = "bound"  # the mark of an edge that is the end of the range
BAND_COLUMNS = {
    "low": "least value with chaos",
    "high": "largest value with chaos",
    "before": "next value below that was tried, at which no motion is shown to be chaotic",
    "after": "next value above that was tried, at which no motion is shown to be chaotic",
    "exponent": "largest Lyapunov exponent found in it, per unit of dimensionless time",
    "error": "of that exponent, half width of its 95 % interval",
}


@dataclass(frozen=True)
class Tried:
    """What became of motions at some values of the parameter: a row for each value, a column for each start."""

    values: np.ndarray  # (n,)
    chaotic: np.ndarray  # (n, starts)
    exponent: np.ndarray  # (n, starts): the largest one of what has not settled, else nan
    error: np.ndarray
    undecided: np.ndarray  # (n, starts): neither settled nor proved chaotic
    states: np.ndarray  # (n, starts, kept, 2): the last stroboscopic states, of a periodic motion those of one period
    peaks: np.ndarray  # (n, starts, kept): max abs of the coordinate in each of the last periods

    @property
    def has_chaos(self) -> np.ndarray:
        """At which values a motion is chaotic, (n,)."""
        return np.asarray(self.chaotic.any(axis=1))

    def chaotic_states(self, row: int, count: int) -> np.ndarray:
        """States of the chaotic motions at a value, (count, 2)."""
        return spread_over(self.states[row][self.chaotic[row]], count)

    def adopt(self, row: int, other: Tried, other_row: int) -> None:
        """Take a chaotic motion from elsewhere to a value that has none: the last of its starts gives way."""
        start = int(np.flatnonzero(other.chaotic[other_row])[0])
        for name in ("chaotic", "exponent", "error", "undecided", "states", "peaks"):
            getattr(self, name)[row, -1] = getattr(other, name)[other_row, start]


def spread_over(states: np.ndarray, count: int) -> np.ndarray:
    """So many of the states (..., 2), evenly spread over them, (count, 2)."""
    states = states.reshape(-1, 2)
    return np.asarray(states[np.linspace(0, len(states) - 1, count).astype(int)])


@dataclass(frozen=True)
class Band:
    """An interval of the parameter in which a motion is chaotic at every value that was tried."""

    low: float
    high: float
    before: float  # the largest value below that was tried, at which none is shown to be; `low` itself at the range's edge
    after: float  # the least one above
    exponent: float  # the largest one found in it
    error: float
    low_mark: str = ""  # the kind of the special point at this edge
    high_mark: str = ""


@dataclass(frozen=True)
class Bands:
    """The bands of chaos of a range, what was tried on its grid, and the special points at their edges."""

    path: str
    bands: tuple[Band, ...]
    tried: Tried

    def marked(self, special: list[tuple[str, float]]) -> Bands:
        """The bands with the kind of the special point at each edge, where there is one near it."""
        reach = REACH * float(np.ptp(self.tried.values))
        marked = [
            replace(
                band,
                low_mark=_mark(band.before, band.low, special, reach),
                high_mark=_mark(band.high, band.after, special, reach),
            )
            for band in self.bands
        ]
        return replace(self, bands=tuple(marked))

    def to_datasets(self) -> dict[str, xarray.Dataset]:
        """`bands`, `exponents` (by value and start) and `stroboscopic` (states and peaks of what moves)."""
        return {"bands": band_dataset(self.bands), "exponents": self._exponents(), "stroboscopic": self._stroboscopic()}

    def _exponents(self) -> xarray.Dataset:
        tried, over = self.tried, ("value", "start")
        columns = {
            "exponent": (over, tried.exponent, {"long_name": "largest Lyapunov exponent of motions that have not settled"}),
            "error": (over, tried.error, {"long_name": "half width of its 95 % interval"}),
            "chaotic": (over, tried.chaotic.astype(np.int8)),
            "undecided": (over, tried.undecided.astype(np.int8), {"long_name": "neither settled nor shown to be chaotic"}),
        }
        return self._along_values(columns)

    def _stroboscopic(self) -> xarray.Dataset:
        tried, over = self.tried, ("value", "start", "period")
        columns = {
            "position": (over, tried.states[..., 0], {"long_name": "first coordinate at phase 0, in the last forcing periods"}),
            "velocity": (over, tried.states[..., 1], {"long_name": "its velocity there"}),
            "peak": (over, tried.peaks, {"long_name": "its largest absolute value in each of these periods"}),
        }
        return self._along_values(columns)

    def _along_values(self, columns: dict[str, Any]) -> xarray.Dataset:
        import xarray

        return xarray.Dataset(columns, {"value": ("value", self.tried.values, {"long_name": self.path})})


def _mark(a: float, b: float, special: list[tuple[str, float]], reach: float) -> str:
    """The kind of the special point in the bracket of an edge, or else the nearest one within reach of it."""
    low, high = min(a, b), max(a, b)
    if low == high:
        return AT_BOUND
    away = [(max(low - value, value - high, 0.0), kind) for kind, value in special]
    nearest = min(away, default=(np.inf, ""))
    return nearest[1] if nearest[0] <= reach else ""


def band_dataset(bands: tuple[Band, ...] = ()) -> xarray.Dataset:
    """The bands, a row each; both ends of each edge's bracket."""
    import xarray

    columns: dict[str, Any] = {
        name: ("band", np.array([getattr(band, name) for band in bands], dtype=float), {"long_name": text})
        for name, text in BAND_COLUMNS.items()
    }
    columns["kind"] = ("band", np.full(len(bands), "CH", dtype="U2"))
    for name in ("low_mark", "high_mark"):
        words = np.array([getattr(band, name) or "none" for band in bands], dtype="U16")
        columns[name] = ("band", words, {"long_name": "kind of the special point at this edge"})
    return xarray.Dataset(columns)
