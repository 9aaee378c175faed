"""Random systems that can be written down anew where nothing must change.

A `Recipe` holds all numbers of a system and of a motion, each with its physical dimension. Its
methods give the same motion in other units, from another origin, with parts that have no effect, in
another order, mirrored, a whole number of periods later, or with all numbers rounded. A recipe
remembers how its coordinates follow from those of the recipe that it was made of, so that `answer`
(in `answers.py`) reads all motions in the terms of the first.

    M q'' + C q' + K (q - q0) + k3 (q - q0)^3 = g + loads + the forces of surfaces + reactions + frictions

with surfaces on whose side +1 the force -k (q - p) - c q' acts, and lags a z' = (sum of q) - z.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

import saltus
from saltus import Contact, Friction, NewtonImpact, Surface

INERT = "inert"  # begins the names of parts without effect


@dataclass(frozen=True)
class RandomContact:
    """A contact of a row of coefficients, sign (row q - position) >= 0."""

    name: str
    row: tuple[float, ...]
    sign: int
    position: float
    restitution: float


@dataclass(frozen=True)
class RandomFriction:
    """A friction along one coordinate: of a normal force, or in a contact."""

    name: str
    place: int
    kinetic: float
    static: float
    ground_speed: float
    normal: float
    contact: str | None = None


@dataclass(frozen=True)
class RandomSurface:
    """A surface of one coordinate, with the force on its side +1."""

    name: str
    place: int
    sign: int
    position: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class RandomLoad:
    """A load on one coordinate; of a record `times` and `values` are the samples in units of `span`
    and `amplitude`.
    """

    place: int
    kind: str  # "harmonic", "ramp", "half sine", "record"
    amplitude: float
    phase: float = 0.0
    start: float = 0.0
    span: float = 1.0
    times: tuple[float, ...] = ()
    values: tuple[float, ...] = ()


@dataclass(frozen=True)
class RandomLag:
    """A coordinate z of first order, span z' = (row q) - z, that pushes with stiffness z."""

    span: float
    row: tuple[float, ...]
    push: tuple[float, ...]


@dataclass(frozen=True)
class View:
    """How coordinates of the first recipe follow from those of this one, and which units it has."""

    length: float = 1.0
    time: float = 1.0
    mass: float = 1.0
    origin: tuple[float, ...] = ()  # in units of the first recipe
    places: tuple[int, ...] = ()  # of the first recipe's coordinates among those of this one
    mirror: int = 1
    begin: float = 0.0  # the time of the start, in units of the first recipe


