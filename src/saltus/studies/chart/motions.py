"""The stable motions of the cells of a chart: the record of a motion, when two are the same, and
what there is in a cell.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.flow import Ending, Recurrence, approached, find_recurrence, return_period, state_names
from saltus.systems import System, natural_units

if TYPE_CHECKING:
    import xarray

KEPT = 8  # the number of motions of each cell that a chart keeps, the largest ones
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))  # rows and columns to the neighbours of a cell


@cache
def motion_type(dimension: int) -> np.dtype[Any]:
    """The record of a motion with so many state variables."""
    return np.dtype(
        [
            ("cell", np.int64),  # the cell's number, row by row
            ("starts", np.int64),  # how many initial states have led to it
            # forcing periods after which it repeats itself; 0 while it has not settled
            ("period", np.int64),
            ("impact_count", np.int64),  # impacts in a period
            ("amplitude", float),  # max abs of all coordinates
            # the extremum on the other side, counted positive there; the amplitude if the motion is
            # symmetric
            ("other", float),
            # The least speed of an impact for models with several contacts, times the natural time
            # so that it is compared with lengths, else 0: between two stops all motions have the
            # same extrema.
            ("slowest", float),
            ("state", float, (dimension,)),  # coordinates and velocities at phase 0
        ]
    )


@dataclass(frozen=True)
class MotionTolerances:
    """By how much of their amplitude motions may differ."""

    # Settled motions of a cell are one motion if their extrema, or those of the mirror image,
    # differ by less.
    same: float = 1e-4
    # Motions of a cell end on the same motion if their states at the same phase differ by less.
    joined: float = 1e-2
    # A neighbour's motion is not tried in a cell that has one whose extrema differ by less.
    alike: float = 0.2
    # Motions of neighbouring cells whose amplitudes differ by less are one family: no motion ends
    # there.
    family: float = 0.35
    # A motion whose two extrema differ by less in size is its own mirror image.
    symmetric: float = 2e-4
    # A motion may end in an orbit on a curve if their amplitudes differ by less: these are steep
    # near a fold.
    curve: float = 0.5
    # A motion that was followed into a cell is the cell's motion if their amplitudes differ by
    # less.
    followed: float = 1e-3


ALIKE = MotionTolerances()


def motions_later(
    system: System,
    motions: np.ndarray,
    periods: int,
    parameters: Mapping[str, np.ndarray],
    *,
    max_period: int,
    kept: int,
    tol: float,
    captured: np.ndarray | None = None,
    slow: float = 0.0,
) -> tuple[np.ndarray, Recurrence]:
    """The motions, records with the fields of `motion_type`, at most so many forcing periods later;
    and how they end.

    Motions are followed so in stages by cells and between cells. If one is about to settle its
    state is the limit to which its last states are extrapolated, so that the next stage begins
    there. Its extrema are those of the period with which it seems to settle: the one of the
    extrapolation or, with `slow`, the one after which it returns within this share of its size.
    """
    ends = find_recurrence(
        system,
        motions["state"],
        periods,
        parameters=parameters,
        captured=captured,
        max_period=max_period,
        kept=kept,
        extrema=True,
        impact_count=True,
        speed=True,
        tol=tol,
    )
    units = natural_units(system)
    ahead = ends.last
    period = np.zeros(len(ends), dtype=int)
    if system.model.has_state_plane:  # else an extrapolated state may lie beyond a contact
        ahead, period = approached(ends.states / units.state, max_period)
        ahead *= units.state
    if slow:
        own = len(system.model.coordinates)
        places = np.abs(ends.states[:, :, :own]) / units.length
        size = np.nanmax(places, axis=(1, 2), initial=0.0)[:, None]
        period = return_period(ends.states, max_period, slow * size, units.state)
    seen = replace(ends, period=np.where(ends.unsettled, period, ends.period))
    later = motions.copy()
    high = seen.highest
    low = -seen.lowest
    later["state"] = np.where(ends.unsettled[:, None], ahead, ends.last)
    later["period"] = seen.period
    later["impact_count"] = seen.impact_count
    later["slowest"] = seen.slowest * units.time
    later["amplitude"] = np.maximum(high, low)
    later["other"] = np.minimum(high, low)
    return later, ends


def distance(system: System, steps: np.ndarray) -> np.ndarray:
    """How large steps between states (n, d) are, (n,), as lengths: of speeds it is the way in the
    natural time."""
    units = natural_units(system)
    return np.asarray(np.abs(steps / units.state).max(axis=1) * units.length)


def motions_in(motions: np.ndarray, cell: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The first motion of each of these cells, then the second, ...: whether there is one, and its
    index in `motions`.
    """
    first, last = (np.searchsorted(motions["cell"], cell, side=side) for side in ("left", "right"))
    for step in range(int((last - first).max(initial=0))):
        there = first + step < last
        yield there, np.where(there, first + step, 0)


def is_same(one: np.ndarray, other: np.ndarray, tolerance: float = ALIKE.same) -> np.ndarray:
    """Whether motions have the same period and the same extrema, so that they are one motion or
    mirror images.
    """
    same = one["period"] == other["period"]
    for name in ("amplitude", "other"):
        same &= np.abs(one[name] - other[name]) <= tolerance * other["amplitude"]
    same &= np.abs(one["slowest"] - other["slowest"]) <= tolerance * (
        other["amplitude"] + other["slowest"]
    )
    return np.asarray(same)


