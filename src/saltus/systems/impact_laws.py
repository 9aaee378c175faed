"""Impact laws: the velocity just after an impact, and the change of energy (paper, section "Impact
scenarios").
"""

from __future__ import annotations

import itertools
from collections import UserDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from saltus.checks import answered
from saltus.errors import ParameterError
from saltus.number_ranges import NumberRange, number_range, settle_numbers
from saltus.systems.contracts.contact_model import (
    Contact,
    ContactModel,
    Friction,
    contact_of,
    held_entry,
    mass_rows,
    normal_forces,
    single_mass,
)
from saltus.systems.contracts.model import Model, OneContactModel, is_zero
from saltus.systems.gap_coordinates import in_gap_coordinates
from saltus.systems.loads.load import Load


class ImpactLaw:
    """The law by which the velocity and side before an impact give those after it, v-, s -> v+, s+,
    for any model.

    `velocity_after` is traced, and may use comparisons within NumPy's where, and maximum and
    minimum, besides what an acceleration may use.
    """

    __slots__ = ()

    has_phases: ClassVar[bool] = False  # whether impulses e times those of a compression follow it

    def velocity_after(
        self, model: OneContactModel, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """The velocity after an impact at `t` through which the motion passes from `side` to
        `next_side`.

        Both velocities are rates of the coordinate, and the result has the sign of `velocity`:
        where the motion bounces, the model's `reset` turns the sign.
        """
        raise NotImplementedError

    def check_one_contact(self, model: OneContactModel) -> None:
        """Refuse, with a ParameterError, a model with one contact for which this law has no
        meaning.

        Parameters
        ----------
        model
            The model.
        """
        if type(self).velocity_after is ImpactLaw.velocity_after:
            raise ParameterError(
                f"{type(self).__name__} has no velocity_after, which a {type(model).__name__} with"
                " its one contact needs; give VelocityReduction(e=...)",
                "impact",
            )

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """E of the impacts of a model with contacts, 0 <= J _|_ v+ + E v- >= 0, rows and columns in
        the order of its contacts.

        J are the impulses, and v the rates of the gaps, at all contacts whose gap is 0.

        Raises
        ------
        ParameterError
            A law that has no meaning for several contacts.
        """
        raise ParameterError(
            f"{type(self).__name__} does not apply to the contacts of a {type(model).__name__}; "
            f"give"
            " NewtonImpact(e=...)",
            "impact",
        )


@dataclass(frozen=True, slots=True)
class VelocityReduction(ImpactLaw):
    """v+ = e v-, with a constant factor e in [0, 1] (paper, `vel_red`).

    In a model with several contacts the others of the group take over the speed if the model
    `transfers`; else each contact turns its own speed back.

    Parameters
    ----------
    e
        The factor of the velocity, in [0, 1].

    Examples
    --------
    >>> lossy = saltus.System(model=system.model, load=system.load, impact=saltus.VelocityReduction(e=0.8))
    >>> impacts = saltus.simulate(lossy, theta=0.3, periods=2).impacts
    >>> bool(np.allclose(impacts.velocity_after / impacts.velocity_before, 0.8))
    True
    """

    e: float = field(default=1.0, metadata=number_range(at_least=0.0, at_most=1.0))

    def __post_init__(self) -> None:
        settle_numbers(self)

    def velocity_after(
        self, model: OneContactModel, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """e v-."""
        return self.e * velocity

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """e at the contact that is hit or, if the model `transfers`, at the others of its group."""
        contacts = model.contacts
        return [[self.e if _passes(model, a, b) else 0.0 for a in contacts] for b in contacts]


def _passes(model: Any, a: Contact, b: Contact) -> bool:
    """Whether an impact at contact `a` gives its speed to `b`: another one of its group if the
    model `transfers`, else itself.
    """
    return a is not b and a.group == b.group if model.transfers else a is b


@dataclass(frozen=True, slots=True)
class EnergyRestitution(ImpactLaw):
    """T+ = r T-, with T the model's kinetic energy, ground velocities and unequal masses included
    (`rest_def`, errata 5, 26).

    T on the new side is a quadratic a v^2 + b v + c in the velocity. The root with the sign of v-
    is taken; if both have this sign, the one on the same side of the minimum -b / (2 a) as v-. At r
    = 1 this gives v+ = v- for m = 0 and nu' = 0. If no root has the sign of v- (small v- on a
    moving ground) the motion cannot go on, and is refused with the instant and the numbers.

    Parameters
    ----------
    r
        The share of the kinetic energy that an impact leaves, above 0 and at most 1.

    Examples
    --------
    >>> ball = saltus.System(model=saltus.WallOscillator(), impact=saltus.EnergyRestitution(r=0.25))
    >>> float(saltus.simulate(ball, x=-2.0, duration=3.0).impacts.velocity_after[0] / -(3**0.5))  # a quarter of the energy
    0.5000000000000006
    """

    r: float = field(metadata=number_range(above=0.0, at_most=1.0))

    def __post_init__(self) -> None:
        settle_numbers(self)

    def velocity_after(
        self, model: OneContactModel, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """The root v+ of a v^2 + b v + c = r T(v-); NaN where there is none."""

        def after(v: Any) -> Any:
            return model.kinetic_energy(t, model.contact, v, next_side, load)

        c = after(0.0)
        a = (after(1.0) + after(-1.0)) / 2 - c
        b = (after(1.0) - after(-1.0)) / 2
        energy = self.r * model.kinetic_energy(t, model.contact, velocity, side, load)
        lowest = -b / (2 * a)
        square = (energy - c) / a + lowest * lowest
        reach = np.sqrt(np.maximum(square, 0.0))
        branch = np.where(velocity > lowest, 1.0, -1.0)
        nearer = lowest + branch * reach
        other = lowest - branch * reach
        through = np.where(nearer * velocity > 0, nearer, other)
        return np.where(square >= 0, np.where(through * velocity > 0, through, np.nan), np.nan)


@dataclass(frozen=True, slots=True)
class InelasticImpact(ImpactLaw):
    """Frictionless, perfectly inelastic contact: the momentum balance of the layer that is not hit
    fixes v+ (errata 25).

    For the metainterface v+ = -cos(2 beta0) v- from lower to upper and -cos(2 beta0)/(1+m) v- back,
    whatever the ground does, for 45 to 135 degrees; outside that range both contacts act and the
    motion stops. For the rocking block it is Housner's factor.

    Examples
    --------
    >>> inelastic = saltus.System(model=system.model, load=system.load, impact=saltus.InelasticImpact())
    >>> impacts = saltus.simulate(inelastic, theta=0.3, periods=1).impacts
    >>> float(impacts.velocity_after[0] / impacts.velocity_before[0] + np.cos(2 * system.model.beta0))
    0.0
    """

    def velocity_after(
        self, model: OneContactModel, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """The model's `inelastic_factor` times v-."""
        return model.inelastic_factor(side) * velocity

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """All zeros: no contact gives speed back, and the balance of momentum determines the other
        velocities.
        """
        return [[0.0] * len(model.contacts) for _ in model.contacts]


class Factors(tuple[Any, ...]):
    """A tuple of numbers of a law, which a trace replaces by symbols: `impact.e.0`, `impact.e.1`,
    ...
    """

    __slots__ = ()

    @property
    def named(self) -> dict[str, Any]:
        """Its entries by the names that they have in paths: their numbers from 0."""
        return {str(i): value for i, value in enumerate(self)}

    def with_values(self, values: Iterable[Any]) -> Factors:
        """The same with other entries.

        Parameters
        ----------
        values
            In the same order.
        """
        return type(self)(values)


class Coefficients(Factors):
    """Numbers that follow from others: a trace replaces them by symbols, but they are no
    parameters.
    """

    __slots__ = ()


class NamedParts(Factors):
    """NamedParts of a model with names of their own, whose numbers have paths such as
    `model.contacts.tip.position`.
    """

    __slots__ = ()

    @property
    def named(self) -> dict[str, Any]:
        """The parts by their names."""
        return {part.name: part for part in self}


class RowNumbers(tuple[float, ...]):
    """The coefficients of all rows of the matrices."""

    __slots__ = ()

    @property
    def structure_key(self) -> Any:
        """What of it belongs to a system's structure: that it is there."""
        return RowNumbers


class Vectors(UserDict[str, RowNumbers]):
    """Rows by their names, which do not change."""

    def __hash__(self) -> int:
        return hash(tuple(self.items()))

    @property
    def structure_key(self) -> Any:
        """What of them belongs to a system's structure: their names."""
        return Vectors, tuple(self)


@dataclass(frozen=True, slots=True)
class NewtonImpact(ImpactLaw):
    """0 <= J _|_ v+ + E v- >= 0 at all contacts whose gap is 0, with the rates v of the gaps and
    the impulses J (Moreau).

    A model with one contact has no other one to which an impact could pass speed: a wall turns the
    velocity round to -e v-. A motion that passes through its contact closes one and opens another
    at once, v+ = g v-, and does not bounce: e must be 0.

    E has the restitution of each contact on its diagonal, the transfer g between contacts of one
    group, and 0 elsewhere. A contact with an impulse has after the impact the rate -e_i v_i- less g
    times the rates v- of the others in its group. For g = 0 the energy lost at an impact is 1/2 sum
    J_i (1 - e_i) |v_i-| on fixed ground. A transfer may raise the energy: see `energy_gain`.

    Parameters
    ----------
    e
        The restitution of all contacts, or a tuple with one for each in the order of the model; in
        [0, 1].
    transfer
        g, in [0, 1].

    Examples
    --------
    >>> stops = saltus.System(model=saltus.TwoStops(stiffness=0.0), impact=saltus.NewtonImpact(e=0.5))
    >>> [float(event.velocity_after[0]) for event in saltus.simulate(stops, x=0.0, velocity=1.0, duration=4.0).events]
    [-0.5]
    """

    e: Any = field(
        default=0.0, metadata={"range": NumberRange(at_least=0.0, at_most=1.0, each=True)}
    )
    transfer: float = field(default=0.0, metadata=number_range(at_least=0.0, at_most=1.0))

    def __post_init__(self) -> None:
        settle_numbers(self)
        if isinstance(self.e, (tuple, list)):
            object.__setattr__(self, "e", Factors(self.e))

    def velocity_after(
        self, model: OneContactModel, t: Any, velocity: Any, side: Any, next_side: Any, load: Load
    ) -> Any:
        """e v- at a wall, whose reset turns its sign, and g v- at a contact that the motion
        passes.
        """
        (e,) = self.e if isinstance(self.e, Factors) else (self.e,)
        return (e if len(model.sides) == 1 else self.transfer) * velocity

    def check_one_contact(self, model: OneContactModel) -> None:
        """Refuse several values of e, and a bounce in a model that passes its contact."""
        values = self.e if isinstance(self.e, Factors) else (self.e,)
        if len(values) != 1:
            raise ParameterError(
                f"impact.e must have 1 value for a {type(model).__name__}, got {len(values)}",
                "impact.e",
            )
        if len(model.sides) == 2 and values[0] != 0.0:
            raise ParameterError(
                f"a {type(model).__name__} passes its contact and does not bounce there, so that"
                f" impact.e must be 0, got {values[0]:g}; VelocityReduction(e=...) and"
                " NewtonImpact(transfer=...) say how much speed passes",
                "impact.e",
            )

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """E; a contact's own restitution takes the place of the law's if it has one."""
        contacts = model.contacts
        factors = self.e if isinstance(self.e, Factors) else (self.e,) * len(contacts)
        if len(factors) != len(contacts):
            names = ", ".join(contact.name for contact in contacts)
            raise ParameterError(
                f"impact.e must have {len(contacts)} value(s), for {names}, got {len(factors)}",
                "impact.e",
            )
        matrix: list[list[Any]] = [
            [self.transfer * (a.group == b.group) for a in contacts] for b in contacts
        ]
        for i, (contact, factor) in enumerate(zip(contacts, factors, strict=True)):
            matrix[i][i] = factor if contact.restitution is None else contact.restitution
        return matrix


@dataclass(frozen=True, slots=True)
class PoissonImpact(NewtonImpact):
    """Two phases: a compression that ends as the law of `NewtonImpact` with e = 0, and an expansion
    with impulses e times those.

    Both have friction where the contact has one. In the expansion an impulse is larger where its
    contact would close again. With one contact whose friction does not act on its gap, v+ = -e v-
    as in Newton's law; else a contact may have a speed after it that it had none of before. For
    models with frictions in contacts.

    Parameters
    ----------
    e
        The ratio of the impulses, for all contacts or a tuple with one for each; in [0, 1].
    transfer
        0.

    Examples
    --------
    >>> saltus.PoissonImpact(e=0.5).has_phases
    True
    """

    has_phases: ClassVar[bool] = True

    def __post_init__(self) -> None:
        NewtonImpact.__post_init__(self)
        if self.transfer:
            raise ParameterError(
                f"PoissonImpact has no transfer, got {self.transfer:g}; NewtonImpact has one",
                "transfer",
            )

    def check_one_contact(self, model: OneContactModel) -> None:
        """Refuse: with one contact NewtonImpact is the same."""
        raise ParameterError(
            f"a {type(model).__name__} has one contact without friction, where NewtonImpact is the"
            " same",
            "impact",
        )

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """The ratios on the diagonal, for a model with frictions in its contacts."""
        if not model.rubs_in_contacts:
            raise ParameterError(
                "PoissonImpact is followed where contacts have friction, and those of"
                f" {type(model).__name__} have none: give NewtonImpact(e=...)",
                "impact",
            )
        return NewtonImpact.restitution_matrix(self, model)


@answered
def energy_gain(model: ContactModel, impact: ImpactLaw) -> dict[str, float]:
    """The largest relative gain of kinetic energy by an impact at each contact; the energy is not
    raised where it is <= 0.

    The contacts of all other coordinates are taken as closed and at rest. The rates of the gaps
    after the impact are then -E v- where an impulse acts, and coordinates without a contact keep
    their momentum. The gain is (v+' M v+) / (v-' M v-) - 1, on fixed ground and in the position
    where these contacts are closed. For two layers it is positive where M_ss e_s^2 + 2 cos(2 beta0)
    e_s g + M_jj g^2 > M_ss, s the layer that is hit.

    Parameters
    ----------
    model
        A model with several contacts.
    impact
        The impact law.

    Examples
    --------
    >>> heavy = saltus.TwoLayer(beta0=np.deg2rad(80), mass_ratio=0.7)
    >>> saltus.energy_gain(heavy, saltus.NewtonImpact(transfer=1.0))["upper"]  # the lower mass is heavier by that share
    0.7
    """
    if model.has_multipliers:
        raise ParameterError(
            f"energy_gain is for contacts of coordinates so far, and {type(model).__name__} has a"
            " contact of a distance or a friction of a rate",
            "model",
        )
    return {
        name: float(share)
        for name, share in energy_gains(in_gap_coordinates(model), impact).items()
    }


def energy_gains(model: Any, impact: Any, shape: tuple[int, ...] = ()) -> dict[str, np.ndarray]:
    """`energy_gain` of a model and a law, or of copies of them (see `substitute`) whose numbers are
    arrays of this shape.
    """
    contacts = model.contacts
    names = model.coordinates
    places = [names.index(contact.coordinate) for contact in contacts]
    matrix = impact.restitution_matrix(model)
    gain = {}
    size = len(names)
    free = [k for k in range(len(names)) if k not in places]
    for s, contact in enumerate(contacts):
        before = np.zeros(size)
        after = [0.0] * size
        q = [np.zeros(shape)] * size
        for j, other in enumerate(contacts):
            if j == s or other.coordinate != contact.coordinate:
                q[places[j]], after[places[j]] = (
                    q[places[j]] + other.position,
                    other.sign * matrix[j][s],
                )
        before[places[s]] = -contact.sign
        given = model.mass_matrix(q[0] if size == 1 else tuple(q))
        given = single_mass(given) if size == 1 else given
        entries = np.broadcast_arrays(
            *after, *([given] if size == 1 else [entry for row in given for entry in row])
        )
        table = np.stack([entry.astype(float) for entry in entries], axis=-1)
        left = table[..., :size].copy()
        mass = table[..., size:].reshape(*table.shape[:-1], size, size)
        if free:
            pushed = (mass @ (left - before)[..., None])[..., free, :]
            left[..., free] = -np.linalg.solve(mass[..., free, :][..., free], pushed)[..., 0]
        energy = [(v * (mass @ v[..., None])[..., 0]).sum(axis=-1) for v in (left, before)]
        gain[contact.name] = energy[0] / energy[1] - 1.0
    return gain


def check_paradox(model: ContactModel) -> None:
    """Refuse frictions in contacts that slide with no reaction, or with several: Painleve's
    paradox, of a constant mass matrix.

    The sliding of frictions with the directions s adds s mu (M a - r)_n to their rows, and
    whichever coordinates are free, their rows and columns have a determinant. The reactions are the
    only ones if it stays positive.
    """
    pressed = [friction for friction in model.frictions if friction.contact is not None]
    if any(friction.limit in model.friction_limits for friction in pressed):
        return  # it depends on the state, and ends a motion there
    names = model.coordinates
    contacts = {contact.name: contact for contact in model.contacts}
    mass = np.array(mass_rows(model, (0.5,) * len(names)), dtype=float)
    places = [(names.index(f.coordinate), contacts[str(f.contact)]) for f in pressed]
    own = {place for t, contact in places for place in (t, names.index(contact.coordinate))}
    parts: tuple[Contact | Friction, ...] = (*model.contacts, *model.frictions)
    others = (
        sorted({names.index(part.coordinate) for part in parts} - own)
        if mass[list(own)].any()
        else []
    )
    for held in itertools.product((False, True), repeat=len(others)):
        for ways in itertools.product((None, 0, 1, -1), repeat=len(pressed)):
            rows = mass.copy()
            fixed = {place for place, is_held in zip(others, held, strict=True) if is_held}
            for friction, (t, contact), way in zip(pressed, places, ways, strict=True):
                n = names.index(contact.coordinate)
                fixed |= set() if way is None else {n} if way else {n, t}
                rows[t] = rows[t] + (way or 0) * contact.sign * float(friction.most) * mass[n]
            free = [place for place in range(len(names)) if place not in fixed]
            share = (
                np.linalg.det(rows[np.ix_(free, free)]) / np.linalg.det(mass[np.ix_(free, free)])
                if free
                else 1.0
            )
            if share <= 0.0:
                slip = ", ".join(
                    f"{f.name} {'forwards' if s > 0 else 'backwards'}"
                    for f, s in zip(pressed, ways, strict=True)
                    if s
                )
                raise ParameterError(
                    f"while {slip} slides, a contact of {type(model).__name__} has no reaction or"
                    " several (Painleve's paradox): 1 + s mu m_nt / m_tt must be positive and is"
                    f" {share:.6g}, with the mass matrix m of what is free; choose a smaller"
                    " coefficient",
                    "model",
                )


def friction_margins(
    model: Model, t: Any, q: Any, v: Any, load: Any, free: Sequence[Any], slides: Sequence[Any]
) -> dict[str, Any]:
    """What must stay positive for each friction, by the name of the limit at which a motion ends
    where it vanishes.

    That is the normal force. Of one in a contact it decides whether a reaction is the only one: let
    m be the Schur complement of M over the free coordinates, t of the friction and n of the contact
    along its sign. The margins are m_tt + s mu m_nt, and where it sticks m_tt - mu abs(m_nt), with
    mu_s and times positive numbers.
    """
    forces = normal_forces(model, t, q, v, load)
    names = model.coordinates
    found: dict[str, Any] = {}
    for friction, force, s in zip(model.frictions, forces, slides, strict=False):
        found[friction.limit] = force
        if friction.contact is not None:
            place = names.index(friction.coordinate)
            contact = contact_of(model, friction)
            own, across = schur_complement(
                mass_rows(model, q, t, load), place, names.index(contact.coordinate), free
            )
            rubs = friction.most * (1.0 - free[names.index(contact.coordinate)]) * across
            found[friction.limit] = (own + contact.sign * s * rubs) * (
                own * own - (1.0 - s * s) * rubs * rubs
            )
    return found


def schur_complement(
    mass: Sequence[Sequence[Any]], place: int, held: int, free: Sequence[Any]
) -> tuple[Any, Any]:
    """The entries (t, t) and (n, t) of the mass matrix, t = `place` and n = `held`, after the
    elimination of the other free coordinates."""
    others = [k for k in range(len(mass)) if k not in (place, held)]
    masks = [1.0 if k in (place, held) else f for k, f in enumerate(free)]
    rows = [
        [held_entry(entry, i, j, masks) for j, entry in enumerate(row)]
        for i, row in enumerate(mass)
    ]
    for number, k in enumerate(others):
        later = others[number + 1 :]
        for i in (*later, place, held):
            if not is_zero(rows[i][k]):
                factor = rows[i][k] / rows[k][k]
                for j in (*later, place):
                    rows[i][j] = rows[i][j] - factor * rows[k][j]
    return rows[place][place], rows[held][place]
