"""Stable manifolds: invariant, drawn to the saddle, and where basins meet; separatrices against
closed forms and SciPy.
"""

import math

import numpy as np
import pytest
from attractor_cases import strobes
from reference_manifolds import manifold
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from shared_systems import forced, steady, walled

import saltus
from saltus.attractors.basins.grid import basins_of_attraction
from saltus.attractors.phase_plane import saddles, separatrices
from saltus.attractors.saddle_manifolds import (
    MANIFOLDS,
    Manifold,
    stable_manifold,
    unstable_manifold,
)
from saltus.errors import ParameterError
from saltus.systems.reversed import reversed_load, reversed_system
from saltus.theory import equilibria, wall_orbits


@pytest.fixture(scope="module")
def saddle() -> saltus.PeriodicOrbit:
    """Of the three orbits between the folds at H = 0.5 the one that repels."""
    found = saltus.search_orbits(forced(W=0.88), "load.frequency", [0.88], max_period=1, starts=32)
    return next(orbit for orbit in found.orbits if not orbit.stable)


@pytest.fixture(scope="module")
def curve(saddle: saltus.PeriodicOrbit) -> Manifold:
    return stable_manifold(saddle, window=((-3.0, 3.0), (-3.0, 3.0)))


@pytest.fixture(scope="module")
def longer() -> Manifold:
    """Of a saddle of period 3."""
    found = saltus.search_orbits(forced(1.0, 2.4), "load.frequency", [2.4], max_period=3, starts=32)
    orbit = next(orbit for orbit in found.orbits if orbit.period == 3 and not orbit.stable)
    return stable_manifold(orbit, window=((-2.0, 2.0), (-2.0, 2.0)), periods=24, step=0.02)


@pytest.fixture(scope="module")
def turning() -> Manifold:
    """Of an orbit that has doubled its period, whose multipliers are below 0, with impacts that
    lose speed.
    """
    system = walled(0.5, 2.6, wall=0.3, e=0.5)
    family = wall_orbits(system, 2)
    speed = 1.02 * family.doubling_speed
    known = family.orbit(speed)
    if abs(known.multipliers).max() < 1.0:
        known = family.orbit(0.98 * family.doubling_speed)
    x, velocity = known.state(0.0)
    loaded = system.with_({"load.force.amplitude": known.amplitude})
    orbit = saltus.find_orbit(loaded, x=float(x), velocity=float(velocity), period=2, settle=0)
    return stable_manifold(orbit, window=((-2.0, 0.3), (-3.0, 3.0)), periods=12, step=0.05)


def edge_of(labels: np.ndarray) -> np.ndarray:
    """The places (row, column) of cells with another label beside them, above or to the right."""
    edge = np.zeros(labels.shape, dtype=bool)
    edge[:, :-1] |= labels[:, 1:] != labels[:, :-1]
    edge[:-1] |= labels[1:] != labels[:-1]
    return np.argwhere(edge)


@pytest.mark.parametrize("which", ["curve", "longer", "turning"])
def test_forward_it_shrinks_onto_its_first_segment_to_1e_8(
    which: str, request: pytest.FixtureRequest
) -> None:
    found: Manifold = request.getfixturevalue(which)
    system, q = found.orbit.system, found.orbit.period
    rng, tried = np.random.default_rng(0), 0
    for branch in found.branches:
        inside = np.flatnonzero(
            np.isfinite(branch.states).all(axis=1) & (np.abs(branch.states).max(axis=1) < 3.0)
        )
        for i in rng.choice(inside, 6):
            periods = math.floor(branch.place[i] * q + 1e-9)
            share = branch.place[i] - periods / q
            if share < 0.0 or share > 1.0 or periods > 12:
                continue
            end = strobes(system, branch.states[i], periods)[-1]
            point = (branch.point + periods) % q
            offset = end - found.orbit_states[point]
            along = offset @ found.directions[point]
            # directions are carried from point 0 on, and turn where a round is complete
            rounds = (branch.point + periods) // q
            assert np.sign(along) == branch.side * np.sign(found.multiplier) ** rounds
            assert np.abs(offset - along * found.directions[point]).max() < 1e-8
            assert np.abs(offset).max() < 10.0 * MANIFOLDS.offset / min(1.0, abs(found.multiplier))
            tried += 1
    assert tried >= 6
    assert (found.multiplier < 0.0) == (which == "turning")


