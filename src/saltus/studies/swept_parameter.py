"""Sweeps as in an experiment: a parameter is changed step by step, up and down again, while the
motion goes on.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.attractors import check_periodic
from saltus.checks import check_axis, check_count, check_number, checked_by
from saltus.errors import MotionError, ParameterError, shown
from saltus.flow import (
    Ending,
    Extreme,
    Functions,
    Motion,
    Quantity,
    Recurrence,
    captured_between,
    check_new_names,
    driven_range,
    extremes_of,
    find_recurrence,
    own_quantities,
    simulate,
    start_with_sides,
    state_names,
    unit_of,
)
from saltus.progress import Progress, part_of, silent
from saltus.result import provenance
from saltus.studies.swept_cycles import EQUILIBRIUM, recurrence_without_load
from saltus.systems import (
    System,
    arguments_of,
    check_along,
    check_path,
    check_system,
    driven_displacements,
    natural_units,
)

if TYPE_CHECKING:
    import xarray

DIRECTIONS = ("up", "down")
FREQUENCY = "load.frequency"
# Columns of a sweep over both directions: what is read of the recurrence at each value, the unit and
# the text of each.
COLUMNS: dict[str, tuple[Callable[[Recurrence], Any], str, str]] = {
    "impact_count": (lambda row: row.impact_count[0], "1", "impacts in a period"),
    "period": (
        lambda row: row.period[0],
        "1",
        "forcing periods after which it repeats itself; 0 where it does not",
    ),
    "periods": (lambda row: row.periods[0], "1", "forcing periods that it was followed"),
}
# The same without a load.
COLUMNS_WITHOUT_LOAD: dict[str, tuple[Callable[[Recurrence], Any], str, str]] = {
    "impact_count": COLUMNS["impact_count"],
    "period": (COLUMNS["period"][0], "1", "the time after which it repeats itself; 0 without one"),
    "periods": (COLUMNS["periods"][0], "1", "natural periods that it was followed"),
}


@dataclass(frozen=True)
class SweepSettings:
    """The numbers by which it is decided whether a step of the amplitude is a jump."""

    step_factor: float = (
        # A step is examined if it is this many times the median of the steps around it: a smooth
        # response has few such.
        5.0
    )
    neighbours: int = 10  # Number of steps around it of which the median is taken.
    # Steps below this share of the largest amplitude are invisible in a plot, and are not examined.
    least_step: float = 0.002
    # A large step is swept again in 10 parts, and from the part that contains the change on in
    # parts of 1/100 and then of 1/1024 of the step: transients become shorter with the parts, so
    # that the jump of a slow sweep is left.
    parts: tuple[int, ...] = (10, 100, 1024)
    kept: float = (
        # The share of the step that must be left in one part, if it is a jump; a root, as near a
        # fold, leaves 0.03.
        0.1
    )
    # Amplitudes up and down are different if they differ by this share of the largest one.
    hysteresis: float = 0.01


SETTINGS = SweepSettings()


@dataclass(frozen=True, kw_only=True)
class SweepRequest:
    """The arguments of `frequency_sweep`, checked and as arrays."""

    system: System
    path: str
    values: Any
    periods: int
    stop_early: bool
    max_period: int
    tol: float
    functions: Any
    velocity: Any
    relays: Any
    coordinates: Any
    own: tuple[Quantity, ...] = field(init=False)  # the functions
    grid: np.ndarray = field(init=False)
    falling: bool = field(init=False)  # whether the sweep begins downwards
    start: np.ndarray = field(init=False)  # (d,)

    def __post_init__(self) -> None:
        check_system(
            self.system,
            "frequency_sweep",
            several_contacts=True,
            multipliers=True,
            switches=True,
            resets=True,
            relays=True,
        )
        if self.is_free:
            self._check_without_load()
        check_path(self.system, self.path)
        given = check_axis("values", self.values, either_way=True)
        falling = bool(given[0] > given[-1])
        grid = given[::-1] if falling else given
        if grid.size < 2:
            raise ParameterError(
                f"values must be two or more increasing or decreasing numbers, got "
                f"{shown(self.values)}",
                "values",
            )
        object.__setattr__(self, "own", own_quantities(self.system, self.functions))
        names = {
            "amplitude",
            "hysteresis",
            "outcome",
            *COLUMNS,
            *state_names(self.coordinate_names),
        }
        check_new_names(self.own, names | {each.name for each in self.extremes})
        check_along(self.system, self.path, grid, "values")
        check_count("periods", self.periods, 1)
        check_count("max_period", self.max_period, 1)
        check_number("tol", self.tol, at_least=1e-15, at_most=1e-6)
        object.__setattr__(self, "grid", grid)
        object.__setattr__(self, "falling", falling)
        object.__setattr__(
            self,
            "start",
            start_with_sides(
                self.system,
                self.velocity,
                self.relays,
                self.coordinates,
                self.__dataclass_fields__,
            ),
        )

    @property
    def is_free(self) -> bool:
        """Whether the load has no period, so that it is cycles of any period that are swept."""
        return self.system.load.frequency is None

    def _check_without_load(self) -> None:
        """Refuse what has no meaning without a load that varies."""
        check_periodic(self.system)
        if self.path == FREQUENCY:
            raise ParameterError(
                "the load has no frequency to sweep; give it one, or name another parameter, such "
                "as path='model.belt_speed', over which cycles without a load are swept",
                "path",
            )
        if not self.stop_early:
            raise ParameterError(
                "without a load there are no forcing periods for which a value could be kept; leave"
                " out stop_early=False",
                "stop_early",
            )

    @property
    def columns(self) -> dict[str, tuple[Callable[[Recurrence], Any], str, str]]:
        """What is read of the motion at each value."""
        return COLUMNS_WITHOUT_LOAD if self.is_free else COLUMNS

    def proved_speeds(self, values: np.ndarray) -> np.ndarray:
        """The speeds of capture at these values, (n,), proved together: a single proof takes as
        long as that of a hundred.
        """
        columns = {self.path: values}
        return (
            captured_between(self.system, columns, columns)
            if self.stop_early and not self.is_free
            else np.full(len(values), np.nan)
        )

    def ends(
        self, system: System, states: np.ndarray, captured: np.ndarray, parameters: Any = None
    ) -> Recurrence:
        """What becomes of states at phase 0, (n, d), with the speeds of capture, (n,), and
        parameters of their own.
        """
        if self.is_free:
            return recurrence_without_load(system, states, self.periods, parameters, self.tol)
        return find_recurrence(
            system,
            states,
            self.periods,
            parameters=parameters,
            captured=captured,
            max_period=self.max_period,
            kept=2 * self.max_period + 2 if self.stop_early else min(self.periods, self.max_period),
            extrema=True,
            from_start=True,
            impact_count=True,
            stop_early=self.stop_early,
            tol=self.tol,
            threads=1 if len(states) == 1 else None,
        )

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The names of the coordinates."""
        names: tuple[str, ...] = self.system.model.coordinates
        return names

    @property
    def extremes(self) -> tuple[Extreme, ...]:
        """The largest and the smallest value of each displacement, in the order of the columns."""
        found = extremes_of(self.system)
        return found[::2] + found[1::2]

    def _motion(self, value: float, rows: Recurrence, i: int) -> Motion:
        """The motion on which a value was left: one period of it or, if it has none, `max_period`
        forcing periods, but no more than each value is kept for."""
        system = self.system.with_({self.path: float(value)})
        if self.is_free:
            lasting = float(rows.period[i]) or natural_units(system).time
            start = arguments_of(system, rows.last[i])
            return simulate(system, **start, duration=lasting, tol=self.tol)
        periods = int(rows.period[i]) or min(self.max_period, self.periods)
        return simulate(system, **arguments_of(system, rows.last[i]), periods=periods, tol=self.tol)

    def numbers_of(self, value: float, row: Recurrence) -> dict[str, float]:
        """The extrema of each displacement, and the functions, of the motion on which one value was
        left.
        """
        several = len(self.coordinate_names) > 1
        if not (self.own or several):
            ranges = {self.coordinate_names[0]: (float(row.lowest[0]), float(row.highest[0]))}
            return {each.name: each.over(ranges) for each in self.extremes}
        motion = self._motion(value, row, 0)
        found = {each.name: each.of(motion) for each in self.own}
        if not several:
            ranges = {self.coordinate_names[0]: (float(row.lowest[0]), float(row.highest[0]))}
            return {each.name: each.over(ranges) for each in self.extremes} | found
        return {each.name: each.of(motion) for each in self.extremes} | found

    def outcome_of(self, row: Recurrence) -> str:
        """The word for what a value was left on.

        That all of it sticks when the time is up says nothing where it may slip in every period: what
        goes on sticking is periodic. A part that moves beside it would change the word.
        """
        outcome = Ending(int(row.outcome[0]))
        if self.is_free and outcome is Ending.PERIODIC and not row.period[0]:
            return EQUILIBRIUM
        if outcome is Ending.HELD and self.system.model.frictions:
            outcome = Ending.UNDECIDED
        return outcome.name.lower()

    def kind_of(self, row: Recurrence) -> tuple[Any, ...]:
        """What changes at a jump alone: the impacts and the period or, where the period is any time,
        what the motion was left on."""
        return row.impact_count[0], self.outcome_of(row) if self.is_free else row.period[0]

    def amplitude_of(self, value: float, rows: Recurrence, i: int) -> float:
        """The amplitude of the motion on which a value was left: of the coordinate or, of several,
        of the displacement that the load drives.
        """
        if len(self.coordinate_names) == 1:
            return float(max(abs(rows.highest[i]), abs(rows.lowest[i])))
        if rows.ended[i]:
            return math.nan
        low, high = driven_range(self._motion(value, rows, i))
        return max(abs(low), abs(high))


