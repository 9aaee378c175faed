"""The bands of chaos along a parameter as a result: the verdict at each value, the bands and their edges."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.enumerations import flags
from saltus.flow import Ending
from saltus.provenance import provenance
from saltus.result import Result
from saltus.studies.diagram.simulated import SimulatedMotions
from saltus.systems import System

if TYPE_CHECKING:
    import xarray


class EdgeKind(StrEnum):
    """What happens to the chaos at the edge of a band."""

    description: str

    BOUND = "bound", "the range of the study ends"
    CASCADE = "cascade", "period doublings accumulate: beyond, the motion has 2^k times the period of an orbit that doubles"
    FOLD = "fold", "a stable orbit ends in a fold: chaos begins with intermittency"
    GRAZING = "grazing", "a stable orbit touches the contact"
    CRISIS = "crisis", "the attractor touches an unstable orbit, and motions leave it"
    UNDECIDED = "undecided", "it is not known whether the motions beyond are chaotic"
    UNKNOWN = "unknown", "none of these is shown"

    def __new__(cls, word: str, description: str) -> EdgeKind:
        """A kind is its word."""
        kind = str.__new__(cls, word)
        kind._value_, kind.description = word, description
        return kind


@dataclass(frozen=True)
class Tried:
    """What became of motions at all values that were tried, in rising order."""

    values: np.ndarray  # (n,)
    verdict: np.ndarray  # (n,): an `Ending`; PERIODIC also where all motions settle or rest
    exponent: np.ndarray  # (n,): largest Lyapunov exponent of the motions that have not settled, else nan
    error: np.ndarray  # (n,): half width of its 95 % interval
    life: np.ndarray  # (n,): mean life of a transient in forcing periods; of chaos the mean life that is excluded with 95 %
    period: np.ndarray  # (n,): longest period of the motions that settle, in forcing periods; 0 where none settles
    states: np.ndarray  # (n, k, d): stroboscopic states of the motions that have not settled, else nan

    @property
    def chaotic(self) -> np.ndarray:
        """At which values a motion is chaotic, (n,)."""
        return np.asarray(self.verdict == Ending.CHAOTIC)

    @property
    def undecided(self) -> np.ndarray:
        """At which values it is not decided what a motion ends on, (n,)."""
        return np.asarray(self.verdict == Ending.UNDECIDED)


@dataclass(frozen=True)
class Edge:
    """The end of a band: the last value with chaos, the first one without, and what happens between them."""

    inner: float
    outer: float
    kind: EdgeKind = EdgeKind.UNKNOWN
    special: float = np.nan  # the value of the special point that shows the kind
    distance: float = np.nan  # of the attractor's states to the nearest unstable orbit, relative to the size of the attractor


@dataclass(frozen=True)
class Band:
    """An interval of the parameter in which a motion is chaotic at every value that was tried."""

    lower: Edge
    upper: Edge
    exponent: float  # the largest Lyapunov exponent found in it
    error: float  # half width of its 95 % interval

    @property
    def low(self) -> float:
        """The least value with chaos."""
        return self.lower.inner

    @property
    def high(self) -> float:
        """The largest value with chaos."""
        return self.upper.inner

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Bands(Result):
    """The bands of chaos of a range, and all that was simulated to find them."""

    system: System
    path: str
    bands: tuple[Band, ...]
    tried: Tried
    motions: SimulatedMotions

    def to_xarray(self) -> xarray.DataTree:
        """The tree of `to_datasets`, with the parameter's `path` and the range."""
        import xarray

        low, high = float(self.tried.values.min()), float(self.tried.values.max())
        about = {"title": "bands of chaos computed by saltus", "kind": "chaotic_bands"}
        name = self.system.model.coordinates[0]
        where: dict[str, Any] = {"path": self.path, "bounds": [low, high], "coordinate": name}
        root = xarray.Dataset(attrs=about | provenance(self.system, **where))
        return xarray.DataTree.from_dict({"/": root, **self.to_datasets()})

    def to_datasets(self) -> dict[str, xarray.Dataset]:
        """`bands`, `exponents` (by value) and `stroboscopic` (a dot for each state of the motions, with the peak around it)."""
        return {"bands": band_dataset(self.bands), "exponents": self._exponents(), "stroboscopic": self._stroboscopic()}

    def _exponents(self) -> xarray.Dataset:
        import xarray

        tried = self.tried
        columns = {
            "exponent": ("value", tried.exponent, {"long_name": "largest Lyapunov exponent of motions that have not settled"}),
            "error": ("value", tried.error, {"long_name": "half width of its 95 % interval"}),
            "verdict": ("value", tried.verdict.astype(np.int8), flags(Ending)),
            "life": (
                "value",
                tried.life,
                {"long_name": "mean life of transients; of chaos the life that is excluded", "units": "periods"},
            ),
            "period": ("value", tried.period, {"long_name": "longest period of what settles", "units": "forcing periods"}),
        }
        return xarray.Dataset(columns, {"value": ("value", tried.values, {"long_name": self.path})})

    def _stroboscopic(self) -> xarray.Dataset:
        import xarray

        motions = self.motions
        shown = np.isfinite(motions.peaks)
        value, model = np.broadcast_to(motions.value[:, None], shown.shape), self.system.model
        unit = model.unit_of(model.coordinates[0])
        columns = {
            "position": (motions.states[..., 0], unit, "first coordinate at phase 0, in the last forcing periods"),
            "velocity": (motions.states[..., motions.states.shape[-1] // 2], unit, "its velocity there"),
            "peak": (motions.peaks, unit, "its largest absolute value in each of these periods"),
            "value": (value, "1", self.path),
        }
        return xarray.Dataset(
            {name: ("dot", array[shown], {"units": units, "long_name": text}) for name, (array, units, text) in columns.items()}
        )


def bands_of(tried: Tried) -> tuple[Band, ...]:
    """The runs of successive values with chaos."""
    chaos = np.concatenate([[False], tried.chaotic, [False]]).astype(int)
    first, last = np.flatnonzero(np.diff(chaos) == 1), np.flatnonzero(np.diff(chaos) == -1) - 1
    bands = []
    for a, b in zip(first.tolist(), last.tolist(), strict=True):
        low, high = _edge(tried, a, a - 1), _edge(tried, b, b + 1)
        top = a + int(np.nanargmax(tried.exponent[a : b + 1]))
        bands.append(Band(low, high, float(tried.exponent[top]), float(tried.error[top])))
    return tuple(bands)


def _edge(tried: Tried, inner: int, outer: int) -> Edge:
    """The edge between the last value with chaos and its neighbour without; the bound of the range if there is no neighbour."""
    value = float(tried.values[inner])
    if not 0 <= outer < len(tried.values):
        return Edge(value, value, EdgeKind.BOUND)
    kind = EdgeKind.UNDECIDED if tried.undecided[outer] else EdgeKind.UNKNOWN
    return Edge(value, float(tried.values[outer]), kind)


def band_dataset(bands: tuple[Band, ...] = ()) -> xarray.Dataset:
    """The bands, a row each, with both ends of the bracket of each edge and what happens at the edge."""
    import xarray

    columns: dict[str, Any] = {"kind": ("band", np.full(len(bands), "CH", dtype="U2"))}
    numbers = {
        "low": ([band.low for band in bands], "least value with chaos"),
        "high": ([band.high for band in bands], "largest value with chaos"),
        "before": ([band.lower.outer for band in bands], "next value below, at which no motion is shown to be chaotic"),
        "after": ([band.upper.outer for band in bands], "next value above, at which no motion is shown to be chaotic"),
        "exponent": ([band.exponent for band in bands], "largest Lyapunov exponent found in it, per unit of dimensionless time"),
        "error": ([band.error for band in bands], "of that exponent, half width of its 95 % interval"),
    }
    for name, (values, text) in numbers.items():
        columns[name] = ("band", np.array(values, dtype=float), {"long_name": text})
    for side, edges in (("low", [band.lower for band in bands]), ("high", [band.upper for band in bands])):
        columns[f"{side}_edge"] = (
            "band", np.array([str(edge.kind) for edge in edges], dtype="U16"), {"long_name": f"what happens at the {side} edge"},
        )  # fmt: skip
        special, distance = ([getattr(edge, name) for edge in edges] for name in ("special", "distance"))
        columns[f"{side}_special"] = ("band", np.array(special, dtype=float), {"long_name": "value of the special point there"})
        columns[f"{side}_distance"] = (
            "band", np.array(distance, dtype=float), {"long_name": "of the attractor to the nearest unstable orbit, by its size"},
        )  # fmt: skip
    return xarray.Dataset(columns)
