"""The types of the compiled functions that follow one motion: those of the kernel, and those of a structure, which it calls."""

from __future__ import annotations

from numba import types

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
MODEL = types.Tuple((*_functions[:4], _f1, _functions[4]))
_matrices = written_type(MATRICES)
CONTACT_MODEL = types.Tuple((_functions[0], _matrices, _f1, _matrices, _functions[4]))
STEP_BUFFERS, EVENT_BUFFERS = types.Tuple((_i2, _f2, _f3)), types.Tuple((_i2, _f2))
ADVANCE = _i(_i1, _f1, _f1, ENV, MODEL, STEP_BUFFERS, EVENT_BUFFERS)
ADVANCE_CONTACTS = _i(_i1, _f1, _f1, ENV, CONTACT_MODEL, _i2, STEP_BUFFERS, EVENT_BUFFERS)
CONTACT_SEGMENTS = _i(_i1, _f1, ENV, CONTACT_MODEL, _i2, _i2, _f1, _f1, _f2, _f3, _f3, _f2)
SEGMENTS = _i(_i1, _f1, ENV, MODEL, _f2, _i2, _f2, _f2, _f3, _f2)
IMPACT_EQUATIONS = types.void(_f2, _f1, _f1, _f, _i, _f2, _f3, _f2, _f3, _f3, _f3)
