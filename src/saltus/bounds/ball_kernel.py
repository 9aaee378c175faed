"""Taylor series in ball arithmetic, validated Taylor steps, and open gaps: the compiled part.

Every operation adds to the radius a bound of its rounding, so that a ball holds for all numbers of
its operands. Doubles are those of IEEE, rounded to nearest; fused multiply-adds are allowed, and no
reassociation. The C library's functions are taken to be right within 3 units in the last place.

A validated step of y'' = A(t, y, y') starts from a ball of states at a ball of times and has a
ball of lengths h.
With the Taylor coefficients C_k of the ball, and the coefficient D of order n + 1 over a box B, the
solution exists on [0, h] and stays in B if

    sum_{k <= n} C_k [0, h]^k + D(B) [0, h]^{n+1}   lies in the interior of   B,

and likewise for y' (the high-order enclosure of Corliss and Rihm 1996, Nedialkov, Jackson and Pryce
2001).
At the first exit from B, Lagrange's form of the remainder would hold up to there and put the
solution into the interior.
Then y(h) lies in sum C_k h^k + D h^{n+1}.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from saltus.taylor import cached_jit, jit


class Op(IntEnum):
    """The operations of a tape, in the order of their numbers."""

    NUMBER = 0
    PARAMETER = 1
    TIME = 2
    SIDE = 3
    COORDINATE = 4
    VELOCITY = 5
    ADD = 6
    SUB = 7
    MUL = 8
    DIV = 9
    POW = 10
    SIN = 11
    COS = 12
    EXP = 13
    LOG = 14
    SQRT = 15
    SINH = 16
    COSH = 17
    TANH = 18
    ATAN = 19
    MAXIMUM = 20
    MINIMUM = 21
    GREATER = 22
    GREATER_EQUAL = 23
    LESS = 24
    LESS_EQUAL = 25
    WHERE = 26


STEPS = "Tuple((boolean[::1],{0},{0},{0},{0}))".format("float64[:,:,::1]")
TAPE = "int64[:,::1],float64[::1],boolean[::1],int64[::1]"
MATRIX = "float64[:,::1]"
VECTOR = "float64[::1]"
BALL_STEPS = (
    f"{STEPS}({TAPE},int64,{MATRIX},{MATRIX},"
    f"{VECTOR},{VECTOR},{VECTOR},{VECTOR},float64[:,:,::1],float64[:,:,::1])"
)
BALL_VALUES = (
    f"Tuple(({MATRIX},{MATRIX}))({TAPE},{MATRIX},{MATRIX},"
    f"{VECTOR},{VECTOR},{MATRIX},{MATRIX},{MATRIX},{MATRIX})"
)
BALL_GAPS = f"boolean({VECTOR},{VECTOR},float64,float64,float64,float64,float64,int64,int64)"
BALL_SERIES = (
    f"Tuple(({MATRIX},{MATRIX}))({TAPE},int64,{VECTOR},{VECTOR},float64,float64,{MATRIX},{MATRIX})"
)

# --- compiled from here on ---------------------------------------------------

EPS = 2.3e-16  # as in balls.py
UP = 1.0 + 1e-14
TINY = 1e-290
MOST_TRIES = 12  # to find a box that the polynomial and the remainder stay in
INFLATED = 1.02  # of the box over the hull of the polynomial
MOST_PIECES = 20000  # of a step, on which a gap is bounded
DEPTH = 60  # of these bisections


@jit
def convolution(m, r, a, b, k, low, high, weighted):
    """The ball of sum_{j=low}^{high} (j) a_j b_{k-j}."""
    total = 0.0
    spread = 0.0
    size = 0.0
    for j in range(low, high + 1):
        weight = float(j) if weighted else 1.0
        x = weight * m[a, j]
        y = m[b, k - j]
        total += x * y
        size += abs(x) * abs(y)
        spread += abs(x) * r[b, k - j] + weight * r[a, j] * (abs(y) + r[b, k - j])
    return total, (spread + (high - low + 5) * EPS * size) * UP + TINY


@jit
def quotient(x, rx, y, ry):
    """The ball of x / y; NaN where y may be 0."""
    if not abs(y) > ry:
        return np.nan, np.nan
    value = x / y
    return value, ((rx + abs(value) * ry) / (abs(y) - ry) + 2.0 * EPS * abs(value)) * UP + TINY


@jit
def hull(low, high):
    """The ball of an interval."""
    middle = 0.5 * (low + high)
    if low == high:
        return middle, 0.0
    return middle, (0.5 * (high - low) + 2.0 * EPS * (abs(low) + abs(high))) * UP


@jit
def elementary(op, x, rx):
    """The ball of a function of a ball."""
    if not rx < np.inf:
        return np.nan, np.nan
    if op == Op.SIN or op == Op.COS:
        sine = math.sin(x)
        cosine = math.cos(x)
        value = sine if op == Op.SIN else cosine
        slope = cosine if op == Op.SIN else sine
        return value, min(rx, abs(slope) * rx + 0.5 * rx * rx + 4 * EPS * rx) * UP + 4 * EPS
    if op == Op.EXP:
        value = math.exp(x)
        return value, (value * math.expm1(rx) * (1.0 + 4 * EPS) + 4 * EPS * value) * UP + TINY
    if op == Op.LOG:
        if not x > rx:
            return np.nan, np.nan
        value = math.log(x)
        return value, (-math.log1p(-rx / x) * (1.0 + 8 * EPS) + 4 * EPS * (abs(value) + EPS)) * UP
    if op == Op.SQRT:
        if not x > rx:
            return np.nan, np.nan
        value = math.sqrt(x)
        return value, (rx / (value + math.sqrt(x - rx)) + 2.0 * EPS * value) * UP
    if op == Op.SINH or op == Op.COSH:
        value = math.sinh(x) if op == Op.SINH else math.cosh(x)
        return value, (math.cosh(abs(x) + rx) * (rx + 6 * EPS)) * UP
    value = math.tanh(x) if op == Op.TANH else math.atan(x)
    return value, (rx + 4 * EPS) * UP


@jit
def power_ball(x, rx, p, rp):
    """The ball of x^p, which is monotone in both: its extremes lie at corners; NaN where x may be
    0 or negative."""
    if not x > rx:
        return np.nan, np.nan
    low = np.inf
    high = -np.inf
    exponent_radius = rp * UP + 2.0 * EPS * abs(p) if rp > 0.0 else 0.0
    for i in range(2):
        base = (x - rx) * (1.0 - 2.0 * EPS) if i == 0 else (x + rx) * (1.0 + 2.0 * EPS)
        for j in range(2):
            value = math.pow(base, p - exponent_radius if j == 0 else p + exponent_radius)
            low = min(low, value)
            high = max(high, value)
    middle, radius = hull(low, high)
    return middle, (radius + 8 * EPS * (1.0 + abs(p) + rp) * high) * UP


@jit
def compared(op, x, rx, y, ry):
    """1 or 0 with radius 0; NaN where the balls do not decide."""
    least = x - y
    spread = (rx + ry + EPS * abs(least)) * UP
    if rx == 0.0 and ry == 0.0 and x == y:
        return (1.0 if op == Op.GREATER_EQUAL or op == Op.LESS_EQUAL else 0.0), 0.0
    if op == Op.LESS or op == Op.LESS_EQUAL:
        least = -least
    if least > spread:
        return 1.0, 0.0
    if least < -spread:
        return 0.0, 0.0
    return np.nan, np.nan


@jit
def chosen(m, r, condition, yes, no, k):
    """The ball of `where`; NaN where its condition is not decided."""
    if m[condition, 0] == 1.0:
        return m[yes, k], r[yes, k]
    if m[condition, 0] == 0.0:
        return m[no, k], r[no, k]
    return np.nan, np.nan


@jit
def of_order_zero(op, m, r, p, q, s):
    """The ball of a node at order 0 that is no leaf."""
    if op == Op.ADD or op == Op.SUB:
        x = m[p, 0] + m[q, 0] if op == Op.ADD else m[p, 0] - m[q, 0]
        return x, (r[p, 0] + r[q, 0] + EPS * abs(x)) * UP
    if op == Op.MUL:
        if p == q:
            x = m[p, 0] * m[p, 0]
            return x, ((2.0 * abs(m[p, 0]) + r[p, 0]) * r[p, 0] + 2.0 * EPS * x) * UP + TINY
        return convolution(m, r, p, q, 0, 0, 0, False)
    if op == Op.DIV:
        return quotient(m[p, 0], r[p, 0], m[q, 0], r[q, 0])
    if op == Op.POW:
        return power_ball(m[p, 0], r[p, 0], m[q, 0], r[q, 0])
    if op == Op.MAXIMUM or op == Op.MINIMUM:
        low = m[p, 0] - r[p, 0] - EPS * abs(m[p, 0])
        high = m[p, 0] + r[p, 0] + EPS * abs(m[p, 0])
        other_low = m[q, 0] - r[q, 0] - EPS * abs(m[q, 0])
        other_high = m[q, 0] + r[q, 0] + EPS * abs(m[q, 0])
        if op == Op.MAXIMUM:
            return hull(max(low, other_low), max(high, other_high))
        return hull(min(low, other_low), min(high, other_high))
    if op == Op.WHERE:
        return chosen(m, r, s, p, q, 0)
    if op >= Op.GREATER:
        return compared(op, m[p, 0], r[p, 0], m[q, 0], r[q, 0])
    return elementary(op, m[p, 0], r[p, 0])


@jit
def of_higher_order(op, m, r, i, p, q, s, k, constant):
    """The ball of a node's coefficient of order k > 0 that is no leaf."""
    if op == Op.ADD or op == Op.SUB:
        x = m[p, k] + m[q, k] if op == Op.ADD else m[p, k] - m[q, k]
        return x, (r[p, k] + r[q, k] + EPS * abs(x)) * UP
    if op == Op.MUL:
        low = k if constant[q] else 0
        high = 0 if constant[p] else k
        return convolution(m, r, p, q, k, low, high, False)
    if op == Op.DIV:
        x = m[p, k]
        rx = r[p, k]
        if not constant[q]:
            total, spread = convolution(m, r, q, i, k, 1, k, False)
            x = x - total
            rx = (rx + spread + EPS * abs(x)) * UP
        return quotient(x, rx, m[q, 0], r[q, 0])
    if op == Op.POW:
        # k u_0 y_k = p sum j u_j y_{k-j} - sum_{j<k} u_j (k - j) y_{k-j}
        above, above_spread = convolution(m, r, p, i, k, 1, k, True)
        x = m[q, 0] * above
        rx = (abs(m[q, 0]) * above_spread + r[q, 0] * (abs(above) + above_spread)) * UP
        below, below_spread = convolution(m, r, i, p, k, 1, k - 1, True)
        top = (x - below) / k
        spread = (rx + below_spread) / k + 3.0 * EPS * (abs(x) + abs(below))
        return quotient(top, spread * UP, m[p, 0], r[p, 0])
    if op == Op.SQRT:
        total, spread = convolution(m, r, i, i, k, 1, k - 1, False)
        x = 0.5 * (m[p, k] - total)
        return quotient(x, (0.5 * (r[p, k] + spread) + EPS * abs(x)) * UP, m[i, 0], r[i, 0])
    if op == Op.LOG:
        total, spread = convolution(m, r, i, p, k, 1, k - 1, True)
        x = m[p, k] - total / k
        spread = (r[p, k] + spread / k + 2.0 * EPS * (abs(x) + abs(total))) * UP
        return quotient(x, spread, m[p, 0], r[p, 0])
    if op == Op.WHERE:
        return chosen(m, r, s, p, q, k)
    if op >= Op.MAXIMUM:
        return np.nan, np.nan  # no series: only events may ask for these, at one instant
    # y' = z u', where z is the node itself for exp and else its partner
    total, spread = convolution(m, r, p, i if op == Op.EXP else q, k, 1, k, True)
    x = -total / k if op == Op.COS else total / k
    return x, (spread / k + EPS * abs(x)) * UP


