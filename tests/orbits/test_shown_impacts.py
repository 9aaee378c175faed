"""The impacts of an orbit whose impacts die away, in every way in which it is shown; and what
beyond the end of its rests.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus
from saltus.orbits import OrbitEnd

FORCE = "load.force.amplitude"


def bouncing() -> saltus.System:
    """A mass between two stops that it reaches twice a period, where it bounces and rests."""
    load = saltus.Load(frequency=0.3, force=saltus.Harmonic(amplitude=3.0))
    return saltus.System(
        model=saltus.TwoStops(damping=0.05), load=load, impact=saltus.NewtonImpact(0.5)
    )


@pytest.fixture(scope="module")
def orbit() -> saltus.PeriodicOrbit:
    return saltus.find_orbit(bouncing(), x=0.1)


@pytest.fixture(scope="module")
def branch(orbit: saltus.PeriodicOrbit) -> saltus.Branch:
    return saltus.continue_orbit(
        orbit,
        FORCE,
        (2.99, 3.01),
        functions={"wide": lambda other: other.system.get(FORCE) - 3.002},
    )


def counted(orbit: saltus.PeriodicOrbit) -> int:
    """The impacts of one period by direct simulation, down to 1e-5 of the system's natural speed,
    below which they are not told one by one.
    """
    told = 1e-5 * orbit.equations.natural.speed
    return int((own_speeds(orbit) > told).sum())


def own_speeds(orbit: saltus.PeriodicOrbit) -> np.ndarray:
    """The speeds of all impacts of one period that direct simulation resolves."""
    motion = saltus.simulate(orbit.system, **orbit.start(), periods=orbit.period, tol=1e-13)
    return np.abs(motion.impacts.velocity_before).ravel()


def test_it_has_the_impacts_of_its_motion(orbit: saltus.PeriodicOrbit) -> None:
    """How many of an accumulation are resolved is no property of the orbit: those that are told
    are the fastest ones of its motion, in two accumulations that die away alike.
    """
    assert orbit.impact_count == counted(orbit)
    assert len(orbit.impact_times) == len(orbit.speeds) == orbit.impact_count
    fastest = np.sort(own_speeds(orbit))[::-1][: orbit.impact_count]
    np.testing.assert_allclose(np.sort(orbit.speeds)[::-1], fastest, rtol=0, atol=1e-12)
    one, other = orbit.speeds.reshape(2, -1)
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)
    # towards the rest each is e = 0.5 times as fast as the one before
    np.testing.assert_allclose(one[1:][-5:] / one[:-1][-5:], 0.5, rtol=1e-3)


def test_its_text_and_its_table_say_so(orbit: saltus.PeriodicOrbit) -> None:
    assert f"{orbit.impact_count} impacts" in repr(orbit)
    table = orbit._repr_html_()
    assert ">impacts<" in table
    assert f">{orbit.impact_count}<" in table


def test_its_branch_says_so(branch: saltus.Branch) -> None:
    data = branch.to_xarray()
    assert data["impact_count"].values.tolist() == [orbit.impact_count for orbit in branch.orbits]
    assert data["impact_count"].values.min() > 30
    for row in range(0, len(branch.orbits), 3):
        # the last of each of two accumulations
        assert abs(int(data["impact_count"][row]) - counted(branch.orbits[row])) <= 2


def test_its_special_points_say_so(branch: saltus.Branch) -> None:
    (point,) = branch.special
    assert f"{point.orbit.impact_count} impacts" in repr(point)
    assert branch.to_xarray()["special_impact_count"].values.tolist() == [point.orbit.impact_count]
    assert point.orbit.impact_count > 30


def test_orbits_read_from_a_file_say_so(branch: saltus.Branch) -> None:
    again = saltus.orbits.orbits_of(branch.to_xarray())
    assert [orbit.impact_count for orbit in again] == [
        orbit.impact_count for orbit in branch.orbits
    ]


def test_the_times_of_its_impacts_are_those_of_its_own_frequency(
    orbit: saltus.PeriodicOrbit,
) -> None:
    """Along a branch in the frequency."""
    beside = saltus.continue_orbit(orbit, "load.frequency", (0.29, 0.3)).orbits[0]
    assert beside.frequency == 0.29
    motion = saltus.simulate(beside.system, **beside.start(), periods=2, tol=1e-13)
    times = np.sort(beside.impact_times % beside.duration)[:3]
    direct = np.sort(motion.impacts.time % beside.duration)
    assert max(np.abs(direct - time).min() for time in times) < 1e-9


def test_beyond_the_end_of_a_rest_a_branch_of_its_own_begins_as_the_motion_goes_on() -> None:
    """Ahead the impacts no longer die away: orbits with impacts alone, which are the motions that
    settle there.
    """
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=1.9, mean=1.0))
    model = saltus.TwoStops(left=-50.0, right=0.0, stiffness=0.2, damping=0.1)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.4))
    found = saltus.continue_orbit(saltus.find_orbit(system, x=-0.5), FORCE, (1.9, 2.6))
    kinds = [str(point.kind) for point in found.special]
    assert kinds[0] == "CH"
    assert kinds.count("CH") == 1
    assert found.ends[1].reason is OrbitEnd.REST_VANISHES
    assert found.ends[1].parameter == found.special[0].parameter
    (beyond,) = saltus.switch_branch(found.special[0], (1.9, 2.6))
    assert str(beyond.ends[0]).startswith("CH at ")
    assert beyond.ends[1].parameter == 2.6
    assert all(orbit.signature.section is None for orbit in beyond.orbits)
    first = beyond.orbits[1]
    settled = saltus.simulate(first.system, x=-0.5, periods=400, tol=1e-13, dense=False)
    assert first.stable
    assert first.state == pytest.approx((settled.x, settled.velocity), abs=1e-9)
    # at a grazing the motion leaves the orbit by the root of rounding
    assert not beyond.orbits[0].grazes
    followed = [orbit for orbit in beyond.orbits[::5] if not orbit.grazes]
    assert len(followed) > 20
    assert max(saltus.orbits.defects(followed)) < 1e-9


def test_at_a_fold_and_at_a_doubling_an_orbit_is_not_stable() -> None:
    """Its multiplier is 1 or -1, up to rounding."""
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(amplitude=1.9, mean=1.0))
    model = saltus.TwoStops(left=-50.0, right=0.0, stiffness=0.2, damping=0.1)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.4)).with_(
        {FORCE: 2.6}
    )
    found = saltus.continue_orbit(saltus.find_orbit(system, x=-0.5), FORCE, (2.2, 2.7))
    marked = [point for point in found.special if point.kind in ("LP", "PD")]
    assert {"LP", "PD"} <= {str(point.kind) for point in marked}
    for point in marked:
        assert np.abs(np.abs(point.orbit.multipliers) - 1.0).min() < 1e-7
        assert not point.orbit.stable
