"""Free orbits and backbones against closed forms and against energy integrals in 40 digits; what
has no free orbit is told.
"""

from dataclasses import dataclass

import mpmath
import numpy as np
import pytest

import saltus
from saltus import OneContactModel, backbone, free_orbit, theory
from saltus.errors import MotionError, ParameterError
from saltus.plots import figure_of
from saltus.plots.curves import draw_backbone
from saltus.systems import System


@dataclass(frozen=True, kw_only=True)
class SlenderBlock(OneContactModel):
    """A rocking block of small angles: theta'' = theta - s alpha, with p = 1."""

    alpha: float

    def acceleration(self, t, theta, velocity, side, load):
        return theta - side * self.alpha


def test_the_free_period_of_a_slender_block_is_housners():
    system = System(model=SlenderBlock(alpha=0.2))
    shares = np.array([1e-6, 0.01, 0.2, 0.5, 0.9, 0.999])
    data = backbone(system, 0.2 * shares)
    assert data.period.values == pytest.approx(4 * np.arccosh(1 / (1 - shares)), rel=2e-11)
    assert data.period.values[:5] == pytest.approx(4 * np.arccosh(1 / (1 - shares[:5])), rel=2e-13)
    assert data.turning.values == pytest.approx(-0.2 * shares, rel=1e-9)


def test_the_free_period_of_a_rigid_block_is_the_elliptic_integral():
    system = System(model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(1.0))
    angles = np.array([0.001, 0.1, 0.25, 0.29])
    assert backbone(system, angles).period.values == pytest.approx(
        theory.rocking_period(angles, alpha=0.3), rel=1e-11
    )


def potential(theta, beta0, stiffness, vertical, horizontal):
    """`pot_balance0`: k^P theta^2 / 2 + V [sin(beta0) - sin(beta0 + |theta|)] + s H [cos(beta0 +
    |theta|) - cos(beta0)].
    """
    size, sign = abs(theta), 1 if theta > 0 else -1
    spring = stiffness if theta > 0 else 1
    forces = (
        vertical * (mpmath.sin(beta0) - mpmath.sin(beta0 + size)),
        horizontal * (mpmath.cos(beta0 + size) - mpmath.cos(beta0)),
    )
    return spring * size**2 / 2 + forces[0] + sign * forces[1]


@pytest.mark.parametrize(
    ("beta0", "stiffness", "mass", "vertical", "horizontal"),
    [(1.4, 1.0, 0.0, -0.5, 0.0), (1.4, 1.7, 0.4, -0.5, 0.03), (1.2, 0.6, 0.2, -0.1, 0.0)],
)
def test_the_backbone_of_the_metainterface_is_its_energy_integral(
    beta0, stiffness, mass, vertical, horizontal
):
    """T = 2 sum over both sides of the integral of dtheta / sqrt(2 (E - P(theta)) / (1 + m)^P), by
    Gauss in 40 digits.
    """
    system = System(
        model=saltus.Metainterface(beta0=beta0, stiffness_ratio=stiffness, mass_ratio=mass),
        load=saltus.Load(vertical=vertical, horizontal=horizontal),
        impact=saltus.EnergyRestitution(1.0),
    )
    amplitudes = np.linspace(0.05, 1.4, 7)
    data = backbone(system, amplitudes)
    assert (data.outcome == "periodic").all()
    with mpmath.workdps(40):
        numbers = [mpmath.mpf(float(x)) for x in (beta0, stiffness, vertical, horizontal)]
        for amplitude, turning, period in zip(
            amplitudes, data.turning.values, data.period.values, strict=True
        ):
            energy = potential(mpmath.mpf(float(amplitude)), *numbers)
            low = mpmath.findroot(lambda x, e=energy: potential(x, *numbers) - e, float(turning))
            assert float(low) == pytest.approx(turning, abs=1e-11)
            total = mpmath.mpf(0)
            for side, end in ((1, mpmath.mpf(float(amplitude))), (-1, low)):
                weight = 1 + mpmath.mpf(mass) if side > 0 else mpmath.mpf(1)

                # theta = end (1 - u^2) takes the singularity of the turning point away
                def time(u, e=energy, b=end, m=weight):
                    return (
                        2
                        * u
                        * abs(b)
                        / mpmath.sqrt(2 * (e - potential(b * (1 - u**2), *numbers)) / m)
                    )

                total += 2 * mpmath.quad(time, [0, 0.5, 1], method="gauss-legendre")
            assert period == pytest.approx(float(total), rel=1e-10)


