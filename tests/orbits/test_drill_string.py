"""A drill string of two discs (examples/drill_string.py) beside DOP853 with a machine of two modes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

import saltus

EXAMPLE = Path(__file__).parents[2] / "examples" / "drill_string.py"
KINETIC, STATIC = 0.5, 1.0


def torque(state):
    pipe, bit, u, v = state
    return 2.0 * (pipe - bit) + 0.05 * (u - v)


def field(t, state, sticks):
    pipe, _, u, v = state
    pull = torque(state)
    return [u, v, (-pipe - 0.05 * u - pull) / 0.5, 0.0 if sticks else pull - KINETIC]


def integrated(state, duration, sticks, event):
    return solve_ivp(
        field, (0.0, duration), state, "DOP853", args=(sticks,), events=event, rtol=1e-12,
        atol=1e-13, first_step=1e-6,
    )  # fmt: skip


def let_go(t, state, sticks):
    return torque(state) - STATIC


let_go.terminal, let_go.direction = True, 1


def slowest(t, state, sticks):
    return torque(state) - KINETIC


slowest.direction = 1


def a_round(speed, state):
    """The time and the state after a stick and a slip, from the start of a stick."""

    def stops(t, state, sticks):
        return state[3] + speed

    stops.terminal, stops.direction = True, -1
    stuck = integrated(state, 100.0, True, let_go)
    free = integrated([*stuck.y[:3, -1], -speed], 100.0, False, stops)
    return stuck.t[-1] + free.t[-1], np.append(free.y[:3, -1], -speed)


def touching(unknowns):
    """What is left of the cycle on which the bit stops without a force to spare: the pipe's angle
    and speed after a round, and the bit's speed to the rock.
    """
    pipe, u, speed = unknowns
    bit = pipe - 0.5 * (KINETIC - 0.05 * (u + speed))
    stuck = integrated([pipe, bit, u, -speed], 100.0, True, let_go)
    free = integrated([*stuck.y[:3, -1], -speed], 8.0, False, slowest)
    apart = free.y_events[0][:, 3] + speed
    last = free.y_events[0][np.argmin(np.abs(apart))]
    return last[0] - pipe, last[2] - u, last[3] + speed


@pytest.fixture(scope="module")
def cycle() -> Any:
    source = EXAMPLE.read_text().split("cycle =")[0]
    names: dict[str, Any] = {}
    exec(compile(source, str(EXAMPLE), "exec"), names)
    return saltus.find_orbit(names["string"], pipe=-0.3, bit=-0.5, velocity=(-0.9, -1.1))


def test_its_cycle_is_that_of_an_independent_solver(cycle):
    state, time = np.array([-0.3, -0.5, -0.9, -1.1]), 0.0
    for _ in range(25):
        time, state = a_round(1.1, state)
    assert cycle.period == pytest.approx(time, abs=1e-9)


def test_its_branch_ends_where_the_bit_only_just_stops(cycle):
    branch = saltus.continue_orbit(cycle, "model.speed", (1.05, 1.3))
    last = branch.special[-1]
    found = root(touching, [-0.29, -0.87, 1.18], tol=1e-13)
    assert found.success
    assert str(last.kind) == "GS"
    assert last.parameter == pytest.approx(found.x[2], abs=1e-9)
