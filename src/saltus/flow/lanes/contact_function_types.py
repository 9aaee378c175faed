"""The types of the lanes' functions for models with several contacts; they replace those of the same names in
`function_types.py`."""

from __future__ import annotations

from numba import types

from saltus.flow.kernel.function_types import ADVANCE_CONTACTS, CONSTANTS, CONTACT_MODEL, MATRICES, NUMBERS
from saltus.flow.kernel.memory import SolverArrays
from saltus.flow.lanes.function_types import (
    JOBS,
    LANE_FIELD,
    LANE_IMPACT,
    LANE_ONE_FREE,
    LANE_ROOT,
    LANE_SERIES,
    RESULTS,
    TABLES,
    TURNING_RANGE,
)
from saltus.taylor import function_type, written_type

_f, _i = types.float64, types.int64
_f1, _f2, _f3 = (types.Array(_f, n, "C") for n in (1, 2, 3))
_i1, _i2, _i3 = (types.Array(_i, n, "C") for n in (1, 2, 3))

LANES = types.Tuple((_i2, _f2, _f2, _f2, _f3, _i2, _i3))
_SOLVER = types.NamedTuple((_f1, *4 * (_f2,), *12 * (_f1,), _f2), SolverArrays)
SPACE = types.Tuple((_f1, _f1, NUMBERS, _f1, _i2, _SOLVER))
_functions = (LANE_SERIES, LANE_IMPACT, LANE_FIELD, CONSTANTS, MATRICES, LANE_ONE_FREE)
CODE = types.Tuple([written_type(s) for s in _functions])
SCALAR = types.Tuple((function_type(ADVANCE_CONTACTS), CONTACT_MODEL))
SCALAR_MOTION = types.UniTuple(_i, 2)(_i, SCALAR, _i1, _i1, _f1, _i1, _f1, LANES, _f2, TABLES, _f1, _i1)
CONTACTS_IMPACT = _i(_i, _i, SCALAR, _i1, _i1, _f1, _f1, LANES, _f2, TABLES, SPACE)
_helpers = (LANE_ROOT, TURNING_RANGE, SCALAR_MOTION, CONTACTS_IMPACT)
HELPERS = types.Tuple([function_type(signature) for signature in _helpers])
RUN_LANES = types.void(CODE, SCALAR, HELPERS, _i1, _i1, _f1, _f1, JOBS, TABLES, RESULTS, _i1)
