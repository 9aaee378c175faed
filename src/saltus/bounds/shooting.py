"""Multiple shooting in balls: the equations of a motion from event to event, and their enclosures.

Between events a motion of D coordinates obeys y'' = A(t, y, y') on the segment's side.
An event has P unknowns p, the first of which is its time if it is free.
It gives the state with which the next segment starts, S(t; p), and 2 D equations with which a
segment ends, E(t, y, y'; p) = 0.
Both are expressions of the traced graph, so that every derivative follows by differentiation.
Each segment is cut at nodes, at fixed times, whose states are unknown too.
No enclosure is thus propagated over more than one Taylor step, and nothing wraps.
The last segment ends with the first event, `span` forcing periods later.
If rows `pins` c . x = d are appended, the parameter at `path` is unknown as well, the last one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from saltus.bounds.balls import TWO_PI_RADIUS, Ball, nearly_inverse, powers_of_two, product
from saltus.bounds.tape import Steps, Tape, load_balls
from saltus.systems import System, natural_units, numbers
from saltus.taylor import FREQUENCY, Expr, differentiate, number, substitute

TIME = Expr("time")
# of a step, at which a gap is looked at for a penetration
SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)
HALVINGS = 4  # of the longest step, where a step from the guess has no enclosure
TWO_PI = Ball(2.0 * np.pi, TWO_PI_RADIUS)


def coordinate(index: int) -> Expr:
    """The symbol of a coordinate."""
    return Expr("coordinate", (), index)


def velocity(index: int) -> Expr:
    """The symbol of a velocity."""
    return Expr("velocity", (), index)


@dataclass(frozen=True)
class Gap:
    """A gap sign (q - position) that must be open inside a segment.

    It vanishes to the orders `start` and `stop` where the segment begins and ends: 0 not at all, 1
    at an impact, 2 at a touch, 3 at a release.
    """

    coordinate: int
    sign: float
    position: Expr  # of parameters alone
    start: int
    stop: int


@dataclass(frozen=True)
class Segment:
    """The motion from one event to the next one."""

    acceleration: tuple[Expr, ...]  # (D,)
    start: tuple[Expr, ...]  # S of the event with which it begins, (2 D,)
    end: tuple[Expr, ...]  # E of the event with which it ends, (2 D,)
    gaps: tuple[Gap, ...]


def varied(segment: Segment, unknowns: Unknowns, theta: float) -> Segment:
    """A segment with a solution of its variational equation, as D further coordinates.

    An event has the further unknowns dp.
    With the vector field f of the state z = (y, y'),

        dz(t+) = S_p dp - f(t, S) dt,        E_z (dz + f dt') + E_t dt' + E_p dp' = 0,

    where (dt', dp') of the event at the end are multiplied by `theta`.
    A vector dp of all events that solves these equations, with `theta` at the end of a period, is a
    kernel vector of the shooting equations at the multiplier theta.
    """
    d = len(segment.acceleration)
    size = 2 * d
    leaves = [unknowns[j] for j in range(size)]
    shifts = [unknowns[size + j] for j in range(size)]
    places = [*map(coordinate, range(d)), *map(velocity, range(d))]
    field = [*map(velocity, range(d)), *segment.acceleration]
    variation = [
        *(coordinate(d + i) for i in range(d)),
        *(velocity(d + i) for i in range(d)),
    ]

    def along(root: Expr, symbols: Sequence[Expr], directions: Sequence[Expr]) -> Expr:
        total = number(0.0)
        for leaf, direction in zip(symbols, directions, strict=True):
            total = total + differentiate(root, leaf) * direction
        return total

    at_start = dict(zip(places, segment.start, strict=True))
    started = [along(root, leaves, shifts) for root in segment.start]
    ended = [along(root, places, variation) for root in segment.end]
    later = [along(root, leaves, shifts) for root in segment.end]
    if unknowns.free_time:
        begin_field = [substitute(root, at_start) for root in field]
        started = [s - f * shifts[0] for s, f in zip(started, begin_field, strict=True)]
        later = [
            moved + along(root, places, field) * shifts[0]
            for moved, root in zip(later, segment.end, strict=True)
        ]
    ended = [now + theta * moved for now, moved in zip(ended, later, strict=True)]
    varied_field = [along(root, places, variation) for root in segment.acceleration]

    def woven(first: Sequence[Expr], second: Sequence[Expr]) -> tuple[Expr, ...]:
        """Positions of both, then velocities of both."""
        return (*first[:d], *second[:d], *first[d:], *second[d:])

    return Segment(
        (*segment.acceleration, *varied_field),
        woven(segment.start, started),
        woven(segment.end, ended),
        segment.gaps,
    )


class Unknowns:
    """The symbols of an event's unknowns: of its time, if it is free, and of further parameters."""

    def __init__(self, system: System, free_time: bool = True) -> None:
        self.free_time = free_time
        self._first = len(list(numbers(system)))

    def __getitem__(self, index: int) -> Expr:
        if self.free_time and index == 0:
            return TIME
        return Expr("parameter", (), self._first + index)


class Enclosure:
    """Balls of the equations and of their derivatives over a box of unknowns.

    `proved` says whether every Taylor step is; nothing else has a meaning without it.
    """

    def __init__(self, rows: int, columns: int, first: int, steps: int) -> None:
        self.proved = True
        self.residual = Adder(rows)
        # The derivatives, without the motion's start at the first event; and this part.
        self.open_jacobian = Adder(rows, columns)
        self.start_jacobian = Adder(rows, first)
        self.path_jacobian = Adder(rows)
        self.coefficients: list[Ball] = [Ball(0.0)] * steps  # of each step, (D, order + 2)
        self.lengths: list[Ball] = [Ball(0.0)] * steps

    @property
    def jacobian(self) -> Ball:
        """The derivatives to all unknowns but the parameter."""
        whole = Adder(*self.open_jacobian.middle.shape)
        whole.middle[:] = self.open_jacobian.middle
        whole.radius[:] = self.open_jacobian.radius
        rows = np.arange(len(whole.middle))
        columns = np.arange(self.start_jacobian.middle.shape[1])
        whole.add((rows[:, None], columns), self.start_jacobian.ball)
        return whole.ball


class Adder:
    """An array of balls to whose entries balls are added."""

    def __init__(self, *shape: int) -> None:
        self.middle = np.zeros(shape)
        self.radius = np.zeros(shape)

    def put(self, places: Any, value: Ball) -> None:
        """Set balls."""
        self.middle[places] = value.middle
        self.radius[places] = value.radius

    def add(self, places: Any, value: Ball) -> None:
        """Add balls at distinct places."""
        self.put(places, Ball(self.middle[places], self.radius[places]) + value)

    @property
    def ball(self) -> Ball:
        """The balls."""
        return Ball(self.middle, self.radius)


@dataclass(frozen=True)
class Step:
    """One Taylor step of a segment, from an event or a node to a node or an event."""

    segment: int
    begin: int  # the place of the first unknown of its begin
    from_event: bool
    begin_time: float  # of a node
    close: int
    to_event: bool
    close_time: float
    wraps: bool  # whether it ends with the first event, a period later


@dataclass(frozen=True)
class ShootingSettings:
    """The Taylor steps.

    Longer steps of higher order have fewer unknowns at the same width of the enclosures.
    """

    step: float = 0.35  # the longest, in the time in which the system moves by itself
    order: int = 36


class _Group:
    """The tapes of the segments that have the same expressions."""

    def __init__(self, segment: Segment, unknowns: Sequence[Expr], path: Expr | None) -> None:
        d = len(segment.acceleration)
        state = [*map(coordinate, range(d)), *map(velocity, range(d))]
        self.bare = Tape(segment.acceleration)
        self.flow = Tape(with_columns(segment.acceleration, path))
        self.start = Tape(_with_slopes(segment.start, unknowns, path))
        # The time comes first, as the end of a period moves with the frequency.
        inner = [TIME, *state, *(leaf for leaf in unknowns if leaf is not TIME)]
        self.end = Tape(_with_slopes(segment.end, inner, path))
        self.positions = Tape([gap.position for gap in segment.gaps] or [number(0.0)])


def _with_slopes(roots: Sequence[Expr], leaves: Sequence[Expr], path: Expr | None) -> list[Expr]:
    """Expressions, their derivatives leaf by leaf, and those to the path."""
    slopes = [differentiate(root, leaf) for leaf in leaves for root in roots]
    along = [number(0.0) if path is None else differentiate(root, path) for root in roots]
    return [*roots, *slopes, *along]


def with_columns(acceleration: Sequence[Expr], path: Expr | None) -> list[Expr]:
    """The accelerations, then those of the derivatives to all initial positions, velocities and to
    a parameter.
    """
    d = len(acceleration)
    result = list(acceleration)
    for j in range(1, 2 * d + 1 + (path is not None)):
        for root in acceleration:
            total = number(0.0)
            if j > 2 * d:
                assert path is not None
                total = differentiate(root, path)
            for i in range(d):
                total = total + differentiate(root, coordinate(i)) * coordinate(d * j + i)
                total = total + differentiate(root, velocity(i)) * velocity(d * j + i)
            result.append(total)
    return result


class Shooting:
    """The equations F(x) = 0, or F(x, parameter) = 0, and their enclosures over boxes.

    Parameters
    ----------
    system
        The system whose numbers are the parameters of the expressions.
    segments
        The segments, one for each event; segment i begins with event i.
    guess
        The unknowns of the events, (events, P).
    event_names, state_names
        The names of the kinds of unknowns: of each event, (events, P), and of the states at the
        nodes, (2 D).
    span
        The forcing periods after which the last segment ends.
    path
        The parameter to which derivatives are taken.
    radii
        How far each number of the system may lie from its double, by its path.
    pins
        Rows c and numbers d; with them the parameter at `path` is unknown.
    free_time
        Whether the time of an event is its first unknown; else it is 0.
    """

    def __init__(
        self,
        system: System,
        segments: Sequence[Segment],
        guess: np.ndarray,
        event_names: Sequence[Sequence[str]],
        state_names: Sequence[str],
        span: float,
        *,
        path: str | None = None,
        radii: dict[str, float] | None = None,
        pins: Sequence[tuple[np.ndarray, float]] | None = None,
        free_time: bool = True,
        settings: ShootingSettings | None = None,
    ) -> None:
        self.system = system
        self.segments = list(segments)
        self.span = span
        self.path = path
        self.settings = settings or ShootingSettings()
        self.unknowns = Unknowns(system, free_time)
        self.free_time = free_time
        names = [name for name, _ in numbers(system)]
        middles = np.array([float(value) for _, value in numbers(system)])
        self.parameters = Ball(middles, [float((radii or {}).get(name, 0.0)) for name in names])
        self.path_place = None if path is None else names.index(path)
        self.frequency_place = names.index(FREQUENCY)
        self.pins = None if pins is None else list(pins)
        guess = np.asarray(guess, dtype=float)
        self.event_count, self.event_size = guess.shape
        self.dof = len(segments[0].acceleration)
        leaf = None if self.path_place is None else Expr("parameter", (), self.path_place)
        leaves = [self.unknowns[j] for j in range(self.event_size)]
        made: dict[Any, _Group] = {}
        self.groups: list[_Group] = []
        for segment in self.segments:
            key = (segment.acceleration, segment.start, segment.end)
            if key not in made:
                made[key] = _Group(segment, leaves, leaf)
            self.groups.append(made[key])
        self._distinct = list(made.values())
        self._layout(guess)
        enclosure = self.enclose(Ball(self.x0))
        for _ in range(HALVINGS):
            if enclosure.proved:
                break
            self.settings = replace(self.settings, step=0.5 * self.settings.step)
            self._layout(guess)
            enclosure = self.enclose(Ball(self.x0))
        nodes = sum(not step.from_event for step in self.steps)
        self.names = [name for names in event_names for name in names]
        self.names += [*state_names] * nodes + [path or ""] * (self.pins is not None)
        self._state_scales = _largest_states(enclosure, self.dof)
        self.scales = self._natural_scales(state_names)

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return int(self.x0.size)

    def _natural_scales(self, state_names: Sequence[str]) -> np.ndarray:
        """The unit of each unknown in which the sizes of boxes are measured: 1 / Omega of a time,
        and of all others the largest modulus of their kind among the unknowns, or along the motion
        where all of them vanish.
        """
        result = np.ones(self.size)
        along = dict(zip(state_names, self._state_scales, strict=True))
        fastest = float(self._state_scales[self.dof :].max())
        for name in dict.fromkeys(self.names):
            places = [place for place, other in enumerate(self.names) if other == name]
            largest = float(np.abs(self.x0[places]).max())
            result[places] = largest if largest > 0.0 else along.get(name, fastest)
        if self.free_time:
            times = range(0, self.event_unknowns, self.event_size)
            result[times] = 1.0 / self.parameters.middle[self.frequency_place]
        return result

    @property
    def row_scales(self) -> np.ndarray:
        """The natural scale of each equation: of a motion, the largest modulus of this coordinate or
        velocity along it; of a pin, the largest of its terms.
        """
        pins = [float(np.abs(row * self.scales).max()) for row, _ in self.pins or []]
        return np.concatenate([np.tile(self._state_scales, len(self.steps)), pins])

    def nearly_inverse(self, jacobian: np.ndarray) -> np.ndarray | None:
        """A matrix near the inverse of a Jacobian with its pins, computed in natural scales, so that
        it depends on no units; None where it is singular.
        """
        rows = powers_of_two(self.row_scales)
        columns = powers_of_two(self.scales)
        inverse = nearly_inverse(jacobian * columns / rows[:, None])
        return None if inverse is None else inverse * columns[:, None] / rows

    def by_name(self, radius: np.ndarray) -> dict[str, float]:
        """The least of some radii for each kind of unknowns."""
        result: dict[str, float] = {}
        for name, value in zip(self.names, radius, strict=True):
            result[name] = min(result.get(name, np.inf), float(value))
        return result

    @property
    def period(self) -> Ball:
        """The time over which the equations reach."""
        return TWO_PI * self.span / self.parameters[self.frequency_place]

    @property
    def event_unknowns(self) -> int:
        """How many of the unknowns, the first ones, belong to events."""
        return int(self.event_count * self.event_size)

    def _layout(self, guess: np.ndarray) -> None:
        """Place nodes along the segments; their states are guessed step after step."""
        frequency = self.parameters.middle[self.frequency_place]
        longest = self.settings.step * natural_units(self.system).own_time
        first = guess[:, 0] if self.free_time else np.zeros(len(guess))
        times = [*first, first[0] + self.span * 2.0 * np.pi / frequency]
        unknowns = [float(value) for event in guess for value in event]
        self.steps: list[Step] = []
        for i in range(self.event_count):
            count = max(1, int(np.ceil((times[i + 1] - times[i]) / longest)))
            nodes = np.linspace(times[i], times[i + 1], count + 1)[1:-1]
            states = [ball.middle for ball in self.follow(i, Ball(guess[i]), nodes, guessed=True)]
            width = 2 * self.dof
            places = [len(unknowns) + width * k for k in range(len(nodes))]
            for state in states:
                unknowns += [float(value) for value in state]
            last = i == self.event_count - 1
            closes = [*places, 0 if last else self.event_size * (i + 1)]
            begins = [self.event_size * i, *places]
            at = [np.nan, *nodes, np.nan]
            for k in range(count):
                self.steps.append(
                    Step(
                        segment=i,
                        begin=begins[k],
                        from_event=k == 0,
                        begin_time=at[k],
                        close=closes[k],
                        to_event=k == count - 1,
                        close_time=at[k + 1],
                        wraps=last and k == count - 1,
                    )
                )
        if self.pins is not None:
            assert self.path_place is not None
            unknowns.append(float(self.parameters.middle[self.path_place]))
        self.x0 = np.array(unknowns)

    def follow(
        self,
        i: int,
        event: Ball,
        nodes: Sequence[float] | np.ndarray,
        parameter: Ball | None = None,
        guessed: bool = False,
    ) -> list[Ball]:
        """Balls of the states at some times after event i, one step after another.

        They grow with the number of steps; if they are `guessed`, each step starts from the middle
        of the last one alone, and they contain nothing.
        """
        group = self.groups[i]
        known = self.parameters_at(parameter)
        known = _joined(known, event).reshape(1, -1)
        nothing = Ball(np.zeros((1, self.dof)))
        time = event[:1] if self.free_time else Ball(np.zeros(1))
        width = 2 * self.dof
        start = group.start.values(known, time, nothing, nothing)[:, :width]
        result: list[Ball] = []
        state = start.reshape(1, 2, self.dof).transposed
        for node in nodes:
            taken = Steps(group.bare, self.settings.order, known, time, node - time, state)
            state = taken.ends[:, :, :2]
            if guessed:
                state = Ball(state.middle)
            time = Ball(np.array([node]))
            result.append(state.transposed.reshape(width))
        return result

    def parameters_at(self, parameter: Ball | None) -> Ball:
        """The system's numbers, with another ball of the one at the path."""
        if parameter is None:
            return self.parameters
        middle = self.parameters.middle.copy()
        radius = self.parameters.radius.copy()
        middle[self.path_place] = parameter.middle
        radius[self.path_place] = parameter.radius
        return Ball(middle, radius)

    def enclose(self, x: Ball, parameter: Ball | None = None) -> Enclosure:
        """F and its derivatives over a box of unknowns, and a ball of the parameter."""
        if self.pins is not None:
            parameter = x[-1]
        known = self.parameters_at(parameter)
        rows = 2 * self.dof * len(self.steps)
        columns = self.size - (self.pins is not None)
        result = Enclosure(rows, columns, self.event_size, len(self.steps))
        for group in self._distinct:
            places = [k for k, s in enumerate(self.steps) if self.groups[s.segment] is group]
            self._enclose_group(group, places, x, known, result)
        return result

    def _enclose_group(
        self, group: _Group, places: list[int], x: Ball, known: Ball, result: Enclosure
    ) -> None:
        """The rows of the steps of one group."""
        steps = [self.steps[k] for k in places]
        begin = self._begins(group, steps, x, known)
        end = self._end_times(steps, x, known)
        taken = self._taken(group, begin, end - begin.time, known)
        result.proved = result.proved and bool(taken.proved.all())
        for i, k in enumerate(places):
            result.coefficients[k] = taken.coefficients[i, : self.dof]
            result.lengths[k] = (end - begin.time)[i]
        columns = len(group.flow.roots) // self.dof
        ends = taken.ends.reshape(len(steps), columns, self.dof, 3)
        flow = _Flow(ends, self.dof, self.path is not None)
        # The derivatives of the ends to the unknowns of the begins, and to the parameter.
        first_rate = _joined(begin.state[:, self.dof :], 2.0 * taken.coefficients[:, : self.dof, 2])
        back = begin.slopes
        if self.free_time:
            moving = np.array([step.from_event for step in steps])
            shift = Ball(
                np.where(moving[:, None], first_rate.middle, 0.0),
                np.where(moving[:, None], first_rate.radius, 0.0),
            )
            first_column = back[:, :, 0] - shift
            back.middle[:, :, 0] = first_column.middle
            back.radius[:, :, 0] = first_column.radius
        back = product(flow.derivative, back)
        along = product(flow.derivative, begin.along.column)[:, :, 0] + flow.along
        at_nodes = [i for i, step in enumerate(steps) if not step.to_event]
        if at_nodes:
            self._close_nodes(places, at_nodes, x, flow, back, along, result)
        at_events = [i for i, step in enumerate(steps) if step.to_event]
        if at_events:
            self._close_events(group, places, at_events, end, x, known, flow, back, along, result)

    def _begins(self, group: _Group, steps: list[Step], x: Ball, known: Ball) -> _Begins:
        """The states with which steps begin, with their derivatives."""
        count = len(steps)
        width = 2 * self.dof
        times = Adder(count)
        states = Adder(count, width)
        slopes = Adder(count, width, max(width, self.event_size))
        along = Adder(count, width)
        events = [i for i, step in enumerate(steps) if step.from_event]
        nodes = [i for i, step in enumerate(steps) if not step.from_event]
        if nodes:
            at = np.array([steps[i].begin for i in nodes])[:, None] + np.arange(width)
            times.put(nodes, Ball([steps[i].begin_time for i in nodes]))
            states.put(nodes, x[at])
            slopes.middle[nodes, :, :width] = np.eye(width)
        if events:
            at = np.array([steps[i].begin for i in events])[:, None] + np.arange(self.event_size)
            unknowns = x[at]
            time = unknowns[:, 0] if self.free_time else Ball(np.zeros(len(events)))
            values = self._values(group.start, known, unknowns, time, None)
            times.put(events, time)
            states.put(events, values[:, :width])
            inner = values[:, width : width * (1 + self.event_size)]
            inner = inner.reshape(len(events), self.event_size, width).transposed
            columns = np.arange(self.event_size)
            slopes.put(np.ix_(np.array(events), np.arange(width), columns), inner)
            along.put(events, values[:, -width:])
        return _Begins(times.ball, states.ball, slopes.ball, along.ball)

    def _end_times(self, steps: list[Step], x: Ball, known: Ball) -> Ball:
        """When steps end."""
        period = TWO_PI * self.span / known[self.frequency_place]
        result = Adder(len(steps))
        for i, step in enumerate(steps):
            if not step.to_event:
                result.add(i, Ball(step.close_time))
                continue
            if self.free_time:
                result.add(i, x[step.close])
            if step.wraps:
                result.add(i, period)
        return result.ball

    def _taken(self, group: _Group, begin: _Begins, length: Ball, known: Ball) -> Steps:
        """The validated steps of the state and of its derivatives."""
        count = len(begin.time.middle)
        d = self.dof
        columns = len(group.flow.roots)
        middle = np.zeros((count, columns, 2))
        radius = np.zeros((count, columns, 2))
        state = begin.state.reshape(count, 2, d).transposed
        middle[:, :d] = state.middle
        radius[:, :d] = state.radius
        for i in range(d):
            middle[:, d * (1 + i) + i, 0] = 1.0
            middle[:, d * (1 + d + i) + i, 1] = 1.0
        parameters = Ball(np.tile(known.middle, (count, 1)), np.tile(known.radius, (count, 1)))
        state = Ball(middle, radius)
        return Steps(group.flow, self.settings.order, parameters, begin.time, length, state)

    def _close_nodes(
        self,
        places: list[int],
        at_nodes: list[int],
        x: Ball,
        flow: _Flow,
        back: Ball,
        along: Ball,
        result: Enclosure,
    ) -> None:
        """The rows of steps to nodes: their ends are the nodes' states."""
        width = 2 * self.dof
        steps = [self.steps[places[i]] for i in at_nodes]
        rows = width * np.array(places)[at_nodes][:, None] + np.arange(width)
        nodes = np.array([step.close for step in steps])[:, None] + np.arange(width)
        result.residual.add(rows, flow.end[at_nodes] - x[nodes])
        result.path_jacobian.add(rows, along[at_nodes])
        blocks = np.tile(-np.eye(width), (len(steps), 1, 1))
        result.open_jacobian.add((rows[:, :, None], nodes[:, None, :]), Ball(blocks))
        inner = [j for j, step in enumerate(steps) if not step.from_event]
        begins = np.array([steps[j].begin for j in inner], dtype=int)[:, None] + np.arange(width)
        result.open_jacobian.add(
            (rows[inner][:, :, None], begins[:, None, :]),
            back[np.array(at_nodes)[inner]][:, :, :width],
        )
        for j, step in enumerate(steps):
            if step.from_event:
                self._add_begin(step, rows[j], back[at_nodes[j]], result)

    def _close_events(
        self,
        group: _Group,
        places: list[int],
        at_events: list[int],
        end: Ball,
        x: Ball,
        known: Ball,
        flow: _Flow,
        back: Ball,
        along: Ball,
        result: Enclosure,
    ) -> None:
        """The rows of steps to an event: E at its end is 0."""
        width = 2 * self.dof
        steps = [self.steps[places[i]] for i in at_events]
        at = np.array([step.close for step in steps])[:, None] + np.arange(self.event_size)
        unknowns = x[at]
        values = self._values(group.end, known, unknowns, end[at_events], flow.end[at_events])
        period_slope = -1.0 * TWO_PI * self.span / known[self.frequency_place]
        period_slope = period_slope / known[self.frequency_place]
        own = self.event_size - self.free_time
        for j, i in enumerate(at_events):
            step = steps[j]
            rows = width * places[i] + np.arange(width)
            part = values[j].reshape(-1, width)  # E, then a row of derivatives for each leaf
            by_time = part[1]
            by_state = part[2 : 2 + width].transposed
            by_unknowns = part[2 + width : 2 + width + own].transposed
            moving = product(by_state, flow.rate[i].column)[:, 0] + by_time
            result.residual.add(rows, part[0])
            self._add_begin(step, rows, product(by_state, back[i]), result)
            columns = step.close + int(self.free_time) + np.arange(own)
            result.open_jacobian.add((rows[:, None], columns), by_unknowns)
            if self.free_time:
                result.open_jacobian.add((rows, step.close), moving)
            result.path_jacobian.add(rows, product(by_state, along[i].column)[:, 0] + part[-1])
            if step.wraps and self.path == FREQUENCY:
                result.path_jacobian.add(rows, moving * period_slope)

    def _add_begin(self, step: Step, rows: np.ndarray, back: Ball, result: Enclosure) -> None:
        """The derivatives of rows to the unknowns of the step's begin."""
        width = self.event_size if step.from_event else 2 * self.dof
        if step.from_event and step.begin == 0:
            columns = np.arange(width)
            result.start_jacobian.add((rows[:, None], columns), back[:, :width])
        else:
            columns = step.begin + np.arange(width)
            result.open_jacobian.add((rows[:, None], columns), back[:, :width])

    def _values(
        self, tape: Tape, known: Ball, unknowns: Ball, time: Ball, states: Ball | None
    ) -> Ball:
        """Balls of a tape's roots at events; the unknowns follow the parameters."""
        count = len(unknowns.middle)
        d = self.dof
        middle = np.concatenate([np.tile(known.middle, (count, 1)), unknowns.middle], axis=1)
        radius = np.concatenate([np.tile(known.radius, (count, 1)), unknowns.radius], axis=1)
        nothing = Ball(np.zeros((count, d)))
        positions = nothing if states is None else states[:, :d]
        velocities = nothing if states is None else states[:, d:]
        return tape.values(Ball(middle, radius), time, positions, velocities)

    def system_rows(self, enclosure: Enclosure, x: Ball) -> tuple[Ball, Ball]:
        """The residual and the Jacobian with the column of the unknown parameter and the rows of
        the pins, if there are any.
        """
        residual = enclosure.residual.ball
        jacobian = enclosure.jacobian
        if self.pins is None:
            return residual, jacobian
        rows = len(residual.middle)
        count = len(self.pins)
        whole = Adder(rows + count, self.size)
        values = Adder(rows + count)
        values.add(np.arange(rows), residual)
        inner = (np.arange(rows)[:, None], np.arange(self.size - 1))
        whole.add(inner, jacobian)
        whole.add((np.arange(rows), self.size - 1), enclosure.path_jacobian.ball)
        for i, (row, goal) in enumerate(self.pins):
            whole.add((rows + i, np.arange(self.size)), Ball(row))
            total = product(Ball(row[None]), x.column)[0, 0] - goal
            values.add(rows + i, total)
        return values.ball, whole.ball

    def pierced(self, enclosure: Enclosure, x: Ball) -> float | None:
        """A time at which a gap is certainly negative, for all motions of a box; else None."""
        for step, gap, coefficients, position, length in self._gaps(enclosure, x):
            begin = x[step.begin] if step.from_event else Ball(step.begin_time)
            for share in SHARES:
                moment = length * share
                value = Ball(0.0)
                for order in reversed(range(len(coefficients.middle))):
                    value = value * moment + coefficients[order]
                if ((value - position) * gap.sign).high < 0.0:
                    return float(begin.middle + moment.middle)
        return None

    def is_open(self, enclosure: Enclosure, x: Ball) -> bool:
        """Whether every gap is open inside every step, for all motions of a box."""
        return all(
            load_balls().is_open(
                np.ascontiguousarray(coefficients.middle),
                np.ascontiguousarray(coefficients.radius),
                gap.sign,
                float(position.middle),
                float(position.radius),
                float(length.middle),
                float(length.radius),
                gap.start if step.from_event else 0,
                gap.stop if step.to_event else 0,
            )
            for step, gap, coefficients, position, length in self._gaps(enclosure, x)
        )

    def _gaps(self, enclosure: Enclosure, x: Ball) -> Iterator[tuple[Step, Gap, Ball, Ball, Ball]]:
        """Each gap of each step, with the coefficients of its coordinate, its position, and the
        step's length.
        """
        known = self.parameters_at(x[-1] if self.pins is not None else None)[None]
        time = Ball(np.zeros(1))
        nothing = Ball(np.zeros((1, self.dof)))
        for k, step in enumerate(self.steps):
            tape = self.groups[step.segment].positions
            positions = tape.values(known, time, nothing, nothing)[0]
            for at, gap in enumerate(self.segments[step.segment].gaps):
                coefficients = enclosure.coefficients[k][gap.coordinate]
                yield step, gap, coefficients, positions[at], enclosure.lengths[k]


def _largest_states(enclosure: Enclosure, dof: int) -> np.ndarray:
    """The largest moduli of the coordinates and of the velocities along a motion, nearly, (2 D)."""
    result = np.zeros(2 * dof)
    for coefficients, length in zip(enclosure.coefficients, enclosure.lengths, strict=True):
        sizes = np.abs(coefficients.middle)
        orders = np.arange(sizes.shape[1])
        powers = np.abs(length.middle) ** orders
        positions = sizes @ powers
        velocities = (sizes * orders)[:, 1:] @ powers[:-1]
        result = np.fmax(result, np.concatenate([positions, velocities]))
    return np.where((result > 0.0) & np.isfinite(result), result, 1.0)


class _Begins(NamedTuple):
    """Where steps begin: times, states, their derivatives to the unknowns there and to the
    parameter.
    """

    time: Ball
    state: Ball
    slopes: Ball
    along: Ball


class _Flow:
    """Steps' ends, (steps, 2 D) with positions before velocities: states, rates, derivatives to
    the state at the begin and to the parameter.
    """

    def __init__(self, ends: Ball, dof: int, with_path: bool) -> None:
        self.end = _packed(ends[:, 0, :, :2])
        self.rate = _packed(ends[:, 0, :, 1:])
        self.derivative = _packed(ends[:, 1 : 2 * dof + 1, :, :2]).transposed
        along = _packed(ends[:, 2 * dof + 1, :, :2]) if with_path else Ball(0.0)
        self.along = along


def _packed(ends: Ball) -> Ball:
    """(..., D, 2) becomes (..., 2 D), positions before velocities."""
    turned = ends.transposed
    return turned.reshape(*turned.middle.shape[:-2], -1)


def _joined(first: Ball, second: Ball) -> Ball:
    return Ball(
        np.concatenate([first.middle, second.middle], axis=-1),
        np.concatenate([first.radius, second.radius], axis=-1),
    )
