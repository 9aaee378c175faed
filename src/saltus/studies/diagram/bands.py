"""Bands of chaos along a parameter: where motions neither rest nor repeat themselves and neighbouring ones part for good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import largest_exponents
from saltus.checks import Rectangle, Window, check_count, check_window
from saltus.flow import simulate_many
from saltus.orbits import initial_states
from saltus.progress import silent
from saltus.studies.checks import check_diagram
from saltus.systems import System

if TYPE_CHECKING:
    import xarray

SETTLING = 400  # forcing periods that a motion is given to come to rest or to repeat itself,
LONGER = 60  # periods of a stretch, instead of 12, where that leaves open whether the exponent is positive
CONFIRMED = 2000  # for which all of its companions must go on without settling: long transients of chaos are none
COMPANIONS, BESIDE = 64, 12  # motions from points of one that looks chaotic that must be so, all of them; at edges fewer do
APART = 1e-7  # between their beginnings, or those from one motion would all be that motion
KEPT = 64  # stroboscopic points of each motion
SEEDS = 4  # states of a chaotic motion from which its neighbours along the parameter are begun
ROUNDS = 7  # halvings of the bracket of an edge
TOLERANCE = 1e-10
REACH = 0.005  # of the range: farther from a band's edge a special point says nothing about it


@dataclass(frozen=True)
class Tried:
    """What became of motions at some values of the parameter: a row for each value, a column for each start."""

    values: np.ndarray  # (n,)
    chaotic: np.ndarray  # (n, starts)
    exponent: np.ndarray  # (n, starts): the largest one of what has not settled, else nan
    error: np.ndarray
    undecided: np.ndarray  # (n, starts): neither settled nor proved chaotic
    strobes: np.ndarray  # (n, starts, KEPT, 2): the last states at phase 0
    peaks: np.ndarray  # (n, starts, KEPT): max abs of the coordinate in each of the last periods

    def seeds(self, row: int) -> np.ndarray:
        """States of the chaotic motions at a value, (SEEDS, 2)."""
        states = self.strobes[row][self.chaotic[row]].reshape(-1, 2)
        return np.asarray(states[np.linspace(0, len(states) - 1, SEEDS).astype(int)])

    @property
    def found(self) -> np.ndarray:
        """At which values a motion is chaotic, (n,)."""
        return np.asarray(self.chaotic.any(axis=1))


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
        """The same with the kind of the special point nearest to each edge, where there is one near it."""
        reach = REACH * float(np.ptp(self.tried.values))
        named = [
            replace(
                band,
                low_mark=_mark(band.before, band.low, special, reach),
                high_mark=_mark(band.high, band.after, special, reach),
            )
            for band in self.bands
        ]
        return replace(self, bands=tuple(named))

    def to_datasets(self) -> dict[str, xarray.Dataset]:
        """`bands`, `exponents` (by value and start) and `strobes` (stroboscopic points and peaks of what moves)."""
        return {"bands": band_dataset(self.bands), "exponents": _exponents(self), "strobes": _strobes(self)}


def chaotic_bands(
    system: System,
    path: str,
    bounds: tuple[float, float],
    *,
    count: int = 121,
    starts: int = 8,
    window: Rectangle | None = None,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> Bands:
    """Where motions are chaotic along a parameter, from `starts` states at each of `count` values.

    A motion is called chaotic if it has not settled after 400 forcing periods, its largest Lyapunov exponent over the next 384
    (or, where that leaves it open, 1920 more) exceeds its error bar in both halves of them, and none of 64 motions from beside
    points of those that look so at this value (12 at the halvings of an edge) settles within 2000 periods: a motion on an
    attractor never leaves it, and where one does chaos is transient. Transients that live for 100 000 periods on average pass
    for chaos nevertheless. Every band is carried on to its neighbours by motions begun on it, and each edge is then halved
    seven times between a value with chaos and one without. Windows of periodic motion between two values of the grid are not
    seen; attractors whose basins hold no start are not either.

    Args:
        system: what moves, with one coordinate, under a load with a frequency.
        path, bounds: dotted path of the parameter, and its range.
        count: of values, evenly from the first bound to the last.
        starts, window, seed: initial states, as `search_orbits` takes them.
        progress: called with the fraction done.

    Raises:
        ParameterError: an argument without meaning.
    """
    bounds = check_diagram(system, path, bounds, starts=starts, seed=seed)
    check_count("count", count, 1)
    window = check_window(window, system)
    say = progress or (lambda share: None)
    search = _Search(system, path, starts, window, seed)
    tried = search.spread(search.at(np.linspace(*bounds, count), progress=lambda share: say(0.7 * share)))
    say(0.8)
    bands = search.edges(tried)
    say(1.0)
    return Bands(path, bands, tried)


@dataclass
class _Search:
    system: System
    path: str
    starts: int
    window: Window
    seed: int
    states: np.ndarray = field(init=False)
    asked: set[tuple[int, int]] = field(default_factory=set)  # from which value of the grid to which chaos was carried on

    def __post_init__(self) -> None:
        self.states = initial_states(self.system, self.starts, self.window, self.seed)

    def at(
        self, values: np.ndarray, states: np.ndarray | None = None, progress: Callable[[float], object] | None = None
    ) -> Tried:
        """Follow motions from states (starts, 2), or (n, starts, 2) of each value's own."""
        given = self.states if states is None else states
        begin = np.broadcast_to(given, (len(values), *given.shape[-2:]))
        ends = self._run(values, begin, SETTLING, progress)
        shape = begin.shape[:2]
        tried = Tried(
            values,
            chaotic=np.zeros(shape, dtype=bool),
            exponent=np.full(shape, np.nan),
            error=np.full(shape, np.nan),
            undecided=np.zeros(shape, dtype=bool),
            strobes=ends.strobes,
            peaks=ends.peaks,
        )
        rows = np.nonzero(ends.moving)
        if rows[0].size:
            self._judge(tried, rows, ends, COMPANIONS if states is None else BESIDE)
        return tried

    def _judge(self, tried: Tried, rows: tuple[np.ndarray, ...], ends: _Ends, companions: int) -> None:
        """Exponents of what has not settled, and whether it is chaotic."""
        values = tried.values[rows[0]]
        found = largest_exponents(self.system, ends.strobes[rows][:, -1], {self.path: values}, tol=TOLERANCE)
        again = np.flatnonzero(~found.positive & (found.exponent > 0.0))  # weak chaos, or none: a longer run may tell
        if again.size:
            columns = {self.path: values[again]}
            longer = largest_exponents(self.system, found.states[again], columns, periods=LONGER, tol=TOLERANCE)
            found = found.replaced(again, longer)
        tried.exponent[rows], tried.error[rows], positive = found.exponent, found.error, found.positive
        tried.undecided[rows] = ~positive & ~(found.exponent + found.error < 0.0)
        if positive.any():
            self._confirm(tried, tuple(place[positive] for place in rows), companions)

    def _confirm(self, tried: Tried, kept: tuple[np.ndarray, ...], companions: int) -> None:
        """Follow companions of motions that look chaotic: where one of them settles, chaos is a transient, however long."""
        lines = np.unique(kept[0])
        states = np.empty((len(lines), companions, 2))
        for i, line in enumerate(lines):
            there = tried.strobes[line, kept[1][kept[0] == line]].reshape(-1, 2)
            states[i] = there[np.linspace(0, len(there) - 1, companions).astype(int)] + APART * np.arange(companions)[:, None]
        later = self._run(tried.values[lines], states, CONFIRMED)
        stays = dict(zip(lines.tolist(), np.all(later.moving, axis=1).tolist(), strict=True))
        for line, start in zip(*kept, strict=True):
            tried.chaotic[line, start], tried.undecided[line, start] = stays[line], not stays[line]

    def _run(
        self, values: np.ndarray, states: np.ndarray, periods: int, progress: Callable[[float], object] | None = None
    ) -> _Ends:
        name = self.system.model.coordinates[0]
        begin: dict[str, Any] = {name: states[..., 0]}
        result = simulate_many(
            self.system,
            **begin,
            velocity=states[..., 1],
            parameters={self.path: values[:, None]},
            periods=periods,
            until=("rest", "settled"),
            sample=("state", "extrema"),
            last=KEPT,
            tol=TOLERANCE,
            progress=silent if progress is None else lambda done, _: progress(done),
        )
        stop = np.array(result["stop"].attrs["flag_meanings"].split())[result["stop"].values]
        strobes = np.stack([result[f"sampled_{name}"].values, result["sampled_velocity"].values], axis=-1)
        peaks = np.maximum(np.abs(result[f"largest_{name}"].values), np.abs(result[f"smallest_{name}"].values))
        moving = (stop == "horizon") & (result["side"].values != 0)
        shown = np.where(moving, KEPT, np.maximum(result["recurrence_period"].values, 1))  # of what has settled its cycle alone
        early = np.arange(strobes.shape[2]) < strobes.shape[2] - shown[..., None]
        strobes[early], peaks[early] = np.nan, np.nan
        return _Ends(moving, strobes, peaks)

    def spread(self, tried: Tried) -> Tried:
        """Carry chaos on to neighbouring values of the grid: motions begun on it, as long as they find more."""
        while True:
            found = tried.found
            edges = [
                (i, j) for i, j in _neighbours(len(found)) if found[i] and not found[j] and not np.isnan(tried.strobes[j]).all()
            ]
            news = [(i, j) for i, j in edges if (i, j) not in self.asked]
            if not news:
                return tried
            self.asked.update(news)
            states = np.stack([tried.seeds(i) for i, _ in news])
            more = self.at(tried.values[[j for _, j in news]], states)
            for row, (_, j) in enumerate(news):
                if more.found[row]:
                    _adopt(tried, j, more, row)

    def edges(self, tried: Tried) -> tuple[Band, ...]:
        """The bands between runs of values with chaos, their edges in brackets."""
        found = np.concatenate([[False], tried.found, [False]]).astype(int)
        first, last = np.flatnonzero(np.diff(found) == 1), np.flatnonzero(np.diff(found) == -1) - 1
        values, n = tried.values, len(tried.values)
        inner = np.concatenate([values[first], values[last]])
        outer = np.concatenate([values[np.maximum(first - 1, 0)], values[np.minimum(last + 1, n - 1)]])
        rows = np.concatenate([first, last])
        if rows.size:
            inner, outer = self._halve(tried, rows, inner, outer)
        half = len(first)
        bands = []
        for k, (a, b) in enumerate(zip(first, last, strict=True)):
            inside = np.where(tried.chaotic[a : b + 1], tried.exponent[a : b + 1], -np.inf)
            top = np.unravel_index(int(inside.argmax()), inside.shape)
            error = float(tried.error[a : b + 1][top])
            low, high, before, after = (float(x) for x in (inner[k], inner[half + k], outer[k], outer[half + k]))
            bands.append(Band(low, high, before, after, float(inside[top]), error))
        return tuple(bands)

    def _halve(self, tried: Tried, rows: np.ndarray, inner: np.ndarray, outer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Halve all brackets of edges at once; motions begin on the chaos of the inner side."""
        inner, outer = inner.copy(), outer.copy()
        states = np.stack([tried.seeds(row) for row in rows])
        for _ in range(ROUNDS):
            open_ = np.flatnonzero(inner != outer)
            if not open_.size:
                break
            middle = 0.5 * (inner[open_] + outer[open_])
            more = self.at(middle, states[open_])
            for row, k in enumerate(open_):
                if more.found[row]:
                    inner[k], states[k] = middle[row], more.seeds(row)
                else:
                    outer[k] = middle[row]
        return inner, outer


@dataclass(frozen=True)
class _Ends:
    moving: np.ndarray  # neither at rest nor settled
    strobes: np.ndarray
    peaks: np.ndarray


def _neighbours(n: int) -> list[tuple[int, int]]:
    return [pair for i, j in pairwise(range(n)) for pair in ((i, j), (j, i))]


def _adopt(tried: Tried, row: int, other: Tried, other_row: int) -> None:
    """Take a chaotic motion of another search into one that is not chaotic: the last of its starts gives way."""
    start = int(np.flatnonzero(other.chaotic[other_row])[0])
    for name in ("chaotic", "exponent", "error", "undecided", "strobes", "peaks"):
        getattr(tried, name)[row, -1] = getattr(other, name)[other_row, start]


def _mark(a: float, b: float, special: list[tuple[str, float]], reach: float) -> str:
    """The kind of the special point in the bracket of an edge, or else the nearest one within reach of it."""
    low, high = min(a, b), max(a, b)
    if low == high:
        return "bound"
    away = [(max(low - value, value - high, 0.0), kind) for kind, value in special]
    nearest = min(away, default=(np.inf, ""))
    return nearest[1] if nearest[0] <= reach else ""


def band_dataset(bands: tuple[Band, ...] = ()) -> xarray.Dataset:
    """The bands, a row each; both ends of each edge's bracket."""
    import xarray

    def column(name: str) -> np.ndarray:
        return np.array([getattr(band, name) for band in bands], dtype=float)

    texts = {
        "low": "least value with chaos",
        "high": "largest value with chaos",
        "before": "next value below that was tried, at which no motion is shown to be chaotic",
        "after": "next value above that was tried, at which no motion is shown to be chaotic",
        "exponent": "largest Lyapunov exponent found in it, per unit of dimensionless time",
        "error": "of that exponent, half width of its 95 % interval",
    }
    columns: dict[str, Any] = {name: ("band", column(name), {"long_name": text}) for name, text in texts.items()}
    columns["kind"] = ("band", np.full(len(bands), "CH", dtype="U2"))
    for name in ("low_mark", "high_mark"):
        words = np.array([getattr(band, name) or "none" for band in bands], dtype="U16")
        columns[name] = ("band", words, {"long_name": "kind of the special point at this edge"})
    return xarray.Dataset(columns)


def _exponents(found: Bands) -> xarray.Dataset:
    import xarray

    tried, over = found.tried, ("value", "start")
    columns = {
        "exponent": (over, tried.exponent, {"long_name": "largest Lyapunov exponent of motions that have not settled"}),
        "error": (over, tried.error, {"long_name": "half width of its 95 % interval"}),
        "chaotic": (over, tried.chaotic.astype(np.int8)),
        "undecided": (over, tried.undecided.astype(np.int8), {"long_name": "neither settled nor shown to be chaotic"}),
    }
    return xarray.Dataset(columns, {"value": ("value", tried.values, {"long_name": found.path})})


def _strobes(found: Bands) -> xarray.Dataset:
    import xarray

    tried, over = found.tried, ("value", "start", "period")
    columns = {
        "position": (over, tried.strobes[..., 0], {"long_name": "first coordinate at phase 0, in the last forcing periods"}),
        "velocity": (over, tried.strobes[..., 1], {"long_name": "its velocity there"}),
        "peak": (over, tried.peaks, {"long_name": "its largest absolute value in each of these periods"}),
    }
    return xarray.Dataset(columns, {"value": ("value", tried.values, {"long_name": found.path})})