def _check(progress: object = None, **arguments: Any) -> None:
    SweepRequest(coordinates=_taken_out(arguments), **arguments)


def _taken_out(arguments: dict[str, Any]) -> dict[str, Any]:
    """The coordinates among named arguments; they are removed from these."""
    known = set(SweepRequest.__dataclass_fields__)
    return {name: arguments.pop(name) for name in list(arguments) if name not in known}


@checked_by(_check)
def frequency_sweep(
    system: System,
    values: Iterable[float],
    *,
    path: str = "load.frequency",
    periods: int = 1000,
    stop_early: bool = True,
    max_period: int = 16,
    velocity: float = 0.0,
    relays: Mapping[str, bool] | None = None,
    tol: float = 1e-11,
    functions: Functions | None = None,
    progress: Progress = silent,
    **coordinates: float,
) -> xarray.Dataset:
    """The response while a parameter goes up and down again, as in an experiment: at each value the
    motion starts from the last state at the value before. If the values fall, the sweep goes down
    and then up.

    Under a load without a frequency, on which nothing acts that varies with time, it is cycles that
    are swept over a parameter that `path` names: a mass on a belt over the belt's speed. `period` is
    then a time, `periods` counts natural periods, the state is that in which a value was left, and
    `outcome` may be `equilibrium`. An equilibrium that repels is left.

    With `stop_early`, each value is kept until the motion repeats itself. Without, it is kept for
    exactly `periods` forcing periods: with periods=1 and many values the parameter changes slowly
    and steadily. Values change at phase 0 of the load, so that the phase of a harmonic does not
    jump.

    A step of the amplitude may be large compared with its neighbours, or the number of impacts or
    the period changes there. It is swept again in parts, down to a thousandth of it; the part that
    is then left is a jump (without `stop_early` the step itself is reported). Where up and down
    differ there is hysteresis.

    Parameters
    ----------
    system
        What moves, under a load with a frequency or a constant one.
    values
        Values of the parameter, increasing or falling.
    path
        Dotted path of the parameter.
    periods
        Forcing periods at each value: the most with `stop_early`, else exactly so many. Without a
        load natural periods, 2 pi natural times each.
    stop_early
        Whether a value is left as soon as the motion repeats itself.
    max_period
        The longest period looked for.
    velocity, coordinates
        The state at the first value, at phase 0.
    relays
        Whether each `Relay` of the model is on there, as `simulate` takes it.
    tol
        The error that one step of the integration may make.
    functions
        Quantities of one's own by name: numbers of the motion on which each value was left. It
        begins at phase 0 and takes one period. Where it does not repeat itself, it takes
        `max_period` forcing periods, but no more than `periods`.
    progress
        Called with the fraction done and what is being done.

    Returns
    -------
    xarray.Dataset
        A Dataset, whose values increase. Over (direction, value): `amplitude` (the largest
        absolute value of the coordinate; of several, of the one that the load drives),
        `largest_...` and `smallest_...` of each coordinate and of each named point in the motion's
        period; `impact_count`, `period` (0: it does not repeat itself), `outcome`, the
        state at phase 0, and the `functions`. Over (value): `hysteresis`. Over (jump): its
        direction, the values that enclose it and the amplitudes there. At values that were not
        reached, as a margin ended the motion before, there is nan.

    Raises
    ------
    ParameterError
        An argument without meaning; a load that does not repeat; `load.frequency` swept or
        `stop_early=False` without a load; a start beyond a contact.

    Examples
    --------
    >>> sweep = saltus.frequency_sweep(system, [0.98, 0.99, 1.0], theta=0.3)
    >>> int(sweep.hysteresis.sum()), sweep.sizes["jump"]
    (0, 0)
    """
    asked = SweepRequest(
        system=system, path=path, values=values, periods=periods, stop_early=stop_early, max_period=max_period, tol=tol,
        functions=functions, velocity=velocity, relays=relays, coordinates=coordinates,
    )  # fmt: skip
    there, back = DIRECTIONS[:: -1 if asked.falling else 1]
    order = asked.grid[:: -1 if asked.falling else 1]
    first = _swept(asked, order, asked.start, part_of(progress, 0.0, 0.4, f"{path} {there}"))
    reached = len(first.rows)
    if not reached:
        _refuse_start(asked, order[0])
    state = first.rows[-1].last[0] if reached else asked.start
    second = _swept(
        asked, order[:reached][::-1], state, part_of(progress, 0.4, 0.8, f"{path} {back}")
    )
    runs = {there: first, back: second}
    jumps = _jumps(asked, runs, part_of(progress, 0.8, 1.0))
    progress(1.0, "done")
    return _dataset(asked, (runs["up"], runs["down"]), jumps)


