"""Sensitivities: the derivatives of a motion to the state that it starts from and to parameters,
impacts included.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.checks import Numbers, Speeds, check_names, instants
from saltus.errors import MotionError
from saltus.flow.kernel.contact_layout import ImpactDetail
from saltus.flow.kernel.layout import EventCode, GrazingDetail, RestDetail
from saltus.flow.motion.events import EventKind, Stop
from saltus.flow.motion.motion import Motion, in_own_coordinates, state_names
from saltus.flow.motion.simulate import MotionRequest, follow
from saltus.flow.motion.validity import DenseOutput
from saltus.flow.programs.compiled import Program
from saltus.progress import Progress, silent
from saltus.result import Result, result_dataset
from saltus.systems import System, check_system, natural_units, solved_motion, substitute
from saltus.taylor import FREQUENCY

if TYPE_CHECKING:
    import xarray

IRREGULAR = {
    ImpactDetail.NO_SPEED: (
        "at time {time:.9g} a contact is reached without speed, where the motion has no derivative"
    ),
    ImpactDetail.APART: (
        "at time {time:.9g} contacts close together, which motions beside this one close one after"
        " the other, so that the motion is not continuous in what moves them apart"
    ),
    ImpactDetail.ORDERED: (
        "at time {time:.9g} contacts close together that do not act on one another, but what the"
        " motion does between two of them depends on which comes first, so that there are only"
        " one-sided derivatives"
    ),
}


IN_ORDER = (
    "at time {time:.9g} {names} change at one instant, and what the motion does depends on which"
    " comes first, so that there are only one-sided derivatives"
)
RUBBING = (EventCode.STICK, EventCode.SLIP, EventCode.REVERSAL)
ONE_INSTANT = 1e-11  # events of frictions nearer than this are at one instant, in natural times
MOVED = 4096.0  # units in the last place by which events are moved: more than rounding moves them
# Derivatives in two orders are the same if their columns differ by no more than this share.
SAME_ORDER = 1e-6
VANISHED = 1e-6  # a column of a state, in natural units: times SAME_ORDER it is rounding


@dataclass(frozen=True, eq=False)
class Sensitivities(Result):
    """The derivatives of a motion of n degrees of freedom; a state is (coordinates, velocities), 2
    n numbers.

    They hold for the motion that `simulate` returns for the same arguments. Its start is at a fixed
    `time`. Its end is at a fixed time if a `duration` was asked for; after a number of `periods` it
    moves with the load's frequency, and at a margin with the margin. A derivative is one-sided if
    the motion starts at a contact, is released by a jump of the load, ends on an event, or grazes
    the contact (see `grazings`).

    `event_times` has a row for each of `motion.events` and a column for each initial coordinate,
    initial velocity and parameter: the derivatives of the event's time. They are nan after the
    motion has lost its derivative, and if the event has none. Such are a grazing, the beginning of
    chatter, and impacts or releases of several contacts that are not simultaneous in neighbouring
    motions.

    Attributes
    ----------
    motion
        The motion.
    state
        The derivatives of the state at the end to the one at the start, (2 n, 2 n).
    parameters
        The derivatives of the state at the end to each parameter, (2 n, parameters).
    parameter_paths
        The dotted paths of the parameters.
    event_times
        The derivatives of the events' times, as above, (events, 2 n + parameters).
    grazings
        The times at which the motion touches the contact; motions that pass on the other side have
        other derivatives.
    undefined
        Why some or all derivatives at the end do not exist; these are nan.
    tangent
        The Taylor series of the derivatives along the motion, from which `at` evaluates them; None
        where they were not kept.
    at_end
        The derivatives at the end at a fixed time, (2 n, 2 n + parameters).

    Examples
    --------
    >>> result = saltus.sensitivities(system, theta=0.3, periods=2)
    >>> float(result.determinant / np.exp(-0.1 * result.motion.time))  # with e = 1 areas shrink by the damping alone
    1.0000000000001628
    """

    motion: Motion
    state: np.ndarray
    parameters: np.ndarray
    parameter_paths: tuple[str, ...]
    event_times: np.ndarray
    grazings: np.ndarray
    undefined: str | None
    tangent: DenseOutput | None
    at_end: np.ndarray

    def at(self, times: Numbers) -> np.ndarray:
        """The derivatives of the state at any times of the motion, at fixed times and to its
        accuracy; at an impact, those just after it.

        They jump at impacts with the state. Just before one they are those of the last number below
        its time, `np.nextafter(time, -np.inf)`. The end of a motion may move with the forcing
        period or with a margin. Then `state` and `parameters` have the derivatives of the moving
        end, and this has those at the fixed time.

        Parameters
        ----------
        times
            A number or an array (m,) of dimensionless times.

        Returns
        -------
        np.ndarray
            (2 n, 2 n + parameters) for one time, (m, 2 n, 2 n + parameters) for m: rows as in
            `state`, and the columns of `event_times`. They are nan from where the motion has lost
            its derivative.

        Raises
        ------
        ParameterError
            A time lies outside the motion, or the motion was computed with dense=False.

        Examples
        --------
        >>> result = saltus.sensitivities(system, theta=0.3, periods=2, parameters=["model.damping"])
        >>> result.at([0.0, 1.0]).shape
        (2, 2, 3)
        """
        wanted = instants(times)
        motion = self.motion
        motion._check_times(wanted)
        found = np.broadcast_to(self.at_end, (wanted.size, *self.at_end.shape)).copy()
        inner = wanted < motion.time
        if inner.any():
            assert self.tangent is not None
            rates = self.tangent.states(wanted[inner])[:2]
            own = len(motion.system.in_gap_coordinates.model.coordinates)
            columns = np.concatenate(
                [x.reshape(-1, own, x.shape[1]) for x in rates], axis=1
            ).transpose(2, 1, 0)
            start = motion._states(np.array([motion.start]))[:2]
            found[inner] = OwnColumns(
                motion.system, self.parameter_paths, motion.start, start
            ).later(wanted[inner], motion, columns)
        return found[0] if np.ndim(times) == 0 else found

    @property
    def determinant(self) -> float:
        """The determinant of `state`, by which the flow has scaled volumes of states; 0 after rest,
        nan where `state` is nan.
        """
        return float(np.linalg.det(self.state)) if np.isfinite(self.state).all() else math.nan

    def to_xarray(self) -> xarray.Dataset:
        """`derivative` (state, to) of the state at the end, and `event_time_derivative` (event, to)
        of the events' times.
        """
        system = self.motion.system
        names = state_names(system.model.coordinates)
        to = [*(f"start_{name}" for name in names), *self.parameter_paths]
        columns: dict[str, tuple[Any, ...]] = {
            "derivative": (
                ("state", "to"),
                np.hstack([self.state, self.parameters]),
                "1",
                "of the state at the end",
            ),
            "event_time": (
                "event",
                [event.time for event in self.motion.events],
                "1",
                "times of the motion's events",
            ),
            "event_kind": (
                "event",
                [event.kind.value for event in self.motion.events],
                "1",
                "what they are",
            ),
            "event_time_derivative": (
                ("event", "to"),
                self.event_times,
                "1",
                "of the events' times",
            ),
            "grazing_time": (
                "grazing",
                self.grazings,
                "1",
                "times at which the motion touches the contact",
            ),
        }
        facts = {"end_time": self.motion.time, "undefined": self.undefined or ""}
        return result_dataset(
            "sensitivities",
            columns,
            {"state": list(names), "to": to},
            system,
            tol=self.motion.tol,
            **facts,
        )

    def __repr__(self) -> str:
        to = ", ".join(("state", *self.parameter_paths))
        rest = (
            f", undefined: {self.undefined}"
            if self.undefined
            else f", determinant={self.determinant:.6g}"
        )
        return f"Sensitivities(of {self.motion!r} to {to}{rest})"


def sensitivities(
    system: System,
    *,
    parameters: Iterable[str] = (),
    velocity: Speeds = 0.0,
    periods: float | None = None,
    duration: float | None = None,
    tol: float = 1e-12,
    time: float = 0.0,
    side: int | None = None,
    relays: Mapping[str, bool] | None = None,
    stop_at: Iterable[str] = (),
    dense: bool = True,
    progress: Progress = silent,
    **coordinates: float,
) -> Sensitivities:
    """The derivatives of an exact motion to its initial state and to parameters, with the saltation
    of every event.

    Along an arc u = dq/dc obeys u'' = a_q u + a_v u' + a_c, which is expanded together with the
    motion, in the same steps. At an impact v+ = R(v-, t, c) at the contact x(c), whose time has the
    derivative dt = (x_c - u-) / v-,

        u+ = x_c - v+ dt,     u'+ = R_v (u'- + a_old dt) + R_t dt + R_c - a_new dt.

    The determinant of this map is R_v v+ / v-. A release moves with the root of the contact
    acceleration; at rest the derivatives are those of the contact's position. With several contacts
    the law of the acting contacts is differentiated (see `contacts/tangent.py`).

    Parameters
    ----------
    system
        What moves.
    parameters
        Dotted paths of the numbers to differentiate to, such as "load.frequency", "impact.e".
    velocity, periods, duration, tol, time, side, relays, stop_at, dense, progress, coordinates
        As for `simulate`.

    Raises
    ------
    ParameterError
        A path leads to no number (the message has similar paths), or another argument has no
        meaning.
    MotionError
        As for `simulate`.

    Examples
    --------
    >>> ball = saltus.System(model=saltus.WallOscillator(stiffness=0.0, wall=0.0), load=saltus.Load(force=1.0))
    >>> result = saltus.sensitivities(ball, x=-2.0, duration=3.0)
    >>> float(result.event_times[0, 0])  # a fall from x = -h takes sqrt(2 h), with the derivative -1 / sqrt(2 h)
    -0.5
    """
    paths = _paths(system, parameters)
    request = MotionRequest(
        system=system,
        coordinates=coordinates,
        velocity=velocity,
        periods=periods,
        duration=duration,
        tol=tol,
        time=time,
        side=side,
        relays=relays,
        stop_at=stop_at,
        dense=dense or system.model.has_multipliers,  # whose accelerations are those of steps
        sensitivities=paths,
    )
    return derivatives_of(request, None, progress)


def in_any_order(
    request: MotionRequest, run: Program | None, found: Sensitivities
) -> Sensitivities:
    """Derivatives that do not depend on the order of events of several frictions at one instant:
    where they do, the columns are nan.

    Neighbouring motions have such events one after the other, in either order. The kernel takes one
    order; the others are those in which the events of a friction happen later or earlier by some
    rounding. Where all give one derivative it is the derivative.
    """
    ties = _ties(found.motion)
    if not ties:
        return found
    system = found.motion.system
    units = natural_units(system).state
    columns = np.hstack([found.state, found.parameters])
    # perturbations of a state in its units, of parameters as they are
    given = np.append(units, np.ones(found.parameters.shape[1]))
    scaled = columns * given / units[:, None]
    size = np.abs(scaled).max(axis=0)
    # A state's column begins with 1: what sticking leaves of one that vanishes is rounding.
    size[: len(units)] = np.maximum(size[: len(units)], VANISHED)
    differs = np.zeros(columns.shape[1], dtype=bool)
    first: tuple[float, str] | None = None
    count = len(system.contact_model.contacts)
    for time, rows, names in ties:
        here = np.zeros_like(differs)
        for row in rows[:-1]:
            for units_moved in (MOVED, -MOVED):
                # one event later is the other one earlier
                moves = ((row, units_moved), (rows[-1], -units_moved))
                other = _moved(request, run, [(count + k, by) for k, by in moves])
                if other is None:
                    here[:] = True
                    continue
                beside = np.hstack([other.state, other.parameters]) * given / units[:, None]
                here |= ~(np.abs(beside - scaled).max(axis=0) <= SAME_ORDER * size)
        if here.any() and first is None:
            first = time, names
        differs |= here
    if first is None:
        return found
    columns[:, differs] = math.nan
    own = found.state.shape[1]
    at_end = found.at_end.copy()
    at_end[:, differs] = math.nan
    return replace(
        found,
        state=columns[:, :own],
        parameters=columns[:, own:],
        at_end=at_end,
        undefined=found.undefined or IN_ORDER.format(time=first[0], names=first[1]),
    )


def _moved(
    request: MotionRequest, run: Program | None, moves: list[tuple[int, float]]
) -> Sensitivities | None:
    """The derivatives with events moved by the first of the moves with which the motion can be
    followed; None if it cannot with any."""
    for row, units_moved in moves:
        try:
            return _in_own_order(request.moved_events(row, units_moved), run)
        except MotionError:
            continue
    return None


def _ties(motion: Motion) -> list[tuple[float, list[int], str]]:
    """The instants at which several frictions begin to slide, stick or turn, each with the numbers
    of these frictions and their names; of one set of frictions the first alone.
    """
    if not motion.system.model.holds_coordinates or len(motion.system.contact_model.frictions) < 2:
        return []
    frictions = motion.system.contact_model.frictions
    count = len(motion.system.contact_model.contacts)
    codes = motion.events.codes
    times = motion.events.times
    together = ONE_INSTANT * natural_units(motion.system).time
    found: dict[tuple[int, ...], float] = {}
    begin = 0
    for end in range(1, len(times) + 1):
        if end < len(times) and times[end] - times[begin] <= together + 1e-14 * abs(times[end]):
            continue
        rubs = [bits for kind, bits in codes[begin:end].tolist() if kind in RUBBING]
        rows = tuple(k for k in range(len(frictions)) if any(b >> count + k & 1 for b in rubs))
        if len(rows) > 1:
            found.setdefault(rows, float(times[begin]))
        begin = end
    return [
        (time, list(rows), " and ".join(frictions[k].name for k in rows))
        for rows, time in found.items()
    ]


def derivatives_of(
    request: MotionRequest, run: Program | None, progress: Progress = silent
) -> Sensitivities:
    """`sensitivities` of a request, with its program if that is known.

    All derivatives of single motions are these, so that one rule says where they are undefined.
    """
    return in_any_order(request, run, _in_own_order(request, run, progress))


def _in_own_order(
    request: MotionRequest, run: Program | None, progress: Progress = silent
) -> Sensitivities:
    """The derivatives with events at one instant in the order in which the kernel takes them."""
    followed = follow(request, progress, run)
    paths = request.sensitivities or ()
    motion = followed.motion
    n = len(request.given.model.coordinates)
    rates = state_rates(motion)
    at_end = followed.columns
    seen = in_own_coordinates(request.given, motion)
    event_times = followed.shifts
    if seen is not motion:
        start = request.given.from_gaps(request.time, *np.split(request.start, 2))
        own = OwnColumns(request.given, paths, request.time, [x[:, None] for x in start])
        at_end, event_times = (
            own.later(np.array([motion.time]), seen, at_end[None])[0],
            own.of_start(event_times),
        )
        rates = own.rates(motion.time, motion.position, rates)
    shift = _end_shift(motion, event_times, paths, request.periods)
    columns = at_end + np.outer(rates, shift) if shift.any() else at_end
    return Sensitivities(
        motion=seen,
        state=columns[:, : 2 * n],
        parameters=columns[:, 2 * n :],
        parameter_paths=paths,
        event_times=event_times,
        grazings=np.array([event.time for event in motion.events.of(EventKind.GRAZING)]),
        undefined=_undefined(motion, columns),
        tangent=followed.tangent,
        at_end=at_end,
    )


@dataclass(frozen=True, eq=False)
class OwnColumns:
    """Derivatives in a system's own coordinates, from those of `system.in_gap_coordinates`; the
    same where that is itself.

    With the states x of the system and y of the other one, y_0 = in(x_0, c) at the start and x =
    out(y, c) at a time,

        dx/dx_0 = out_y (dy/dy_0) in_x,    dx/dc = out_y (dy/dc + (dy/dy_0) in_c) + out_c.
    """

    system: System
    paths: tuple[str, ...]
    time: float  # of the start
    start: Any  # the own coordinates and velocities there, (n, 1) each

    def of_start(self, columns: np.ndarray) -> np.ndarray:
        """Columns (..., 2 n + parameters) along the own state at the start and along parameters at
        this fixed state.
        """
        model = self._model
        load = self.system.load
        n = len(self._model.coordinates)
        into = state_slopes(model.gap_values, self.time, self.start, load)[0]
        first = columns[..., : 2 * n]
        moved = first @ self._by_numbers("gap_values", self.time, *self.start)[0]
        return np.concatenate([first @ into, columns[..., 2 * n :] + moved], axis=-1)

    def later(self, times: np.ndarray, motion: Motion, columns: np.ndarray) -> np.ndarray:
        """Columns (m, 2 n, 2 n + parameters) at times (m,) of a motion of the system."""
        if self._model is self.system.model:
            return columns
        position, velocity, _ = motion._states(times) if motion.dense else (*_end_of(motion), None)
        inner = self.system.to_gaps(times, position, velocity)
        out = state_slopes(self._model.own_values, times, inner, self.system.load)
        found = out @ self.of_start(columns)
        found[..., out.shape[-2] :] += self._by_numbers("own_values", times, *inner)
        return np.asarray(found)

    def rates(self, time: float, position: Any, rates: np.ndarray) -> np.ndarray:
        """The velocity and acceleration of the own coordinates at a time, (2 n,)."""
        v, a = ([*x] if len(x) > 1 else x[0] for x in np.split(rates, 2))
        return np.concatenate(
            [
                np.atleast_1d(x)
                for x in self._model.own_values(time, self.system.load, position, v, a)[1:]
            ]
        )

    @property
    def _model(self) -> Any:
        return self.system.in_gap_coordinates.model

    def _by_numbers(
        self, method: str, times: Any, position: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """The derivatives of `own_values` or `gap_values` to the parameters, (m, 2 n, parameters),
        at complex numbers.
        """
        size = len((self.system.model if method == "own_values" else self._model).coordinates)
        step = 1e-100
        found = np.zeros((position.shape[1], 2 * size, len(self.paths)))
        for j, path in enumerate(self.paths):
            chosen = {path: 1j * step}
            twin = substitute(
                self.system.in_gap_coordinates,
                lambda at, x, by=chosen: x + by[at] if at in by else x,  # type: ignore[misc]
            )
            given = ([*values] if len(values) > 1 else values[0] for values in (position, velocity))
            changed = getattr(twin.model, method)(times, twin.load, *given)
            each = [x for part in changed for x in (part if isinstance(part, tuple) else (part,))]
            for i, value in enumerate(each):
                found[:, i, j] = np.imag(value) / step
        return found


def state_slopes(lead: Any, times: Any, states: Sequence[Any], load: Any) -> np.ndarray:
    """The derivatives, at complex numbers, of the states that `lead` makes, `own_values` or
    `gap_values`, to the states that it is given: coordinates and velocities of m motions, (n, m)
    each; (m, 2 c, 2 n) for c coordinates that `lead` returns."""
    state = np.array([*states[0], *states[1]], dtype=complex)
    step = 1e-100
    n = len(states[0])
    found = []
    for j in range(2 * n):
        beside = state.copy()
        beside[j] += 1j * step
        changed = lead(
            times, load, *(tuple(half) if n > 1 else half[0] for half in np.split(beside, 2))
        )
        values = [x for part in changed for x in (part if isinstance(part, tuple) else (part,))]
        found.append(
            np.stack([np.imag(x) / step * np.ones(state.shape[1]) for x in values], axis=1)
        )
    return np.stack(found, axis=-1)


def _end_of(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """The coordinates and velocities at the end, (n, 1) each."""
    return np.atleast_1d(motion.position)[:, None], np.atleast_1d(motion.velocity)[:, None]


def _paths(system: System, parameters: Iterable[str]) -> tuple[str, ...]:
    """The checked paths of the parameters to differentiate to."""
    check_system(
        system,
        "sensitivities",
        several_contacts=True,
        multipliers=True,
        switches=True,
        jumps=True,
        resets=True,
        relays=True,
    )
    return check_names("parameters", parameters, "parameters, such as ['load.frequency']")


def _end_shift(
    motion: Motion, event_times: np.ndarray, paths: tuple[str, ...], periods: float | None
) -> np.ndarray:
    """The shift of the time at the end along each column: with the margin that ends the motion, or
    with the forcing period.
    """
    shift = np.zeros(event_times.shape[1])
    if motion.stop is Stop.LIMIT:
        return np.asarray(event_times[-1])
    if periods is not None and FREQUENCY in paths:
        frequency = motion.system.load.frequency
        assert frequency is not None
        shift[shift.size - len(paths) + paths.index(FREQUENCY)] = (
            -2.0 * math.pi * periods / frequency**2
        )
    return shift


# A motion that ends at a corner of its load, up to this share of the forcing period, ends before it:
# the rates there are extrapolated from two instants so far before.
AT_CORNER = 1e-10
BEFORE_CORNER = 1e-7


def state_rates(motion: Motion) -> np.ndarray:
    """The time derivative of the state at the end of a motion, (2 degrees of freedom,)."""
    load = motion.system.load
    if load.period is not None and load.corners.size:
        share = motion.time / load.period
        if (np.abs((share - load.corners + 0.5) % 1.0 - 0.5) < AT_CORNER).any():
            step = BEFORE_CORNER * load.period
            near, far = (_rates_at(motion, motion.time - k * step) for k in (1, 2))
            return np.asarray(2.0 * near - far)
    return _rates_at(motion, motion.time)


def _rates_at(motion: Motion, time: float) -> np.ndarray:
    """The same with the load of a time."""
    system = motion.system
    side = motion.side
    velocity = np.atleast_1d(motion.velocity)
    if side == 0:
        return np.zeros(2 * velocity.size)
    acceleration: Any
    along = bool(system.model.surfaces) and 0 in motion.sides.values()
    by_series = along or system.model.has_switches
    if system.model.has_multipliers or (by_series and motion.dense is not None):
        return _rates_of_series(motion, time)
    if system.model.holds_coordinates:
        held = {
            contact.coordinate for contact in system.model.contacts if contact.name in motion.closed
        }
        above = [
            each.sign * s
            for each, s in zip(system.model.surfaces, motion.sides.values(), strict=True)
        ]
        slides = [*motion.sliding.values(), *above]
        held |= {
            friction.coordinate
            for friction, s in zip(system.model.frictions, slides, strict=False)
            if s == 0
        }
        free = [float(name not in held) for name in system.model.coordinates]
        q = motion.position
        acceleration = solved_motion(
            system.model, time, q, motion.velocity, system.load, free, slides
        ).acceleration
    else:
        acceleration = system.model.acceleration(
            time, motion.position, motion.velocity, float(side), system.load
        )
    return np.concatenate([velocity, np.atleast_1d(np.asarray(acceleration, dtype=float))])


def _rates_of_series(motion: Motion, time: float) -> np.ndarray:
    """The same of a motion whose contacts are held by multipliers, from the series of its last
    step."""
    dense = motion.dense
    assert dense is not None
    if not dense.start.size:
        return np.full(2 * np.size(motion.velocity), math.nan)
    series = dense.series[-1]
    orders = np.arange(series.shape[1])
    tau = time - dense.start[-1]
    powers = tau ** np.maximum(orders - 2, 0)
    acceleration = series[:, 2:] @ (orders * (orders - 1) * powers)[2:]
    return np.concatenate([np.atleast_1d(motion.velocity), acceleration])


def _undefined(motion: Motion, columns: np.ndarray) -> str | None:
    """Why some columns are nan: the last event at which the motion has lost its derivative; None if
    all are finite.
    """
    if np.isfinite(columns).all():
        return None
    for event, detail in zip(reversed(motion.events), motion.events.details[::-1], strict=True):
        if (
            event.kind is EventKind.IMPACT
            and motion.system.model.contacts
            and detail != ImpactDetail.REGULAR
        ):
            return IRREGULAR[ImpactDetail(detail)].format(time=event.time)
        if event.kind is EventKind.CHATTER:
            return (
                f"at time {event.time:.9g} impacts without loss became too small to be followed,"
                " and their phase is lost"
            )
        if event.kind is EventKind.GRAZING and detail == GrazingDetail.TRIPLE:
            return (
                f"at time {event.time:.9g} the motion meets the contact without speed, where it has"
                " no derivative"
            )
        if event.kind is EventKind.REST and detail == RestDetail.NEVER_AGAIN:
            return (
                f"from time {event.time:.9g} on it rests at contact and impacts lose nothing, so"
                " that a motion from a state beside it never comes to rest: there is no derivative"
                " to what moves it off the contact"
            )
    if motion.system.model.contacts:
        return (
            "it starts with a closed contact whose impacts lose nothing, or a reaction reaches 0"
            " without a rate, so that motions beside it go another way"
        )
    return "the derivatives leave the range of numbers"