def test_between_a_wall_and_a_spring():
    """Amplitudes below the wall take 2 pi; above it the wall at 1 cuts 2 arccos(1 / a) off."""
    system = System(model=saltus.WallOscillator(), load=saltus.Load(force=0.0))
    data = backbone(system, [-0.5, -0.999, -1.5, -3.0])
    sizes = np.array([1.5, 3.0])
    assert data.period.values[:2] == pytest.approx([2 * np.pi] * 2, rel=1e-13)
    assert data.period.values[2:] == pytest.approx(2 * np.pi - 2 * np.arccos(1 / sizes), rel=1e-13)
    assert data.impact_speed.values[2:] == pytest.approx(np.sqrt(sizes**2 - 1), rel=1e-12)
    assert np.isnan(data.impact_speed.values[:2]).all()


def test_one_free_orbit_is_a_motion_that_comes_back():
    orbit = free_orbit(
        System(model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(1.0)), 0.1
    )
    motion = orbit.motion()
    assert (motion.theta, motion.velocity) == pytest.approx((0.1, 0.0), abs=1e-12)
    assert len(motion.impacts) == 2
    assert orbit.frequency == pytest.approx(
        2 * np.pi / theory.rocking_period(0.1, alpha=0.3), rel=1e-11
    )


def test_what_has_no_free_orbit_is_told():
    unforced = saltus.Load(vertical=-0.5)
    damped = System(model=saltus.Metainterface(beta0=1.4, damping=0.1), load=unforced)
    inelastic = System(
        model=saltus.Metainterface(beta0=1.4), load=unforced, impact=saltus.VelocityReduction(0.8)
    )
    block = System(model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(1.0))
    for system, start, outcome in (
        (damped, 0.4, "lost"),
        (inelastic, 0.4, "lost"),
        (block, 0.31, "ended"),
        (block, 0.0, "equilibrium"),
    ):
        assert backbone(system, [start]).outcome.values.tolist() == [outcome]
    with pytest.raises(
        MotionError, match=r"no free orbit begins at rest at theta = 0.4: .* energy is lost"
    ):
        free_orbit(damped, 0.4)
    forced = System(
        model=saltus.Metainterface(beta0=1.4),
        load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.1)),
    )
    with pytest.raises(ParameterError, match=r"load\.horizontal varies"):
        backbone(forced, [0.1])
    with pytest.raises(ParameterError, match="amplitudes must be finite numbers"):
        backbone(block, [np.nan])


def test_the_picture_of_a_backbone_has_frequencies_and_amplitudes():
    data = backbone(
        System(model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(1.0)),
        [0.05, 0.1, 0.2, 0.35],
    )
    (ax,) = figure_of(draw_backbone(data)).axes
    (line,) = ax.lines
    assert line.get_xdata()[:3] == pytest.approx(data.frequency.values[:3])
    assert line.get_ydata().tolist() == data.amplitude.values.tolist()


@pytest.mark.parametrize("rate", [1e-8, 1.0, 1e8])
def test_units_of_time_do_not_matter(rate):
    """2 pi / sqrt(k)."""
    spring = System(model=saltus.WallOscillator(stiffness=rate**2))
    assert free_orbit(spring, -0.5).period * rate == pytest.approx(2.0 * np.pi, rel=1e-12)


@dataclass(frozen=True, kw_only=True)
class Displaced(saltus.Model):
    """x'' = -(x - o) - c x'."""

    origin: float = 0.0
    damping: float = 0.0
    coordinates = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return self.origin - x - self.damping * velocity


@pytest.mark.parametrize("origin", [0.0, 1.0, 1e6])
def test_the_origin_does_not_matter(origin):
    """What loses 1e-7 of its amplitude is no orbit, however far its origin is."""
    still = System(model=Displaced(origin=origin))
    assert free_orbit(still, origin + 0.5).period == pytest.approx(2 * np.pi, rel=1e-9)
    with pytest.raises(MotionError, match="energy is lost"):
        free_orbit(System(model=Displaced(origin=origin, damping=1e-6)), origin + 0.5)
