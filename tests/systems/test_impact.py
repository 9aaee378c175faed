"""Impact laws: velocities and energies after an impact, and errata 5, 7, 25, 26."""

import math
import warnings

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from saltus import InelasticImpact, TwoLayer
from saltus.errors import ParameterError
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    RockingBlock,
    VelocityReduction,
    WallOscillator,
)

angle = st.floats(0.1, 3.0)
mass = st.floats(0, 3)
side = st.sampled_from([1, -1])
rate = st.floats(-1, 1)
speed = st.floats(0.05, 3)


def ground(zeta, nu):
    """A load whose ground velocities are zeta' and nu' at t = 0."""
    return Load(frequency=1.0, ground_horizontal=Harmonic(zeta), ground_vertical=Harmonic(nu))


def energy(m, beta0, v, s, zeta, nu):
    """Kinetic energy at theta = 0 as erratum 5 writes it."""
    moving = (zeta + v * math.sin(beta0)) ** 2 + (nu + s * v * math.cos(beta0)) ** 2
    return (1 + m) / 2 * moving if s == 1 else m / 2 * (zeta**2 + nu**2) + moving / 2


def printed_energy(beta0, v, zeta, nu):
    """The bracket of the printed `rest_def_vel`, with one sign of nu' for both sides."""
    return (zeta + v * math.sin(beta0)) ** 2 + (nu + v * math.cos(beta0)) ** 2


@settings(deadline=None)
@given(angle, mass, side, speed, rate, rate)
def test_kinetic_energy_at_contact_is_that_of_erratum_5_and_of_two_layers(beta0, m, s, v, zeta, nu):
    found = Metainterface(beta0=beta0, mass_ratio=m).kinetic_energy(
        0.0, 0.0, -s * v, s, ground(zeta, nu)
    )
    assert found == pytest.approx(energy(m, beta0, -s * v, s, zeta, nu), abs=1e-12)
    velocities = (-s * v, 0.0) if s == 1 else (0.0, -s * v)
    both = TwoLayer(beta0=beta0, mass_ratio=m).kinetic_energy(
        0.0, (0.0, 0.0), velocities, 0, ground(zeta, nu)
    )
    assert found == pytest.approx(both, abs=1e-12)


@settings(deadline=None)
@given(angle, side, speed, st.floats(0.05, 1), rate, rate, mass)
def test_erratum_5_energy_decreases_exactly_under_the_corrected_conditions(
    beta0, s, size, e, zeta, nu, m
):
    """sigma = +1 coming from lower: v the velocity before, e v after; m = 0 and general m, both
    ways.
    """
    v = -s * size  # the impacting layer closes
    sine, cosine = math.sin(beta0), math.cos(beta0)
    load = ground(zeta, nu)
    plain, heavy = Metainterface(beta0=beta0), Metainterface(beta0=beta0, mass_ratio=m)

    def lost(model):
        return model.kinetic_energy(0.0, 0.0, v, s, load) - model.kinetic_energy(
            0.0, 0.0, e * v, -s, load
        )

    no_mass = v * ((1 - e**2) * v + 2 * (1 - e) * sine * zeta + 2 * s * (1 + e) * cosine * nu)
    assert 2 * lost(plain) == pytest.approx(no_mass, abs=1e-12)
    if s == 1:
        general = (1 + m - e**2) * v**2 + 2 * v * (
            (1 + m - e) * sine * zeta + (1 + m + e) * cosine * nu
        )
    else:
        f = (1 + m) * e
        general = (1 - f * e) * v**2 + 2 * v * ((1 - f) * sine * zeta - (1 + f) * cosine * nu)
    assert 2 * lost(heavy) == pytest.approx(general, abs=1e-11)


@settings(deadline=None)
@given(angle, side, speed, rate, st.floats(0.1, 1))
def test_erratum_5_a_vertical_ground_velocity_changes_the_energy_even_at_e_1(beta0, s, size, nu, e):
    """T(-) - T(+) = 2 sigma v nu' cos(beta0) at e = 1 and m = 0, where the printed restitution is
    1.
    """
    v = -s * size
    model = Metainterface(beta0=beta0)
    load = ground(0.0, nu)
    before, after = (model.kinetic_energy(0.0, 0.0, v, x, load) for x in (s, -s))
    assert before - after == pytest.approx(2 * s * v * nu * math.cos(beta0), abs=1e-12)
    printed = printed_energy(beta0, v, 0.0, nu) / printed_energy(beta0, v, 0.0, nu)
    assert printed == 1.0
    assume(abs(v * nu * math.cos(beta0)) > 1e-3)
    assert after / before != pytest.approx(printed, abs=1e-6)