@dataclass(frozen=True)
class Recipe:
    """A system and a motion of it, in numbers."""

    name: str
    kind: str  # "own", "structure", "wall" or "passing"
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    cubic: np.ndarray
    neutral: np.ndarray
    constant: np.ndarray
    loads: tuple[RandomLoad, ...]
    frequency: float | None
    position: np.ndarray
    velocity: np.ndarray
    duration: float
    contacts: tuple[RandomContact, ...] = ()
    frictions: tuple[RandomFriction, ...] = ()
    surfaces: tuple[RandomSurface, ...] = ()
    lag: RandomLag | None = None
    lag_start: float = 0.0
    bias: float = 0.0  # of a motion that passes its contact
    view: View = View()

    @property
    def size(self) -> int:
        """The number of coordinates, without the lag."""
        return len(self.mass)

    @property
    def has_inert_coordinate(self) -> bool:
        """Whether a coordinate without effect was added."""
        return -1 in self._old_places()

    # --- the same in other words ---------------------------------------------

    def in_units(self, length: float = 1.0, time: float = 1.0, mass: float = 1.0) -> Recipe:
        """The same with numbers that are `length` times as large for lengths, and so on."""
        force = mass * length / time**2
        stiffness = mass / time**2
        return replace(
            self,
            name=f"{self.name} in units (length {length:g}, time {time:g}, mass {mass:g})",
            mass=self.mass * mass,
            damping=self.damping * mass / time,
            stiffness=self.stiffness * stiffness,
            cubic=self.cubic * stiffness / length**2,
            neutral=self.neutral * length,
            constant=self.constant * force,
            loads=tuple(
                replace(
                    load,
                    amplitude=load.amplitude * force,
                    start=load.start * time,
                    span=load.span * time,
                )
                for load in self.loads
            ),
            frequency=None if self.frequency is None else self.frequency / time,
            position=self.position * length,
            velocity=self.velocity * length / time,
            duration=self.duration * time,
            contacts=tuple(replace(c, position=c.position * length) for c in self.contacts),
            frictions=tuple(
                replace(
                    f,
                    ground_speed=f.ground_speed * length / time,
                    normal=f.normal * force,
                )
                for f in self.frictions
            ),
            surfaces=tuple(
                replace(
                    s,
                    position=s.position * length,
                    stiffness=s.stiffness * stiffness,
                    damping=s.damping * mass / time,
                )
                for s in self.surfaces
            ),
            lag=(
                None
                if self.lag is None
                else replace(
                    self.lag,
                    span=self.lag.span * time,
                    push=tuple(k * stiffness for k in self.lag.push),
                )
            ),
            lag_start=self.lag_start * length,
            bias=self.bias * force,
            view=replace(
                self.view,
                length=self.view.length * length,
                time=self.view.time * time,
                mass=self.view.mass * mass,
            ),
        )

    def from_origin(self, origin: Any) -> Recipe:
        """The same with coordinates q + origin."""
        d = np.broadcast_to(np.asarray(origin, dtype=float), (self.size,)).copy()
        moved = dict(self._origin())
        for new, old in enumerate(self._old_places()):
            if old >= 0:
                moved[old] = moved.get(old, 0.0) + d[new] / self.view.length * self.view.mirror
        lag = self.lag
        return replace(
            self,
            name=f"{self.name} from another origin",
            neutral=self.neutral + d,
            position=self.position + d,
            contacts=tuple(
                replace(c, position=c.position + float(np.dot(c.row, d))) for c in self.contacts
            ),
            surfaces=tuple(replace(s, position=s.position + d[s.place]) for s in self.surfaces),
            constant=self.constant
            + (0.0 if lag is None else -np.asarray(lag.push) * float(np.dot(lag.row, d))),
            lag_start=self.lag_start + (0.0 if lag is None else float(np.dot(lag.row, d))),
            view=replace(
                self.view, origin=tuple(moved.get(i, 0.0) for i in range(len(self._places())))
            ),
        )

    def mirrored(self) -> Recipe:
        """The same with coordinates -q."""
        return replace(
            self,
            name=f"{self.name} mirrored",
            neutral=-self.neutral,
            constant=-self.constant,
            position=-self.position,
            velocity=-self.velocity,
            loads=tuple(replace(load, amplitude=-load.amplitude) for load in self.loads),
            contacts=tuple(replace(c, sign=-c.sign, position=-c.position) for c in self.contacts),
            frictions=tuple(replace(f, ground_speed=-f.ground_speed) for f in self.frictions),
            surfaces=tuple(replace(s, sign=-s.sign, position=-s.position) for s in self.surfaces),
            lag_start=-self.lag_start,
            view=replace(self.view, mirror=-self.view.mirror),
        )

    def in_order(self, rng: np.random.Generator) -> Recipe:
        """The same with coordinates, contacts, frictions and surfaces in a random order."""
        order = rng.permutation(self.size)
        new_place = np.argsort(order)
        lag = self.lag

        def shuffled(parts: tuple[Any, ...], keep: Callable[[Any], Any]) -> tuple[Any, ...]:
            return tuple(keep(parts[i]) for i in rng.permutation(len(parts)))

        def row(numbers: tuple[float, ...]) -> tuple[float, ...]:
            return tuple(numbers[i] for i in order)

        return replace(
            self,
            name=f"{self.name} in another order",
            mass=self.mass[np.ix_(order, order)],
            damping=self.damping[np.ix_(order, order)],
            stiffness=self.stiffness[np.ix_(order, order)],
            cubic=self.cubic[order],
            neutral=self.neutral[order],
            constant=self.constant[order],
            position=self.position[order],
            velocity=self.velocity[order],
            loads=shuffled(self.loads, lambda p: replace(p, place=int(new_place[p.place]))),
            contacts=shuffled(self.contacts, lambda p: replace(p, row=row(p.row))),
            frictions=shuffled(self.frictions, lambda p: replace(p, place=int(new_place[p.place]))),
            surfaces=shuffled(self.surfaces, lambda p: replace(p, place=int(new_place[p.place]))),
            lag=None if lag is None else replace(lag, row=row(lag.row), push=row(lag.push)),
            view=replace(self.view, places=tuple(int(new_place[i]) for i in self._places())),
        )

    def later(self, periods: int) -> Recipe:
        """The same, begun a number of forcing periods later."""
        if self.frequency is None:
            raise ValueError("a system without a frequency has no periods")
        begin = self.view.begin + periods * 2.0 * np.pi / self.frequency / self.view.time
        return replace(
            self, name=f"{self.name} {periods} periods later", view=replace(self.view, begin=begin)
        )

    def rounded(self, rng: np.random.Generator, size: float = 1e-13) -> Recipe:
        """The same with every number times 1 +- size."""

        def near(value: Any) -> Any:
            if isinstance(value, np.ndarray):
                return value * (1.0 + size * rng.choice([-1.0, 1.0], value.shape))
            if isinstance(value, float):
                return value * (1.0 + size * float(rng.choice([-1.0, 1.0])))
            if isinstance(value, tuple):
                return tuple(near(each) for each in value)
            if isinstance(value, View) or not dataclasses.is_dataclass(value):
                return value
            kept = ("row", "times")
            changes = {
                f.name: near(getattr(value, f.name))
                for f in dataclasses.fields(value)
                if f.name not in kept
            }
            return replace(value, **changes)

        changed = near(self)
        # a friction whose limits are equal keeps them equal, and matrices stay symmetric
        frictions = tuple(
            replace(new, static=new.kinetic) if old.static == old.kinetic else new
            for new, old in zip(changed.frictions, self.frictions, strict=True)
        )
        upper = {
            name: np.triu(getattr(changed, name)) + np.triu(getattr(changed, name), 1).T
            for name in ("mass", "damping", "stiffness")
        }
        # what is at a contact or in equilibrium at the start stays there
        return replace(
            changed,
            name=f"{self.name} rounded",
            position=self.position,
            neutral=self.neutral,
            contacts=tuple(
                replace(new, position=old.position)
                for new, old in zip(changed.contacts, self.contacts, strict=True)
            ),
            surfaces=tuple(
                replace(new, position=old.position)
                for new, old in zip(changed.surfaces, self.surfaces, strict=True)
            ),
            frictions=frictions,
            **upper,
        )

    def with_inert(self, part: str, place: int = 0) -> Recipe:
        """The same with a part that has no effect: one of `inert_parts`."""
        name = f"{self.name} with an inert {part}"
        if part == "friction":
            rub = RandomFriction(f"{INERT}_rub", self._unrubbed()[place], 0.0, 0.0, 0.0, 1.0)
            return replace(self, name=name, frictions=(*self.frictions, rub))
        if part == "surface":
            level = float(self.position[place] + 0.1 * self.view.length * self.view.mirror)
            pass_by = RandomSurface(f"{INERT}_surface", place, 1, level, 0.0, 0.0)
            return replace(self, name=name, surfaces=(*self.surfaces, pass_by))
        if part == "contact":
            place, sign = self._room_for_contact()
            far = RandomContact(
                f"{INERT}_contact",
                tuple(float(i == place) for i in range(self.size)),
                sign,
                float(self.position[place]) - sign * 1e3 * self.view.length,
                0.5,
            )
            return replace(self, name=name, contacts=(*self.contacts, far))
        if part != "coordinate":
            raise ValueError(part)

        def wider(matrix: np.ndarray, corner: float) -> np.ndarray:
            wide = np.zeros((self.size + 1, self.size + 1))
            wide[:-1, :-1] = matrix
            wide[-1, -1] = corner
            return wide

        v = self.view
        more = lambda row: (*row, 0.0)  # noqa: E731
        return replace(
            self,
            name=name,
            mass=wider(self.mass, v.mass),
            damping=wider(self.damping, 0.1 * v.mass / v.time),
            stiffness=wider(self.stiffness, 1.7 * v.mass / v.time**2),
            cubic=np.append(self.cubic, 0.0),
            neutral=np.append(self.neutral, 0.0),
            constant=np.append(self.constant, 0.0),
            position=np.append(self.position, 0.3 * v.length),
            velocity=np.append(self.velocity, 0.2 * v.length / v.time),
            contacts=tuple(replace(c, row=more(c.row)) for c in self.contacts),
            lag=(
                None
                if self.lag is None
                else replace(self.lag, row=more(self.lag.row), push=more(self.lag.push))
            ),
            view=replace(v, places=self._places()),
        )

    @property
    def inert_parts(self) -> tuple[str, ...]:
        """The parts without effect that `with_inert` can add."""
        if self.kind not in ("own", "structure"):
            return ()
        found = ["surface"]
        if self.kind == "own":
            found += ["coordinate"]
            found += ["friction"] if self._unrubbed() else []
        return (*found, "contact") if self._room_for_contact() else tuple(found)

    def _unrubbed(self) -> list[int]:
        """The coordinates along which a further friction may act: no friction acts along them yet,
        no contact in which there is one, and contacts keep no sums.
        """
        rows = {c.name: c.row for c in self.contacts}
        taken = {f.place for f in self.frictions}
        for friction in self.frictions:
            if friction.contact is not None:
                taken |= {i for i, x in enumerate(rows[friction.contact]) if x}
        has_sums = any(np.count_nonzero(row) > 1 for row in rows.values())
        return [] if has_sums else [i for i in range(self.size) if i not in taken]

    def _room_for_contact(self) -> Any:
        """A coordinate and a sign that a further contact may have; None if there is none."""
        taken = {(i, c.sign * np.sign(c.row[i])) for c in self.contacts for i in range(self.size)}
        free = [(i, s) for i in range(self.size) for s in (1, -1) if (i, s) not in taken]
        return free[0] if free else None

    def _places(self) -> tuple[int, ...]:
        """The places of the first recipe's coordinates among those of this one."""
        return self.view.places or tuple(range(self.size))

    def _old_places(self) -> list[int]:
        """For each coordinate its place in the first recipe, -1 for one that was added."""
        places = list(self._places())
        return [places.index(i) if i in places else -1 for i in range(self.size)]

    def _origin(self) -> list[tuple[int, float]]:
        return list(enumerate(self.view.origin))

    # --- as a system of saltus -----------------------------------------------

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the coordinates, without the lag."""
        named = {new: f"q{old}" for old, new in enumerate(self._places())}
        return tuple(named.get(i, f"{INERT}_q{i}") for i in range(self.size))

    def system(self) -> saltus.System:
        """The system."""
        if self.kind in ("wall", "passing"):
            return self._one_contact()
        if self.kind == "structure":
            return self._structure()
        return self._own()

    def arguments(self) -> dict[str, Any]:
        """The state at the start, the duration and the time, as `simulate` takes them."""
        span = {"duration": self.duration, "time": self.view.begin * self.view.time}
        if self.kind == "structure":
            model: Any = self.system().model
            return {**model.start(self.position, self.velocity), **span}
        start = dict(zip(self.coordinates, self.position.tolist(), strict=True))
        rates = self.velocity.tolist()
        if self.lag is not None:
            start |= {"lag": self.lag_start}
            rates = [*rates, 0.0]
        return {**start, "velocity": tuple(rates) if len(rates) > 1 else rates[0], **span}

    def _signals(self) -> dict[str, list[Any]]:
        """The signals on each coordinate, by their channels."""
        found: dict[str, list[Any]] = {}
        for load in self.loads:
            signal: Any
            if load.kind == "harmonic":
                signal = saltus.Harmonic(amplitude=load.amplitude, phase=load.phase)
            elif load.kind == "ramp":
                signal = saltus.Ramp(amplitude=load.amplitude, duration=load.span, start=load.start)
            elif load.kind == "half sine":
                signal = saltus.HalfSine(
                    amplitude=load.amplitude, frequency=np.pi / load.span, start=load.start
                )
            else:
                signal = saltus.Record(
                    time=load.start + load.span * np.array(load.times),
                    value=load.amplitude * np.array(load.values),
                )
            found.setdefault(f"on_{self.coordinates[load.place]}", []).append(signal)
        return found

    def _load(self) -> saltus.Load:
        signals = {
            name: parts[0] if len(parts) == 1 else parts for name, parts in self._signals().items()
        }
        return saltus.Load(frequency=self.frequency, **signals)

    def _one_contact(self) -> saltus.System:
        wall = self.contacts[0]
        model_class = (Wall if wall.sign < 0 else Floor) if self.kind == "wall" else Passing
        model = model_class(
            mass=float(self.mass[0, 0]),
            damping=float(self.damping[0, 0]),
            stiffness=float(self.stiffness[0, 0]),
            cubic=float(self.cubic[0]),
            neutral=float(self.neutral[0]),
            constant=float(self.constant[0]),
            edge=wall.position,
            bias=self.bias,
        )
        return saltus.System(
            model=model, load=self._load(), impact=saltus.VelocityReduction(wall.restitution)
        )

    def _own(self) -> saltus.System:
        lag = self.lag
        shape = (
            self.coordinates,
            tuple(self._signals()),
            tuple(map(tuple, (self.mass != 0.0).tolist())),
            bool(self.cubic.any()),
            tuple((c.name, c.row, c.sign) for c in self.contacts),
            tuple((f.name, f.place, f.contact) for f in self.frictions),
            tuple((s.name, s.place, s.sign) for s in self.surfaces),
            None if lag is None else lag.row,
        )
        n = range(self.size)
        values = {
            f"{name}_{i}_{j}": float(getattr(self, name)[i, j])
            for name in ("mass", "damping", "stiffness")
            for i in n
            for j in n
        }
        values |= {
            f"{name}_{i}": float(getattr(self, name)[i])
            for name in ("cubic", "neutral", "constant")
            for i in n
        }
        for c in self.contacts:
            values |= {f"{c.name}_position": c.position, f"{c.name}_restitution": c.restitution}
        for f in self.frictions:
            values |= {f"{f.name}_{x}": getattr(f, x) for x in FRICTION_NUMBERS}
        for s in self.surfaces:
            values |= {f"{s.name}_{x}": getattr(s, x) for x in SURFACE_NUMBERS}
        if lag is not None:
            values |= {"lag_span": lag.span}
            values |= {f"lag_push_{i}": lag.push[i] for i in n}
        model = own_class(shape)(**values)
        impact = NewtonImpact(e=0.5) if self.contacts else None
        return saltus.System(model=model, load=self._load(), impact=impact)

    def _structure(self) -> saltus.System:
        if self.cubic.any() or self.lag is not None:
            raise ValueError("a structure is linear")
        pushed = self.constant + self.stiffness @ self.neutral
        signals = self._signals()
        channels = {f"on_{name}": name for name in self.coordinates}
        load = {
            channel: [*signals.get(channel, []), float(pushed[i])]
            for i, channel in enumerate(channels)
        }
        rows = {
            c.name: c.row for c in self.contacts if sum(map(abs, c.row)) != 1.0 or max(c.row) != 1.0
        }
        points = {f"point_{name}": list(row) for name, row in rows.items()}

        def coordinate(c: RandomContact) -> str:
            return f"point_{c.name}" if c.name in rows else self.coordinates[c.row.index(1.0)]

        model = saltus.Structure(
            mass=self.mass,
            stiffness=self.stiffness,
            damping=self.damping,
            names=self.coordinates,
            points=points,
            forces=channels,
            contacts=[
                Contact(
                    name=c.name,
                    coordinate=coordinate(c),
                    sign=c.sign,
                    position=c.position,
                    restitution=c.restitution,
                )
                for c in self.contacts
            ],
            surfaces=[
                Surface(
                    name=s.name,
                    coordinate=self.coordinates[s.place],
                    sign=s.sign,
                    position=s.position,
                    stiffness=s.stiffness,
                    damping=s.damping,
                )
                for s in self.surfaces
            ],
            friction=[
                Friction(
                    name=f.name,
                    coordinate=self.coordinates[f.place],
                    kinetic=f.kinetic * f.normal,
                    static=f.static * f.normal,
                    ground_speed=f.ground_speed,
                )
                for f in self.frictions
            ],
        )
        return saltus.System(
            model=model,
            load=saltus.Load(frequency=self.frequency, **load),
            impact=NewtonImpact(e=0.5),
        )


# --- models ------------------------------------------------------------------

FRICTION_NUMBERS = ("kinetic", "static", "ground_speed", "normal")
SURFACE_NUMBERS = ("position", "stiffness", "damping")


@cache
def own_class(shape: Any) -> Any:
    """A class of models of a shape, whose fields are its numbers."""
    names, channels, masses, has_cubic, contacts, frictions, surfaces, lag_row = shape
    n = range(len(names))
    fields = [f"{name}_{i}_{j}" for name in ("mass", "damping", "stiffness") for i in n for j in n]
    fields += [f"{name}_{i}" for name in ("cubic", "neutral", "constant") for i in n]
    fields += [f"{c[0]}_{x}" for c in contacts for x in ("position", "restitution")]
    fields += [f"{f[0]}_{x}" for f in frictions for x in FRICTION_NUMBERS]
    fields += [f"{s[0]}_{x}" for s in surfaces for x in SURFACE_NUMBERS]
    has_lag = lag_row is not None
    fields += ["lag_span", *(f"lag_push_{i}" for i in n)] if has_lag else []

    def coordinate_of(row: tuple[float, ...]) -> Any:
        terms = {name: factor for name, factor in zip(names, row, strict=True) if factor}
        return next(iter(terms)) if [*terms.values()] == [1.0] else terms

    def contacts_of(self: Any) -> tuple[Contact, ...]:
        return tuple(
            Contact(
                name=name,
                coordinate=coordinate_of(row),
                sign=sign,
                position=getattr(self, f"{name}_position"),
                restitution=getattr(self, f"{name}_restitution"),
            )
            for name, row, sign in contacts
        )

    def frictions_of(self: Any) -> tuple[Friction, ...]:
        return tuple(
            Friction(
                name=name,
                coordinate=names[place],
                kinetic=getattr(self, f"{name}_kinetic"),
                static=getattr(self, f"{name}_static"),
                ground_speed=getattr(self, f"{name}_ground_speed"),
                contact=contact,
            )
            for name, place, contact in frictions
        )

    def surfaces_of(self: Any) -> tuple[Surface, ...]:
        return tuple(
            Surface(
                name=name,
                coordinate=names[place],
                sign=sign,
                position=getattr(self, f"{name}_position"),
            )
            for name, place, sign in surfaces
        )

    def mass_matrix(self: Any, q: Any) -> Any:
        rows = [[getattr(self, f"mass_{i}_{j}") if masses[i][j] else 0.0 for j in n] for i in n]
        if has_lag:
            rows = [*([*row, 0.0] for row in rows), [*(0.0 for _ in n), 1.0]]
        return rows[0][0] if len(rows) == 1 else rows

    def force(self: Any, t: Any, q: Any, v: Any, load: Any, *sides: Any) -> Any:
        several = len(names) + has_lag > 1
        q = list(q) if several else [q]
        v = list(v) if several else [v]
        found = []
        for i in n:
            total = getattr(self, f"constant_{i}")
            for j in n:
                far = q[j] - getattr(self, f"neutral_{j}")
                total = total - getattr(self, f"stiffness_{i}_{j}") * far
                total = total - getattr(self, f"damping_{i}_{j}") * v[j]
            if has_cubic:
                far = q[i] - getattr(self, f"neutral_{i}")
                total = total - getattr(self, f"cubic_{i}") * far * far * far
            if f"on_{names[i]}" in channels:
                total = total + getattr(load, f"on_{names[i]}")(t)
            for name, place, _ in surfaces:
                if place == i:
                    far = q[i] - getattr(self, f"{name}_position")
                    pressed = getattr(self, f"{name}_stiffness") * far
                    pressed = pressed + getattr(self, f"{name}_damping") * v[i]
                    total = total - 0.5 * (1.0 + sides[0][name]) * pressed
            if has_lag:
                total = total + getattr(self, f"lag_push_{i}") * q[-1]
            found.append(total)
        if has_lag:
            follows = -q[-1]
            for factor, value in zip(lag_row, q[:-1], strict=True):
                follows = follows + factor * value
            found.append(follows / self.lag_span)
        return tuple(found) if len(found) > 1 else found[0]

    def normal_forces(self: Any, t: Any, q: Any, v: Any, load: Any) -> Any:
        return tuple(getattr(self, f"{name}_normal") for name, _, _ in frictions)

    space: dict[str, Any] = {
        "coordinates": (*names, "lag") if has_lag else names,
        "first_order": ("lag",) if has_lag else (),
        "channels": channels,
        "mass_matrix": mass_matrix,
        "force": force,
    }
    space |= {"contacts": property(contacts_of)} if contacts else {}
    space |= {"surfaces": property(surfaces_of)} if surfaces else {}
    if frictions:
        space |= {"frictions": property(frictions_of), "normal_forces": normal_forces}
    return dataclasses.make_dataclass(
        "RandomModel",
        [(name, float) for name in fields],
        bases=(saltus.ContactModel,),
        namespace=space,
        frozen=True,
        kw_only=True,
    )


@dataclass(frozen=True, kw_only=True)
class OneContact(saltus.OneContactModel):
    """What the models of one contact share."""

    mass: float
    damping: float
    stiffness: float
    cubic: float
    neutral: float
    constant: float
    edge: float
    bias: float

    coordinates = ("q0",)
    channels = ("on_q0",)

    @property
    def contact(self) -> Any:
        return self.edge

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Any) -> Any:
        far = x - self.neutral
        force = load.on_q0(t) + self.constant - self.damping * velocity - self.stiffness * far
        return (force - self.cubic * far * far * far + side * self.bias) / self.mass


@dataclass(frozen=True, kw_only=True)
class Wall(OneContact):
    """A wall above."""

    @property
    def sides(self) -> tuple[int, ...]:
        return (1,)

    def gap(self, x: Any, side: Any) -> Any:
        return self.edge - x

    def reset(self, t: Any, velocity: Any, side: Any, load: Any, impact: Any) -> Any:
        return side, -impact.velocity_after(self, t, velocity, side, side, load)


@dataclass(frozen=True, kw_only=True)
class Floor(Wall):
    """A floor below."""

    def gap(self, x: Any, side: Any) -> Any:
        return x - self.edge


@dataclass(frozen=True, kw_only=True)
class Passing(OneContact):
    """A contact that motions go through."""

    def gap(self, x: Any, side: Any) -> Any:
        return side * (x - self.edge)


# --- random recipes ----------------------------------------------------------


def random_recipe(kind: str, rng: np.random.Generator) -> Recipe:
    """A random motion of a kind, one of `KINDS`, with numbers near 1."""
    return KINDS[kind](rng)


def _positive(rng: np.random.Generator, size: int, coupling: float = 0.3) -> np.ndarray:
    """A random symmetric matrix with a dominant diagonal."""
    matrix = rng.uniform(-coupling, coupling, (size, size)) / size
    matrix = matrix + matrix.T
    np.fill_diagonal(matrix, rng.uniform(0.7, 1.6, size))
    return matrix


def _basis(name: str, size: int, rng: np.random.Generator, **parts: Any) -> Recipe:
    """A recipe of a size, shaken harmonically, with what is given in the place of what is
    random.
    """
    places = range(size)
    frequency = float(rng.uniform(0.6, 2.0))
    loads = tuple(
        RandomLoad(i, "harmonic", float(rng.uniform(0.3, 1.5)), phase=float(rng.uniform(0, 6)))
        for i in places
    )
    given: dict[str, Any] = {
        "name": name,
        "kind": "own",
        "mass": _positive(rng, size, 0.2) if size > 1 else np.array([[rng.uniform(0.6, 1.6)]]),
        "damping": np.diag(rng.uniform(0.02, 0.2, size)),
        "stiffness": _positive(rng, size),
        "cubic": np.zeros(size),
        "neutral": rng.uniform(-0.3, 0.3, size),
        "constant": np.zeros(size),
        "loads": loads,
        "frequency": frequency,
        "position": rng.uniform(-0.5, 0.5, size),
        "velocity": rng.uniform(-0.5, 0.5, size),
        "duration": float(rng.uniform(3.0, 6.0)) * 2.0 * np.pi / frequency,
    }
    return Recipe(**(given | parts))


def _number(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _pulses(rng: np.random.Generator, place: int = 0) -> RandomLoad:
    """A load that begins later, of one of three kinds."""
    kind = str(rng.choice(["ramp", "half sine", "record"]))
    times = (0.0, 0.7, 1.0, 2.5, 40.0)
    values = (0.0, *rng.uniform(-1.0, 1.0, 3).tolist(), 0.3)
    samples: dict[str, Any] = {"times": times, "values": values} if kind == "record" else {}
    return RandomLoad(
        place,
        kind,
        _number(rng, 0.5, 1.5) * float(rng.choice([-1.0, 1.0])),
        start=_number(rng, 0.1, 1.0),
        span=_number(rng, 0.3, 2.0),
        **samples,
    )


def _wall(rng: np.random.Generator) -> Recipe:
    sign = int(rng.choice([-1, 1]))
    wall = RandomContact(
        "wall", (1.0,), sign, -sign * _number(rng, 0.6, 1.2), _number(rng, 0.2, 0.9)
    )
    cubic = np.array([_number(rng, 0.0, 0.3)])
    return _basis("wall", 1, rng, kind="wall", contacts=(wall,), cubic=cubic)


def _passing(rng: np.random.Generator) -> Recipe:
    edge = RandomContact("edge", (1.0,), 1, _number(rng, -0.3, 0.3), _number(rng, 0.7, 1.0))
    bias = -_number(rng, 0.1, 0.6)
    return _basis("passing", 1, rng, kind="passing", contacts=(edge,), bias=bias)


def _ball(rng: np.random.Generator) -> Recipe:
    """A ball that comes to rest on a floor, under a load that shakes it or begins later."""
    floor = RandomContact("floor", (1.0,), 1, 0.0, _number(rng, 0.2, 0.8))
    loads: tuple[RandomLoad, ...] = (_pulses(rng),)
    if rng.random() < 0.5:
        loads = (RandomLoad(0, "harmonic", _number(rng, 0.1, 0.8)),)
    harmonic = loads[0].kind == "harmonic"
    return _basis(
        "ball",
        1,
        rng,
        contacts=(floor,),
        constant=-rng.uniform(0.8, 1.5, 1),
        stiffness=np.zeros((1, 1)),
        position=rng.uniform(0.2, 1.5, 1),
        loads=loads,
        frequency=1.3 if harmonic else None,
        duration=_number(rng, 12.0, 20.0),
    )


def _stops(rng: np.random.Generator) -> Recipe:
    """A mass with friction between two stops."""
    contacts = (
        RandomContact("left", (1.0,), 1, -_number(rng, 0.6, 1.0), _number(rng, 0.2, 0.8)),
        RandomContact("right", (1.0,), -1, _number(rng, 0.6, 1.0), _number(rng, 0.2, 0.8)),
    )
    kinetic = _number(rng, 0.05, 0.3)
    seal = RandomFriction("seal", 0, kinetic, kinetic * _number(rng, 1.0, 1.4), 0.0, 1.0)
    return _basis("stops", 1, rng, contacts=contacts, frictions=(seal,))


def _block(rng: np.random.Generator) -> Recipe:
    """A block that slides and hops on a floor with friction."""
    floor = RandomContact("floor", (0.0, 1.0), 1, 0.0, _number(rng, 0.0, 0.8))
    mu = _number(rng, 0.05, 0.6)
    rub = RandomFriction("rub", 0, mu, mu, 0.0, 1.0, contact="floor")
    return _basis(
        "block",
        2,
        rng,
        mass=np.diag(rng.uniform(0.7, 1.4, 2)),
        stiffness=np.diag([_number(rng, 0.0, 0.4), 0.0]),
        damping=np.zeros((2, 2)),
        constant=np.array([0.0, -1.0]),
        contacts=(floor,),
        frictions=(rub,),
        position=np.array([0.0, _number(rng, 0.1, 1.5)]),
    )


def _chain(rng: np.random.Generator) -> Recipe:
    """Two masses that hit each other and a wall."""
    contacts = (
        RandomContact("between", (-1.0, 1.0), 1, _number(rng, 0.1, 0.3), _number(rng, 0.2, 0.8)),
        RandomContact("wall", (0.0, 1.0), -1, _number(rng, 1.2, 1.6), _number(rng, 0.2, 0.8)),
    )
    position = np.array([0.0, 1.0]) + rng.uniform(-0.2, 0.1, 2)
    return _basis(
        "chain",
        2,
        rng,
        contacts=contacts,
        position=position,
        neutral=np.array([0.0, 1.0]),
        mass=np.diag(rng.uniform(0.6, 1.5, 2)),
    )


def _belt(rng: np.random.Generator) -> Recipe:
    """Two masses, one of them on a belt, the other one rubbing on a wall."""
    frictions = (
        RandomFriction(
            "belt", 0, _number(rng, 0.1, 0.3), _number(rng, 0.35, 0.5), _number(rng, -0.5, 0.5), 1.0
        ),
        RandomFriction("rub", 1, 0.2, 0.2, 0.0, _number(rng, 0.5, 1.5)),
    )
    return _basis("belt", 2, rng, frictions=frictions)


def _soft(rng: np.random.Generator) -> Recipe:
    """A mass between a soft stop and a hard one."""
    level = _number(rng, 0.1, 0.5)
    stop = RandomSurface("stop", 0, 1, level, _number(rng, 1.0, 8.0), _number(rng, 0.0, 0.5))
    wall = RandomContact("wall", (1.0,), 1, -_number(rng, 0.5, 0.9), _number(rng, 0.2, 0.8))
    return _basis("soft", 1, rng, contacts=(wall,), surfaces=(stop,))


def _resting(rng: np.random.Generator) -> Recipe:
    """A mass at rest on the surface of a soft stop until its load begins."""
    stop = RandomSurface("stop", 0, int(rng.choice([-1, 1])), 0.2, _number(rng, 1.0, 8.0), 0.1)
    return _basis(
        "resting",
        1,
        rng,
        surfaces=(stop,),
        neutral=np.array([0.2]),
        position=np.array([0.2]),
        velocity=np.zeros(1),
        loads=(_pulses(rng),),
        frequency=None,
        duration=10.0,
    )


def _lag(rng: np.random.Generator) -> Recipe:
    """A mass at a wall, pushed by a coordinate of first order."""
    wall = RandomContact("wall", (1.0,), -1, _number(rng, 0.3, 0.8), _number(rng, 0.2, 0.8))
    lag = RandomLag(_number(rng, 0.5, 2.0), (1.0,), (-_number(rng, 0.1, 0.6),))
    return _basis(
        "lag", 1, rng, contacts=(wall,), lag=lag, lag_start=0.1, position=rng.uniform(-0.5, 0.2, 1)
    )


def _structure(rng: np.random.Generator) -> Recipe:
    """A structure of four masses with a wall and a soft stop."""
    wall = RandomContact(
        "wall", (0.0, 0.0, 0.0, 1.0), -1, _number(rng, 0.3, 0.7), _number(rng, 0.2, 0.8)
    )
    stop = RandomSurface("stop", 1, 1, _number(rng, 0.2, 0.5), _number(rng, 0.5, 3.0), 0.1)
    springs = np.diag(rng.uniform(1.5, 2.5, 4)) - np.eye(4, k=1) * 0.8 - np.eye(4, k=-1) * 0.8
    return _basis(
        "structure",
        4,
        rng,
        kind="structure",
        mass=np.diag(rng.uniform(0.7, 1.4, 4)),
        stiffness=springs,
        neutral=np.zeros(4),
        contacts=(wall,),
        surfaces=(stop,),
        position=rng.uniform(-0.2, 0.2, 4),
    )


KINDS: dict[str, Callable[[np.random.Generator], Recipe]] = {
    "wall": _wall,
    "passing": _passing,
    "ball": _ball,
    "stops": _stops,
    "block": _block,
    "chain": _chain,
    "belt": _belt,
    "soft": _soft,
    "resting": _resting,
    "lag": _lag,
    "structure": _structure,
}
