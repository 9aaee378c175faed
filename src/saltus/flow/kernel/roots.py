"""The first root of a polynomial on [0, 1]: exclusion, Bernstein subdivision, bracketed Newton.

This text is compiled together with each kernel (see `compiled.py`), so it uses plain loops and the
decorator `jit`.
"""

from __future__ import annotations

import numpy as np

from saltus.taylor import jit, lean_jit

# --- compiled from here on ---------------------------------------------------

NONE = 0
SIMPLE = 1
NEVER = 2.0  # stands for no root: later than any u in [0, 1]
# square root of the working precision: two roots closer than this are one tangency
NARROW = 2.0**-26
# rounding of a Bernstein coefficient, relative to the sum of the polynomial's terms
NOISE = 4.0 * 2.0**-52
# more than the rounding of a product of as many factors as a series has terms, as a share
ROUNDING_OF_POWERS = 1e-12
# the most boxes on the stack; a bisection down to NARROW leaves one behind at each of 26 levels
DEPTH = 64


@jit
def horner(c, n, x):
    """sum_{k=0..n} c[k] x^k."""
    value = c[n]
    for k in range(n - 1, -1, -1):
        value = value * x + c[k]
    return value


@jit
def value_and_slope(c, n, x):
    """sum_{k=0..n} c[k] x^k and its derivative, n >= 1: in one loop, as each waits for its own last
    sum.
    """
    value = c[n]
    slope = n * c[n]
    for k in range(n - 1, 0, -1):
        value, slope = value * x + c[k], slope * x + k * c[k]
    return value * x + c[0], slope


@jit
def both_sums(a, b, n, x):
    """sum_{k=0..n} a[k] x^k and sum_{k=0..n} b[k] x^k."""
    first = a[n]
    second = b[n]
    for k in range(n - 1, -1, -1):
        first, second = first * x + a[k], second * x + b[k]
    return first, second


@jit
def keeps_sign(p, n):
    """Whether certainly p != 0 on [0, 1]: because p0 + p1 u + p2 u^2 stays farther from 0 than the
    sum of abs(p_k), k >= 3.
    """
    sign = 1.0 if p[0] > 0.0 else -1.0
    rest = 0.0
    for k in range(3, n + 1):
        rest += abs(p[k])
    first = sign * p[0]
    second = sign * p[1]
    third = sign * p[2]
    low = min(first, first + second + third)
    if third > 0.0 and 0.0 < -second < 2.0 * third:
        low = first - second * second / (4.0 * third)
    return low > rest


@jit
def excluded(p, n):
    """Whether certainly p > 0 on [0, 1]."""
    return p[0] > 0.0 and keeps_sign(p, n)


@jit
def to_bernstein(p, n, b):
    """Bernstein coefficients on [0, 1]: b_i = sum_k C(i,k)/C(n,k) p_k, by repeated sums as in
    Pascal's triangle.
    """
    binomial = 1.0
    for k in range(n + 1):
        b[k] = p[k] / binomial
        binomial = binomial * (n - k) / (k + 1)
    for r in range(1, n + 1):
        for i in range(n, r - 1, -1):
            b[i] += b[i - 1]


@jit
def variations(b, n):
    """The number of sign variations of the coefficients, zeros left out: the number of roots is
    this or less by an even number."""
    count = 0
    last = 0
    for i in range(n + 1):
        sign = 1 if b[i] > 0.0 else (-1 if b[i] < 0.0 else 0)
        if sign != 0:
            if last != 0 and sign != last:
                count += 1
            last = sign
    return count


@jit
def leading_sign(b, n):
    """The sign of the first coefficient that is not zero: the sign of the polynomial just after
    0.
    """
    for i in range(n + 1):
        if b[i] != 0.0:
            return 1 if b[i] > 0.0 else -1
    return 0