def test_erratum_5_printed_condition_misjudges_a_gain_of_energy():
    """From the lower layer with nu' of one sign, the printed condition says loss where the energy
    grows.
    """
    beta0, v, e, nu = math.radians(60), -1.0, 0.9, 0.5
    model, load = Metainterface(beta0=beta0), ground(0.0, nu)
    gained = model.kinetic_energy(0.0, 0.0, e * v, -1, load) > model.kinetic_energy(
        0.0, 0.0, v, 1, load
    )
    printed_says_loss = ((1 + e) * v + 2 * nu * math.cos(beta0)) * v > 0
    assert gained
    assert printed_says_loss


def admissible_roots(m, beta0, v, s, zeta, nu, r):
    """All v+ of the sign of v- with T+ = r T-, by the companion matrix of the quadratic written out
    from erratum 5.
    """
    new, scale = -s, (1 + m) / 2 if s == -1 else 0.5
    constant = zeta**2 + nu**2
    extra = m / 2 * constant if new == -1 else 0.0
    target = r * energy(m, beta0, v, s, zeta, nu)
    linear = 2 * (zeta * math.sin(beta0) + new * nu * math.cos(beta0))
    roots = np.roots([scale, scale * linear, scale * constant + extra - target])
    return [x.real for x in roots if abs(x.imag) < 1e-12 and x.real * v > 0]


@settings(deadline=None)
@given(angle, mass, side, speed, rate, rate, st.floats(0.05, 1.0))
@example(1.4, 0.0, 1, 0.05, 0.9, 0.3, 0.5)
def test_erratum_26_energy_restitution_keeps_its_ratio_or_says_that_it_cannot(
    beta0, m, s, size, zeta, nu, r
):
    """The ratio of energies is r and the sign is kept; NaN, without a warning, exactly where no
    root has that sign.
    """
    v = -s * size
    model, load = Metainterface(beta0=beta0, mass_ratio=m), ground(zeta, nu)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        after = float(EnergyRestitution(r).velocity_after(model, 0.0, v, s, -s, load))
    roots = admissible_roots(m, beta0, v, s, zeta, nu, r)
    if roots:
        assume(min(map(abs, roots)) > 1e-6)  # not at the border of solvability
    if math.isnan(after):
        assert not roots
    else:
        assert after * v > 0
        assert energy(m, beta0, after, -s, zeta, nu) == pytest.approx(
            r * energy(m, beta0, v, s, zeta, nu), rel=1e-9, abs=1e-12
        )
        assert min(abs(after - x) for x in roots) < 1e-7


def test_erratum_26_a_slow_impact_on_a_moving_ground_has_no_solution():
    """With r < 1 and v- -> 0 the energy r T- lies below that of v+ = 0 on a ground in motion: no v+
    of the sign of v-.
    """
    model, load = Metainterface(beta0=1.4), ground(0.5, 0.0)
    law = EnergyRestitution(0.8)
    slow = float(law.velocity_after(model, 0.0, 0.01, -1, 1, load))
    fast = float(law.velocity_after(model, 0.0, 2.0, -1, 1, load))
    assert math.isnan(slow)
    assert 0 < fast < 2.0
    still = float(law.velocity_after(model, 0.0, 0.01, -1, 1, Load()))
    # a ground at rest always allows it: r = e^2
    assert still == pytest.approx(math.sqrt(0.8) * 0.01)


@settings(deadline=None)
@given(angle, side, st.floats(-3, 3), rate)
def test_restitution_1_keeps_the_velocity_on_a_ground_moving_sideways(beta0, s, v, zeta):
    """m = 0 and nu' = 0: both sides have one T, so v+ = v- is the root on the side of its minimum
    where v- lies.
    """
    assume(abs(v) > 1e-3)
    assume(abs(v + zeta * math.sin(beta0)) > 1e-3)
    model = Metainterface(beta0=beta0)
    after = EnergyRestitution(1.0).velocity_after(model, 0.0, v, s, -s, ground(zeta, 0.0))
    assert float(after) == pytest.approx(v, rel=1e-9)


