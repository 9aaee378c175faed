"""A vector of doubles, one for each lane, in one or two of this machine's registers: a type for numba, and its operations.

Within compiled code `+ - * / < <= > >=` work on vectors, mixed with numbers. A comparison gives a mask; `bits` turns a mask into
an integer with one bit for each lane, on which `& | ~` work, and `mask` turns it back. Memory is counted in slots of one
vector. `Vec` is the same vector where LLVM's code is written directly (see `emit.py`).
"""

from __future__ import annotations

import operator
import os
import platform
from collections.abc import Callable
from itertools import product
from typing import Any

from llvmlite import binding, ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

DOUBLE, BIT, LONG = ir.DoubleType(), ir.IntType(1), ir.IntType(64)


def host_width() -> int:
    """How many lanes suit this machine: 16 with AVX-512, 4 with AVX2, 2 with SSE2 or NEON, else 1.

    With AVX-512 a vector takes two registers: while the processor waits for the sums in one it works on those in the other, and
    a step takes some 10 % less for each lane.

    The environment variable SALTUS_LANES overrides it, for tests: the results are the same.
    """
    if os.environ.get("SALTUS_LANES") in ("1", "2", "4", "8", "16"):
        return int(os.environ["SALTUS_LANES"])
    features = binding.get_host_cpu_features()
    for feature, width in (("avx512f", 16), ("avx2", 4), ("sse2", 2), ("neon", 2)):
        if features.get(feature):
            return width
    return 2 if platform.machine().lower() in ("arm64", "aarch64") else 1


WIDTH = host_width()
ALL = (1 << WIDTH) - 1  # every lane, as bits
VECTOR, MASK = ir.VectorType(DOUBLE, WIDTH), ir.VectorType(BIT, WIDTH)
LONGS = ir.VectorType(LONG, WIDTH)
CACHE_LINE = 64  # bytes
FUSED = ("contract", "nsz")  # what arithmetic may do besides IEEE: fused multiply-adds


class VectorType(types.Type):
    """numba's type of a vector of doubles."""

    def __init__(self) -> None:
        super().__init__(name=f"doubles{WIDTH}")


class MaskType(types.Type):
    """numba's type of a vector of truths."""

    def __init__(self) -> None:
        super().__init__(name=f"truths{WIDTH}")


vector_type, mask_type = VectorType(), MaskType()


@register_model(VectorType)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, MASK)


