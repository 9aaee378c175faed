"""Models from expressions of SymPy move as the same equations written by hand, and go to files and
to other processes.
"""

import pickle
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus.errors import ParameterError

sympy = pytest.importorskip("sympy")
mechanics = pytest.importorskip("sympy.physics.mechanics")


def wall(e=0.5):
    """A ball on a spring that bounces from a stop at x = d."""
    x, v, k, d, F = sympy.symbols("x v k d F")
    model = saltus.from_sympy(
        coordinates=[x],
        velocities=[v],
        force=[F - k * x],
        parameters={k: 4.0, d: 0.5},
        channels={"force": F},
        contacts=[saltus.Contact(name="stop", coordinate="x", sign=-1, position=d)],
        name="StoppedMass",
    )
    return saltus.System(model=model, load=saltus.Load(force=0.25), impact=saltus.NewtonImpact(e=e))


def test_a_model_with_a_stop_hits_it_at_the_instant_of_its_closed_form():
    """From x = -1/2 about x_0 = F / k = 1/16 with w = 2: x = x_0 + (x(0) - x_0) cos(2 t) reaches d
    = 1/2 as cos(2 t) = -7/9.
    """
    motion = saltus.simulate(wall(), x=-0.5, velocity=0.0, duration=2.0)
    first = np.arccos(-7 / 9) / 2
    assert motion.impacts.time[0] == pytest.approx(first, abs=1e-12)
    speed = 2 * (9 / 16) * np.sin(2 * first)
    assert motion.impacts.velocity_before[0] == pytest.approx(speed, abs=1e-12)
    assert motion.impacts.velocity_after[0] == pytest.approx(-0.5 * speed, abs=1e-12)
    assert wall().parameters["model.d"] == 0.5


def test_a_model_goes_to_files_and_to_other_processes():
    system = wall()
    assert saltus.System.from_json(system.to_json()) == system
    again = pickle.loads(pickle.dumps(system))
    assert again == system
    assert system.with_({"model.d": 0.25}).model.contacts[0].position == 0.25


def double_pendulum():
    """Two masses m on massless bars of length 1 under gravity g, by Lagrange's equations."""
    one, other = mechanics.dynamicsymbols("one other")
    t, g, m = mechanics.dynamicsymbols._t, *sympy.symbols("g m")
    place = [sympy.sin(one), -sympy.cos(one)]
    second = [place[0] + sympy.sin(other), place[1] - sympy.cos(other)]
    speeds = [sum(x.diff(t) ** 2 for x in each) for each in (place, second)]
    method = mechanics.LagrangesMethod(
        m * sum(speeds) / 2 - m * g * (place[1] + second[1]), [one, other]
    )
    method.form_lagranges_equations()
    return saltus.from_sympy(method, parameters={g: 9.81, m: 2.0}, name="DoublePendulum")


def test_lagranges_equations_keep_the_energy_and_are_those_written_by_hand():
    model = double_pendulum()
    system = saltus.System(model=model)
    theta, velocity = (0.4, -0.7), (0.3, 1.1)
    by_hand = np.array([[2.0, np.cos(1.1)], [np.cos(1.1), 1.0]])
    pull = [
        -1.1 * 1.1 * np.sin(1.1) - 2 * 9.81 * np.sin(0.4),
        0.3 * 0.3 * np.sin(1.1) + 9.81 * np.sin(0.7),
    ]
    expected = np.linalg.solve(by_hand, pull)
    np.testing.assert_allclose(
        model.acceleration(0.0, theta, velocity, 1, system.load), expected, rtol=0, atol=1e-12
    )
    motion = saltus.simulate(system, one=0.4, other=-0.7, velocity=velocity, duration=10.0)
    (a, b), (u, v) = motion.at(np.linspace(0.0, 10.0, 60))
    energy = 2.0 * (u * u + v * v / 2 + u * v * np.cos(a - b)) - 2.0 * 9.81 * (
        2 * np.cos(a) + np.cos(b)
    )
    np.testing.assert_allclose(energy, energy[0], rtol=0, atol=1e-9)


def test_kanes_equations_with_rates_as_speeds_are_taken():
    x, u = mechanics.dynamicsymbols("x u")
    k, frame, point = sympy.symbols("k"), mechanics.ReferenceFrame("N"), mechanics.Point("P")
    point.set_vel(frame, u * frame.x)
    body = mechanics.Particle("ball", point, 1)
    method = mechanics.KanesMethod(frame, [x], [u], kd_eqs=[x.diff() - u])
    method.kanes_equations([body], [(point, -k * x * frame.x)])
    system = saltus.System(model=saltus.from_sympy(method, parameters={k: 9.0}, name="Kane"))
    assert saltus.simulate(system, x=0.2, velocity=0.0, duration=1.0).position == pytest.approx(
        0.2 * np.cos(3.0), abs=1e-12
    )


