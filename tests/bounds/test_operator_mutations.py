"""Every bound with which a zero, a multiplier or a piece of a curve is judged is needed: with one sign
turned or one bound made smaller, something false is accepted or something plain is refused.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from mutations import mutated, mutations_of

from saltus.bounds import Ball, arcs, krawczyk

OPERATOR = (
    "contraction",
    "Centre.step",
    "Centre.weights",
    "Centre.image",
    "Centre.zero",
    "centre_at",
    "verified_zero",
    "return_map",
    "_of_two",
    "_by_discs",
    "_isolated",
)
CURVE = ("Tube.hull", "Tube.at", "Tube.holds", "_Image.__init__", "drift_of", "turn_of")
TINY = Fraction(1e-14)  # what roundings of doubles may add
WIDER = 1.3  # the most that a bound may exceed the least one
# Sites whose change no exact result can show, each with the reason.
COVERED = "the products before it are rounded upward by UP, which is more than this rounding"
MARGIN = "a margin of rounding: multipliers so near to 1, or to each other, are no doubles"
CONJUGATE = "the conjugates of all eigenvalues have the same moduli and distances"
EQUIVALENT = {
    "contraction: no rounding: inverse: np.ndarray, residual: Ball, jacobian: Ball, radius: np.ndarray": (
        COVERED
    ),
    "contraction: sign turned: 1.0 + (len(radius) + 4) * EPS": COVERED,
    "contraction: sign turned: len(radius) + 4": COVERED,
    "_of_two: no rounding: matrix: Ball": COVERED,
    "_of_two: sign turned: 1.0 + EPS": MARGIN,
    "_by_discs: no rounding: matrix: Ball": COVERED,
    "_by_discs: sign turned: np.diagonal(re.middle) + 1j * np.diagonal(im.middle)": CONJUGATE,
    "_by_discs: sign turned: 1.0 + size * EPS": COVERED,
    "_by_discs: sign turned: discs + 4.0 * EPS * np.diagonal(off)": MARGIN,
    "_by_discs: sign turned: discs[i] + EPS * sizes[i]": COVERED,
    "_by_discs: sign turned: 1.0 - EPS": MARGIN,
    "_by_discs: sign turned: 1.0 + EPS": MARGIN,
    "_isolated: no rounding: centre: np.ndarray, discs: np.ndarray, index: int": MARGIN,
    "_isolated: sign turned: 1.0 - 4.0 * EPS": MARGIN,
    "Tube.holds: no rounding: self, zero: Ball": "`inside` rounds upward by more",
    "_Image.__init__: no rounding: self, centre: Centre, tube: Tube": COVERED,
    "turn_of: no rounding: defect: np.ndarray, drift: np.ndarray, tangent: np.ndarray, scales: np.ndarray": (
        COVERED
    ),
    "turn_of: sign turned: 1.0 + 1e-12": COVERED,
}


def exact(values: np.ndarray) -> list:
    return [exact(v) if np.ndim(v) else Fraction(float(v)) for v in values]


def contraction_holds(module: SimpleNamespace) -> bool:
    """|A F| + |I - A J| r for all F and J of their balls, in fractions."""
    rng = np.random.default_rng(11)
    for _ in range(12):
        inverse = rng.normal(size=(3, 3))
        residual = Ball(rng.normal(size=3) * 1e-3, np.abs(rng.normal(size=3)) * 1e-3)
        jacobian = Ball(
            np.linalg.inv(inverse) + 1e-2 * rng.normal(size=(3, 3)),
            np.abs(rng.normal(size=(3, 3))) * 1e-2,
        )
        radius = np.abs(rng.normal(size=3))
        found = module.contraction(inverse, residual, jacobian, radius)
        a, fm, fr, r = map(exact, (inverse, residual.middle, residual.radius, radius))
        jm, jr = exact(jacobian.middle), exact(jacobian.radius)
        for i in range(3):
            least = abs(sum(a[i][k] * fm[k] for k in range(3)))
            least += sum(abs(a[i][k]) * fr[k] for k in range(3))
            for j in range(3):
                middle = abs(int(i == j) - sum(a[i][k] * jm[k][j] for k in range(3)))
                spread = sum(abs(a[i][k]) * jr[k][j] for k in range(3))
                least += (middle + spread) * r[j]
            if not least <= Fraction(float(found[i])) <= least * Fraction(WIDER):
                return False
    return True


def corners_of(matrix: Ball) -> list[np.ndarray]:
    """The matrices at the corners of a ball, and its middle."""
    size = matrix.middle.size
    signs = [np.reshape(s, matrix.middle.shape) for s in product((-1.0, 1.0), repeat=size)]
    return [matrix.middle, *(matrix.middle + sign * matrix.radius for sign in signs)]


def moduli_of(matrix: np.ndarray) -> np.ndarray:
    return np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1]


def turned(values: list[float], complex_pair: bool, rng: np.random.Generator) -> np.ndarray:
    """A matrix with these eigenvalues, or with a complex pair of the first two parts."""
    size = len(values)
    basis = rng.normal(size=(size, size)) + 2.0 * np.eye(size)
    inner = np.diag(values)
    if complex_pair:
        inner[:2, :2] = [[values[0], values[1]], [-values[1], values[0]]]
    return basis @ inner @ np.linalg.inv(basis)


CASES = [
    ([0.5, -0.3], False),
    ([1.4, 0.2], False),
    ([-1.4, 0.2], False),
    ([0.97, 0.1], False),
    ([-0.97, 0.1], False),
    ([1.03, 0.1], False),
    ([-1.03, 0.1], False),
    ([0.6, 0.75], True),
    ([0.6, 0.85], True),
    ([0.1, 0.2], True),
    ([1.1, -1.2], False),
]


def multipliers_hold(module: SimpleNamespace) -> bool:
    """The verdict and the moduli of matrices of balls, against the corners of the balls."""
    rng = np.random.default_rng(12)
    for (values, pair), radius in product(CASES, (1e-12, 1e-4, 0.02)):
        for judge, more in (
            (module._of_two, []),
            (module._by_discs, []),
            (module._by_discs, [0.3]),
        ):
            size = len(values) + len(more)
            middle = turned(values + more, pair, rng)
            spread = radius * np.abs(rng.normal(size=(size, size)))
            matrix = Ball(middle, spread)
            found = judge(matrix)
            corners = [moduli_of(corner) for corner in corners_of(matrix)]
            largest = [moduli[0] for moduli in corners]
            if found.stable is True and not max(largest) < 1.0:
                return False
            if found.stable is False and not min(largest) > 1.0:
                return False
            if radius == 1e-12 and found.stable is not bool(max(largest) < 1.0):
                return False
            if radius < 1e-3 and not pair and len(found.moduli) != size:
                return False
            for (centre, reach), *sizes in zip(found.moduli, *corners, strict=False):
                rounding = 1e-13 * (1.0 + centre)
                if max(abs(centre - m) for m in sizes) > reach + rounding:
                    return False
            most = 40.0 * np.linalg.cond(middle) ** 2 * (radius + 1e-13) * size
            if any(reach > most for _, reach in found.moduli):
                return False
    return diagonals_hold(module)


def diagonals_hold(module: SimpleNamespace) -> bool:
    """Of a diagonal matrix the discs are the balls themselves; two of them meet or not."""
    radius = np.array([0.02, 0.03, 0.01])
    found = module._by_discs(Ball(np.diag([0.7, 0.4, -0.2]), np.diag(radius)))
    if len(found.moduli) != 3:
        return False
    if not all(reach >= r for (_, reach), r in zip(found.moduli, radius, strict=True)):
        return False
    centre = np.array([0.0, 1.0 + 0.0j])
    return bool(
        module._isolated(centre, np.array([0.45, 0.45]), 0)
        and not module._isolated(centre, np.array([0.55, 0.55]), 0)
    )


def operator_holds(module: SimpleNamespace) -> bool:
    return (
        contraction_holds(module)
        and zeros_hold(module)
        and return_maps_hold(module)
        and multipliers_hold(module)
    )


class Roots:
    """The equations x^2 = 2, y = x in balls, as shooting equations are asked."""

    size = 2
    scales = np.array([1.0, 4.0])
    row_scales = np.array([2.0, 0.5])

    def __init__(self, largest: float = 10.0) -> None:
        self.largest = largest

    def enclose(self, box: Ball) -> SimpleNamespace:
        return SimpleNamespace(proved=bool(box.magnitude.max() < self.largest), box=box)

    def system_rows(self, enclosure: SimpleNamespace, box: Ball) -> tuple[Ball, Ball]:
        x, y = box[0], box[1]
        first, second = x * x - 2.0, y - x
        slope = x * 2.0
        residual = Ball([first.middle, second.middle], [first.radius, second.radius])
        matrix = Ball(
            [[slope.middle, 0.0], [-1.0, 1.0]],
            [[slope.radius, 0.0], [0.0, 0.0]],
        )
        return residual, matrix

    def nearly_inverse(self, matrix: np.ndarray) -> np.ndarray:
        return np.linalg.inv(matrix)


def zeros_hold(module: SimpleNamespace) -> bool:
    """The root of 2 is verified in boxes that contain it alone, and in no others; the operator's image
    of a box of radius r about it has the radius r^2 / sqrt(2), as the slope changes by so much.
    """
    root = np.full(2, np.sqrt(2.0))
    narrow = np.full(2, 1e-9)
    for middle, radius, unique, largest, true in (
        (root, narrow, np.full(2, 0.3), 10.0, True),
        (root, narrow, np.full(2, 1.2), 10.0, True),
        (root, narrow, np.full(2, 1.5), 10.0, False),  # beyond 0 the slope vanishes
        (root, narrow, narrow / 2, 10.0, False),
        (root + 1e-6, narrow, np.full(2, 0.3), 10.0, False),
        (root - 1e-6, narrow, np.full(2, 0.3), 10.0, False),
        (root, narrow, np.full(2, 0.3), 1.6, False),  # a step has no enclosure over the wide box
        (root, narrow[:1], np.full(2, 0.3), 10.0, False),
    ):
        zero = module.verified_zero(Roots(largest), middle, radius, unique)
        if isinstance(zero, module.NotProved) is true:
            return False
        if true and not (zero.radius is radius and zero.unique is unique):
            return False
    centre = module.centre_at(Roots(), root)
    reach = centre.image(np.full(2, 0.3))[0][0]
    least = 0.09 / np.sqrt(2.0)
    step = module.centre_at(Roots(), root + 1e-3).step[0]
    slope = 1.0 / (2.0 * np.sqrt(2.0))  # of the inverse
    weights = [2.0 * slope, (2.0 * slope + 0.5) / 4.0]
    condition = module.verified_zero(Roots(), root, narrow, narrow).condition
    return bool(
        least <= reach <= WIDER * least
        and 1e-3 - 1e-6 <= step <= WIDER * 1e-3
        and np.allclose(centre.weights, weights)
        and np.isclose(condition, max(weights))
    )


def return_maps_hold(module: SimpleNamespace) -> bool:
    """-(L^-1 B) for all L and B of their balls, first rows, in units of powers of two."""
    rng = np.random.default_rng(14)
    scales = np.array([2.0, 0.5, 8.0])
    rows = np.array([4.0, 1.0, 0.25])
    for radius in (1e-12, 1e-3):
        left = Ball(rng.normal(size=(3, 3)) + 3.0 * np.eye(3), radius * np.ones((3, 3)))
        right = Ball(rng.normal(size=(3, 2)), radius * np.ones((3, 2)))
        equations = SimpleNamespace(scales=scales, row_scales=rows, event_size=2)
        enclosure = SimpleNamespace(
            open_jacobian=SimpleNamespace(middle=left.middle, ball=left),
            start_jacobian=SimpleNamespace(ball=right),
        )
        found = module.return_map(equations, enclosure)
        if not found.radius.max() < 60.0 * (radius + 1e-14):
            return False
        for sign in (-1.0, 0.0, 1.0):
            matrix = left.middle + sign * left.radius
            exact_map = -np.linalg.solve(matrix, right.middle - sign * right.radius)[:2]
            exact_map = exact_map * scales[:2] / scales[:2, None]
            if not (np.abs(found.middle - exact_map) <= found.radius + 1e-13).all():
                return False
    return True


def curve_holds(module: SimpleNamespace) -> bool:
    return tubes_hold(module) and turns_hold(module) and images_hold(module)


def images_hold(module: SimpleNamespace) -> bool:
    """|I - A J|, |A (J t - e)| and the operator's image of a tube, for all J of their ball, in
    fractions; a tube is proved where the image is narrower, and only there.
    """
    rng = np.random.default_rng(13)
    verdicts = set()
    for trial in range(24):
        inverse = rng.normal(size=(3, 3)) + 2.0 * np.eye(3)
        spread = 10.0 ** rng.uniform(-4, -1) * np.abs(rng.normal(size=(3, 3)))
        jacobian = Ball(np.linalg.inv(inverse) + 3e-2 * rng.normal(size=(3, 3)), spread)
        tangent = inverse[:, -1] + 0.1 * (trial % 2) * rng.normal(size=3)
        radius = np.abs(rng.normal(size=3)) + 0.1
        step = 10.0 ** rng.uniform(-4, 0) * np.abs(rng.normal(size=3))
        half = 0.5
        a, t, r, y = map(exact, (inverse, tangent, radius, step))
        jm, jr = exact(jacobian.middle), exact(jacobian.radius)
        defect, drift = module.drift_of(inverse, jacobian, tangent)
        tube = module.Tube(np.zeros(3), tangent, radius, np.array([0.0, 0.0, 1.0]), half)
        centre = SimpleNamespace(
            inverse=inverse,
            step=step,
            shooting=SimpleNamespace(
                enclose=lambda box: SimpleNamespace(proved=True),
                system_rows=lambda enclosure, box, jacobian=jacobian: (None, jacobian),
                scales=np.ones(3),
            ),
        )
        image = module._Image(centre, tube)
        for i in range(3):
            least = []
            for j in range(3):
                middle = abs(int(i == j) - sum(a[i][k] * jm[k][j] for k in range(3)))
                least.append(middle + sum(abs(a[i][k]) * jr[k][j] for k in range(3)))
                if not least[-1] <= Fraction(defect[i][j]) <= least[-1] * Fraction(WIDER) + TINY:
                    return False
            moved = sum(a[i][k] * sum(jm[k][j] * t[j] for j in range(3)) for k in range(3))
            off = abs(moved - a[i][2])
            off += sum(abs(a[i][k]) * jr[k][j] * abs(t[j]) for k in range(3) for j in range(3))
            if not off <= Fraction(drift[i]) <= off * Fraction(WIDER) + TINY:
                return False
            reach = y[i] + off * Fraction(half) + sum(w * s for w, s in zip(least, r, strict=True))
            if not reach <= Fraction(image.reach[i]) <= reach * Fraction(WIDER) + TINY:
                return False
        verdicts.add(image.proved is not None)
        if (image.proved is not None) != bool((image.reach < radius).all()):
            return False
    return verdicts == {True, False}


def tubes_hold(module: SimpleNamespace) -> bool:
    """A tube's hull, its middle, and which enclosed zeros lie inside it, at its borders."""
    middle = np.array([1.0, -2.0, 0.5])
    tangent = np.array([0.51, -1.1, 1.0])
    radius = np.array([0.1, 0.2, 0.05])
    row = np.array([0.0, 0.0, 1.0])
    half = 0.26
    box = module.Tube(middle, tangent, radius, row, half)
    hull = box.hull
    for place in range(3):
        reach = abs(Fraction(tangent[place])) * Fraction(half) + Fraction(radius[place])
        if not reach <= Fraction(hull.radius[place]) <= reach * Fraction(1.0 + 1e-10):
            return False
    if not np.array_equal(hull.middle, middle):
        return False
    for s in (-0.2, 0.0, 0.2):
        if not np.allclose(box.at(s), middle + s * tangent, rtol=0.0, atol=1e-15):
            return False
        for place in range(2):
            for side in (-1.0, 1.0):
                for share, inside in ((0.95, True), (1.05, False)):
                    zero = box.at(s).copy()
                    zero[place] += side * share * radius[place]
                    if box.holds(Ball(zero, 1e-6)) is not inside:
                        return False
    # A zero's own spread counts along the curve, and across it by the slope of the tube.
    for s, spread, inside in (
        (0.25, 0.005, True),
        (0.25, 0.02, False),
        (-0.25, 0.005, True),
        (-0.25, 0.02, False),
        (0.3, 1e-6, False),
        (-0.3, 1e-6, False),
    ):
        along = np.array([0.0, 0.0, spread])
        if box.holds(Ball(middle + s * tangent, along)) is not inside:
            return False
    if not box.holds(Ball(middle, np.array([0.06, 0.0, 0.02]))):
        return False
    # Where a tube is hardly longer than the roundings of s, nothing is known to lie in it.
    far = 1e8 * np.ones(3)
    tiny = module.Tube(far, tangent, radius, np.array([0.6, 0.6, 0.5]), 6e-7)
    if tiny.holds(Ball(far)):
        return False
    return not box.holds(Ball(middle, np.array([0.06, 0.0, 0.09])))


