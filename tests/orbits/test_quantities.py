"""Quantities of one's choice: of a coordinate, of a named point, of a function of a motion, on orbits,
branches, sweeps and pictures; by default of the displacement that the load drives.
"""

from dataclasses import dataclass

import numpy as np
import pytest

import saltus
from saltus.systems import driven_displacement

MASS = np.diag([1.0, 2.0, 0.5])
STIFFNESS = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.5]])
FORCE = 0.1
FREQUENCY = 0.62


def chain(order: tuple[int, ...] = (0, 1, 2), mass: float = 1.0) -> saltus.System:
    """Three masses, with a force on the second and a stop of the first that nothing reaches."""
    place = np.argsort(order)
    turned = np.ix_(order, order)
    names = [("a", "b", "c")[i] for i in order]
    far = saltus.Contact(name="far", coordinate=names[place[0]], position=50.0, sign=-1)
    model = saltus.Structure(
        mass=mass * MASS[turned],
        damping=mass * 0.05 * STIFFNESS[turned],
        stiffness=mass * STIFFNESS[turned],
        names=names,
        contacts=[far],
        forces={"f": "b"},
        points={"between": {"b": 0.5, "c": 0.5}},
    )
    load = saltus.Load(frequency=FREQUENCY, f=saltus.Harmonic(mass * FORCE))
    return saltus.System(model=model, load=load)


def response(frequency: float) -> np.ndarray:
    """The complex amplitudes of the three masses, by the equations themselves."""
    stiffness = STIFFNESS * (1.0 + 0.05j * frequency) - frequency**2 * MASS
    return np.linalg.solve(stiffness, [0.0, FORCE, 0.0])


EXPECTED = dict(zip("abc", np.abs(response(FREQUENCY)), strict=True)) | {
    "between": abs(response(FREQUENCY)[1:].mean())
}


@pytest.mark.parametrize("mass", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_quantities_of_a_linear_structure_are_those_of_its_response(
    order: tuple[int, ...], mass: float
) -> None:
    system = chain(order, mass)
    orbit = saltus.find_orbit(system, **system.model.start(0.0))
    assert driven_displacement(system) == "b"
    assert orbit.amplitude == pytest.approx(EXPECTED["b"], rel=1e-9)
    for name, expected in EXPECTED.items():
        assert orbit.quantity(name) == pytest.approx(expected, rel=1e-9)
        assert orbit.quantity(f"largest_{name}") == pytest.approx(expected, rel=1e-9)
        assert orbit.quantity(f"smallest_{name}") == pytest.approx(-expected, rel=1e-9)


@pytest.fixture(scope="module")
def resonance() -> saltus.Branch:
    system = chain()
    orbit = saltus.find_orbit(system, **system.model.start(0.0))
    return saltus.continue_orbit(orbit, "load.frequency", (0.5, 0.8), step=0.3)


def test_a_branch_and_its_table_have_them_at_each_point(resonance: saltus.Branch) -> None:
    sizes = np.abs([response(value) for value in resonance.parameters])
    data = resonance.to_xarray(
        functions={"swing": lambda motion: np.ptp(motion.extrema[0]), "c": "c"}
    )
    for i, name in enumerate("abc"):
        np.testing.assert_allclose(resonance.quantity(name), sizes[:, i], rtol=1e-8)
    np.testing.assert_allclose(resonance.amplitudes, sizes[:, 1], rtol=1e-8)
    np.testing.assert_allclose(data.amplitude, sizes[:, 1], rtol=1e-8)
    np.testing.assert_allclose(data.largest_b, sizes[:, 1], rtol=1e-8)
    between = np.abs([response(value)[1:].mean() for value in resonance.parameters])
    np.testing.assert_allclose(data.largest_between, between, rtol=1e-8)
    np.testing.assert_allclose(data.swing, 2.0 * sizes[:, 0], rtol=1e-8)
    np.testing.assert_allclose(data.c, sizes[:, 2], rtol=1e-8)


def test_a_sweep_has_them_and_its_amplitude_is_that_of_the_driven_mass() -> None:
    sweep = saltus.frequency_sweep(chain(), [0.6, FREQUENCY], **chain().model.start(0.0))
    there = sweep.sel(value=FREQUENCY, direction="up")
    for name, expected in EXPECTED.items():
        if name in ("a", "b", "between"):
            assert float(there[f"largest_{name}"]) == pytest.approx(expected, rel=1e-6)
    assert float(there.amplitude) == pytest.approx(EXPECTED["b"], rel=1e-6)


def damper(clearance: float = 1.0) -> saltus.System:
    return saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.05, clearance=clearance, damping=0.02),
        load=saltus.Load(frequency=0.95, force=saltus.Harmonic(0.05 * clearance)),
        impact=saltus.NewtonImpact(0.6),
    )


