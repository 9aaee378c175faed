"""The numbers of generated arithmetic: one double, or a vector of doubles with one for each lane.

`Vec` stands for such a number while LLVM's code is written: Python's operators append instructions.
None stands for a number that is known to be zero, and a float for any other number that is known.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, cast

from llvmlite import binding, ir

DOUBLE = ir.DoubleType()
BIT = ir.IntType(1)
LONG = ir.IntType(64)
INDEX = ir.IntType(32)
CACHE_LINE = 64  # bytes
FUSED = ("contract", "nsz")  # LLVM's flags that allow fused multiply-adds


def host_width() -> int:
    """How many lanes suit this machine: 16 with AVX-512, 4 with AVX2, 2 with SSE2 or NEON, else 1.

    With AVX-512 a vector takes two registers: while the processor waits for the sums in one, it
    works on those in the other, so that a step takes about 10 % less time for each lane. The
    environment variable SALTUS_LANES overrides it, for tests: the results are the same.
    """
    if os.environ.get("SALTUS_LANES") in ("1", "2", "4", "8", "16"):
        return int(os.environ["SALTUS_LANES"])
    features = binding.get_host_cpu_features()
    for feature, width in (("avx512f", 16), ("avx2", 4), ("sse2", 2), ("neon", 2)):
        if features.get(feature):
            return width
    return 2 if platform.machine().lower() in ("arm64", "aarch64") else 1


WIDTH = host_width()


@dataclass(frozen=True)
class Arithmetic:
    """How numbers are computed: on how many lanes at once, whether multiply-adds may be fused, and
    how exactly.
    """

    width: int
    fused: bool = True
    # quotients are rounded once, the C library has sine and cosine; lanes use reciprocals,
    # polynomials
    exact: bool = False

    def of(self, element: Any) -> Any:
        """LLVM's type of a number, a truth or an integer for each lane."""
        return element if self.width == 1 else ir.VectorType(element, self.width)

    def constant(self, value: float, element: Any = DOUBLE) -> Any:
        """LLVM's constant with the same value in all lanes."""
        return ir.Constant(self.of(element), value if self.width == 1 else [value] * self.width)

    def number(self, builder: Any, value: float) -> Vec:
        """One number in all lanes."""
        return Vec(builder, self.constant(value), self)

    def everywhere(self, builder: Any, number: Any) -> Vec:
        """LLVM's number in all lanes."""
        if self.width == 1:
            return Vec(builder, number, self)
        undefined = ir.Constant(self.of(DOUBLE), ir.Undefined)
        first = builder.insert_element(undefined, number, ir.Constant(INDEX, 0))
        zeros = ir.Constant(self.of(INDEX), [0] * self.width)
        return Vec(builder, builder.shuffle_vector(first, undefined, zeros), self)

    @property
    def divides(self) -> bool:
        """Whether quotients need divisions: without fused multiply-adds a product with an inverse
        in two parts is no quotient.
        """
        return self.exact and not self.fused

    def unfused(self) -> Arithmetic:
        """The same without fused multiply-adds: a law that takes the difference of two equal
        products must get 0.
        """
        return replace(self, fused=False)


SCALAR = Arithmetic(1, exact=True)
LANES = Arithmetic(WIDTH)


