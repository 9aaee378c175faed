"""Errata 35 to 39: what is printed fails, and holds as corrected, by two kinds of evidence that can
each fail.
"""

import math

import numpy as np
import pytest
import xarray as xr
from claim_verdicts import claims_of, verdicts
from scipy_motion import by_scipy
from spectrum_cases import branch, diagram, folded, loop
from test_errata import crossings

import saltus
from saltus.branch_tables import branch_tables
from saltus.theory import critical_horizontal, static_angle
from saltus_paper import ClaimVerdict
from saltus_paper.figures import fig13
from saltus_paper.figures.fig09 import static_unit
from saltus_paper.figures.harmonic_loads import AMPLITUDE, under_both, under_force
from saltus_paper.figures.knots_and_jumps import birth
from saltus_paper.figures.load_diagrams import undeformed
from saltus_paper.measures.response_measures import _anticipated, border_of_rest, coexistence
from saltus_paper.measures.spectrum_features import amplitudes_at


@pytest.fixture(scope="module")
def rest_under_both_loads():
    critical = float(critical_horizontal(1.3962634015954636, -0.5, 0.25))
    groups = {
        "undeformed": undeformed(under_both(), critical),
        "disturbed": fig13._disturbed(critical),
    }
    return xr.DataTree.from_dict({**groups, "a": xr.Dataset(attrs={"critical": critical})})


def test_an_attractor_of_a_short_stable_part_lies_on_the_drawn_line():
    """Fig. 11b: three periods, stable between a fold and a doubling that are 1.6e-4 apart.

    SciPy's integrator settles there, Newton's method finds the orbit with its multipliers, and the
    line of the branch, whose steps are longer, passes it as a stable one.
    """
    amplitude, periods = 2.420395, 3
    system = under_force(frequency=1.0, amplitude=amplitude)
    beta0, vertical, damping = math.radians(80.0), -0.5, 0.1

    def acceleration(t, theta, v, side, middle):
        angle = beta0 + side * theta
        push = amplitude * math.sin(t)
        return math.sin(angle) * push + side * math.cos(angle) * vertical - damping * v - theta

    orbit = saltus.find_orbit(system, theta=-0.5543603, velocity=-2.3527150, period=periods)
    assert orbit.stable
    theta, velocity = orbit.section_state
    end = 2.0 * math.pi * periods * 6
    x, v, _, impacts = by_scipy(
        acceleration,
        lambda x, side: side * x,
        (theta + 1e-5, velocity),
        1 if theta > 0.0 else -1,
        0.0,
        end,
    )
    # the disturbance has become smaller by the multipliers, 0.39 in each of the orbit's periods
    assert (x, v) == pytest.approx((theta, velocity), abs=1e-6)
    assert len(impacts) == 6 * orbit.impact_count
    family = saltus.continue_orbit(orbit, AMPLITUDE, (2.41, 2.6))
    branch = saltus.continue_orbit(family.orbits[-1], AMPLITUDE, (1.9, 2.8))
    lines = amplitudes_at(branch.to_xarray(), amplitude, stable=True)
    assert np.abs(lines - orbit.amplitude).min() < 5e-3


def judged(data):
    return claims_of({"fig13-critical": border_of_rest(data)})["fig13-critical"]


def test_erratum_35_rest_is_lost_where_the_ellipse_leaves_the_domain(rest_under_both_loads):
    claim = judged(rest_under_both_loads)
    assert (claim.verdict, claim.erratum) == (ClaimVerdict.CORRECTED, 35)
    assert "0.07635" in claim.evidence
    assert "0.08816" in claim.evidence


@pytest.mark.parametrize(
    ("moved", "verdict"),
    [
        ([1e-5, 1e-3, 1e-5], ClaimVerdict.AS_PRINTED),  # held below the printed amplitude
        ([1e-5, 1e-5, 1e-3], ClaimVerdict.UNDECIDED),  # held just above the corrected one, too
        ([1e-3, 1e-3, 1e-3], ClaimVerdict.UNDECIDED),  # lost before it
    ],
)
def test_erratum_35_needs_both_kinds_of_evidence(rest_under_both_loads, moved, verdict):
    disturbed = rest_under_both_loads["disturbed"].to_dataset().assign(moved=("case", moved))
    data = rest_under_both_loads.assign(disturbed=xr.DataTree(disturbed))
    assert judged(data).verdict is verdict


