"""The memory of the scalar kernels in words.

`motion`, which the compiled functions take, is a named tuple by its address: of a record with the
numbers of the motion, the arrays of its state, those of a step, the buffers of its records, and the
functions of its structure. All of their fields are attributes of `motion` itself (see
`taylor/numba_types.py`), so that a compiled function reads `motion.time` or `motion.velocities[0]`,
whichever part they are in. The types that numba is told follow at the end, with those of a
structure's functions.
"""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numba import from_dtype, types

from saltus.taylor import written_type

_WHOLE = np.int64
_REAL = np.float64

MOTION = np.dtype(
    [
        # What is given at the start, up to the tolerance: where the motion is, when it ends, and
        # how it is computed.
        ("time", _REAL),  # within the forcing period
        ("period", _WHOLE),  # the forcing period
        ("mode", _WHOLE),  # a `Mode`
        ("side", _WHOLE),
        ("piece", _WHOLE),  # of the records
        # the side that the caller has chosen for a motion from rest that is not unique; or 0
        ("leave_by", _WHOLE),
        ("dense", _WHOLE),  # whether steps are recorded
        ("last_period", _WHOLE),  # in which the motion ends
        ("end", _REAL),  # of the motion, as a time within its last forcing period
        ("period_length", _REAL),
        ("natural_time", _REAL),  # of the load, P / 2 pi, or of a system without a period
        ("tolerance", _REAL),
        # What the kernel itself begins with 0.
        ("origin", _REAL),  # the time at which the forcing period began
        # order of the gap's known zero at the start of an arc; the side just released in CONTACT
        # from rest
        ("skip", _WHOLE),
        ("new_piece", _WHOLE),  # whether it has just begun, so that the load may have jumped
        ("rested", _WHOLE),  # whether the motion was at rest or in chatter before
        ("chatter_speed", _REAL),  # of the gap, while impacts without loss are averaged
        # natural scales, the largest so far: of the acceleration at an impact, of the speed of an
        # impact, of what presses on contacts and frictions (an acceleration), of sliding speeds
        ("pull", _REAL),
        ("fastest", _REAL),
        ("press", _REAL),
        ("swiftest", _REAL),
        ("log_tolerance", _REAL),  # of the tolerance, for the length of every step
        ("recorded_steps", _WHOLE),  # in the buffer
        ("recorded_events", _WHOLE),  # in the buffer
        (
            "horizon",
            _REAL,
        ),  # for the scalar steps of a lane, which end with its forcing period: the local time at its motion's end
        # whether to return as soon as the motion is smooth again (see `programs/lane_driver.py`)
        ("until_smooth", _WHOLE),
        # for tests: 1 plus the row of a contact or friction whose events are moved, and by how
        # many units in the last place of the time; 0 moves none
        ("nudged", _WHOLE),
        ("nudge", _REAL),
        # how often no answer changed least, and the time at which this was first so
        # (`choose_closed`)
        ("ties", _WHOLE),
        ("tied_at", _REAL),
        ("order", _WHOLE),  # of the Taylor series
        # The sizes of the structure.
        ("dof", _WHOLE),  # coordinates that are followed, own (1 + columns)
        ("margin_count", _WHOLE),  # the number of margins at which the motion stops
        ("workspace_rows", _WHOLE),
        ("sides", _WHOLE),  # of the contact
        # whether steps are checked: the structure has functions with steep changes that a series
        # may miss
        ("checked", _WHOLE),
        # how many of the model's own coordinates, the last ones, are of first order
        ("first_order", _WHOLE),
        ("own", _WHOLE),  # the model's own coordinates
        ("columns", _WHOLE),  # of the tangent
        # the first of its own coordinates, on which impacts act; those behind them have mass 1
        ("local", _WHOLE),
        # whether the load's breakpoints are shares of the forcing period, and return in each
        ("repeats", _WHOLE),
        # 1 plus the tangent's column along the frequency with which they move, 0 without one
        ("corner_column", _WHOLE),
        # how many numbers events at contacts need, which `matrices` fills
        ("contact_numbers", _WHOLE),
        # how many rows of contacts, frictions and surfaces multipliers may hold, in the place of
        # coordinates; 0 if none may
        ("multipliers", _WHOLE),
        # whether these rows do not change with the time at a fixed state
        ("fixed_rows", _WHOLE),
    ]
)
_NAMES: Any = MOTION.names
# In the order of `Structure.sizes`.
SIZES = list(_NAMES[_NAMES.index("dof") :])


