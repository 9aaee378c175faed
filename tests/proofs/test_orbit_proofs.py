"""What is proved of orbits is true by closed forms, and what is false is refuted."""

from __future__ import annotations

import math
import pickle
import runpy
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

import saltus
from saltus.orbits.orbit import PeriodicOrbit

DOCS = Path(__file__).parents[2] / "docs"


def ball_on_table(amplitude: float, e: float = 0.5) -> saltus.System:
    """A ball under an acceleration of 1 on a table that moves with the amplitude, at frequency
    1.
    """
    return saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=amplitude)),
        impact=saltus.VelocityReduction(e),
    )


@pytest.fixture(scope="module")
def table_orbit() -> saltus.PeriodicOrbit:
    """The stable orbit of period 1 with one impact."""
    orbit = saltus.find_orbit(ball_on_table(1.2), x=-1.0, velocity=-3.0)
    assert (orbit.period, orbit.impact_count) == (1, 1)
    return orbit


@pytest.fixture(scope="module")
def metainterface() -> saltus.PeriodicOrbit:
    """The README's orbit."""
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    return saltus.find_orbit(system, theta=0.3)


def contains(pair: np.ndarray, exact: mp.mpf) -> bool:
    return bool(abs(mp.mpf(float(pair[0])) - exact) <= mp.mpf(float(pair[1])))


def test_the_orbit_of_a_ball_on_a_table_contains_its_closed_form(
    table_orbit: saltus.PeriodicOrbit,
) -> None:
    """It leaves the table with u = pi and meets it with the relative speed 2 pi / (1 + e), when the
    table moves with u (1 - e) / (1 + e); the product of the multipliers is e^2."""
    proof = saltus.prove(table_orbit)
    assert proof.proved
    assert proof.stable
    with mp.workdps(40):
        assert contains(proof.impact_speeds[0], 2 * mp.pi / (1 + mp.mpf("0.5")))
        # The wall moves with a cos t, away from the ball where it is positive.
        phase = 2 * mp.pi - mp.acos(-mp.pi / 3 / mp.mpf(1.2))
        assert contains(proof.impact_times[0], phase)
    assert proof.impact_speeds[0, 1] < 1e-12
    sizes = proof.moduli[:, 0]
    assert np.prod(sizes) == pytest.approx(0.5**2, abs=1e-9)


def test_a_linear_oscillator_at_a_wall_contains_its_closed_form() -> None:
    """x'' + c x' + k x = F sin(W t) between impacts at x = 1: two linear equations for the free
    part give speed and phase, here in 40 digits by Newton's method on the closed form."""
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=0.8, force=saltus.Harmonic(amplitude=0.5)),
        impact=saltus.VelocityReduction(0.7),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    proof = saltus.prove(orbit)
    assert proof.proved
    with mp.workdps(40):
        exact = wall_impacts(
            [(float(t), float(s)) for t, s in zip(orbit.impact_times, orbit.speeds, strict=True)],
            orbit.duration,
        )
        for (time, speed), when, fast in zip(
            exact, proof.impact_times, proof.impact_speeds, strict=True
        ):
            assert contains(when, time)
            assert contains(fast, speed)