def test_the_amplitude_of_an_impact_damper_is_that_of_its_case() -> None:
    """Beside dense sampling of the motion; twice the lengths make it twice as large."""
    start = {"z": 0.5, "x": 0.0, "velocity": (0.0, 0.3)}
    orbit = saltus.find_orbit(damper(), **start)
    motion = orbit.motion()
    position, _ = motion.at(np.linspace(motion.start, motion.time, 20001))
    assert orbit.amplitude == pytest.approx(np.abs(position[0]).max(), abs=1e-7)
    assert orbit.quantity("x") == pytest.approx(1.0, abs=1e-12)  # pinned at the walls
    twice = saltus.find_orbit(damper(2.0), z=1.0, x=0.0, velocity=(0.0, 0.6))
    assert twice.amplitude == pytest.approx(2.0 * orbit.amplitude, rel=1e-9)


def test_a_sweep_of_an_impact_damper_sees_its_hysteresis() -> None:
    """At 1.05 two impacts a period on the way up, and a wide motion that does not repeat down."""
    start = {"z": 0.25, "x": 0.0, "velocity": (0.0, 0.3)}
    sweep = saltus.frequency_sweep(damper(), np.linspace(1.0, 1.1, 11), **start, periods=400)
    assert sweep.hysteresis.sel(value=1.05) == 1
    up, down = sweep.amplitude.sel(value=1.05).values
    assert down > 2.0 * up


@dataclass(frozen=True, kw_only=True)
class Twisted(saltus.ContactModel):
    """A mass with a force, and an angle that it turns by a spring; in any order and unit."""

    length: float = 1.0
    coordinates = ("angle", "x")
    units = ("rad", "1")
    channels = ("force",)

    def force(self, t, q, velocity, load):  # type: ignore[no-untyped-def]
        angle, x = q
        pull = 0.3 * (x / self.length - angle)
        return pull, load.force(t) - x - pull / self.length


class TwistedOtherwise(Twisted):
    coordinates = ("x", "angle")
    units = ("1", "rad")

    def force(self, t, q, velocity, load):  # type: ignore[no-untyped-def]
        return Twisted.force(self, t, q[::-1], velocity[::-1], load)[::-1]


@pytest.mark.parametrize("kind", [Twisted, TwistedOtherwise])
@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
def test_the_driven_coordinate_does_not_depend_on_order_or_units(kind: type, length: float) -> None:
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(0.1 * length))
    assert driven_displacement(saltus.System(model=kind(length=length), load=load)) == "x"


@pytest.mark.parametrize("channel", ["force", "ground"])
def test_the_case_of_an_impact_pair_is_driven_by_a_force_and_by_the_ground(channel: str) -> None:
    load = saltus.Load(frequency=1.0, **{channel: saltus.Harmonic(0.1)})
    assert driven_displacement(saltus.System(model=saltus.ImpactPair(), load=load)) == "z"


def test_a_quantity_that_there_is_not_is_refused_with_those_that_there_are(
    resonance: saltus.Branch,
) -> None:
    with pytest.raises(saltus.ParameterError, match="between"):
        resonance.quantity("w")
    with pytest.raises(saltus.ParameterError, match="largest_between"):
        saltus.plot(resonance, quantity="w")
    for name in ("amplitude", "point", "multiplier", "unknown", "through"):
        with pytest.raises(saltus.ParameterError, match="another name"):
            resonance.to_xarray(functions={name: len})
    with pytest.raises(saltus.ParameterError, match="words as names"):
        resonance.to_xarray(functions={"a\nb": len})
    with pytest.raises(saltus.ParameterError, match="quantity must be a name"):
        saltus.plot(resonance, quantity=["b"])
    with pytest.raises(saltus.ParameterError, match="must return a number"):
        resonance.to_xarray(functions={"states": lambda motion: motion.position})


@pytest.mark.parametrize("quantity", [None, "b", "between", "smallest_c", lambda motion: 2.0])
def test_any_of_them_is_drawn(resonance: saltus.Branch, quantity: object) -> None:
    axes = saltus.plot(resonance, quantity=quantity)
    highest = max(float(np.max(line.get_ydata())) for line in axes.lines if len(line.get_ydata()))
    name = "b" if quantity is None else quantity
    assert highest == pytest.approx(resonance.quantity(name).max(), rel=1e-2)
