"""The two-layer model against the Lagrangian, and the reduced model against the two-layer one."""

import math

import numpy as np
import pytest
import sympy as sp

from saltus import TwoLayer
from saltus.systems import Harmonic, Load, Metainterface

EXAMPLE = TwoLayer(
    beta0=1.3, damping=0.2, stiffness_ratio=0.7, mass_ratio=0.4, dissipation_ratio=1.6
)
LOAD = Load(
    frequency=1.3,
    horizontal=Harmonic(0.7),
    vertical=-0.5,
    lower_horizontal=0.3,
    lower_vertical=Harmonic(0.2, phase=1.0),
    ground_horizontal=Harmonic(0.4, phase=0.3),
    ground_vertical=Harmonic(0.1, order=2),
)


@pytest.fixture
def lagrange(symbols):
    """The paper's T, Pi, R and Q (per K2) as printed, and the Euler-Lagrange residuals in theta,
    theta', theta''.
    """
    model, load, t = symbols.model(EXAMPLE), symbols.load, symbols.t
    b0, m, k, c, damping = (
        model.beta0,
        model.mass_ratio,
        model.stiffness_ratio,
        model.dissipation_ratio,
        model.damping,
    )
    q = [sp.Function("theta_1")(t), sp.Function("theta_2")(t)]
    v = [sp.diff(x, t) for x in q]
    zeta, nu = load.ground_horizontal(t), load.ground_vertical(t)
    kinetic = potential = rayleigh = sp.Integer(0)
    forces = []
    for j in (1, 2):
        angle, s = b0 - (-1) ** j * q[j - 1], (-1) ** j
        x = zeta.diff(t) + (j - 1) * sp.sin(b0 + q[0]) * v[0] + sp.sin(angle) * v[j - 1]
        y = nu.diff(t) + (j - 1) * sp.cos(b0 + q[0]) * v[0] - s * sp.cos(angle) * v[j - 1]
        kinetic += ((2 - j) * m + j - 1) * (x**2 + y**2) / 2
        potential += ((2 - j) * k + j - 1) * q[j - 1] ** 2 / 2
        rayleigh += damping * ((2 - j) * c + j - 1) * v[j - 1] ** 2 / 2
        # (1 + h)^(2-j) H, as h H is the lower channel
        h = load.horizontal(t) + (2 - j) * load.lower_horizontal(t)
        w = load.vertical(t) + (2 - j) * load.lower_vertical(t)
        forces.append(h * sp.sin(angle) - s * w * sp.cos(angle))
    lagrangian = kinetic - potential
    residuals = [
        sp.diff(sp.diff(lagrangian, v[i]), t)
        - sp.diff(lagrangian, q[i])
        + sp.diff(rayleigh, v[i])
        - forces[i]
        for i in (0, 1)
    ]
    theta, rate, second = (sp.symbols(f"{n}_1 {n}_2", real=True) for n in ("q", "v", "a"))
    names = [(sp.diff(x, t, 2), a) for x, a in zip(q, second, strict=True)]
    names += [(sp.diff(x, t), b) for x, b in zip(q, rate, strict=True)] + list(
        zip(q, theta, strict=True)
    )

    class Result:
        pass

    r = Result()
    r.model, r.load, r.t, r.theta, r.rate, r.second = model, load, t, theta, rate, second
    r.residuals = [sp.expand(e.subs(names)) for e in residuals]
    r.kinetic, r.potential, r.rayleigh = (e.subs(names) for e in (kinetic, potential, rayleigh))
    r.forces = [e.subs(names) for e in forces]
    return r


def test_energies_dissipation_and_forces_are_the_papers(lagrange, is_zero):
    model, theta, rate = lagrange.model, lagrange.theta, lagrange.rate
    assert is_zero(
        model.kinetic_energy(lagrange.t, theta, rate, 0, lagrange.load) - lagrange.kinetic
    )
    assert is_zero(model.potential_energy(theta) - lagrange.potential)
    assert is_zero(model.dissipation(rate) - lagrange.rayleigh)
    for mine, paper in zip(
        model.generalised_forces(lagrange.t, theta, lagrange.load), lagrange.forces, strict=True
    ):
        assert is_zero(mine - paper)


