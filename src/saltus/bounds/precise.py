"""The residual of shooting equations with more digits than doubles have, in the balls of FLINT.

Where the equations are nearly singular, the inverse Jacobian makes the rounding of their residual
larger than the boxes in which the operator contracts.
Then this residual alone is computed anew: the Taylor coefficients of each step in balls of many
bits, its remainder by the compiled arithmetic.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds.balls import EPS, TINY, Ball
from saltus.bounds.tape import Steps
from saltus.taylor import Expr, ordered

if TYPE_CHECKING:
    from saltus.bounds.shooting import Shooting, Step

BITS = 128
# Of the Taylor steps: their remainder in doubles must not matter beside a rounding of the state.
ORDER = 60
WIDER = 1.0 + 1e-10  # above the roundings of a radius that becomes a double


def _hyperbolic(sign: int) -> Callable[[Any], Any]:
    """(e^u + sign e^-u) / 2, of which FLINT has no series."""
    return lambda u: (u.exp() + sign / u.exp()) / 2


def _is(holds: Callable[[Any, Any], bool], fails: Callable[[Any, Any], bool]) -> Any:
    """1 or 0; NaN where balls do not decide."""
    return lambda u, w: (
        (u - u) * 0 + 1 if holds(u, w) else (u - u) * 0 if fails(u, w) else (u - u) / 0
    )


# Each takes balls, and most of them series of balls too.
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "pow": operator.pow,
    **{name: operator.methodcaller(name) for name in ("sin", "cos", "exp", "log", "sqrt", "atan")},
    "sinh": _hyperbolic(-1),
    "cosh": _hyperbolic(1),
    "tanh": lambda u: 1 - 2 / ((2 * u).exp() + 1),
    "maximum": lambda u, w: u.max(w),
    "minimum": lambda u, w: u.min(w),
    "greater": _is(operator.gt, operator.le),
    "greater_equal": _is(operator.ge, operator.lt),
    "less": _is(operator.lt, operator.ge),
    "less_equal": _is(operator.le, operator.gt),
    "where": lambda c, yes, no: yes if c == 1 else no if c == 0 else c,
}


def has_flint() -> bool:
    """Whether the extra `prove` is installed."""
    return find_spec("flint") is not None


def precise_residual(shooting: Shooting, x: np.ndarray) -> Ball | None:
    """The ball of F and of its pins at a point of doubles; None where a step has no enclosure, or
    the motion between events has a function without a series.
    """
    import flint

    before = flint.ctx.prec, flint.ctx.cap
    flint.ctx.prec = BITS
    flint.ctx.cap = ORDER + 1
    try:
        rows = _Residual(shooting, x).rows()
    except (TypeError, AttributeError):  # FLINT's words for what it has no series of
        return None
    finally:
        flint.ctx.prec, flint.ctx.cap = before
    return None if rows is None else _in_doubles(rows)


def _in_doubles(values: Sequence[Any]) -> Ball:
    """Balls of doubles that contain balls of FLINT."""
    middle = np.array([float(value.mid()) for value in values])
    radius = np.array([float(value.rad()) for value in values])
    return Ball(middle, radius * WIDER + EPS * np.abs(middle) + TINY)


class _Residual:
    """The equations at one point."""

    def __init__(self, shooting: Shooting, x: np.ndarray) -> None:
        from flint import arb

        self.shooting = shooting
        self.x = [arb(float(value)) for value in x]
        known = shooting.parameters_at(Ball(x[-1]) if shooting.pins is not None else None)
        pairs = zip(known.middle, known.radius, strict=True)
        self.known = [arb(float(middle), float(radius)) for middle, radius in pairs]
        self.known_balls = known[None]
        frequency = self.known[shooting.frequency_place]
        self.period = 2 * arb.pi() * arb(float(shooting.span)) / frequency

    def rows(self) -> list[Any] | None:
        """Balls of all equations, or None where a step has no enclosure."""
        from flint import arb

        result: list[Any] = []
        for step in self.shooting.steps:
            rows = self._rows_of(step)
            if rows is None:
                return None
            result += rows
        for row, goal in self.shooting.pins or []:
            terms = (arb(float(c)) * value for c, value in zip(row, self.x, strict=True))
            result.append(sum(terms, arb(0)) - arb(float(goal)))
        return result

    def _rows_of(self, step: Step) -> list[Any] | None:
        from flint import arb

        shooting = self.shooting
        segment = shooting.segments[step.segment]
        width = 2 * shooting.dof
        size = shooting.event_size
        zero = arb(0)
        if step.from_event:
            event = self.x[step.begin : step.begin + size]
            begin = event[0] if shooting.free_time else zero
            state = self._values(segment.start, [*self.known, *event], begin, [zero] * width)
        else:
            begin = arb(step.begin_time)
            state = self.x[step.begin : step.begin + width]
        close = self.x[step.close : step.close + (size if step.to_event else width)]
        end = arb(step.close_time) if not step.to_event else close[0]
        if step.to_event and not shooting.free_time:
            end = zero
        if step.wraps:
            end = end + self.period
        reached = self._reached(step, begin, end - begin, state)
        if reached is None:
            return None
        if step.to_event:
            return self._values(segment.end, [*self.known, *close], end, reached)
        return [now - node for now, node in zip(reached, close, strict=True)]

    def _reached(self, step: Step, begin: Any, length: Any, state: list[Any]) -> list[Any] | None:
        """The state after a step, positions before velocities."""
        from flint import arb, arb_poly

        d = self.shooting.dof
        start = _in_doubles(state).reshape(1, 2, d).transposed
        taken = Steps(
            self.shooting.groups[step.segment].bare,
            ORDER,
            self.known_balls,
            _in_doubles([begin]),
            _in_doubles([length]),
            start,
        )
        if not taken.proved[0]:
            return None
        result = []
        rest = taken.coefficients[0, :, -1]
        motion = self._motion(self.shooting.segments[step.segment].acceleration, begin, state)
        for y, middle, radius in zip(motion, rest.middle, rest.radius, strict=True):
            coefficients = y.coeffs()
            coefficients += [0] * (ORDER + 1 - len(coefficients))
            result.append(arb_poly([*coefficients, arb(float(middle), float(radius))]))
        return [*(y(length) for y in result), *(y.derivative()(length) for y in result)]

    def _motion(self, acceleration: Sequence[Expr], begin: Any, state: list[Any]) -> list[Any]:
        """The series of the coordinates up to ORDER, by Picard's iteration: each time one more
        coefficient is that of the motion.
        """
        from flint import arb_series

        d = self.shooting.dof
        time = arb_series([begin, 1])
        motion = [arb_series([q, v], prec=2) for q, v in zip(state[:d], state[d:], strict=True)]
        while min(y.prec for y in motion) <= ORDER:
            places = [*motion, *(y.derivative() for y in motion)]
            pulls = self._values(acceleration, self.known, time, places)
            motion = [
                arb_series([q, v]) + (pull + arb_series([0])).integral().integral()
                for q, v, pull in zip(state[:d], state[d:], pulls, strict=True)
            ]
        return motion

    def _values(
        self, roots: Sequence[Expr], known: list[Any], time: Any, state: Sequence[Any]
    ) -> list[Any]:
        """Some expressions of balls or of series; `state` has positions before velocities."""
        from flint import arb

        d = self.shooting.dof
        values: dict[int, Any] = {}
        for node in ordered(list(roots)):
            if node.op == "number":
                value = arb(float(node.value))
            elif node.op == "parameter":
                value = known[node.value]
            elif node.op == "time":
                value = time
            elif node.op in ("coordinate", "velocity"):
                value = state[node.value + d * (node.op == "velocity")]
            else:
                value = FUNCTIONS[node.op](*(values[id(part)] for part in node.args))
            values[id(node)] = value
        return [values[id(root)] for root in roots]
