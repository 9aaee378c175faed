"""The bands of chaos along a parameter as a result: the verdict at each value, the bands, and what
happens at their edges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from saltus.enumerations import flags
from saltus.flow import Ending, Motion, find_recurrence
from saltus.orbits import Branch, PeriodicOrbit, SpecialKind, SpecialPoint, is_symmetric
from saltus.result import Result, provenance
from saltus.studies.diagram.simulated import SimulatedMotions
from saltus.systems import System, driven_displacement, image_of, natural_units

if TYPE_CHECKING:
    import xarray


class EdgeKind(StrEnum):
    """What happens to the chaos at the edge of a band."""

    description: str

    BOUND = "bound", "the range of the study ends"
    CASCADE = (
        "cascade",
        (
            "period doublings accumulate: beyond, the motion has 2^k times the period of an orbit"
            " that doubles"
        ),
    )
    FOLD = "fold", "a stable orbit ends in a fold: chaos begins with intermittency"
    GRAZING = "grazing", "a stable orbit touches the contact"
    CRISIS = "crisis", "the attractor touches an unstable orbit, and motions leave it"
    UNDECIDED = "undecided", "it is not known whether the motions beyond are chaotic"
    UNKNOWN = "unknown", "none of these is shown"

    def __new__(cls, word: str, description: str) -> EdgeKind:
        """A kind is its word."""
        kind = str.__new__(cls, word)
        kind._value_ = word
        kind.description = description
        return kind


@dataclass(frozen=True)
class TriedValues:
    """What became of motions at all values that were tried, in rising order."""

    values: np.ndarray  # (n,)
    verdict: np.ndarray  # (n,): an `Ending`; PERIODIC also where all motions settle or rest
    # (n,): largest Lyapunov exponent of the motions that have not settled, else nan
    exponent: np.ndarray
    error: np.ndarray  # (n,): half width of its 95 % interval
    # (n,): mean life of a transient in forcing periods; of chaos the mean life that is excluded
    # with 95 %
    mean_life: np.ndarray
    # (n,): longest period of the motions that settle, in forcing periods; 0 where none settles
    period: np.ndarray
    # (n, k, d): stroboscopic states of the motions that have not settled, else nan
    states: np.ndarray

    @property
    def chaotic(self) -> np.ndarray:
        """At which values a motion is chaotic, (n,)."""
        return np.asarray(self.verdict == Ending.CHAOTIC)

    @property
    def undecided(self) -> np.ndarray:
        """At which values it is not decided what a motion ends on, (n,)."""
        return np.asarray(self.verdict == Ending.UNDECIDED)


class BandOrigin(NamedTuple):
    """A special point of a branch, at which bands of chaos may begin."""

    kind: str
    value: float  # of the parameter
    state: tuple[float, ...]  # of its orbit at phase 0


@dataclass(frozen=True)
class Edge:
    """The end of a band: the last value with chaos, the first one without, and what happens between
    them.
    """

    inner: float
    outer: float
    kind: EdgeKind = EdgeKind.UNKNOWN
    special: float = np.nan  # the value of the special point that shows the kind
    # of the attractor's states to the nearest unstable orbit, relative to the size of the attractor
    distance: float = np.nan


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
    tried: TriedValues
    motions: SimulatedMotions

    def to_xarray(self) -> xarray.DataTree:
        """The tree of `to_datasets`, with the parameter's `path` and the range."""
        import xarray

        from saltus.result_tree import ResultTree

        low = float(self.tried.values.min())
        high = float(self.tried.values.max())
        about = {"title": "bands of chaos computed by saltus", "kind": "chaotic_bands"}
        name = driven_displacement(self.system)
        name = name if name in self.system.model.coordinates else self.system.model.coordinates[0]
        where: dict[str, Any] = {"path": self.path, "bounds": [low, high], "coordinate": name}
        root = xarray.Dataset(attrs=about | provenance(self.system, **where))
        return ResultTree.from_dict({"/": root, **self.to_datasets()})

    def to_datasets(self) -> dict[str, xarray.Dataset]:
        """`bands`, `exponents` (by value) and `stroboscopic` (a dot for each state of the motions,
        with the peak around it).
        """
        return {
            "bands": band_dataset(self.bands),
            "exponents": self._exponents(),
            "stroboscopic": self._stroboscopic(),
        }

    def _exponents(self) -> xarray.Dataset:
        import xarray

        tried = self.tried
        columns = {
            "exponent": (
                "value",
                tried.exponent,
                {"long_name": "largest Lyapunov exponent of motions that have not settled"},
            ),
            "error": ("value", tried.error, {"long_name": "half width of its 95 % interval"}),
            "verdict": ("value", tried.verdict.astype(np.int8), flags(Ending)),
            "life": (
                "value",
                tried.mean_life,
                {
                    "long_name": "mean life of transients; of chaos the life that is excluded",
                    "units": "periods",
                },
            ),
            "period": (
                "value",
                tried.period,
                {"long_name": "longest period of what settles", "units": "forcing periods"},
            ),
        }
        return xarray.Dataset(columns, {"value": ("value", tried.values, {"long_name": self.path})})

    def _stroboscopic(self) -> xarray.Dataset:
        import xarray

        motions = self.motions
        shown = np.isfinite(motions.peaks)
        value = np.broadcast_to(motions.value[:, None], shown.shape)
        model = self.system.model
        name = driven_displacement(self.system)
        name = name if name in model.coordinates else model.coordinates[0]
        place = model.coordinates.index(name)
        unit = model.unit_of(name)
        columns = {
            "position": (
                motions.states[..., place],
                unit,
                f"{name} at phase 0, in the last forcing periods",
            ),
            "velocity": (
                motions.states[..., motions.states.shape[-1] // 2 + place],
                unit,
                "its velocity there",
            ),
            "peak": (motions.peaks, unit, "its largest absolute value in each of these periods"),
            "value": (value, "1", self.path),
        }
        return xarray.Dataset(
            {
                name: ("dot", array[shown], {"units": units, "long_name": text})
                for name, (array, units, text) in columns.items()
            },
            attrs={"coordinate": name},
        )


def bands_of(tried: TriedValues) -> tuple[Band, ...]:
    """The runs of successive values with chaos."""
    chaos = np.concatenate([[False], tried.chaotic, [False]]).astype(int)
    first = np.flatnonzero(np.diff(chaos) == 1)
    last = np.flatnonzero(np.diff(chaos) == -1) - 1
    bands = []
    for a, b in zip(first.tolist(), last.tolist(), strict=True):
        low = _edge(tried, a, a - 1)
        high = _edge(tried, b, b + 1)
        top = a + int(np.nanargmax(tried.exponent[a : b + 1]))
        bands.append(Band(low, high, float(tried.exponent[top]), float(tried.error[top])))
    return tuple(bands)


def _edge(tried: TriedValues, inner: int, outer: int) -> Edge:
    """The edge between the last value with chaos and its neighbour without; the bound of the range
    if there is no neighbour.
    """
    value = float(tried.values[inner])
    if not 0 <= outer < len(tried.values):
        return Edge(value, value, EdgeKind.BOUND)
    kind = EdgeKind.UNDECIDED if tried.undecided[outer] else EdgeKind.UNKNOWN
    return Edge(value, float(tried.values[outer]), kind)


def band_dataset(bands: tuple[Band, ...] = ()) -> xarray.Dataset:
    """The bands, a row each, with both ends of the bracket of each edge and what happens at the
    edge.
    """
    import xarray

    columns: dict[str, Any] = {"kind": ("band", np.full(len(bands), "CH", dtype="U2"))}
    numbers = {
        "low": ([band.low for band in bands], "least value with chaos"),
        "high": ([band.high for band in bands], "largest value with chaos"),
        "before": (
            [band.lower.outer for band in bands],
            "next value below, at which no motion is shown to be chaotic",
        ),
        "after": (
            [band.upper.outer for band in bands],
            "next value above, at which no motion is shown to be chaotic",
        ),
        "exponent": (
            [band.exponent for band in bands],
            "largest Lyapunov exponent found in it, per unit of dimensionless time",
        ),
        "error": (
            [band.error for band in bands],
            "of that exponent, half width of its 95 % interval",
        ),
    }
    for name, (values, text) in numbers.items():
        columns[name] = ("band", np.array(values, dtype=float), {"long_name": text})
    for side, edges in (
        ("low", [band.lower for band in bands]),
        ("high", [band.upper for band in bands]),
    ):
        columns[f"{side}_edge"] = (
            "band", np.array([str(edge.kind) for edge in edges], dtype="U16"), {"long_name": f"what happens at the {side} edge"},
        )  # fmt: skip
        special, distance = (
            [getattr(edge, name) for edge in edges] for name in ("special", "distance")
        )
        columns[f"{side}_special"] = (
            "band",
            np.array(special, dtype=float),
            {"long_name": "value of the special point there"},
        )
        columns[f"{side}_distance"] = (
            "band", np.array(distance, dtype=float), {"long_name": "of the attractor to the nearest unstable orbit, by its size"},
        )  # fmt: skip
    return xarray.Dataset(columns)


@dataclass(frozen=True)
class EdgeSettings:
    """When the evidence suffices to say what happens at an edge."""

    # Largest distance of a fold or a grazing from the bracket of an edge, as a share of the range.
    beside: float = 1e-4
    # Largest distance, as a share of the range, of the period doubling of an orbit from the edge at
    # which its cascade ends.
    cascade: float = 0.03
    # The period of the motions beyond an edge is that at the first regular one of this many values
    # next to it.
    nearest: int = 4
    # The largest distance, as a share of the attractor's size, at which the attractor touches an
    # unstable orbit: its states are no denser than that. Inside the band, at `depth` times the
    # range from the edge or in the middle of a narrower band, it must be at least `grown` times as
    # far away, as unstable orbits within the attractor are near to it everywhere.
    touch: float = 0.02
    grown: float = 3.0
    depth: float = 0.005
    # The longest period of unstable orbits that are compared, in forcing periods.
    longest_period: int = 3
    # An orbit is that of a special point if their parameters differ by no more than this,
    # relatively.
    same_place: float = 1e-9
    # Forcing periods for which chaotic motions are followed to sample the attractor's states.
    periods: int = 400


SETTINGS = EdgeSettings()


def explained(system: System, chaos: Bands, branches: Sequence[Branch]) -> Bands:
    """The bands with what happens at each edge, as far as the branches of the same diagram show it.

    If a fold or a grazing at which orbits lose their stability lies in the bracket of the edge, it
    is what happens there. The edge is the end of a cascade if the motions beyond it have 2^k times
    (k > 0) the period of an orbit whose period doubling lies on that side. It is a crisis if the
    motions beyond are transients and the attractor comes up to an unstable orbit at the edge.
    Within the band its states at phase 0 are away from the states of this orbit.
    """
    look = _Evidence(system, chaos, branches)
    bands = [
        replace(band, lower=look.of(band, band.lower), upper=look.of(band, band.upper))
        for band in chaos.bands
    ]
    return replace(chaos, bands=tuple(bands))


class _Evidence:
    """The special points and the unstable orbits of a diagram."""

    def __init__(self, system: System, chaos: Bands, branches: Sequence[Branch]) -> None:
        self.system = system
        self.chaos = chaos
        self.branches = branches
        self.span = float(np.ptp(chaos.tried.values))
        self.special = turning_points(branches)

    def of(self, band: Band, edge: Edge) -> Edge:
        """The edge with its kind and the evidence for it."""
        if edge.kind is EdgeKind.BOUND:
            return edge
        special, kind = self._special(edge)
        if special is not None:
            return replace(edge, kind=kind, special=special.parameter)
        if self._verdict(edge.outer) is not Ending.TRANSIENT:
            return edge
        distance = self._touched(band, edge)
        return replace(
            edge,
            distance=distance,
            kind=EdgeKind.CRISIS if distance <= SETTINGS.touch else edge.kind,
        )

    def _verdict(self, value: float) -> Ending:
        return Ending(self.chaos.tried.verdict[np.searchsorted(self.chaos.tried.values, value)])

    def _special(self, edge: Edge) -> tuple[SpecialPoint | None, EdgeKind]:
        """The special point that shows what happens at an edge, or None, and the kind of edge that
        it makes.
        """
        low = min(edge.inner, edge.outer)
        high = max(edge.inner, edge.outer)
        reach = SETTINGS.beside * self.span
        beside = [point for point in self.special if low - reach <= point.parameter <= high + reach]
        for code, kind in ((SpecialKind.LP, EdgeKind.FOLD), (SpecialKind.GR, EdgeKind.GRAZING)):
            nearest = min(
                (p for p in beside if p.kind == code),
                key=lambda p: abs(p.parameter - edge.outer),
                default=None,
            )
            if nearest is not None:
                return nearest, kind
        period = self._period_beyond(edge)
        side = np.sign(edge.outer - edge.inner)
        doubled = [
            point
            for point in self.special
            if point.kind == SpecialKind.PD
            and 0.0 <= side * (point.parameter - edge.inner) <= SETTINGS.cascade * self.span
            and _is_doubled(period, point.orbit.period)
        ]
        nearest = min(doubled, key=lambda p: abs(p.parameter - edge.inner), default=None)
        return nearest, EdgeKind.CASCADE

    def _period_beyond(self, edge: Edge) -> int:
        """The longest period of the motions at the nearest value beyond an edge at which they are
        regular; 0 if there is none.
        """
        tried = self.chaos.tried
        first = int(np.searchsorted(self.chaos.tried.values, edge.outer))
        step = 1 if edge.outer > edge.inner else -1
        nearest = [
            i
            for i in range(first, first + SETTINGS.nearest * step, step)
            if 0 <= i < len(tried.values)
        ]
        return next(
            (
                int(tried.period[i])
                for i in nearest
                if tried.verdict[i] == Ending.PERIODIC and tried.period[i] > 0
            ),
            0,
        )

    def _touched(self, band: Band, edge: Edge) -> float:
        """The attractor's distance to the unstable orbit that it touches at an edge but not inside
        the band; nan if there is none."""
        tried = self.chaos.tried
        span = band.high - band.low
        toward = np.sign(edge.inner - edge.outer) * min(SETTINGS.depth * self.span, 0.5 * span)
        inside = np.flatnonzero(
            tried.chaotic & (tried.values >= band.low) & (tried.values <= band.high)
        )
        within = float(
            tried.values[inside[np.abs(tried.values[inside] - edge.inner - toward).argmin()]]
        )
        here = self._attractor(edge.inner)
        there = self._attractor(within)
        best = float("nan")
        for branch in self.branches:
            distance = _distance(here, branch, edge.inner)
            if (
                distance <= SETTINGS.touch
                and _distance(there, branch, within) >= SETTINGS.grown * distance
            ):
                best = float(np.fmin(best, distance))
        return best

    def _attractor(self, value: float) -> np.ndarray:
        """States of the chaos at a value that was tried, at phase 0, (n, d)."""
        tried = self.chaos.tried
        begin = tried.states[np.searchsorted(tried.values, value)]
        begin = begin[np.isfinite(begin).all(axis=1)]
        parameters = {self.chaos.path: np.full(len(begin), value)}
        states = find_recurrence(self.system, begin, SETTINGS.periods, parameters=parameters).states
        return np.asarray(states[np.isfinite(states).all(axis=-1)])


def _distance(states: np.ndarray, branch: Branch, value: float) -> float:
    """The least distance of an attractor's states to the unstable orbits of a branch, as a share of
    the attractor's size; inf if there are no such orbits."""
    orbits = _unstable_at(branch, value)
    if not orbits:
        return np.inf
    points = np.concatenate([_section(orbit) for orbit in orbits])
    size = np.ptp(states, axis=0)
    return float(min(np.linalg.norm((states - point) / size, axis=1).min() for point in points))


def turning_points(branches: Sequence[Branch]) -> list[SpecialPoint]:
    """The special points at which stable orbits lose their stability or end: those with stable
    orbits on one side only.
    """
    return [special for branch in branches for special in branch.special if _turns(branch, special)]


def _turns(branch: Branch, special: SpecialPoint) -> bool:
    """Whether stability changes at a special point, or a stable branch ends there; orbits at the
    point itself do not count.
    """
    away = np.abs(branch.parameters - special.parameter)
    scale = max(abs(special.parameter), float(np.ptp(branch.parameters)))
    length = natural_units(special.orbit.system).length
    apart = away / scale + np.abs(branch.sizes - special.orbit.size) / length
    nearest = int(apart.argmin())
    there = away > SETTINGS.same_place * scale
    below = np.flatnonzero(there[:nearest])[-1:]
    above = nearest + np.flatnonzero(there[nearest:])[:1]
    beside = branch.stable[np.concatenate([below, above])]
    return bool(beside.any()) and not (len(beside) == 2 and bool(beside.all()))


def band_origins(branches: Sequence[Branch]) -> list[BandOrigin]:
    """The special points of branches at which narrow bands may begin, as `BandSearch` takes
    them.
    """
    return [
        BandOrigin(
            str(special.kind), special.parameter, tuple(special.orbit.section_state.tolist())
        )
        for special in turning_points(branches)
    ]


def _is_doubled(period: int, base: int) -> bool:
    """Whether a period is 2, 4, 8, ... times another."""
    times = period // base
    return period == times * base and times > 1 and times & (times - 1) == 0


def _unstable_at(branch: Branch, value: float) -> list[PeriodicOrbit]:
    """The unstable orbits of a branch at a value, where it has any."""
    unseen = not branch.parameters.min() <= value <= branch.parameters.max() or branch.stable.all()
    if unseen or branch.points[0].orbit.period > SETTINGS.longest_period:
        return []
    return [orbit for orbit in branch.at(value) if orbit.admissible and not orbit.stable]


def _section(orbit: PeriodicOrbit) -> np.ndarray:
    """The states of an orbit at phase 0, and those of its mirror image, (n, d)."""
    motion = orbit.motion(orbit.period + 2)
    forcing = orbit.duration / orbit.period
    first = forcing * np.ceil(motion.start / forcing)
    times = first + forcing * np.arange(orbit.period)
    states = _at(motion, times)
    if not is_symmetric(orbit.system):
        return states
    return np.concatenate([states, image_of(orbit.system, _at(motion, times + 0.5 * forcing))])


def _at(motion: Motion, times: np.ndarray) -> np.ndarray:
    """The states of a motion at some times, (n, d)."""
    position, velocity = motion.at(times)
    return np.concatenate([np.atleast_2d(position), np.atleast_2d(velocity)]).T
