"""Bands of chaos: found where chaos is known to be, nowhere else, with narrow edges and the windows
between them.
"""

from dataclasses import replace

import numpy as np
import pytest
from shared_systems import forced, under

from saltus import ParameterError, WallOscillator, chaotic_bands, continue_orbit, find_orbit
from saltus.flow import Ending, find_recurrence
from saltus.orbits import SpecialKind
from saltus.studies.diagram.bands import Band, Edge, EdgeKind, band_dataset, band_origins
from saltus.studies.diagram.chaos_search import BandSearch
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.effort import CHAOS
from saltus.studies.diagram.simulated import simulate_from, starts_at
from saltus.systems import Harmonic, Load, System, check_window

WINDOW = ((-4.0, 4.0), (-4.0, 4.0))
AMPLITUDE, FREQUENCY = "load.horizontal.amplitude", "load.frequency"


# The default steps are shares of a figure's range; over the narrow ranges of these tests larger
# ones are as fine.
COARSE = replace(CHAOS, step=0.01, fine_step=0.005, edge=1e-3)


def bands(system, path, bounds, count=9, starts=4, settings=COARSE):
    values = np.repeat(np.linspace(*bounds, count), starts)
    states = starts_at(
        system, np.linspace(*bounds, count), starts, check_window(WINDOW, system), 0
    ).reshape(-1, 2)
    begun = simulate_from(system, path, values, states, COARSE.settling)
    search = BandSearch(DiagramWork(system, path), bounds, settings)
    search.look(begun)
    return search.bands


@pytest.fixture(scope="module")
def quasi_periodic_band():
    """Where the paper has quasi-periodic motions (errata 22), at Hhat = 0.2."""
    return bands(forced(0.2), FREQUENCY, (0.35, 0.43))


def test_the_band_that_the_paper_calls_quasi_periodic_is_chaotic(quasi_periodic_band):
    widest = max(quasi_periodic_band.bands, key=lambda band: band.high - band.low)
    # the issue and numerics.md: chaotic at 0.38, period 1 at 0.36, a cascade ends at 0.3994
    assert 0.36 < widest.low < 0.365
    assert 0.385 < widest.high < 0.3995
    assert max(band.high for band in quasi_periodic_band.bands) < 0.3995
    assert widest.exponent - widest.error > 0.0
    assert widest.exponent == pytest.approx(0.03, abs=0.012)


@pytest.mark.thorough
def test_a_cascade_of_long_periods_is_followed_to_its_chaos_beside_another_attractor():
    """Fig.

    10a's orbit of period 16 doubles at Omega = 3.8024; four of five random motions settle on period
    1 everywhere here.
    """
    system, bounds = (
        under(ground_horizontal=Harmonic(amplitude=0.25), vertical=-0.5),
        (3.798, 3.814),
    )
    family = continue_orbit(
        find_orbit(
            system.with_({FREQUENCY: 3.799}), theta=-2.513657, velocity=-1.455095, period=16
        ),
        FREQUENCY,
        (3.796, 3.806),
    )
    assert any(
        special.kind == SpecialKind.PD and abs(special.parameter - 3.802431) < 1e-5
        for special in family.special
    )
    settings = replace(COARSE, step=0.1, fine_step=0.05, edge=0.01, beside=(-0.05, 0.05))
    search = BandSearch(DiagramWork(system, FREQUENCY), bounds, settings)
    search.look(
        simulate_from(system, FREQUENCY, np.linspace(*bounds, 5), np.zeros((5, 2)), COARSE.settling)
    )
    assert not search.bands.bands
    search.look(search.given[0].only(slice(0)), band_origins([family]))
    inside = np.array(
        [any(value in band for band in search.bands.bands) for value in (3.8035, 3.809)]
    )
    assert inside.tolist() == [False, True]
    states = np.random.default_rng(2).uniform(-4.0, 4.0, (40, 2))
    ends = find_recurrence(
        system, states, 20_000, parameters={FREQUENCY: np.full(40, 3.809)}, max_period=64, kept=130
    )
    # plain simulation: few random motions stay in that chaos
    assert 0 < (ends.outcome == Ending.UNDECIDED).sum() < 20


def test_the_brackets_of_edges_are_narrow(quasi_periodic_band):
    tried = quasi_periodic_band.tried
    for band in quasi_periodic_band.bands:
        for edge in (band.lower, band.upper):
            assert 0.0 < abs(edge.outer - edge.inner) <= 1.0001 * COARSE.edge * np.ptp(tried.values)
            assert tried.chaotic[tried.values == edge.inner].all()
            assert not tried.chaotic[tried.values == edge.outer].any()


@pytest.mark.thorough
def test_bands_exclude_long_transients_and_the_more_so_beside_transients():
    """A mean life L is excluded with 95 % if none of the motions, all together, has settled within
    3 L forcing periods.
    """
    found = bands(forced(3.0), FREQUENCY, (1.784, 1.82), count=13)
    tried, beside, longest = found.tried, 0, CHAOS.judgements[-1].exposure / 3.0
    for band in found.bands:
        within = (tried.values >= band.low) & (tried.values <= band.high)
        assert 3.0 * tried.mean_life[within].sum() >= CHAOS.judgements[1].exposure
        for edge in (band.lower, band.upper):
            inner, outer = np.searchsorted(tried.values, [edge.inner, edge.outer])
            if tried.verdict[outer] == Ending.TRANSIENT:
                assert tried.mean_life[inner] >= min(CHAOS.longer * tried.mean_life[outer], longest)
                beside += tried.mean_life[outer] > 1000.0
    assert beside  # such transients are longer than those that the first judgement excludes