def test_each_point_goes_to_its_place_a_period_before(curve: Manifold) -> None:
    """The map shifts the place by 1: so the image of the points of one level are points of the
    level before, to 1e-8.
    """
    for branch in curve.branches:
        levels = [np.flatnonzero(np.floor(branch.place + 1e-12) == n) for n in (6, 7)]
        before = {round(float(branch.place[i]) % 1.0, 12): branch.states[i] for i in levels[0]}
        pairs = [
            (i, before[key])
            for i in levels[1]
            if (key := round(float(branch.place[i]) % 1.0, 12)) in before
        ]
        assert len(pairs) >= 8
        for i, image in pairs[1:9]:
            assert strobes(curve.orbit.system, branch.states[i], 1)[-1] == pytest.approx(
                image, abs=1e-8
            )


def test_motions_from_it_approach_the_saddle_and_those_beside_it_leave_to_both_sides(
    curve: Manifold,
) -> None:
    system, stable = curve.orbit.system, [1.58618614, 2.25614202]
    branch = curve.branches[0]
    inside = np.flatnonzero(
        np.isfinite(branch.states).all(axis=1)
        & (branch.place > 6)
        & (np.abs(branch.states[:, 0]) < 2.5)
    )
    i = inside[len(inside) // 2]
    path = strobes(system, branch.states[i], 14)
    apart = np.abs(path - curve.orbit_states[0]).max(axis=1)
    assert apart.min() < 1e-4 < 0.3 < apart[0]
    tangent = branch.states[i + 1] - branch.states[i - 1]
    aside = 1e-3 * np.array([-tangent[1], tangent[0]]) / np.hypot(*tangent)
    ends = []
    for sign in (1.0, -1.0):
        theta, velocity = strobes(system, branch.states[i] + sign * aside, 70)[-1]
        ends.append(saltus.simulate(system, theta=theta, velocity=velocity, periods=1))
    highest = sorted(
        np.abs(motion.at(np.linspace(0.0, motion.time, 2001))[0]).max() for motion in ends
    )
    assert highest == pytest.approx(stable, abs=1e-3)


def test_the_boundary_of_the_basins_lies_on_it_to_a_cell(curve: Manifold) -> None:
    grid = np.linspace(-3.0, 3.0, 101)
    labels = basins_of_attraction(curve.orbit.system, theta=grid, velocity=grid)["label"].values
    cell = grid[1] - grid[0]
    edge = grid[edge_of(labels)][:, ::-1]
    on = curve.states[np.isfinite(curve.states).all(axis=1)]
    assert cKDTree(on).query(edge)[0].max() < 1.5 * cell
    inside = on[np.abs(on).max(axis=1) < 2.9]
    assert len(inside) > 300
    assert cKDTree(edge).query(inside)[0].max() < 1.5 * cell


def test_with_impacts_that_lose_speed_the_multiplier_is_the_closed_forms_and_the_basins_meet_on_it() -> (
    None
):
    system = walled(0.6, 2.6, wall=0.3, e=0.5)
    family = wall_orbits(system, 2)
    speed = brentq(lambda v: family.amplitude(v) - 0.6, 1e-6, family.fold_speed)
    known = family.orbit(speed)
    x, velocity = known.state(0.0)
    orbit = saltus.find_orbit(system, x=float(x), velocity=float(velocity), period=2, settle=0)
    found = stable_manifold(orbit, window=((-1.0, 0.3), (-1.5, 1.5)), periods=20)
    assert found.multiplier == pytest.approx(min(np.abs(known.multipliers)), rel=1e-9)
    assert len({branch.point for branch in found.branches}) == 2
    grid = np.linspace(-1.0, 0.3, 66), np.linspace(-1.5, 1.5, 61)
    labels = basins_of_attraction(system, x=grid[0], velocity=grid[1])["label"].values
    cell = np.array([grid[0][1] - grid[0][0], grid[1][1] - grid[1][0]])
    places = edge_of(labels)
    edge = np.stack([grid[0][places[:, 1]], grid[1][places[:, 0]]], axis=1) / cell
    on = found.states[np.isfinite(found.states).all(axis=1)] / cell
    assert len(edge) > 50
    assert cKDTree(on).query(edge)[0].max() < 1.5


def test_neighbours_are_as_close_as_the_step(curve: Manifold) -> None:
    for branch in curve.branches:
        chords = np.hypot(*np.diff(branch.states, axis=0).T)
        inside = (np.abs(branch.states) <= 3.0).all(axis=1)
        assert chords[inside[1:] & inside[:-1]].max() <= 0.01 * 3.0 * (1 + 1e-9)


def test_the_unstable_manifold_leads_to_both_attractors(saddle: saltus.PeriodicOrbit) -> None:
    found = unstable_manifold(saddle, periods=80, step=0.05)
    assert found.multiplier * stable_manifold(
        saddle, periods=1, step=0.2
    ).multiplier == pytest.approx(
        math.exp(-0.1 * 2.0 * math.pi / 0.88), rel=1e-9
    )  # the determinant of the map
    ends = sorted(float(branch.states[-1, 0]) for branch in found.branches)
    attracting = saltus.search_orbits(
        forced(W=0.88), "load.frequency", [0.88], max_period=1, starts=16, repelling=0
    ).orbits
    assert ends == pytest.approx(sorted(orbit.state[0] for orbit in attracting), abs=1e-5)


def test_only_saddles_have_manifolds(saddle: saltus.PeriodicOrbit) -> None:
    with pytest.raises(ParameterError, match="only a saddle"):
        stable_manifold(saltus.find_orbit(forced(), theta=0.3))
    with pytest.raises(ParameterError, match="window must be"):
        stable_manifold(saddle, window=((1.0, 0.0), (0.0, 1.0)))


@pytest.mark.parametrize(
    "system", [forced(0.4, 0.9), walled(0.5, wall=0.7)], ids=["metainterface", "wall with a loss"]
)
def test_backward_motions_come_from_where_forward_ones_began(system: saltus.System) -> None:
    name = system.model.coordinates[0]
    motion = saltus.simulate(
        system, **{name: 0.3}, velocity=0.25, time=0.4, duration=17.0, tol=1e-14
    )
    assert len(motion.impacts) >= 2
    back = saltus.simulate(
        reversed_system(system),
        **{name: getattr(motion, name)},
        velocity=-motion.velocity,
        time=-17.4,
        duration=17.0,
        tol=1e-14,
    )
    assert getattr(back, name) == pytest.approx(0.3, abs=1e-10)
    assert back.velocity == pytest.approx(-0.25, abs=1e-10)
    assert len(back.impacts) == len(motion.impacts)


def test_a_reversed_load_is_the_load_at_minus_the_time() -> None:
    record = saltus.Record(
        [0.0, 0.4, 1.0, 1.7, 2.2], [0.0, 0.3, -0.2, 0.5, 0.1], quantity="velocity"
    )
    load = saltus.Load(
        frequency=1.3,
        horizontal=saltus.Harmonic(0.4, mean=0.1, phase=0.7, order=2)
        + saltus.Harmonic(0.2, phase=-1.0)
        + 0.3,
        vertical=-0.5,
        ground_horizontal=record,
    )
    back, times = reversed_load(load), np.linspace(-2.1, 2.1, 29)
    for name in ("horizontal", "vertical", "ground_horizontal"):
        one, other = getattr(load, name), getattr(back, name)
        assert other.acceleration(times) == pytest.approx(
            np.asarray(one.acceleration(-times)), abs=1e-12
        )
        assert other.velocity(times) == pytest.approx(-np.asarray(one.velocity(-times)), abs=1e-12)
        if name != "ground_horizontal":
            assert other(times) == pytest.approx(np.asarray(one(-times)), abs=1e-12)


@pytest.mark.parametrize(
    "impact",
    [saltus.VelocityReduction(0.0), saltus.EnergyRestitution(0.9), saltus.InelasticImpact()],
)
def test_impacts_without_an_inverse_are_refused(impact) -> None:
    with pytest.raises(ParameterError, match="cannot be followed backward"):
        reversed_system(forced().with_({"impact": impact}))


def test_the_separatrices_of_a_rocking_block_have_the_energy_of_its_saddles_up_to_the_next_impact() -> (
    None
):
    """v^2 / 2 + cos(alpha - |theta|) = 1. All of them come from overturned blocks."""
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.3), impact=saltus.VelocityReduction(0.9)
    )
    found = separatrices(block, window=((-2.0, 2.0), (-2.0, 2.0)))
    assert [(round(branch.saddle, 9), str(branch.end)) for branch in found] == [
        (s, "limit") for s in (-0.3, -0.3, 0.3, 0.3)
    ]
    assert sorted(len(branch.impacts) for branch in found) == [0, 0, 1, 1]
    for branch in found:
        first = (
            branch.time >= branch.impacts[0, 0]
            if len(branch.impacts)
            else np.ones(branch.time.size, dtype=bool)
        )
        theta, velocity = branch.theta[first], branch.velocity[first]
        assert first.sum() > 20
        energy = velocity**2 / 2 + np.cos(0.3 - np.abs(theta))
        assert np.abs(energy[np.isfinite(energy)][:-2] - 1).max() < 1e-10


