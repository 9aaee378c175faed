"""The series of the lanes: every operation and function, in all lanes at once, against power series
composed in 40 digits.
"""

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from numba import njit, types
from power_series import solution
from test_series import OPERATIONS, agrees, force

from saltus.flow.kernel.layout import HIGHEST_ORDER, LOWEST_ORDER
from saltus.flow.kernel.layout import SERIES_LENGTH as STRIDE
from saltus.flow.lane_steps.function_types import LANE_SERIES
from saltus.flow.lane_steps.memory import SLOTS
from saltus.flow.programs.compiled import program
from saltus.flow.programs.compiled_lanes import load_lane_functions
from saltus.flow.programs.lane_threads import lane_order
from saltus.systems import Harmonic, Load, Model, Record, System, WallOscillator
from saltus.taylor import written_type
from saltus.taylor.graph import RECORD_WIDTH
from saltus.taylor.vectors import WIDTH

# Operations on a record, whose series ends: what they make ends soon, or late, or never
OF_RECORD = {
    "record": lambda r, q, v: r + 2 * r * q - (1 - r) * v + r / 3 - q / (2 + r),
    "square of a record": lambda r, q, v: (
        r * r * np.sin(q) + r * r * r - (r * r + r) * v + np.square(r * r)
    ),
    "functions of a record": lambda r, q, v: (
        np.cos(r * r) - np.sqrt(3 + r) * np.exp(-r) + np.log(2 + r) * np.tanh(r) * q
    ),
    "powers of a record": lambda r, q, v: (
        (2 + r) ** 1.5 + np.sinh(0.3 * r) * q / np.cosh(r * v) + 1 / (2 + r) + (q + 2) ** r
    ),
}
PIECE = (0.3, -0.2, 0.15, 0.4, -0.1)  # of the record, from the time of the step
STATES = [(0.35, 0.55, 0.0), (-0.45, -0.3, 2.1)]
ORDER = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Many(Model):
    """x_i'' = operation i of x_i, x_i' and the load, or of a record."""

    a: float = 1.3
    b: float = 0.6

    operations: ClassVar[tuple[str, ...]] = (*OPERATIONS, *OF_RECORD)
    coordinates: ClassVar[tuple[str, ...]] = tuple(f"x{i}" for i in range(len(operations)))
    channels: ClassVar[tuple[str, ...]] = ("force", "pulse")

    def acceleration(self, t, position, velocity, side, load):
        f, r = load.force(t), load.pulse(t)
        return tuple(
            OF_RECORD[name](r, q, v)
            if name in OF_RECORD
            else OPERATIONS[name](q, v, f, self.a, self.b)
            for name, q, v in zip(self.operations, position, velocity, strict=True)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Some(Many):
    """Every fourth of them."""

    operations: ClassVar[tuple[str, ...]] = Many.operations[::4]
    coordinates: ClassVar[tuple[str, ...]] = Many.coordinates[: len(operations)]


class LaneSeries:
    """The compiled series of a system, for states in all lanes at once."""

    def __init__(self, system):
        self.run = program(system)
        self.plan, (self.function, *_) = load_lane_functions(self.run.trace)
        self.call = njit(types.void(written_type(LANE_SERIES), *LANE_SERIES.args))(_call)

    def coefficients(self, states, order):
        """Of positions, velocities, accelerations, shape (lanes, coordinates, STRIDE); `states` =
        (t, positions, velocities).
        """
        places, rows = self.plan.places, self.plan.rows
        m = np.full(self.plan.end * WIDTH, np.nan)
        memory = m.reshape(-1, WIDTH)
        memory[SLOTS.origin], memory[SLOTS.side] = 0.0, 1.0
        for lane in range(WIDTH):
            memory[SLOTS.now, lane], q, v = states[lane % len(states)]
            memory[places.position : places.position + rows, lane] = q
            memory[places.velocity : places.velocity + rows, lane] = v
        for part, values in (
            (places.parameters, self.run.env[0]),
            (places.constants, self.run.env[1]),
        ):
            memory[part : part + len(values)] = values[:, None]
        for k in range(self.plan.records * RECORD_WIDTH):
            memory[places.records + k] = PIECE[k]
        self.call(self.function, m, np.array(places), order)
        series = [
            memory[part : part + rows * STRIDE].reshape(rows, STRIDE, WIDTH)
            for part in (places.positions, places.velocities, places.accelerations)
        ]
        return [part.transpose(2, 0, 1) for part in series]


def _call(function, m, places, order):
    function(m, places, order)


@pytest.mark.parametrize(
    "model", [Some(), pytest.param(Many(), marks=pytest.mark.thorough)], ids=["some", "all"]
)
def test_series_of_each_operation_and_of_every_order_in_lanes(model):
    """One structure for all of them, as compiling it is what takes time: ten seconds for all."""
    pulse = Record([0.0, 1.0, 2.0], [0.1, 0.4, 0.3])
    # see `force`
    load = Load(
        frequency=1.3,
        force=Harmonic(0.4, phase=0.7) + Harmonic(0.2, mean=0.1, order=3),
        pulse=pulse,
    )
    series, rows = LaneSeries(System(model=model, load=load)), len(model.coordinates)
    states, wrong = [(t, [x] * rows, [v] * rows) for x, v, t in STATES], []
    # so that each state is in lane 0 once, which may be the only one
    for first in range(len(STATES)):
        positions = series.coefficients(states[first:] + states[:first], HIGHEST_ORDER)[0]
        for row, name in enumerate(model.operations):
            expected = _expected(name, *STATES[first])
            wrong += [
                (name, lane)
                for lane in range(0, WIDTH, 2)
                if not agrees(positions[lane, row, : ORDER + 1], expected)
            ]
    assert not wrong
    whole, orders = series.coefficients(states, HIGHEST_ORDER), np.arange(1, HIGHEST_ORDER + 1)
    for part, slope in itertools.pairwise(whole):
        assert np.allclose(slope[:, :, :-1], part[:, :, 1:] * orders, rtol=1e-15, atol=0.0)
    # made in pairs: none lacks its last coefficient or changes one before
    for order in range(LOWEST_ORDER, HIGHEST_ORDER, 2):
        for part, last, complete in zip(
            series.coefficients(states, order), (order, order, order - 1), whole, strict=True
        ):
            assert np.array_equal(part[:, :, : last + 1], complete[:, :, : last + 1])


def _expected(name, x, v, t):
    """The coefficients of x about t, in 40 digits."""
    if name in OF_RECORD:
        return solution(
            lambda s, q, w: OF_RECORD[name](sum(c * s**k for k, c in enumerate(PIECE)), q, w),
            x,
            v,
            0.0,
            ORDER,
        )
    return solution(lambda s, q, w: OPERATIONS[name](q, w, force(s), 1.3, 0.6), x, v, t, ORDER)


def test_the_series_of_a_linear_system():
    """x'' = -x - 0.2 x' + 0.3 sin 2t, whose coefficients follow from each other."""
    lanes = LaneSeries(
        System(model=WallOscillator(damping=0.2), load=Load(frequency=2.0, force=Harmonic(0.3)))
    )
    expected = solution(lambda t, q, v: -q - 0.2 * v + 0.3 * np.sin(2.0 * t), 0.4, -1.1, 0.7, 16)
    for position in lanes.coefficients([(0.7, [0.4], [-1.1])], 16)[0]:
        assert agrees(position[0, :17], expected)


def test_orders_are_even_and_within_their_bounds():
    assert [lane_order(10.0**-n) for n in range(6, 16)] == [14, 14, 16, 16, 18, 18, 20, 20, 22, 22]
    orders = {lane_order(tol) for tol in np.geomspace(1e-15, 1e-6, 1001)}
    assert orders == set(range(LOWEST_ORDER, HIGHEST_ORDER + 1, 2))
