"""The first root of a polynomial on (0, 1]: none is missed, none is invented, and a simple one is
exact to rounding.
"""

import math

import mpmath
import numba
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from saltus.flow.kernel import roots
from saltus.flow.kernel.layout import ZERO
from saltus.flow.kernel.roots import NEVER, NONE, SIMPLE
from saltus.taylor import compiled_part
from saltus.taylor.private_numba import OPTIONS

_kernel = {"np": np, "ZERO": ZERO} | dict.fromkeys(("jit", "lean_jit"), numba.njit(**OPTIONS))
exec(compiled_part(roots), _kernel)
leading = _kernel["leading"]
excluded, first_root, horner, value_and_slope, newton, roots_within, to_bernstein, variations = (
    _kernel[name]
    for name in (
        "excluded",
        "first_root",
        "horner",
        "value_and_slope",
        "newton",
        "roots_within",
        "to_bernstein",
        "variations",
    )
)
EPS = 2.0**-52
DEGREES = st.integers(2, 23)


@pytest.mark.parametrize("degree", [1, 2, 3, 8, 15, 22])
def test_a_polynomial_and_its_slope_are_those_of_numpy(degree):
    p = np.polynomial.Polynomial(np.random.default_rng(degree).normal(size=degree + 1))
    for x in (0.0, 0.3, 1.0, -0.7):
        assert horner(p.coef, degree, x) == pytest.approx(p(x), abs=1e-14)
        assert value_and_slope(p.coef, degree, x) == (
            horner(p.coef, degree, x),
            pytest.approx(p.deriv()(x), abs=1e-13),
        )


def solve(coefficients):
    """`first_root` of a polynomial given by ascending coefficients: (kind, root, touch)."""
    p = np.array(coefficients, dtype=float)
    return first_root(p, p.size - 1)


def size(p):
    return np.abs(p).sum()


def expand(roots, pairs, constant):
    """The ascending coefficients of prod (r - u) prod ((u - a)^2 + b^2), scaled to the value
    `constant` at 0.
    """
    p = np.array([1.0])
    for r in roots:
        p = np.convolve(p, [r, -1.0])
    for a, b in pairs:
        p = np.convolve(p, [a * a + b * b, -2 * a, 1.0])
    return p * (constant / p[0])


def assert_first(p, kind, root, touch):
    """The answer is right to within the rounding of p: up to the root p is not negative, at the
    root it is zero.
    """
    noise = 60 * EPS * size(p)
    end = root if kind == SIMPLE else 1.0
    slope = np.polynomial.Polynomial(p).deriv()
    extrema = np.array([z.real for z in slope.roots() if abs(z.imag) < 1e-6])
    inside = np.concatenate([np.linspace(0, end, 400), extrema[(extrema > 0) & (extrema < end)]])
    assert np.polynomial.polynomial.polyval(inside, p).min() >= -noise, "a crossing was missed"
    if kind == SIMPLE:
        assert 0.0 <= root <= 1.0
        assert abs(horner(p, p.size - 1, root)) <= noise
        assert horner(p, p.size - 1, min(root + 1e-7, 1.0)) <= noise
    if touch <= 1.0:
        assert touch <= end
        assert abs(horner(p, p.size - 1, touch)) <= noise + size(p) * p.size**2 * 2.0**-52
    else:
        assert touch == NEVER


@st.composite
def polynomials(draw):
    """Any mixture of roots inside (single, close together, repeated) and outside, real and complex,
    of degree 2 to 23.
    """
    degree = draw(DEGREES)
    inside = st.floats(0.01, 1.0)
    roots = draw(
        st.lists(
            st.one_of(inside, inside, st.sampled_from([0.25, 0.5, 0.75, 1.0])),
            max_size=min(degree, 5),
        )
    )
    for r in list(roots):
        if len(roots) < degree and draw(st.booleans()):  # a cluster, or a repeated root
            roots.append(min(1.0, r + draw(st.sampled_from([0.0, 1e-9, 1e-7, 1e-5, 1e-3]))))
    pairs = []
    while degree - len(roots) - 2 * len(pairs) >= 2 and draw(st.booleans()):
        pairs.append(
            (draw(st.floats(-0.5, 1.5)), draw(st.sampled_from([1e-8, 1e-6, 1e-3, 0.1, 1.0])))
        )
    while len(roots) + 2 * len(pairs) < degree:
        roots.append(draw(st.one_of(st.floats(-20.0, -0.5), st.floats(1.1, 20.0))))
    return expand(roots, pairs, 10.0 ** draw(st.integers(-12, 3)))


@pytest.mark.thorough
@given(polynomials())
@settings(max_examples=200, deadline=None)
def test_no_crossing_is_missed_and_none_invented(p):
    if not np.isfinite(p).all() or p[0] <= 0:
        return
    assert_first(p, *first_root(p, p.size - 1))


