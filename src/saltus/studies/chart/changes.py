"""What becomes of the motions of a chart between two neighbouring cells, found by simulation in
lanes.

A motion is followed in steps from the middle of its cell to that of the neighbour. If it settles as
the same motion after a step, the next step begins there; if not, the step is halved. Many changes
are looked into at the same time, and no orbit is solved for.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.flow import captured_between
from saltus.studies.chart.motions import (
    ALIKE,
    SIDES,
    distance,
    motion_type,
    motions_in,
    motions_later,
    read_motions,
)
from saltus.systems import System, states_beside

if TYPE_CHECKING:
    import xarray

# Changes are of motions above this many times the least amplitude: smaller ones may only be too
# small to count in the next cell.
COUNTS = 1.2


@dataclass(frozen=True, eq=False)
class ChartMotions:
    """A chart as plain arrays: its axes, its motions, and which of these are of one family."""

    horizontal: np.ndarray
    vertical: np.ndarray
    motions: np.ndarray  # of `motion_type`, by cell and falling amplitude
    # (n,): the number of each motion's family: motions that are counterparts of each other from
    # cell to cell
    family: np.ndarray
    least: float  # the smallest amplitude that counts
    monostable: np.ndarray  # (rows, columns): whether all motions come to rest

    @property
    def place(self) -> np.ndarray:
        """(n, 2): row and column of each motion."""
        return np.stack(np.unravel_index(self.motions["cell"], self.monostable.shape), axis=1)

    @property
    def family_size(self) -> np.ndarray:
        """(n,): how many motions there are in the family of each."""
        return np.asarray(np.bincount(self.family, minlength=1)[self.family])


@dataclass(frozen=True, eq=False)
class Changes:
    """Where motions of a chart end: in `source` there is one that has no counterpart in the
    neighbour `target`.
    """

    motion: np.ndarray  # (n,): the index of the motion in the chart's motions
    source: np.ndarray  # (n, 2): row and column of its cell
    target: np.ndarray  # (n, 2): row and column of the neighbour

    def only(self, chosen: np.ndarray) -> Changes:
        """Some of them."""
        return Changes(self.motion[chosen], self.source[chosen], self.target[chosen])

    @property
    def along(self) -> int:
        """Along which axis the first change lies: 0 horizontally, 1 vertically."""
        return 0 if self.source[0, 0] == self.target[0, 0] else 1

    def __len__(self) -> int:
        return len(self.motion)


def read_chart(chart: xarray.Dataset) -> ChartMotions:
    """The motions of a chart, and which of them are of one family."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    chart, motions = chart.transpose("vertical", "horizontal", ...), read_motions(chart)
    shape = chart["count"].shape
    pairs = np.concatenate(
        [np.empty((0, 2), dtype=int), *(_counterparts(motions, shape, side)[0] for side in SIDES)]
    )
    graph = coo_array(
        (np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(motions), len(motions))
    )
    family = (
        connected_components(graph, directed=False)[1] if len(motions) else np.zeros(0, dtype=int)
    )
    axes = chart["horizontal"].values, chart["vertical"].values
    return ChartMotions(
        *axes, motions, family, float(chart.attrs["least"]), monostable(chart).values
    )


def monostable(chart: xarray.Dataset) -> xarray.DataArray:
    """Where no motion counts and every start that settles comes to rest: the white region of the
    paper's charts.
    """
    return (chart["count"] == 0) & (chart["unsettled"] == 0)


