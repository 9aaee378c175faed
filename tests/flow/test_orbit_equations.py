"""The equations of orbits with several contacts, from segments of any numbers: a perturbation is
carried from event to event.
"""

import numpy as np
import pytest

from saltus.flow import SegmentEnd, load_contact_equations

OWN = 2
SEGMENTS = 3
FREQUENCY = 1.3
FREE = np.array([1, 2, 3])
TIMES = np.array([0.3, 1.1, 1.9, 5.0])
PARAMETERS = 2  # of which the second one is the frequency
RANDOM = np.random.default_rng(45)
# A mirror that swaps two coordinates, and one of two bodies that are swapped in the coordinates of
# the first one and of the gap between them.
NONE = np.eye(2)
SWAP = np.array([[0.0, -1.0], [-1.0, 0.0]])
BODIES = np.array([[-1.0, -1.0], [0.0, 1.0]])
SHIFT = np.array([0.4, 0.4, 0.0, 0.0])


def followed(segments):
    """Segments with random ends, columns and maps."""
    columns = 2 * OWN + PARAMETERS
    return (
        RANDOM.normal(size=(segments, SegmentEnd.NUMBERS + 10 * OWN)),
        RANDOM.normal(size=(segments, 2 * OWN + 1, columns)),
        RANDOM.normal(size=(segments, 2 * OWN, columns)),
        np.empty((0, 1)),
    )


def of_state(turn):
    """The matrix that turns coordinates and velocities."""
    return np.kron(np.eye(2), turn)


def equations(results, events, turn):
    """The residual, and its derivatives to the unknowns, to the later ones, and to parameters."""
    size = len(FREE) + events
    arrays = np.zeros(size), *np.zeros((2, size, size)), np.zeros((size, PARAMETERS))
    asked = np.array([0.5, -0.2, 0.7, 0.1])
    times = TIMES[: len(results[0]) + 1].copy()
    request = (
        *(FREE, times, asked, of_state(turn), np.zeros(2 * OWN) if turn is NONE else SHIFT),
        *(FREQUENCY, 1),
    )
    load_contact_equations()(request, results, arrays)
    return arrays


def carried(results, events, state, phases, parameters):
    """The changes of all guards and of the state at the end, by changes of the state at the start,
    of the phases with that of the first event a period later, and of the parameters."""
    ends, columns, maps, _ = results
    guards = []
    for s in range(len(ends)):
        times = np.zeros(2) if not events else phases[s : s + 2] / FREQUENCY
        # at fixed phases the frequency moves the times
        times = times - TIMES[s : s + 2] * parameters[1] / FREQUENCY
        rates = ends[s, SegmentEnd.NUMBERS :].reshape(-1, 2 * OWN)
        begin = state - rates[1] * times[0]
        change = columns[s] @ [*begin, *parameters]
        change[:-1] += rates[3] * times[1]
        # the guard's own derivative to the start has the motion along with it
        own = columns[s, -1, : 2 * OWN] @ state + columns[s, -1, 2 * OWN :] @ parameters
        by_phases = ends[s, [SegmentEnd.BY_START, SegmentEnd.BY_END]] @ times
        guards.append(own + by_phases)
        state = change[:-1]
        if events:
            state = maps[s] @ [*state, *parameters]
    return np.array(guards[:events]), state


@pytest.mark.parametrize("turn", [NONE, SWAP, BODIES], ids=["none", "swap", "bodies"])
@pytest.mark.parametrize("events", [0, SEGMENTS])
def test_a_perturbation_is_carried_from_event_to_event(events, turn):
    results = followed(events or 1)
    _, here, there, by_parameters = equations(results, events, turn)
    unknowns = RANDOM.normal(size=len(FREE) + events)
    later = RANDOM.normal(size=len(unknowns))
    parameters = RANDOM.normal(size=PARAMETERS)
    state = np.zeros(2 * OWN)
    state[FREE] = unknowns[: len(FREE)]
    phases = np.append(unknowns[len(FREE) :], later[len(FREE) :][:1])
    guards, end = carried(results, events, state, phases, parameters)
    end = of_state(turn) @ end
    expected = np.append(guards, end[FREE] - later[: len(FREE)])
    found = here @ unknowns + there @ later + by_parameters @ parameters
    assert found == pytest.approx(expected, abs=1e-12)


def test_the_residual_is_the_guards_and_the_state_that_is_not_met():
    results = followed(SEGMENTS)
    ends = results[0]
    residual, *_ = equations(results, SEGMENTS, SWAP)
    after = ends[-1, SegmentEnd.NUMBERS + 8 * OWN :]
    image = np.array([0.4 - after[1], 0.4 - after[0], -after[3], -after[2]])
    met = (image - [0.5, -0.2, 0.7, 0.1])[FREE]
    assert residual == pytest.approx(np.append(ends[:, SegmentEnd.GUARD], met), abs=1e-15)