def test_every_entry_of_the_matrices_follows_from_the_lagrangian(lagrange, is_zero):
    model, theta, rate, second = lagrange.model, lagrange.theta, lagrange.rate, lagrange.second
    mass, drag = model.mass_matrix(theta), model.damping_matrix()
    turning, stiffness = model.velocity_matrix(theta), model.stiffness_matrix()
    force = model.load_vector(lagrange.t, theta, lagrange.load)
    zero = dict.fromkeys((*rate, *second), 0)
    for i, residual in enumerate(lagrange.residuals):
        # no product of velocities: D is all there is
        assert is_zero(sp.diff(residual, rate[0], rate[1]))
        for j in (0, 1):
            assert is_zero(sp.diff(residual, second[j]) - mass[i, j])
            assert is_zero(sp.diff(residual, rate[j]).subs(zero) - drag[i, j])
            assert is_zero(sp.diff(residual, rate[j], 2) / 2 - turning[i, j])
        at_rest = residual.subs(zero)
        assert is_zero(at_rest - sum(stiffness[i, j] * theta[j] for j in (0, 1)) + force[i])


def test_linearisation_is_the_first_order_of_the_series(lagrange, is_zero):
    model, load, t = lagrange.model, lagrange.load, lagrange.t
    small = sp.Symbol("epsilon")
    shrink = {x: small * x for x in (*lagrange.theta, *lagrange.rate, *lagrange.second)}
    mass, stiffness = model.mass_matrix(model.contact), model.linear_stiffness_matrix(t, load)
    force, drag = model.load_vector(t, model.contact, load), model.damping_matrix()
    for i, residual in enumerate(lagrange.residuals):
        grown = residual.subs(shrink, simultaneous=True)
        first = sp.diff(grown, small).subs(small, 0)
        wanted = sum(
            mass[i, j] * lagrange.second[j]
            + drag[i, j] * lagrange.rate[j]
            + stiffness[i, j] * lagrange.theta[j]
            for j in (0, 1)
        )
        assert is_zero(grown.subs(small, 0) + force[i])
        assert is_zero(first - wanted)


def test_acceleration_solves_the_matrix_equation_for_numbers_and_arrays():
    rng = np.random.default_rng(1)
    theta, velocity = rng.uniform(-1, 1, (2, 50)), rng.uniform(-2, 2, (2, 50))
    times = rng.uniform(0, 10, 50)
    batch = np.array(EXAMPLE.acceleration(times, theta, velocity, 0, LOAD))
    for n in range(50):
        q, v, t = tuple(theta[:, n]), tuple(velocity[:, n]), times[n]
        right = np.array(EXAMPLE.load_vector(t, q, LOAD)) - EXAMPLE.damping_matrix() @ v
        right = right - EXAMPLE.velocity_matrix(q) @ np.square(v) - EXAMPLE.stiffness_matrix() @ q
        expected = np.linalg.solve(EXAMPLE.mass_matrix(q), right)
        assert EXAMPLE.acceleration(t, q, v, 0, LOAD) == pytest.approx(expected, rel=1e-12)
        assert batch[:, n] == pytest.approx(expected, rel=1e-12)
    assert EXAMPLE.mass_matrix(theta).shape == (2, 2, 50)
    reactions = EXAMPLE.constraint_reactions(times, theta, velocity, batch, LOAD)
    assert np.abs(reactions).max() < 1e-11


@pytest.mark.parametrize("side", [1, -1])
def test_reduced_equation_is_the_two_layer_one_with_the_other_layer_closed(symbols, is_zero, side):
    """Symbolic: theta'' of `gov_eqn_theta_long` makes the open layer's row vanish; the closed row
    is the reaction margin.
    """
    concrete = Metainterface(
        beta0=1.3, damping=0.2, stiffness_ratio=0.7, mass_ratio=0.4, dissipation_ratio=1.6
    )
    reduced, full, load, t = (
        symbols.model(concrete),
        symbols.model(EXAMPLE),
        symbols.load,
        symbols.t,
    )
    size, speed = sp.Symbol("size", positive=True), sp.Symbol("speed", real=True)
    s = sp.Integer(side)
    theta = s * size
    second = reduced.acceleration(t, theta, speed, s, load)

    def pair(value):
        return (value, sp.Integer(0)) if side == 1 else (sp.Integer(0), value)

    reactions = full.constraint_reactions(t, pair(theta), pair(speed), pair(second), load)
    opened, closed = reactions if side == 1 else reversed(reactions)
    assert is_zero(opened)
    # erratum 21: R2 <= 0 while the lower layer is open, R1 >= 0 while the upper one is
    assert is_zero(closed + s * reduced.margins(t, theta, speed, second, s, load)["reaction"])
    difference = reduced.kinetic_energy(t, theta, speed, s, load) - full.kinetic_energy(
        t, pair(theta), pair(speed), 0, load
    )
    assert is_zero(difference)