@given(
    st.lists(st.floats(0.05, 0.99), min_size=1, max_size=4, unique=True),
    st.lists(st.one_of(st.floats(-9.0, -0.5), st.floats(1.5, 9.0)), min_size=1, max_size=12),
)
@settings(max_examples=12, deadline=None)
def test_first_simple_root_agrees_with_forty_digits(inside, outside):
    inside = sorted(inside)
    if min(np.diff([0.0, *inside])) < 0.02:
        return
    p = expand([*inside, *outside], [], 1.0)
    exact = [z for z in polyroots(p) if abs(z.imag) < 1e-25 and 0 < z.real <= 1]
    expected = min(z.real for z in exact)
    kind, root, touch = solve(p)
    assert (kind, touch) == (SIMPLE, NEVER)
    slope = abs(sum(k * p[k] * float(expected) ** (k - 1) for k in range(1, p.size)))
    assert abs(root - expected) <= 2 * EPS * p.size * size(p) / slope + EPS


def polyroots(p):
    with mpmath.workdps(40):
        return mpmath.polyroots([mpmath.mpf(x) for x in p[::-1]], maxsteps=200, extraprec=100)


@given(st.integers(1, 15), st.integers(1, 15), st.integers(0, 6))
@example(8, 4, 0)
@settings(max_examples=60, deadline=None)
def test_roots_where_boxes_meet_are_found_exactly(first, second, bend):
    # (i/16 - u)(j/16 - u)(1 + u)^bend has coefficients without rounding, and its roots lie on the
    # boxes' borders.
    p = np.array([1.0])
    for factor in ([first / 16, -1.0], [second / 16, -1.0], *[[1.0, 1.0]] * bend):
        p = np.convolve(p, factor)
    kind, root, touch = solve(p)
    if first == second:  # a graze; the rounding of Bernstein coefficients may still push it through
        assert (kind == NONE) == (touch != NEVER)
        assert min(root, touch) == pytest.approx(first / 16, abs=2e-7)
    else:
        assert (kind, root, touch) == (
            SIMPLE,
            pytest.approx(min(first, second) / 16, abs=4 * EPS),
            NEVER,
        )


def test_touch_at_the_border_of_a_box_does_not_hide_the_crossing_before_it():
    # Rounding decides the sign at the touches 1/4 and 1/2, where a search for the root 15/128 must
    # not begin.
    kind, root, touch = solve(expand([15 / 128, 0.25, 0.25, 0.5, 0.5], [], 0.1))
    assert (kind, touch) == (SIMPLE, NEVER)
    assert root == pytest.approx(15 / 128, abs=1e-12)


def test_root_at_the_end_is_found_there_or_left_to_the_next_step():
    for q in ([1.0, -1.0], [1.0, 0.0, -1.0], [2.0, -1.0, -1.0]):
        kind, root, touch = solve([*q, 0.0] if len(q) == 2 else q)
        assert touch == NEVER
        assert kind == NONE or root == 1.0
    kind, root, _ = solve([1.0, -(1.0 + 2 * EPS), 0.0])  # just inside: it must be found
    assert kind == SIMPLE
    assert root == pytest.approx(1.0, abs=4 * EPS)
    assert solve([1.0, -(1.0 - 2 * EPS), 0.0])[0] == NONE  # just outside


@pytest.mark.parametrize("place", [0.5, 0.25, 0.3, 2 / 3, 0.9999, 1e-3])
@pytest.mark.parametrize("degree", [2, 7, 23])
def test_double_root_is_a_touch_and_the_crossing_after_it_is_found(place, degree):
    outside = [-2.0] * (degree - 2)
    kind, root, touch = solve(expand([place, place, *outside], [], 1.0))
    # rounding of p may push it through
    assert (kind, root) == (NONE, NEVER) or abs(root - place) < 1e-6
    if kind == NONE and touch != NEVER:
        assert touch == pytest.approx(place, abs=1e-6)
    if place < 0.9 and degree > 2:
        p = expand([place, place, 0.95, *outside[1:]], [], 1.0)
        kind, root, touch = solve(p)
        assert kind == SIMPLE
        assert min(abs(root - 0.95), abs(root - place)) < 1e-6
        if touch != NEVER:
            assert touch == pytest.approx(place, abs=1e-6)


