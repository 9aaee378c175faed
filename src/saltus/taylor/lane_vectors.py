"""The lanes' vector as a type of numba: within compiled code `+ - * / < <= > >=` work on vectors,
mixed with numbers.

A comparison gives a mask; `bits` turns a mask into an integer with one bit for each lane, on which
`& | ~` work, and `mask` turns it back. Memory is counted in slots of one vector.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types

from saltus.taylor.numba_types import Array, inlined, operator_meaning, register_type
from saltus.taylor.vectors import BIT, DOUBLE, INDEX, LANES, LONG, WIDTH, Vec

ALL = (1 << WIDTH) - 1  # every lane, as bits


class VectorType(types.Type):
    """numba's type of a vector of doubles."""

    def __init__(self) -> None:
        super().__init__(name=f"doubles{WIDTH}")


class MaskType(types.Type):
    """numba's type of a vector of truths."""

    def __init__(self) -> None:
        super().__init__(name=f"truths{WIDTH}")


vector_type = VectorType()
mask_type = MaskType()
register_type(VectorType, LANES.of(DOUBLE))
register_type(MaskType, LANES.of(BIT))


def _lift(builder: Any, kind: Any, value: Any) -> Vec:
    """A vector, or a number in all lanes."""
    if isinstance(kind, VectorType):
        return Vec(builder, value, LANES)
    if isinstance(kind, types.Integer):
        value = builder.sitofp(value, DOUBLE)
    return LANES.everywhere(builder, value)


def _on_vectors(write: Callable[..., Any]) -> Callable[..., Any]:
    """`write` gets vectors, whether vectors or numbers are given, and gives a vector or a mask."""

    def code(builder: Any, kinds: Any, *args: Any) -> Any:
        result = write(
            *(_lift(builder, kind, value) for kind, value in zip(kinds, args, strict=True))
        )
        return result.value if isinstance(result, Vec) else result

    return code


# --- operators ---------------------------------------------------------------


for _symbol in (operator.add, operator.sub, operator.mul, operator.truediv):
    operator_meaning(_symbol, VectorType, vector_type, _on_vectors(_symbol))
for _symbol, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
):
    _compare = _on_vectors(lambda a, b, sign=_sign: a.compare(sign, b))
    operator_meaning(_symbol, VectorType, mask_type, _compare)
operator_meaning(operator.neg, VectorType, vector_type, _on_vectors(operator.neg), 1)


# --- functions on vectors ----------------------------------------------------


def _log2(a: Vec) -> Vec:
    """log2 to 0.05, for a > 0: linear in every octave, as is the integer that has the same bits as
    the number.
    """
    bits = a.builder.bitcast(a.value, LANES.of(LONG))
    return Vec(a.builder, a.builder.sitofp(bits, LANES.of(DOUBLE)), LANES) * 2.0**-52 - (
        1023.0 - 0.043
    )


def _exp2(a: Vec) -> Vec:
    """2**a to 0.4 %, for -1000 < a < 1000: the exponent, and a parabola for the rest."""
    b = a.builder
    whole = a.intrinsic("llvm.floor")
    rest = a - whole
    exponent = b.add(b.fptosi(whole.value, LANES.of(LONG)), LANES.constant(1023, LONG))
    power = Vec(b, b.bitcast(b.shl(exponent, LANES.constant(52, LONG)), LANES.of(DOUBLE)), LANES)
    return power * (1.0 + rest * (0.6565 + 0.3435 * rest))


def _inverse(a: Vec) -> Vec:
    """1/a to 1e-5: a line in every octave, and two of Newton's steps."""
    b = a.builder
    bits = a.builder.bitcast(a.value, LANES.of(LONG))
    y = Vec(
        b, b.bitcast(b.sub(LANES.constant(0x7FDE623822FC16E6, LONG), bits), LANES.of(DOUBLE)), LANES
    )
    for _ in range(2):
        y = y * (2.0 - a * y)
    return y


def _root(a: Vec) -> Vec:
    """The square root to 0.2 %, for a >= 0, by that of 1/a: a line in every second octave, and one
    of Newton's steps.
    """
    b = a.builder
    bits = a.builder.bitcast(a.value, LANES.of(LONG))
    halved = b.lshr(bits, LANES.constant(1, LONG))
    y = Vec(
        b,
        b.bitcast(b.sub(LANES.constant(0x5FE6EB50C7B537A9, LONG), halved), LANES.of(DOUBLE)),
        LANES,
    )
    z = a * y
    return z * (1.5 - (0.5 * y) * z)


