"""Zeros of shooting equations, proved: existence, uniqueness, and the derivative of the return map.

Let A be near the inverse of the Jacobian at x0, and X = x0 +- r.
Let Y = |A F(x0)| and Z = |I - A F_x(X)|, with Y + Z r < r in every component. Then X contains
exactly one zero of F, it lies in x0 +- (Y + Z r), and F_x is regular on X (Krawczyk 1969; Rump,
Acta Numerica 19, 2010, section 13).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.bounds.balls import EPS, UP, Ball, powers_of_two, product, solve
from saltus.bounds.shooting import Enclosure, Shooting


@dataclass(frozen=True)
class KrawczykSettings:
    """How a box is looked for in which the operator proves a zero."""

    newton: int = 12  # steps of Newton's method before it, at most
    rough: float = 1e-3  # in natural scales; a longer step need not be shorter than the last one
    boxes: int = 4  # tried, each twice as wide as the last result
    least_radius: float = 1e-16  # relative to the natural scales and to the unknowns
    wide_boxes: int = 12  # tried for uniqueness
    # A box is wide enough if its result fills this share of it.
    filled: float = 0.6
    halvings: int = 10  # of the box of a singular orbit, see `only_one`
    # A box is told wider than the operator's image of it by this, and its image is narrower than it
    # by `sure`: machines that round in another way verify it too.
    room: float = 1.01
    sure: float = 0.99


SETTINGS = KrawczykSettings()


@dataclass(frozen=True)
class ProvedZero:
    """A box that contains exactly one zero, with what proves it.

    Attributes
    ----------
    middle, radius
        The box in which the zero lies, (unknowns,).
    inverse
        A, the nearly inverse Jacobian at the middle.
    residual
        The ball of F at the middle.
    enclosure
        The equations over the box.
    unique
        The radii of a box, as wide as was found, that has no other zero, (unknowns,).
    condition
        How far an unknown moves, in natural scales, where the equations are off by one.
    """

    middle: np.ndarray
    radius: np.ndarray
    inverse: np.ndarray
    residual: Ball
    enclosure: Enclosure
    unique: np.ndarray
    condition: float

    @property
    def box(self) -> Ball:
        """The box in which the zero lies."""
        return Ball(self.middle, self.radius)


@dataclass(frozen=True)
class NotProved:
    """No box was found, with the reason in words."""

    reason: str


def contraction(
    inverse: np.ndarray, residual: Ball, jacobian: Ball, radius: np.ndarray
) -> np.ndarray:
    """Y + Z r, rounded upward: the zero lies within it if it is less than r everywhere."""
    y = product(Ball(inverse), residual.column).magnitude[:, 0]
    z = (Ball(np.eye(len(inverse))) - product(Ball(inverse), jacobian)).magnitude
    reach = (z @ radius) * (1.0 + (len(radius) + 4) * EPS) * UP
    return np.asarray((y + reach) * UP)


def prove_zero(
    shooting: Shooting, settings: KrawczykSettings = SETTINGS, unique: bool = True
) -> ProvedZero | NotProved:
    """The tightest box around the zero near `shooting.x0` in which Krawczyk's operator proves it.

    Unless `unique`, no wider box is looked for in which it is alone.
    """
    near = _newton(shooting, settings.newton)
    if isinstance(near, NotProved):
        return near
    x, inverse, residual = near
    y = product(Ball(inverse), residual.column).magnitude[:, 0]
    condition = float(natural_weights(shooting, inverse).max())
    floor = settings.least_radius * np.maximum(shooting.scales, np.abs(x))
    radius = 2.0 * y + floor
    reason = ""
    for _ in range(settings.boxes):
        enclosure = shooting.enclose(Ball(x, radius))
        if not enclosure.proved:
            return NotProved("a Taylor step over the box of the unknowns has no enclosure")
        jacobian = shooting.system_rows(enclosure, Ball(x, radius))[1]
        reach = contraction(inverse, residual, jacobian, radius)
        if (reach < settings.sure * radius).all():
            first = (radius, enclosure)
            tight, inner = _tightened(shooting, x, inverse, residual, first, reach)
            alone = radius
            if unique:
                alone = _widest(shooting, x, inverse, residual, radius, settings)
            return ProvedZero(x, tight, inverse, residual, inner, alone, condition)
        share = float((reach / radius).max())
        reason = (
            f"Krawczyk's operator does not contract: its image is {share:.3g} times as wide as the "
            f"box, at a condition of {condition:.2g}"
        )
        radius = 2.0 * reach
    return NotProved(reason)


def _tightened(
    shooting: Shooting,
    x: np.ndarray,
    inverse: np.ndarray,
    residual: Ball,
    proved: tuple[np.ndarray, Enclosure],
    reach: np.ndarray,
) -> tuple[np.ndarray, Enclosure]:
    """A smaller box that the operator maps into its interior too, with the equations over it; from
    a box that is `proved`, and its image, as long as images shrink to half.
    """
    while True:
        radius = np.minimum(proved[0], SETTINGS.room * reach)
        enclosure = shooting.enclose(Ball(x, radius))
        jacobian = shooting.system_rows(enclosure, Ball(x, radius))[1]
        reach = contraction(inverse, residual, jacobian, radius)
        if not enclosure.proved or not (reach < radius).all():
            return proved
        if (reach / shooting.scales).sum() >= 0.5 * (radius / shooting.scales).sum():
            return radius, enclosure
        proved = (radius, enclosure)


def verified_zero(
    shooting: Shooting, middle: np.ndarray, radius: np.ndarray, unique: np.ndarray
) -> ProvedZero | NotProved:
    """A zero that is said to lie within `radius` of a middle, and to be alone within `unique`:
    verified anew by the operator, without a search.
    """
    if not middle.shape == radius.shape == unique.shape == (shooting.size,):
        return NotProved("its unknowns are not those of the equations")
    if not (radius <= unique).all():
        return NotProved("its box is wider than the one in which it is alone")
    at = shooting.enclose(Ball(middle))
    residual, jacobian = shooting.system_rows(at, Ball(middle))
    inverse = shooting.nearly_inverse(jacobian.middle)
    if not at.proved or inverse is None:
        return NotProved("the equations have no enclosure there, or are singular")
    for box in (unique, radius):
        enclosure = shooting.enclose(Ball(middle, box))
        jacobian = shooting.system_rows(enclosure, Ball(middle, box))[1]
        reach = contraction(inverse, residual, jacobian, box)
        if not enclosure.proved or not (reach < box).all():
            return NotProved("Krawczyk's operator does not map its box into the interior")
    condition = float(natural_weights(shooting, inverse).max())
    return ProvedZero(middle, radius, inverse, residual, enclosure, unique, condition)


def _newton(shooting: Shooting, steps: int) -> tuple[np.ndarray, np.ndarray, Ball] | NotProved:
    """A point nearer to the zero, the inverse of the Jacobian and the ball of F there.

    Steps are taken until they no longer become shorter by half.
    """
    x = shooting.x0.copy()
    last = np.inf
    for step in range(steps + 1):
        enclosure = shooting.enclose(Ball(x))
        residual, jacobian = shooting.system_rows(enclosure, Ball(x))
        if not enclosure.proved or not np.isfinite(jacobian.middle).all():
            return NotProved("a Taylor step at the orbit has no enclosure")
        nearly = shooting.nearly_inverse(jacobian.middle)
        if nearly is None:
            return NotProved("the equations are singular there")
        inverse = nearly
        change = inverse @ residual.middle
        length = float((np.abs(change) / np.maximum(shooting.scales, np.abs(x))).max())
        shorter = length < 0.5 * last or length > SETTINGS.rough
        if step == steps or not shorter or length < 0.1 * EPS:
            break
        x = x - change
        last = length
    return x, inverse, residual


def natural_weights(shooting: Shooting, inverse: np.ndarray) -> np.ndarray:
    """How far the unknowns move, in natural scales, where every equation is off by its natural
    scale: row sums of the inverse Jacobian that depend on no units.
    """
    return np.asarray(np.abs(inverse) @ shooting.row_scales / shooting.scales)


def _widest(
    shooting: Shooting,
    x: np.ndarray,
    inverse: np.ndarray,
    residual: Ball,
    proved: np.ndarray,
    settings: KrawczykSettings,
) -> np.ndarray:
    """Radii, nearly the largest ones, in which the operator proves that there is no other zero."""
    weights = natural_weights(shooting, inverse)
    scale = min(1e-3, 1e-2 / float(weights.max()))
    weights = shooting.scales * np.maximum(weights / weights.max(), 1e-3)
    best = proved
    found = False
    for attempt in range(settings.wide_boxes):
        radius = np.maximum(scale * weights, proved)
        enclosure = shooting.enclose(Ball(x, radius))
        if not enclosure.proved:
            if found:
                break
            scale *= 0.3
            continue
        jacobian = shooting.system_rows(enclosure, Ball(x, radius))[1]
        reach = contraction(inverse, residual, jacobian, radius)
        worst = float((reach / radius).max())
        if worst < settings.sure:
            best = radius
            found = True
        if found and (worst > settings.filled or attempt > 3):
            break
        if not np.isfinite(worst):
            scale *= 0.1
        else:
            scale *= 0.85 / worst if worst > 0.1 else 5.0
    return best


def only_one(
    shooting: Shooting, zero: ProvedZero, settings: KrawczykSettings = SETTINGS
) -> np.ndarray | None:
    """Radii in which there is no other singular orbit, whatever its kernel vector.

    The shooting is that of `varied` segments: the last half of each event's unknowns, and of the
    positions and of the velocities at each node, belong to the kernel vector.
    A kernel vector phi of J(x, parameter), scaled by the pin c . phi = g, solves the bordered
    system [J b; c 0] (phi, 0) = (0, g).
    It is enclosed for all (x, parameter) of a box, which is halved until the enclosure lies in the
    box in which (x, parameter, phi) is unique.
    """
    assert shooting.pins is not None
    x = zero.middle
    count = shooting.event_unknowns
    p = shooting.event_size
    d = shooting.dof
    varied = [*range(d // 2, d), *range(d + d // 2, 2 * d)]
    events = [p * i + j for i in range(shooting.event_count) for j in range(p // 2, p)]
    nodes = [k + j for k in range(count, shooting.size - 1, 2 * d) for j in varied]
    columns = np.array(events + nodes)
    rows = np.array([2 * d * k + j for k in range(len(shooting.steps)) for j in varied])
    pin, goal = shooting.pins[0]
    others = np.setdiff1d(np.arange(shooting.size), columns)
    # In natural scales, so that the result depends on no units.
    units = powers_of_two(shooting.scales[columns])
    equations = powers_of_two(shooting.row_scales[rows])
    scaled_pin = pin[columns] * units
    share = float(powers_of_two(np.abs(scaled_pin).max()))
    for halving in range(settings.halvings):
        box = zero.unique.copy()
        box[others] *= 0.5**halving
        enclosure = shooting.enclose(Ball(x, box))
        if not enclosure.proved:
            continue
        jacobian = shooting.system_rows(enclosure, Ball(x, box))[1][np.ix_(rows, columns)]
        jacobian = jacobian.scaled(units / equations[:, None])
        left = np.linalg.svd(jacobian.middle)[0][:, -1]
        size = len(columns) + 1
        middle = np.zeros((size, size))
        radius = np.zeros((size, size))
        middle[:-1, :-1] = jacobian.middle
        radius[:-1, :-1] = jacobian.radius
        middle[:-1, -1] = left
        middle[-1, :-1] = scaled_pin / share
        right = np.zeros((size, 1))
        right[-1] = goal / share
        solution = solve(Ball(middle, radius), Ball(right))
        if solution is None:
            continue
        if solution[:-1, 0].inside(x[columns] / units, zero.unique[columns] / units):
            return box
    return None


def return_map(shooting: Shooting, enclosure: Enclosure) -> Ball | None:
    """The derivative M of the return map of the first event's unknowns, in units near their natural
    scales, (P, P).

    The equations are cut open at this event: L d = -B d_1, with B the derivatives to the start of
    the first step.
    One verified linear system gives M; a product of segments' maps would wrap.

    Returns
    -------
    Ball | None
        None where L was not shown to be regular.
    """
    columns = powers_of_two(shooting.scales[: enclosure.open_jacobian.middle.shape[1]])
    rows = powers_of_two(shooting.row_scales[: len(enclosure.open_jacobian.middle)])[:, None]
    left = enclosure.open_jacobian.ball.scaled(columns / rows)
    right = enclosure.start_jacobian.ball.scaled(columns[: shooting.event_size] / rows)
    solution = solve(left, right)
    return None if solution is None else -solution[: shooting.event_size]


@dataclass(frozen=True)
class Multipliers:
    """Bounds of the multipliers of a return map.

    Attributes
    ----------
    stable
        True if all lie inside the unit circle, False if one lies outside, None if it is undecided.
    moduli
        Balls of their moduli, largest first; empty where they were not separated.
    """

    stable: bool | None
    moduli: tuple[tuple[float, float], ...]


def multipliers_of(matrix: Ball | None) -> Multipliers:
    """Bounds of the eigenvalues of a matrix of balls.

    Of a 2 x 2 matrix by Jury's conditions and in closed form, of a larger one by Gershgorin's
    discs after a similarity with the computed eigenvectors, whose inverse is verified.
    """
    if matrix is None or not np.isfinite(matrix.radius).all():
        return Multipliers(None, ())
    return _of_two(matrix) if len(matrix.middle) == 2 else _by_discs(matrix)


def _of_two(matrix: Ball) -> Multipliers:
    trace = matrix[0, 0] + matrix[1, 1]
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    discriminant = trace * trace / 4.0 - determinant
    moduli: list[tuple[float, float]] = []
    if discriminant.low > 0.0:
        root = discriminant.sqrt()
        pair = [trace / 2.0 + root, trace / 2.0 - root]
        sizes = [(float(abs(z.middle)), float(z.radius * UP)) for z in pair]
        moduli = sorted(sizes, reverse=True)
    elif discriminant.high < 0.0:
        root = determinant.sqrt()
        moduli = [(float(root.middle), float(root.radius))] * 2
    stable: bool | None = None
    bound = (determinant + 1.0).high
    if determinant.magnitude < 1.0 and trace.magnitude < (determinant + 1.0).low:
        stable = True
    elif (
        determinant.low > 1.0 or determinant.high < -1.0 or trace.low > bound or -trace.high > bound
    ):
        stable = False
    elif moduli and moduli[0][0] - moduli[0][1] > 1.0 + EPS:
        stable = False  # where the determinant is a small difference of large products
    return Multipliers(stable, tuple(moduli))


def _by_discs(matrix: Ball) -> Multipliers:
    """V^-1 M V for the computed eigenvectors V, as pairs of real matrices, and discs around its
    diagonal.
    """
    values, vectors = np.linalg.eig(matrix.middle)
    size = len(values)
    # The complex V as a real matrix of twice the size, whose inverse is verified.
    real = np.block([[vectors.real, -vectors.imag], [vectors.imag, vectors.real]])
    zero = np.zeros((size, size))
    middle = np.block([[matrix.middle, zero], [zero, matrix.middle]])
    radius = np.block([[matrix.radius, zero], [zero, matrix.radius]])
    similar = solve(Ball(real), product(Ball(middle, radius), Ball(real)))
    if similar is None:
        return Multipliers(None, ())
    re = similar[:size, :size]
    im = similar[size:, :size]
    off = np.hypot(re.magnitude, im.magnitude) * UP
    centre = np.diagonal(re.middle) + 1j * np.diagonal(im.middle)
    own = np.diagonal(re.radius) + np.diagonal(im.radius)
    discs = (off.sum(axis=1) - np.diagonal(off)) * (1.0 + size * EPS) * UP + own * UP
    discs = discs + 4.0 * EPS * np.diagonal(off)
    sizes = np.abs(centre)
    order = np.argsort(-sizes, kind="stable")
    moduli = tuple((float(sizes[i]), float((discs[i] + EPS * sizes[i]) * UP)) for i in order)
    apart = [_isolated(centre, discs, int(i)) for i in order]
    named = moduli if all(apart) else ()
    if (sizes + discs < 1.0 - EPS).all():
        return Multipliers(True, named)
    outside = apart[0] and moduli[0][0] - moduli[0][1] > 1.0 + EPS
    return Multipliers(False if outside else None, named)


def _isolated(centre: np.ndarray, discs: np.ndarray, index: int) -> bool:
    """Whether a disc meets no other one, so that it contains exactly one eigenvalue."""
    others = np.arange(len(centre)) != index
    distance = np.abs(centre - centre[index])[others] * (1.0 - 4.0 * EPS)
    return bool((distance > (discs[others] + discs[index]) * UP).all())
