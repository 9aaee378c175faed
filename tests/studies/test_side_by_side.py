"""Parts of a search at the same time: the results, errors and progress are those of one after the other."""

import threading
from concurrent.futures import CancelledError

import pytest
import xarray as xr
from shared_systems import forced

import saltus
from saltus.progress import growing, silent
from saltus.studies.diagram import side_by_side as module
from saltus.studies.diagram.side_by_side import all_at_once, side_by_side

AMPLITUDE = "load.horizontal.amplitude"


@pytest.fixture
def cores(monkeypatch):
    def use(count):
        monkeypatch.setattr(module, "available_cores", lambda: count)

    use(2)
    return use


def test_a_diagram_does_not_depend_on_whether_its_parts_run_at_the_same_time(cores):
    """The first chaos of Fig. 11, behind a cascade of doublings, on one core and on two."""
    diagrams = []
    for count in (1, 2):
        cores(count)
        diagrams.append(saltus.bifurcation_diagram(forced(1.0), AMPLITUDE, (1.74, 1.78), effort="quick"))
    assert diagrams[0]["bands"].sizes["band"] > 0
    for path in diagrams[0].groups:
        xr.testing.assert_identical(diagrams[0][path].to_dataset(), diagrams[1][path].to_dataset())


def test_both_parts_run_at_the_same_time(cores):
    """Each waits until the other one has begun."""
    begun = threading.Barrier(2, timeout=30.0)
    side_by_side(lambda progress: begun.wait(), lambda progress: begun.wait(), silent)


def test_on_one_core_the_parts_run_one_after_the_other_in_this_thread(cores):
    cores(1)
    ran = []
    side_by_side(lambda progress: ran.append(threading.get_ident()), lambda progress: ran.append(threading.get_ident()), silent)
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


def test_an_error_beside_is_raised_after_the_other_part(cores):
    done = []

    def fail(progress):
        raise saltus.ParameterError("no orbit", "load")

    with pytest.raises(saltus.ParameterError, match="no orbit"):
        side_by_side(fail, lambda progress: done.append(True), silent)
    assert done == [True]


@pytest.mark.parametrize("count", [1, 2])
def test_all_results_come_in_the_order_of_the_computations(cores, count):
    cores(count)
    assert all_at_once([lambda number=number: number**2 for number in range(5)]) == [0, 1, 4, 9, 16]


def test_a_growing_progress_never_falls():
    heard = []
    progress = growing(lambda fraction, what: heard.append(fraction))
    for fraction in (0.1, 0.5, 0.2, 0.7, 0.0):
        progress(fraction, "")
    assert heard == [0.1, 0.5, 0.5, 0.7, 0.7]
