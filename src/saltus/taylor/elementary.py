"""The elementary functions of pages and of cards: equal in every browser to the last bit, as they are built
from sums and products alone.

Browsers round sines, exponentials and powers differently, and a page must show the same motion in
all of them. Errors are below one unit in the last place, of tanh below 2.1
(`tests/web/test_elementary.py` compares with 40 digits). Arguments of sine and cosine are reduced
by as many digits of pi as they need. All constants are computed here, in whole numbers.

The compiled part goes into one module with LLVM's text of the kernels (`portable_text.py`), under the
names of the C library.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache

import numpy as np

from saltus.taylor.kernels import jit


def _arctangent(x: Fraction) -> Fraction:
    """atan x of a small fraction, by its series in fixed point."""
    unit = 1 << 1400  # pi is needed to 1300 bits for the largest arguments
    power = int(unit * x)
    square = x * x
    total = 0
    k = 0
    while power:
        total += (-1) ** k * (power // (2 * k + 1))
        power, k = power * square.numerator // square.denominator, k + 1
    return Fraction(total, unit)


def _pieces(value: Fraction, sizes: tuple[int, ...]) -> tuple[float, ...]:
    """Doubles whose sum is a number: the first ones have so many bits each, and the last one all
    that a double has.
    """
    pieces = []
    left = value
    for size in sizes:
        unit = Fraction(2) ** (math.floor(math.log2(abs(left))) + 1 - size)
        pieces.append(float(left // unit * unit))
        left -= Fraction(pieces[-1])
    return (*pieces, float(left))


@cache
def _pi() -> Fraction:
    return 16 * _arctangent(Fraction(1, 5)) - 4 * _arctangent(Fraction(1, 239))  # Machin


# 2 atanh(1 / 3)
_LOG_2 = sum((Fraction(2, (2 * k + 1) * 3 ** (2 * k + 1)) for k in range(60)), Fraction(0))
# a multiple by a whole number below 2^20 is exact in each but the last
HALF_PI = _pieces(_pi() / 2, (33, 33, 33))
HALF_PI_PAIR = _pieces(_pi() / 2, (53,))
LOG_2 = _pieces(_LOG_2, (33,))
THIRD = _pieces(Fraction(1, 3), (53,))
TWO_OVER_PI = np.array(
    [int(digits * 2 ** (24 * (i + 1))) & 0xFFFFFF for digits in [2 / _pi()] for i in range(66)]
)  # its binary digits, 24 by 24
ANGLES = tuple(
    _pieces(a, (53,))
    for a in (
        _arctangent(Fraction(1, 2)),
        _pi() / 4,
        _pi() / 4 + _arctangent(Fraction(1, 5)),
        _pi() / 2,
    )
)
FACTORIALS = tuple(1.0 / math.factorial(n) for n in range(24))
ODD = tuple(1.0 / (2 * n + 1) for n in range(30))

# --- compiled from here on ---------------------------------------------------


@jit
def bits_of(x):
    """The 64 bits of a number."""
    return np.float64(x).view(np.int64)


@jit
def power_of_two(k):
    """2^k for -1022 <= k <= 1023."""
    return np.int64((k + 1023) << 52).view(np.float64)


@jit
def scaled(x, k):
    """x 2^k, in two steps, as 2^k itself may be no number."""
    half = k // 2
    return x * power_of_two(half) * power_of_two(k - half)


@jit
def two_sum(a, b):
    """a + b, rounded, and the rounding error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@jit
def halves(a):
    """A number as the sum of two of 26 bits (Veltkamp)."""
    large = 134217729.0 * a
    high = large - (large - a)
    return high, a - high


@jit
def two_product(a, b):
    """a b, rounded, and the rounding error (Dekker)."""
    product = a * b
    a1, a2 = halves(a)
    b1, b2 = halves(b)
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2


@jit
def pair_product(a, a_low, b, b_low):
    """The product of two sums of two numbers."""
    high, low = two_product(a, b)
    return two_sum(high, low + (a * b_low + a_low * b))


@jit
def exponential(high, low):
    """exp(high + low) = (a + b) 2^k, a near 1, for |high| < 1100."""
    k = np.floor(high / LOG_2[0] + 0.5)
    r, r_low = two_sum(high - k * LOG_2[0], low - k * LOG_2[1])
    value = FACTORIALS[16]
    for n in range(15, 1, -1):
        value = value * r + FACTORIALS[n]
    a, b = two_sum(1.0, r)
    return a, b + (r * r * value + r_low * (1.0 + r)), int(k)