class Vec:
    """A vector while LLVM's code is written: Python's operators append instructions; numbers become constants."""

    __slots__ = ("builder", "fused", "value")

    def __init__(self, builder: Any, value: Any, fused: bool = True) -> None:
        self.builder, self.value, self.fused = builder, value, fused

    def _new(self, value: Any) -> Vec:
        return Vec(self.builder, value, self.fused)

    def as_value(self, other: Any) -> Any:
        """LLVM's value of a vector or of a number."""
        return other.value if isinstance(other, Vec) else ir.Constant(VECTOR, [float(other)] * WIDTH)

    def _operation(self, name: str, left: Any, right: Any) -> Vec:
        flags = FUSED if self.fused else ("nsz",)
        return self._new(getattr(self.builder, name)(self.as_value(left), self.as_value(right), flags=flags))

    def __add__(self, other: Any) -> Vec:
        return self._operation("fadd", self, other)

    def __radd__(self, other: Any) -> Vec:
        return self._operation("fadd", other, self)

    def __sub__(self, other: Any) -> Vec:
        return self._operation("fsub", self, other)

    def __rsub__(self, other: Any) -> Vec:
        return self._operation("fsub", other, self)

    def __mul__(self, other: Any) -> Vec:
        return self._operation("fmul", self, other)

    def __rmul__(self, other: Any) -> Vec:
        return self._operation("fmul", other, self)

    def __truediv__(self, other: Any) -> Vec:
        return self._operation("fdiv", self, other)

    def __rtruediv__(self, other: Any) -> Vec:
        return self._operation("fdiv", other, self)

    def __neg__(self) -> Vec:
        return self._new(self.builder.fneg(self.value))

    def fma(self, factor: Any, addend: Any) -> Vec:
        """self * factor + addend, rounded once where the machine can."""
        return self._call("llvm.fmuladd", self.value, self.as_value(factor), self.as_value(addend))

    def sqrt(self) -> Vec:
        """The square root."""
        return self._call("llvm.sqrt", self.value)

    def nearest(self) -> Vec:
        """The nearest whole number."""
        return self._call("llvm.rint", self.value)

    def _call(self, name: str, *values: Any) -> Vec:
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(values))
        function = cgutils.get_or_insert_function(self.builder.module, kind, f"{name}.v{WIDTH}f64")
        return self._new(self.builder.call(function, values))

    def compare(self, sign: str, other: Any) -> Any:
        """LLVM's value of the mask of a comparison; False where one is NaN."""
        return self.builder.fcmp_ordered(sign, self.value, self.as_value(other))

    def select(self, mask: Any, other: Any) -> Vec:
        """This vector where the mask is set, and the other one elsewhere."""
        return self._new(self.builder.select(mask, self.value, self.as_value(other)))

    def lane_by_lane(self, name: str, *others: Any) -> Vec:
        """A function of the C library, called for each lane."""
        vectors = [self.value, *(self.as_value(other) for other in others)]
        kind = ir.FunctionType(DOUBLE, [DOUBLE] * len(vectors))
        function = cgutils.get_or_insert_function(self.builder.module, kind, name)
        result = ir.Constant(VECTOR, ir.Undefined)
        for lane in range(WIDTH):
            index = ir.Constant(ir.IntType(32), lane)
            arguments = [self.builder.extract_element(v, index) for v in vectors]
            result = self.builder.insert_element(result, self.builder.call(function, arguments), index)
        return self._new(result)

    def sin_cos(self) -> tuple[Vec, Vec]:
        """Sine and cosine to about one unit in the last place, for arguments up to 1e6.

        The argument is reduced by pi/2 in three parts, of which the first two have 33 bits so that their products with a
        whole number are exact, and the polynomials for [-pi/4, pi/4] are those of fdlibm (Sun Microsystems, 1993).
        """
        n = (self * (2.0 / 3.141592653589793)).nearest()
        r = self - n * 1.57079632673412561417e00
        r = r - n * 6.07710050630396597660e-11
        r = r - n * 2.02226624879595063154e-21
        z = r * r
        s = _polynomial(z, SINE).fma(z * r, r)
        half = z * 0.5
        c = _polynomial(z, COSINE) * (z * z) - half + 1.0
        quadrant = self.builder.fptosi(n.value, LONGS)
        odd = self._bit(quadrant, 0)
        sine, cosine = c.select(odd, s), s.select(odd, c)
        high = self._bit(quadrant, 1)
        return (-sine).select(high, sine), (-cosine).select(self.builder.xor(high, odd), cosine)

    def _bit(self, numbers: Any, place: int) -> Any:
        one = ir.Constant(LONGS, [1 << place] * WIDTH)
        return self.builder.icmp_unsigned("!=", self.builder.and_(numbers, one), ir.Constant(LONGS, [0] * WIDTH))


def everywhere(builder: Any, number: Any) -> Vec:
    """LLVM's number in all lanes."""
    undefined = ir.Constant(VECTOR, ir.Undefined)
    first = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return Vec(builder, builder.shuffle_vector(first, undefined, zeros))


SINE = (
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
)
COSINE = (
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
)


def _polynomial(z: Vec, coefficients: tuple[float, ...]) -> Vec:
    value = z * coefficients[-1] + coefficients[-2]
    for coefficient in coefficients[-3::-1]:
        value = value.fma(z, coefficient)
    return value


