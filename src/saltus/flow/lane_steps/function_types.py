"""The numba types of a group of lanes and of its functions that are called through pointers (see
`kernel/memory.py`).

Models with one contact or none, and models with several, have a type of group each; `shared`,
`RUN_LANES` and the others below are those of the former, and `of_contacts` those of the latter.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import from_dtype, types

from saltus.flow.kernel.memory import (
    ADVANCE,
    ADVANCE_CONTACTS,
    CONSTANTS,
    CONTACT_MODEL,
    GEOMETRY,
    MATRICES,
    MODEL,
    NUMBERS,
    SolverArrays,
)
from saltus.flow.lane_steps.memory import (
    END,
    FLAGS,
    JOB,
    ROW,
    SERIES,
    Code,
    Helpers,
    LaneGroup,
    LaneSettings,
    LaneSizes,
    Parts,
    Slots,
    Work,
)
from saltus.taylor import function_type, written_type
from saltus.taylor.lane_memory import LanesType, LaneType, named_tuple, shared_as

_f = types.float64
_i = types.int64
_f1, _f2, _f3, _f4 = (types.Array(_f, n, "C") for n in (1, 2, 3, 4))
_i1, _i2, _i3 = (types.Array(_i, n, "C") for n in (1, 2, 3))


def _records(dtype: np.dtype[Any]) -> Any:
    return types.Array(from_dtype(dtype), 1, "C")


# memory of the lanes, the first slots of its parts, order
LANE_SERIES = LANE_ONE_FREE = types.void(_f1, _i1, _i)
LANE_IMPACT = LANE_FIELD = types.void(_f1, _i1)
TURNING_RANGE = types.UniTuple(_f, 2)(_f1, _i, _f, _f, _f1)
TABLES = types.Tuple((_f2, _f4))
_LIMITS = types.Tuple((_f, types.UniTuple(_f, 2), _f, types.UniTuple(_f, 4)))
_SIZES = named_tuple(LaneSizes, *(27 * (_i,)), _i1, _i1)
_SETTINGS = named_tuple(LaneSettings, _f, _f, _f, _f, _LIMITS, _LIMITS, _f)
_WORK = named_tuple(Work, _f2, _records(JOB), _f2, TABLES, _f2, _records(END), _f2, _f3, _i1)
_SOLVER = named_tuple(SolverArrays, _f1, *4 * (_f2,), *13 * (_f1,), _f2, _f2, *4 * (_f1,))


class LaneTypes(NamedTuple):
    """The types of the lanes' functions for a kind of models."""

    shared: Any  # the intrinsic that gives a group's tuple as its lanes
    RUN_LANES: Any  # the types of functions
    LANE_ROOT: Any
    SCALAR_MOTION: Any
    CONTACTS_IMPACT: Any


def _lane_types(name: str, code: Any, advance: Any, functions: Any, several: bool) -> LaneTypes:
    """The types for models with one contact or none, or with several.

    A lane is an argument of functions to which its group has pointers, so the type of the group's
    tuple comes last.
    """
    space = types.Tuple((NUMBERS, _f1, _i2, _SOLVER)) if several else types.none
    lanes = LanesType(name, Slots._fields, Parts._fields, SERIES, rows="rows", flags="flags")
    lane = LaneType(lanes)
    root = _f(lane, _i, _f, _f, _f, _i)
    motion = types.UniTuple(_i, 2)(lane)
    impact = _i(lane, _i)
    helpers: list[Any] = [
        function_type(signature)
        for signature in (root, TURNING_RANGE, motion, impact)[: 4 if several else 3]
    ]
    helpers += [function_type(advance)] if several else [types.none, function_type(advance)]
    group = named_tuple(
        LaneGroup,
        *(
            _f1,
            _i1,
            _SIZES,
            _SETTINGS,
            named_tuple(Code, *code),
            named_tuple(Helpers, *helpers),
            types.Tuple((functions,)),
        ),
        *(_records(FLAGS), _records(ROW), _f2, _f2, _f3, _i2, _i3, _f1, _f1, space, _WORK),
    )
    LanesType.tuples[name] = group
    return LaneTypes(shared_as(lanes), types.void(group), root, motion, impact)


_code = [written_type(signature) for signature in (LANE_SERIES, LANE_IMPACT, LANE_FIELD, CONSTANTS)]
_geometry, _matrices, _one_free = (
    written_type(signature) for signature in (GEOMETRY, MATRICES, LANE_ONE_FREE)
)
_functions = types.Tuple(tuple(MODEL.types[i] for i in (0, 1, 2, 3, 5)))
ONE_CONTACT = _lane_types(
    "lanes of one contact", (*_code, _geometry, types.none), ADVANCE, _functions, several=False
)
CONTACTS = _lane_types(
    "lanes of several contacts",
    (*_code, _matrices, _one_free),
    ADVANCE_CONTACTS,
    CONTACT_MODEL,
    several=True,
)
shared, RUN_LANES, LANE_ROOT, SCALAR_MOTION, CONTACTS_IMPACT = ONE_CONTACT
