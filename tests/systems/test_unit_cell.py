"""The unit cell: its geometry drawn and measured, the two angle measures, and errata 1, 2, 3, 19,
20.
"""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus import UnitCell
from saltus.errors import ParameterError

CELL = UnitCell(alpha0=math.radians(40), beta0=math.radians(80))
share = st.floats(0.02, 0.98)


@st.composite
def cells(draw):
    beta0 = math.pi * draw(share)
    return UnitCell(beta0=beta0, alpha0=(math.pi - beta0) * draw(share))


def length(layout, pair):
    return np.linalg.norm(np.diff(layout.segment(pair), axis=0))


@settings(deadline=None)
@given(
    cells(), st.floats(0, 1), st.floats(0, 1), st.sampled_from([(1, 1), (-1, 1), (1, -1), (-1, -1)])
)
def test_every_bar_keeps_its_length_and_every_slider_jumps_transversely(cell, first, second, signs):
    theta = (first * cell.kinematic_limit, -second * cell.kinematic_limit)
    layout = cell.layout(*theta, misaligned=signs)
    start = cell.layout()
    size = max(1.0, cell.base, cell.lambda_)
    for pair in layout.bars:
        assert length(layout, pair) == pytest.approx(length(start, pair), abs=1e-9 * size)
    assert length(layout, ("lower_left", "middle_left")) == pytest.approx(1.0)
    for angle, (a, d), (b, c) in zip(theta, layout.diagonals, layout.sliders, strict=True):
        p, q, r, s = (layout.points[name] for name in (a, b, c, d))
        # sqrt of rounding at the closed slider
        assert np.dot(r - q, q - p) == pytest.approx(0.0, abs=1e-6 * size**2)
        assert (q - p) == pytest.approx(s - r, abs=1e-9 * size)  # halves stay parallel and equal
        jump = np.linalg.norm(r - q)
        assert jump == pytest.approx(2 * cell.lambda_ * math.tan(cell.phi(angle)), abs=1e-7 * size)


@settings(deadline=None)
@given(cells(), st.floats(0, 1), st.floats(0, 1))
def test_masses_are_at_the_coordinates_of_the_paper(cell, first, second):
    """x_1 = xi_1 - sin(alpha0 - beta0) / (2 sin(alpha0)), x_2 - x_1 = xi_2 + cos(beta0), y_1 =
    eta_1, ... (`displ_ratio2`).
    """
    theta = (first * cell.kinematic_limit, -second * cell.kinematic_limit)
    layout = cell.layout(*theta)
    size = max(1.0, cell.base)
    offset = math.sin(cell.alpha0 - cell.beta0) / (2 * math.sin(cell.alpha0))
    assert layout.points["mass_1"] == pytest.approx(
        [cell.xi(theta[0]) - offset, cell.eta(theta[0])], abs=1e-12 * size
    )
    step = layout.points["mass_2"] - layout.points["mass_1"]
    assert step == pytest.approx(
        [cell.xi(theta[1]) + math.cos(cell.beta0), cell.eta(theta[1])], abs=1e-12 * size
    )
    assert layout.points["mass_1"] == pytest.approx(
        (layout.points["middle_left"] + layout.points["middle_right"]) / 2
    )
    assert layout.points["mass_2"] == pytest.approx(
        (layout.points["upper_left"] + layout.points["upper_right"]) / 2
    )


@settings(deadline=None)
@given(cells(), st.floats(1e-3, 0.999), st.sampled_from([1, 2]))
def test_both_angle_measures_give_each_other(cell, part, layer):
    sign = 1 if layer == 1 else -1
    for past_line in (False, True):
        size = part * cell.line_limit + past_line * (
            cell.kinematic_limit - 2 * part * cell.line_limit
        )
        theta = sign * size
        phi = cell.phi(theta)
        assert cell.theta(phi, layer=layer, past_line=past_line) == pytest.approx(theta, abs=1e-6)
        assert cell.beta_of_phi(phi) == pytest.approx(
            min(cell.beta(theta), 2 * math.pi - cell.beta(theta)), abs=1e-6
        )
        assert cell.alpha_of_phi(phi) == pytest.approx(cell.alpha(theta), abs=1e-6)
        back = cell.phi(cell.theta(phi, layer=layer, past_line=past_line))
        assert back == pytest.approx(phi, abs=1e-6)


@settings(deadline=None)
@given(cells())
def test_erratum_1_chi_is_half_the_printed_one(cell):
    printed = math.sin(2 * cell.alpha0 + cell.beta0) / math.sin(cell.alpha0 + cell.beta0)
    at_rest = cell.psi / (2 * cell.lambda_)
    assert math.cos(cell.alpha0) == pytest.approx(at_rest + cell.chi, abs=1e-9 * (1 + at_rest))
    assert cell.psi == pytest.approx(2 * cell.lambda_**2 / cell.base)  # so psi has sin(beta0)^2
    wrong = at_rest + printed - math.cos(cell.alpha0)
    assert wrong == pytest.approx(printed / 2, abs=1e-9 * (1 + at_rest + abs(printed)))