# --- erratum 36 --------------------------------------------------------------


@pytest.fixture(scope="module")
def first_cycle():
    system = under_force(frequency=1.0, amplitude=0.2)
    found = saltus.continue_orbit(saltus.find_orbit(system, theta=0.3), AMPLITUDE, (1e-3, 0.3))
    attributes = {
        "bounds": [1e-3, 0.3],
        "path": AMPLITUDE,
        "system": system.to_json(),
        "critical": 0.5 / math.tan(math.radians(80)),
    }
    tree = xr.DataTree.from_dict(
        {"/": xr.Dataset(attrs=attributes), **branch_tables([found.to_xarray()])}
    )
    return tree.assign(birth=xr.DataTree(birth(tree)))


def test_erratum_36_the_first_cycle_is_born_at_a_fold_with_an_amplitude_of_its_own(first_cycle):
    claim = claims_of({"fig11-anticipated": _anticipated({1.0: first_cycle})})["fig11-anticipated"]
    assert (claim.verdict, claim.erratum) == (ClaimVerdict.CORRECTED, 36)
    # the reference of two other codes
    assert float(first_cycle["birth"]["fold"]) == pytest.approx(0.0219879514, abs=1e-9)
    stays = first_cycle["birth"].to_dataset().assign(after=first_cycle["birth"]["before"])
    # had the simulated motion stayed, there were no fold
    undone = first_cycle.assign(birth=xr.DataTree(stays))
    assert (
        verdicts({"fig11-anticipated": _anticipated({1.0: undone})})["fig11-anticipated"]
        is ClaimVerdict.UNDECIDED
    )


def test_a_supercritical_cycle_would_be_as_printed():
    load = np.linspace(0.05, 0.2, 40)
    cycle = branch(load, np.sqrt(load - 0.05), np.ones(40), special=[("LP", 0.05, 0.0)])
    tree = diagram(cycle)
    tree.attrs["critical"] = 0.1
    tree["birth"] = xr.DataTree(xr.Dataset({"before": 0.0, "after": 0.0}))
    assert (
        verdicts({"fig11-anticipated": _anticipated({1.0: tree})})["fig11-anticipated"]
        is ClaimVerdict.AS_PRINTED
    )


# --- erratum 37 --------------------------------------------------------------


def exponent(frequency, amplitude, state, periods=80, apart=1e-7):
    """The largest exponent per unit of time of a motion, from a neighbour of it, by SciPy from
    impact to impact.
    """
    period, state, other, sums = 2 * math.pi / frequency, np.array(state), None, []
    for _ in range(periods):
        end, gap = (
            crossings(*state, period, frequency, amplitude, -0.5, 0.1)[1:, -1],
            np.array([1.0, 0.0]),
        )
        if other is not None:
            gap = crossings(*other, period, frequency, amplitude, -0.5, 0.1)[1:, -1] - end
            sums.append(math.log(np.linalg.norm(gap) / apart))
        state, other = end, end + apart * gap / np.linalg.norm(gap)
    return np.mean(sums[5:]) / period


@pytest.mark.parametrize(
    ("frequency", "amplitude", "state"),
    [
        (0.945833333, 2.0, (-1.19484, -2.25574)),
        pytest.param(0.559166667, 3.0, (-0.13854, -0.25262), marks=pytest.mark.thorough),
    ],
)
def test_erratum_37_motions_outside_the_printed_ranges_are_chaotic_by_another_integrator(
    frequency, amplitude, state
):
    assert exponent(frequency, amplitude, state) > 0.02


def test_the_exponent_of_a_periodic_motion_by_the_other_integrator_is_negative():
    assert exponent(0.6, 0.5, (0.8, 0.1), periods=40) < -0.01


# --- erratum 39 --------------------------------------------------------------


def followed(amplitude, state, periods):
    """At Omega = 1, by SciPy from impact to impact: the states after each period, and the least
    speed of an impact and the least abs(theta) of a turning point on the way."""
    states, slowest, nearest = [np.array(state)], np.inf, np.inf
    for _ in range(periods):
        _, theta, velocity = crossings(*states[-1], 2 * math.pi, 1.0, amplitude, -0.5, 0.1)
        touches = np.flatnonzero(theta[1:] == 0.0) + 1
        turns = np.flatnonzero(velocity[1:] * velocity[:-1] < 0.0)
        slowest = min(slowest, float(np.abs(velocity[touches]).min(initial=np.inf)))
        nearest = min(nearest, float(np.abs(theta[turns]).min(initial=np.inf)))
        states.append(np.array([theta[-1], velocity[-1]]))
    return np.array(states), slowest, nearest


