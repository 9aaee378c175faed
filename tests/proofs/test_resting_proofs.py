"""Orbits that rest are proved, with their infinitely many impacts."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import saltus


def resting(amplitude: float, e: float) -> saltus.PeriodicOrbit:
    """A ball under an acceleration of 1 on a table that moves with the amplitude."""
    system = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, damping=0.0, wall=0.0),
        load=saltus.Load(frequency=1.0, force=1.0, ground=saltus.Harmonic(amplitude=amplitude)),
        impact=saltus.VelocityReduction(e),
    )
    return saltus.find_orbit(system, x=0.0)


def flight(a: mp.mpf, begin: mp.mpf, speed: mp.mpf, guess: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    """x'' = 1 + a sin t from x = 0 with x' = -speed: the time near `guess` at which it is 0 again,
    and x' there."""

    def place(t: mp.mpf) -> mp.mpf:
        h = t - begin
        swing = mp.sin(begin) - mp.sin(t) + mp.cos(begin) * h
        return (h / 2 + a * swing / h - speed) if h else -speed

    end = mp.findroot(place, guess)
    h = end - begin
    return end, h + a * (mp.cos(begin) - mp.cos(end)) - speed


@pytest.mark.parametrize(("amplitude", "e"), [(1.3, 0.3), (1.6, 0.2), (1.2, 0.5)])
def test_an_accumulation_is_proved_and_contains_its_closed_form(amplitude: float, e: float) -> None:
    """The table pulls once a sin t falls below -1; flights are solved in 40 digits."""
    proof = saltus.prove(resting(amplitude, e))
    assert proof.proved, proof.reason
    assert proof.stable
    assert proof.check()
    with mp.workdps(40):
        a = mp.mpf(amplitude)
        released = mp.pi + mp.asin(1 / a)
        middle, radius = map(float, proof.releases[0])
        assert abs(mp.mpf(middle) - released - 2 * mp.pi) <= mp.mpf(radius)
        time = released
        leaving = mp.mpf(0)
        for number in range(60):
            guess = (
                mp.mpf(float(proof.impact_times[number, 0]))
                if number < len(proof.impact_times)
                else time + 2 * leaving / -(-1 - a * mp.sin(time))
            )
            time, speed = flight(a, time, leaving, guess)
            if number < len(proof.impact_times):
                for exact, pair in (
                    (time, proof.impact_times[number]),
                    (speed, proof.impact_speeds[number]),
                ):
                    assert abs(exact - mp.mpf(float(pair[0]))) <= mp.mpf(float(pair[1]))
            leaving = mp.mpf(e) * speed
        # The 60th impact is before the bound, which is no more than 1 % of the excursion late.
        assert time <= mp.mpf(float(proof.rests_by[0]))
        assert proof.rests_by[0] - time < 0.01 * (time - released)
    assert "Infinitely many further impacts are over by" in proof.statement


def test_a_rest_that_is_too_short_is_not_proved() -> None:
    """Where the accumulation has just time to end, no bound of it does."""
    proof = saltus.prove(resting(1.3, 0.3))
    assert proof.made is not None
    assert proof.shooting is not None
    assert proof.zero is not None
    from dataclasses import replace

    from saltus.orbits.segments.resting_segments import rest_by

    rest = proof.made.rests[0]
    assert rest_by(proof.shooting, proof.zero.box, rest) is not None
    # An impact that returns more than it gets, a contact that pulls, a rest that never rises.
    pushes = replace(rest, pull=-1.0 * rest.pull)
    grows = replace(rest, restitution=rest.restitution * 4.0)
    pulled = replace(rest, held_pull=-1.0 * rest.held_pull)
    falls = replace(rest, held_rate=-1.0 * rest.held_rate)
    for wrong in (pushes, grows, pulled, falls):
        assert rest_by(proof.shooting, proof.zero.box, wrong) is None


def test_a_resting_orbit_s_dataset_has_its_impacts() -> None:
    data = saltus.prove(resting(1.3, 0.3)).to_xarray()
    assert data.sizes["enclosed"] == 6
    assert np.isfinite(data.enclosed_time).all()