def test_erratum_1_printed_chi_and_the_other_reading_of_psi_miss_the_undeformed_cell():
    printed = math.sin(2 * CELL.alpha0 + CELL.beta0) / math.sin(CELL.alpha0 + CELL.beta0)
    assert math.degrees(math.acos(CELL.psi / (2 * CELL.lambda_) + CELL.chi)) == pytest.approx(40.0)
    assert abs(math.degrees(math.acos(CELL.psi / (2 * CELL.lambda_) + printed)) - 40.0) > 1.0
    other = math.sin(CELL.beta0**2) / (
        2 * math.sin(CELL.alpha0) * math.sin(CELL.alpha0 + CELL.beta0)
    )
    assert abs(math.acos(other / (2 * CELL.lambda_) + CELL.chi) - CELL.alpha0) > 0.01


def test_erratum_2_the_sign_of_theta_is_that_of_the_inequalities():
    """beta_j only grows, so theta_1 >= 0 >= theta_2 needs theta_j = -(-1)^j (beta_j - beta0)."""
    phi = 0.3
    opening = CELL.beta_of_phi(phi) - CELL.beta0
    assert opening > 0
    printed = {j: (-1) ** j * opening for j in (1, 2)}
    assert printed[1] < 0 < printed[2]  # against theta_conditions
    assert CELL.theta(phi, layer=1) == pytest.approx(opening) == -CELL.theta(phi, layer=2)
    # the velocity of the first mass that kin_eng uses, sin(beta0 + theta_1) theta_1', needs it too
    theta, step = CELL.theta(phi, layer=1), 1e-6
    slope = (
        CELL.layout(theta + step).points["mass_1"] - CELL.layout(theta - step).points["mass_1"]
    ) / (2 * step)
    assert slope == pytest.approx(
        [math.sin(CELL.beta0 + theta), math.cos(CELL.beta0 + theta)], abs=1e-9
    )


@pytest.mark.parametrize("theta", [0.4, -0.4, 1.5, -1.5])
def test_erratum_3_alpha_is_the_angle_of_the_diagonal_and_the_printed_one_is_not(theta):
    j = 1 if theta > 0 else 2
    layout = CELL.layout(max(theta, 0.0), min(theta, 0.0))
    start, end = (layout.points[name] for name in layout.diagonals[j - 1])
    across, up = end - start
    measured = math.atan2(up, across if j == 1 else -across)
    assert CELL.alpha(theta) == pytest.approx(measured, abs=1e-12)
    lowered = math.cos(CELL.beta0) - math.cos(CELL.beta0 + (-1) ** j * theta)
    ratio = (lowered + CELL.psi) / CELL.psi
    if ratio > 0:
        secant = (
            math.sqrt(ratio) * 2 * CELL.lambda_ / (lowered + 4 * CELL.lambda_ * CELL.chi + CELL.psi)
        )
        assert abs(secant) < 1 or abs(math.acos(1 / secant) - measured) > 0.05


def test_erratum_19_the_line_is_at_100_degrees_for_80():
    assert math.degrees(CELL.line_limit) == pytest.approx(100.0)
    assert CELL.line_condition() == CELL.line_limit
    assert CELL.eta(CELL.line_limit) == pytest.approx(0.0, abs=1e-15)
    flat = CELL.layout(CELL.line_limit)
    assert flat.points["middle_left"] == pytest.approx([1.0, 0.0], abs=1e-15)
    assert abs(CELL.eta(math.radians(110))) > 0.1  # the printed angle is no line


def test_erratum_20_the_slider_closes_again_at_200_degrees():
    limit = CELL.kinematic_limit
    assert math.degrees(limit) == pytest.approx(200.0)
    assert CELL.phi(limit) == pytest.approx(0.0, abs=1e-7)
    assert CELL.phi(limit - 0.01) > 0.01
    assert math.cos(CELL.beta(limit + 0.01)) > math.cos(CELL.beta0)  # no real phi past it
    with pytest.raises(ParameterError, match=r"kinematic limit 2 \(pi - beta0\) = 3.49066 rad"):
        CELL.phi(limit + 0.01)
    with pytest.raises(ParameterError, match=r"theta_2 must lie in \[-3.49066, 0\] rad"):
        CELL.layout(0.0, -limit - 0.01)
    for n in (2, 3):
        assert n * math.pi - CELL.beta0 > limit  # every further line condition lies past it
        with pytest.raises(ParameterError, match="only n = 1"):
            CELL.line_condition(n)


