"""The types of the lanes' functions, which are called through pointers (see `flow/kernel/function_types.py`)."""

from __future__ import annotations

from numba import types

from saltus.flow.kernel.function_types import ADVANCE, CONSTANTS, GEOMETRY, MODEL
from saltus.taylor import function_type, written_type

_f, _i = types.float64, types.int64
_f1, _f2, _f3 = (types.Array(_f, n, "C") for n in (1, 2, 3))
_i1, _i2 = (types.Array(_i, n, "C") for n in (1, 2))

LANE_SERIES = LANE_ONE_FREE = types.void(_f1, _i)  # memory of the lanes, order
LANE_IMPACT = LANE_FIELD = types.void(_f1)
LANE_ROOT = _f(_f1, _i, _i, _i, _f, _f, _f, _i, _f1, _f1)
TURNING_RANGE = types.UniTuple(_f, 2)(_f1, _i, _f, _f, _f1)
JOBS = types.Tuple((_f2, _f2, _i2, _f2))  # states; numbers; labels; parameters
TABLES = types.Tuple((_f2, types.Array(_f, 4, "C")))  # record breakpoints, record table; a row for each trajectory, or one
LANES = types.Tuple((_i2, _f2, _f2, _f2, _f3, _i2))  # the arrays with a row for each lane, in the places of `LaneArray`
RESULTS = types.Tuple((_f2, _f2, _i2, _f3))  # states; numbers; labels; samples
_functions = (LANE_SERIES, LANE_IMPACT, LANE_FIELD, CONSTANTS, GEOMETRY)
CODE = types.Tuple([written_type(signature) for signature in _functions])
SCALAR = types.Tuple((function_type(ADVANCE), types.Tuple(tuple(MODEL.types[i] for i in (0, 1, 2, 3, 5)))))
SCALAR_MOTION = types.UniTuple(_i, 2)(_i, SCALAR, _i1, _i1, _f1, _i1, _f1, LANES, _f2, TABLES, _f1, _i1)
HELPERS = types.Tuple([function_type(signature) for signature in (LANE_ROOT, TURNING_RANGE, SCALAR_MOTION)])
RUN_LANES = types.void(CODE, SCALAR, HELPERS, _i1, _i1, _f1, _f1, JOBS, TABLES, RESULTS, _i1)