@jit
def series_of(
    nodes, numbers, constant, roots, order, middles, radii, tm, tr, m, r, ym, yr, accelerate
):
    """The coefficients 0..order of all nodes, and those of order 2..order + 2 of the coordinates,
    whose first two are given; the first roots are the accelerations of the coordinates.

    `nodes` has an operation and up to three operands in each row.
    """
    for k in range(order + 1):
        for i in range(len(nodes)):
            op = nodes[i, 0]
            p = nodes[i, 1]
            q = nodes[i, 2]
            x = 0.0
            rx = 0.0
            if constant[i] and k > 0:
                pass
            elif op == Op.NUMBER:
                x = numbers[i]
            elif op == Op.PARAMETER:
                x = middles[p]
                rx = radii[p]
            elif op == Op.TIME:
                if k == 0:
                    x = tm
                    rx = tr
                elif k == 1:
                    x = 1.0
            elif op == Op.SIDE:
                x = np.nan
                rx = np.nan
            elif op == Op.COORDINATE:
                x = ym[p, k]
                rx = yr[p, k]
            elif op == Op.VELOCITY:
                x = (k + 1.0) * ym[p, k + 1]
                rx = ((k + 1.0) * yr[p, k + 1] + EPS * abs(x)) * UP
            elif k == 0:
                x, rx = of_order_zero(op, m, r, p, q, nodes[i, 3])
            else:
                x, rx = of_higher_order(op, m, r, i, p, q, nodes[i, 3], k, constant)
            m[i, k] = x
            r[i, k] = rx
        if accelerate:
            for c in range(ym.shape[0]):
                root = roots[c]
                factor = (k + 1.0) * (k + 2.0)
                ym[c, k + 2] = m[root, k] / factor
                yr[c, k + 2] = (r[root, k] / factor + EPS * abs(ym[c, k + 2])) * UP + TINY


