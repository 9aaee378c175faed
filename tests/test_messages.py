"""Mistakes that people made: each is answered with what to do instead."""

import dataclasses
import math
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus.errors import SaltusError

WALL = saltus.System(
    model=saltus.WallOscillator(damping=0.1),
    load=saltus.Load(frequency=2.6, force=saltus.Harmonic(1.0)),
    impact=saltus.VelocityReduction(0.8),
)


def own(base=saltus.ContactModel, frozen=True, **parts):
    """A model of one coordinate x with these parts."""
    kind = type("Own", (base,), {"coordinates": ("x",), **parts})
    return dataclasses.dataclass(frozen=frozen, kw_only=True)(kind)()


def pushed(force):
    """A model with this force."""
    return own(force=lambda self, t, x, velocity, load: force(t, x, velocity))


MISTAKES = {
    "a system for an orbit": (
        lambda: saltus.continue_orbit(WALL, "load.frequency", (1.0, 2.0)),
        "orbit must be a PeriodicOrbit, as find_orbit gives it",
    ),
    "a function as a load": (
        lambda: saltus.Load(force=lambda t: 0.0),
        "load.force must be a number, a Harmonic, a pulse or a Record",
    ),
    "samples as a load": (
        lambda: saltus.Load(force=np.zeros(3)),
        "samples are given as Record(time, value)",
    ),
    "many starts": (
        lambda: saltus.simulate(WALL, x=np.linspace(0.0, 0.1, 3), periods=1),
        "for many starts at once use simulate_many",
    ),
    "a list of changes": (lambda: WALL.with_([1]), "changes must be a dict"),
    "a switch": (
        lambda: saltus.simulate(WALL, x=0.0, periods=1, dense=[1]),
        "dense must be True or False",
    ),
    "a branch on the state": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -x if x > 0 else x)),
        "may not branch on its state",
    ),
    "Python's functions": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -math.sin(x))),
        "use NumPy's functions, not math's",
    ),
    "a function without a series": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -np.floor(x))),
        "np.floor cannot be traced",
    ),
    "the only coordinate as a list": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -x[0])),
        "write q, not q[0]",
    ),
    "the time": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -np.sin(t))),
        "the time may only be passed to a load channel",
    ),
    "drag": (
        lambda: saltus.System(model=pushed(lambda t, x, v: -v * v if v > 0.0 else v * v)),
        "as in -v * abs(v)",
    ),
    "a class that may change": (
        lambda: saltus.System(model=own(frozen=False, force=lambda self, t, x, v, load: -x)),
        "@dataclass(frozen=True, kw_only=True)",
    ),
    "a Hertz contact": (
        lambda: saltus.simulate(
            saltus.System(model=pushed(lambda t, x, v: -(x**1.5))), x=0.3, duration=5.0
        ),
        "a Hertz contact is written as",
    ),
    "a duration for exponents": (
        lambda: saltus.lyapunov_spectrum(WALL, x=0.0, duration=200.0),
        "duration",
    ),
    "a duration for a verdict": (lambda: saltus.classify(WALL, x=0.0, duration=9.0), "duration"),
    "a duration for an orbit": (lambda: saltus.find_orbit(WALL, x=0.0, duration=9.0), "duration"),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_a_mistake_is_answered_with_what_to_do(what):
    call, answer = MISTAKES[what]
    with pytest.raises(SaltusError) as refusal:
        call()
    assert answer in str(refusal.value)


def test_a_curved_gap_of_one_contact_is_refused_when_a_system_is_made():
    def reset(self, t, velocity, side, load, impact):
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    model = own(
        saltus.OneContactModel,
        acceleration=lambda self, t, x, velocity, side, load: -x,
        sides=(1,),
        contact=0.0,
        gap=lambda self, x, side: np.sin(x),
        reset=reset,
    )
    with pytest.raises(SaltusError, match="gap must be linear in the coordinate"):
        saltus.System(model=model)


@pytest.mark.parametrize("mass", [2.0, [[2.0]], ((2.0,),), np.array([[2.0]])])
def test_the_mass_of_one_coordinate_may_be_a_matrix(mass):
    """x = cos(t sqrt(k / m))."""

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Heavy(saltus.ContactModel):
        coordinates: ClassVar = ("x",)
        contacts: ClassVar = (saltus.Contact(name="far", coordinate="x", position=-9.0),)

        def force(self, t, x, velocity, load):
            return -3.0 * x

        def mass_matrix(self, x):
            return mass

    system = saltus.System(model=Heavy())
    assert saltus.simulate(system, x=1.0, duration=2.0).x == pytest.approx(
        math.cos(2.0 * math.sqrt(1.5)), abs=1e-12
    )
    balance = saltus.energies(saltus.simulate(system, x=1.0, duration=2.0))
    assert abs(balance.defect) < 1e-12


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("integrate", "simulate"),
        ("solve", "simulate"),
        ("solve_ivp", "simulate"),
        ("lyapunov", "lyapunov_spectrum"),
        ("basins", "basins_of_attraction"),
        ("continuation_", "continue_orbit"),
    ],
)
def test_names_of_other_packages_lead_to_those_of_this_one(name, meant):
    with pytest.raises(AttributeError, match=f"did you mean '{meant}'"):
        getattr(saltus, name)


def test_what_a_motion_has_is_told():
    motion = saltus.simulate(WALL, x=0.0, periods=1)
    for name in ("t", "y", "times"):
        with pytest.raises(AttributeError, match=r"it has time, final_state, at\(t\), samples"):
            getattr(motion, name)


def test_a_quantity_that_a_branch_does_not_have_is_answered_with_its_own():
    branch = saltus.continue_orbit(
        saltus.find_orbit(WALL, x=0.1), "load.frequency", (2.55, 2.65), step=1.0
    )
    with pytest.raises(SaltusError, match=r"quantity must be one of amplitude, .*got 'z'"):
        saltus.plot(branch, quantity="z")


def test_a_page_is_no_result(tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<!doctype html>\n<title>A page</title>\n" + 600 * " ")
    with pytest.raises(SaltusError, match="is a page; open it in a browser"):
        saltus.load(page)
