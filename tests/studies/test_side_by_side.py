"""Parts of a search at the same time: the results, errors and progress are those of one after the
other.
"""

import threading
from concurrent.futures import CancelledError
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced

import saltus
from saltus.flow import Ending
from saltus.progress import growing, silent
from saltus.studies.diagram import diagram_work as module
from saltus.studies.diagram.diagram_work import DiagramWork, all_at_once, side_by_side
from saltus.studies.diagram.effort import EFFORTS, Effort
from saltus.studies.diagram.searched_range import MotionStarts, SearchedRange

AMPLITUDE = "load.horizontal.amplitude"


@pytest.fixture
def cores(monkeypatch):
    def use(count):
        monkeypatch.setattr(module, "available_cores", lambda: count)

    use(2)
    return use


@pytest.mark.thorough
def test_a_diagram_does_not_depend_on_whether_its_parts_run_at_the_same_time(cores, monkeypatch):
    """Within the first chaos of Fig. 11, with two random samples."""
    monkeypatch.setitem(EFFORTS, Effort.QUICK, replace(EFFORTS[Effort.QUICK], samples=2))
    diagrams = []
    for count in (1, 2):
        cores(count)
        few = {"effort": "quick", "starts": 2, "max_period": 4}
        diagrams.append(saltus.bifurcation_diagram(forced(1.0), AMPLITUDE, (1.756, 1.757), **few))
    assert diagrams[0]["bands"].sizes["band"] > 0
    for path in diagrams[0].groups:
        xr.testing.assert_identical(diagrams[0][path].to_dataset(), diagrams[1][path].to_dataset())


def test_values_that_are_judged_with_different_level_at_the_same_time_have_the_same_verdicts(cores):
    states, found = np.random.default_rng(3).uniform(-0.5, 0.5, (4, 2)), []
    for count in (1, 2):
        cores(count)
        search = SearchedRange(DiagramWork(forced(1.0), AMPLITUDE), (1.74, 1.77))
        search.simulate_starts(
            [
                MotionStarts(1.755, states, 0),
                MotionStarts(1.76, states, 1),
                MotionStarts(1.765, states, 0),
            ]
        )
        found.append(search.tried())
    assert (found[0].verdict == Ending.CHAOTIC).sum() >= 2
    for one, other in zip(*(vars(tried).values() for tried in found), strict=True):
        assert np.array_equal(one, other, equal_nan=True)


def test_both_parts_run_at_the_same_time(cores):
    """Each waits until the other one has begun."""
    begun = threading.Barrier(2, timeout=30.0)
    side_by_side(lambda progress: begun.wait(), lambda progress: begun.wait(), silent)


def test_on_one_core_the_parts_run_one_after_the_other_in_this_thread(cores):
    cores(1)
    ran = []
    side_by_side(
        lambda progress: ran.append(threading.get_ident()),
        lambda progress: ran.append(threading.get_ident()),
        silent,
    )
    assert ran == [threading.get_ident()] * 2


def test_only_the_calling_thread_reports_the_progress_of_the_other_one(cores):
    reported, callers = threading.Event(), set()

    def beside(progress):
        progress(0.5, "beside")
        reported.wait(30.0)

    def heard(fraction, what):
        callers.add((threading.get_ident(), what))
        reported.set()

    side_by_side(beside, lambda progress: None, heard)
    assert callers == {(threading.get_ident(), "beside")}


def test_an_interrupt_ends_the_other_part_at_its_next_report(cores):
    begun, ended = threading.Event(), []

    def beside(progress):
        begun.set()
        try:
            while True:
                progress(0.0, "beside")
        except CancelledError:
            ended.append(True)
            raise

    def interrupted(progress):
        begun.wait(30.0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        side_by_side(beside, interrupted, silent)
    assert ended == [True]


def test_an_error_beside_ends_the_other_part_at_its_next_report(cores):
    failed = threading.Event()

    def fail(progress):
        failed.set()
        raise saltus.ParameterError("no orbit", "load")

    def here(progress):
        failed.wait(30.0)
        while True:
            progress(0.0, "here")

    with pytest.raises(saltus.ParameterError, match="no orbit"):
        side_by_side(fail, here, silent)


@pytest.mark.parametrize("count", [1, 2])
def test_all_results_come_in_the_order_of_the_computations(cores, count):
    cores(count)
    assert all_at_once([lambda progress, number=number: number**2 for number in range(5)]) == [
        0,
        1,
        4,
        9,
        16,
    ]


def test_an_error_of_one_computation_ends_the_others_at_their_next_report(cores):
    def fail(progress):
        raise saltus.ParameterError("no orbit", "load")

    def endless(progress):
        while True:
            progress(0.0, "")

    with pytest.raises(saltus.ParameterError, match="no orbit"):
        all_at_once([endless, fail, endless])


LATE = [
    pytest.param(when, marks=pytest.mark.thorough)
    for when in ("following", "looking for chaos, confirming", "estimating")
]


@pytest.mark.parametrize("when", ["looking for chaos, values", *LATE])
def test_an_interrupted_diagram_ends_at_once(cores, when):
    """The threads are gone when the interrupt arrives where the diagram was asked for."""

    def interrupt(fraction, what):
        if what.startswith(when):
            raise KeyboardInterrupt

    begun = set(threading.enumerate())
    with pytest.raises(KeyboardInterrupt):
        saltus.bifurcation_diagram(
            forced(1.0), AMPLITUDE, (1.74, 1.77), effort="quick", starts=4, progress=interrupt
        )
    assert {
        thread
        for thread in threading.enumerate()
        if thread not in begun and not thread.name.startswith("saltus")
    } == set()


def test_a_growing_progress_never_falls():
    heard = []
    progress = growing(lambda fraction, what: heard.append(fraction))
    for fraction in (0.1, 0.5, 0.2, 0.7, 0.0):
        progress(fraction, "")
    assert heard == [0.1, 0.5, 0.5, 0.7, 0.7]