@jit
def newton(p, n, low, high):
    """The root of p in [low, high], p(low) > 0 >= p(high): Newton's steps, bisection where one
    leaves the bracket.
    """
    at_low = horner(p, n, low)
    at_high = horner(p, n, high)
    share = at_low / (at_low - at_high) if at_low > 0.0 > at_high else 0.5
    # p may be nearly zero at an end, where rounding decides its sign: begin in the middle
    if not 0.01 < share < 0.99:
        share = 0.5
    u = low + share * (high - low)
    before = u
    for left in range(199, -1, -1):
        value, slope = value_and_slope(p, n, u)
        narrower = u != (low if value > 0.0 else high)
        if value > 0.0:
            low = u
        else:
            high = u
        following = u - value / slope if slope != 0.0 else 0.5 * (low + high)
        # at equality the step has converged: bisection would lose nine digits
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - u) <= 2.0**-53 * following or high - low <= 2.0**-53 * high:
            return following
        # often the last steps lead from one of two neighbouring numbers to the other and back
        if following == before and not narrower:
            return u if left % 2 else following
        before = u
        u = following
    return u


@jit
def first_root(p, n):
    """The first root in (0, 1] of a polynomial of degree n that starts positive.

    Returns (kind, u, touch): SIMPLE and the root, or NONE; and the first place before it at which p
    touches zero, within the working precision, without changing its sign (a grazing), or NEVER.
    """
    if excluded(p, n):
        return NONE, NEVER, NEVER
    size = abs(p[0])
    steep = 0.0
    end = p[0]
    for k in range(1, n + 1):
        size += abs(p[k])
        steep += k * abs(p[k])
        end += p[k]
    noise = NOISE * size
    # it falls everywhere, as a small bounce does
    if p[0] > 0.0 > p[1] and -2.0 * p[1] > steep * (1.0 + NOISE) and end < -noise:
        return SIMPLE, newton(p, n, 0.0, 1.0), NEVER
    boxes = np.empty((DEPTH, n + 1))
    left = np.empty(DEPTH)
    width = np.empty(DEPTH)
    to_bernstein(p, n, boxes[0])
    left[0] = 0.0
    width[0] = 1.0
    top = 1
    touch = NEVER
    while top > 0:
        top -= 1
        b = boxes[top]
        low = left[top]
        wide = width[top]
        count = variations(b, n)
        # a root where two boxes meet
        if low > 0.0 and (b[0] <= 0.0 or (b[0] <= noise and count == 0)):
            if leading_sign(b, n) <= 0:
                return SIMPLE, low, touch
            touch = min(touch, low)
        if count == 0:
            continue
        if count == 1 and b[0] > 0.0:
            return SIMPLE, newton(p, n, low, low + wide), touch
        largest = 0.0
        for i in range(n + 1):
            largest = max(largest, abs(b[i]))
        if wide < NARROW or largest <= noise or top + 2 > DEPTH:
            if b[n] < 0.0:
                return SIMPLE, newton(p, n, low, low + wide), touch
            touch = min(touch, low + 0.5 * wide)
            continue
        half = 0.5 * wide
        split(boxes, top, n)
        left[top] = low + half
        width[top] = half
        left[top + 1] = low
        width[top + 1] = half
        top += 2
    return NONE, NEVER, touch


@jit
def split(boxes, top, n):
    """Bisect the box at `top` by de Casteljau: its right half takes its place, its left half goes
    on top, to be next.
    """
    right = boxes[top]
    first = boxes[top + 1]
    for i in range(n + 1):
        first[i] = right[0]
        for k in range(n - i):
            right[k] = 0.5 * (right[k] + right[k + 1])


@jit
def scale_gap(g, skip, order, h, p):
    """p_k = g_{k + skip} h^k for k = 0..order - skip, else 0: the series on [0, 1] without its
    known root at 0.
    """
    power = 1.0
    for k in range(p.size):
        p[k] = 0.0
    for k in range(order - skip + 1):
        p[k] = g[k + skip] * power
        power *= h


@jit
def contact_root(g, skip, order, h, poly):
    """The first zero of the gap within the step, apart from a known zero of order `skip` at its
    start.
    """
    # rounding left the last step's end on the wrong side of the contact
    if skip == 0 and g[0] <= 0.0:
        if g[1] < 0.0:
            return SIMPLE, 0.0, NEVER
        skip = 1
    # leaving from rest: lower coefficients are zero up to rounding
    while skip < order - 2 and g[skip] <= 0.0:
        skip += 1
    # a series of a lower order has none of the others
    if skip > order:
        return NONE, NEVER, NEVER
    scale_gap(g, skip, order, h, poly)
    return first_root(poly, order - skip)