def _function(write: Callable[..., Any], count: int = 1) -> Any:
    """A function of vectors or numbers that gives a vector."""
    return inlined(vector_type, _on_vectors(write), count)


absolute = _function(lambda a: a.intrinsic("llvm.fabs"))
minimum = _function(lambda a, b: a.select(a.compare("<", b), b), 2)
maximum = _function(lambda a, b: a.select(a.compare(">", b), b), 2)
fma = _function(lambda a, b, c: a.fma(b, c), 3)
splat = _function(lambda a: a)
rough_inverse, rough_root, rough_log2, rough_exp2 = (
    _function(write) for write in (_inverse, _root, _log2, _exp2)
)


# --- memory, masks and lanes -------------------------------------------------


def _slot(builder: Any, array: Array, slot: Any) -> Any:
    """LLVM's pointer to a slot of a one-dimensional array."""
    place = builder.gep(array.data, [builder.mul(slot, LONG(WIDTH))])
    return builder.bitcast(place, LANES.of(DOUBLE).as_pointer())


def _load(builder: Any, kinds: Any, array: Array, slot: Any) -> Any:
    loaded = builder.load(_slot(builder, array, slot))
    loaded.align = 8
    return loaded


def _store(builder: Any, kinds: Any, array: Array, slot: Any, value: Any) -> None:
    builder.store(value, _slot(builder, array, slot)).align = 8


def _lane(builder: Any, array: Array, slot: Any, lane: Any) -> Any:
    """LLVM's pointer to the number of one lane in a slot."""
    return builder.gep(array.data, [builder.add(builder.mul(slot, LONG(WIDTH)), lane)])


def _get(builder: Any, kinds: Any, array: Array, slot: Any, lane: Any) -> Any:
    return builder.load(_lane(builder, array, slot, lane))


def _put(builder: Any, kinds: Any, array: Array, slot: Any, lane: Any, number: Any) -> None:
    builder.store(number, _lane(builder, array, slot, lane))


def _replace(builder: Any, kinds: Any, array: Array, slot: Any, chosen: Any, value: Any) -> None:
    new = Vec(builder, value, LANES)
    old = Vec(builder, _load(builder, kinds, array, slot), LANES)
    _store(builder, kinds, array, slot, new.select(chosen, old).value)


def _select(builder: Any, kinds: Any, chosen: Any, yes: Any, no: Any) -> Any:
    return _lift(builder, kinds[1], yes).select(chosen, _lift(builder, kinds[2], no)).value


def _bits(builder: Any, kinds: Any, chosen: Any) -> Any:
    return builder.zext(builder.bitcast(chosen, ir.IntType(WIDTH)), LONG)


def _mask(builder: Any, kinds: Any, integer: Any) -> Any:
    return builder.bitcast(builder.trunc(integer, ir.IntType(WIDTH)), LANES.of(BIT))


def _vector_lane(builder: Any, kinds: Any, vector: Any, lane: Any) -> Any:
    return vector if WIDTH == 1 else builder.extract_element(vector, builder.trunc(lane, INDEX))


def _with_lane(builder: Any, kinds: Any, vector: Any, lane: Any, number: Any) -> Any:
    return (
        number if WIDTH == 1 else builder.insert_element(vector, number, builder.trunc(lane, INDEX))
    )


load = inlined(vector_type, _load, 2)  # the vector in a slot of an array
store = inlined(types.void, _store, 3)  # put a vector into a slot of an array
# put a vector into a slot of an array, in the lanes whose mask is set
replace = inlined(types.void, _replace, 4)
get = inlined(types.float64, _get, 3)  # the number of one lane in a slot of an array
put = inlined(types.void, _put, 4)  # set the number of one lane in a slot of an array
# of a mask and two vectors: the first where the mask is set, the other one elsewhere
select = inlined(vector_type, _select, 3)
bits = inlined(types.int64, _bits, 1)  # a mask as an integer: lane i is bit i
mask = inlined(mask_type, _mask, 1)  # the mask of an integer's bits
vector_lane = inlined(types.float64, _vector_lane, 2)  # the number in one lane
with_lane = inlined(vector_type, _with_lane, 3)  # the vector with another number in one lane
# The place of the lowest bit that is set in an integer (there must be one), and the number of bits
# that are set.
first_lane = inlined(types.int64, lambda builder, kinds, integer: builder.cttz(integer, BIT(1)), 1)
lane_count = inlined(types.int64, lambda builder, kinds, integer: builder.ctpop(integer), 1)