def _packed(names: tuple[str, ...]) -> Struct:
    """The first fields of a record as Python's numbers: NumPy takes as long for one of them as this
    for all.
    """
    return Struct("=" + "".join("d" if MOTION[name] == _REAL else "q" for name in names))


WHOLE_RECORD = _packed(_NAMES)
AT_START = _packed(_NAMES[: _NAMES.index("tolerance") + 1])
MotionNumbers: Any = namedtuple("MotionNumbers", _NAMES)  # type: ignore[misc]  # a record as Python's numbers


@cache
def blank_record(order: int, sizes: tuple[int, ...]) -> bytes:
    """The bytes of a record MOTION for motions of a structure: all but the order and the sizes are
    0.
    """
    known = {"order": order, **dict(zip(SIZES, sizes, strict=True))}
    return WHOLE_RECORD.pack(*(known.get(name, 0) for name in _NAMES))


def motion_record(order: int, sizes: tuple[int, ...]) -> tuple[np.ndarray, bytearray]:
    """An array of one record, all but the order and the sizes 0, and its bytes; NumPy's own way
    takes ten times as long.
    """
    memory = bytearray(blank_record(order, sizes))
    return np.ndarray((1,), MOTION, memory), memory


INSTANT = ("time", "origin")  # of an event, behind the parameters of a model with several contacts


def behind_parameters(frictions: int, flags: int) -> list[float]:
    """What stands behind the parameters at the start: the slidings, an instant, and that all
    coordinates, or rows of multipliers, are free.
    """
    return [0.0] * (frictions + len(INSTANT)) + [1.0] * flags


class MotionMemory(NamedTuple):
    """What `motion` is the address of."""

    numbers: Any  # a record MOTION
    parts: Any  # one of the named tuples below whose names end in Parts


class StateArrays(NamedTuple):
    """The state and its parts."""

    # all coordinates, including those of the tangent's columns, their velocities, and the shifts
    state: Any
    coordinates: Any
    velocities: Any
    shifts: Any  # of the last event, along each column


class StepArrays(NamedTuple):
    """Taylor coefficients of a step, and the space to compute them."""

    coordinate_series: Any
    velocity_series: Any
    acceleration_series: Any
    gap_series: Any
    margin_series: Any
    recurrences: Any
    polynomial: Any  # scaled to a step of 1
    pull_series: Any  # the contact accelerations of both sides
    step_end: Any  # the first five again, evaluated at the end of a step


class StepBuffers(NamedTuple):
    """The recorded steps: (period, side), (local time, length), and the coordinates' series."""

    step_labels: Any
    step_spans: Any
    step_series: Any


class EventBuffers(NamedTuple):
    """The recorded events: (period, kind, side, detail), and (local time, velocities before and
    after, more, shifts).
    """

    event_labels: Any
    event_values: Any


class OneContactFunctions(NamedTuple):
    """The functions of a structure with one contact, and its geometry."""

    series: Any
    contact_series: Any
    reset: Any
    contact_damping: Any
    geometry: Any
    tangent: Any


class ContactsFunctions(NamedTuple):
    """The functions of a structure with several contacts, the contacts' signs, and its
    eigenmodes.
    """

    series: Any
    matrices: Any
    # the derivatives, along each column of the tangent, of the numbers that `matrices` fills
    matrix_slopes: Any
    tangent: Any
    load_series: Any  # of the load's channels, for eigenmodes
    signs: Any
    # the table of `systems/structures/eigenmodes.py`; empty for motions that are not followed in them
    eigenmodes: Any


class ModeArrays(NamedTuple):
    """The series of a structure in its eigenmodes."""

    mode_series: Any
    input_series: Any
    # the columns of the tangent in eigenmodes, and the rates of those of parameters
    mode_columns: Any
    mode_rates: Any
    # whether they are ahead of the columns in the state, and by what time
    carried: Any