@pytest.mark.thorough
def test_a_quick_effort_halves_brackets_less_far():
    """To a thousandth of the range where "standard" goes on to a tenth of that; the edge is that of
    the band above.
    """
    low, high = 0.35, 0.37
    found = chaotic_bands(
        forced(0.2), FREQUENCY, (low, high), count=5, starts=4, window=WINDOW, effort="quick"
    )
    widest = max(found.bands, key=lambda band: band.high - band.low)
    assert 0.36 < widest.low < 0.365
    bracket = abs(widest.lower.outer - widest.lower.inner) / (high - low)
    assert 1e-4 < bracket <= 1.0001e-3


def test_plain_simulation_agrees_with_the_bands_at_random_values(quasi_periodic_band):
    """Motions that no band or window knows of, 2000 periods each, at values away from the edges by
    more than their brackets.
    """
    values = np.random.default_rng(5).uniform(0.35, 0.43, 60)
    edges = np.array(
        [
            [band.lower.outer, band.low, band.high, band.upper.outer]
            for band in quasi_periodic_band.bands
        ]
    ).ravel()
    values = values[np.abs(values[:, None] - edges).min(axis=1) > 5e-5]
    states = np.random.default_rng(6).uniform(-0.3, 0.3, (len(values), 6, 2))
    ends = find_recurrence(
        forced(0.2),
        states.reshape(-1, 2),
        2000,
        parameters={FREQUENCY: np.repeat(values, 6)},
        max_period=64,
        kept=130,
    )
    goes_on = (ends.outcome == Ending.UNDECIDED).reshape(-1, 6).any(axis=1)
    in_band = np.array(
        [any(value in band for band in quasi_periodic_band.bands) for value in values]
    )
    assert 5 < in_band.sum() < len(values)
    # but for windows narrower than a hundredth of the range
    assert (goes_on == in_band).mean() > 0.9


def test_the_chaos_that_erratum_32_overlooked_lies_in_a_band():
    """The review of the results, section 2: Omega = 0.5, Hhat = 0.105."""
    found = bands(
        forced(0.1, 0.5),
        AMPLITUDE,
        (0.1, 0.11),
        count=5,
        settings=replace(COARSE, step=0.05, edge=0.01),
    )
    assert any(0.105 in band for band in found.bands)


def test_settled_motions_show_their_cycle_alone(quasi_periodic_band):
    motions = quasi_periodic_band.motions
    shown = np.isfinite(motions.peaks).sum(axis=1)
    assert (shown[motions.periodic] == motions.period[motions.periodic]).all()
    assert len(quasi_periodic_band.to_datasets()["stroboscopic"]["value"]) == shown.sum()


def test_there_is_no_chaos_in_a_linear_oscillator():
    linear = System(
        model=WallOscillator(stiffness=1.0, damping=0.1, wall=50.0),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.1)),
    )
    found = bands(linear, FREQUENCY, (0.5, 2.0))
    assert found.bands == ()
    assert (found.tried.verdict == Ending.PERIODIC).all()


@pytest.mark.thorough
def test_transients_of_chaos_at_high_frequency_make_no_band():
    """numerics.md and the issue: Omega = 4, Hhat between 7.2 and 7.3."""
    found = bands(
        forced(7.2, 4.0),
        AMPLITUDE,
        (7.2, 7.3),
        count=3,
        settings=replace(COARSE, step=0.1, fine_step=0.1),
    )
    assert found.bands == ()
    # it does look like chaos for hundreds of periods
    assert (found.tried.verdict == Ending.TRANSIENT).any()


@pytest.mark.thorough
def test_results_do_not_depend_on_the_run(quasi_periodic_band):
    again = bands(forced(0.2), FREQUENCY, (0.35, 0.43))
    assert again.bands == quasi_periodic_band.bands
    assert np.array_equal(again.tried.states, quasi_periodic_band.tried.states, equal_nan=True)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"path": "load.freq"}, "did you mean 'load.frequency'"),
        ({"bounds": (2.0, 1.0)}, "the smaller one first"),
        ({"bounds": (0.5, np.nan)}, "the smaller one first"),
        ({"count": 1}, "count must"),
        ({"starts": 1.5}, "starts must be a whole number"),
        ({"window": 3}, "window must be"),
        (
            {"system": System(model=forced(1.0).model, load=Load(vertical=-0.5))},
            "give the Load one",
        ),
    ],
)
def test_bad_use_is_answered_with_a_sentence(change, says):
    given = {"system": forced(1.0), "path": "load.frequency", "bounds": (0.5, 2.0)} | change
    with pytest.raises(ParameterError, match=says):
        chaotic_bands(**given)


def test_bands_become_a_dataset_also_where_there_are_none():
    assert band_dataset().sizes["band"] == 0
    data = band_dataset(
        (
            Band(
                Edge(0.2, 0.199, EdgeKind.GRAZING, 0.1995),
                Edge(0.4, 0.4, EdgeKind.BOUND),
                0.1,
                0.01,
            ),
        )
    )
    assert data["kind"].values.tolist() == ["CH"]
    assert data["low_edge"].values.tolist() == ["grazing"]
    assert data["low_special"].values.tolist() == [0.1995]
    assert data["high_edge"].values.tolist() == ["bound"]


def test_an_interval_at_whose_ends_no_motion_is_left_to_begin_with_is_halved_all_the_same():
    """There a motion of a long period was judged, of which no state is kept as settled: such an
    interval was tried for ever.
    """
    search = BandSearch(DiagramWork(forced(0.2), FREQUENCY), (0.0, 1.0))
    for value in (0.5, 0.5005):
        search.entry(value).period = CHAOS.long_period + 1
    search.refine()
    values = [place.value for place in search.entries]
    assert values == pytest.approx([0.5, 0.50025, 0.5005], rel=1e-9)