def _refuse_start(asked: SweepRequest, value: float) -> None:
    """Refuse a start from which there is no motion at the first value, as `simulate` does: one
    beyond a contact, for instance.
    """
    system = asked.system.with_({asked.path: float(value)})
    with contextlib.suppress(MotionError):  # the motion begins, and cannot go on
        simulate(system, **arguments_of(system, asked.start), periods=1, tol=asked.tol, dense=False)


@dataclass(frozen=True)
class _OneWay:
    """A sweep in one direction: the values that were reached, in their order, and the motion at
    each.
    """

    values: np.ndarray
    start: np.ndarray
    rows: list[Recurrence]
    numbers: list[dict[str, float]]  # the extrema of the displacements, and the functions
    driven: tuple[str, ...]  # the displacements that the load drives

    @property
    def amplitude(self) -> np.ndarray:
        """The amplitude at each value."""
        extremes = [
            [numbers[f"{kind}_{name}"] for kind in ("largest", "smallest") for name in self.driven]
            for numbers in self.numbers
        ]
        return np.asarray(np.abs(np.reshape(extremes, (-1, 2 * len(self.driven)))).max(axis=1))


def _swept(
    asked: SweepRequest, values: np.ndarray, state: np.ndarray, progress: Progress
) -> _OneWay:
    """Follow the motion from value to value, until a margin ends it."""
    run = _OneWay(values, state, [], [], driven_displacements(asked.system))
    for i, (value, captured) in enumerate(zip(values, asked.proved_speeds(values), strict=True)):
        progress(i / len(values), "")
        row = asked.ends(
            asked.system.with_({asked.path: float(value)}), state[None], np.array([captured])
        )
        if row.ended[0]:
            break
        run.rows.append(row)
        run.numbers.append(asked.numbers_of(value, row))
        state = row.last[0]
    return replace(run, values=values[: len(run.rows)])