def test_other_equations_are_another_model():
    """A file of the first of two systems is read as that system, whether they are named or not."""
    x, v, k = sympy.symbols("x v k")
    asked = {"coordinates": [x], "velocities": [v], "parameters": {k: 2.0}}
    linear, cubic = (
        saltus.System(model=saltus.from_sympy(**asked, force=[-k * x**n])) for n in (1, 3)
    )
    again = saltus.from_sympy(**asked | {"parameters": {k: 3.0}}, force=[-k * x])
    assert type(again) is type(linear.model) is not type(cubic.model)
    for system, force in ((linear, -1.0), (cubic, -0.25)):
        read = saltus.System.from_json(system.to_json())
        assert read == system
        assert read.model.force(0.0, 0.5, 0.0, read.load) == force
    saltus.from_sympy(**asked, force=[-k * x], name="OneName")
    with pytest.raises(
        ParameterError, match="there is a model 'OneName' with other equations already"
    ):
        saltus.from_sympy(**asked, force=[-k * x**3], name="OneName")


def test_what_an_expression_may_not_have_is_refused():
    x, v, k, z = sympy.symbols("x v k z")
    with pytest.raises(ParameterError, match="force has 'z', which is none of x, v, k"):
        saltus.from_sympy(coordinates=[x], velocities=[v], force=[-k * x + z], parameters={k: 1.0})
    with pytest.raises(
        ParameterError, match="velocities must have the rate of each coordinate, and x has none"
    ):
        saltus.from_sympy(coordinates=[x], force=[-k * x], parameters={k: 1.0})
    with pytest.raises(
        ParameterError, match="there is a model 'TwoStops' with other equations already"
    ):
        saltus.from_sympy(
            coordinates=[x], velocities=[v], force=[-k * x], parameters={k: 1.0}, name="TwoStops"
        )
    with pytest.raises(ParameterError, match="mass has"):
        saltus.from_sympy(
            coordinates=[x], velocities=[v], mass=[[1 + v]], force=[-k * x], parameters={k: 1.0}
        )
    with pytest.raises(
        ParameterError, match="1 coordinates need a mass matrix of 1 rows and 1 forces"
    ):
        saltus.from_sympy(coordinates=[x], velocities=[v], force=[-k * x, 0], parameters={k: 1.0})
    for wrong in (
        {"coordinates": "x"},
        {"parameters": 3},
        {"channels": {"force": 3}},
        {"name": ""},
    ):
        with pytest.raises(ParameterError, match=f"{next(iter(wrong))} must be"):
            saltus.from_sympy(
                **{"coordinates": [x], "velocities": [v], "force": [-x], "parameters": {}} | wrong
            )
    with pytest.raises(
        ParameterError, match="equations must be a LagrangesMethod or a KanesMethod"
    ):
        saltus.from_sympy(3, parameters={})


# --- switches ----------------------------------------------------------------

HELD = sympy.Symbol("k")
PLACE, SPEED = sympy.symbols("x v")


@pytest.mark.parametrize(
    ("force", "written"),
    [
        (HELD * SPEED * sympy.Abs(SPEED), lambda x, v: 0.3 * v * abs(v)),
        (HELD * sympy.sign(SPEED), lambda x, v: 0.3 * np.sign(v)),
        (HELD * sympy.Max(PLACE, 0), lambda x, v: 0.3 * np.maximum(x, 0.0)),
        (
            HELD * sympy.Max(PLACE, SPEED, 0),
            lambda x, v: 0.3 * np.maximum(np.maximum(x, v), 0.0),
        ),
        (HELD * sympy.Heaviside(PLACE), lambda x, v: np.where(x > 0.0, 0.3, 0.0)),
        (
            sympy.Piecewise(
                (HELD * PLACE, (PLACE > 0.5) & (SPEED > 0)), (PLACE / 2, PLACE < 0), (0, True)
            ),
            lambda x, v: np.where((x > 0.5) & (v > 0.0), 0.3 * x, np.where(x < 0.0, 0.5 * x, 0.0)),
        ),
    ],
)
def test_switches_of_expressions_are_those_of_numpy(force, written):
    @dataclass(frozen=True, kw_only=True)
    class Written(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)

        def force(self, t, x, velocity, load):
            return -x - written(x, velocity)

    model = saltus.from_sympy(
        coordinates=[PLACE], velocities=[SPEED], force=[-PLACE - force], parameters={HELD: 0.3}
    )
    start = {"x": 1.0, "velocity": 0.5, "duration": 9.0}
    one = saltus.simulate(saltus.System(model=model), **start)
    other = saltus.simulate(saltus.System(model=Written()), **start)
    assert one.x == pytest.approx(other.x, abs=1e-12)
    assert one.velocity == pytest.approx(other.velocity, abs=1e-12)
    assert len(one.events) == len(other.events) > 0


@pytest.mark.parametrize(
    ("force", "sentence"),
    [
        (
            sympy.Piecewise((PLACE, PLACE > 1)),
            r"force has a Piecewise .* end it with \(value, True\)",
        ),
        (
            sympy.Piecewise((PLACE, sympy.Eq(PLACE, 1)), (0, True)),
            "which differs at an instant only: use < or >",
        ),
    ],
)
def test_conditions_that_are_no_force_are_refused(force, sentence):
    with pytest.raises(ParameterError, match=sentence):
        saltus.from_sympy(
            coordinates=[PLACE], velocities=[SPEED], force=[force], parameters={HELD: 0.3}
        )