def test_exact_double_root_is_a_touch_or_a_crossing_there_and_nowhere_else():
    # (2^j u - i)^2 (2 + u)^n has exact coefficients. With n = 0 the Bernstein coefficients are
    # exact too, and it is a touch.
    for i, j in ((1, 1), (1, 2), (3, 2), (5, 3), (11, 4)):
        for n in range(5):
            p = np.array([i * i, -2.0 * i * 2**j, 4.0**j])
            for _ in range(n):
                p = np.convolve(p, [2.0, 1.0])
            kind, root, touch = solve(p)
            assert kind == NONE or n > 0
            assert (kind == NONE) == (touch != NEVER)
            assert min(root, touch) == pytest.approx(i / 2**j, abs=2e-7)
            kind, root, touch = solve(np.convolve(p, [15 / 16, -1.0]))  # and a crossing after it
            assert kind == SIMPLE
            assert root == pytest.approx(15 / 16, abs=1e-12) or root == pytest.approx(
                i / 2**j, abs=2e-7
            )
            assert touch == NEVER or touch == pytest.approx(i / 2**j, abs=2e-7)


@pytest.mark.parametrize("place", [0.5, 0.25, 0.3, 0.7])
@pytest.mark.parametrize("multiplicity", [3, 5])
def test_odd_multiple_root_is_a_crossing(place, multiplicity):
    kind, root, _ = solve(expand([place] * multiplicity + [-3.0, 2.0], [], 1.0))
    assert kind == SIMPLE
    assert root == pytest.approx(place, abs=(200 * EPS) ** (1 / multiplicity))


def test_leftmost_of_a_close_pair_is_found():
    for gap in (1e-2, 1e-4, 1e-6, 2e-7):
        p = np.array([0.5 * (0.5 + gap), -(1.0 + gap), 1.0])
        kind, root, touch = solve(p)
        assert (kind, touch) == (SIMPLE, NEVER)
        exact = (-p[1] - math.sqrt(math.fsum([p[1] ** 2, -4 * p[0]]))) / 2
        assert root == pytest.approx(exact, abs=8 * EPS / gap)


def test_minimum_above_rounding_is_neither_a_root_nor_a_touch():
    for minimum in (1e-3, 1e-6, 1e-9, 1e-12, 1e-13):
        for n in range(4):
            p = np.array([0.25 + minimum, -1.0, 1.0])
            for _ in range(n):
                p = np.convolve(p, [1.0, 0.5])
            assert solve(p) == (NONE, NEVER, NEVER)


def test_minimum_within_rounding_is_never_a_crossing():
    for minimum in (1e-15, 3e-16, 2.0**-52, 0.0):
        kind, _, touch = solve([0.25 + minimum, -1.0, 1.0])
        assert kind == NONE
        assert touch == NEVER or touch == pytest.approx(0.5, abs=1e-7)


@pytest.mark.parametrize("lead", [1e-300, 1e-100, 1e-30, 1e-17, 1e-9])
def test_tiny_leading_values(lead):
    kind, root, touch = solve([lead, -1.0, 0.3, 0.1])
    assert (kind, touch) == (SIMPLE, NEVER)
    assert root == pytest.approx(lead, rel=1e-8 if lead > 1e-10 else 1e-15)
    # starts near zero, rises, does not come back
    assert solve([lead, 1.0, -0.5, -0.2]) == (NONE, NEVER, NEVER)
    kind, root, _ = solve([lead, 1.0, -2.0, 0.0])  # rises from a tiny value and returns at 1/2
    assert kind == SIMPLE
    assert root == pytest.approx(0.5, rel=1e-8 if lead > 1e-10 else 4 * EPS)
    kind, root, _ = solve([lead, 0.0, -1.0, 0.0])
    assert kind == SIMPLE
    assert root == pytest.approx(math.sqrt(lead), rel=1e-13)


def test_scale_does_not_matter():
    p = expand([0.3, 0.8, -2.0, 5.0], [(0.5, 0.2)], 1.0)
    roots = {solve(p * 2.0**k)[1] for k in (-900, -300, 0, 300, 900)}
    assert roots == {solve(p)[1]}


def test_exclusion_only_when_certain():
    rng = np.random.default_rng(1)
    kept = 0
    for _ in range(2000):
        p = rng.normal(size=rng.integers(3, 24))
        p = np.concatenate(
            [[abs(p[0]) + rng.exponential(0.5)], p[1:] * 0.5 ** np.arange(1, p.size)]
        )
        if excluded(p, p.size - 1):
            kept += 1
            assert np.polynomial.polynomial.polyval(np.linspace(0, 1, 200), p).min() > 0
    assert kept > 200


def test_bernstein_coefficients_give_the_polynomial():
    rng = np.random.default_rng(2)
    for n in (2, 5, 14, 23):
        p = rng.normal(size=n + 1)
        b = np.empty(n + 1)
        to_bernstein(p, n, b)
        for u in (0.0, 0.2, 0.5, 1.0):
            sum_ = sum(math.comb(n, i) * u**i * (1 - u) ** (n - i) * b[i] for i in range(n + 1))
            assert sum_ == pytest.approx(np.polynomial.polynomial.polyval(u, p), abs=1e-12)