def wall_impacts(guess: list[tuple[float, float]], period: float) -> list[tuple[mp.mpf, mp.mpf]]:
    """Times and speeds of the impacts of the closed form, with doubles c = 0.1, W = 0.8, e =
    0.7.
    """
    c, w, force, e = mp.mpf(0.1), mp.mpf(0.8), mp.mpf(0.5), mp.mpf(0.7)
    decay = c / 2
    fast = mp.sqrt(1 - decay**2)
    denominator = (1 - w**2) ** 2 + (c * w) ** 2
    inphase = force * (1 - w**2) / denominator
    quadrature = force * c * w / denominator

    def forced(t: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        value = inphase * mp.sin(w * t) - quadrature * mp.cos(w * t)
        return value, w * (inphase * mp.cos(w * t) + quadrature * mp.sin(w * t))

    def flight(t0: mp.mpf, speed: mp.mpf, t1: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
        x, v = forced(t0)
        x = 1 - x
        v = -e * speed - v
        h = t1 - t0
        swing = (v + decay * x) / fast
        damped = mp.exp(-decay * h)
        free = damped * (x * mp.cos(fast * h) + swing * mp.sin(fast * h))
        rate = -decay * free + damped * fast * (swing * mp.cos(fast * h) - x * mp.sin(fast * h))
        end, end_rate = forced(t1)
        return free + end - 1, rate + end_rate

    turn = 2 * mp.pi / w * round(period * 0.8 / (2 * math.pi))

    def equations(*unknowns: mp.mpf) -> list[mp.mpf]:
        count = len(unknowns) // 2
        rows = []
        for i in range(count):
            later = unknowns[2 * (i + 1)] if i + 1 < count else unknowns[0] + turn
            speed = unknowns[(2 * (i + 1) + 1) % (2 * count)]
            gap, rate = flight(unknowns[2 * i], unknowns[2 * i + 1], later)
            rows += [gap, rate - speed]
        return rows

    start = [mp.mpf(x) for pair in guess for x in pair]
    found = mp.findroot(equations, start, tol=mp.mpf("1e-60"), verify=False)
    return [(found[2 * i], found[2 * i + 1]) for i in range(len(guess))]


def test_the_readme_s_orbit_is_proved_with_the_multipliers_of_the_flow(
    metainterface: saltus.PeriodicOrbit,
) -> None:
    """|multiplier|^2 = exp(-C T) for e = 1 over the half period."""
    proof = saltus.prove(metainterface)
    assert proof.proved
    assert proof.stable
    assert proof.check()
    assert min(proof.unique_within.values()) > 1e-3
    with mp.workdps(30):
        modulus = mp.exp(-mp.mpf(0.1) * mp.pi / 2)
        for pair in proof.moduli:
            assert contains(pair, modulus)
    assert "asymptotically stable" in proof.statement
    assert "mirror" in "".join(proof.assumptions)


def test_a_theorem_holds_within_radii_of_the_numbers(
    metainterface: saltus.PeriodicOrbit,
) -> None:
    wide = saltus.prove(metainterface, radii={"model.damping": 1e-6})
    assert wide.proved
    moved = saltus.prove(
        saltus.find_orbit(metainterface.system.with_({"model.damping": 0.1 + 9e-7}), theta=0.3)
    )
    distance = np.abs(moved.impact_times[:, 0] - wide.impact_times[:, 0])
    assert (distance > 1e-8).all()
    assert (distance <= wide.impact_times[:, 1]).all()


def test_radii_are_told_no_larger_than_they_were_proved(
    metainterface: saltus.PeriodicOrbit,
) -> None:
    """The mean of the vertical load is its own image, so the mirror symmetry holds for all."""
    radius = 1.99e-7
    proof = saltus.prove(metainterface, radii={"load.vertical": radius})
    assert proof.proved
    told = proof.statement.rpartition("load.vertical within ")[2].split()[0]
    assert mp.mpf("0.99") * radius < mp.mpf(told) <= mp.mpf(radius)


def test_a_proof_can_be_pickled(metainterface: saltus.PeriodicOrbit) -> None:
    proof = saltus.prove(metainterface)
    copied = pickle.loads(pickle.dumps(proof))
    assert copied.statement == proof.statement
    assert copied.check()


def test_an_orbit_that_was_moved_is_refuted(metainterface: saltus.PeriodicOrbit) -> None:
    unknowns = metainterface.solution.unknowns + 1e-9
    moved = PeriodicOrbit(
        metainterface.equations, replace(metainterface.solution, unknowns=unknowns)
    )
    proof = saltus.prove(moved)
    assert proof.proved is False
    assert "does not solve" in proof.reason


def test_an_orbit_that_penetrates_is_refuted(table_orbit: saltus.PeriodicOrbit) -> None:
    """A table that moves far meets the ball on its flight: the equations of an impact each period
    have a solution, whose gap is negative in between."""
    known = table_orbit.equations
    system = ball_on_table(6.0)
    equations = type(known)(system, known.signature, known.paths, known.tol)
    speed = 4.0 * math.pi / 3.0
    shift = math.acos(-math.pi / 3.0 / 6.0)
    orbits = [
        PeriodicOrbit.near(equations, np.array([phase, speed]), equations.values)
        for phase in (shift, 2.0 * math.pi - shift)
    ]
    pierced = [orbit for orbit in orbits if orbit is not None and orbit.clearance < -1e-3]
    assert pierced
    for orbit in pierced:
        proof = saltus.prove(orbit)
        assert proof.proved is False
        assert "penetrates" in proof.reason


def test_both_orbits_of_a_fold_are_proved(table_orbit: saltus.PeriodicOrbit) -> None:
    """The ball meets the table with the same speed at two phases: a node and a saddle."""
    equations = table_orbit.equations
    speed = 4.0 * math.pi / 3.0
    shift = math.acos(-math.pi / 3.0 / 1.2)
    for phase, stable in ((2.0 * math.pi - shift, True), (shift, False)):
        orbit = PeriodicOrbit.near(equations, np.array([phase, speed]), equations.values)
        assert orbit is not None
        proof = saltus.prove(orbit)
        assert proof.proved
        assert proof.stable is stable


def outside_closed_forms(equations, count: int) -> int:
    """How many of the impacts of random balls on tables lie outside their enclosures, in 300 bits:
    both orbits of period 1 of random restitutions and amplitudes."""
    rng = np.random.default_rng(7)
    wrong = 0
    proofs = 0
    for e, share in zip(rng.uniform(0.1, 0.9, count), rng.uniform(1.02, 1.6, count), strict=True):
        amplitude = float(share * math.pi * (1 - e) / (1 + e))
        own = type(equations)(
            ball_on_table(amplitude, float(e)), equations.signature, equations.paths, equations.tol
        )
        shift = math.acos(-1.0 / share)
        for phase in (2.0 * math.pi - shift, shift):
            orbit = PeriodicOrbit.near(own, np.array([phase, 2.0 * math.pi / (1 + e)]), own.values)
            assert orbit is not None
            proof = saltus.prove(orbit)
            if proof.proved is None:
                continue
            proofs += 1
            with mp.workprec(300):
                exact_e = mp.mpf(float(e))
                ratio = mp.pi * (1 - exact_e) / (1 + exact_e) / mp.mpf(amplitude)
                exact = mp.acos(-ratio)
                time = 2 * mp.pi - exact if phase > math.pi else exact
                wrong += not contains(proof.impact_times[0], time)
                wrong += not contains(proof.impact_speeds[0], 2 * mp.pi / (1 + exact_e))
    assert proofs > count
    return wrong


def test_random_balls_on_tables_contain_their_closed_forms(
    table_orbit: saltus.PeriodicOrbit,
) -> None:
    assert outside_closed_forms(table_orbit.equations, 5) == 0


@pytest.mark.thorough
def test_a_hundred_orbits_contain_their_closed_forms(table_orbit: saltus.PeriodicOrbit) -> None:
    assert outside_closed_forms(table_orbit.equations, 50) == 0


def test_contacts_of_several_coordinates_are_proved() -> None:
    """The impact pair: multipliers by interval arithmetic against the orbit's own."""
    system = saltus.System(
        model=saltus.ImpactPair(mass_ratio=0.3, damping=0.1, clearance=0.5),
        load=saltus.Load(frequency=1.2, force=saltus.Harmonic(amplitude=0.6)),
        impact=saltus.NewtonImpact(e=0.6),
    )
    orbit = saltus.find_orbit(system, z=0.1, x=0.1)
    proof = saltus.prove(orbit)
    assert proof.proved
    assert proof.stable
    largest = np.sort(np.abs(orbit.multipliers))[::-1][:4]
    assert (np.abs(largest - proof.moduli[:, 0]) <= proof.moduli[:, 1] + 1e-9).all()


def test_what_cannot_be_proved_says_why() -> None:
    block = saltus.System(
        model=saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1, damping=0.05),
        load=saltus.Load(frequency=0.9, force=saltus.Harmonic(amplitude=0.5)),
    )
    proof = saltus.prove(saltus.find_orbit(block, x=0.0))
    assert proof.proved is None
    assert proof.reason
    assert proof.statement.startswith("Nothing is proved")
    with pytest.raises(saltus.ParameterError, match="no certificate"):
        _ = proof.certificate


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"radii": {"model.dampin": 1e-3}}, "is not a number of the system"),
        ({"radii": {"model.damping": -1.0}}, "must lie in"),
        ({"radii": {"load.horizontal.mean": 1e-9}}, "orbit is symmetric, and with another load"),
        ({"radii": {"load.horizontal.order": 1e-9}}, "is a whole number"),
        ({"step": 0.0}, "step must lie in"),
        ({"step": 1e-300}, "step must be at least"),
        ({"step": 1e-3}, "step must be at least"),
        ({"order": 2}, "order"),
    ],
)
def test_bad_arguments_are_one_sentence(
    metainterface: saltus.PeriodicOrbit, arguments: dict, message: str
) -> None:
    with pytest.raises(saltus.ParameterError, match=message):
        saltus.prove(metainterface, **arguments)


def test_other_results_are_refused() -> None:
    with pytest.raises(saltus.ParameterError, match="takes a PeriodicOrbit"):
        saltus.prove(3)


@pytest.mark.thorough
def test_the_certificate_of_the_readme_s_orbit_is_checked_by_another_program(
    metainterface: saltus.PeriodicOrbit,
) -> None:
    pytest.importorskip("flint")
    checker = runpy.run_path(str(DOCS / "check_certificate.py"))
    assert checker["check"](saltus.prove(metainterface).certificate)
