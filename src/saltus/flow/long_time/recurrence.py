"""Recurrence: many motions are followed until each rests, repeats itself or the time is up.

Orbits, attractors, charts and diagrams all use this one engine to find where motions end. A motion
recurs with the period q if its stroboscopic states, those at phase 0 of the load, come back to
themselves after q forcing periods. The orbit that a motion approaches is extrapolated from them
(`approached`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.enumerations import NumberedSentence
from saltus.flow.lanes.ensemble import run_ensemble, simulate_many
from saltus.flow.lanes.ensemble_result import EnsembleResult
from saltus.flow.lanes.inputs import Inputs, read_inputs
from saltus.flow.lanes.options import EnsembleOptions, Sample, Until, read_threads
from saltus.flow.long_time.load_release import load_releases
from saltus.flow.motion.events import Stop
from saltus.flow.motion.motion import state_names
from saltus.flow.programs.compiled import limits_of
from saltus.progress import Progress, silent
from saltus.systems import System, units_with_sides

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class ApproachSettings:
    """When the states of a motion are taken to approach an orbit."""

    # The largest error with which the map may predict the last step between two states, relative to
    # that step. The extrapolated orbit has an error of about this share of the way to it; the next
    # extrapolation begins nearer, with the square of this.
    linear: float = 0.02
    # The largest multiplier of the map. It excludes extrapolation to orbits that are not stable:
    # with an error of 2 % the map cannot show 0.95 where a multiplier is 1, and no state is moved
    # along an unstable direction.
    multiplier: float = 0.95
    # The longest way to the orbit, as a share of the size of the states: a longer one may lead into
    # another basin.
    reach: float = 0.2
    # Steps below this share of the size of the states consist mostly of rounding and of the errors
    # of the motions.
    least: float = 1e-9
    # Two steps are parallel if the sine of the angle between them is smaller than this: they then
    # give one multiplier, not two.
    parallel: float = 1e-3


SETTINGS = ApproachSettings()


def approached(states: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """The states on the orbits that motions approach, and the periods of these orbits; 0 for a
    motion that approaches none.

    Let s_k be states q forcing periods apart, d_k = s_k - s_(k-1), and M the linear map that takes
    d_1 to d_2 and d_2 to d_3. If M also predicts the last step, d_4 = M d_3, and is a contraction,
    the orbit is at s_4 + M (1 - M)^-1 d_4. The shortest period q up to `longest` is taken for which
    this holds; it needs 4 q + 1 states.

    Parameters
    ----------
    states
        Coordinate and velocity at the ends of the last forcing periods, in the order of time, (n,
        kept, 2).
    longest
        The longest period that is looked for.

    Returns
    -------
    tuple[np.ndarray, np.ndarray]
        The states on the orbits, or the last states of motions that approach none, (n, 2); and the
        periods, (n,).
    """
    limit = states[:, -1].copy()
    period = np.zeros(len(states), dtype=int)
    size = np.nanmax(np.abs(states), axis=1, initial=0.0).max(axis=1)
    for q in range(1, min(longest, (states.shape[1] - 1) // 4) + 1):
        left = np.flatnonzero(period == 0)
        found, good = _limits(states[left, -1 - 4 * q :: q], size[left])
        limit[left[good]], period[left[good]] = found[good], q
    return limit, period


def _limits(states: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The states that sequences of five states, (n, 5, 2), approach, and whether they do approach
    them.
    """
    steps = np.diff(states, axis=1)
    length = np.linalg.norm(steps, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        m = _maps(steps, length)
        error = np.linalg.norm(np.einsum("nij,nj->ni", m, steps[:, 2]) - steps[:, 3], axis=1)
        inverse = np.eye(2) - m
        moved = np.einsum("nij,nj->ni", m, steps[:, 3])
        way = np.stack([_det(moved, inverse[:, :, 1]), _det(inverse[:, :, 0], moved)], axis=1)
        way /= _det(inverse[:, :, 0], inverse[:, :, 1])[:, None]
        good = (error <= SETTINGS.linear * length[:, 3]) & (_radius(m) <= SETTINGS.multiplier)
        good &= (np.linalg.norm(way, axis=1) <= SETTINGS.reach * size) & (
            length[:, 3] > SETTINGS.least * size
        )
    return states[:, -1] + way, good


def _maps(steps: np.ndarray, length: np.ndarray) -> np.ndarray:
    """The linear maps (n, 2, 2) that take the first of the steps (n, 4, 2) to the second, and the
    second to the third. If the first two are parallel, the map takes the second step to the third,
    and directions orthogonal to the second to 0."""
    one = steps[:, 0]
    two = steps[:, 1]
    three = steps[:, 2]
    area = _det(one, two)
    inverse = np.stack(
        [np.stack([two[:, 1], -two[:, 0]], axis=1), np.stack([-one[:, 1], one[:, 0]], axis=1)],
        axis=1,
    )
    both = np.einsum("nij,njk->nik", np.stack([two, three], axis=2), inverse) / area[:, None, None]
    single = np.einsum("ni,nj->nij", three, two) / (length[:, 1] ** 2)[:, None, None]
    parallel = np.abs(area) <= SETTINGS.parallel * length[:, 0] * length[:, 1]
    return np.asarray(np.where(parallel[:, None, None], single, both))


def _det(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The determinants of the matrices with these columns (n, 2)."""
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _radius(m: np.ndarray) -> np.ndarray:
    """The largest absolute values of the eigenvalues of matrices (n, 2, 2)."""
    half = 0.5 * (m[:, 0, 0] + m[:, 1, 1])
    det = _det(m[:, :, 0], m[:, :, 1])
    spread = half**2 - det
    return np.asarray(
        np.where(
            spread >= 0.0,
            np.abs(half) + np.sqrt(np.maximum(spread, 0.0)),
            np.sqrt(np.maximum(det, 0.0)),
        )
    )


@dataclass(frozen=True)
class RecurrenceSettings:
    """When a motion counts as periodic, in orbits, attractors, charts and diagrams."""

    # The compiled lanes look for periods up to this one (`LONGEST_RECURRENCE` in
    # flow/lane_steps/memory.py). A motion has settled with the period q if 2 q + 2 successive states
    # agree with those q forcing periods before to within `RECURRENT` (same file): 1e-10 of their
    # size, or of natural units where they are smaller.
    compiled_max_period: int = 16
    # Longer periods are looked for in the last states of a motion that was followed to the end: the
    # states of one period must agree with those of the period before to within this. It is larger
    # because only two periods are compared.
    long_agreement: float = 1e-9
    # A motion that was followed to the end counts as periodic if its last state is this near to the
    # one a period before: Newton's method then solves for the orbit, and fails if there is none.
    near_return: float = 1e-6
    # The error of one step, relative to the state: a tenth of the tolerance with which the compiled
    # lanes compare states.
    tol: float = 1e-11


RECURRENCE = RecurrenceSettings()


class Ending(NumberedSentence):
    """What a motion ends on, as far as it is known: the answer of simulations, verdicts, charts and
    diagrams alike.

    `str` gives the word, `sentence` the meaning.

    Examples
    --------
    >>> saltus.classify(system, theta=0.3).kind is saltus.Ending.PERIODIC
    True
    """

    UNDECIDED = 0, "it goes on moving without repeating itself, and no more is known"
    HELD = 1, "it is at rest at the contact, from where a later load may pull it"
    REST = 2, "it is at rest at the contact for all later loads"
    PERIODIC = 3, "it repeats itself"
    ENDED = 4, "it is ended by a margin of the model, or cannot go on"
    QUASI_PERIODIC = (
        5,
        "it is on a torus: it does not repeat itself, and motions beside it stay there",
    )
    CHAOTIC = 6, "motions beside it part from it for good, and none of them settles"
    TRANSIENT = 7, "it looks like chaos for a while, but motions beside it settle"

    def __str__(self) -> str:
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True, eq=False)
class Recurrence:
    """The outcomes of many motions, one row for each; a state has the coordinates, then their
    velocities, d numbers in all.
    """

    outcome: np.ndarray  # (n,): an `Ending` for each
    # (n,): forcing periods after which the motion repeats itself; 0 if it does not
    period: np.ndarray
    periods: np.ndarray  # (n,): forcing periods for which it was followed
    last: np.ndarray  # (n, d): the state at the end
    # (n, kept, d): the stroboscopic states, the last one last, nan where there were fewer
    states: np.ndarray
    # (n, kept, 2): largest and smallest of all coordinates in each of these periods; nan where they
    # were not recorded
    extrema: np.ndarray | None = None
    impact_counts: np.ndarray | None = None  # (n, kept): impacts in each of these periods
    # (n, kept): the least speed before an impact in each of these periods, inf without
    speeds: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.outcome)

    @property
    def rest(self) -> np.ndarray:
        """Whether each motion is at rest at the contact for good, (n,)."""
        return np.asarray(self.outcome == Ending.REST)

    @property
    def periodic(self) -> np.ndarray:
        """Whether each motion repeats itself, (n,)."""
        return np.asarray(self.outcome == Ending.PERIODIC)

    @property
    def ended(self) -> np.ndarray:
        """Whether each motion was ended by a margin of the model, or cannot go on, (n,)."""
        return np.asarray(self.outcome == Ending.ENDED)

    @property
    def unsettled(self) -> np.ndarray:
        """Whether each motion neither rests for good, nor repeats itself, nor has ended, (n,)."""
        return np.asarray(self.outcome <= Ending.HELD)

    @property
    def within_period(self) -> np.ndarray:
        """Whether each kept forcing period is one of the motion's last `period` ones, (n, kept);
        all are if it has no period.
        """
        kept = max(
            a.shape[1]
            for a in (self.states, self.extrema, self.impact_counts, self.speeds)
            if a is not None
        )
        length = np.where(self.period > 0, self.period, kept)
        return np.asarray(np.arange(kept)[::-1] < length[:, None])

    @property
    def highest(self) -> np.ndarray:
        """The largest of all coordinates over the motion's period, (n,); -inf where none was
        recorded.
        """
        assert self.extrema is not None
        return np.asarray(
            np.nanmax(
                np.where(self.within_period, self.extrema[:, :, 0], np.nan), axis=1, initial=-np.inf
            )
        )

    @property
    def lowest(self) -> np.ndarray:
        """The smallest of all coordinates over the motion's period, (n,); inf where none was
        recorded.
        """
        assert self.extrema is not None
        return np.asarray(
            np.nanmin(
                np.where(self.within_period, self.extrema[:, :, 1], np.nan), axis=1, initial=np.inf
            )
        )

    @property
    def impact_count(self) -> np.ndarray:
        """The impacts over the motion's period, (n,)."""
        assert self.impact_counts is not None
        return np.asarray(
            np.nansum(np.where(self.within_period, self.impact_counts, 0.0), axis=1).astype(int)
        )

    @property
    def slowest(self) -> np.ndarray:
        """The least speed before an impact over the motion's period, (n,); 0 without impacts, and
        where it was not sampled.
        """
        if self.speeds is None:
            return np.zeros(len(self))
        least = np.nanmin(np.where(self.within_period, self.speeds, np.nan), axis=1, initial=np.inf)
        return np.asarray(np.where(np.isfinite(least), least, 0.0))

    def only(self, rows: Any) -> Recurrence:
        """The results of some of the motions."""
        columns = {part.name: getattr(self, part.name) for part in fields(self)}
        return replace(
            self, **{name: values[rows] for name, values in columns.items() if values is not None}
        )

    def after(self, periods: int, states: np.ndarray) -> Recurrence:
        """These results as those of longer motions, which were followed for `periods` before and
        then had these states.
        """
        return replace(
            self,
            periods=self.periods + periods,
            states=np.concatenate([states, self.states], axis=1),
        )


def find_recurrence(
    system: System,
    states: np.ndarray,
    periods: int,
    *,
    parameters: Mapping[str, np.ndarray] | None = None,
    captured: np.ndarray | None = None,
    max_period: int = RECURRENCE.compiled_max_period,
    kept: int | None = None,
    extrema: bool = False,
    impact_count: bool = False,
    speed: bool = False,
    from_start: bool = False,
    stop_early: bool = True,
    tol: float = RECURRENCE.tol,
    threads: int | None = None,
    progress: Progress = silent,
    settings: RecurrenceSettings = RECURRENCE,
) -> Recurrence:
    """Follow motions from states at phase 0 until they rest for good, repeat themselves or the time
    is up.

    A motion at the contact is at rest for good if it is proved to be captured, or if the load never
    pulls there. If motions have parameters of their own, only the proof counts.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    states
        The states at the start, (n, d): coordinates, then velocities, then the sides of relays;
        states of the result are such too.
    periods
        The largest number of forcing periods for which a motion is followed.
    parameters
        Numbers by dotted path, (n,) each, in place of the system's.
    captured
        The speeds below which the motions are proved to be captured, (n,), if they are known
        (`captured_between`); else nan.
    max_period
        The longest period that is looked for. Periods above 16 are found only if `kept` is more
        than twice as large.
    kept
        How many of the last stroboscopic states are kept, by default all; 0 for none.
    extrema, impact_count, speed
        Whether these are recorded, over max(kept, max_period) of the last forcing periods.
    from_start
        Whether extrema are recorded from the start; they always are if a limit of the model may end
        a motion. Otherwise recording begins when a motion begins to repeat itself or its time is
        nearly up. Extrema are nan for motions that come to rest for good or cannot go on.
    stop_early
        With False every motion is followed for all periods, and its period is read from the last
        states (`near_return`).
    tol
        The error that one step may make.
    threads
        How many cores to use; by default all.
    progress
        Called with the fraction done.
    """
    limits = limits_of(system, ())
    beside = extrema and system.in_gap_coordinates is not system
    sampled = {
        Sample.STATE: kept != 0,
        Sample.EXTREMA: extrema and not beside,
        Sample.IMPACT_COUNT: impact_count,
    }
    sampled[Sample.SPEED] = speed and system.model.names_its_contacts
    size = periods if kept is None else kept
    options = EnsembleOptions(
        tol=tol,
        periods=periods,
        limits=limits,
        sample=tuple(name for name, chosen in sampled.items() if chosen),
        until=(Until.REST, Until.SETTLED) if stop_early else (),
        from_start=from_start or bool(limits),
    )
    last = max(1, min(max(size, max_period if extrema or impact_count or speed else 1), periods))
    inputs = _inputs(system, states, parameters)
    result = run_ensemble(
        system, inputs, options, read_threads(threads), progress, last=last, captured=captured
    )
    found = replace(_read(result), outcome=_outcome(result, parameters is not None))
    if found.extrema is not None and not options.from_start:
        found.extrema[~result.stopped(Stop.HORIZON, Stop.REST, Stop.SETTLED)] = np.nan
    units = units_with_sides(system)
    found = _with_periods(
        found, result.recurrence_period if stop_early else None, max_period, settings, units
    )
    if not beside:
        return found
    gone = found.ended if options.from_start else found.ended | found.rest
    return replace(
        found,
        extrema=result.extrema_later(
            np.where(gone, 0, np.where(found.period, found.period, last)), last
        ),
    )


def motions_from(system: System, states: np.ndarray, **options: Any) -> xarray.Dataset:
    """`simulate_many` from states (n, d) at phase 0; `ensemble_from` is faster."""
    coordinates, velocity, relays = _as_arguments(system, states)
    return simulate_many(system, **coordinates, velocity=velocity, relays=relays, **options)


def ensemble_from(
    system: System,
    states: np.ndarray,
    periods: int,
    *,
    parameters: Mapping[str, np.ndarray],
    tol: float,
    until: tuple[str, ...] = (),
    derivatives: bool = False,
) -> EnsembleResult:
    """The ends of motions from states (n, d) at phase 0 as arrays: making a dataset takes longer
    than following a few motions.

    With `derivatives` those to the initial states are computed, too.
    """
    paths = () if derivatives else None
    options = EnsembleOptions(
        tol=tol, periods=periods, limits=limits_of(system, ()), until=until, paths=paths
    )
    inputs = _inputs(system, states, parameters)
    return run_ensemble(system, inputs, options, read_threads(None), silent)


def _inputs(
    system: System, states: np.ndarray, parameters: Mapping[str, np.ndarray] | None
) -> Inputs:
    """Motions from states (n, d) at phase 0, with parameters of their own."""
    coordinates, velocity, relays = _as_arguments(system, states)
    return read_inputs(system, velocity, 0.0, parameters, coordinates, relays)


def _as_arguments(system: System, states: np.ndarray) -> tuple[dict[str, Any], Any, Any]:
    """States (n, d) as `simulate_many` takes them: coordinates by name, the velocity, and the sides
    of relays if they are behind them.
    """
    names = system.model.coordinates
    moving = system.model.moving
    velocities = tuple(states[:, len(names) + i] for i in range(len(moving)))
    coordinates = {name: states[:, i] for i, name in enumerate(names)}
    relays = None
    if states.shape[1] > 2 * len(names):
        sides = states[:, 2 * len(names) :].T
        relays = {each.name: s for each, s in zip(system.model.relays, sides, strict=True)}
    return coordinates, velocities[0] if len(moving) == 1 else velocities, relays


def last_states(system: System, result: xarray.Dataset) -> np.ndarray:
    """The states at the end of an ensemble's motions, (..., d)."""
    return np.stack(
        [result[name].values for name in state_names(system.model.coordinates)], axis=-1
    )


def return_distances(states: np.ndarray, max_period: int, units: Any = 1.0) -> np.ndarray:
    """The distance of the last of the states (..., kept, d) from those q = 1, 2, ... periods
    before, in units of the state variables (d,), (..., max_period or fewer)."""
    count = min(max_period, states.shape[-2] - 1)
    apart = states[..., -1:, :] - states[..., -1 - count : -1, :]
    apart = np.abs(apart / units).max(axis=-1)
    return np.asarray(apart[..., ::-1])


def return_period(
    states: np.ndarray,
    max_period: int,
    within: Any = RECURRENCE.near_return,
    units: Any = 1.0,
) -> np.ndarray:
    """The shortest period after which the last of the states (..., kept, d) has come back to within
    a distance, in units of the state variables (d,); 0 if none has.
    """
    near = return_distances(states, max_period, units) < within
    if not near.shape[-1]:  # one state alone
        return np.zeros(near.shape[:-1], dtype=int)
    return np.where(near.any(axis=-1), 1 + np.argmax(near, axis=-1), 0)


def nearest_return(states: np.ndarray, max_period: int, units: Any = 1.0) -> int:
    """The period after which the last of the states (kept, d) is nearest to an earlier one, in
    units of the state variables (d,)."""
    return 1 + int(np.argmin(return_distances(states, max_period, units)))


def _read(result: EnsembleResult) -> Recurrence:
    """The records of the motions; their outcomes are filled in later."""
    last = result.last
    samples = result.samples
    assert result.periods is not None
    columns = {
        kind: samples[kind][:, :, 0] if kind in samples else None
        for kind in (Sample.IMPACT_COUNT, Sample.SPEED)
    }
    return Recurrence(
        outcome=np.full(len(last), Ending.UNDECIDED, dtype=np.int8),
        period=np.zeros(len(last), dtype=int),
        periods=result.periods,
        last=last,
        states=samples.get(Sample.STATE, np.empty((len(last), 0, last.shape[1]))),
        extrema=samples.get(Sample.EXTREMA),
        impact_counts=columns[Sample.IMPACT_COUNT],
        speeds=columns[Sample.SPEED],
    )


def _outcome(result: EnsembleResult, varied: bool) -> np.ndarray:
    """The outcomes that do not follow from a period."""
    outcome = np.full(len(result.stops), Ending.UNDECIDED, dtype=np.int8)
    held = result.held & result.stopped(Stop.HORIZON, Stop.REST)
    if held.any():
        outcome[held] = Ending.HELD if varied or not _rest_lasts(result.system) else Ending.REST
    outcome[result.stopped(Stop.CAPTURED)] = Ending.REST
    outcome[~result.stopped(Stop.HORIZON, Stop.REST, Stop.SETTLED, Stop.CAPTURED)] = Ending.ENDED
    return outcome


def _rest_lasts(system: System) -> bool:
    """Whether it is known that the load never pulls a system off its rest; with several contacts,
    each must hold one coordinate."""
    system = system.in_gap_coordinates
    contacts = system.model.contacts
    names = system.model.coordinates
    known = not contacts or sorted(contact.coordinate for contact in contacts) == sorted(names)
    known &= not (system.model.frictions or system.model.surfaces or system.dependent)
    known &= not system.model.has_switches
    return known and not load_releases(system)


def _with_periods(
    found: Recurrence,
    compiled: Any,
    max_period: int,
    settings: RecurrenceSettings,
    units: np.ndarray,
) -> Recurrence:
    """The results with the periods that the compiled lanes have found, or that the kept states
    show.
    """
    outcome = found.outcome.copy()
    period = found.period.copy()
    if compiled is None:
        period[:] = return_period(found.states, max_period, settings.near_return, units)
    else:
        period[:] = np.where(compiled <= max_period, compiled, 0)
        longer = found.unsettled & (period == 0) & (max_period > settings.compiled_max_period)
        for row in np.flatnonzero(longer):
            period[row] = _long_period(found.states[row] / units, max_period, settings)
    period[~found.unsettled] = 0
    outcome[period > 0] = Ending.PERIODIC
    return replace(found, outcome=outcome, period=period)


def _long_period(states: np.ndarray, max_period: int, settings: RecurrenceSettings) -> int:
    """The period, longer than those that compiled lanes look for, with which the last states (kept,
    d) repeat; 0 without one.
    """
    for q in range(settings.compiled_max_period + 1, min(max_period, len(states) // 2 - 1) + 1):
        if np.abs(states[-q:] - states[-2 * q : -q]).max() < settings.long_agreement:
            return q
    return 0
