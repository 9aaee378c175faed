"""The cells of a stability chart: which stable motions there are under each pair of values of two parameters.

Every cell is tried from states spread over a window, then from the motions of its neighbours, until these add nothing new.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import Window, check_window
from saltus.flow import simulate_many
from saltus.orbits import initial_states
from saltus.systems import System

MOTIONS = 8  # kept of each cell, the largest ones
INNERMOST = 1e-2  # every other start lies in a smaller copy of the window, down to this part of it
STAGES = (1 / 20, 1 / 20, 1 / 10, 4 / 5)  # of the forcing periods, after which motions that have come together go on as one
AT_ONCE, FEWER_STAGES = 500, (1 / 10, 9 / 10)  # for no more tracks than so many
PATIENCE, FEW = 4, 3  # times the periods for what is left of a cell, if no more than so many: slow, and not chaotic
TOGETHER = 1e-2  # of their amplitude: motions so near to one another at the same phase become one
NEGLIGIBLE = 0.5  # of the least amplitude: what stays below it for some periods is not followed to where it settles
EQUAL = 1e-4  # of the amplitude: settled motions with the same extrema, or the mirror images of these, are one
ALIKE = 0.2  # of the amplitude: where a cell has such a motion already a neighbour's is no news
ROUNDS = 400  # of starts from neighbours
SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0))
MOTION = np.dtype(
    [
        ("cell", np.int64),
        ("period", np.int64),  # forcing periods
        ("impact_count", np.int64),  # impacts in them
        ("amplitude", float),  # max abs(theta)
        ("other", float),  # the extremum on the other side, counted positive there
        ("state", float, (2,)),  # theta and theta' at phase 0
    ]
)


@dataclass(frozen=True)
class Task:
    """What is looked for in the cells of a block, and how; the numbers are those of `stability_chart`."""

    system: System
    parameters: Mapping[str, np.ndarray]  # by dotted path, a number for each cell
    max_period: int
    least: float
    periods: int
    tol: float
    threads: int | None

    @property
    def size(self) -> int:
        """How many cells there are."""
        return len(next(iter(self.parameters.values())))


@dataclass
class Tracks:
    """Motions on their way, a row for each."""

    cell: np.ndarray
    state: np.ndarray  # (n, 2) at phase 0
    starts: np.ndarray  # how many each stands for
    amplitude: np.ndarray  # of late

    def only(self, chosen: np.ndarray) -> Tracks:
        """Some of them."""
        return Tracks(self.cell[chosen], self.state[chosen], self.starts[chosen], self.amplitude[chosen])


@dataclass
class Found:
    """The stable motions, each once, by cell and falling amplitude; of the other starts how many ended how, by cell."""

    motions: np.ndarray  # of dtype MOTION
    captured: np.ndarray  # at rest, for all later loads
    tiny: np.ndarray  # on motions smaller than those that count
    unsettled: np.ndarray  # chaotic, slow, or of a longer period


def cells(arguments: Mapping[str, Any], block: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The variables of a chart over a block of its plane, (rows, columns), and those of its motions with a last axis of 8.

    A pure function of its arguments, as a sweep needs it: `arguments` are those of `stability_chart` as JSON has them, with
    `paths` by axis; `block` holds the values of the two axes, rows first.
    """
    axes = [np.asarray(block[name], dtype=float) for name in arguments["paths"]]
    grid = np.meshgrid(*axes, indexing="ij")
    task = Task(
        system=System.from_json(arguments["system"]),
        parameters={path: values.ravel() for path, values in zip(arguments["paths"].values(), grid, strict=True)},
        **{name: arguments[name] for name in ("max_period", "least", "periods", "tol", "threads")},
    )
    states = starts(
        task.system, arguments["starts"], check_window(np.reshape(arguments["window"], (2, 2)), task.system), arguments["seed"]
    )
    found = settle(task, np.repeat(np.arange(task.size), len(states)), np.tile(states, (task.size, 1)))
    motions = from_neighbours(task, found, grid[0].shape)
    made = table(found, motions, task.size)
    return {name: values.reshape(*grid[0].shape, *values.shape[1:]) for name, values in made.items()}


def starts(system: System, count: int, window: Window, seed: int) -> np.ndarray:
    """(count, 2): states spread over the window, every other one drawn in towards the contact, the last of them to 1 %."""
    states = initial_states(system, count, window, seed)
    contact = np.array([float(system.model.contact) if system.model.sides else 0.0, 0.0])
    inner = states[1::2]
    inner[:] = contact + (inner - contact) * np.geomspace(1.0, INNERMOST, len(inner) + 1)[1:, None]
    return states