@pytest.mark.parametrize("side", [1, -1])
def test_erratum_21_reaction_fails_right_after_a_fast_crossing(side):
    """At theta = 0+ in free motion the second row asks for theta'^2 <= -V sin(beta0): 0.70 at 80
    deg and V = -0.5.
    """
    beta0, vertical = math.radians(80), -0.5
    model, load = Metainterface(beta0=beta0), Load(vertical=vertical)

    def margin(speed):
        second = model.acceleration(0.0, 0.0, side * speed, side, load)
        return float(model.margins(0.0, 0.0, side * speed, second, side, load)["reaction"])

    onset = math.sqrt(-vertical * math.sin(beta0))
    assert onset == pytest.approx(0.70, abs=0.005)
    assert margin(onset) == pytest.approx(0.0, abs=1e-15)
    assert margin(onset - 1e-6) > 0 > margin(onset + 1e-6)


def test_free_undamped_motion_conserves_energy_to_first_order():
    """T + Pi - work potential of a constant load has no rate along theta'', at random states."""
    model = TwoLayer(beta0=1.3, mass_ratio=0.4, stiffness_ratio=0.7)
    load = Load(vertical=-0.5, horizontal=0.3, lower_vertical=0.2)
    rng = np.random.default_rng(2)
    step = 1e-5
    for _ in range(20):
        q, v = rng.uniform(-0.8, 0.8, 2), rng.uniform(-1, 1, 2)
        a = np.array(model.acceleration(0.0, q, v, 0, load))
        power = float(np.dot(model.generalised_forces(0.0, q, load), v))

        def energy(shift, q=q, v=v, a=a):
            velocity = v + a * shift
            position = q + v * shift + a * shift**2 / 2
            return model.kinetic_energy(0.0, position, velocity, 0, load) + model.potential_energy(
                position
            )

        assert (energy(step) - energy(-step)) / (2 * step) == pytest.approx(power, abs=1e-7)


def test_its_contract_is_a_model_with_a_contact_of_each_layer_that_stops_at_the_kinematic_limits():
    assert EXAMPLE.sides == ()
    assert [(contact.name, contact.coordinate, contact.sign) for contact in EXAMPLE.contacts] == [
        ("lower", "theta_1", 1),
        ("upper", "theta_2", -1),
    ]
    assert EXAMPLE.coordinates == ("theta_1", "theta_2")
    assert EXAMPLE.channels == Metainterface.channels
    margins = EXAMPLE.margins(0.0, (0.2, -0.3), (0.0, 0.0), (0.0, 0.0), 0, LOAD)
    assert set(EXAMPLE.stops) <= set(margins)
    limit = math.pi - EXAMPLE.beta0
    past = EXAMPLE.margins(0.0, (limit + 0.1, -2 * limit - 0.1), (0.0, 0.0), (0.0, 0.0), 0, LOAD)
    assert past["lower_line_limit"] < 0 < past["lower_kinematic_limit"]
    assert past["upper_kinematic_limit"] < 0


def test_massless_middle_has_a_singular_mass_matrix_where_the_bars_are_parallel():
    """det M = m + sin(beta_1 + beta_2)^2, so only m = 0 fails, and only where beta_1 + beta_2 =
    pi.
    """
    beta0 = math.radians(80)
    theta = (math.radians(5), -math.radians(15))
    for m in (0.0, 0.3):
        assert np.linalg.det(
            TwoLayer(beta0=beta0, mass_ratio=m).mass_matrix(theta)
        ) == pytest.approx(m, abs=1e-15)