@dataclass
class _Step:
    """A step of one direction, of which the part is looked for in which a slower sweep makes the
    change of amplitude.
    """

    direction: str
    first: float
    last: float  # the values at its ends
    before: float
    after: float  # the amplitudes there
    # the value to which the slower sweep has come, with the amplitude and the state there
    low: float
    size: float
    state: np.ndarray
    found: tuple[float, ...]  # the values before and after the change, and the amplitudes there
    ended: bool = False  # whether a margin has ended the slower sweep

    @property
    def change(self) -> float:
        """How much the amplitude changes where it changes most, as far as it is known."""
        return abs(self.found[3] - self.found[2])

    @property
    def is_left(self) -> bool:
        """Whether so much of the step is left there that it may be a jump."""
        return self.change >= SETTINGS.kept * abs(self.after - self.before)

    def goes_on(self, asked: SweepRequest, value: float, rows: Recurrence, i: int) -> bool:
        """Take the motion at the next value; returns whether the change is still to come."""
        self.ended = bool(rows.ended[i])
        if self.ended:
            return False
        size = asked.amplitude_of(value, rows, i)
        if abs(size - self.after) < abs(size - self.size):
            self.found = (self.low, value, self.size, size)
            return False
        self.low = value
        self.size = size
        self.state = rows.last[i]
        return True