class OneContactParts(NamedTuple):
    """A motion of a model with one contact."""

    state_arrays: StateArrays
    env: Any  # parameters, constants, record breakpoints, record table
    parameters: Any
    breaks: Any
    functions: OneContactFunctions
    step_arrays: StepArrays
    step_buffers: StepBuffers
    event_buffers: EventBuffers


class OneContactSegmentParts(NamedTuple):
    """A segment of an orbit of a model with one contact, of which nothing is recorded."""

    state_arrays: StateArrays
    env: Any
    functions: OneContactFunctions
    step_arrays: StepArrays


class SegmentRequest(NamedTuple):
    """The segments of an orbit of a model with one contact."""

    spans: Any  # (n, 3): begin, end, and the gap's speed before the impact that starts it
    # (n, 2): the side before that impact (0: starts from a state), and the side of the segment (0:
    # all)
    sides: Any
    states: Any  # (n, 2 own): where it starts, unless by an impact


class SegmentResults(NamedTuple):
    """What is filled for each of these segments."""

    ends: Any  # in the columns of `SegmentValue`
    columns: Any
    extremes: Any  # in those of `SegmentColumn`


class ImpactRequest(NamedTuple):
    """The impacts that end segments of an orbit of a model with one contact."""

    spans: Any  # of the segments, as those of `SegmentRequest`
    signs: Any  # of the gap's rate on the segments
    speeds: Any  # of the impacts that end them
    frequency: Any
    place: Any  # of the frequency among the parameters, or -1


class ImpactEquations(NamedTuple):
    """The equations of these impacts and their derivatives, which are filled."""

    residual: Any  # (n, 2)
    here: Any  # (n, 2, 2), to phase and speed of the impact before each segment
    there: Any  # to those of the impact after it
    parameters: Any  # (n, 2, parameters)


class SolverArrays(NamedTuple):
    """The arrays in which impacts and closed contacts are solved for."""

    # filled by `matrices`: mass matrix by rows, E by rows, positions, speeds of the frictions'
    # grounds
    solver_numbers: Any
    inverse: Any  # of the mass matrix
    coupling: Any  # the rates that unit impulses of the contacts give to the gaps, signs included
    block: Any  # the rows of a linear system, with its right-hand sides behind them
    reduced: Any  # the coupling of some of the contacts
    right: Any
    impulses: Any
    tried: Any
    rates: Any  # of the gaps before an impact
    gaps: Any
    # of open contacts, kept beside the coordinates, as differences of large numbers have few digits
    open_gaps: Any
    pulls: Any  # the second derivatives of the gaps with no contact closed
    falling_gaps: Any  # while an accumulation is followed
    falling_rates: Any
    falling_pulls: Any
    slopes: Any  # a row for each column of the tangent: the derivatives of `solver_numbers`
    jump: Any  # of the velocities at an impact
    # by how much an impact, a release or the end of an accumulation moves with each column
    event_shifts: Any
    pull_slopes: Any  # the derivatives of `pulls`, a row for each column
    # of the rows that multipliers hold: the accelerations by their multipliers, (local, rows)
    pushes: Any
    mobilities: Any  # and what each gives to its own row
    row_terms: Any  # the sizes of the terms of their rates at the end of the last step
    slide_rates: Any  # of the frictions: their sliding speeds, exactly 0 at rest
    stuck_impulses: Any  # and the impulses with which they stuck at the last impact


class ContactsParts(NamedTuple):
    """A motion of a model with several contacts."""

    state_arrays: StateArrays
    env: Any
    parameters: (
        # the last ones say in which direction each friction slides, and whether each coordinate is
        # free (1) or held (0)
        Any
    )
    breaks: Any
    functions: ContactsFunctions
    contacts: Any  # a row for each contact, in the columns of `PartColumn`
    sided: Any  # behind them, a row for each friction and surface, in the same columns
    step_arrays: StepArrays
    mode_arrays: ModeArrays
    solver: SolverArrays
    step_buffers: StepBuffers
    event_buffers: EventBuffers


class ContactsSegmentParts(NamedTuple):
    """A segment of an orbit of a model with several contacts, of which nothing is recorded."""

    state_arrays: StateArrays
    env: Any
    parameters: Any
    functions: ContactsFunctions
    contacts: Any
    sided: Any  # none
    step_arrays: StepArrays
    mode_arrays: ModeArrays
    solver: SolverArrays
    turns: Any  # the times of the extrema in a step, as shares of it
    least: Any  # an inner minimum and its time
    excursion: Any  # integrals along an excursion


