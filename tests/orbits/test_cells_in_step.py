"""Orbits of chains of cells that move in step, with restitution: contacts of all cells close at one
instant.
"""

from typing import Any

import numpy as np
import pytest

import saltus
from saltus.orbits import same_orbit
from saltus.orbits.finding import from_motion
from saltus.studies.diagram.branch_set import PlacedBranch, placed
from saltus.studies.diagram.simulated import simulate_from

BETA80 = np.deg2rad(80)
# Chains with a coupling for which their slowest motions of cells against one another are the same;
# three cells are compiled for ten times as long as two.
CHAINS = [(2, 0.25), pytest.param((3, 0.5), marks=pytest.mark.thorough)]


def cells(kind: type, **numbers: Any) -> saltus.System:
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.6))
    return saltus.System(
        model=kind(beta0=BETA80, mass_ratio=0.2, damping=0.05, **numbers),
        load=load,
        impact=saltus.NewtonImpact(e=0.5),
    )


@pytest.fixture(scope="module", params=CHAINS, ids=lambda chain: f"{chain[0]} cells")
def chain(request: pytest.FixtureRequest) -> saltus.System:
    count, coupling = request.param
    return cells(saltus.CellChain, cells=count, coupling=coupling)


def begun(chain: saltus.System, last: float) -> dict[str, float]:
    """Angles from which motions begin, with the lower layer of the last cell at this one."""
    angles = {
        "lower_1": 0.1,
        "upper_1": -0.05,
        "lower_2": 0.12,
        "upper_2": -0.05,
        "lower_3": 0.1,
        "upper_3": -0.06,
    }
    names = chain.model.coordinates
    return {name: angles[name] for name in names} | {names[-2]: last}


@pytest.fixture(scope="module")
def in_step(chain: saltus.System) -> saltus.PeriodicOrbit:
    return saltus.find_orbit(
        chain, **begun(chain, 0.12), velocity=(0.0,) * len(chain.model.coordinates)
    )


@pytest.fixture(scope="module")
def branch(in_step: saltus.PeriodicOrbit) -> saltus.Branch:
    return saltus.continue_orbit(in_step, "load.frequency", (0.999, 1.01))


def test_they_end_on_the_orbit_of_one_cell_whose_multipliers_are_among_theirs(
    in_step: saltus.PeriodicOrbit,
) -> None:
    one = saltus.find_orbit(cells(saltus.TwoLayer), theta_1=0.1, theta_2=-0.05, velocity=(0.0, 0.0))
    for layer, own in (("lower_1", "theta_1"), ("upper_2", "theta_2")):
        amplitude = one.quantity(f"amplitude_{own}")
        assert in_step.quantity(f"amplitude_{layer}") == pytest.approx(amplitude, abs=1e-9)
    assert in_step.residual < 1e-12
    for multiplier in one.multipliers:
        assert np.abs(in_step.multipliers - multiplier).min() < 1e-6
    assert len(one.multipliers) == 4
    assert len(in_step.multipliers) == 2 * len(in_step.system.model.coordinates)
    # cells that part come together slowly
    assert np.abs(in_step.multipliers).max() > np.abs(one.multipliers).max() + 0.1


def test_multipliers_of_cells_that_close_alike_are_those_of_their_motion() -> None:
    """Without restitution each cell closes one layer and opens the other: both belong to the event
    of their own cell.
    """
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.15))
    model = saltus.CellChain(beta0=BETA80, cells=2, coupling=0.5, damping=0.1)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.0))
    orbit = saltus.find_orbit(
        system, lower_1=0.4, upper_1=0.0, lower_2=0.4, upper_2=0.0, velocity=(0.0,) * 4
    )
    # upper_1 opens, then upper_2, and so on
    assert [event.closed for event in orbit.signature.events] == [9, 5, 6, 10]
    state = saltus.sensitivities(system, **orbit.start(), periods=1, tol=1e-12).state
    expected, found = np.linalg.eigvals(state), orbit.multipliers
    for multiplier in expected[np.abs(expected) > 0.01]:
        assert np.abs(found - multiplier).min() < 1e-7


@pytest.mark.thorough
def test_multipliers_of_eight_cells_are_those_of_differences_of_motions() -> None:
    """Without restitution a cell has one layer open at a time: eight angles and their rates
    move.
    """
    load = saltus.Load(frequency=1.0, vertical=-0.5, horizontal=saltus.Harmonic(amplitude=0.15))
    model = saltus.CellChain(beta0=BETA80, cells=8, coupling=0.5, damping=0.1)
    system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.0))
    places = {name: 0.4 if name.startswith("lower") else 0.0 for name in model.coordinates}
    orbit = saltus.find_orbit(system, **places, velocity=(0.0,) * 16)
    start, step, columns = orbit.start(), 1e-6, []
    # all lower ones, or all upper ones
    opened = np.flatnonzero(np.abs([start[name] for name in model.coordinates]) > 1e-3)
    own = np.concatenate([opened, 16 + opened])
    assert len(opened) == 8
    for place in range(16):
        ends = []
        for sign in (1.0, -1.0):
            given = dict(start)
            velocity = np.array(given.pop("velocity"))
            if place < 8:
                given[model.coordinates[opened[place]]] += sign * step
            else:
                velocity[opened[place - 8]] += sign * step
            motion = saltus.simulate(
                system, **given, velocity=tuple(velocity), periods=1, tol=1e-14, dense=False
            )
            ends.append(np.ravel(motion.final_state)[own])
        columns.append((ends[0] - ends[1]) / (2 * step))
    expected = np.linalg.eigvals(np.transpose(columns))
    for multiplier in expected:
        assert np.abs(orbit.multipliers - multiplier).min() < 1e-6


