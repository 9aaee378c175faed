"""Periodic orbits of every kind: they are motions, their multipliers are those of the flow, and
they are what they say.
"""

import math

import numpy as np
import pytest
from orbit_cases import FORCED, orbit_of
from shared_systems import forced, walled

from saltus import Harmonic, Load, Metainterface, System, find_orbit, sensitivities, simulate
from saltus.orbits import is_symmetric

IMPACTS = {"six impacts": 6, "ten impacts": 10, "around a deformed equilibrium": 0, ("wall, "
                                                                                    "free"): 0, ("wall, one "
                                                                                                "impact"): 1,
           "wall, one impact in two periods": 1, ("a user's smooth "
                                                 "model"): 0, "smoothed": 0}  # fmt: skip
PERIODS = {"period 3": 3, "period 3, large": 3, "wall, one impact in two periods": 2}
HALVES = {
    "symmetric",
    "period 3",
    "period 3, large",
    "small",
    "six impacts",
    "ten impacts",
    "rocking block",
    "smoothed",
    "a user's model",  # symmetric about its edge
    "a user's smooth model",
}


def after(orbit, periods, tol=1e-14):
    """The state so many of the load's periods after the orbit's state at phase 0, or at its first
    impact, as a vector.
    """
    motion = simulate(orbit.system, **orbit.start(), periods=periods, tol=tol, dense=False)
    return np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))


def phase_zero(orbit):
    """The orbit's state at phase 0 as the arguments of a motion."""
    position, velocity = orbit.state
    model = orbit.system.model
    if len(model.coordinates) == 1:
        return {model.coordinates[0]: position, "velocity": velocity}
    return orbit.start()


def test_kind_of_each_orbit(name, orbit):
    assert orbit.signature.impact_count == IMPACTS.get(name, 2)
    assert orbit.period == PERIODS.get(name, 1)
    assert orbit.symmetric == (name in HALVES)
    assert orbit.stable
    assert orbit.admissible
    assert orbit.residual < 1e-12


def test_it_comes_back(orbit):
    assert orbit.defect < 1e-12


@pytest.mark.parametrize("name", PERIODS)
def test_it_does_not_come_back_earlier(orbit):
    assert orbit.period > 1
    start = phase_zero(orbit)
    begin = np.append(
        [start[c] for c in orbit.system.model.coordinates], np.atleast_1d(start["velocity"])
    )
    for q in range(1, orbit.period):
        motion = simulate(orbit.system, **start, periods=q, tol=1e-13)
        assert (
            np.abs(
                np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity)) - begin
            ).max()
            > 0.05
        )


def test_multipliers_are_those_of_the_flow(orbit):
    """Over one period from a point of it, with the saltation of every impact: an independent way to
    the same numbers.
    """
    found = sensitivities(orbit.system, **phase_zero(orbit), periods=orbit.period, tol=1e-14)
    of_the_flow = np.linalg.eigvals(found.state).astype(complex)
    distances = np.abs(orbit.multipliers[:, None] - of_the_flow[None, :])
    assert distances.min(axis=0).max() < 1e-8
    assert distances.min(axis=1).max() < 1e-8
    assert np.prod(orbit.multipliers) == pytest.approx(found.determinant, rel=1e-8)


@pytest.mark.parametrize("name", ["symmetric", "unequal layers, losses", "period 3", ("six "
                                                                                     "impacts"), ("ten "
                                                                                                    "impacts"),
                                              ("around a deformed "
                                              "equilibrium"), "small"])  # fmt: skip
