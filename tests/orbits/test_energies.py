"""The energy balance of motions: its sum closes on random motions of every kind, and its parts are
those of closed forms.
"""

import os
from dataclasses import dataclass

import numpy as np
import pytest

import saltus
from saltus import energies

CASES = int(os.environ.get("SALTUS_CASES", "10000"))


@dataclass(frozen=True, kw_only=True)
class Sledge(saltus.ContactModel):
    """A pendulum of length 1 on a sledge on a spring, with a stop for the sledge: a mass matrix
    that depends on the angle.

    T = x'^2 + x' phi' cos(phi) + phi'^2 / 2, V = x^2 / 2 + 1 - cos(phi), with the Coriolis term
    phi'^2 sin(phi) on the sledge.
    """

    damping: float = 0.1
    coordinates = ("x", "phi")
    channels = ("force",)
    contacts = (saltus.Contact(name="stop", coordinate="x", sign=-1, position=0.4),)

    def mass_matrix(self, q):
        return [[2.0, np.cos(q[1])], [np.cos(q[1]), 1.0]]

    def force(self, t, q, velocity, load):
        turning = velocity[1] * velocity[1] * np.sin(q[1])
        return turning - q[0] - self.damping * velocity[0] + load.force(t), -np.sin(q[1])


def systems(rng):
    """A random system of each kind of model, with a start."""
    u = rng.uniform
    wave = saltus.Harmonic(amplitude=u(0.1, 1.0), phase=u(0, 6))
    force = saltus.Load(
        frequency=u(0.6, 2.0), force=[wave, u(-0.2, 0.2)], ground=saltus.Harmonic(u(0, 0.2))
    )
    both = {
        "horizontal": wave,
        "vertical": [u(-0.8, -0.2), saltus.Harmonic(0.1)],
        "ground_horizontal": saltus.Harmonic(u(0, 0.1)),
    }
    cell = {"beta0": u(1.1, 1.5), "damping": u(0, 0.2)}
    layers = {
        "mass_ratio": u(0, 0.6),
        "stiffness_ratio": u(0.8, 1.4),
        "dissipation_ratio": u(0.5, 1.5),
    }
    loaded = saltus.Load(frequency=u(0.6, 2.0), **both)
    e = u(0.3, 0.95)
    yield (
        saltus.System(
            model=saltus.WallOscillator(damping=u(0, 0.2), wall=0.3),
            load=force,
            impact=saltus.VelocityReduction(e),
        ),
        {"x": u(-0.5, 0.2)},
    )
    yield (
        saltus.System(
            model=saltus.Metainterface(**cell, **layers),
            load=loaded,
            impact=saltus.VelocityReduction(e),
        ),
        {"theta": u(-0.5, 0.5)},
    )
    yield (
        saltus.System(
            model=saltus.TwoStops(damping=0.1, left=-0.4, right=0.5),
            load=force,
            impact=saltus.NewtonImpact(e),
        ),
        {"x": u(-0.3, 0.3)},
    )
    yield (
        saltus.System(
            model=saltus.ImpactPair(damping=0.1, clearance=0.4),
            load=force,
            impact=saltus.NewtonImpact(e),
        ),
        {"z": 0.1, "x": u(-0.3, 0.3)},
    )
    yield (
        saltus.System(
            model=saltus.TwoLayer(**cell, **layers), load=loaded, impact=saltus.NewtonImpact(e)
        ),
        {"theta_1": u(0, 0.3), "theta_2": u(-0.3, 0)},
    )
    pressed = saltus.Load(frequency=u(0.6, 2.0), force=wave)
    yield (
        saltus.System(
            model=saltus.BeltOscillator(damping=0.05, belt_speed=u(-0.3, 0.3)), load=pressed
        ),
        {"x": u(-1, 1)},
    )
    yield (
        saltus.System(model=Sledge(), load=pressed, impact=saltus.NewtonImpact(e)),
        {"x": 0.0, "phi": u(-1, 1)},
    )
    shaken = saltus.Load(
        frequency=u(2, 4),
        ground_horizontal=saltus.Harmonic(u(0, 0.1)),
        ground_vertical=saltus.Harmonic(0.02),
    )
    yield (
        saltus.System(
            model=saltus.RockingBlock(alpha=0.3), load=shaken, impact=saltus.VelocityReduction(e)
        ),
        {"theta": u(-0.2, 0.2)},
    )


def defect(rng):
    """The largest defect of the energy of one random motion of each kind, relative to the energies
    exchanged, or to 1e-9.
    """
    worst, impacts = 0.0, 0
    for system, start in systems(rng):
        motion = saltus.simulate(system, **start, periods=2.0)
        if motion.stop == "limit":
            continue  # an overturned block
        balance = energies(motion, periods=1)
        impacts += sum(part.startswith("impact") for part in balance.part.values.tolist())
        worst = max(worst, abs(balance.defect) / max(float(np.abs(balance.energy).sum()), 1e-9))
    return worst, impacts


def test_the_energies_of_random_motions_of_every_kind_add_up():
    accumulations = (1202, 1239)  # long ones, and a block that comes to rest in the last period
    found = [defect(np.random.default_rng(seed)) for seed in (*range(10), *accumulations)]
    assert sum(impacts for _, impacts in found) > 20
    assert max(worst for worst, _ in found) < 1e-10


