"""The types of the compiled functions that follow one motion: those of the kernel, and those of a structure, which it calls."""

from __future__ import annotations

from numba import from_dtype, types

from saltus.flow.kernel.memory import (
    MOTION,
    ContactsFunctions,
    ContactsSegmentRequest,
    ContactsSegmentResults,
    EventBuffers,
    OneContactFunctions,
    SegmentRequest,
    SegmentResults,
    StepBuffers,
)
from saltus.taylor import written_type

_f, _i = types.float64, types.int64
_f1, _f2, _f3 = (types.Array(_f, n, "C") for n in (1, 2, 3))
_i1, _i2 = (types.Array(_i, n, "C") for n in (1, 2))
ENV = types.Tuple((_f1, _f1, _f1, _f3))  # parameters, constants, record breakpoints, record table

CONSTANTS = types.void(_f1, _f1)
GEOMETRY = types.void(ENV, _f1)
SERIES = types.void(_f, _f, _f, ENV, _i, _f2, _f2, _f2, _f1, _f2, _f2, _i)
CONTACT_SERIES = types.void(_f, _f, _f, ENV, _i, _f1, _f2, _i)
RESET = types.UniTuple(_f, 2)(_f, _f, _f, _f, ENV, _i)
CONTACT_DAMPING = _f(_f, _f, _f, ENV, _i)
TANGENT = types.void(_i, _i, _f, _f, _f, ENV, _i, _f1)
MATRICES = MATRIX_SLOPES = types.void(ENV, _i, _f1, _f1)

_functions = [written_type(s) for s in (SERIES, CONTACT_SERIES, RESET, CONTACT_DAMPING, TANGENT)]
MODEL = types.NamedTuple((*_functions[:4], _f1, _functions[4]), OneContactFunctions)
_matrices = written_type(MATRICES)
CONTACT_MODEL = types.NamedTuple((_functions[0], _matrices, _f1, _matrices, _functions[4]), ContactsFunctions)
NUMBERS = types.Array(from_dtype(MOTION), 1, "C")
STEP_BUFFERS = types.NamedTuple((_i2, _f2, _f3), StepBuffers)
EVENT_BUFFERS = types.NamedTuple((_i2, _f2), EventBuffers)
BUFFERS = types.Tuple((STEP_BUFFERS, EVENT_BUFFERS))
ADVANCE = _i(NUMBERS, _f1, ENV, MODEL, _i2, BUFFERS)
ADVANCE_CONTACTS = _i(NUMBERS, _f1, ENV, CONTACT_MODEL, _i2, BUFFERS)
SEGMENTS = _i(
    NUMBERS, ENV, MODEL, types.NamedTuple((_f2, _i2, _f2), SegmentRequest), types.NamedTuple((_f2, _f3, _f2), SegmentResults)
)
CONTACT_SEGMENTS = _i(
    *(NUMBERS, ENV, CONTACT_MODEL, _i2),
    types.NamedTuple((_i2, _f1, _f1), ContactsSegmentRequest),
    types.NamedTuple((_f2, _f3, _f3, _f2), ContactsSegmentResults),
)
IMPACT_EQUATIONS = types.void(_f2, _f1, _f1, _f, _i, _f2, _f3, _f2, _f3, _f3, _f3)