@jit
def horner_ball(cm, cr, first, derivative, hm, hr):
    """The ball of sum_{k >= first} c_k k (k - 1) .. (k - derivative + 1) h^(k - first) over a ball
    h."""
    value = 0.0
    spread = 0.0
    for k in range(len(cm) - 1, first - 1, -1):
        factor = 1.0
        for d in range(derivative):
            factor *= k - d
        scaled = value * hm
        spread = abs(value) * hr + spread * (abs(hm) + hr) + EPS * abs(scaled)
        term = factor * cm[k]
        value = scaled + term
        spread = (spread + factor * cr[k] + EPS * (abs(value) + 2.0 * abs(term))) * UP
    return value, spread + TINY


@jit
def polynomial_hull(ym, yr, n, h, d):
    """The ball of the polynomial of degree n, or of its rate (d = 1), over [0, h]."""
    middle = ym[d]
    spread = yr[d]
    power = 1.0
    for k in range(d + 1, n + 1):
        power *= h
        factor = float(k) if d else 1.0
        middle += 0.5 * factor * ym[k] * power
        own = 0.5 * abs(ym[k]) + yr[k] + 2.0 * n * EPS * abs(ym[k])
        spread += factor * power * own
    return middle, (spread + (n + 2.0) * EPS * (abs(middle) + spread)) * UP