class Vec:
    """A number, or a vector of them, while LLVM's code is written: Python's operators append
    instructions.
    """

    __slots__ = ("arithmetic", "builder", "value")

    def __init__(self, builder: Any, value: Any, arithmetic: Arithmetic) -> None:
        self.builder = builder
        self.value = value
        self.arithmetic = arithmetic

    def _new(self, value: Any) -> Vec:
        return Vec(self.builder, value, self.arithmetic)

    def as_value(self, other: Any) -> Any:
        """LLVM's value of this kind of a vector or of a number."""
        return other.value if isinstance(other, Vec) else self.arithmetic.constant(float(other))

    def _operation(self, name: str, left: Any, right: Any) -> Vec:
        flags = FUSED if self.arithmetic.fused else FUSED[1:]
        return self._new(
            getattr(self.builder, name)(self.as_value(left), self.as_value(right), flags=flags)
        )

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
        return self.intrinsic("llvm.fmuladd", factor, addend)

    def inverse(self) -> tuple[Vec, Vec]:
        """1 / self, and what rounding takes from it."""
        inverse = 1.0 / self
        return inverse, (-inverse).fma(self, 1.0) * inverse

    def function(self, name: str, *others: Any) -> Vec:
        """An elementary function by its name in the C library."""
        if name == "sqrt":
            return self.intrinsic("llvm.sqrt")
        if name in ("sin", "cos"):
            return (
                self.intrinsic(f"llvm.{name}")
                if self.arithmetic.exact
                else self._sin_cos()[name == "cos"]
            )
        return self._library(name, [self.value, *(self.as_value(other) for other in others)])

    def intrinsic(self, name: str, *others: Any) -> Vec:
        """One of LLVM's own functions, of this and other numbers."""
        width = "f64" if self.arithmetic.width == 1 else f"v{self.arithmetic.width}f64"
        values = [self.value, *(self.as_value(other) for other in others)]
        return self._new(self._call(f"{name}.{width}", self.arithmetic.of(DOUBLE), values))

    def _call(self, name: str, kind: Any, values: list[Any]) -> Any:
        module = self.builder.module
        function = module.globals.get(name) or ir.Function(
            module, ir.FunctionType(kind, [kind] * len(values)), name
        )
        return self.builder.call(function, values)

    def compare(self, sign: str, other: Any) -> Any:
        """LLVM's value of the mask of a comparison; False where one is NaN."""
        return self.builder.fcmp_ordered(sign, self.value, self.as_value(other))

    def select(self, mask: Any, other: Any) -> Vec:
        """This vector where the mask is set, and the other one elsewhere."""
        return self._new(self.builder.select(mask, self.value, self.as_value(other)))

    def _library(self, name: str, values: list[Any]) -> Vec:
        """A function of the C library, called for each lane."""
        if self.arithmetic.width == 1:
            return self._new(self._call(name, DOUBLE, values))
        result = ir.Constant(self.arithmetic.of(DOUBLE), ir.Undefined)
        for lane in range(self.arithmetic.width):
            index = ir.Constant(INDEX, lane)
            arguments = [self.builder.extract_element(v, index) for v in values]
            result = self.builder.insert_element(result, self._call(name, DOUBLE, arguments), index)
        return self._new(result)

    def _sin_cos(self) -> tuple[Vec, Vec]:
        """Sine and cosine to about one unit in the last place, for arguments up to 1e6.

        The argument is reduced by pi/2 in three parts, of which the first two have 33 bits so that
        their products with a whole number are exact, and the polynomials for [-pi/4, pi/4] are
        those of fdlibm (Sun Microsystems, 1993).
        """
        n = (self * (2.0 / 3.141592653589793)).intrinsic("llvm.rint")
        r = self - n * 1.57079632673412561417e00
        r = r - n * 6.07710050630396597660e-11
        r = r - n * 2.02226624879595063154e-21
        z = r * r
        s = _polynomial(z, SINE).fma(z * r, r)
        half = z * 0.5
        c = _polynomial(z, COSINE) * (z * z) - half + 1.0
        quadrant = self.builder.fptosi(n.value, self.arithmetic.of(LONG))
        odd = self._bit(quadrant, 0)
        sine = c.select(odd, s)
        cosine = s.select(odd, c)
        high = self._bit(quadrant, 1)
        return (-sine).select(high, sine), (-cosine).select(self.builder.xor(high, odd), cosine)

    def _bit(self, numbers: Any, place: int) -> Any:
        one, zero = (self.arithmetic.constant(value, LONG) for value in (1 << place, 0))
        return self.builder.icmp_unsigned("!=", self.builder.and_(numbers, one), zero)


Coefficient = Vec | float | None  # of a series; None: zero

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


def add(a: Coefficient, b: Coefficient) -> Coefficient:
    """a + b, where None is zero."""
    return b if a is None else a if b is None else a + b


def subtract(a: Coefficient, b: Coefficient) -> Coefficient:
    """a - b, where None is zero."""
    return a if b is None else negative(b) if a is None else a - b