def test_variations_bound_the_roots_of_random_polynomials():
    rng = np.random.default_rng(3)
    for _ in range(200):
        n = int(rng.integers(2, 12))
        p = rng.normal(size=n + 1)
        b = np.empty(n + 1)
        to_bernstein(p, n, b)
        roots = [z for z in np.roots(p[::-1]) if abs(z.imag) < 1e-9 and 0 < z.real < 1]
        assert variations(b, n) >= len(roots)
        assert (variations(b, n) - len(roots)) % 2 == 0


def test_newton_is_exact_to_rounding_and_stays_in_its_bracket():
    rng = np.random.default_rng(4)
    for _ in range(200):
        root = rng.uniform(0.05, 0.95)
        p = expand(
            [
                root,
                *rng.uniform(1.5, 4.0, rng.integers(0, 12)),
                *rng.uniform(-4, -1, rng.integers(1, 9)),
            ],
            [],
            1.0,
        )
        found = newton(p, p.size - 1, 0.0, 1.0)
        slope = abs(np.polynomial.Polynomial(p).deriv()(root))
        assert abs(found - root) <= 4 * EPS * p.size * size(p) / slope
        assert abs(horner(p, p.size - 1, found)) <= 4 * EPS * p.size * size(p)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_root_beside_one_at_the_start_is_found_beside_it(sign):
    """As of the speed of a gap whose contact has just been released: 0 with its slope, up to
    rounding of the slope.
    """
    p, found = sign * np.array([0.0, -1e-12, 1.0, 0.5]), np.zeros(4)
    assert roots_within(p, 3, found, 1e-18) == 1
    assert found[0] == pytest.approx(1e-12, rel=1e-9)


def first_above_rounding(coefficients, start, zero, size, base):
    """`leading` as it is defined, with all roots."""
    places = np.arange(len(coefficients))
    rate = 0.0
    if size > 0.0:
        later = places[max(start, base) + 1 :]
        rate = max((np.abs(coefficients[later]) / size) ** (1.0 / (later - base)), default=0.0)
    rounding = zero * size * rate ** np.maximum(places - base, 0.0)
    rounding[:base] = 0.0
    above = np.flatnonzero((np.abs(coefficients) > rounding) & (places >= start))
    return int(above[0]) if len(above) else len(coefficients)


@pytest.mark.parametrize("base", [0, 1, 2])
def test_the_leading_coefficient_is_the_first_one_above_the_rounding_of_its_series(base):
    rng = np.random.default_rng(base)
    seen = set()
    for _ in range(3000):
        order = int(rng.integers(4, 23))
        growth = 10.0 ** rng.uniform(-3, 3)
        c = rng.normal(size=order) * growth ** np.arange(order)
        c[rng.random(order) < 0.2] = 0.0
        vanishing = int(rng.integers(0, order))
        c[:vanishing] *= 10.0 ** rng.uniform(-20, -10, vanishing)
        start = base + int(rng.integers(-min(base, 1), 2))
        size = 10.0 ** rng.uniform(-2, 2)
        expected = first_above_rounding(c, start, ZERO, size, base)
        assert leading(c, start, order, ZERO, size, base, 0.0) == expected
        seen.add(expected - start)
    assert {0, 1, 2} <= seen


def long_newton(p, n, low, high):
    """`newton` as it is defined: up to 200 steps, all of them taken."""
    at_low, at_high = horner(p, n, low), horner(p, n, high)
    share = at_low / (at_low - at_high) if at_low > 0.0 > at_high else 0.5
    if not 0.01 < share < 0.99:
        share = 0.5
    u = low + share * (high - low)
    for step in range(200):
        value, slope = value_and_slope(p, n, u)
        low, high = (u, high) if value > 0.0 else (low, u)
        following = u - value / slope if slope != 0.0 else 0.5 * (low + high)
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - u) <= 2.0**-53 * following or high - low <= 2.0**-53 * high:
            return following, step
        u = following
    return u, 200


def test_newton_between_two_neighbouring_numbers_gives_what_all_steps_would():
    rng = np.random.default_rng(11)
    longest = 0
    for _ in range(1500):
        degree = int(rng.integers(2, 20))
        p = rng.normal(size=degree + 1) * 0.5 ** np.arange(degree + 1)
        p[0] = abs(p[0])
        if horner(p, degree, 1.0) >= 0.0:
            continue
        expected, steps = long_newton(p, degree, 0.0, 1.0)
        assert newton(p, degree, 0.0, 1.0) == expected
        longest += steps == 200
    assert longest > 10