def turns_hold(module: SimpleNamespace) -> bool:
    """The sign of the last part of J^-1 e for all J of a ball, by its corners."""
    unit = np.array([0.0, 1.0])
    scales = np.array([1.0, 1.0])
    decided = 0
    for slope in (0.3, -0.3, 0.05, -0.05):
        middle = np.array([[1.0, 0.4], [2.0, 0.0]])
        # J (x, p) = e with p = slope: the second row is chosen for it.
        x = -0.4 * slope
        middle[1] = [0.5, (1.0 - 0.5 * x) / slope]
        for radius in (1e-10, 1e-3, 0.02, 0.1, 0.3):
            jacobian = Ball(middle, radius * np.abs(middle))
            inverse = np.linalg.inv(middle)
            for off in (0.0, 0.02, 0.2):
                tangent = inverse[:, -1] + off * np.array([0.3, -np.sign(slope)])
                turn = module.turn_of(*module.drift_of(inverse, jacobian, tangent), tangent, scales)
                corners = corners_of(jacobian)
                signs = {int(np.sign(np.linalg.solve(corner, unit)[-1])) for corner in corners}
                if turn and signs != {turn}:
                    return False
                decided += turn != 0
                if radius == 1e-10 and off == 0.0 and turn != np.sign(slope):
                    return False
    # Found by a search: corners of this ball turn in both directions.
    inverse = np.array([[-0.75701314, -0.6219635], [0.50019616, -0.62250872]])
    radius = np.array([[0.80240615, 0.15367349], [0.16152955, 0.03148532]])
    jacobian = Ball(np.linalg.inv(inverse), radius)
    tangent = inverse[:, -1]
    if module.turn_of(*module.drift_of(inverse, jacobian, tangent), tangent, scales):
        return False
    return decided >= 20


MODULES = {
    "operator": (krawczyk, OPERATOR, operator_holds),
    "curve": (arcs, CURVE, curve_holds),
}


@pytest.mark.parametrize("name", MODULES)
def test_the_checks_hold_without_a_mutation(name: str) -> None:
    module, functions, holds = MODULES[name]
    assert holds(mutated(module, functions, None))


@pytest.mark.parametrize("name", MODULES)
def test_every_mutation_is_noticed(name: str) -> None:
    module, functions, holds = MODULES[name]
    unnoticed = []
    for mutation in mutations_of(module, functions):
        if mutation.name in EQUIVALENT:
            continue
        try:
            if holds(mutated(module, functions, mutation.number)):
                unnoticed.append(mutation.name)
        except Exception:  # whatever a mutation breaks is noticed
            continue
    assert unnoticed == []