@pytest.mark.thorough
def test_the_energies_of_ten_thousand_random_motions_add_up():
    assert (
        max(defect(np.random.default_rng(1000 + seed))[0] for seed in range(-(-CASES // 8))) < 1e-10
    )


def test_a_bouncing_ball_loses_at_the_wall_what_gravity_gives():
    """A ball falls from h: at the first impact the energy h becomes e^2 h, so that the impact takes
    (1 - e^2) h.
    """
    h, e = 1.5, 0.6
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0),
        load=saltus.Load(force=1.0),
        impact=saltus.VelocityReduction(e),
    )
    first = np.sqrt(2 * h)
    # up to the top of the first bounce
    up = energies(saltus.simulate(ball, x=-h, duration=first * (1 + e))).energy.to_series()
    assert up["load.force"] == pytest.approx(h - e**2 * h, rel=1e-12)
    assert up["impact"] == pytest.approx((1 - e**2) * h, rel=1e-12)
    assert up["kinetic"] == pytest.approx(0.0, abs=1e-12)
    rest = energies(
        saltus.simulate(ball, x=-h, duration=first * (1 + 2 * e / (1 - e)) + 1)
    ).energy.to_series()
    assert rest["impact"] == pytest.approx(h, rel=1e-12)


def test_stick_and_slip_takes_from_the_belt_what_friction_and_dashpot_turn_into_heat():
    """On the orbit, with the sticking phase in which the belt winds up the spring; without damping
    the slip phase is a part of a circle: heat = mu_k N times the path of the mass relative to the
    belt."""
    belt = saltus.System(model=saltus.BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1))
    motion = saltus.simulate(belt, x=0.3, velocity=0.1, duration=30.0)
    times = [event.time for event in motion.events if event.kind == "slip"]
    assert len(times) >= 2
    loop = saltus.simulate(belt, x=0.3, velocity=0.1, duration=times[1] - times[0])
    balance = energies(loop)
    energy = balance.energy.to_series()
    assert energy["friction.belt"] == pytest.approx(energy["ground.belt"], rel=1e-10)
    assert energy["kinetic"] + energy["potential"] == pytest.approx(0.0, abs=1e-11)
    slip = next(event.time for event in loop.events if event.kind == "stick")
    start, end = loop.at(0.0)[0], loop.at(slip)[0]
    assert energy["friction.belt"] == pytest.approx(0.2 * (0.1 * slip - (end - start)), rel=1e-10)


def test_the_power_of_an_orbit_is_split_between_dashpot_and_stops():
    system = saltus.System(
        model=saltus.TwoStops(damping=0.2, left=-0.3, right=0.3),
        load=saltus.Load(frequency=1.1, force=saltus.Harmonic(0.5)),
        impact=saltus.NewtonImpact(0.7),
    )
    orbit = saltus.find_orbit(system, x=0.0)
    power = energies(orbit).power.to_series()
    # a symmetric orbit
    assert power["impact.left"] == pytest.approx(power["impact.right"], rel=1e-9)
    motion = orbit.motion()
    speeds = np.abs(
        motion.impacts.velocity_before[motion.impacts.time < motion.start + orbit.duration]
    )
    assert power["impact.left"] + power["impact.right"] == pytest.approx(
        np.sum((1 - 0.7**2) * speeds**2 / 2) / orbit.duration, rel=1e-9
    )
    assert power["load.force"] == pytest.approx(saltus.mean_dissipated_power(orbit), rel=1e-10)
    parts = energies(orbit).power
    lost = parts[parts.part.str.startswith("impact")].sum()
    assert float(lost) == pytest.approx(power["impact.left"] + power["impact.right"], rel=1e-12)
    parts = energies(
        saltus.simulate(system.with_({"load.force.amplitude": 0.01}), x=0.0, periods=2)
    ).power
    # a stop that is not struck has no part
    assert float(parts[parts.part.str.startswith("impact")].sum()) == 0.0


@dataclass(frozen=True)
class OwnStop(saltus.OneContactModel):
    """A wall oscillator of a user's own, as it is first written."""

    sides = (1,)

    def acceleration(self, t, theta, velocity, side, load):
        return -theta

    def reset(self, t, velocity, side, load, impact):
        return side, -impact.velocity_after(self, t, velocity, side, side, load)


def test_energies_of_a_model_without_kinetic_energy_say_which_method_is_missing():
    motion = saltus.simulate(
        saltus.System(model=OwnStop(), impact=saltus.NewtonImpact(0.5)), theta=1.0, duration=3.0
    )
    line = (
        r"add kinetic_energy\(self, t, theta, velocity, side, load\), such as return 0\.5 \* "
        r"velocity\*\*2"
    )
    for ask in (energies, saltus.mean_dissipated_power):
        with pytest.raises(
            saltus.ParameterError,
            match=f"^OwnStop defines no kinetic_energy, which this needs: {line}",
        ):
            ask(motion)
    added = type(
        "Own",
        (OwnStop,),
        {"kinetic_energy": lambda self, t, theta, velocity, side, load: 0.5 * velocity**2},
    )
    motion = saltus.simulate(
        saltus.System(model=added(), impact=saltus.NewtonImpact(0.5)), theta=1.0, duration=3.0
    )
    taken = energies(motion).energy.sel(part="impact")
    # from 1 it meets the wall with the speed 1
    assert float(taken) == pytest.approx((1 - 0.5**2) / 2, rel=1e-10)


def test_a_system_has_no_energies_by_itself():
    system = saltus.System(model=OwnStop(), impact=saltus.NewtonImpact(0.5))
    for ask in (
        energies,
        saltus.mean_dissipated_power,
        lambda of: saltus.transmissibility(of, "force"),
    ):
        with pytest.raises(
            saltus.ParameterError,
            match=r"must be an orbit or a motion, got a System; give saltus\.find_orbit",
        ):
            ask(system)