def _jumps(
    asked: SweepRequest, runs: Mapping[str, _OneWay], progress: Progress
) -> list[tuple[Any, ...]]:
    """The direction of each jump, the values before and after it, and the amplitudes there."""
    steps = list[_Step]()
    least = dict[str, float]()
    for name, run in runs.items():
        least[name] = SETTINGS.least_step * run.amplitude.max(initial=0.0)
        for i in _candidates(asked, run):
            first, last = run.values[i : i + 2].tolist()
            a, b = run.amplitude[i : i + 2].tolist()
            steps.append(
                _Step(name, first, last, a, b, first, a, run.rows[i].last[0], (first, last, a, b))
            )
    levels = SETTINGS.parts if asked.stop_early else ()
    for k, parts in enumerate(levels):
        _sweep_parts(asked, steps, parts, part_of(progress, k / len(levels), (k + 1) / len(levels)))
        steps = [step for step in steps if step.is_left]  # a smooth change is spread over its parts
    return [
        (step.direction, *step.found)
        for step in steps
        if step.is_left and step.change >= least[step.direction]
    ]


def _sweep_parts(asked: SweepRequest, steps: list[_Step], parts: int, progress: Progress) -> None:
    """Sweep steps again in so many parts, all of them at once, each up to its change of
    amplitude.
    """
    ways = [
        (step, _parts(step.low, step.last, (step.last - step.first) / parts))
        for step in steps
        if not step.ended
    ]
    ways = [(step, inner) for step, inner in ways if inner]
    if not ways:
        return
    proved = iter(asked.proved_speeds(np.array([value for _, inner in ways for value in inner])))
    going = [(step, [(value, next(proved)) for value in inner]) for step, inner in ways]
    for k in range(max(len(inner) for _, inner in going)):
        progress(k / parts, f"{asked.path} in smaller steps, {len(going)} at once")
        values, captured = np.array([inner[k] for _, inner in going]).T
        rows = asked.ends(
            asked.system,
            np.array([step.state for step, _ in going]),
            captured,
            {asked.path: values},
        )
        here = zip(going, values.tolist(), range(len(going)), strict=True)
        going = [
            (step, inner)
            for (step, inner), value, i in here
            if step.goes_on(asked, value, rows, i) and k + 1 < len(inner)
        ]
        if not going:
            return


def _parts(low: float, last: float, step: float) -> list[float]:
    """The values after `low`, a step apart, up to `last` itself."""
    values = []
    while low != last:
        low += step
        low = last if abs(low - last) < 0.5 * abs(step) else low
        values.append(low)
    return values


def _candidates(asked: SweepRequest, run: _OneWay) -> list[int]:
    """The steps of the amplitude that are large compared with those around them, or at which
    impacts or the period change.
    """
    sizes = run.amplitude
    reach = SETTINGS.neighbours // 2
    steps = np.abs(np.diff(sizes))
    kinds = [asked.kind_of(row) for row in run.rows]
    other = np.array([one != following for one, following in pairwise(kinds)], dtype=bool)
    around = [np.delete(steps, i)[max(0, i - reach) : i + reach] for i in range(steps.size)]
    usual = np.array([np.median(near) if near.size else 0.0 for near in around])
    large = (steps > SETTINGS.step_factor * usual) | other
    return np.flatnonzero(large & (steps > SETTINGS.least_step * sizes.max(initial=0.0))).tolist()