def test_without_damping_a_separatrix_has_the_energy_of_its_saddle() -> None:
    system = steady(C=0.0)
    energy = {e.theta: e.energy for e in equilibria(system)}
    (rest,) = (value for theta, value in energy.items() if theta == 0.0)
    for branch in separatrices(system):
        top = min(energy.items(), key=lambda item: abs(item[0] - branch.saddle))[1]
        assert branch.end == "saddle"
        for velocity in branch.impacts[:, 1]:
            assert 0.5 * velocity**2 == pytest.approx(top - rest, abs=1e-9)
    assert sum(len(branch.impacts) for branch in separatrices(system)) == 2


def test_separatrices_cross_the_contact_where_an_independent_integration_does() -> None:
    system = steady()
    points = [
        e
        for e in equilibria(system)
        if e.eigenvalues is not None and e.eigenvalues[0].real > 0 > e.eigenvalues[1].real
    ]
    assert [s.place for s in saddles(system)] == pytest.approx([p.theta for p in points], abs=1e-12)
    ours = separatrices(system)
    for point in points:
        for outward in (True, False):
            theirs = manifold(
                system,
                point,
                stable=True,
                outward=outward,
                saddles=[p.theta for p in points],
                bound=9.0,
            )
            speeds = theirs.velocity[theirs.theta == 0.0][::2]
            away = math.copysign(1.0, point.theta) * (1.0 if outward else -1.0)
            (mine,) = (
                b
                for b in ours
                if b.saddle == pytest.approx(point.theta) and (b.theta[1] > b.saddle) == (away > 0)
            )
            count = min(len(speeds), len(mine.impacts))
            assert count >= 2
            assert mine.impacts[:count, 1] == pytest.approx(speeds[:count], abs=1e-7)


def test_separatrices_part_the_basins_of_a_constant_load() -> None:
    system, theta, velocity = steady(), np.linspace(-2.0, 2.0, 61), np.linspace(-1.5, 1.5, 51)
    labels = basins_of_attraction(system, theta=theta, velocity=velocity)["label"].values
    places = edge_of(labels)
    cell = np.array([theta[1] - theta[0], velocity[1] - velocity[0]])
    edge = np.stack([theta[places[:, 1]], velocity[places[:, 0]]], axis=1) / cell
    on = (
        np.concatenate([np.stack([b.theta, b.velocity], axis=1) for b in separatrices(system)])
        / cell
    )
    assert cKDTree(on[np.isfinite(on).all(axis=1)]).query(edge)[0].max() < 1.5


def test_a_varying_load_has_no_phase_plane() -> None:
    with pytest.raises(ParameterError, match="stable_manifold"):
        separatrices(forced())
