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
from saltus.bounds.precise import has_flint, precise_residual
from saltus.bounds.shooting import Enclosure, Shooting

EXTRA = 'pip install ".[prove]"'


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
    # More digits are tried where Newton's step, in natural scales, is longer than a few roundings, and
    # the condition less than what makes the Jacobian in doubles useless.
    rounded: float = 1e-14
    singular: float = 1e11
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
    precise
        Whether the residual was computed by FLINT.
    """

    middle: np.ndarray
    radius: np.ndarray
    inverse: np.ndarray
    residual: Ball
    enclosure: Enclosure
    unique: np.ndarray
    condition: float
    precise: bool = False

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


@dataclass(frozen=True)
class Centre:
    """A point x of doubles near a zero, around which boxes are tried.

    Attributes
    ----------
    shooting
        The equations.
    x
        The point.
    inverse
        A, the nearly inverse Jacobian there.
    residual
        The ball of F there.
    precise
        Whether this was computed by FLINT.
    """

    shooting: Shooting
    x: np.ndarray
    inverse: np.ndarray
    residual: Ball
    precise: bool

    def zero(self, radius: np.ndarray, enclosure: Enclosure, unique: np.ndarray) -> ProvedZero:
        """The zero that the operator proves within `radius`, and alone within `unique`."""
        condition = float(self.weights.max())
        parts = (self.x, radius, self.inverse, self.residual, enclosure, unique)
        return ProvedZero(*parts, condition, self.precise)

    @property
    def step(self) -> np.ndarray:
        """Y, a bound of Newton's step."""
        return np.asarray(product(Ball(self.inverse), self.residual.column).magnitude[:, 0])

    @property
    def weights(self) -> np.ndarray:
        """How far the unknowns move, in natural scales, where every equation is off by its natural
        scale: row sums of the inverse Jacobian that depend on no units.
        """
        shooting = self.shooting
        return np.asarray(np.abs(self.inverse) @ shooting.row_scales / shooting.scales)

    def image(self, radius: np.ndarray) -> tuple[np.ndarray, Enclosure] | None:
        """The radii of the operator's image of x +- radius, and the equations over this box; None
        where a Taylor step has no enclosure.
        """
        box = Ball(self.x, radius)
        enclosure = self.shooting.enclose(box)
        if not enclosure.proved:
            return None
        jacobian = self.shooting.system_rows(enclosure, box)[1]
        return contraction(self.inverse, self.residual, jacobian, radius), enclosure


def centre_at(shooting: Shooting, x: np.ndarray, precise: bool = False) -> Centre | NotProved:
    """The equations and the nearly inverse Jacobian at a point; the residual with more digits if it
    is to be `precise`.
    """
    at = shooting.enclose(Ball(x))
    if not at.proved:
        return NotProved("a Taylor step at the orbit has no enclosure")
    residual, jacobian = shooting.system_rows(at, Ball(x))
    inverse = shooting.nearly_inverse(jacobian.middle)
    if inverse is None:
        return NotProved("the equations are singular there")
    if precise:
        finer = precise_residual(shooting, x)
        if finer is None:
            return NotProved("the equations have no enclosure with more digits than doubles have")
        residual = finer
    return Centre(shooting, x, inverse, residual, precise)


def newton(
    shooting: Shooting, x: np.ndarray, steps: int, precise: bool = False
) -> Centre | NotProved:
    """A point nearer to the zero, by steps that are taken until they no longer become shorter by
    half.
    """
    last = np.inf
    for step in range(steps + 1):
        centre = centre_at(shooting, x, precise)
        if isinstance(centre, NotProved):
            return centre
        change = centre.inverse @ centre.residual.middle
        length = float((np.abs(change) / np.maximum(shooting.scales, np.abs(x))).max())
        shorter = length < 0.5 * last or length > SETTINGS.rough
        if step == steps or not shorter or length < 0.1 * EPS:
            break
        x = x - change
        last = length
    return centre