def negative(a: Coefficient) -> Coefficient:
    """-a, where None is zero."""
    return None if a is None else -a


def multiply(a: Coefficient, b: Coefficient) -> Coefficient:
    """a b, where None is zero and a factor of one costs nothing."""
    if a is None or b is None:
        return None
    for x, y in ((a, b), (b, a)):
        if not isinstance(x, Vec) and x in (1.0, -1.0):
            return y if x == 1.0 else -y
    return a * b


def dot(pairs: Iterable[tuple[Coefficient, Coefficient]], start: Coefficient = None) -> Coefficient:
    """start + the sum of the products; None stands for zero."""
    for a, b in pairs:
        if a is not None and b is not None:
            vector, factor = (a, b) if isinstance(a, Vec) else (b, a)
            # two known numbers come first
            start = multiply(a, b) if start is None else cast(Vec, vector).fma(factor, start)
    return start


@contextmanager
def loop(
    builder: Any, begin: int, end: Any, starts: Sequence[Vec] = (), after: list[Vec] | None = None
) -> Iterator[Any]:
    """A loop over whole numbers, at least once. With `after` numbers go through it, which begin
    with `starts`: the code within appends their next values to it, and they are the last ones
    afterwards."""
    before = builder.block
    body = builder.append_basic_block("loop")
    builder.branch(body)
    builder.position_at_end(body)
    i = builder.phi(LONG)
    i.add_incoming(LONG(begin), before)
    carried = [builder.phi(start.value.type) for start in starts]
    yield (
        i
        if after is None
        else (
            i,
            [Vec(builder, x, start.arithmetic) for x, start in zip(carried, starts, strict=True)],
        )
    )
    for x, start, value in zip(carried, starts, after or (), strict=True):
        x.add_incoming(start.value, before)
        x.add_incoming(value.value, builder.block)
    following = builder.add(i, LONG(1))
    i.add_incoming(following, builder.block)
    done = builder.append_basic_block("after")
    builder.cbranch(
        builder.icmp_signed("<", following, LONG(end) if isinstance(end, int) else end), body, done
    )
    builder.position_at_end(done)


def quotient(value: Coefficient, inverse: Vec, rest: Vec) -> Coefficient:
    """A number times an inverse in two parts (`Vec.inverse`), in two thirds of a division's time.

    What must be exact is rounded once, as the quotient is: with the first part alone the
    coefficients of a series would have the same error in every step.
    """
    return dot([(inverse, value)], multiply(rest, value) if inverse.arithmetic.exact else None)


def inverses(builder: Any, count: int) -> list[Any]:
    """Tables of 1/k for k below `count`, and of what rounding takes from it."""
    whole = range(1, count)
    parts = [1.0 / k for k in whole], [float(Fraction(1, k) - Fraction(1.0 / k)) for k in whole]
    return [constant_table(builder, [1.0, *part]) for part in parts]


