"""Momentum, energy and the laws of what touches, of random models of up to 8 coordinates in which
all parts act at once.

Each structure has masses that are coupled, springs, dampers and at times a pendulum, contacts of
single coordinates and between bodies, frictions with known normal forces and in contacts, surfaces
with springs and dampers behind them, and coordinates of first order. Its numbers are drawn anew for
each motion. What the motion must keep is computed from its dense output alone.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import saltus


@dataclasses.dataclass(frozen=True)
class Layout:
    """Which parts a structure has: rows of coefficients of the `count` coordinates that move."""

    count: int
    electric: tuple[int, ...]  # the coordinate that each coordinate of first order is coupled to
    springs: np.ndarray
    contacts: np.ndarray  # of their gaps
    signs: tuple[int, ...]  # of the contacts
    frictions: np.ndarray
    pressed: tuple[int, ...]  # the contact that each friction is in, or -1
    falling: tuple[bool, ...]  # whether each friction falls with the speed
    surfaces: np.ndarray
    pendulum: bool  # whether the last coordinate is the angle of a pendulum on the first
    moving: bool  # whether the first contact's wall moves
    law: type  # of impacts

    @property
    def numbers(self) -> dict[str, int]:
        """How many numbers of each kind its models have."""
        n, s = self.count, len(self.springs)
        sizes = {
            "m": n,
            "a": n,
            "k": s,
            "rest": s,
            "c": s,
            "load": n,
            "p": len(self.contacts),
            "mu": len(self.frictions),
        }
        sizes |= {"more": len(self.frictions), "w": len(self.frictions), "N": len(self.frictions)}
        sizes |= {
            "fall": len(self.frictions),
            "at": len(self.surfaces),
            "hard": len(self.surfaces),
            "soft": len(self.surfaces),
        }
        return sizes | {"kappa": len(self.electric), "leak": len(self.electric)}


def drawn_layout(random: np.random.Generator) -> Layout:
    """A random structure whose contacts, frictions and surfaces are independent."""
    n = int(random.integers(1, 9))
    local = random.permutation(n)[: random.integers(1, min(n, 6) + 1)]

    def row(place):
        found = np.eye(n)[place]
        others = [i for i in range(n) if i not in local]
        if others and random.uniform() < 0.5:
            found[random.choice(others)] = random.choice([-1.0, 1.0, -0.7])
        return found

    rows = [row(place) for place in local]
    kinds = random.choice(["contact", "friction", "surface"], size=len(rows), p=[0.5, 0.3, 0.2])
    of = {
        kind: np.array([r for r, k in zip(rows, kinds, strict=True) if k == kind]).reshape(-1, n)
        for kind in sorted({*kinds})
    }
    none = np.zeros((0, n))
    contacts, frictions, surfaces = (
        of.get(kind, none) for kind in ("contact", "friction", "surface")
    )
    pressed = [-1] * len(frictions)
    for i, k in enumerate(random.permutation(len(contacts))[: len(frictions)]):
        pressed[i] = int(k) if random.uniform() < 0.7 else -1
    springs = [np.eye(n)[i] for i in range(n)] + [
        np.eye(n)[i + 1] - np.eye(n)[i] for i in range(n - 1)
    ]
    electric = tuple(int(i) for i in random.permutation(n)[: random.integers(0, 3)])
    pendulum = n > 1 and random.uniform() < 0.3
    moving = bool(len(contacts)) and not pendulum and random.uniform() < 0.3
    falling, signs = (
        random.uniform(size=len(frictions)) < 0.4,
        random.choice([1, -1], size=len(contacts)),
    )
    law = (
        random.choice([saltus.NewtonImpact, saltus.PoissonImpact])
        if max(pressed, default=-1) >= 0
        else saltus.NewtonImpact
    )
    found = {
        "electric": electric,
        "springs": np.array(springs),
        "pendulum": pendulum,
        "moving": moving,
        "law": law,
    }
    found |= {
        "contacts": signs[:, None] * contacts,
        "signs": tuple(signs.tolist()),
        "surfaces": surfaces,
    }
    return Layout(
        n, frictions=frictions, pressed=tuple(pressed), falling=tuple(falling.tolist()), **found
    )


def model_of(layout: Layout):
    """The class of a structure's models, whose numbers are its fields."""
    n, moves, states = (
        layout.count,
        [f"x{i}" for i in range(layout.count)],
        [f"u{i}" for i in range(len(layout.electric))],
    )

    def terms(row, *more):
        return {name: float(a) for name, a in zip(moves, row, strict=True) if a} | dict(more)

    def several(self, kind):
        return [getattr(self, f"{kind}{i}") for i in range(layout.numbers[kind])]

    def contacts(self):
        given = zip(layout.contacts, layout.signs, several(self, "p"), strict=True)
        return tuple(
            saltus.Contact(
                name=f"c{i}", sign=s, position=s * at,
                coordinate=terms(s * row, *([("ground", -1.0 * s)] if layout.moving and i == 0 else [])),
            )
            for i, (row, s, at) in enumerate(given)
        )  # fmt: skip

    def frictions(self):
        given = zip(*(several(self, kind) for kind in ("mu", "more", "w", "fall")), strict=True)
        return tuple(
            saltus.Friction(
                name=f"f{i}", coordinate=terms(layout.frictions[i]), kinetic=mu, static=mu + more, ground_speed=w,
                contact=f"c{layout.pressed[i]}" if layout.pressed[i] >= 0 else None,
                stribeck_speed=fall if layout.falling[i] else None,
            )
            for i, (mu, more, w, fall) in enumerate(given)
        )  # fmt: skip

    def surfaces(self):
        given = zip(layout.surfaces, several(self, "at"), strict=True)
        return tuple(
            saltus.Surface(name=f"s{i}", coordinate=terms(row), position=at)
            for i, (row, at) in enumerate(given)
        )

    def mass_matrix(self, q):
        m, a = several(self, "m"), several(self, "a")
        rows = [[m[i] * (i == j) + a[i] * a[j] for j in range(n)] for i in range(n)]
        if layout.pendulum:
            rows[0][n - 1] = rows[n - 1][0] = rows[0][n - 1] + 0.3 * np.cos(q[n - 1])
        full = [[*row, *[0.0] * len(states)] for row in rows] + [
            [0.0] * (n + len(states)) for _ in states
        ]
        for i in range(n, n + len(states)):
            full[i][i] = 1.0
        return full if n + len(states) > 1 else full[0][0]

    def force(self, t, q, v, load, *sides):
        q, v = (list(x) if n + len(states) > 1 else [x] for x in (q, v))
        found = [a * load.force(t) for a in several(self, "load")]
        parts = zip(
            layout.springs,
            several(self, "k"),
            several(self, "rest"),
            several(self, "c"),
            strict=True,
        )
        for row, k, rest, c in parts:
            pull = k * (sum(a * x for a, x in zip(row, q, strict=False) if a) - rest)
            pull = pull + c * sum(a * x for a, x in zip(row, v, strict=False) if a)
            found = [f - a * pull if a else f for f, a in zip(found, row, strict=True)]
        given = zip(
            layout.surfaces, *(several(self, kind) for kind in ("at", "hard", "soft")), strict=True
        )
        for i, (row, at, hard, soft) in enumerate(given):
            pull = hard * (sum(a * x for a, x in zip(row, q, strict=False) if a) - at)
            pull = pull + soft * sum(a * x for a, x in zip(row, v, strict=False) if a)
            pull = (1.0 + sides[0][f"s{i}"]) / 2.0 * pull
            found = [f - a * pull if a else f for f, a in zip(found, row, strict=True)]
        if layout.pendulum:
            found[0] = found[0] + 0.3 * np.sin(q[n - 1]) * v[n - 1] ** 2
        rates = []
        for place, kappa, leak, u in zip(
            layout.electric, several(self, "kappa"), several(self, "leak"), q[n:], strict=True
        ):
            found[place] = found[place] - kappa * u
            rates.append(kappa * v[place] - leak * u)
        return (*found, *rates) if n + len(states) > 1 else found[0]

    space = {
        "coordinates": (*moves, *states),
        "first_order": tuple(states),
        "channels": ("force", "ground"),
        "contacts": property(contacts),
        "frictions": property(frictions),
        "surfaces": property(surfaces),
        "mass_matrix": mass_matrix,
        "force": force,
        "normal_forces": lambda self, t, q, v, load: tuple(
            N + 0.2 * (q[0] if n + len(states) > 1 else q) ** 2 for N in several(self, "N")
        ),
    }
    fields = [
        (f"{kind}{i}", float, dataclasses.field(default=1.0))
        for kind, size in layout.numbers.items()
        for i in range(size)
    ]
    return dataclasses.make_dataclass(
        "Random", fields, bases=(saltus.ContactModel,), namespace=space, frozen=True, kw_only=True
    )


