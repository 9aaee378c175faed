"""Series whose last coefficients vanish by symmetry: the step must not go as far as the terms that
are not there.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import mpmath as mp
import numpy as np
import pytest

from saltus.flow import simulate, simulate_many
from saltus.systems import Model, System


@dataclass(frozen=True, kw_only=True)
class Odd(Model):
    """x'' = -linear x - cubic x^3 - quintic x^5, without contact."""

    linear: float = 0.0
    cubic: float = 0.0
    quintic: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -self.linear * x - self.cubic * x**3 - self.quintic * x**5


def lemniscate(time):
    """x of x'' = -x^3 from x = 0, x' = 1, by the lemniscate sine."""
    with mp.workdps(30):
        # x'^2 = 1 - x^4/2: x = a sl(t / a) with a = 2^(1/4) and sl the lemniscate sine, sl(u) =
        # sd(sqrt(2) u, 1/2) / sqrt(2)
        a = mp.mpf(2) ** mp.mpf("0.25")
        return float(a * mp.ellipfun("sd", mp.sqrt(2) * time / a, m=mp.mpf("0.5")) / mp.sqrt(2))


@pytest.mark.parametrize("digits", range(6, 16))
def test_a_cubic_oscillator_through_zero_follows_the_lemniscate_at_every_tolerance(digits):
    motion = simulate(
        System(model=Odd(cubic=1.0)), x=0.0, velocity=1.0, duration=5.0, tol=10.0**-digits
    )
    assert motion.x == pytest.approx(lemniscate(5.0), abs=10 * 10.0**-digits + 1e-14)


@pytest.mark.parametrize("digits", range(6, 16, 3))
@pytest.mark.parametrize("linear", [0.0, 1e-12, 1e-6, 1e-3, 1.0])
@pytest.mark.parametrize("power", ["cubic", "quintic"])
def test_odd_oscillators_keep_their_energy_from_zero_at_every_tolerance(digits, linear, power):
    motion = simulate(
        System(model=Odd(linear=linear, **{power: 1.0})),
        x=0.0,
        velocity=1.0,
        duration=20.0,
        tol=10.0**-digits,
    )
    degree = 4 if power == "cubic" else 6
    energy = motion.velocity**2 / 2 + linear * motion.x**2 / 2 + motion.x**degree / degree
    assert energy == pytest.approx(0.5, abs=30 * 10.0**-digits + 2e-14)
    assert math.isfinite(motion.x)


@pytest.mark.parametrize("digits", [9, 12])
@pytest.mark.parametrize(("power", "degree"), [("cubic", 4), ("quintic", 6)])
def test_odd_oscillators_keep_their_energy_when_steps_begin_near_zero(power, degree, digits):
    """There the other coefficients are small, and do not vanish."""
    system = System(model=Odd(**{power: 1.0}))
    for speed in [0.7 + 0.007 * i for i in range(100)]:
        motion = simulate(system, x=0.0, velocity=speed, duration=20.0, tol=10.0**-digits)
        energy = motion.velocity**2 / 2 + motion.x**degree / degree
        assert energy == pytest.approx(speed**2 / 2, abs=30 * 10.0**-digits)


@pytest.mark.parametrize("digits", [6, 9, 14])
@pytest.mark.parametrize("power", ["cubic", "quintic"])
def test_ensembles_of_odd_oscillators_keep_their_energy_from_near_zero(digits, power):
    rng = np.random.default_rng(0)
    x = np.append(np.zeros(20), 10.0 ** rng.uniform(-12, -1, 100))
    velocity = rng.uniform(0.2, 3.0, x.size)
    tol = 10.0**-digits
    ends = simulate_many(
        System(model=Odd(**{power: 1.0})), x=x, velocity=velocity, duration=20.0, tol=tol
    )
    degree = 4 if power == "cubic" else 6
    before = velocity**2 / 2 + x**degree / degree
    after = ends.velocity.values**2 / 2 + ends.x.values**degree / degree
    assert np.abs(after / before - 1.0).max() < 30 * tol + 2e-14
