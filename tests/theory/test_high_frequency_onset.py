"""The high-frequency onset against the fold of the two-crossing symmetric orbit, solved by shooting
with DOP853.
"""

import math
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

from saltus.errors import ParameterError
from saltus.systems import Harmonic, Load, Metainterface, System
from saltus.theory import critical_horizontal, high_frequency_onset

BETA = math.radians(80)


@cache
def computed_onset(frequency, beta0=BETA, vertical=-0.5, damping=0.1):
    """The least Hhat at which a symmetric period-1 orbit with two crossings exists: for each phase
    of its upward crossing the impact speed v and Hhat that bring theta to 0 with velocity -v half a
    period later, by Newton; then the least Hhat.
    """
    half = math.pi / frequency

    def arc(phase, speed, load):
        system = System(
            model=Metainterface(beta0=beta0, damping=damping),
            load=Load(
                frequency=frequency, horizontal=Harmonic(load, phase=phase), vertical=vertical
            ),
        )

        def flow(t, y):
            return [y[1], system.model.acceleration(t, y[0], y[1], 1, system.load)]

        end = solve_ivp(flow, (0, half), [0.0, speed], method="DOP853", rtol=1e-13, atol=1e-17).y[
            :, -1
        ]
        return np.array([end[0] / half, end[1] + speed])

    def needed(phase):
        closing = -vertical * math.cos(beta0)
        x = np.array(
            [
                closing * half / 2,
                closing * damping * math.pi**3 / (24 * frequency * math.sin(beta0)),
            ]
        )
        for _ in range(8):
            base, step = arc(phase, *x), 1e-4 * x
            jacobian = np.column_stack(
                [
                    (arc(phase, *(x + d)) - arc(phase, *(x - d))) / (2 * sum(d))
                    for d in np.diag(step)
                ]
            )
            change = np.linalg.solve(jacobian, base)
            x = x - change
            if abs(change[1]) < 1e-13 * abs(x[1]):
                break
        return x[1]

    fold = minimize_scalar(
        needed,
        bounds=(math.pi / 2 - 0.3, math.pi / 2 + 0.3),
        method="bounded",
        options={"xatol": 1e-4},
    )
    return fold.fun


@pytest.mark.thorough
def test_the_computed_onset_is_the_fold_found_by_continuation():
    """The reference fold in Hhat at Omega = 1, from two independent codes, checks the shooting used
    below.
    """
    assert computed_onset(1.0) == pytest.approx(0.0219879514, rel=1e-7)


def test_erratum_28_at_the_papers_highest_frequency():
    assert computed_onset(4.0) == pytest.approx(0.0029359, abs=5e-8)
    onset = high_frequency_onset(4.0, beta0=BETA, vertical=-0.5, damping=0.1)
    assert onset == pytest.approx(0.00285, abs=5e-6)
    assert onset == pytest.approx(critical_horizontal(BETA, -0.5) * 0.1 * math.pi**3 / 96)


@pytest.mark.thorough
@pytest.mark.parametrize(("order", "power"), [(1, 2), (2, 4)])
def test_erratum_28_order_of_the_relative_error(order, power):
    frequencies = (6.0, 9.0, 13.5)
    errors = [
        abs(
            high_frequency_onset(w, beta0=BETA, vertical=-0.5, damping=0.1, order=order)
            / computed_onset(w)
            - 1
        )
        for w in frequencies
    ]
    rates = np.diff(np.log(errors)) / np.diff(np.log(frequencies))
    assert rates == pytest.approx([-power, -power], abs=0.15)


@pytest.mark.parametrize(
    ("degrees", "vertical", "damping"),
    [
        (45, -0.5, 1.0),
        *(
            pytest.param(*each, marks=pytest.mark.thorough)
            for each in [(60, -0.4, 0.05), (80, -1.0, 0.3), (100, 0.7, 0.1)]
        ),
    ],
)
def test_erratum_28_second_order_at_other_angles_loads_and_dampings(degrees, vertical, damping):
    beta0 = math.radians(degrees)
    errors = []
    for w in (8.0, 16.0):
        computed = computed_onset(w, beta0, vertical, damping)
        errors.append(
            abs(
                high_frequency_onset(w, beta0=beta0, vertical=vertical, damping=damping, order=2)
                / computed
                - 1
            )
        )
    assert errors[0] < 2e-3
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.5)


def test_integrals_and_series_of_the_derivation():
    u, w, d, q = sp.symbols("u w d q", positive=True)
    parabola = u * (sp.pi - u) / 2
    speed = sp.diff(parabola, u)
    assert sp.integrate(speed**2, (u, 0, sp.pi)) == sp.pi**3 / 12
    assert sp.simplify(sp.integrate(sp.sin(u) * speed, (u, 0, sp.pi))) == 0
    assert sp.simplify(sp.integrate(sp.cos(u) * speed, (u, 0, sp.pi))) == 2
    assert (
        sp.simplify(sp.integrate(sp.cos(u) * parabola * speed, (u, 0, sp.pi)) - (12 - sp.pi**2) / 2)
        == 0
    )
    # arcs of x'' = -1 - q^2 x with x(0) = x(pi) = 0, about their middle
    arc_speed = -sp.sin(q * w) / (q * sp.cos(q * sp.pi / 2))
    loss = (
        sp.integrate(sp.sin(q * w) ** 2, (w, -sp.pi / 2, sp.pi / 2))
        / (q * sp.cos(q * sp.pi / 2)) ** 2
    )
    gain = sp.cos(q * sp.pi / 2) * (1 / (1 - q) - 1 / (1 + q)) / (q * sp.cos(q * sp.pi / 2))
    numeric = sp.Integral(-sp.sin(w) * arc_speed.subs(q, 0.3), (w, -sp.pi / 2, sp.pi / 2)).evalf()
    assert float(gain.subs(q, 0.3)) == pytest.approx(float(numeric))
    ratio = sp.series(sp.simplify(loss / gain) * 24 / sp.pi**3, q, 0, 4).removeO()
    assert sp.simplify(ratio - 1 - (sp.pi**2 / 5 - 1) * q**2) == 0
    # the damped parabola
    j = (sp.pi * sp.cosh(sp.pi * d / 2) - 2 * sp.sinh(sp.pi * d / 2) / d) / d
    exact = j * sp.sqrt(1 + d**2) / (2 * sp.cosh(sp.pi * d / 2)) * 24 / (sp.pi**3 * d)
    assert (
        sp.simplify(
            sp.series(exact, d, 0, 4).removeO() - 1 - (sp.Rational(1, 2) - sp.pi**2 / 10) * d**2
        )
        == 0
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertical": 0.5}, "stable undeformed"),
        ({"damping": 0.0}, "damping must"),
        ({"frequency": 0.5}, "high frequency"),
        ({"damping": 9.0}, "high frequency"),
        ({"order": 3}, "order must"),
        ({"beta0": 80.0}, "degrees"),
    ],
)
def test_refuses_what_is_out_of_range(changes, message):
    arguments = {"frequency": 4.0, "beta0": BETA, "vertical": -0.5, "damping": 0.1} | changes
    with pytest.raises(ParameterError, match=message):
        high_frequency_onset(arguments.pop("frequency"), **arguments)