class InnerLoop:
    """A loop over j = 1 ..

    k - 1 that makes the sums of some products of series for the orders k and k + 1 (see
    `series.py`).
    """

    def __init__(self, series: Any) -> None:
        self.series, self.builder = series, series.builder
        self.block = self.builder.append_basic_block("sums")
        # LLVM's variable, its value at first, its next value
        self._changing: list[tuple[Any, Any, Any]] = []
        self._loaded: dict[tuple[int, bool], Vec] = {}
        self._carried: dict[int, Vec] = {}
        self.made = 0  # sums
        self._j = self._variable(LONG)

    def sums(self, forward: Any, backward: Any) -> tuple[Vec, Vec]:
        """sum a_j b_{k-j} and sum a_j b_{k+1-j} of a `forward`, b `backward`; a_1 b_k only if b_k
        is known before the loop.
        """
        self.made += 1
        with self.builder.goto_block(self.block):
            a = self._load(forward, False)
            b = self._load(backward, True)
            return self._sum(a, b), self._sum(a, self._before(backward, b))

    def _variable(self, kind: Any) -> Any:
        with self.builder.goto_block(self.block):
            self.builder.position_at_start(self.block)
            return self.builder.phi(kind)

    def _load(self, row: Any, backwards: bool) -> Vec:
        """Coefficient j, or k - j, of a series."""
        key = (id(row), backwards)
        if key not in self._loaded:
            index = self.builder.sub(self.series.order, self._j) if backwards else self._j
            self._loaded[key] = self.series._at(row, index)
        return self._loaded[key]

    def _before(self, row: Any, loaded: Vec) -> Vec:
        """Coefficient k + 1 - j, which the iteration before has loaded."""
        if id(row) not in self._carried:
            variable = self._variable(self.series._kind)
            start = self.series.memory.value(row.pair[0] if row.early else None)
            self._changing.append((variable, start, loaded.value))
            self._carried[id(row)] = Vec(self.builder, variable, self.series.memory.arithmetic)
        return self._carried[id(row)]

    def _sum(self, a: Vec, b: Vec) -> Vec:
        variable = self._variable(self.series._kind)
        total = a.fma(b, Vec(self.builder, variable, self.series.memory.arithmetic))
        self._changing.append((variable, a.as_value(0.0), total.value))
        return total

    def close(self, before: Any, after: Any) -> None:
        """Join the loop to the code before and after it."""
        with self.builder.goto_block(self.block):
            following = self.builder.add(self._j, LONG(1))
            self.builder.cbranch(
                self.builder.icmp_signed("<", following, self.series.order), self.block, after
            )
        for variable, start, value in [(self._j, LONG(1), following), *self._changing]:
            variable.add_incoming(start, before)
            variable.add_incoming(value, self.block)


class ColumnInputs:
    """What is pushed in the columns of parameters, in memory: zeros for the other columns, then
    numbers for each of these.
    """

    def __init__(self, memory: Any, columns: int, pushes: Sequence[Sequence[Any]]) -> None:
        """`pushes` are, of each number that a column has, those in the last of all columns, None
        for 0.
        """
        self._builder = memory.builder
        self._arithmetic = memory.arithmetic
        self._pushes = {
            i: each for i, each in enumerate(pushes) if any(push is not None for push in each)
        }
        self._first = columns - max(map(len, self._pushes.values()), default=0)
        size = max(1, len(self._pushes) * (1 + columns - self._first))
        with self._builder.goto_entry_block():
            self._array = self._builder.alloca(self._arithmetic.of(DOUBLE), size)
            self._array.align = min(CACHE_LINE, 8 * self._arithmetic.width)
            for place in range(len(self._pushes)):
                self._put(place, None)

    def store(self, value: Callable[[Any], Coefficient]) -> None:
        """Put the present values into memory."""
        pushes = (push for column in zip(*self._pushes.values(), strict=True) for push in column)
        for place, push in enumerate(pushes, len(self._pushes)):
            self._put(place, None if push is None else value(push))

    def of(self, i: int, column: Any) -> Vec:
        """What is pushed in LLVM's column, as counted from 0, of one of its numbers."""
        b = self._builder
        if i not in self._pushes:
            return Vec(b, self._arithmetic.constant(0.0), self._arithmetic)
        own = b.sub(column, LONG(self._first - 1))
        own = b.select(b.icmp_signed("<", own, LONG(0)), LONG(0), own)
        place = b.add(b.mul(own, LONG(len(self._pushes))), LONG(list(self._pushes).index(i)))
        return Vec(b, b.load(b.gep(self._array, [place])), self._arithmetic)

    def _put(self, place: int, value: Coefficient) -> None:
        number = value.value if isinstance(value, Vec) else self._arithmetic.constant(value or 0.0)
        self._builder.store(number, self._builder.gep(self._array, [LONG(place)]))


def constant_table(builder: Any, numbers: list[float]) -> Any:
    """LLVM's pointer to an array of constants in the compiled code."""
    values = ir.Constant(ir.ArrayType(ir.DoubleType(), len(numbers)), numbers)
    module = builder.module
    table = ir.GlobalVariable(module, values.type, module.get_unique_name("numbers"))
    table.linkage = "internal"
    table.global_constant = True
    table.initializer = values
    return table