def _counterparts(
    motions: np.ndarray, shape: tuple[int, ...], side: tuple[int, int]
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of motions (n, 2) that are counterparts in neighbouring cells, and which motions have
    no counterpart on this side.
    """
    there = np.stack(np.unravel_index(motions["cell"], shape), axis=1) + side
    inside = ((there >= 0) & (there < shape)).all(axis=1)
    target = np.where(inside, there @ [shape[1], 1], -1)
    amplitude = motions["amplitude"]
    pairs = [np.empty((0, 2), dtype=int)]
    lonely = inside.copy()
    symmetric = np.abs(amplitude - motions["other"]) < ALIKE.symmetric * amplitude
    for counts, other in motions_in(motions, target):
        size = np.maximum(amplitude[other], amplitude)
        like = counts & (np.abs(amplitude[other] - amplitude) <= ALIKE.family * size)
        like &= (motions["period"][other] == motions["period"]) & (symmetric[other] == symmetric)
        pairs.append(np.stack([np.flatnonzero(like), other[like]], axis=1))
        lonely &= ~like
    return np.concatenate(pairs), np.asarray(lonely)


def changes_of(chart: ChartMotions) -> Changes:
    """Every end of a motion between two cells of a chart, without motions that are hardly large
    enough to count.
    """
    counts = chart.motions["amplitude"] > COUNTS * chart.least
    place = chart.place
    motion = []
    target = []
    for side in SIDES:
        lonely = np.flatnonzero(
            _counterparts(chart.motions, chart.monostable.shape, side)[1] & counts
        )
        motion.append(lonely)
        target.append(place[lonely] + side)
    chosen = np.concatenate(motion)
    return Changes(chosen, place[chosen], np.concatenate(target))


def keys_of(chart: ChartMotions, changes: Changes) -> list[tuple[int, ...]]:
    """The keys of changes: row and column, the motion's amplitude in nrad, row and column of the
    neighbour.
    """
    size = np.rint(chart.motions["amplitude"][changes.motion] * 1e9).astype(int)
    rows = zip(changes.source, size, changes.target, strict=True)
    return [tuple(map(int, (*source, nrad, *target))) for source, nrad, target in rows]


class ChangeOutcome(NumberedSentence):
    """What becomes of a motion between two cells."""

    UNKNOWN = 0, "not known"
    JUMP = 1, "jumps to another motion"
    DOUBLING = 2, "passes into one of twice or half its period"
    SYMMETRY = 3, "gains or loses its symmetry"
    SHRINKS = 4, "becomes too small to count"
    CONTINUED = 5, "goes on"
    MISSED = 6, "goes on, but no start of the neighbour has led to it"

    @property
    def is_end(self) -> bool:
        """Whether the motion ends at a place between the two cells."""
        return self in ENDS

    @property
    def is_harmless(self) -> bool:
        """Whether the same motion goes on into the neighbour."""
        return self in (ChangeOutcome.SHRINKS, ChangeOutcome.CONTINUED)


ENDS = (ChangeOutcome.JUMP, ChangeOutcome.DOUBLING, ChangeOutcome.SYMMETRY)

# the fields of `motion_type` that `way_type` has too
SEEN = ("state", "period", "impact_count", "amplitude", "other", "slowest")


@cache
def way_type(dimension: int) -> np.dtype[Any]:
    """The record of a motion between two cells: the share of the way, and the motion there; its
    period is 0 if it does not settle."""
    kept = motion_type(dimension)
    return np.dtype([("share", float), *((name, kept[name]) for name in SEEN)])


@cache
def ending_type(dimension: int) -> np.dtype[Any]:
    """The record of what becomes of a motion with so many state variables.

    `outcome`; `settled`, the last share of the way at which the motion has settled in time; `last`,
    the motion at the last share at which it is the same motion, settled or about to settle; `next`,
    the motion at the next share, at which it is another one.
    """
    way = way_type(dimension)
    return np.dtype([("outcome", np.int8), ("settled", float), ("last", way), ("next", way)])


@dataclass(frozen=True)
class TraceSettings:
    """How changes are looked into in lanes."""

    # The way is halved so often to enclose the end of a motion: to 1/64 of a cell.
    halvings: int = 6
    # The first step from the middle of the motion's cell is halved so often before the motion
    # counts as lost: its state cannot be extrapolated from two places yet, so that a longer step
    # misses its basin more easily.
    first_halvings: int = 10
    # The most steps of a motion, far more than most take. Where its size changes much between two
    # cells, steps are short.
    rounds: int = 200
    # If a motion is the same at a place where a longer step had lost it, the next steps are at most
    # this many times the last one.
    stride: float = 4.0
    # The stages in which motions are followed, as shares of the forcing periods: after each,
    # motions that are lost are given up, and the state of a motion that is about to settle is
    # replaced by its extrapolated limit.
    stages: tuple[float, ...] = (1 / 20, 1 / 20, 2 / 5)
    # With up to this number of motions, an ensemble takes longer to begin a stage than to follow
    # them in one.
    few_motions: int = 16
    few_stages: tuple[float, ...] = (1 / 2,)
    # A motion that returns within this share of its amplitude after some forcing periods has this
    # period and settles slowly, as motions do near their special points.
    slow: float = 1e-3
    # A motion that reaches the neighbour but has not settled there is followed for so many times
    # the periods.
    patience: int = 8


SETTINGS = TraceSettings()


@dataclass(frozen=True, eq=False)
class Ways:
    """The n ways along which motions are followed: the parameters at both ends, and the motions at
    the start.
    """

    system: System
    # the parameters by dotted path, (n,), at the middle of the motions' cells
    start: Mapping[str, np.ndarray]
    end: Mapping[str, np.ndarray]
    motions: np.ndarray  # (n,), of `motion_type`
    periods: int
    max_period: int
    tol: float

    @cached_property
    def captured(self) -> np.ndarray:
        """(n,): the speeds below which capture is proved all along a way; nan where this is
        computed at each place instead.
        """
        return captured_between(self.system, self.start, self.end)

    def settled(
        self, rows: np.ndarray, last: np.ndarray, share: np.ndarray, states: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The motions, of `way_type`, on which motions from states (n, d) at these shares of the
        ways settle; whether they have.

        A motion that differs much from the last one is not followed further.
        """
        found = np.zeros(len(rows), last.dtype)
        settled = np.zeros(len(rows), dtype=bool)
        left = np.arange(len(rows))
        found["share"] = share
        found["state"] = states
        for part in SETTINGS.stages if len(rows) > SETTINGS.few_motions else SETTINGS.few_stages:
            if not left.size:
                break
            found[left], settled[left] = self.followed(
                rows[left], found[left], math.ceil(part * self.periods)
            )
            left = left[~settled[left] & is_near(last[left], found[left])]
        return found, settled

    def followed(
        self, rows: np.ndarray, motions: np.ndarray, periods: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """The motions, of `way_type`, at most so many forcing periods later, and whether they have
        settled.
        """
        parameters = {
            path: a[rows] + motions["share"] * (self.end[path][rows] - a[rows])
            for path, a in self.start.items()
        }
        how: dict[str, Any] = {
            "max_period": self.max_period,
            "kept": 2 * self.max_period,
            "tol": self.tol,
        }
        how |= {"captured": self.captured[rows], "slow": SETTINGS.slow}
        found, ends = motions_later(
            self.system, motions, max(periods, 3 * self.max_period), parameters, **how
        )
        for name in ("period", "impact_count", "amplitude", "other", "slowest"):
            found[name][ends.rest] = 0
        return found, ends.periodic | ends.rest


def trace(ways: Ways, least: float) -> np.ndarray:
    """What becomes of each motion on its way, of `ending_type`; `least` is the smallest amplitude
    that counts.

    A motion counts as lost only after a step as short as the last halving: a longer one may miss
    its basin.
    """
    count = len(ways.motions)
    result = np.zeros(count, ending_type(ways.system.dimension))
    last = result["last"]
    following = result["next"]
    for name in SEEN:
        last[name] = ways.motions[name]
    before = last.copy()
    high = np.ones(count)
    trial = np.full(count, 0.5)
    going = np.ones(count, dtype=bool)
    for _ in range(SETTINGS.rounds):
        rows = np.flatnonzero(going)
        if not rows.size:
            break
        found, settled = ways.settled(
            rows,
            last[rows],
            trial[rows],
            _heading(ways.system, last[rows], before[rows], trial[rows]),
        )
        same = _is_same(last[rows], found)
        on = rows[same]
        lost = rows[~same]
        before[on], last[on] = last[on], found[same]
        result["settled"][on] = np.where(settled[same], found["share"][same], result["settled"][on])
        going[on] = (trial[on] < 1.0) & (last["amplitude"][on] >= least)
        near = 0.5 ** np.where(last["share"] > 0.0, SETTINGS.halvings, SETTINGS.first_halvings)
        following[lost], going[lost] = found[~same], trial[lost] - last["share"][lost] > near[lost]
        farther = np.minimum(
            last["share"] + SETTINGS.stride * (last["share"] - before["share"]), 1.0
        )
        high[on], high[lost] = np.where(trial[on] < high[on], high[on], farther[on]), trial[lost]
        trial = np.where(high - last["share"] > near, 0.5 * (last["share"] + high), high)
    _wait(ways, result)
    result["outcome"] = np.where(going, ChangeOutcome.UNKNOWN, _outcomes(last, following, least))
    return result


def _wait(ways: Ways, result: np.ndarray) -> None:
    """Follow the motions that have reached the neighbour without settling there until they settle.

    If one settles as another motion, this is its `next`, and its `last` share is the one at which
    it had settled.
    """
    rows = np.flatnonzero((result["last"]["share"] >= 1.0) & (result["settled"] < 1.0))
    if not rows.size:
        return
    last = result["last"][rows]
    found, _ = ways.followed(rows, last, SETTINGS.patience * ways.periods)
    same = _is_same(last, found)
    result["last"][rows[same]], result["settled"][rows[same]] = found[same], 1.0
    result["next"][rows[~same]], result["last"]["share"][rows[~same]] = (
        found[~same],
        result["settled"][rows[~same]],
    )


def _heading(system: System, last: np.ndarray, before: np.ndarray, share: np.ndarray) -> np.ndarray:
    """States (n, d) at these shares of the way, extrapolated along the line through the last two
    states.

    Where these differ much, as they do when they are states in different forcing periods of one
    motion, the last one is taken.
    """
    step = last["state"] - before["state"]
    gone = last["share"] - before["share"]
    usable = (gone > 0.0) & (distance(system, step) <= ALIKE.alike * last["amplitude"])
    with np.errstate(divide="ignore", invalid="ignore"):
        ahead = np.where(usable, (share - last["share"]) / gone, 0.0)
    return states_beside(system, last["state"], ahead[:, None] * step)


def is_symmetric(motions: np.ndarray) -> np.ndarray:
    """Which motions are their own mirror images."""
    return np.asarray(
        np.abs(motions["amplitude"] - motions["other"]) < ALIKE.symmetric * motions["amplitude"]
    )


def is_near(last: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Whether the extrema have changed by no more than those of one motion may in a step of this
    length.

    If the number of impacts is the same, their least speed must not have changed by more either. If
    it is not, the least speed is not compared, as an impact that appears at a grazing begins
    without speed.
    """
    size = np.maximum(last["amplitude"], found["amplitude"])
    near = ALIKE.family * np.sqrt(np.abs(found["share"] - last["share"]))
    apart = (
        np.maximum(*(np.abs(found[name] - last[name]) for name in ("amplitude", "other")))
        <= near * size
    )
    fastest = size + np.maximum(last["slowest"], found["slowest"])
    alike = np.abs(found["slowest"] - last["slowest"]) <= near * fastest
    return np.asarray(apart & (alike | (found["impact_count"] != last["impact_count"])))


def _is_same(last: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Whether what was found a step further on is the same motion."""
    same = (found["period"] == last["period"]) & (is_symmetric(found) == is_symmetric(last))
    return np.asarray(same & is_near(last, found))


def _outcomes(last: np.ndarray, following: np.ndarray, least: float) -> np.ndarray:
    """The outcomes that follow from the last motion that was the same and from the first one that
    was another.
    """
    near = is_near(last, following)
    ratio = following["period"] / last["period"]
    outcome = np.full(len(last), ChangeOutcome.JUMP, dtype=np.int8)
    outcome[near & (ratio == 1.0)] = ChangeOutcome.SYMMETRY
    outcome[near & ((ratio == 2.0) | (ratio == 0.5))] = ChangeOutcome.DOUBLING
    outcome[last["share"] >= 1.0] = ChangeOutcome.MISSED
    outcome[last["amplitude"] < least] = ChangeOutcome.SHRINKS
    return outcome