@jit
def remainder_reach(dm, dr, n, h, d):
    """How far the remainder D [0, h]^{n+1}, or its rate (d = 1), reaches."""
    power = h**n * (1.0 + (n + 2.0) * EPS) * UP
    factor = (n + 1.0) * power if d else power * h
    return factor * (abs(dm) + dr) * UP


@jit
def one_step(nodes, numbers, constant, roots, n, middles, radii, tm, tr, hm, hr, cm, cr, work):
    """One validated step; `cm`, `cr` have the state and get the coefficients, that of the
    remainder last.
    """
    m, r, dm, dr, bm, br, nr = work
    ny = cm.shape[0]
    series_of(nodes, numbers, constant, roots, n - 2, middles, radii, tm, tr, m, r, cm, cr, True)
    h = (hm + hr) * UP
    for c in range(ny):
        for d in range(2):
            bm[c, d], nr[c, d] = polynomial_hull(cm[c], cr[c], n, h, d)
            br[c, d] = INFLATED * nr[c, d] + 1e-10 * (abs(bm[c, d]) + nr[c, d]) + TINY
    middle_time = tm + 0.5 * h
    time_spread = (tr + 0.5 * h + EPS * abs(middle_time)) * UP
    stays = False
    for _ in range(MOST_TRIES):
        for c in range(ny):
            for d in range(2):
                dm[c, d] = bm[c, d]
                dr[c, d] = br[c, d]
        series_of(
            nodes,
            numbers,
            constant,
            roots,
            n - 1,
            middles,
            radii,
            middle_time,
            time_spread,
            m,
            r,
            dm,
            dr,
            True,
        )
        if stays:
            break  # the remainder over the smaller box, in which the solution is known to stay
        inside = True
        for c in range(ny):
            for d in range(2):
                reach = (nr[c, d] + remainder_reach(dm[c, n + 1], dr[c, n + 1], n, h, d)) * UP
                if not reach < br[c, d]:
                    inside = False
                    br[c, d] = 1.5 * reach + 1e-10 * abs(bm[c, d])
        stays = inside
        if inside:
            for c in range(ny):
                for d in range(2):
                    reach = remainder_reach(dm[c, n + 1], dr[c, n + 1], n, h, d)
                    br[c, d] = (nr[c, d] + reach) * UP
    for c in range(ny):
        cm[c, n + 1] = dm[c, n + 1]
        cr[c, n + 1] = dr[c, n + 1]
    return stays