@jit
def exp_function(x):
    """e^x."""
    if x != x:
        return x
    if x > 709.8:
        return np.inf
    if x < -745.2:
        return 0.0
    a, b, k = exponential(x, 0.0)
    return scaled(a + b, k)


@jit
def small_sinh(x):
    """sinh x by its series, for |x| < 1."""
    z = x * x
    value = FACTORIALS[21]
    for n in range(19, 1, -2):
        value = value * z + FACTORIALS[n]
    return x + x * z * value


@jit
def hyperbolic(x, sign):
    """(e^x + sign e^-x) / 2 for x >= 0."""
    if x > 711.0:
        return np.inf
    a, b, k = exponential(x, 0.0)
    if x > 30.0:
        return scaled(a + b, k - 1)
    a, b = scaled(a, k), scaled(b, k)
    high, low = two_sum(a, sign / (a + b))
    return 0.5 * (high + (low + b))


@jit
def sinh_function(x):
    """sinh x."""
    if x != x or abs(x) < 1.0:
        return small_sinh(x)
    return np.copysign(hyperbolic(abs(x), -1.0), x)


@jit
def cosh_function(x):
    """cosh x."""
    return x if x != x else hyperbolic(abs(x), 1.0)


@jit
def tanh_function(x):
    """tanh x."""
    if x != x or abs(x) < 1.0:
        return small_sinh(x) / hyperbolic(abs(x), 1.0)
    if abs(x) > 20.0:
        return np.copysign(1.0, x)
    square = exp_function(2.0 * abs(x))
    return np.copysign(1.0 - 2.0 / (square + 1.0), x)


@jit
def logarithm(x):
    """log x of a positive number as a sum of two numbers: k log 2 + 2 atanh s with x = 2^k (1 + f)
    and s = f / (2 + f).
    """
    k = 0
    if x < 2.2250738585072014e-308:
        x, k = x * 18014398509481984.0, -54
    pattern = bits_of(x)
    k += (pattern >> 52) - 1023
    m = np.int64((pattern & 0xFFFFFFFFFFFFF) | (1023 << 52)).view(np.float64)
    if m > 1.4142135623730951:
        m, k = 0.5 * m, k + 1
    f = m - 1.0
    d, d_low = two_sum(2.0, f)
    s = f / d
    p, p_low = two_product(s, d)
    s_low = (((f - p) - p_low) - s * d_low) / d
    z, z_low = pair_product(s, s_low, s, s_low)
    value = ODD[20]
    for n in range(19, 1, -1):
        value = value * z + ODD[n]
    t, t_low = two_sum(THIRD[0], THIRD[1] + value * z)
    t, t_low = pair_product(t, t_low, z, z_low)
    t, t_low = pair_product(t, t_low, s, s_low)
    w, w_low = two_sum(s, t)
    w_low += t_low + s_low
    high, low = two_sum(k * LOG_2[0], 2.0 * w)
    return two_sum(high, low + (2.0 * w_low + k * LOG_2[1]))


@jit
def log_function(x):
    """log x."""
    if x != x or x == np.inf:
        return x
    if x <= 0.0:
        return -np.inf if x == 0.0 else np.nan
    high, low = logarithm(x)
    return high + low


@jit
def positive_power(x, y):
    """x^y of a positive finite number x, finite y."""
    high, low = logarithm(x)
    if abs(y * high) > 1000.0:
        return np.inf if y * high > 0.0 else 0.0
    p, p_low = two_product(y, high)
    p, p_low = two_sum(p, p_low + y * low)
    if p > 709.8:
        return np.inf
    if p < -745.2:
        return 0.0
    a, b, k = exponential(p, p_low)
    return scaled(a + b, k)


@jit
def pow_function(x, y):
    """x^y, with the special cases of the C library."""
    if y == 0.0 or x == 1.0:
        return 1.0
    if x != x or y != y:
        return np.nan
    whole = np.floor(y) == y
    odd = whole and abs(y) < 9007199254740992.0 and np.floor(0.5 * y) != 0.5 * y
    if abs(y) == np.inf:
        if abs(x) == 1.0:
            return 1.0
        return np.inf if (abs(x) > 1.0) == (y > 0.0) else 0.0
    if x == 0.0 or abs(x) == np.inf:
        size = np.inf if (x == 0.0) == (y < 0.0) else 0.0
    elif x < 0.0 and not whole:
        return np.nan
    else:
        size = positive_power(abs(x), y)
    return np.copysign(size, x) if odd else size


@jit
def digits_at(number, place):
    """24 binary digits of a number, given 24 by 24, from a place on."""
    limb = place // 24
    shift = place % 24
    above = number[limb + 1] if limb + 1 < number.size else 0
    return ((number[limb] >> shift) | (above << (24 - shift))) & 0xFFFFFF