@settings(deadline=None)
@given(cells())
def test_displacement_and_misalignment_are_largest_on_the_line(cell):
    theta = np.linspace(0, cell.kinematic_limit, 401)
    for sign in (1, -1):
        assert np.abs(cell.xi(sign * theta)).max() == pytest.approx(cell.max_displacement, rel=1e-4)
        assert np.all(np.abs(cell.xi(sign * theta)) <= cell.max_displacement + 1e-12)
        assert np.all(cell.phi(sign * theta) <= cell.max_misalignment + 1e-12)
    assert abs(cell.xi(cell.line_limit)) == pytest.approx(cell.max_displacement, abs=1e-12)
    assert cell.phi(cell.line_limit) == pytest.approx(cell.max_misalignment, abs=1e-9)


def test_small_theta_is_quadratic_in_phi():
    """abs(theta) / phi^2 -> psi / sin(beta0), with an error of second order in phi."""
    coefficient = CELL.psi / math.sin(CELL.beta0)
    errors = [abs(CELL.theta(phi) / phi**2 - coefficient) for phi in (1e-1, 1e-2)]
    assert errors[0] < 0.05
    assert errors[1] == pytest.approx(errors[0] / 100, rel=0.1)
    for theta in (1e-8, -1e-8):
        assert CELL.phi(theta) == pytest.approx(CELL.small_phi(theta), rel=1e-7)


def test_rate_of_phi_diverges_at_an_impact_like_the_inverse_root():
    """phi' abs(phi) -> abs(theta)' sin(beta0) / (2 psi): with theta' finite, phi' grows 10-fold as
    theta falls 100-fold.
    """
    theta = np.array([1e-4, 1e-6, 1e-8, 1e-10])
    for sign in (1, -1):
        rate = CELL.phi_velocity(sign * theta, -sign * 0.5)
        assert np.all(rate < 0)
        assert rate[1:] / rate[:-1] == pytest.approx([10, 10, 10], rel=1e-3)
        product = rate * CELL.phi(sign * theta)
        assert product[-1] == pytest.approx(-0.5 * math.sin(CELL.beta0) / (2 * CELL.psi), rel=1e-9)
    assert CELL.phi_velocity(0.0, -0.5) == -math.inf
    assert CELL.phi_velocity(0.0, 0.5) == math.inf
    assert CELL.phi_velocity(0.0, 0.0) == 0.0


@pytest.mark.parametrize("theta", [0.01, -0.3, 1.2, -2.5])
def test_rate_of_phi_is_the_derivative_of_phi(theta):
    with mpmath.workdps(40):
        b0, psi = mpmath.mpf(CELL.beta0), mpmath.mpf(CELL.psi)

        def phi(x):
            return mpmath.atan(mpmath.sqrt((mpmath.cos(b0) - mpmath.cos(b0 + abs(x))) / psi))

        assert CELL.phi(theta) == pytest.approx(float(phi(mpmath.mpf(theta))), rel=1e-13)
        assert CELL.phi_velocity(theta, 0.7) == pytest.approx(
            float(0.7 * mpmath.diff(phi, theta)), rel=1e-12
        )


def test_functions_take_arrays_and_agree_with_numbers():
    theta = np.linspace(-1.5, 1.5, 7).reshape(7, 1)
    for name in ("alpha", "beta", "phi", "xi", "eta"):
        whole = getattr(CELL, name)(theta)
        assert whole.shape == (7, 1)
        assert whole[2, 0] == pytest.approx(getattr(CELL, name)(float(theta[2, 0])))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"alpha0": 40.0, "beta0": 1.0},
            r"alpha0 must lie in \(0, pi\) rad, got 40.0 \(degrees\?\)",
        ),
        ({"alpha0": 0.0, "beta0": 1.0}, "alpha0 must lie in"),
        ({"alpha0": 1.0, "beta0": math.nan}, "beta0 must lie in"),
        ({"alpha0": 2.0, "beta0": 2.0}, r"alpha0 \+ beta0 must lie below pi rad, got 2.0 \+ 2.0"),
    ],
)
def test_impossible_cells_are_refused(fields, message):
    with pytest.raises(ParameterError, match=message):
        UnitCell(**fields)


def test_impossible_configurations_are_refused():
    with pytest.raises(ParameterError, match=r"theta_1 must lie in \[0, .*\] rad, got -0.1"):
        CELL.layout(-0.1, 0.0)
    with pytest.raises(ParameterError, match=r"theta_2 must lie in \[-.*, 0\] rad, got 0.1"):
        CELL.layout(0.1, 0.1)
    with pytest.raises(ParameterError, match=r"abs\(phi\) must lie in"):
        CELL.beta_of_phi(CELL.max_misalignment + 0.01)
    with pytest.raises(ParameterError, match="layer must be 1"):
        CELL.theta(0.1, layer=3)
    with pytest.raises(ParameterError, match="no SI data"):
        CELL.metainterface()
