"""One motion gets one verdict from all four doors: `classify`, `find_attractors`, a chart and a
diagram.
"""

import numpy as np
import pytest
from shared_systems import forced

from saltus import classify, find_attractors, stability_chart
from saltus.flow import Ending
from saltus.studies.diagram.diagram_work import DiagramWork
from saltus.studies.diagram.searched_range import MotionStarts, SearchedRange

AMPLITUDE = "load.horizontal.amplitude"
MOTIONS = {
    Ending.PERIODIC: (forced(0.5, 1.0), 2.0),
    Ending.CHAOTIC: (forced(3.0, 1.6), 2.0),
    # numerics.md: chaos that settles after some thousand periods
    Ending.TRANSIENT: (forced(7.2, 4.0), 2.0),
    Ending.QUASI_PERIODIC: (
        forced(0.002, 1.0, C=0.0, V=0.5),
        0.02,
    ),  # without damping, about a deformed equilibrium: KAM's curves
}


def by_classify(system, window):
    theta, velocity = states_within(system, window)[0]
    return classify(system, theta=theta, velocity=velocity, periods=600, transient=0)


def states_within(system, window, count=6):
    """Random states about the equilibrium near which the motion stays, or about the contact."""
    middle = 0.03 if window < 0.1 else 0.0
    return np.random.default_rng(1).uniform(-window, window, (count, 2)) + np.array([middle, 0.0])


def by_attractors(system, window):
    middle = 0.03 if window < 0.1 else 0.0
    bounds = ((middle - window, middle + window), (-window, window))
    return find_attractors(system, window=bounds, starts=1)


def by_chart(system, window):
    middle = 0.03 if window < 0.1 else 0.0
    bounds = ((middle - window, middle + window), (-window, window))
    values = {"horizontal": [system.get(AMPLITUDE)], "vertical": [system.get("load.vertical")]}
    return stability_chart(system, **values, window=bounds, starts=6).isel(horizontal=0, vertical=0)


def by_diagram(system, window):
    value = system.get(AMPLITUDE)
    search = SearchedRange(DiagramWork(system, AMPLITUDE), (0.9 * value, 1.1 * value))
    search.simulate_starts(
        [MotionStarts(value, states_within(system, window), level=2)]
    )  # as bands are judged where transients are near
    return Ending(search.tried().verdict[0])


# as they settle on no orbit, all starts are followed to the end of each patience
LONG = {Ending.QUASI_PERIODIC, Ending.CHAOTIC}
CASES = [
    pytest.param(kind, marks=pytest.mark.thorough if kind in LONG else (), id=str(kind))
    for kind in MOTIONS
]


@pytest.mark.parametrize("expected", CASES)
def test_four_doors_have_one_judge(expected):
    """A transient ends on an orbit: the motion of `classify` and those of `find_attractors` are
    given the time to come there.
    """
    system, window = MOTIONS[expected]
    verdict, found, cell = (
        by_classify(system, window),
        by_attractors(system, window),
        by_chart(system, window),
    )
    assert by_diagram(system, window) is expected
    kinds = {member.kind for member in found} - {Ending.REST}
    if expected is Ending.TRANSIENT:
        assert verdict.kind is Ending.PERIODIC or verdict.cause.name == "TRANSIENT"
        assert kinds == {Ending.PERIODIC}
        # how long each start takes is decided by rounding: all may have settled, so that none is
        # judged
        settled = not cell["unsettled"] and np.isnan(cell["exponent"])
        assert settled or Ending(int(cell["verdict"])) in (Ending.TRANSIENT, Ending.PERIODIC)
        assert int(cell["count"]) > 0
        assert cell["count"] > 0
    elif expected is Ending.PERIODIC:
        assert verdict.kind is expected
        assert kinds == {expected}
        assert cell["unsettled"] == 0
        assert cell["count"] > 0
    else:
        assert verdict.kind is expected
        assert Ending(int(cell["verdict"])) is expected
        if expected is Ending.CHAOTIC:
            assert kinds == {expected}
        else:  # nothing attracts without damping
            assert not kinds
            assert all(
                "quasi-periodic, but areas do not shrink" in reason for reason in found.reasons
            )