@jit
def far_quadrant(x):
    """`quadrant` of a large positive number, from its product with 240 digits of 2 / pi (Payne and
    Hanek, 1983).
    """
    pattern = bits_of(x)
    power = (pattern >> 52) - 1075
    m = (pattern & 0xFFFFFFFFFFFFF) | (1 << 52)
    first = max((power - 2) // 24, 0)
    power -= 24 * first
    number = np.zeros(14, np.int64)
    for i in range(10):
        digits = TWO_OVER_PI[first + 9 - i]
        for j in range(3):
            number[i + j] += digits * ((m >> (24 * j)) & 0xFFFFFF)
    for i in range(13):
        number[i + 1] += number[i] >> 24
        number[i] &= 0xFFFFFF
    place = 240 - power
    n = digits_at(number, place) & 3
    high = 0.0
    low = 0.0
    unit = 1.0
    for i in range(6):
        digits, unit = digits_at(number, place - 24 * (i + 1)), unit / 16777216.0
        if i == 0 and digits >= 8388608:
            digits, n = digits - 16777216, n + 1
        high, error = two_sum(high, digits * unit)
        low += error
    high, low = two_sum(high, low)
    r, r_low = pair_product(high, low, HALF_PI_PAIR[0], HALF_PI_PAIR[1])
    return n & 3, r, r_low


@jit
def quadrant(x):
    """n and r, a sum of two numbers, with x = n pi / 2 + r and |r| <= pi / 4, for x >= 0; n modulo
    4.
    """
    if x > 100000.0:
        return far_quadrant(x)
    n = np.floor(x / HALF_PI_PAIR[0] + 0.5)
    high, error = two_sum(x - n * HALF_PI[0], -n * HALF_PI[1])
    high, more = two_sum(high, -n * HALF_PI[2])
    high, low = two_sum(high, (error + more) - n * HALF_PI[3])
    return np.int64(n) & 3, high, low


@jit
def near_sine(r, low):
    """sin(r + low) for |r| <= pi / 4."""
    z = r * r
    value = FACTORIALS[19]
    for n in range(17, 1, -2):
        value = FACTORIALS[n] - value * z
    return r + (low * (1.0 - 0.5 * z) - r * z * value)


@jit
def near_cosine(r, low):
    """cos(r + low) for |r| <= pi / 4."""
    z = r * r
    value = FACTORIALS[20]
    for n in range(18, 2, -2):
        value = FACTORIALS[n] - value * z
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * z * value - r * low))


@jit
def turned(x, n, r, low):
    """The sine (of n quarters more) at a place that `quadrant` gives."""
    value = near_cosine(r, low) if n & 1 else near_sine(r, low)
    return -value if n & 2 else value


@jit
def sin_function(x):
    """sin x."""
    if x != x or abs(x) == np.inf:
        return np.nan
    if abs(x) < 1e-8:
        return x
    n, r, low = quadrant(abs(x))
    value = turned(x, n, r, low)
    return -value if x < 0.0 else value


@jit
def cos_function(x):
    """cos x."""
    if x != x or abs(x) == np.inf:
        return np.nan
    n, r, low = quadrant(abs(x))
    return turned(x, n + 1, r, low)


@jit
def near_angle(t):
    """atan(t) - t for |t| < 0.45, by its series."""
    z = t * t
    value = ODD[24]
    for n in range(23, 0, -1):
        value = ODD[n] - value * z
    return -t * z * value


@jit
def atan_function(x):
    """atan x: of a number between two of 0, 1/2, 1, 3/2 and infinity by the addition theorem."""
    size = abs(x)
    if x != x or size < 0.4375:
        return x + near_angle(x)
    if size < 0.6875:
        k = 0
        t = (2.0 * size - 1.0) / (2.0 + size)
    elif size < 1.1875:
        k = 1
        t = (size - 1.0) / (size + 1.0)
    elif size < 2.4375:
        k = 2
        t = (size - 1.5) / (1.0 + 1.5 * size)
    else:
        k = 3
        t = -1.0 / size
    high, low = two_sum(ANGLES[k][0], t)
    return np.copysign(high + (low + (ANGLES[k][1] + near_angle(t))), x)


@jit
def nextafter_function(x, y):
    """The next number from x towards y."""
    if x != x or y != y:
        return np.nan
    if x == y:
        return y
    if x == 0.0:
        return np.copysign(5e-324, y)
    away = (y > x) == (x > 0.0)
    return np.int64(bits_of(x) + (1 if away else -1)).view(np.float64)