# --- memory ----------------------------------------------------------------------------------------------------------------


def slot_pointer(context: Any, builder: Any, array_type: Any, array: Any, slot: Any) -> Any:
    """LLVM's pointer to a slot of a one-dimensional array."""
    data = context.make_array(array_type)(context, builder, array).data
    place = builder.gep(data, [builder.mul(slot, ir.Constant(LONG, WIDTH))])
    return builder.bitcast(place, VECTOR.as_pointer())


@intrinsic
def load(typing: Any, array: Any, slot: Any) -> Any:
    """The vector in a slot of an array."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        loaded = builder.load(slot_pointer(context, builder, signature.args[0], *args))
        loaded.align = 8
        return loaded

    return vector_type(array, types.int64), code


@intrinsic
def store(typing: Any, array: Any, slot: Any, value: Any) -> Any:
    """Put a vector into a slot of an array."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        stored = builder.store(args[2], slot_pointer(context, builder, signature.args[0], *args[:2]))
        stored.align = 8
        return context.get_dummy_value()

    return types.void(array, types.int64, vector_type), code


# --- operations in compiled code --------------------------------------------------------------------------------------------


def _lift(builder: Any, kind: Any, value: Any) -> Vec:
    """A vector, or a number in all lanes."""
    if isinstance(kind, VectorType):
        return Vec(builder, value)
    if isinstance(kind, types.Integer):
        value = builder.sitofp(value, DOUBLE)
    return everywhere(builder, value)


def _function(result: Any, write: Callable[..., Any], count: int) -> Any:
    """A function of compiled code that takes `count` vectors or numbers; `write` gets them as `Vec`."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        written = write(*(_lift(builder, kind, value) for kind, value in zip(signature.args, args, strict=True)))
        return written.value if isinstance(written, Vec) else written

    if count == 1:
        return intrinsic(lambda typing, a: (result(a), code))
    if count == 2:
        return intrinsic(lambda typing, a, b: (result(a, b), code))
    return intrinsic(lambda typing, a, b, c: (result(a, b, c), code))


def _operator(symbol: Any, result: Any, write: Callable[..., Any], count: int = 2) -> None:
    """Let Python's operator mean `write` where a vector is among its operands; the others may be numbers.

    numba's `overload` would compile a function for every pair of types.
    """

    class Meaning(AbstractTemplate):
        key = symbol

        def generic(self, args: Any, kws: Any) -> Any:
            vectors = [isinstance(kind, VectorType) for kind in args]
            if (
                len(args) == count
                and any(vectors)
                and all(v or isinstance(k, types.Number) for v, k in zip(vectors, args, strict=True))
            ):
                return signature(result, *args)
            return None

    infer_global(symbol)(Meaning)

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        written = write(*(_lift(builder, kind, value) for kind, value in zip(sig.args, args, strict=True)))
        return written.value if isinstance(written, Vec) else written

    for kinds in product((VectorType, types.Number), repeat=count):
        if VectorType in kinds:
            lower_builtin(symbol, *kinds)(code)


for _symbol in (operator.add, operator.sub, operator.mul, operator.truediv):
    _operator(_symbol, vector_type, _symbol)
for _symbol, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _operator(_symbol, mask_type, lambda a, b, sign=_sign: a.compare(sign, b))
_operator(operator.neg, vector_type, operator.neg, 1)

absolute = _function(vector_type, lambda a: a._call("llvm.fabs", a.value), 1)
minimum = _function(vector_type, lambda a, b: a.select(a.compare("<", b), b), 2)
maximum = _function(vector_type, lambda a, b: a.select(a.compare(">", b), b), 2)
fma = _function(vector_type, lambda a, b, c: a.fma(b, c), 3)
splat = _function(vector_type, lambda a: a, 1)


def _log2(a: Vec) -> Vec:
    """log2 to 0.05, for a > 0: a line in every octave, as a number's bits are those of an integer that grows like that."""
    bits = a.builder.bitcast(a.value, LONGS)
    return Vec(a.builder, a.builder.sitofp(bits, VECTOR)) * 2.0**-52 - (1023.0 - 0.043)