def test_product_of_multipliers_is_the_determinant_law(name):
    """e^2 for each impact, exp(-C [c T_lower / (1 + m) + T_upper]) for the time spent on each
    side.
    """
    orbit = orbit_of(name)
    model, e = orbit.system.model, orbit.system.impact.e
    ends = np.append(orbit.impact_times, orbit.impact_times[:1] + orbit.duration)
    spent = {1: 0.0, -1: 0.0}
    if len(orbit.sides):
        # an impact leads to the other side
        for side, duration in zip(-orbit.sides, np.diff(ends), strict=True):
            spent[int(side)] += duration
    else:
        spent[orbit.signature.side] = orbit.duration
    assert spent[1] + spent[-1] == pytest.approx(orbit.duration)
    rate = model.damping * (model.dissipation_ratio * spent[1] / (1 + model.mass_ratio) + spent[-1])
    expected = e ** (2 * len(orbit.sides)) * math.exp(-rate)
    assert np.prod(orbit.multipliers).real == pytest.approx(expected, rel=1e-8)
    assert abs(np.prod(orbit.multipliers).imag) < 1e-12


@pytest.mark.parametrize("name", ["wall, one impact", "wall, one impact in two periods"])
def test_product_of_multipliers_of_the_wall_oscillator(name):
    orbit = orbit_of(name)
    e, c = orbit.system.impact.e, orbit.system.model.damping
    assert np.prod(orbit.multipliers).real == pytest.approx(
        e**2 * math.exp(-c * orbit.duration), rel=1e-8
    )


def test_impacts_and_extrema_are_those_of_the_motion(orbit):
    motion = simulate(orbit.system, **orbit.start(), periods=orbit.period, tol=1e-14)
    shift = orbit.impact_times[:1]  # the motion starts with the first impact, and ends with it
    impacts = [(t, v) for t, v in zip(motion.impacts.time, motion.impacts.velocity_before, strict=True)
               if 1e-6 < t - shift[0] < orbit.duration - 1e-6] if len(shift) else []  # fmt: skip
    assert len(impacts) == max(0, len(orbit.impact_times) - 1)
    for (time, velocity), expected, speed in zip(
        impacts, orbit.impact_times[1:], orbit.speeds[1:], strict=True
    ):
        assert time == pytest.approx(expected, abs=1e-10)
        assert abs(velocity) == pytest.approx(speed, abs=1e-10)
    begin = shift[0] if len(shift) else 0.0
    values = np.atleast_2d(motion.at(np.linspace(begin, begin + orbit.duration, 6001)[:-1])[0])[0]
    assert orbit.highest == pytest.approx(values.max(), abs=2e-5)
    assert orbit.lowest == pytest.approx(values.min(), abs=2e-5)
    assert orbit.amplitude == max(abs(orbit.highest), abs(orbit.lowest))


def test_a_disturbance_decays_as_the_multipliers_say(orbit):
    """A motion from beside it comes back to it: the orbit is stable under the event-driven flow,
    not only by its own matrix.
    """
    start = phase_zero(orbit)
    begin = np.append(
        [start[c] for c in orbit.system.model.coordinates], np.atleast_1d(start["velocity"])
    )
    first = orbit.system.model.coordinates[0]
    size = abs(orbit.multipliers[0])
    periods = orbit.period * max(3, math.ceil(math.log(1e-4) / math.log(max(size, 1e-3))))
    motion = simulate(
        orbit.system,
        **(start | {first: start[first] + 1e-6}),
        periods=periods,
        tol=1e-14,
        dense=False,
    )
    end = np.append(np.atleast_1d(motion.position), np.atleast_1d(motion.velocity))
    assert np.abs(end - begin).max() < 1e-7


def test_margins_are_the_least_along_the_motion():
    orbit = orbit_of("symmetric")
    model, load = orbit.system.model, orbit.system.load
    motion = orbit.motion()
    times = np.linspace(orbit.impact_times[0], orbit.impact_times[0] + orbit.duration, 40_001)[1:-1]
    theta, velocity = motion.at(times)
    side = np.sign(theta)
    acceleration = np.array(
        [model.acceleration(*args, load) for args in zip(times, theta, velocity, side, strict=True)]
    )
    for name, values in model.margins(times, theta, velocity, acceleration, side, load).items():
        assert orbit.margins[name] == pytest.approx(
            float(np.min(values)), abs=2e-3 if name == "reaction" else 1e-6
        )


