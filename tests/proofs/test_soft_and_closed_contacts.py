"""Orbits through soft stops, and orbits on which contacts stay closed, are proved, or refused in one
sentence.
"""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest
from soft_stops import soft_stop

import saltus


def two_stops(e: float, frequency: float, amplitude: float) -> saltus.System:
    return saltus.System(
        model=saltus.TwoStops(left=-1.0, right=1.0, damping=0.05),
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(amplitude=amplitude)),
        impact=saltus.NewtonImpact(e=e),
    )


def belt() -> saltus.System:
    return saltus.System(
        model=saltus.BeltOscillator(),
        load=saltus.Load(frequency=0.7, force=saltus.Harmonic(amplitude=0.5)),
    )


def wall_without_restitution() -> saltus.System:
    return saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=0.6, force=saltus.Harmonic(amplitude=2.0, mean=2.0)),
        impact=saltus.VelocityReduction(0.0),
    )


def motion(system: saltus.System, beyond: bool, t0: Any, x: Any, v: Any, t1: Any) -> tuple:
    """The state at t1 of the linear motion on one side of a soft stop, in closed form."""
    model = system.model
    k = mp.mpf(model.stiffness) + (mp.mpf(model.stop) if beyond else 0)
    c = mp.mpf(model.damping) + (mp.mpf(model.damper) if beyond else 0)
    push = mp.mpf(model.stop) * mp.mpf(model.edge) - mp.mpf(model.preload) if beyond else mp.mpf(0)
    w, force = mp.mpf(system.load.frequency), mp.mpf(system.get("load.force.amplitude"))
    size = (k - w**2) ** 2 + (c * w) ** 2
    inphase, quadrature = force * (k - w**2) / size, -force * c * w / size

    def forced(t: Any) -> tuple:
        sine, cosine = mp.sin(w * t), mp.cos(w * t)
        value = inphase * sine + quadrature * cosine + push / k
        return value, w * (inphase * cosine - quadrature * sine)

    f, df = forced(t0)
    half = c / 2
    fast = mp.sqrt(k - half**2)
    h = t1 - t0
    x, swing = x - f, (v - df + half * (x - f)) / fast
    fall = mp.exp(-half * h)
    free = fall * (x * mp.cos(fast * h) + swing * mp.sin(fast * h))
    rate = -half * free + fall * fast * (swing * mp.cos(fast * h) - x * mp.sin(fast * h))
    f, df = forced(t1)
    return free + f, rate + df


def test_an_orbit_through_a_preloaded_soft_stop_contains_its_closed_form() -> None:
    """The two instants at which it passes the edge, with their speeds, solve four equations of two
    linear motions, in 40 digits.
    """
    system = soft_stop(preload=0.5)
    orbit = saltus.find_orbit(system, x=0.0)
    proof = saltus.prove(orbit, step=1.0, order=24)
    assert proof.proved, proof.reason
    assert proof.check()
    assert len(proof.impact_times) == 2
    edge = mp.mpf(system.model.edge)
    (t1, _), (t2, _) = proof.impact_times
    (s1, _), (s2, _) = proof.impact_speeds
    with mp.workdps(40):
        period = 2 * mp.pi / mp.mpf(system.load.frequency)
        # Which of them leads beyond the edge is tried; only one choice returns to it.
        for enters in (True, False):

            def equations(a: Any, u: Any, b: Any, w: Any, enters: bool = enters) -> list:
                sign = 1 if enters else -1
                x, v = motion(system, enters, a, edge, sign * u, b)
                y, z = motion(system, not enters, b, edge, -sign * w, a + period)
                return [x - edge, v + sign * w, y - edge, z - sign * u]

            guess = [mp.mpf(float(value)) for value in (t1, s1, t2, s2)]
            if max(map(abs, equations(*guess))) > 1e-6:
                continue
            exact = mp.findroot(equations, guess)
            pairs = zip(proof.impact_times, proof.impact_speeds, strict=True)
            balls = [ball for pair in pairs for ball in pair]
            for ball, value in zip(balls, exact, strict=True):
                assert abs(mp.mpf(float(ball[0])) - value) <= mp.mpf(float(ball[1]))
                assert ball[1] < 1e-11
            return
    raise AssertionError("the enclosed times and speeds solve no closed form")


REFUSED: dict[str, tuple[Any, dict[str, float], str]] = {
    "a soft stop": (soft_stop(), {"x": 0.0}, "pass through their contact"),
    "a soft stop with a damper": (
        soft_stop(damper=0.3),
        {"x": 0.0},
        "pass through their contact",
    ),
    "stops without restitution": (two_stops(0.0, 1.6, 2.0), {"x": 0.2}, "stays closed"),
    "rests at two stops": (two_stops(0.3, 0.2, 3.0), {"x": 0.2}, "rests among several contacts"),
    "a rest after one impact": (wall_without_restitution(), {"x": 0.0}, "has no bound"),
    "sticking": (belt(), {"x": 0.1}, "sticking"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_proved_is_refused_in_one_sentence(name: str) -> None:
    system, start, words = REFUSED[name]
    proof = saltus.prove(saltus.find_orbit(system, **start))
    assert proof.proved is None
    assert proof.stable is None
    assert words in proof.reason
    assert "\n" not in proof.reason
    assert len(proof.reason) < 200
    assert proof.statement == f"Nothing is proved: {proof.reason}."
    assert not proof.check()
    with pytest.raises(saltus.ParameterError, match="nothing is proved"):
        _ = proof.certificate


def test_a_branch_through_a_soft_stop_says_why_it_is_not_proved() -> None:
    orbit = saltus.find_orbit(soft_stop(), x=0.0)
    branch = saltus.continue_orbit(orbit, "load.frequency", bounds=(0.75, 0.85))
    proof = saltus.prove(branch)
    assert not proof.proved.any()
    assert "pass through their contact" in proof.reasons[0]
    assert np.all(["\n" not in reason for reason in proof.reasons])


def test_a_branch_of_orbits_that_rest_is_refused() -> None:
    """Its rests would have to be proved in each box."""
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=1.0),
        load=saltus.Load(frequency=0.6, force=saltus.Harmonic(amplitude=2.0, mean=2.0)),
        impact=saltus.VelocityReduction(0.4),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    assert saltus.prove(orbit).proved
    branch = saltus.continue_orbit(orbit, "load.frequency", bounds=(0.59, 0.61))
    proof = saltus.prove(branch)
    assert not proof.proved.any()
    assert "not yet along a branch" in proof.reasons[0]