def test_multipliers_are_the_rate_at_which_a_motion_beside_it_comes_back(
    in_step: saltus.PeriodicOrbit,
) -> None:
    """The first and the last cell pushed apart: the slowest motion against each other has the
    largest multiplier.
    """
    largest = np.abs(in_step.multipliers).max()
    state = in_step.start()
    velocity = np.array(state.pop("velocity"))
    velocity[[0, -2]] += 1e-4, -1e-4
    apart = []
    for periods in (20, 30):
        motion = saltus.simulate(
            in_step.system, **state, velocity=tuple(velocity), periods=periods, dense=False
        )
        apart.append(np.abs(np.subtract(motion.position[:2], motion.position[-2:])).sum())
    assert (apart[1] / apart[0]) ** 0.1 == pytest.approx(largest, rel=1e-3)


@pytest.mark.thorough
def test_rounding_makes_no_special_points_along_their_branch(
    request: pytest.FixtureRequest,
    chain: saltus.System,
    in_step: saltus.PeriodicOrbit,
    branch: saltus.Branch,
) -> None:
    """What the cells do at one instant comes in an order that rounding decides, at each point
    anew.
    """
    assert not branch.special
    assert [str(end) for end in branch.ends] == ["bound 0.999", "bound 1.01"]
    assert all(same_orbit(orbit, orbit) for orbit in branch.orbits)
    assert same_orbit(branch.at(1.0)[0], in_step)


@pytest.mark.thorough
def test_eight_cells_in_step_have_the_branch_of_one() -> None:
    """Sixteen coordinates: 272 impacts a period, many of them at one instant."""
    chain = cells(saltus.CellChain, cells=8, coupling=3.28)
    names = chain.model.coordinates
    angles = {name: 0.11 if name.startswith("lower") else -0.055 for name in names}
    angles["lower_8"] = 0.12
    orbit = saltus.find_orbit(chain, **angles, velocity=(0.0,) * len(names))
    one = saltus.find_orbit(
        cells(saltus.TwoLayer), theta_1=0.11, theta_2=-0.055, velocity=(0.0, 0.0)
    )
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.999, 1.01))
    assert not branch.special
    assert [str(end) for end in branch.ends] == ["bound 0.999", "bound 1.01"]
    times = np.linspace(5.1, 11.0, 50)
    together = orbit.motion().at(times)[0]
    lower, upper = one.motion().at(times)[0]
    np.testing.assert_allclose(together[0::2], np.tile(lower, (8, 1)), rtol=0, atol=1e-9)
    np.testing.assert_allclose(together[1::2], np.tile(upper, (8, 1)), rtol=0, atol=1e-9)


@pytest.mark.thorough
def test_the_order_of_events_in_cells_that_do_not_act_on_one_another_makes_no_special_points(
    chain: saltus.System,
) -> None:
    """Below the frequency 0.993 the cells part: the impacts of one come before or after those of
    another.
    """
    system = chain.with_({"load.frequency": 0.97})
    orbit = saltus.find_orbit(
        system, velocity=(0.0,) * len(chain.model.coordinates), **begun(chain, 0.3)
    )
    state = orbit.start()
    assert abs(state["lower_1"] - state[chain.model.coordinates[-2]]) > 0.1
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.96, 0.98))
    assert not branch.special
    assert [str(end) for end in branch.ends] == ["bound 0.96", "bound 0.98"]


@pytest.mark.thorough
def test_maps_of_motions_one_by_one_are_those_of_lanes() -> None:
    """Near returns of systems of many coordinates are improved one by one."""
    system, rng = cells(saltus.TwoLayer), np.random.default_rng(0)
    states = np.column_stack(
        [rng.uniform(0.05, 0.3, 6), rng.uniform(-0.3, -0.05, 6), rng.uniform(-0.2, 0.2, (6, 2))]
    )
    values = np.linspace(0.9, 1.1, 6)
    ends, slopes = from_motion._mapped(system, "load.frequency", values, states, 2)
    singly = from_motion._mapped_singly(system, "load.frequency", values, states, 2)
    np.testing.assert_allclose(singly[0], ends, rtol=0, atol=1e-7)
    np.testing.assert_allclose(singly[1], slopes, rtol=0, atol=1e-5)
    assert np.abs(slopes).max() > 0.01


@pytest.mark.thorough
def test_motions_whose_impacts_die_away_lie_on_the_branch_of_their_orbit(
    request: pytest.FixtureRequest, chain: saltus.System, branch: saltus.Branch
) -> None:
    """Orbits list impacts above 1e-5, motions in lanes all that were followed: down to 1e-6."""
    values = np.array([1.002, 1.008])
    states = np.tile([*begun(chain, 0.12).values(), *(0.0,) * len(chain.model.coordinates)], (2, 1))
    motions = simulate_from(chain, "load.frequency", values, states, 300)
    assert (motions.slowest < 1e-5).all()
    assert placed(motions, [PlacedBranch(branch)], False).all()