def _exp2(a: Vec) -> Vec:
    """2**a to 0.4 %, for -1000 < a < 1000: the exponent, and a parabola for the rest."""
    b, whole = a.builder, a._call("llvm.floor", a.value)
    rest = a - whole
    exponent = b.add(b.fptosi(whole.value, LONGS), ir.Constant(LONGS, [1023] * WIDTH))
    power = Vec(b, b.bitcast(b.shl(exponent, ir.Constant(LONGS, [52] * WIDTH)), VECTOR))
    return power * (1.0 + rest * (0.6565 + 0.3435 * rest))


def _inverse(a: Vec) -> Vec:
    """1/a to 1e-5: a line in every octave, and two of Newton's steps."""
    b, bits = a.builder, a.builder.bitcast(a.value, LONGS)
    y = Vec(b, b.bitcast(b.sub(ir.Constant(LONGS, [0x7FDE623822FC16E6] * WIDTH), bits), VECTOR))
    for _ in range(2):
        y = y * (2.0 - a * y)
    return y


def _root(a: Vec) -> Vec:
    """The square root to 0.2 %, for a >= 0, by that of 1/a: a line in every second octave, and one of Newton's steps."""
    b, bits = a.builder, a.builder.bitcast(a.value, LONGS)
    halved = b.lshr(bits, ir.Constant(LONGS, [1] * WIDTH))
    y = Vec(b, b.bitcast(b.sub(ir.Constant(LONGS, [0x5FE6EB50C7B537A9] * WIDTH), halved), VECTOR))
    z = a * y
    return z * (1.5 - (0.5 * y) * z)


rough_inverse = _function(vector_type, _inverse, 1)
rough_root = _function(vector_type, _root, 1)
rough_log2 = _function(vector_type, _log2, 1)
rough_exp2 = _function(vector_type, _exp2, 1)


@intrinsic
def select(typing: Any, chosen: Any, yes: Any, no: Any) -> Any:
    """`yes` where the mask is set, `no` elsewhere."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        yes, no = (_lift(builder, kind, value) for kind, value in zip(signature.args[1:], args[1:], strict=True))
        return yes.select(args[0], no).value

    return vector_type(chosen, yes, no), code


@intrinsic
def bits(typing: Any, chosen: Any) -> Any:
    """A mask as an integer: lane i is bit i."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        narrow = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.zext(narrow, LONG) if WIDTH < 64 else narrow

    return types.int64(chosen), code


@intrinsic
def mask(typing: Any, integer: Any) -> Any:
    """The mask of an integer's bits."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.bitcast(builder.trunc(args[0], ir.IntType(WIDTH)), MASK)

    return mask_type(types.int64), code


@intrinsic
def first_lane(typing: Any, integer: Any) -> Any:
    """The lowest lane whose bit is set, of an integer that is not zero."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.cttz(args[0], ir.Constant(BIT, 1))

    return types.int64(types.int64), code


@intrinsic
def lane_count(typing: Any, integer: Any) -> Any:
    """How many lanes have their bit set."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.ctpop(args[0])

    return types.int64(types.int64), code


@intrinsic
def vector_lane(typing: Any, vector: Any, lane: Any) -> Any:
    """The number in one lane."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.extract_element(args[0], builder.trunc(args[1], ir.IntType(32)))

    return types.float64(vector, types.int64), code


@intrinsic
def with_lane(typing: Any, vector: Any, lane: Any, number: Any) -> Any:
    """The vector with another number in one lane."""

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.insert_element(args[0], args[2], builder.trunc(args[1], ir.IntType(32)))

    return vector_type(vector, types.int64, types.float64), code