@pytest.mark.parametrize(
    ("amplitude", "state", "period"),
    [
        (1.7495, (-0.772341, -1.761583), 4),
        (1.7515, (0.527813, -1.829018), 8),
        pytest.param(1.7522, (0.680624, -1.616595), 16, marks=pytest.mark.thorough),
    ],
)
def test_erratum_39_the_first_chaos_at_the_primary_resonance_comes_by_doublings_without_grazing(
    amplitude, state, period
):
    """Periods 4, 8 and 16 up to Hhat = 1.7526, and chaos beyond it, in which no impact is slow and
    no turn near the contact.
    """
    states, slowest, nearest = followed(amplitude, state, period)
    assert np.abs(states[-1] - states[0]).max() < 1e-4
    assert np.abs(states[period // 2] - states[0]).max() > 1e-3  # none of half the period
    assert (slowest > 1.4, nearest > 0.5) == (True, True)
    if period == 16:
        assert exponent(1.0, 1.76, (0.717795, -1.604636)) > 0.05
        _, slowest, nearest = followed(1.76, (0.717795, -1.604636), 60)
        assert (slowest > 1.0, nearest > 0.3) == (True, True)


# --- erratum 38 --------------------------------------------------------------


def counted(*branches, dots):
    """A diagram with critical load 0.25 whose simulation at values 0.75, 1.25, ...

    found so many attractors at each.
    """
    values = np.arange(0.75, 3.0, 0.5)
    places = [
        (value, 1.0) for value, number in zip(values, dots, strict=True) for _ in range(number)
    ]
    tree = diagram(*branches, dots=places)
    tree.attrs["critical"] = 0.25
    tree["search"] = xr.DataTree(xr.Dataset(coords={"searched": values}))
    return tree


@pytest.mark.parametrize(
    ("tree", "verdict"),
    [
        (counted(folded(), loop(), dots=(1, 2, 3, 1, 1)), ClaimVerdict.CORRECTED),
        # simulation sees them grow
        (counted(folded(), loop(), dots=(1, 2, 2, 3, 4)), ClaimVerdict.UNDECIDED),
        (
            counted(
                *(branch([start, 3.0], [1, 1], [1, 1]) for start in (0.0, 1.1, 1.7, 2.4)),
                dots=(1, 1, 2, 3, 4),
            ),
            ClaimVerdict.AS_PRINTED,
        ),
        # never several
        (counted(branch([0.0, 3.0], [0.1, 1.0], [1, 1]), dots=(1,) * 5), ClaimVerdict.DISAGREES),
    ],
)
def test_erratum_38_the_number_of_stable_motions_rises_and_falls(tree, verdict):
    assert verdicts({"fig11-coexistence": coexistence({1.0: tree})})["fig11-coexistence"] is verdict


@pytest.mark.parametrize("amplitude", [0.2, 1.0, 3.0])
def test_theta_st_is_where_a_slowly_growing_load_leads(amplitude):
    """By a motion, for which the claim has the balance of moments: H rises from 0 to its amplitude
    in 2000 units of time.
    """
    load = saltus.Load(horizontal=saltus.Ramp(amplitude=amplitude, duration=2000.0), vertical=-0.5)
    slow = saltus.System(model=saltus.Metainterface(beta0=math.radians(80), damping=0.5), load=load)
    reached = saltus.simulate(slow, theta=0.0, velocity=0.0, duration=2400.0, dense=False).position
    assert reached == pytest.approx(static_angle(math.radians(80), amplitude, -0.5), abs=1e-6)
    for scale, verdict in (
        (reached, ClaimVerdict.AS_PRINTED),
        (1.001 * reached, ClaimVerdict.DISAGREES),
    ):
        spectrum = xr.DataTree(xr.Dataset(attrs={"scale": scale}))
        assert (
            verdicts({"fig09-static": static_unit({amplitude: spectrum})})["fig09-static"]
            is verdict
        )