RANGES = {
    "m": (0.5, 2.0), "a": (-0.5, 0.5), "k": (0.2, 2.0), "rest": (-1.0, 1.0), "c": (0.0, 0.2), "load": (-1.0, 1.0),
    "p": (-0.6, 0.0), "mu": (0.1, 0.5), "more": (0.0, 0.2), "w": (-0.3, 0.3), "N": (0.2, 1.0), "at": (-0.5, 0.5),
    "hard": (1.0, 10.0), "soft": (0.0, 1.0),
    "fall": (0.1, 0.5), "kappa": (0.1, 0.6), "leak": (0.2, 2.0),
}  # fmt: skip


class Drawn:
    """A system with random numbers and a start, and its matrices in NumPy."""

    def __init__(self, layout: Layout, cls, random: np.random.Generator) -> None:
        self.layout = layout
        self.given = {
            kind: random.uniform(*RANGES[kind], size) for kind, size in layout.numbers.items()
        }
        self.given["w"] *= random.integers(0, 2, size=self.given["w"].size)
        model = cls(
            **{
                f"{kind}{i}": float(x)
                for kind, values in self.given.items()
                for i, x in enumerate(values)
            }
        )
        ground = saltus.Harmonic(0.2, phase=0.3) if layout.moving else 0.0
        load = saltus.Load(
            frequency=float(random.uniform(0.5, 2.0)), force=saltus.Harmonic(1.0), ground=ground
        )
        self.e = random.uniform(0.0, 0.9, len(layout.contacts))
        e = tuple(self.e.tolist()) if len(self.e) > 1 else self.e.sum()
        given = {"impact": layout.law(e=e)} if len(self.e) else {}
        self.system = saltus.System(model=model, load=load, **given)
        q = random.uniform(-0.5, 0.5, layout.count)
        # in any order: each row has a coordinate of its own
        for row, at in zip(layout.contacts, self.given["p"], strict=True):
            place = next(
                i for i in np.flatnonzero(row) if np.count_nonzero(layout.contacts[:, i]) == 1
            )
            q[place] += (max(at + 0.3 - row @ q, 0.0) + 0.1) / row[place]
        start = {f"x{i}": float(x) for i, x in enumerate(q)} | {
            f"u{i}": 0.2 for i in range(len(layout.electric))
        }
        velocity = tuple(random.normal(size=layout.count).tolist())
        self.start = start | {"velocity": velocity if layout.count > 1 else velocity[0]}

    def mass(self, q: np.ndarray) -> np.ndarray:
        """M, (n, n, times)."""
        n, a = self.layout.count, self.given["a"]
        found = np.repeat(
            (np.diag(self.given["m"]) + np.outer(a, a))[:, :, None], q.shape[1], axis=2
        )
        if self.layout.pendulum:
            found[0, n - 1] += 0.3 * np.cos(q[n - 1])
            found[n - 1, 0] = found[0, n - 1]
        return found

    def stretch(self, q: np.ndarray) -> np.ndarray:
        return self.layout.springs @ q - self.given["rest"][:, None]

    def beyond(self, q: np.ndarray) -> np.ndarray:
        return np.maximum(self.layout.surfaces @ q - self.given["at"][:, None], 0.0)

    def pressed_speed(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.where(self.beyond(q) > 0.0, self.layout.surfaces @ v, 0.0)

    def energy(self, q: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What is stored in masses, springs and capacitors."""
        kinetic = np.einsum("it,ijt,jt->t", v, self.mass(q), v) / 2
        springs = self.given["k"] @ self.stretch(q) ** 2 + self.given["hard"] @ self.beyond(q) ** 2
        return kinetic + (springs + (u**2).sum(axis=0)) / 2

    def forces(self, t: np.ndarray, q: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """r without reactions and frictions."""
        given, n, springs = self.given, self.layout.count, self.layout.springs
        found = np.outer(given["load"], self.system.load.force(t))
        found -= springs.T @ (
            given["k"][:, None] * self.stretch(q) + given["c"][:, None] * (springs @ v)
        )
        found -= self.layout.surfaces.T @ (
            given["hard"][:, None] * self.beyond(q)
            + given["soft"][:, None] * self.pressed_speed(q, v)
        )
        for place, kappa, volt in zip(self.layout.electric, given["kappa"], u, strict=True):
            found[place] -= kappa * volt
        if self.layout.pendulum:
            found[0] += 0.3 * np.sin(q[n - 1]) * v[n - 1] ** 2
        return found

    def supplied(self, t: np.ndarray, q: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """The power of the load less what dampers and resistances take."""
        load = (self.given["load"] @ v) * self.system.load.force(t)
        dampers = (
            self.given["c"] @ (self.layout.springs @ v) ** 2
            + self.given["soft"] @ self.pressed_speed(q, v) ** 2
        )
        return load - dampers - self.given["leak"] @ u**2


SOME = (2, 21, 43, 54, 58)  # in which everything occurs
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


def sampled(motion):
    """Times, weights, coordinates, velocities, accelerations at Gauss's points of all steps, in the
    own coordinates.
    """
    dense, load = motion.dense, motion.system.load
    half, order = dense.length / 2, dense.series.shape[2]
    times = ((dense.start + half)[:, None] + half[:, None] * NODES).ravel()
    tau = ((half[:, None] * (1 + NODES)).ravel()[:, None] ** np.arange(order))[:, None, :]
    series, powers, found = np.repeat(dense.series, NODES.size, axis=0), np.arange(order), []
    # each step by its own series, as steps between impacts that accumulate are shorter than
    # rounding
    for _ in range(3):
        found.append((series * tau[:, :, : series.shape[2]]).sum(axis=2).T)
        series = (series * powers[: series.shape[2]])[:, :, 1:]
    inner = motion.system.in_gap_coordinates
    if inner is not motion.system:
        rows = np.array(inner.model.gap_sums()[0])
        shifts = [
            [np.broadcast_to(m, times.shape) for m in inner.model.walls_at(times, load, rate)]
            for rate in range(3)
        ]
        found = [np.linalg.solve(rows, z - np.array(m)) for z, m in zip(found, shifts, strict=True)]
    return times, (half[:, None] * WEIGHTS).ravel(), *found


@dataclasses.dataclass(frozen=True)
class Impacts:
    """The impacts of a motion: what contacts and frictions push at each, and the mean of the
    velocities before and after.
    """

    pushes: np.ndarray  # (contacts and frictions, impacts)
    middle: np.ndarray  # (coordinates, impacts)


def checked_impacts(drawn: Drawn, motion, rows: np.ndarray) -> Impacts:
    """M (v+ - v-) = S' J + T' P with Moreau's law: 0 <= J _|_ S v+ + e S v- >= 0, and P rubs as J
    presses.
    """
    layout, count, kinds = drawn.layout, len(drawn.layout.contacts), ("impact", "held")
    events = [event for event in motion.events if str(event.kind) in kinds]
    pushes, middle = np.zeros((len(rows), len(events))), np.zeros((layout.count, len(events)))
    for k, event in enumerate(events):
        before, after = (
            np.ravel(x)[: layout.count] for x in (event.velocity_before, event.velocity_after)
        )
        q = np.atleast_1d(motion.at(event.time)[0])[: layout.count, None]
        jump, size = drawn.mass(q)[:, :, 0] @ (after - before), 1.0 + np.abs(before).max()
        pushes[:, k], middle[:, k] = (
            np.linalg.lstsq(rows.T, jump, rcond=None)[0],
            (before + after) / 2,
        )
        assert np.abs(jump - rows.T @ pushes[:, k]).max() < 1e-12 * size, (
            "an impulse besides those of what touches"
        )
        J, P = pushes[:count, k], pushes[count:, k]
        if (
            str(event.kind) == "held"
        ):  # takes the last speed of impacts that were not followed, of which a reaction pushes as much
            assert np.abs(J).max() < 1e-3 * size, (
                "impacts that are not followed although they are fast"
            )
            continue
        assert J.min(initial=0.0) > -1e-12 * size, "an impulse that pulls"
        np.testing.assert_allclose(J, np.ravel(event.impulse), rtol=0, atol=1e-12 * size)
        wall = np.zeros((2, count))
        if layout.moving:
            wall[:, 0] = (
                motion.system.load.ground(event.time),
                motion.system.load.ground.velocity(event.time),
            )
        near, falls = (
            layout.contacts @ q[:, 0] - wall[0] - drawn.given["p"] < 1e-9,
            layout.contacts @ before - wall[1],
        )
        struck = [
            event.contact == "both" or f"c{i}" in event.contact.split("+") for i in range(count)
        ]
        touch = near & ((np.abs(falls) < 1e-13 * size) | struck)
        kept = layout.contacts @ after - wall[1] + drawn.e * falls
        two_phases = layout.law is saltus.PoissonImpact and max(layout.pressed, default=-1) >= 0
        if not two_phases:
            assert (kept[touch] > -1e-11 * size).all(), "slower than the restitution"
            assert np.abs(J * kept).max() < 1e-11 * size, "an impulse on what leaves faster"
        assert np.abs(J[~touch]).max(initial=0.0) < 1e-12 * size, "an impulse from afar"
        for i, pressed in enumerate(layout.pressed):
            most = drawn.given["mu"][i] * J[pressed] if pressed >= 0 else 0.0
            slip = layout.frictions[i] @ after - drawn.given["w"][i]
            assert abs(P[i]) < most + 1e-11 * size, "a friction beyond its cone"
            cone = abs(slip) < 1e-11 * size or abs(P[i] + np.sign(slip) * most) < 1e-11 * size
            assert cone or two_phases, "a friction that helps"
    return Impacts(pushes, middle)


def check_balances(drawn: Drawn, duration: float) -> list[str]:
    """Follow a motion and compare it with all that it must keep; returns the kinds of its
    events.
    """
    layout, system, given = drawn.layout, drawn.system, drawn.given
    motion = saltus.simulate(system, **drawn.start, duration=duration)
    n, rows, count = (
        layout.count,
        np.vstack([layout.contacts, layout.frictions]),
        len(layout.contacts),
    )
    t, weight, q, v, a = sampled(motion)
    u, (q, v, a) = q[n:], (x[:n] for x in (q, v, a))
    mass, force = drawn.mass(q), drawn.forces(t, q, u, v)
    left = np.einsum("ijt,jt->it", mass, a) - force
    size = 1.0 + np.abs(force).max() + np.abs(left).max()
    acting = np.linalg.lstsq(rows.T, left, rcond=None)[0] if len(rows) else np.zeros((0, t.size))
    assert np.abs(left - rows.T @ acting).max() < 1e-7 * size, (
        "forces besides those of what touches and rubs"
    )
    wall = np.zeros((count, t.size))
    if layout.moving:
        wall[0] = system.load.ground(t)
    gaps, pressure = layout.contacts @ q - wall - given["p"][:, None], acting[:count]
    assert gaps.min(initial=0.0) > -1e-12 * (1.0 + np.abs(q).max()), "penetration"
    assert pressure.min(initial=0.0) > -1e-7 * size, "a contact that pulls"
    assert np.abs(pressure[gaps > 1e-9]).max(initial=0.0) < 1e-7 * size, (
        "a contact that pushes from afar"
    )
    slip, rub = layout.frictions @ v - given["w"][:, None], acting[count:]
    known = given["N"][:, None] + 0.2 * q[0] ** 2
    normal = np.array(
        [known[i] if k < 0 else pressure[k] for i, k in enumerate(layout.pressed)]
    ).reshape(slip.shape)
    rise = np.exp(-np.abs(slip) / given["fall"][:, None]) * np.array(layout.falling)[:, None]
    mu = given["mu"][:, None] + given["more"][:, None] * rise
    assert (np.abs(rub) < (given["mu"] + given["more"])[:, None] * normal + 1e-7 * size).all(), (
        "more than static friction"
    )
    law = np.where(np.abs(slip) > 1e-9, -np.sign(slip) * mu * normal, rub)
    assert np.abs(rub - law).max(initial=0.0) < 1e-7 * size, "a friction off Coulomb's law"
    impacts = checked_impacts(drawn, motion, rows)
    ends = [
        np.reshape(x, (len(system.model.coordinates), -1))
        for x in motion.at(np.array([motion.start, motion.time]))
    ]
    (q1, u1), v1 = (ends[0][:n], ends[0][n:]), ends[1][:n]
    momentum = np.einsum("ijt,jt->it", drawn.mass(q1), v1)
    turned = force.copy()
    if layout.pendulum:
        turned[[0, n - 1]] -= 0.3 * np.sin(q[n - 1]) * v[n - 1] * v[[n - 1, 0]]
    pushed = (turned + rows.T @ acting) @ weight + (rows.T @ impacts.pushes).sum(axis=1)
    power = drawn.supplied(t, q, u, v) + (acting * (rows @ v)).sum(axis=0)
    work = power @ weight + (impacts.pushes * (rows @ impacts.middle)).sum()
    stored = drawn.energy(q1, u1, v1)
    if not layout.moving:
        assert abs(saltus.energies(motion).defect) < 1e-11 * size**2
    assert np.abs(momentum[:, 1] - momentum[:, 0] - pushed).max() < 1e-12 * size * (
        1.0 + motion.time
    ), "momentum"
    assert abs(stored[1] - stored[0] - work) < 1e-12 * size**2 * (1.0 + motion.time), "energy"
    return [str(event.kind) for event in motion.events]


def structures(seeds):
    """Random structures, the classes of their models, and generators for their numbers."""
    for seed in seeds:
        random = np.random.default_rng(seed)
        layout = drawn_layout(random)
        yield layout, model_of(layout), random


def test_random_models_keep_their_balances_and_laws():
    kinds = [
        kind
        for layout, cls, random in structures(SOME)
        for _ in range(2)
        for kind in check_balances(Drawn(layout, cls, random), 13.0)
    ]
    assert {"impact", "held", "release", "stick", "slip", "reversal", "crossing"} <= set(kinds)


@pytest.mark.thorough
def test_ten_thousand_random_models_keep_their_balances_and_laws():
    impacts = 0
    for layout, cls, random in structures(range(100, 140)):
        for _ in range(250):
            impacts += check_balances(Drawn(layout, cls, random), 13.0).count("impact")
    assert impacts > 100_000