@lean_jit
def margin_root(m, order, h, poly):
    """The instant at which a margin reaches zero within the step, as a share of it; 0 if it is not
    positive at the start, NEVER if it does not reach zero."""
    if m[0] <= 0.0:
        return 0.0
    scale_gap(m, 0, order, h, poly)
    kind, u, _ = first_root(poly, order)
    return u if kind == SIMPLE else NEVER


@lean_jit
def growth_of(coefficients, start, order, size, base, rate):
    """The rate w at which coefficients grow from `size` on, the one at `base`: the least one, not
    below `rate`, with which all from `start` on are at most size w^(k - base).
    """
    grown = rate ** (start - base)  # the power of the rate that coefficient k is compared with
    for k in range(start, order):
        ratio = abs(coefficients[k]) / size
        # roots take long, and most coefficients grow no faster than one before
        if ratio > (1.0 - ROUNDING_OF_POWERS) * grown:
            rate = max(rate, ratio ** (1.0 / (k - base)))
            grown = rate ** (k - base)
        grown *= rate
    return rate


@jit
def leading(coefficients, start, order, zero, size, base, rate):
    """The index from `start` on of the first coefficient that is more than rounding; `order` if
    there is none.

    The coefficients up to `base` exclusively are exactly 0 or not; `size` is the natural size of
    that at `base`, of which the share `zero` is rounding. With the rate w at which the later ones
    grow from `size` on, at least `rate`, the rounding of coefficient k is that times w^(k - base).
    """
    rounding = zero * size
    # the rate is needed only where the first coefficient does not decide
    first = abs(coefficients[start]) if start < order and start <= base else 0.0
    if first > (rounding if start == base else 0.0):
        return start
    if size > 0.0:
        rate = growth_of(coefficients, max(start, base) + 1, order, size, base, rate)
    rounding *= rate ** max(start - base, 0)
    for k in range(start, order):
        if abs(coefficients[k]) > (rounding if k >= base else 0.0):
            return k
        if k >= base:
            rounding *= rate
    return order


@jit
def root_between(p, n, low, high, rises):
    """The root of p in [low, high], where its sign changes once: from minus to plus if it
    `rises`.
    """
    if not rises:
        return newton(p, n, low, high)
    for k in range(n + 1):  # `newton` starts where p is positive
        p[k] = -p[k]
    root = newton(p, n, low, high)
    for k in range(n + 1):
        p[k] = -p[k]
    return root


@jit
def roots_within(p, n, roots, noise):
    """Fill `roots` with the places in (0, 1) at which a polynomial of degree n changes its sign by
    more than `noise`; returns their number."""
    if keeps_sign(p, n):
        return 0
    steep = 0.0
    end = p[0]
    for k in range(1, n + 1):
        steep += k * abs(p[k])
        end += p[k]
    # it rises or falls everywhere
    if min(abs(p[0]), abs(end)) > noise and 2.0 * abs(p[1]) > steep * (1.0 + NOISE):
        if p[0] * end > 0.0:
            return 0
        roots[0] = root_between(p, n, 0.0, 1.0, p[0] < 0.0)
        return 1
    boxes = np.empty((DEPTH, n + 1))
    left = np.empty(DEPTH)
    width = np.empty(DEPTH)
    to_bernstein(p, n, boxes[0])
    left[0] = 0.0
    width[0] = 1.0
    top = 1
    found = 0
    while top > 0:
        top -= 1
        b = boxes[top]
        low = left[top]
        wide = width[top]
        count = variations(b, n)
        largest = 0.0
        for i in range(n + 1):
            largest = max(largest, abs(b[i]))
        if count == 0 or largest <= noise or found == roots.size:
            continue
        if count == 1 or wide < NARROW or top + 2 > DEPTH:
            if count % 2 == 0:
                continue
            # b[0] may be 0
            roots[found] = root_between(p, n, low, low + wide, leading_sign(b, n) < 0)
            found += 1
            continue
        half = 0.5 * wide
        split(boxes, top, n)
        left[top] = low + half
        width[top] = half
        left[top + 1] = low
        width[top + 1] = half
        top += 2
    return found


@lean_jit
def nudged_share(motion, u, h):
    """The share of a step at which an event happens that a test has moved by `nudge` units in the
    last place of the time.
    """
    moved = u + motion.nudge * 2.0**-52 * (motion.time + u * h) / h
    return max(moved, 0.0)