def test_the_wall_oscillators_orbit_is_the_one_of_the_closed_form():
    """x'' + c x' + k x = A cos(W t): between impacts a damped sine and the steady response, matched
    at the wall by hand.
    """
    orbit = orbit_of("wall, one impact")
    model, load, e = orbit.system.model, orbit.system.load, orbit.system.impact.e
    c, k, W, A = model.damping, model.stiffness, load.frequency, 0.5
    t, v = orbit.impact_times[0], orbit.speeds[0]
    response = A / complex(k - W * W, c * W)

    def steady(time):
        return (response * np.exp(1j * W * time)).real, (
            1j * W * response * np.exp(1j * W * time)
        ).real

    w = math.sqrt(k - c * c / 4)
    x0, v0 = model.wall - steady(t)[0], -e * v - steady(t)[1]
    T = orbit.duration
    decay = math.exp(-c * T / 2)
    x1 = decay * (x0 * math.cos(w * T) + (v0 + c * x0 / 2) / w * math.sin(w * T))
    v1 = decay * (v0 * math.cos(w * T) - (k * x0 + c * v0 / 2) / w * math.sin(w * T))
    assert x1 + steady(t)[0] == pytest.approx(model.wall, abs=1e-12)
    assert v1 + steady(t)[1] == pytest.approx(v, abs=1e-12)


def test_an_orbit_of_the_mirrored_system_is_its_mirror_image():
    system = forced(H=0.3, V=-1.6)
    orbit = orbit_of("around a deformed equilibrium")
    position, velocity = orbit.state
    image = find_orbit(system, parameters=FORCED, theta=1.2)
    assert image.signature.side == -orbit.signature.side
    assert image.highest == pytest.approx(-orbit.lowest, abs=1e-11)
    assert image.lowest == pytest.approx(-orbit.highest, abs=1e-11)
    half = simulate(system, theta=position, velocity=velocity, periods=0.5, tol=1e-14)
    assert np.abs(np.array(image.state) + np.array([half.theta, half.velocity])).max() < 1e-10


def test_a_motion_with_one_impact_over_the_period_is_no_orbit_but_no_crash():
    """Two sides make impacts come in pairs; near a saddle of a chaotic motion a start may show a
    single one.
    """
    from saltus import MotionError

    with pytest.raises(MotionError, match="try another start"):
        find_orbit(forced(H=2.0, W=1.2), parameters=FORCED, theta=0.3, settle=0, period=1)


def test_walls_at_other_places_only_shift_what_moves():
    """x -> x + d with the load's mean moved by k d is the same motion."""
    one, other = walled(A=0.5, wall=0.7), walled(A=0.5, wall=1.9, mean=1.2)
    paths = ("load.frequency", "load.force.amplitude", "model.wall")
    first, second = (
        find_orbit(one, parameters=paths, x=0.2),
        find_orbit(other, parameters=paths, x=1.4),
    )
    assert np.abs(first.speeds - second.speeds).max() < 1e-12
    assert np.abs(first.impact_times - second.impact_times).max() < 1e-12
    assert first.highest + 1.2 == pytest.approx(second.highest, abs=1e-12)
    assert first.lowest + 1.2 == pytest.approx(second.lowest, abs=1e-12)


def test_symmetry_half_a_period_later_is_that_of_every_harmonic():
    """A harmonic of order 20 is 0 at all twentieths of a period; only odd orders change their sign
    in half a period.
    """
    for order in range(1, 41):
        load = Load(
            frequency=1.0,
            horizontal=Harmonic(0.3) + Harmonic(0.1, order=order),
            vertical=Harmonic(-0.5, order=2),
        )
        assert is_symmetric(System(model=Metainterface(beta0=1.4), load=load)) == (order % 2 == 1)
    shifted = Load(frequency=1.0, horizontal=Harmonic(0.3, mean=1e-9), vertical=-0.5)
    assert not is_symmetric(System(model=Metainterface(beta0=1.4), load=shifted))
    # a constant shift moves nothing
    shaken = Load(frequency=1.0, ground_horizontal=Harmonic(0.3, mean=2.0), vertical=-0.5)
    assert is_symmetric(System(model=Metainterface(beta0=1.4), load=shaken))