def settle(task: Task, cell: np.ndarray, states: np.ndarray, known: np.ndarray | None = None) -> Found:
    """Follow motions from states (n, 2) at phase 0 in the cells of these numbers until they settle, or come to a known one."""
    tracks = Tracks(cell, states, np.ones(len(cell), dtype=np.int64), np.full(len(cell), np.inf))
    ended = {name: np.zeros(task.size, dtype=np.int64) for name in ("captured", "tiny", "unsettled")}
    motions = [np.empty(0, MOTION)]
    for share in (*(STAGES if len(cell) > AT_ONCE else FEWER_STAGES), PATIENCE):
        if share == PATIENCE:
            many = np.bincount(tracks.cell, minlength=task.size)[tracks.cell] > FEW
            _count(ended["unsettled"], tracks.only(many))
            tracks = tracks.only(~many)
        tracks, settled, captured = _follow(task, tracks, math.ceil(share * task.periods), motions)
        small = ~captured & (tracks.amplitude < task.least * np.where(settled, 1.0, NEGLIGIBLE))
        _count(ended["captured"], tracks.only(captured))
        _count(ended["tiny"], tracks.only(small))
        tracks = joined(tracks.only(~captured & ~settled & ~small))
        if known is not None:
            tracks = tracks.only(~arrived(tracks, known))
    small = tracks.amplitude < task.least
    _count(ended["tiny"], tracks.only(small))
    _count(ended["unsettled"], tracks.only(~small))
    return Found(distinct(np.concatenate(motions)), **ended)


def _count(number: np.ndarray, tracks: Tracks) -> None:
    np.add.at(number, tracks.cell, tracks.starts)


def _follow(task: Task, tracks: Tracks, periods: int, motions: list[np.ndarray]) -> tuple[Tracks, np.ndarray, np.ndarray]:
    """The tracks some periods later, which of them have settled and which are captured; large ones are noted as motions."""
    if not len(tracks.cell):
        return tracks, np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
    ends = _simulate(task, tracks, periods)
    name, stops = task.system.model.coordinates[0], ends.stop.attrs["flag_meanings"].split()
    captured = np.isin(ends["stop"].values, [stops.index("captured"), stops.index("rest")])
    settled = (ends["recurrence_period"].values > 0) & (ends["recurrence_period"].values <= task.max_period) & ~captured
    kept = np.where(settled, ends["recurrence_period"].values, task.max_period)  # of the last forcing periods
    window = np.arange(ends.sizes["period"])[::-1] < kept[:, None]
    extremes = [np.nanmax(np.where(window, side, np.nan), axis=1, initial=-np.inf) for side in (
        ends[f"largest_{name}"].values, -ends[f"smallest_{name}"].values)]  # fmt: skip
    state = np.stack([ends[name].values, ends["velocity"].values], axis=1)
    tracks = Tracks(tracks.cell, state, tracks.starts, np.maximum(*extremes))
    large = settled & (tracks.amplitude >= task.least)
    new = np.empty(int(large.sum()), MOTION)
    new["cell"], new["period"], new["state"] = tracks.cell[large], kept[large], state[large]
    new["amplitude"], new["other"] = tracks.amplitude[large], np.minimum(*extremes)[large]
    new["impact_count"] = np.nansum(np.where(window, ends["period_impact_count"].values, 0.0), axis=1)[large]
    motions.append(new)
    return tracks, settled, captured


def _simulate(task: Task, tracks: Tracks, periods: int) -> Any:
    states: dict[str, Any] = {task.system.model.coordinates[0]: tracks.state[:, 0], "velocity": tracks.state[:, 1]}
    return simulate_many(
        task.system,
        **states,
        parameters={path: values[tracks.cell] for path, values in task.parameters.items()},
        periods=periods,
        tol=task.tol,
        until=("rest", "settled"),
        sample=("extrema", "impact_count"),
        last=task.max_period,
        threads=task.threads,
    )


def joined(tracks: Tracks) -> Tracks:
    """The tracks with those that have come together as one: in a cell, at the same phase, near to one another for their size."""
    tracks = tracks.only(np.argsort(tracks.cell, kind="stable"))
    into = np.arange(len(tracks.cell))
    for step in range(1, int(np.bincount(tracks.cell).max(initial=0))):
        apart = np.abs(tracks.state[step:] - tracks.state[:-step]).max(axis=1)
        near = apart <= TOGETHER * np.minimum(tracks.amplitude[step:], tracks.amplitude[:-step])
        near &= tracks.cell[step:] == tracks.cell[:-step]
        into[step:] = np.where(near, np.minimum(into[step:], into[:-step]), into[step:])
    kept = into == np.arange(len(into))
    while not kept[into].all():  # what came together with something that did itself
        into = into[into]
    number = np.zeros(len(into), dtype=np.int64)
    np.add.at(number, into, tracks.starts)
    return Tracks(tracks.cell, tracks.state, number, tracks.amplitude).only(kept)


def distinct(motions: np.ndarray) -> np.ndarray:
    """Each motion of each cell once, and mirror images as one, by cell and falling amplitude."""
    motions = motions[np.lexsort((-motions["amplitude"], motions["cell"]))]
    fresh = np.ones(len(motions), dtype=bool)
    for step in range(1, int(np.bincount(motions["cell"]).max(initial=0))):
        one, two = motions[step:], motions[:-step]
        same = (one["cell"] == two["cell"]) & (one["period"] == two["period"])
        for name in ("amplitude", "other"):
            same &= np.abs(one[name] - two[name]) <= EQUAL * two["amplitude"]
        fresh[step:] &= ~same
    return motions[fresh]


