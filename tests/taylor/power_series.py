"""Truncated power series in 40 digits, composed by brute force: what the generated recurrences are
held against.

f(u) is the sum of f^(j)(u_0) / j! (u - u_0)^j, with the derivatives from mpmath and the powers
multiplied out. No recurrence of `saltus.taylor.rules` is used.
"""

import mpmath as mp
import numpy as np

from saltus.taylor import rules

DIGITS = 40
# By NumPy's names: every function of the rules, which mpmath has under the same name.
FUNCTIONS = {rule.numpy.__name__: getattr(mp, name) for name, rule in rules.FUNCTIONS.items()} | {
    "tan": mp.tan
}


class Series:
    """sum c_k tau^k, k < len(c); answers Python's operators and NumPy's functions, so that a
    model's own formula runs on it.
    """

    __array_priority__ = 2000

    def __init__(self, coefficients):
        self.c = [mp.mpf(x) for x in coefficients]

    def _other(self, value):
        return value if isinstance(value, Series) else Series([value] + [0] * (len(self.c) - 1))

    def __add__(self, other):
        return Series([a + b for a, b in zip(self.c, self._other(other).c, strict=True)])

    def __mul__(self, other):
        b = self._other(other).c
        return Series([mp.fsum(self.c[j] * b[k - j] for j in range(k + 1)) for k in range(len(b))])

    def __neg__(self):
        return self * -1

    def __pos__(self):
        return self

    def __sub__(self, other):
        return self + self._other(other) * -1

    def __rsub__(self, other):
        return self._other(other) - self

    def __truediv__(self, other):
        return self * self._other(other).compose(lambda x: 1 / x)

    def __rtruediv__(self, other):
        return self._other(other) / self

    def __pow__(self, exponent):
        if isinstance(exponent, Series):
            return (exponent * self.compose(mp.log)).compose(mp.exp)
        return self.compose(lambda x: x ** mp.mpf(exponent))

    def __rpow__(self, base):
        return self.compose(lambda x: mp.mpf(base) ** x)

    __radd__, __rmul__ = __add__, __mul__

    def __abs__(self):
        return self if self.c[0] > 0 else -self

    def compose(self, function):
        """function(self)."""
        n = len(self.c)
        outer = mp.taylor(function, self.c[0], n - 1)
        step, result = Series([0, *self.c[1:]]), Series([outer[-1]] + [0] * (n - 1))
        for coefficient in outer[-2::-1]:
            result = result * step + coefficient
        return result

    def __array_ufunc__(self, ufunc, method, *inputs):
        name = ufunc.__name__
        if name in FUNCTIONS:
            return inputs[0].compose(FUNCTIONS[name])
        left = inputs[0] if isinstance(inputs[0], Series) else self._other(float(inputs[0]))
        if len(inputs) == 1:
            return {
                "absolute": abs,
                "negative": lambda x: -x,
                "positive": lambda x: x,
                "square": lambda x: x * x,
            }[name](left)
        operations = {
            "add": lambda a, b: a + b,
            "subtract": lambda a, b: a - b,
            "multiply": lambda a, b: a * b,
            "divide": lambda a, b: a / b,
            "power": lambda a, b: a**b,
        }
        right = inputs[1] if isinstance(inputs[1], Series) else float(inputs[1])
        return operations[name](left, right)


def solution(acceleration, position, velocity, t0, order):
    """The Taylor coefficients about t0 of q'' = acceleration(t, q, v), a function of `Series`;
    tuples for several coordinates.
    """
    several = isinstance(position, tuple)
    starts = list(zip(position, velocity, strict=True)) if several else [(position, velocity)]
    with mp.workdps(DIGITS):
        q = [[mp.mpf(x), mp.mpf(v)] for x, v in starts]
        for n in range(1, order):
            place = tuple(Series(c[:n]) for c in q)
            speed = tuple(Series([k * c[k] for k in range(1, n + 1)]) for c in q)
            t = Series([t0, 1, *[0] * n][:n])
            rates = (
                acceleration(t, place, speed) if several else (acceleration(t, place[0], speed[0]),)
            )
            for c, rate in zip(q, rates, strict=True):
                c.append(
                    (rate.c[n - 1] if isinstance(rate, Series) else rate * (n == 1)) / (n * (n + 1))
                )
        coefficients = np.array([[float(x) for x in c] for c in q])
    return coefficients if several else coefficients[0]