@cached_jit(BALL_STEPS)
def ball_steps(
    nodes,
    numbers,
    constant,
    roots,
    n,
    middles,
    radii,
    times,
    time_radii,
    lengths,
    length_radii,
    y0m,
    y0r,
):
    """Validated steps from states (steps, coordinates, 2).

    Returns whether each is proved; the coefficients, that of the remainder last, (steps,
    coordinates, n + 2); values, velocities and accelerations at the end, (steps, coordinates, 3).
    """
    count = y0m.shape[0]
    ny = y0m.shape[1]
    proved = np.zeros(count, dtype=np.bool_)
    cm = np.zeros((count, ny, n + 2))
    cr = np.zeros((count, ny, n + 2))
    em = np.full((count, ny, 3), np.nan)
    er = np.full((count, ny, 3), np.nan)
    m = np.zeros((len(nodes), n + 2))
    r = np.zeros((len(nodes), n + 2))
    dm = np.zeros((ny, n + 2))
    dr = np.zeros((ny, n + 2))
    work = (m, r, dm, dr, np.zeros((ny, 2)), np.zeros((ny, 2)), np.zeros((ny, 2)))
    for i in range(count):
        for c in range(ny):
            for d in range(2):
                cm[i, c, d] = y0m[i, c, d]
                cr[i, c, d] = y0r[i, c, d]
        proved[i] = one_step(
            nodes,
            numbers,
            constant,
            roots,
            n,
            middles[i],
            radii[i],
            times[i],
            time_radii[i],
            lengths[i],
            length_radii[i],
            cm[i],
            cr[i],
            work,
        )
        for c in range(ny):
            for d in range(3):
                value, spread = horner_ball(cm[i, c], cr[i, c], d, d, lengths[i], length_radii[i])
                em[i, c, d] = value
                er[i, c, d] = spread
                if not spread < np.inf:
                    proved[i] = False
    return proved, cm, cr, em, er