def _state_of(i: int, row: Recurrence) -> float:
    return float(row.last[0, i])


def _dataset(
    asked: SweepRequest, runs: tuple[_OneWay, _OneWay], jumps: list[tuple[Any, ...]]
) -> xarray.Dataset:
    import xarray

    model = asked.system.model
    count = asked.grid.size
    driven = driven_displacements(asked.system)
    names = model.coordinates
    unit = unit_of(asked.system, driven[0])
    columns: dict[str, tuple[Callable[[Recurrence], Any], str, str]] = dict(asked.columns)
    for i, state in enumerate(state_names(names)):
        columns[state] = (
            partial(_state_of, i),
            model.unit_of(names[i % len(names)]),
            f"{state} where it was left" if asked.is_free else f"{state} at phase 0",
        )
    table = {key: np.full((2, count), np.nan) for key in columns}
    outcome = np.full((2, count), "", dtype=f"<U{max(len(each.name) for each in Ending)}")
    texts = {
        each.name: {
            "units": each.unit,
            "long_name": f"{each.kind} {each.displacements[0]} in a period",
        }
        for each in asked.extremes
    }
    own = {each.name: np.full((2, count), np.nan) for each in (*asked.extremes, *asked.own)}
    for way, run in enumerate(runs):
        for key, values in own.items():
            values[way, np.searchsorted(asked.grid, run.values)] = [
                numbers[key] for numbers in run.numbers
            ]
    for run, values, words in zip(runs, zip(*table.values(), strict=True), outcome, strict=True):
        places = np.searchsorted(asked.grid, run.values)
        words[places] = [asked.outcome_of(row) for row in run.rows]
        for column, (read, _, _) in zip(values, columns.values(), strict=True):
            column[places] = [read(row) for row in run.rows]
    over = ("direction", "value")
    sizes = [own[f"{kind}_{name}"] for kind in ("largest", "smallest") for name in driven]
    amplitude = np.abs(sizes).max(axis=0)
    said = {"units": unit, "long_name": f"max abs({' or '.join(driven)}) in a period"}
    data = xarray.Dataset(
        {"amplitude": (over, amplitude, said)}
        | {
            key: (over, table[key], {"units": units, "long_name": text})
            for key, (_, units, text) in columns.items()
        },
        {
            "direction": list(DIRECTIONS),
            "value": ("value", asked.grid, {"units": "1", "long_name": asked.path}),
        },
    )
    data = data.assign(
        {
            key: (over, found, texts.get(key, {"units": "1", "long_name": key}))
            for key, found in own.items()
        }
    )
    data["outcome"] = (
        over,
        outcome,
        {"long_name": "rest, periodic, or moving without repeating itself"},
    )
    up, down = amplitude
    apart = np.abs(up - down) > SETTINGS.hysteresis * np.nanmax(amplitude, initial=0.0)
    data["hysteresis"] = (
        "value",
        apart.astype(np.int8),
        {"units": "1", "long_name": "whether up and down differ"},
    )
    labels = ("direction", "before", "after", "amplitude_before", "amplitude_after")
    for i, label in enumerate(labels):
        found = np.array(
            [jump[i] for jump in jumps], dtype="<U4" if label == "direction" else float
        )
        data[f"jump_{label}"] = (
            "jump",
            found,
            {"units": unit if label.startswith("amplitude") else "1"},
        )
    start = {f"start_{each}": float(x) for each, x in zip(names, asked.start, strict=False)}
    numbers: dict[str, Any] = {
        "path": asked.path,
        "coordinate": " ".join(names),
        "periods": asked.periods,
        "stop_early": str(asked.stop_early),
        **start,
    }
    data.attrs = {"title": "sweep computed by saltus", "kind": "frequency_sweep"}
    data.attrs |= provenance(asked.system, tol=asked.tol, **numbers)
    data.attrs["shown"] = " ".join(driven)
    return data