def prove_zero(
    shooting: Shooting,
    settings: KrawczykSettings = SETTINGS,
    unique: bool = True,
    precise: bool = False,
) -> ProvedZero | NotProved:
    """The tightest box around the zero near `shooting.x0` in which Krawczyk's operator proves it.

    Unless `unique`, the first box is enough, after one step of Newton's method: no tighter one is
    looked for, and no wider one in which it is alone. With `precise`, the residual
    is computed with more digits where doubles are not enough, if FLINT is there.
    """
    steps = settings.newton if unique else 1
    centre = newton(shooting, shooting.x0, steps)
    if isinstance(centre, NotProved):
        return centre
    zero = _proved_around(centre, settings, unique)
    if not isinstance(zero, NotProved) or not precise or not _needs_digits(centre, settings):
        return zero
    if not has_flint():
        return NotProved(f"{zero.reason}; more digits may prove it: {EXTRA}")
    centre = newton(shooting, centre.x, settings.newton, precise=True)
    if isinstance(centre, NotProved):
        return centre
    return _proved_around(centre, settings, unique)


def _needs_digits(centre: Centre, settings: KrawczykSettings) -> bool:
    """Whether the rounding of the residual is what keeps the operator from contracting."""
    scales = np.maximum(centre.shooting.scales, np.abs(centre.x))
    rounded = float((centre.step / scales).max()) > settings.rounded
    return rounded and float(centre.weights.max()) < settings.singular


def _proved_around(
    centre: Centre, settings: KrawczykSettings, unique: bool
) -> ProvedZero | NotProved:
    x = centre.x
    condition = float(centre.weights.max())
    floor = settings.least_radius * np.maximum(centre.shooting.scales, np.abs(x))
    radius = 2.0 * centre.step + floor
    reason = ""
    for _ in range(settings.boxes):
        image = centre.image(radius)
        if image is None:
            return NotProved("a Taylor step over the box of the unknowns has no enclosure")
        reach, enclosure = image
        if (reach < settings.sure * radius).all():
            if not unique:
                return centre.zero(radius, enclosure, radius)
            tight, inner = _tightened(centre, (radius, enclosure), reach)
            return centre.zero(tight, inner, _widest(centre, radius, settings))
        share = float((reach / radius).max())
        reason = (
            f"Krawczyk's operator does not contract: its image is {share:.3g} times as wide as the "
            f"box, at a condition of {condition:.2g}"
        )
        radius = 2.0 * reach
    return NotProved(reason)


def _tightened(
    centre: Centre, proved: tuple[np.ndarray, Enclosure], reach: np.ndarray
) -> tuple[np.ndarray, Enclosure]:
    """A smaller box that the operator maps into its interior too, with the equations over it; from
    a box that is `proved`, and its image, as long as images shrink to half.
    """
    scales = centre.shooting.scales
    while True:
        radius = np.minimum(proved[0], SETTINGS.room * reach)
        image = centre.image(radius)
        if image is None or not (image[0] < radius).all():
            return proved
        reach = image[0]
        proved = (radius, image[1])
        if (reach / scales).sum() >= 0.5 * (radius / scales).sum():
            return proved


def verified_zero(
    shooting: Shooting,
    middle: np.ndarray,
    radius: np.ndarray,
    unique: np.ndarray,
    precise: bool = False,
) -> ProvedZero | NotProved:
    """A zero that is said to lie within `radius` of a middle, and to be alone within `unique`:
    verified anew by the operator, without a search; by FLINT if it is to be `precise`.
    """
    if not middle.shape == radius.shape == unique.shape == (shooting.size,):
        return NotProved("its unknowns are not those of the equations")
    if not (radius <= unique).all():
        return NotProved("its box is wider than the one in which it is alone")
    if precise and not has_flint():
        return NotProved(f"it was proved with more digits: {EXTRA}")
    centre = centre_at(shooting, middle, precise)
    if isinstance(centre, NotProved):
        return centre
    for box in (unique, radius):
        image = centre.image(box)
        if image is None or not (image[0] < box).all():
            return NotProved("Krawczyk's operator does not map its box into the interior")
        enclosure = image[1]
    return centre.zero(radius, enclosure, unique)


def _widest(centre: Centre, proved: np.ndarray, settings: KrawczykSettings) -> np.ndarray:
    """Radii, nearly the largest ones, in which the operator proves that there is no other zero."""
    weights = centre.weights
    scale = min(1e-3, 1e-2 / float(weights.max()))
    weights = centre.shooting.scales * np.maximum(weights / weights.max(), 1e-3)
    best = proved
    found = False
    for attempt in range(settings.wide_boxes):
        radius = np.maximum(scale * weights, proved)
        image = centre.image(radius)
        if image is None:
            if found:
                break
            scale *= 0.3
            continue
        worst = float((image[0] / radius).max())
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