@cached_jit(BALL_VALUES)
def ball_values(nodes, numbers, constant, roots, middles, radii, times, time_radii, qm, qr, vm, vr):
    """Balls of expressions at instants, with positions and velocities (instants, coordinates)."""
    count = qm.shape[0]
    dof = qm.shape[1]
    m = np.zeros((len(nodes), 1))
    r = np.zeros((len(nodes), 1))
    ym = np.zeros((dof, 2))
    yr = np.zeros((dof, 2))
    values = np.zeros((count, len(roots)))
    spreads = np.zeros((count, len(roots)))
    for i in range(count):
        for c in range(dof):
            ym[c, 0] = qm[i, c]
            yr[c, 0] = qr[i, c]
            ym[c, 1] = vm[i, c]
            yr[c, 1] = vr[i, c]
        series_of(
            nodes,
            numbers,
            constant,
            roots,
            0,
            middles[i],
            radii[i],
            times[i],
            time_radii[i],
            m,
            r,
            ym,
            yr,
            False,
        )
        for j in range(len(roots)):
            values[i, j] = m[roots[j], 0]
            spreads[i, j] = r[roots[j], 0]
    return values, spreads


@cached_jit(BALL_SERIES)
def ball_series(nodes, numbers, constant, roots, order, middles, radii, tm, tr, y0m, y0r):
    """The Taylor coefficients 0..order of the coordinates from states (coordinates, 2), without a
    remainder.
    """
    ny = y0m.shape[0]
    m = np.zeros((len(nodes), order + 1))
    r = np.zeros((len(nodes), order + 1))
    ym = np.zeros((ny, order + 1))
    yr = np.zeros((ny, order + 1))
    for c in range(ny):
        for d in range(2):
            ym[c, d] = y0m[c, d]
            yr[c, d] = y0r[c, d]
    series_of(
        nodes, numbers, constant, roots, order - 2, middles, radii, tm, tr, m, r, ym, yr, True
    )
    return ym, yr


@jit
def bends(wm, wr, begin, top, derivative):
    """Whether w' < 0 (derivative 1) or w'' > 0 (derivative 2) on [begin, top]."""
    pieces = 8
    for piece in range(pieces):
        low = begin + (top - begin) * piece / pieces
        high = begin + (top - begin) * (piece + 1) / pieces
        half = (0.5 * (high - low) + 4.0 * EPS * high) * UP
        value, spread = horner_ball(wm, wr, derivative, derivative, 0.5 * (low + high), half)
        rises = value - spread > 0.0
        falls = value + spread < 0.0
        if not (falls if derivative == 1 else rises):
            return False
    return True


@cached_jit(BALL_GAPS)
def is_open(cm, cr, sign, contact, contact_radius, hm, hr, start, stop):
    """Whether sign (q - contact) > 0 inside (0, h), for one step with the coefficients c.

    At the start the gap vanishes to the order `start`: 0 at a node, 1 at an impact, 2 at a touch,
    3 at a release; the series is divided by this power of the time.
    At the end it vanishes to the order `stop`, 0, 1 or 2: on [s, h] the speed is negative (1) or
    the acceleration positive (2), and on [0, s] the gap is positive.
    """
    wm = sign * cm
    wr = cr.copy()
    wm[0] -= sign * contact
    wr[0] = (wr[0] + contact_radius + EPS * (abs(wm[0]) + abs(contact))) * UP
    top = (hm + hr) * UP
    end = top
    if stop > 0:
        end = -1.0
        for tries in range(40):
            begin = 0.0 if tries == 0 else top * (1.0 - 0.5**tries)
            if bends(wm, wr, begin, top, stop):
                end = begin
                break
        if end <= 0.0:
            return end == 0.0  # the whole step bends towards the contact
    stack = np.zeros((DEPTH + 4, 2))
    stack[0, 1] = end
    depth = 1
    pieces = 0
    while depth > 0:
        low = stack[depth - 1, 0]
        high = stack[depth - 1, 1]
        middle = 0.5 * (low + high)
        half = (0.5 * (high - low) + 2.0 * EPS * high) * UP
        value, spread = horner_ball(wm, wr, start, 0, middle, half)
        pieces += 1
        if value - spread > 0.0:
            depth -= 1
        elif depth >= DEPTH or pieces > MOST_PIECES:
            return False
        else:
            stack[depth - 1, 0] = middle
            stack[depth - 1, 1] = high
            stack[depth, 0] = low
            stack[depth, 1] = middle
            depth += 1
    return True