class ContactsSegmentRequest(NamedTuple):
    """The segments of an orbit of a model with several contacts, one after the other."""

    plan: Any  # (n, ...), in the columns of `SegmentPlan`
    times: Any  # (n + 1,)
    first: Any  # the state at the first of them
    # the natural units in which extremes are given, of length, time and force, and the reaction in
    # them that is the rounding of elastic forces, (4,)
    units: Any


class ContactsSegmentResults(NamedTuple):
    """What is filled for each of these segments."""

    ends: Any  # in the places of `SegmentEnd`
    columns: Any
    maps: Any
    extremes: Any  # in the places of `SegmentExtremes`


class LaneImpactParts(NamedTuple):
    """An impact of a lane, of which nothing but the state is known."""

    state_arrays: StateArrays
    env: Any
    parameters: Any
    functions: ContactsFunctions
    contacts: Any
    solver: SolverArrays


_f = types.float64
_i = types.int64
_f1, _f2, _f3 = (types.Array(_f, n, "C") for n in (1, 2, 3))
_i1, _i2 = (types.Array(_i, n, "C") for n in (1, 2))
ENV = types.Tuple((_f1, _f1, _f1, _f3))  # parameters, constants, record breakpoints, record table

CONSTANTS = types.void(_f1, _f1)
GEOMETRY = types.void(ENV, _f1)
SERIES = types.void(_f, _f, _f, ENV, _i, _f2, _f2, _f2, _f1, _f2, _f2, _i)
CONTACT_SERIES = LOAD_SERIES = types.void(_f, _f, _f, ENV, _i, _f1, _f2, _i)
RESET = types.UniTuple(_f, 2)(_f, _f, _f, _f, ENV, _i)
CONTACT_DAMPING = _f(_f, _f, _f, ENV, _i)
TANGENT = types.void(_i, _i, _f, _f, _f, ENV, _i, _f1)
MATRICES = MATRIX_SLOPES = types.void(ENV, _i, _f1, _f1)

_functions = [written_type(s) for s in (SERIES, CONTACT_SERIES, RESET, CONTACT_DAMPING, TANGENT)]
MODEL = types.NamedTuple((*_functions[:4], _f1, _functions[4]), OneContactFunctions)
_matrices = written_type(MATRICES)
_contacts = (_functions[0], _matrices, _matrices, _functions[4], _functions[1], _f1, _f1)
CONTACT_MODEL = types.NamedTuple(_contacts, ContactsFunctions)
NUMBERS = types.Array(from_dtype(MOTION), 1, "C")
STEP_BUFFERS = types.NamedTuple((_i2, _f2, _f3), StepBuffers)
EVENT_BUFFERS = types.NamedTuple((_i2, _f2), EventBuffers)
BUFFERS = types.Tuple((STEP_BUFFERS, EVENT_BUFFERS))
MARGINS = DRAWING = types.void(_f, _f, _f, ENV, _i, _f1, _f1)
ADVANCE = _i(NUMBERS, _f1, ENV, MODEL, _i2, BUFFERS)
ADVANCE_CONTACTS = _i(NUMBERS, _f1, ENV, CONTACT_MODEL, _i2, BUFFERS)
_results = types.NamedTuple((_f2, _f3, _f2), SegmentResults)
SEGMENTS = _i(NUMBERS, ENV, MODEL, types.NamedTuple((_f2, _i2, _f2), SegmentRequest), _results)
CONTACT_SEGMENTS = _i(
    *(NUMBERS, ENV, CONTACT_MODEL, _i2),
    types.NamedTuple((_i2, _f1, _f1, _f1), ContactsSegmentRequest),
    types.NamedTuple((_f2, _f3, _f3, _f2), ContactsSegmentResults),
)
IMPACT_EQUATIONS = types.void(
    types.NamedTuple((_f2, _f1, _f1, _f, _i), ImpactRequest),
    _results,
    types.NamedTuple((_f2, _f3, _f3, _f3), ImpactEquations),
)