@settings(deadline=None)
@given(angle, mass, speed, st.floats(0.05, 1))
def test_erratum_7_energy_restitution_changes_the_velocity_by_the_root_of_the_mass(beta0, m, v, r):
    """On a ground at rest v+ / v- = sqrt(r (1+m)) from lower to upper, and sqrt(r / (1+m)) back."""
    model, law = Metainterface(beta0=beta0, mass_ratio=m), EnergyRestitution(r)
    up, down = (
        float(law.velocity_after(model, 0.0, -s * v, s, -s, Load())) / (-s * v) for s in (1, -1)
    )
    assert up == pytest.approx(math.sqrt(r * (1 + m)), rel=1e-12)
    assert down == pytest.approx(math.sqrt(r / (1 + m)), rel=1e-12)


@given(st.floats(0, 1), rate, side)
def test_velocity_reduction_multiplies_the_velocity(e, v, s):
    assert (
        VelocityReduction(e).velocity_after(Metainterface(beta0=1.0), 0.0, v, s, -s, Load())
        == e * v
    )
    assert Metainterface(beta0=1.0).reset(0.0, v, s, Load(), VelocityReduction(e)) == (-s, e * v)


@settings(deadline=None)
@given(st.floats(math.pi / 4 + 0.01, 3 * math.pi / 4 - 0.01), mass, side, speed, rate, rate)
def test_erratum_25_inelastic_impact_keeps_the_momentum_of_the_layer_not_hit(
    beta0, m, s, size, zeta, nu
):
    """The row of M of the opening layer, [[p_j]] = 0, with the closing layer stopped; the ground's
    velocity cancels.
    """
    v = -s * size
    model, load = Metainterface(beta0=beta0, mass_ratio=m), ground(zeta, nu)
    after = float(InelasticImpact().velocity_after(model, 0.0, v, s, -s, load))
    both = TwoLayer(beta0=beta0, mass_ratio=m)
    i, j = (0, 1) if s == 1 else (1, 0)

    def momentum(own, other):
        """d T / d theta_j' by a central difference, exact for a quadratic."""

        def kinetic(change):
            velocities = [0.0, 0.0]
            velocities[i], velocities[j] = own, other + change
            return both.kinetic_energy(0.0, (0.0, 0.0), velocities, 0, load)

        return (kinetic(0.5) - kinetic(-0.5)) / 1.0

    assert after * v > 0
    assert momentum(0.0, after) == pytest.approx(momentum(v, 0.0), abs=1e-12)
    expected = -math.cos(2 * beta0) * v / (1 if s == 1 else 1 + m)
    assert after == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("degrees", [20.0, 44.9, 135.1, 170.0])
def test_erratum_25_outside_45_to_135_degrees_an_inelastic_impact_stops_the_motion(degrees):
    model = Metainterface(beta0=math.radians(degrees))
    for s in (1, -1):
        assert float(InelasticImpact().velocity_after(model, 0.0, -s * 1.0, s, -s, Load())) == 0.0


@pytest.mark.parametrize("alpha", [0.1, 0.4, 0.8])
def test_a_block_that_rocks_keeps_its_angular_momentum_about_the_new_corner(alpha):
    """Housner: I_O = (4/3) M R^2, (I_O - 2 M R^2 sin(alpha)^2) v- = I_O v+; and it stops where that
    would turn it back.
    """
    block = RockingBlock(alpha=alpha)
    factor = max((4 / 3 - 2 * math.sin(alpha) ** 2) / (4 / 3), 0.0)
    assert float(
        InelasticImpact().velocity_after(block, 0.0, -0.7, 1, -1, Load())
    ) == pytest.approx(-0.7 * factor)


def test_a_wall_turns_the_velocity_round_with_either_law():
    wall = WallOscillator(stiffness=1.0, damping=0.1, wall=1.0)
    assert wall.reset(0.0, 0.6, 1, Load(), VelocityReduction(0.8)) == (1, pytest.approx(-0.48))
    next_side, after = wall.reset(0.0, 0.6, 1, Load(), EnergyRestitution(0.64))
    assert (next_side, float(after)) == (1, pytest.approx(-0.48))
    with pytest.raises(ParameterError, match="WallOscillator defines no inelastic_factor"):
        wall.reset(0.0, 0.6, 1, Load(), InelasticImpact())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: VelocityReduction(1.1), r"e must lie in \[0, 1\], got 1.1"),
        (lambda: VelocityReduction(-0.1), "e must"),
        (lambda: VelocityReduction(math.nan), "e must"),
        (lambda: VelocityReduction("1"), "e must be a number"),
        (lambda: EnergyRestitution(0.0), r"r must lie in \(0, 1\], got 0.0"),
        (lambda: EnergyRestitution(-1.0), "r must"),
    ],
)
def test_impossible_laws_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()
