"""Proofs of capture: a speed after an impact below which a motion comes to rest at the contact and
never leaves it.

Bounds of the pull give the energy that opens a gap in a flight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np

from saltus.bounds.adiabatic_invariant import budget, first_guess, largest_start, normal_form
from saltus.bounds.gap_equation import OPENING, SPEED, Leaves, Opening, reads
from saltus.bounds.intervals import SLACK, Interval, enclose, enclosed_along
from saltus.systems import (
    System,
    broadcast_arrays,
    check_parameters,
    check_system,
    finite_array,
    numbers,
    parameter_table,
)
from saltus.taylor import (
    Expr,
    Trace,
    differentiate,
    number,
    record_tables,
    structure_key,
    substitute,
    trace,
)

Bounds = Callable[[Interval], Interval]
Work = tuple[Any, Any, Any]


@dataclass(frozen=True)
class ClimbSettings:
    """The largest opening of a gap, and the steps in which it is opened."""

    widest: float = 1e6  # The largest opening that is considered.
    # The largest number of times that the first step is divided by 4, until it may be taken.
    tries: int = 30
    steps: int = 20  # The largest number of steps over the opening, each at most a third of it.


CLIMB = ClimbSettings()


def climb(pull: Bounds, slope: Bounds, allowed: Any) -> Work:
    """Open a gap from 0 as long as the pull is positive at all times and the ratio of the two works
    is below `allowed`.

    Parameters
    ----------
    pull
        Bounds of -A(t, w, 0) over all t for w in an interval, arrays (1, n).
    slope
        Bounds of its derivative to w.
    allowed
        The bound of the ratio of the works, (1, n).

    Returns
    -------
    Work
        The opening W that is reached, and lower and upper bounds of the work, int_0^W min_t(-A) dw
        and int_0^W max_t(-A) dw; arrays (1, n), 0 where nothing is proved. The ratio of the works
        is below `allowed` for all smaller openings too.
    """
    done: Work = (np.zeros_like(allowed), np.zeros_like(allowed), np.zeros_like(allowed))
    step = np.ones_like(allowed)
    for _ in range(CLIMB.tries):  # until the whole of it can be one step
        _, holds = _step(pull, slope, allowed, done, step)
        if holds.all():
            break
        step = np.where(holds, step, step / 4)
    first = step = step / 2
    for _ in range(CLIMB.steps):
        new, holds = _step(pull, slope, allowed, done, step)
        done = tuple(np.where(holds, x, y) for x, y in zip(new, done, strict=True))
        step = np.where(holds, np.minimum(2 * step, np.maximum(done[0] / 3, first)), step / 2)
    return done


def _step(pull: Bounds, slope: Bounds, allowed: Any, done: Work, step: Any) -> tuple[Work, Any]:
    """The works after one more step, and whether it may be taken.

    Over a step h the work is h times the pull in the middle, to within h^2 / 8 times the range of
    the slope. Anywhere in the step, the ratio of the works lies between the ratio before the step
    and the one with the extreme pulls of the step.
    """
    opening, lo, hi = done
    middle = pull(Interval(opening + step / 2))
    change = slope(Interval(opening, opening + step))
    reach = step / 2 * change.magnitude()
    spread = step * step / 8 * (change.hi - change.lo)
    low = (middle.lo - reach) * (1 - SLACK)
    high = (middle.hi + reach) * (1 + SLACK)
    new = (
        opening + step,
        lo + (step * middle.lo - spread) * (1 - SLACK),
        hi + (step * middle.hi + spread) * (1 + SLACK),
    )
    return new, (low > 0) & (hi + high * step < allowed * (lo + low * step)) & (
        new[0] <= CLIMB.widest
    )


@dataclass(frozen=True)
class CaptureSettings:
    """The intervals of a proof, and the speeds that are tried."""

    cells: int = 16  # The number of intervals into which the forcing period is divided.
    # Parameter sets that are treated at once for each cell of the time: their arrays then stay in
    # the cache.
    batch: int = 8192
    # The number of intervals for a system at rest, where a bound is cheap and the load makes all
    # its width.
    rest_cells: int = 64
    # A product of impact factors this close to 1 is 1: no law states its numbers more exactly.
    one: float = 1e-14
    # The largest speeds over which the corrected invariant is bounded, as shares of the first
    # guess; they are tried in turn.
    boxes: tuple[float, ...] = (0.7, 0.2)


CAPTURE = CaptureSettings()


def capture_speed(system: System, parameters: Mapping[str, Any] | None = None) -> Any:
    """The speed of the gap just after an impact below which a motion is provably captured at the
    contact.

    The impact may be at any time and to any side. If it leaves abs(gap_rate * velocity) below the
    returned speed, the motion stays near the contact under all later loads and its speed falls to
    zero: in finite time if impacts lose speed, otherwise through damping. No later release is
    possible, as the contact accelerations press on every side at all times. The speed is 0 where
    nothing is proved: for instance if the load can lift the system off, if neither impacts nor
    damping dissipate energy, or if the impact law has no bounded slope at rest
    (`EnergyRestitution`). Margins at which a motion may stop are not considered.

    On side s the gap obeys w'' = A(t, w, u), u = w'. Let f be the factor of the gap's speed at
    impact, and measure the gap of one side in units that make the factors of both sides equal. The
    larger of two speeds is returned.

    *Energy.* Let A_u <= 0 and 0 < lo(w) <= -A(t, w, 0) <= hi(w) for all t. A flight that leaves
    with speed v turns before W, where 2 int_0^W lo dw = v^2, and comes back with rho^2 v^2 <= 2
    int_0^W hi dw. So it is captured if f rho < 1 up to v; and where A does not depend on the time,
    rho <= 1, if the flights stay below the first W at which lo may be 0 (the barrier), and f < 1,
    or f <= 1 and A_u < 0.

    *Corrected adiabatic invariant.* Under periodic loads the energy bounds prove nothing for f near
    1, because flights gain speed while the pull grows and lose it afterwards. L = 3 ln v + ln sum
    1/alpha + O(v) falls nevertheless (`adiabatic_invariant.py`), so that damping captures at f = 1
    too. Records of samples are not periodic: only the energy bounds are used with them.

    All bounds are interval bounds over the whole forcing period, or the whole record, and over all
    openings and speeds in question.

    Parameters
    ----------
    system
        A model with a contact.
    parameters
        Arrays or numbers by dotted path, which broadcast; all others are the system's.

    Returns
    -------
    Any
        The speeds, an array of the shape to which the parameters broadcast; a DataArray where they
        are DataArrays.

    Raises
    ------
    ParameterError
        `system` is no system; a path leads to no number of it; a value is no number, or refused by
        the system; or shapes do not fit together.

    Examples
    --------
    >>> quiet = system.with_({"load.horizontal.amplitude": 0.02})
    >>> bool(saltus.capture_speed(quiet) > 0.02), float(saltus.capture_speed(system))  # beyond Hcr nothing is proved
    (True, 0.0)
    """
    check_system(system, "capture_speed", several_contacts=True)
    arrays = {
        path: finite_array(path, given)
        for path, given in parameter_table(system, parameters).items()
    }
    dims, shape, coords, columns = broadcast_arrays(arrays)
    check_parameters(system, columns)
    speeds = proved_speeds(system, columns).reshape(shape)
    if all(not hasattr(a, "dims") or not a.ndim for a in arrays.values()):
        return speeds
    from xarray import DataArray

    return DataArray(speeds, dims=dims, coords=coords, name="capture_speed")


def proved_speeds(
    system: System, given: Mapping[str, np.ndarray], to: Mapping[str, np.ndarray] | None = None
) -> np.ndarray:
    """`capture_speed` for flat columns of numbers that the system takes; (n,), or (1,) for numbers
    alone.

    With second columns, `to`, each speed holds for all numbers between the two columns; under a
    load by records it is then 0.
    """
    traced, law = _law_of(system)
    sides = [
        [columns.get(path, np.asarray(value)) for path, value in system.parameters.items()]
        for columns in (given, to or given)
    ]
    columns = np.broadcast_arrays(*map(np.atleast_1d, sides[0] + sides[1]))
    first = columns[: len(sides[0])]
    second = columns[len(sides[0]) :]
    result = np.zeros(columns[0].size)
    records = [] if law is None else _record_ranges(system, traced, given)
    if law is None or (records and to is not None):
        return result
    for start in range(0, result.size, CAPTURE.batch):
        part = slice(start, start + CAPTURE.batch)
        ranges = [
            Interval(np.minimum(a, b)[None, part], np.maximum(a, b)[None, part])
            for a, b in zip(first, second, strict=True)
        ]
        result[part] = law.capture(Leaves(ranges, records), result[part].size)
    return result


def _law_of(system: System) -> tuple[Trace, _Law | None]:
    """The trace of a system and the expressions that are bounded (None without a contact), kept for
    each structure.
    """
    key = structure_key(system)
    if key not in _laws:
        traced = trace(system)
        _laws[key] = traced, _Law(traced) if traced.side_count else None
    return _laws[key]


_laws: dict[Any, tuple[Trace, _Law | None]] = {}


def keeps_rest(system: System, given: Mapping[str, np.ndarray]) -> np.ndarray:
    """Whether a system with several contacts stays at rest for ever once all of them are closed,
    proved for columns of numbers.

    It is proved where interval bounds of every contact's reaction, l = -r(t, q, 0) along its sign
    at rest, are positive over the whole forcing period. Nothing is proved where a coordinate has no
    contact or two of them, or under a load by records.

    Returns
    -------
    np.ndarray
        (n,), or (1,) for numbers alone.
    """
    traced, _ = _law_of(system)
    # those of a structure's equations too
    arrays = (given.get(path, np.asarray(value)) for path, value in numbers(system))
    columns = np.broadcast_arrays(*map(np.atleast_1d, arrays))
    size = columns[0].size if columns else 1
    if (
        traced.records
        or traced.dependent
        or sorted(traced.contact_coordinates) != list(range(traced.dof))
    ):
        return np.zeros(size, dtype=bool)
    state = {
        Expr("coordinate", (), i): position
        for i, position in zip(traced.contact_coordinates, traced.positions, strict=True)
    }
    state |= {
        Expr(op, (), i): number(0.0)
        for op in ("velocity", "acceleration")
        for i in range(traced.dof)
    }
    always = Leaves([Interval(c[None, :]) for c in columns], [])
    frequency = next(
        (i for i, path in enumerate(traced.parameters) if path == "load.frequency"), None
    )
    time = Interval(-1e300, 1e300)
    if frequency is not None:
        edges = np.arange(CAPTURE.rest_cells + 1)[:, None] * (2 * np.pi / CAPTURE.rest_cells)
        time = Interval(edges[:-1], edges[1:] * (1 + SLACK)) / always.parameters[frequency]
    pushes = enclose(
        [substitute(reaction, state) for reaction in traced.reactions], replace(always, time=time)
    )
    lowest = [np.broadcast_to(push.lo, (CAPTURE.rest_cells, size)).min(axis=0) for push in pushes]
    return np.asarray(np.min(lowest, axis=0) > 0.0)


def _record_ranges(
    system: System, traced: Trace, columns: Mapping[str, np.ndarray]
) -> list[Interval]:
    """Bounds of every record (and derivative) that the trace reads, over all time and all numbers;
    scales left out.
    """
    breaks, tables = record_tables(system, traced.records, columns)
    if not breaks.size:
        return []
    edge = np.zeros((len(breaks), 1))
    length = np.concatenate([edge, np.diff(breaks, axis=1), edge], axis=1).reshape(-1)
    span = Interval(np.zeros_like(length), length)
    ranges = []
    for rows in np.moveaxis(tables, 1, 0):
        # a record that drifts before its start or after its end has no bounds
        drifts = np.any(rows[:, [0, -1], 1:] != 0.0)
        pieces = rows.reshape(-1, rows.shape[-1]).T
        value = reduce(
            lambda total, c: total * span + Interval(c), pieces[-2::-1], Interval(pieces[-1])
        )
        ranges.append(Interval(-np.inf, np.inf) if drifts else value.over_cells())
    return ranges


@dataclass
class _Impacts:
    """The impacts in one cycle of sides: -ln of their factor, and the units of the gap in which all
    factors are equal.
    """

    loss: np.ndarray  # (1, n), at least 0; NaN where nothing is known
    stretch: dict[int, np.ndarray]  # by side, (1, n)


class _Law:
    """The expressions of a system near its contact, and the bounds that follow from them for many
    parameter sets.
    """

    def __init__(self, traced: Trace) -> None:
        sides = (1, -1)[: traced.side_count]
        self.openings = {s: Opening(traced, s) for s in sides}
        pairs = {s: _factor(traced, s) for s in sides}
        self.cycles = _cycles({s: following for s, (following, _, _) in pairs.items()})
        self.factors = {s: [factor, at_rest] for s, (_, factor, at_rest) in pairs.items()}
        accelerations = [side.a for side in self.openings.values()]
        self.recorded = any(reads(a, "record") for a in accelerations)
        self.timed = any(reads(a, "time") for a in accelerations)
        self.by_speed = any(reads(f, "velocity") for f, _ in self.factors.values())
        self.frequency = next(
            (i for i, path in enumerate(traced.parameters) if path == "load.frequency"), None
        )

    def capture(self, leaves: Leaves, n: int) -> np.ndarray:
        """The speeds below which capture is proved, (n,)."""
        with np.errstate(all="ignore"):
            always = replace(leaves, time=self._time(leaves, 1))
            speed = self._proved(always, np.zeros((1, n)), np.full((1, n), CLIMB.widest))
            # the factors of the slowest impacts first, then of all below the speed so found
            if self.by_speed:
                speed = self._proved(always, speed, speed)
        return np.asarray(speed[0])

    def _time(self, leaves: Leaves, cells: int) -> Interval:
        """The forcing period in cells, (cells, n); all time if there is none."""
        if self.frequency is None:
            return Interval(-1e300, 1e300)
        edges = np.arange(cells + 1)[:, None] * (2 * np.pi / cells)
        return Interval(edges[:-1], edges[1:] * (1 + SLACK)) / leaves.parameters[self.frequency]

    def _proved(self, always: Leaves, reach: np.ndarray, limit: np.ndarray) -> np.ndarray:
        """The proved speeds, at most `limit`, with the factors of impacts up to the speed
        `reach`.
        """
        least = np.full_like(limit, np.inf)
        for cycle in self.cycles:
            impacts = self._impacts(cycle, always, reach)
            narrow, wide = (reduce(f, impacts.stretch.values()) for f in (np.minimum, np.maximum))
            speed, steady = self._energy(cycle, impacts, always, limit / wide)
            chosen = np.flatnonzero((~steady | ~(speed > 0)) & (impacts.loss >= 0))
            if not self.recorded and (self.frequency is not None or not self.timed):
                batch = max(1, CAPTURE.batch // CAPTURE.cells)
                for start in range(0, chosen.size, batch):
                    part = chosen[start : start + batch]
                    found = self._by_invariant(cycle, impacts, always, limit / wide, part)
                    speed[:, part] = np.fmax(speed[:, part], found)
            least = np.minimum(least, np.where(impacts.loss >= 0, speed * narrow, 0.0))
        return np.where(np.isfinite(least), least, 0.0)

    def _impacts(self, cycle: tuple[int, ...], always: Leaves, reach: np.ndarray) -> _Impacts:
        around = replace(always, speed=Interval(np.zeros_like(reach), reach))
        factors = []
        for side in cycle:
            factor, at_rest = enclose(self.factors[side], around)
            sound = (factor.lo >= 0) & (at_rest.lo == 0) & (at_rest.hi == 0)
            factors.append(np.where(sound, factor.hi, np.nan) + np.zeros_like(reach))
        first = factors[0]
        last = factors[-1]
        ratio = np.where((first > 0) & (last > 0), np.sqrt(first / last), 1.0)
        e = np.maximum(first / ratio, last * ratio)
        e = np.where(np.abs(e - 1) <= CAPTURE.one, 1.0, e)
        stretch = dict(zip(cycle, (np.ones_like(ratio), ratio), strict=False))
        return _Impacts(
            np.where(e <= 1, np.minimum(-np.log(e) * (1 - SLACK), 10.0), np.nan), stretch
        )

    def _energy(
        self, cycle: tuple[int, ...], impacts: _Impacts, always: Leaves, limit: Any
    ) -> tuple[Any, Any]:
        """The speed from the bounds of the energy, and whether the accelerations do not depend on
        the time; (1, n).
        """
        everywhere = replace(
            always, opening=Interval(0.0, CLIMB.widest), speed=Interval(-CLIMB.widest, CLIMB.widest)
        )
        steady = np.full(limit.shape, not self.recorded)
        alive = impacts.loss >= 0
        for side in cycle:
            here = replace(always, stretch=Interval(impacts.stretch[side]))
            change, pull = enclose(
                [self.openings[side].a_t, self.openings[side].jets[0][0]],
                replace(everywhere, stretch=here.stretch),
            )
            steady &= (change.lo == 0) & (change.hi == 0)
            alive &= pull.lo > 0
        speed = np.where(alive & (steady | (impacts.loss > 0)), limit, 0.0)
        chosen = np.flatnonzero(speed)
        for side in cycle if chosen.size else ():
            leaves = replace(always, stretch=Interval(impacts.stretch[side])).only(chosen)
            top = self._by_energy(
                side, leaves, impacts.loss[:, chosen], steady[:, chosen], limit[:, chosen]
            )
            speed[:, chosen] = np.minimum(speed[:, chosen], top)
        return speed * (1 - SLACK), steady

    def _by_energy(self, side: int, leaves: Leaves, loss: Any, steady: Any, limit: Any) -> Any:
        """The speed up to which flights on one side, with the impact after, lose energy."""
        a, a_w, a_u = (getattr(self.openings[side], name) for name in ("a", "a_w", "a_u"))
        allowed = np.where(steady, np.inf, np.exp(2 * loss) * (1 - SLACK))
        rise, bend = (enclosed_along(e, leaves, OPENING) for e in (a, a_w))
        turning, lo, hi = climb(lambda w: -rise(w), lambda w: -bend(w), allowed)
        top = np.sqrt(2 * hi)
        (growth,) = enclose(
            [a_u],
            replace(leaves, opening=Interval(0 * turning, turning), speed=Interval(-top, top)),
        )
        falls = (lo > 0) & ((growth.hi < 0) | ((growth.hi <= 0) & (loss > 0)))
        gain = np.where(steady, 1.0, np.sqrt(hi / lo))
        return np.where(falls, np.minimum(np.sqrt(2 * lo), limit / gain), 0.0)

    def _by_invariant(
        self, cycle: tuple[int, ...], impacts: _Impacts, always: Leaves, limit: Any, chosen: Any
    ) -> Any:
        """The speed from the corrected adiabatic invariant, for the chosen parameter sets, (1,
        chosen.size).
        """
        result = np.zeros((1, chosen.size))
        here = [replace(always, stretch=Interval(impacts.stretch[s])).only(chosen) for s in cycle]
        pulls = [
            enclose([self.openings[s].jets[0][0]], self._in_cells(x))[0]
            for s, x in zip(cycle, here, strict=True)
        ]
        alive = np.flatnonzero(reduce(np.minimum, [(p.lo + result).min(axis=0) for p in pulls]) > 0)
        # the load lifts the system off everywhere; bounds of no parameter sets take as long as
        # those of a few
        if not alive.size:
            return result
        here = [self._in_cells(x.only(alive)) for x in here]
        bounds = [self.openings[s].bounds(x) for s, x in zip(cycle, here, strict=True)]
        forms = [
            normal_form(side, None if len(cycle) == 1 else bounds[1 - i])
            for i, side in enumerate(bounds)
        ]
        loss = impacts.loss[:, chosen[alive]]
        period = np.atleast_1d(here[0].time.hi)[-1:]
        top = np.minimum(first_guess(forms, loss), limit[:, chosen[alive]])
        for v in (fraction * top for fraction in CAPTURE.boxes):
            boxes = [
                self.openings[s].boxed(x, f.pull, v)
                for s, x, f in zip(cycle, here, forms, strict=True)
            ]
            budgets = [budget(form, box, v) for form, box in zip(forms, boxes, strict=True)]
            found = largest_start(budgets, loss, period, v)
            result[:, alive] = np.where(result[:, alive] > 0, result[:, alive], found)
            if (result[:, alive] > 0).all():
                break
        return result

    def _in_cells(self, leaves: Leaves) -> Leaves:
        return replace(leaves, time=self._time(leaves, CAPTURE.cells if self.timed else 1))


def _factor(traced: Trace, side: int) -> tuple[int, Expr, Expr]:
    """The side after an impact on `side` (0 if it is not fixed), the derivative of the gap's speed
    after the impact to the speed before, as a function of the latter, and the velocity after an
    impact without speed.
    """
    leaf = {Expr("side"): float(side)}
    assert traced.gap_rate is not None
    assert traced.next_side is not None
    assert traced.velocity_after is not None
    following = substitute(traced.next_side, leaf)
    if following.op != "number" or following.value not in (1.0, -1.0)[: traced.side_count]:
        return 0, number(np.nan), number(np.nan)
    rate, next_rate = (
        substitute(traced.gap_rate, {Expr("side"): s}) for s in (float(side), following.value)
    )
    after = substitute(traced.velocity_after, leaf)
    change = substitute(differentiate(after, SPEED), {SPEED: -1.0 / rate * SPEED})
    return int(following.value), -1.0 * (next_rate / rate) * change, substitute(after, {SPEED: 0.0})


def _cycles(following: dict[int, int]) -> list[tuple[int, ...]]:
    """The sides of successive flights of a motion, for every side at which it may begin; none where
    that is not known.
    """
    if all(after == -side for side, after in following.items()):
        return [tuple(following)]
    return (
        [(side,) for side in following]
        if all(after == side for side, after in following.items())
        else []
    )