def from_neighbours(task: Task, found: Found, shape: tuple[int, int]) -> np.ndarray:
    """The motions found, and those that starts in every cell from its neighbours' motions lead to, until these add nothing.

    This follows every motion through the chart to where its stability ends, however little it attracts there.
    """
    known = news = found.motions
    for _ in range(ROUNDS):
        cell, states = seeds(news, known, shape)
        if not len(cell):
            break
        further = settle(task, cell, states, known).motions
        news = further[~has(known, further["cell"], further, EQUAL)]
        known = distinct(np.concatenate([known, news]))
    return known


def seeds(motions: np.ndarray, known: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Cells, (n,), and states, (n, 2), where a neighbour has a motion and the cell none alike: its state, or where that is
    heading to if the cell behind the neighbour has such a motion too."""
    rows, columns = np.unravel_index(motions["cell"], shape)
    found = []
    for down, right in SIDES:
        inside = (rows + down >= 0) & (rows + down < shape[0]) & (columns + right >= 0) & (columns + right < shape[1])
        behind = (rows - down >= 0) & (rows - down < shape[0]) & (columns - right >= 0) & (columns - right < shape[1])
        step, source = down * shape[1] + right, motions[inside]
        new = ~has(known, source["cell"] + step, source, ALIKE)
        source, behind = source[new], behind[inside][new]
        found.append((source["cell"] + step, _heading(source, known, np.where(behind, source["cell"] - step, -1))))
    return np.concatenate([cell for cell, _ in found]), np.concatenate([states for _, states in found])


def _heading(motions: np.ndarray, known: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """States a cell further on in a straight line from those of alike motions in the cells behind; else the states themselves."""
    ahead = motions["state"].copy()
    for there, other in _motions_of(known, behind):
        like = there & _alike(other, motions, ALIKE)
        step = motions["state"] - other["state"]
        like &= np.abs(step).max(axis=1) <= ALIKE * motions["amplitude"]  # also at the same phase of several periods
        ahead[like] = motions["state"][like] + step[like]
    return ahead


def has(known: np.ndarray, cell: np.ndarray, motions: np.ndarray, tolerance: float) -> np.ndarray:
    """Whether these cells have a motion like each of these."""
    result = np.zeros(len(cell), dtype=bool)
    for there, other in _motions_of(known, cell):
        result |= there & _alike(other, motions, tolerance)
    return result


def _alike(some: np.ndarray, others: np.ndarray, tolerance: float) -> np.ndarray:
    """Whether motions are of the same period and impacts, and of about the same extrema."""
    like = (some["period"] == others["period"]) & (some["impact_count"] == others["impact_count"])
    for name in ("amplitude", "other"):
        like &= np.abs(some[name] - others[name]) <= tolerance * others["amplitude"]
    return np.asarray(like)


def arrived(tracks: Tracks, known: np.ndarray) -> np.ndarray:
    """Which tracks have come to a motion that their cell has already."""
    result = np.zeros(len(tracks.cell), dtype=bool)
    for there, other in _motions_of(known, tracks.cell):
        apart = np.abs(tracks.state - other["state"]).max(axis=1)
        result |= there & (apart <= TOGETHER * np.minimum(tracks.amplitude, other["amplitude"]))
    return result


def _motions_of(known: np.ndarray, cell: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The first motion of each of these cells, then the second, ...: whether there is one, and what it is."""
    first, last = (np.searchsorted(known["cell"], cell, side=side) for side in ("left", "right"))
    for step in range(int((last - first).max(initial=0))):
        there = first + step < last
        yield there, known[np.where(there, first + step, 0)]


def table(found: Found, motions: np.ndarray, size: int) -> dict[str, np.ndarray]:
    """The variables of a chart, each with a row for a cell."""
    number = np.bincount(motions["cell"], minlength=size)
    rank = np.arange(len(motions)) - np.repeat(np.cumsum(number) - number, number)
    kept = rank < MOTIONS
    place = motions["cell"][kept], rank[kept]
    columns = {}
    for name, empty in (("amplitude", np.nan), ("other", np.nan), ("period", 0), ("impact_count", 0)):
        columns[name] = np.full((size, MOTIONS), empty)
        columns[name][place] = motions[name][kept]
    for i, name in enumerate(("theta", "velocity")):
        columns[name] = np.full((size, MOTIONS), np.nan)
        columns[name][place] = motions["state"][kept, i]
    smallest = np.full(size, np.nan)
    np.fmin.at(smallest, motions["cell"], motions["amplitude"])
    return {
        "amplitude": columns["amplitude"][:, 0],
        "period": columns["period"][:, 0],
        "smallest_amplitude": smallest,
        "count": number,
        "rest": found.captured > 0,
        "tiny": found.tiny,
        "unsettled": found.unsettled,
        **{f"motion_{name}": values for name, values in columns.items()},
    }
