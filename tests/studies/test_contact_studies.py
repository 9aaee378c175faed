"""Diagrams, charts and searches of models with several contacts, beside the reduced model and
closed forms.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import saltus
from saltus import (
    BeltOscillator,
    ImpactPair,
    NewtonImpact,
    TwoLayer,
    TwoStops,
    bifurcation_diagram,
    branch_of,
    response_spectrum,
    search_orbits,
    stability_chart,
)
from saltus.attractors import judge
from saltus.attractors.judgement import Reason
from saltus.flow import Ending, Stop
from saltus.orbits import orbits_near_returns, solved_near
from saltus.plots.chart import draw_stability_chart
from saltus.plots.response import draw_diagram
from saltus.studies import bordered_chart
from saltus.studies.chart.motions import CellOutcome
from saltus.studies.diagram.chaos_search import BandOrigin, BandSearch
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import EFFORTS, Effort
from saltus.studies.diagram.simulated import SimulatedMotions, followed
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    System,
    VelocityReduction,
    check_window,
    initial_states,
)

BETA80 = math.radians(80)
FORCE, H = "load.force.amplitude", "load.horizontal.amplitude"


def layers(model, amplitude=0.1, **numbers):
    load = Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=amplitude))
    return System(
        model=model(beta0=BETA80, damping=0.1, **numbers), load=load, impact=VelocityReduction(1.0)
    )


def stops(e=0.7):
    """x'' = A cos tau between stops at -1 and 1."""
    return System(
        model=TwoStops(stiffness=0.0),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.8, phase=math.pi / 2)),
        impact=NewtonImpact(e=e),
    )


@pytest.mark.thorough
def test_a_spectrum_of_both_layers_is_the_reduced_one_where_the_closed_layer_stays_closed():
    """H = 0.1 and frequencies about 1: the same stable branch, to 1e-8 in amplitude, and nothing
    left that is not on it.
    """
    few = {
        "values": [0.95, 1.0, 1.05],
        "starts": 6,
        "max_period": 1,
        "effort": "quick",
        "repelling": 0,
        "switch": False,
    }
    both, reduced = (
        response_spectrum(layers(model), bounds=(0.95, 1.05), **few)
        for model in (TwoLayer, Metainterface)
    )
    assert both.attrs["coordinate"] == "theta_1 theta_2"
    for tree in (both, reduced):
        assert tree["bands"].sizes["band"] == 0
        assert tree["unplaced"].sizes["dot"] == 0
        assert (tree["attractors"]["placed"] == 1).all()
    one, other = (tree["attractors"].to_dataset() for tree in (both, reduced))
    for value in few["values"]:
        here, there = (
            data["amplitude"].values[data["parameter"].values == value] for data in (one, other)
        )
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-8)
    assert draw_diagram(both)[0].get_ylabel() == r"$\max_\tau(|\theta_1|, |\theta_2|)$ (rad)"


def test_a_diagram_between_two_stops_follows_the_closed_form():
    """Motions with one impact at each stop, half a period apart, have after each impact the speed v
    of

    sin(phi) = -v (1 - e) / (2 e A), cos(phi) = (1 - v pi (1 + e) / (4 e)) / A,

    before it v / e, and are stable for A from 0.5 to 0.65. All motions reach both stops: speeds
    tell them apart.
    """
    e = 0.7
    tree = bifurcation_diagram(
        stops(e),
        FORCE,
        (0.5, 0.65),
        values=[0.52, 0.62],
        starts=8,
        max_period=1,
        bands=False,
        repelling=0,
        switch=False,
    )
    compared = 0
    for number in range(tree["branches"].sizes["branch"]):
        branch = branch_of(tree, number)
        regular = (branch["impact_count"].values == 2) & (branch["stable"].values == 1)
        for A, speed in zip(
            branch["parameter"].values[regular], e * branch["slowest"].values[regular], strict=True
        ):
            sine, cosine = -(1 - e) / (2 * e * A), -math.pi * (1 + e) / (4 * e * A)
            assert (sine * speed) ** 2 + (1 / A + cosine * speed) ** 2 == pytest.approx(
                1.0, abs=1e-8
            )
            compared += 1
    assert compared > 5
    assert draw_diagram(tree)[0].get_ylabel() == "least speed of an impact"  # all amplitudes are 1
    assert draw_diagram(tree, "amplitude")[0].get_ylabel() == r"$\max_\tau |x|$"
    # motions of three periods, beside these from 0.62 on
    assert set(tree["unplaced"]["reason"].values.tolist()) <= {"longer"}


def test_chaos_between_two_walls_is_a_band_and_regular_motion_beside_it_is_none():
    """At A = 1.1 motions settle; at 1.9 (e = 0.9) they part with the exponent that pairs of
    neighbouring motions have there.
    """
    coarse = replace(EFFORTS[Effort.QUICK].chaos, step=0.5, fine_step=0.5, edge=0.5)
    at, area = np.repeat([1.1, 1.9], 4), check_window(None, stops())
    begun = followed(stops(0.9), FORCE, at, initial_states(stops(), 8, area, 0), 300)
    search = BandSearch(DiagramWork(stops(0.9), FORCE), (1.1, 1.9), coarse)
    search.look(begun)
    bands = search.bands
    assert bands.bands[-1].high == 1.9
    assert not any(1.1 in band for band in bands.bands)
    values, exponents = bands.tried.values, bands.tried.exponent
    growth, length = [], 2 * math.pi
    system = stops(0.9).with_({FORCE: 1.9})
    state, apart = np.array([0.1, 0.5]), 1e-8
    direction = np.array([apart, 0.0])
    for _ in range(400):
        begun = [state, state + direction]
        one, other = (
            saltus.simulate(system, x=x, velocity=v, periods=1, dense=False) for x, v in begun
        )
        state, change = (
            np.array([one.x, one.velocity]),
            np.array([other.x - one.x, other.velocity - one.velocity]),
        )
        growth.append(math.log(np.linalg.norm(change) / np.linalg.norm(direction)))
        direction = change * (apart / np.linalg.norm(change))
        direction[0] = np.clip(state[0] + direction[0], -1.0, 1.0) - state[0]
    error = np.std(growth[20:]) / math.sqrt(len(growth) - 20) / length
    found, its_error = exponents[values == 1.9][0], bands.tried.error[values == 1.9][0]
    assert abs(np.mean(growth[20:]) / length - found) < 3 * math.hypot(error, its_error / 2)


def test_chaos_at_inner_values_alone_is_followed_to_the_ends_of_the_range():
    """Between two stops there is chaos up to the end of the range, and none at its beginning. A
    band ended at the outermost value that was given, as if the range did."""
    coarse = replace(EFFORTS[Effort.QUICK].chaos, step=0.3, fine_step=0.3, edge=0.3, beside=())
    at, area = np.full(4, 1.7), check_window(None, stops())
    begun = followed(stops(0.9), FORCE, at, initial_states(stops(), 4, area, 0), 300)
    search = BandSearch(DiagramWork(stops(0.9), FORCE), (1.1, 1.9), coarse)
    search.look(begun)
    # with so few motions a value between may seem to have none
    bands = search.bands.bands
    assert bands[-1].high == 1.9
    assert 1.1 < bands[0].lower.outer < bands[0].low <= 1.7


def test_a_chart_of_both_layers_is_the_reduced_one_where_the_closed_layer_stays_closed():
    """At V = -1 the closed layer stays closed for H up to 0.25, at V = -0.5 and H = 0.25 it does
    not (docs/both_layers.md).
    """
    axes = {"horizontal": [0.05, 0.15, 0.25], "vertical": [-1.0, -0.5], "starts": 6}
    both, reduced = (stability_chart(layers(model), **axes) for model in (TwoLayer, Metainterface))
    np.testing.assert_allclose(
        both["amplitude"].values[0], reduced["amplitude"].values[0], rtol=0, atol=1e-6
    )
    assert abs(float(both["amplitude"][1, 2] - reduced["amplitude"][1, 2])) > 1e-3
    np.testing.assert_array_equal(both["count"].values[0], reduced["count"].values[0])
    assert {"motion_theta_1", "motion_theta_2_velocity", "motion_slowest"} <= set(both)
    assert r"\theta_2" in draw_stability_chart(both).figure.axes[-1].get_ylabel()


def test_a_chart_tells_motions_apart_that_all_reach_both_stops():
    """Between two stops every motion has the amplitude 1; at A = 0.8 the two that are mirror images
    of one another count once.
    """
    chart = stability_chart(
        stops(), horizontal=[0.8], vertical=[0.0], paths=(FORCE, "model.damping"), starts=12
    )
    wide = stability_chart(
        stops(),
        horizontal=[0.52, 0.6],
        vertical=[0.0, 0.01],
        paths=(FORCE, "model.damping"),
        starts=4,
    )
    assert draw_stability_chart(wide).figure.axes[-1].get_ylabel() == "least speed of an impact"
    speeds = chart["motion_slowest"].values[np.isfinite(chart["motion_slowest"].values)]
    assert len(speeds) == int(chart["count"].values[0, 0])
    assert (np.diff(np.sort(speeds)) > 1e-4).all()


def test_a_cell_whose_only_motion_has_a_longer_period_than_is_looked_for_is_not_at_rest():
    """A mass on a belt that moves cannot come to rest; here it repeats itself every seven periods,
    a chart looks for six.
    """
    model = BeltOscillator(kinetic=0.2, static=0.3, belt_speed=0.1, damping=0.02)
    belt = System(model=model, load=Load(frequency=0.3, force=Harmonic(amplitude=0.2636)))
    assert saltus.classify(belt, x=0.1).period == 7
    axes = {
        "horizontal": [0.2636],
        "vertical": [0.3],
        "paths": (FORCE, "load.frequency"),
        "starts": 4,
    }
    for max_period, words in ((6, "long"), (7, "one_motion")):
        outcome = stability_chart(belt, **axes, max_period=max_period)["outcome"]
        assert outcome.attrs["flag_meanings"].split()[int(outcome[0, 0])] == words


@pytest.mark.thorough
def test_a_search_finds_the_orbit_of_both_layers_and_says_what_it_searched():
    """The stable orbit of the reduced model at H = 0.1, and no other of one period."""
    both, reduced = (
        search_orbits(layers(model), H, [0.1], max_period=1, starts=8)
        for model in (TwoLayer, Metainterface)
    )
    stable = [
        [orbit.amplitude for orbit in search.orbits if orbit.stable] for search in (both, reduced)
    ]
    np.testing.assert_allclose(stable[0], stable[1], rtol=0, atol=1e-9)
    assert len(both.window) == 4


@pytest.mark.thorough
def test_what_the_massless_hinge_ends_is_neither_rest_nor_settled():
    """Without mass, under a large load: each motion ends at the hinge, so that it is not known
    where it would have gone.
    """
    pressed = layers(TwoLayer, amplitude=0.9).with_({"load.vertical": -1.0})
    window = check_window(None, pressed)
    states = initial_states(pressed, 6, window, 0)
    stops_of = {
        saltus.simulate(pressed, theta_1=a, theta_2=b, velocity=v, periods=400).stop
        for a, b, *v in states
    }
    assert stops_of == {Stop.SINGULAR}
    judged = judge(pressed, states[None], {})
    assert (judged.ending[0], judged.reason[0]) == (Ending.UNDECIDED, Reason.LIMIT)
    chart = stability_chart(pressed, horizontal=[0.9], vertical=[-1.0], starts=6)
    assert (int(chart["outcome"][0, 0]), int(chart["unsettled"][0, 0])) == (
        CellOutcome.UNDECIDED,
        6,
    )
    few = {"values": [1.0], "starts": 6, "max_period": 1, "bands": False, "effort": "quick"}
    diagram = response_spectrum(pressed, bounds=(0.995, 1.005), **few)
    assert diagram["search"]["ended"].values.tolist() == [6]
    assert diagram.attrs["ended_share"] > 0.9


def fold_between_stops(e):
    """The force A below which a free mass has no motion with one impact at each stop a period.

    With a = -k / A, b = 1 / A, c = -pi (1 + k) / (2 A) and k = (1 - e) / (2 e) the speed v at which
    it leaves a stop has (a v)^2 + (b + c v)^2 = 1, whose two solutions meet where c^2 = a^2 (b^2 -
    1).
    """
    return 1 / np.sqrt(1 + (math.pi / 2 * (1 + e) / (1 - e)) ** 2)


def test_a_chart_between_stops_has_the_closed_form_as_its_border():
    """In the plane of force and restitution: the curve of folds, and the ends of motions between
    cells, found by simulation.
    """
    axes = {
        "horizontal": np.linspace(0.36, 0.6, 5),
        "vertical": np.linspace(0.04, 0.2, 3),
        "paths": (FORCE, "impact.e"),
    }
    made = bordered_chart(stops(), **axes, starts=6, curves=1)
    curve = made["borders/curve_00"]
    assert (curve.attrs["kind"], curve.attrs["period"]) == ("LP", 1)
    assert np.abs(curve["horizontal"] - fold_between_stops(curve["vertical"])).max() < 1e-12
    ends = made["borders/ends"].to_dataset()
    ends = ends.where((ends["period"] == 1) & (ends["vertical"].isin(axes["vertical"])), drop=True)
    assert ends.sizes["end"] == 3  # one in each row
    beside = np.abs(ends["horizontal"] - fold_between_stops(ends["vertical"]))
    assert (beside <= 1.02 * ends["uncertainty"] * 0.04).all()


@pytest.mark.thorough
def test_what_simulation_says_of_the_ends_of_motions_of_both_layers_continuation_says_too():
    """A sample of them is solved for as orbits; and where a gap touches without speed a motion goes
    on.
    """
    both = layers(TwoLayer, amplitude=0.5).with_({"impact": NewtonImpact(e=0.0)})
    made = bordered_chart(
        both,
        horizontal=np.linspace(0.05, 0.9, 18),
        vertical=np.linspace(-1.0, -0.2, 5),
        starts=6,
        curves=1,
    )
    counts = made["disagreements"].attrs
    assert counts["located"] + counts["harmless"] == counts["changes"] >= 10
    assert counts["sampled_agree"] == counts["sampled"] >= 6
    curve = made["borders/curve_00"]
    assert float(curve["residual"].max()) < 1e-9


def test_orbits_of_a_loose_mass_that_no_wall_touches_are_a_continuum_and_no_branch():
    """The case moves as Z exp(i Omega t), Z = F / (1 - Omega^2 + i c Omega), and the mass stands
    still at any place between the walls: each is an orbit with the multiplier 1 twice. A near
    return leads to one of them, and none of them is followed."""
    frequency, damping, force = 0.6, 0.02, 0.05
    load = Load(frequency=frequency, force=Harmonic(amplitude=force, phase=math.pi / 2))
    pair = System(
        model=ImpactPair(mass_ratio=0.1, damping=damping), load=load, impact=NewtonImpact(e=0.6)
    )
    peak = force / (1 - frequency**2 + 1j * damping * frequency)
    z, velocity = peak.real, (1j * frequency * peak).real
    state = np.array([z, 0.1 - z, velocity, -velocity])
    orbit = solved_near(pair, "load.frequency", state, 1)
    assert orbit is not None
    np.testing.assert_allclose(np.sort(np.abs(orbit.multipliers - 1.0))[:2], 0.0, atol=1e-9)
    shift = 1e-3 * np.array([1.0, -1.0, 0.0, 0.0])
    returns = np.stack([state + shift, state + 0.5 * shift])[None, None]
    assert (
        orbits_near_returns(
            pair, "load.frequency", np.array([frequency]), returns, [np.empty((0, 4))], 1
        )
        == []
    )


def test_a_stored_diagram_of_two_stops_is_the_one_without_a_store_and_is_found_again(tmp_path):
    few = {
        "values": [0.52, 0.62],
        "starts": 4,
        "max_period": 1,
        "effort": "quick",
        "repelling": 0,
        "switch": False,
    }
    plain = bifurcation_diagram(stops(), FORCE, (0.5, 0.65), **few)
    for _ in range(2):  # computed, then read
        kept = bifurcation_diagram(
            stops(), FORCE, (0.5, 0.65), **few, store=tmp_path / "diagram.zarr"
        )
        for name in ("points", "attractors", "special", "bands"):
            assert kept[name].to_dataset().identical(plain[name].to_dataset())


def test_of_special_points_that_crowd_only_some_are_looked_beside(monkeypatch):
    begun = []
    settings = replace(EFFORTS[Effort.QUICK].chaos, beside=(0.0,), spacing=0.1)
    search = BandSearch(DiagramWork(stops(), FORCE), (1.0, 2.0), settings)
    monkeypatch.setattr(
        search, "simulate_starts", lambda motions: begun.extend(one.value for one in motions)
    )
    search.beside_special_points(
        [BandOrigin("LP", value, (0.0, 0.5)) for value in (1.3, 1.0, 1.05, 1.125)]
    )
    assert begun == [1.0, 1.125, 1.3]


def test_impacts_that_die_away_are_not_counted_where_chaos_is_looked_for():
    """How many are followed changes along a parameter, and nothing else does: intervals would be
    halved there.
    """
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(0.5))
    work = SimpleNamespace(system=saltus.System(model=saltus.ImpactPair(), load=load))
    search, n, none = BandSearch(work, (0.0, 1.0)), 4, np.full((4, 1), np.nan)
    search._settle(
        SimulatedMotions(
            value=np.full(n, 0.5),
            periods=np.ones(n),
            last=np.zeros((n, 4)),
            outcome=np.full(n, Ending.PERIODIC),
            period=np.ones(n, dtype=int),
            impact_count=np.array([113, 122, 2, 3]),
            highest=np.ones(n),
            lowest=np.zeros(n),
            slowest=np.array([1e-7, 2e-7, 0.1, 0.1]),
            states=np.full((n, 1, 4), np.nan),
            peaks=none,
        )
    )
    assert search.entry(0.5).kinds == {(1, 0), (1, 2), (1, 3)}
