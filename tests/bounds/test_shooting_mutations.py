"""Every term of the shooting equations is needed: with one sign turned or one bound made smaller, exact
residuals or derivatives leave their balls, balls become wider, or a gap is judged falsely.

The motion is that of x'' = -k x - c x' + g cos(W t), which has a closed form.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
from mutations import mutated, mutations_of

import saltus
from saltus.bounds import Ball, shooting
from saltus.systems import numbers
from saltus.taylor import Expr, number

FUNCTIONS = (
    "varied",
    "Enclosure.jacobian",
    "Adder.add",
    "_with_slopes",
    "with_columns",
    "Shooting.__init__",
    "Shooting.period",
    "Shooting.follow",
    "Shooting.parameters_at",
    "Shooting.enclose",
    "Shooting._enclose_group",
    "Shooting._begins",
    "Shooting._end_times",
    "Shooting._taken",
    "Shooting._close_nodes",
    "Shooting._close_events",
    "Shooting._add_begin",
    "Shooting._values",
    "Shooting.system_rows",
    "Shooting.pierced",
    "Shooting.is_open",
    "_Flow.__init__",
    "_packed",
)
WIDER = 1.3  # the most that a ball may exceed that of the equations as they are
SYSTEM = saltus.System(
    model=saltus.WallOscillator(stiffness=1.3, damping=0.15, wall=0.4),
    load=saltus.Load(frequency=0.9, force=saltus.Harmonic(amplitude=0.7)),
)
NAMES = [name for name, _ in numbers(SYSTEM)]
K, C, WALL, W, G = (
    Expr("parameter", (), NAMES.index(name))
    for name in (
        "model.stiffness",
        "model.damping",
        "model.wall",
        "load.frequency",
        "load.force.amplitude",
    )
)
E1, E2 = 0.8, 0.6  # what two events leave of a speed
GUESS = np.array([[0.3, 1.1], [4.0, 0.9]])
RADII = {"model.damping": 1e-4, "load.frequency": 2e-4, "model.wall": 3e-4}
BOX = 1e-3


def segments(module: SimpleNamespace, gaps: bool = True) -> list:
    """From an event at the wall to one at its opposite, and back; both positions move with the
    speed and with time, so that every derivative matters.
    """
    q, v = module.coordinate(0), module.velocity(0)
    unknown = module.Unknowns(SYSTEM)
    t, s = module.TIME, unknown[1]
    acceleration = (number(-1.0) * K * q - C * v + G * Expr("cos", (W * t,)),)
    first = (WALL + 0.1 * s * s, number(-E1) * s + 0.2 * C * t)
    second = (number(-1.0) * WALL + 0.05 * t, number(E2) * s)
    to_first = (q - WALL - 0.1 * s * s, v - s + 0.1 * t * C)
    to_second = (q + WALL - 0.05 * t, v + s * s)
    below = (module.Gap(0, -1.0, WALL + 3.0, 0, 0),) if gaps else ()
    return [
        module.Segment(acceleration, first, to_second, below),
        module.Segment(acceleration, second, to_first, below),
    ]


def equations(module: SimpleNamespace, path: str, pinned: bool = False) -> SimpleNamespace:
    made = module.Shooting(
        SYSTEM,
        segments(module),
        GUESS,
        [["time", "speed"]] * 2,
        ["x", "x'"],
        1.0,
        path=path,
        radii=RADII,
        pins=[] if pinned else None,
        settings=module.ShootingSettings(step=1.6, order=24),
    )
    if pinned:
        row = np.linspace(0.5, 1.5, made.size)
        made.pins = [(-row, 0.2), (row, 0.7)]
    return made


# --- the closed form --------------------------------------------------------------


def flow(t0: mp.mpf, q: mp.mpf, v: mp.mpf, t1: mp.mpf, p: dict[str, mp.mpf]) -> tuple:
    """The state at t1."""
    k, c, w, g = p["k"], p["c"], p["w"], p["g"]
    size = (k - w**2) ** 2 + (c * w) ** 2
    a, b = g * (k - w**2) / size, g * c * w / size

    def forced(t: mp.mpf) -> tuple:
        return (
            a * mp.cos(w * t) + b * mp.sin(w * t),
            w * (b * mp.cos(w * t) - a * mp.sin(w * t)),
        )

    f, df = forced(t0)
    x, y = q - f, v - df
    half = c / 2
    fast = mp.sqrt(k - half**2)
    h = t1 - t0
    swing = (y + half * x) / fast
    fall = mp.exp(-half * h)
    free = fall * (x * mp.cos(fast * h) + swing * mp.sin(fast * h))
    rate = -half * free + fall * fast * (swing * mp.cos(fast * h) - x * mp.sin(fast * h))
    f, df = forced(t1)
    return free + f, rate + df


def begin_of(number_: int, t: mp.mpf, s: mp.mpf, p: dict[str, mp.mpf]) -> tuple:
    if number_ == 0:
        return p["wall"] + s * s * mp.mpf(0.1), -mp.mpf(E1) * s + mp.mpf(0.2) * p["c"] * t
    return -p["wall"] + mp.mpf(0.05) * t, mp.mpf(E2) * s


def end_of(number_: int, t: mp.mpf, s: mp.mpf, q: mp.mpf, v: mp.mpf, p: dict[str, mp.mpf]) -> list:
    if number_ == 1:
        return [q - p["wall"] - mp.mpf(0.1) * s * s, v - s + mp.mpf(0.1) * t * p["c"]]
    return [q + p["wall"] - mp.mpf(0.05) * t, v + s * s]


def parameters(path: str, moved: float, side: int) -> dict[str, mp.mpf]:
    """The numbers of the system, at a corner of their radii, and the one at the path moved."""
    values = dict(numbers(SYSTEM))
    names = {"k": "model.stiffness", "c": "model.damping", "wall": "model.wall"}
    names |= {"w": "load.frequency", "g": "load.force.amplitude"}
    return {
        key: mp.mpf(values[name])
        + side * mp.mpf(RADII.get(name, 0.0))
        + mp.mpf(moved if name == path else 0.0)
        for key, name in names.items()
    }


def rows_of(step: shooting.Step, x: list, p: dict[str, mp.mpf]) -> list:
    """The two equations of a step, by the closed form."""
    if step.from_event:
        t0 = x[step.begin]
        q, v = begin_of(step.segment, t0, x[step.begin + 1], p)
    else:
        t0 = mp.mpf(step.begin_time)
        q, v = x[step.begin], x[step.begin + 1]
    t1 = x[step.close] if step.to_event else mp.mpf(step.close_time)
    if step.wraps:
        t1 = t1 + 2 * mp.pi / p["w"]
    q, v = flow(t0, q, v, t1, p)
    if step.to_event:
        return end_of(step.segment, t1, x[step.close + 1], q, v, p)
    return [q - x[step.close], v - x[step.close + 1]]


def residual(steps: tuple, x: list, p: dict[str, mp.mpf]) -> list:
    """F by the closed form."""
    return [row for step in steps for row in rows_of(step, x, p)]


@cache
def exact(steps: tuple, at: tuple, path: str, side: int) -> tuple[list, list, list]:
    """F, its derivatives to all unknowns and that to the parameter, by differences in 60 digits."""
    with mp.workdps(60):
        small = mp.mpf(10) ** -20
        x = [mp.mpf(value) for value in at]

        def slope(move: int | None) -> list:
            ends = []
            for sign in (1, -1):
                other = [v + sign * small * (i == move) for i, v in enumerate(x)]
                p = parameters(path, 0.0, side)
                if move is None:
                    p = parameters(path, sign * small, side)
                ends.append(residual(steps, other, p))
            return [(a - b) / (2 * small) for a, b in zip(*ends, strict=True)]

        columns = [slope(i) for i in range(len(x))]
        return residual(steps, x, parameters(path, 0.0, side)), columns, slope(None)


def contain(balls: Ball, values: list) -> bool:
    with mp.workdps(40):
        pairs = zip(balls.middle.ravel(), balls.radius.ravel(), values, strict=True)
        return all(
            np.isfinite(r) and abs(mp.mpf(float(m)) - v) <= mp.mpf(float(r)) for m, r, v in pairs
        )


def as_they_are(path: str) -> SimpleNamespace:
    return equations(shooting, path)


def boxes_hold(module: SimpleNamespace) -> bool:
    """F and its derivatives at the corners of a box and of the parameters, in their balls; these as
    narrow as those of the equations as they are."""
    for path in ("model.damping", "load.frequency"):
        made = equations(module, path)
        plain = as_they_are(path)
        if made.steps != [module.Step(**vars(step)) for step in plain.steps]:
            return False
        rng = np.random.default_rng(5)
        count = made.size
        corners = [(np.zeros(count), 0), *((rng.choice([-1.0, 1.0], count), k) for k in (-1, 1))]
        for reach in (0.0, BOX):
            box = Ball(plain.x0, np.full(count, reach))
            enclosure = made.enclose(box)
            least = plain.enclose(box)
            if not enclosure.proved:
                return False
            if not np.array_equal(
                made.system_rows(enclosure, box)[1].middle, least.jacobian.middle
            ):
                return False
            for ours, theirs in (
                (enclosure.residual.ball, least.residual.ball),
                (enclosure.jacobian, least.jacobian),
                (enclosure.path_jacobian.ball, least.path_jacobian.ball),
            ):
                if not (ours.radius <= WIDER * theirs.radius + 1e-14).all():
                    return False
            for corner, side in corners if reach else [(np.zeros(count), 0), (np.zeros(count), 1)]:
                point = tuple(float(v) for v in plain.x0 + reach * (1.0 - 1e-9) * corner)
                values, columns, along = exact(tuple(plain.steps), point, path, side)
                if not contain(enclosure.residual.ball, values):
                    return False
                if not contain(enclosure.path_jacobian.ball, along):
                    return False
                flat = [columns[j][i] for i in range(len(values)) for j in range(count)]
                if not contain(enclosure.jacobian, flat):
                    return False
    return True


def pins_hold(module: SimpleNamespace) -> bool:
    """The rows of a pin, and the column of the parameter, which moves the period and the motion."""
    path = "load.frequency"
    made = equations(module, path, pinned=True)
    plain = equations(shooting, path, pinned=True)
    x = Ball(plain.x0, 1e-6)
    enclosure = made.enclose(x)
    values, matrix = made.system_rows(enclosure, x)
    row, goal = made.pins[1]
    rows = len(values.middle) - 2
    if not np.array_equal(matrix.middle[-2], -row) or values.middle[-1] == values.middle[-2]:
        return False
    if not np.array_equal(matrix.middle[-1], row) or matrix.radius[-1].max() > 1e-15:
        return False
    middle = float(row @ plain.x0 - goal)
    reach = 1e-6 * float(np.abs(row).sum())
    if not (abs(values.middle[-1] - middle) < 1e-12 and reach <= values.radius[-1] < 1.01 * reach):
        return False
    same = (
        (matrix[:rows, -1], enclosure.path_jacobian.ball),
        (matrix[:rows, :-1], enclosure.jacobian),
        (values[:rows], enclosure.residual.ball),
    )
    for ours, theirs in same:
        if not (np.abs(ours.middle - theirs.middle) <= theirs.radius + 1e-15).all():
            return False
    # The parameter is the last unknown: elsewhere the equations are those at that parameter.
    at = plain.x0.copy()
    at[-1] += 0.01
    moved = made.enclose(Ball(at)).residual.ball
    found, _, _ = exact(tuple(plain.steps), tuple(map(float, plain.x0[:-1])), path, 0)
    if contain(moved, found):
        return False
    with mp.workdps(40):
        p = parameters(path, 0.01, 0)
        p["w"] = mp.mpf(float(at[-1]))
        return contain(moved, residual(tuple(plain.steps), [mp.mpf(float(v)) for v in at], p))


def kernels_hold(module: SimpleNamespace) -> bool:
    """Of varied segments the further equations are the derivatives along the further unknowns; those
    of the event that closes the period count theta times."""
    path = "model.damping"
    plain = as_they_are(path)
    rng = np.random.default_rng(6)
    made_of = segments(module, gaps=False)
    for theta in (1.0, -1.0):
        unknowns = module.Unknowns(SYSTEM)
        larger = [
            module.varied(made_of[0], unknowns, 1.0),
            module.varied(made_of[1], unknowns, theta),
        ]
        guess = np.concatenate([GUESS, rng.normal(size=(2, 2))], axis=1)
        made = module.Shooting(
            SYSTEM,
            larger,
            guess,
            [["time", "speed", "dt", "ds"]] * 2,
            ["x", "u", "x'", "u'"],
            1.0,
            settings=module.ShootingSettings(step=1.6, order=24),
        )
        if len(made.steps) != len(plain.steps):
            return False
        x = made.x0 + 1e-3 * rng.normal(size=made.size)
        nodes = x[8:].reshape(-1, 4)
        events = x[:8].reshape(2, 4)
        point = np.concatenate([events[:, :2].ravel(), nodes[:, [0, 2]].ravel()])
        phi = np.concatenate([events[:, 2:].ravel(), nodes[:, [1, 3]].ravel()])
        found = made.enclose(Ball(x)).residual.ball.middle.reshape(-1, 4)
        values, columns, _ = exact(tuple(plain.steps), tuple(map(float, point)), path, 0)
        jacobian = np.array(columns, dtype=float).T
        closing = jacobian[-2:, :2] @ phi[:2]
        expected = jacobian @ phi
        expected[-2:] += (theta - 1.0) * closing
        if not np.allclose(found[:, [0, 2]].ravel(), np.array(values, dtype=float), atol=1e-10):
            return False
        if not np.allclose(found[:, [1, 3]].ravel(), expected, atol=1e-9):
            return False
        slopes = made.enclose(Ball(x)).jacobian.middle
        for place in range(8):
            ends = []
            for sign in (1.0, -1.0):
                other = x.copy()
                other[place] += sign * 1e-5
                ends.append(made.enclose(Ball(other)).residual.ball.middle)
            if not np.allclose(slopes[:, place], (ends[0] - ends[1]) / 2e-5, atol=1e-6):
                return False
    return True


def corners_hold(module: SimpleNamespace) -> bool:
    """Over short steps, where balls are hardly wider than what they stand for: each equation at the
    corner at which it is largest, and the derivatives to the times of events at both ends of their
    speeds.
    """
    path = "load.force.amplitude"

    def made_by(other: SimpleNamespace, radii: dict[str, float]) -> SimpleNamespace:
        return other.Shooting(
            SYSTEM,
            segments(other),
            GUESS,
            [["time", "speed"]] * 2,
            ["x", "x'"],
            1.0,
            path=path,
            radii=radii,
            settings=other.ShootingSettings(step=0.35, order=24),
        )

    plain = made_by(shooting, {path: 1e-3})
    made = made_by(module, {path: 1e-3})
    least = plain.enclose(Ball(plain.x0))
    reach = 1e-6
    found = made.enclose(Ball(plain.x0, reach)).residual.ball
    x = [mp.mpf(float(v)) for v in plain.x0]
    slopes = np.sign(least.jacobian.middle)
    sides = np.sign(least.path_jacobian.middle)
    p = parameters(path, 0.0, 0)
    for k, step in enumerate(plain.steps):
        for row in (2 * k, 2 * k + 1):
            for sign in (1, -1):
                share = sign * mp.mpf(reach) * (1 - mp.mpf(10) ** -9)
                at = [v + share * int(slope) for v, slope in zip(x, slopes[row], strict=True)]
                moved = p | {"g": p["g"] + sign * int(sides[row]) * mp.mpf(1e-3)}
                if not contain(found[row], [rows_of(step, at, moved)[row - 2 * k]]):
                    return False
    radius = np.zeros(plain.size)
    radius[[1, 3]] = reach
    jacobian = made_by(module, {}).enclose(Ball(plain.x0, radius)).jacobian
    small = mp.mpf(10) ** -15
    for k, step in enumerate(plain.steps):
        if not step.from_event:
            continue
        for sign in (1, -1):
            ends = []
            for move in (1, -1):
                at = list(x)
                at[step.begin + 1] += sign * mp.mpf(reach) * (1 - mp.mpf(10) ** -9)
                at[step.begin] += move * small
                ends.append(rows_of(step, at, p))
            slope = [(a - b) / (2 * small) for a, b in zip(*ends, strict=True)]
            if not contain(jacobian[2 * k : 2 * k + 2, step.begin], slope):
                return False
    return True


def motions_hold(module: SimpleNamespace) -> bool:
    """States after an event are those of the closed form, and the period is 2 pi span / W."""
    made = equations(module, "model.damping")
    event = Ball(GUESS[1], np.array([1e-6, 1e-6]))
    nodes = (4.5, 5.5)
    for guessed in (False, True):
        states = made.follow(1, event, nodes, guessed=guessed)
        with mp.workdps(40):
            p = parameters("model.damping", 0.0, 0)
            start = begin_of(1, mp.mpf(GUESS[1, 0]), mp.mpf(GUESS[1, 1]), p)
            for node, state in zip(nodes, states, strict=True):
                values = flow(mp.mpf(GUESS[1, 0]), *start, mp.mpf(node), p)
                if not np.allclose(state.middle, np.array(values, dtype=float), atol=1e-6):
                    return False
                if not guessed and not contain(state, list(values)):
                    return False
                if state.radius.max() > 1e-2:
                    return False
    moved = made.follow(1, Ball(GUESS[1]), nodes[:1], Ball(np.asarray(0.2)))[0]
    with mp.workdps(40):
        p = parameters("model.damping", 0.0, 0)
        p["c"] = mp.mpf(0.2)
        start = begin_of(1, mp.mpf(GUESS[1, 0]), mp.mpf(GUESS[1, 1]), p)
        if not contain(moved, list(flow(mp.mpf(GUESS[1, 0]), *start, mp.mpf(nodes[0]), p))):
            return False
    known = made.parameters_at(Ball(np.asarray(0.2), np.asarray(0.01)))
    place = NAMES.index("model.damping")
    for part, value in ((known.middle, 0.2), (known.radius, 0.01)):
        expected = (
            made.parameters.middle if part is known.middle else made.parameters.radius
        ).copy()
        expected[place] = value
        if not np.array_equal(part, expected):
            return False
    if not contain(module.TWO_PI, [2 * mp.pi]):
        return False
    turns = 2.0 * np.pi / 0.9
    spread = turns * RADII["load.frequency"] / 0.9
    period = made.period
    return bool(abs(period.middle - turns) < 1e-12 and spread <= period.radius < WIDER * spread)


def gaps_hold(module: SimpleNamespace) -> bool:
    """A gap on each side of the motion, from far away to where it is pierced; a gap that is pierced is
    negative there by the closed form."""
    plain = as_they_are("model.damping")
    x = Ball(plain.x0, 1e-9)
    with mp.workdps(20):
        p = parameters("model.damping", 0.0, 0)
        tops = []
        times = np.linspace(0.0, 1.0, 201)[1:-1]
        ends = [*GUESS[:, 0], GUESS[0, 0] + 2.0 * np.pi / 0.9]
        track = []
        for i in range(2):
            start = begin_of(i, mp.mpf(GUESS[i, 0]), mp.mpf(GUESS[i, 1]), p)
            for share in times:
                t = ends[i] + share * (ends[i + 1] - ends[i])
                q = float(flow(mp.mpf(GUESS[i, 0]), *start, mp.mpf(t), p)[0])
                track.append((t, q))
        values = np.array(track)
        tops = values[:, 1].max(), values[:, 1].min()
    for sign, extreme in ((-1.0, tops[0]), (1.0, tops[1])):
        for off in (-0.3, -0.05, 0.05, 0.3):
            # sign (q - position) >= `off` along the motion
            position = extreme - sign * off
            gap = module.Gap(0, sign, number(0.0) * WALL + position, 0, 0)
            made = equations(module, "model.damping")
            made.segments = [
                module.Segment(s.acceleration, s.start, s.end, (gap,)) for s in made.segments
            ]
            for group in made.groups:
                group.positions = shooting.Tape([gap.position])
            enclosure = made.enclose(x)
            if made.is_open(enclosure, x) is not (off > 0.0):
                return False
            pierced = made.pierced(enclosure, x)
            if off > 0.0 and pierced is not None:
                return False
            if off == -0.3:
                if pierced is None:
                    return False
                near = values[np.abs(values[:, 0] - pierced).argmin()]
                if not sign * (near[1] - position) < 0.02:
                    return False
    return True


def holds(module: SimpleNamespace) -> bool:
    with mp.workdps(40):
        return (
            boxes_hold(module)
            and pins_hold(module)
            and kernels_hold(module)
            and corners_hold(module)
            and motions_hold(module)
            and gaps_hold(module)
        )


def survivors(every: int) -> list[str]:
    """The mutations that no check notices."""
    found = []
    for mutation in list(mutations_of(shooting, FUNCTIONS))[::every]:
        try:
            with np.errstate(all="ignore"):
                unnoticed = holds(mutated(shooting, FUNCTIONS, mutation.number))
        except Exception:  # whatever a mutation breaks is noticed
            unnoticed = False
        if unnoticed:
            found.append(mutation.name)
    return found


def test_the_equations_hold_without_a_mutation() -> None:
    assert holds(mutated(shooting, FUNCTIONS, None))


def test_a_sample_of_mutations_is_noticed() -> None:
    assert survivors(9) == []


@pytest.mark.thorough
def test_every_mutation_is_noticed() -> None:
    assert survivors(1) == []