def is_alike(one: np.ndarray, other: np.ndarray, tolerance: float) -> np.ndarray:
    """Whether motions have the same period and number of impacts, and about the same extrema."""
    return np.asarray(
        is_same(one, other, tolerance) & (one["impact_count"] == other["impact_count"])
    )


def has_alike(
    known: np.ndarray, cell: np.ndarray, motions: np.ndarray, tolerance: float
) -> np.ndarray:
    """Whether each of the cells (n,) has a motion similar to the motion of the same index."""
    result = np.zeros(len(cell), dtype=bool)
    for there, index in motions_in(known, cell):
        result |= there & is_alike(known[index], motions, tolerance)
    return result


def distinct(motions: np.ndarray) -> np.ndarray:
    """The motions of each cell without duplicates and mirror images, by cell and falling
    amplitude.
    """
    motions = by_cell(motions)
    fresh = np.ones(len(motions), dtype=bool)
    for step in range(1, int(np.bincount(motions["cell"]).max(initial=0))):
        one = motions[step:]
        other = motions[:-step]
        fresh[step:] &= ~((one["cell"] == other["cell"]) & is_same(one, other))
    return motions[fresh]


def by_cell(motions: np.ndarray) -> np.ndarray:
    """Motions in the order of their cells and, in a cell, of falling amplitude."""
    return motions[np.lexsort((-motions["amplitude"], motions["cell"]))]


def table(
    motions: np.ndarray, size: int, names: Sequence[str], time: float | None = None
) -> dict[str, np.ndarray]:
    """The variables of a chart of `size` cells that follow from its motions, which are given by
    cell and falling amplitude.

    `names` are those of the state variables; with the natural `time` there is a variable for the
    least speed of an impact.
    """
    number = np.bincount(motions["cell"], minlength=size)
    rank = np.arange(len(motions)) - np.repeat(np.cumsum(number) - number, number)
    kept = rank < KEPT
    place = motions["cell"][kept], rank[kept]
    fields = {"amplitude": np.nan, "other": np.nan, "period": 0, "impact_count": 0}
    fields |= {} if time is None else {"slowest": np.nan}
    columns = {
        name: np.full((size, KEPT), empty)
        for name, empty in (fields | dict.fromkeys(names, np.nan)).items()
    }
    for name in fields:
        columns[name][place] = motions[name][kept]
    if time is not None:
        columns["slowest"] /= time
    for i, name in enumerate(names):
        columns[name][place] = motions["state"][kept, i]
    smallest = np.full(size, np.nan)
    np.fmin.at(smallest, motions["cell"], motions["amplitude"])
    summary = {
        "amplitude": columns["amplitude"][:, 0],
        "period": columns["period"][:, 0],
        "smallest_amplitude": smallest,
    }
    return {
        **summary,
        "count": number,
        **{f"motion_{name}": values for name, values in columns.items()},
    }


def read_motions(chart: xarray.Dataset) -> np.ndarray:
    """The motions that a chart keeps, by cell and falling amplitude."""
    chart = chart.transpose("vertical", "horizontal", ...)
    names = [
        "amplitude",
        "other",
        "period",
        "impact_count",
        *(["slowest"] if "motion_slowest" in chart else []),
    ]
    variables = state_names(tuple(str(chart.attrs["coordinate"]).split()))
    columns: dict[str, Any] = {
        name: chart[f"motion_{name}"].values for name in (*names, *variables)
    }
    shape = columns["amplitude"].shape
    at = np.nonzero(np.isfinite(columns["amplitude"]))
    motions = np.zeros(len(at[0]), motion_type(len(variables)))
    motions["cell"] = np.ravel_multi_index(at[:2], shape[:2]) if len(at[0]) else 0
    for name in names:
        motions[name] = columns[name][at]
    if "slowest" in names:
        motions["slowest"] *= natural_units(System.from_json(chart.attrs["system"])).time
    motions["state"] = np.stack([columns[name][at] for name in variables], axis=1)
    return motions


class CellOutcome(NumberedSentence):
    """What there is in a cell."""

    REST = 0, "every motion comes to rest"
    ONE_MOTION = 1, "one stable motion"
    SEVERAL_MOTIONS = 2, "several stable motions"
    CHAOS = 3, "chaos, and no stable motion"
    MOTIONS_AND_CHAOS = 4, "chaos beside stable motions"
    LONG = 5, "a motion of a longer period than is looked for"
    UNDECIDED = 6, "motions of which it is not decided what they are"
    QUASI_PERIODIC = 7, "a quasi-periodic motion"


def outcomes(count: np.ndarray, unsettled: np.ndarray, verdict: np.ndarray) -> np.ndarray:
    """The `CellOutcome` of cells, from their numbers of stable motions and of unsettled starts, and
    the verdict on the latter.
    """
    outcome = np.where(
        count > 1,
        CellOutcome.SEVERAL_MOTIONS,
        np.where(count == 1, CellOutcome.ONE_MOTION, CellOutcome.REST),
    )
    open_ = unsettled > 0
    chaotic = open_ & (verdict == Ending.CHAOTIC)
    outcome[chaotic] = np.where(
        count[chaotic] > 0, CellOutcome.MOTIONS_AND_CHAOS, CellOutcome.CHAOS
    )
    left = open_ & ~chaotic & (count == 0)
    shown = {Ending.PERIODIC: CellOutcome.LONG, Ending.QUASI_PERIODIC: CellOutcome.QUASI_PERIODIC}
    outcome[left] = [shown.get(Ending(one), CellOutcome.UNDECIDED) for one in verdict[left]]
    return np.asarray(outcome)
