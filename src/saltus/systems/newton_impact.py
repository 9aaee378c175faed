"""Newton's law of impact for models with several contacts, with a transfer between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import check_number, settle_numbers
from saltus.errors import ParameterError
from saltus.public_functions import answered
from saltus.systems.factors import Factors
from saltus.systems.impact import ImpactLaw
from saltus.systems.model import Model


@dataclass(frozen=True, slots=True)
class NewtonImpact(ImpactLaw):
    """0 <= J _|_ v+ + E v- >= 0 at all contacts whose gap is 0, with the rates v of the gaps and the impulses J (Moreau).

    E has the restitution of each contact on its diagonal, the transfer g between contacts of one group, and 0 elsewhere. A
    contact with an impulse has after the impact the rate -e_i v_i- less g times the rates v- of the others in its group. For
    g = 0 the energy lost at an impact is 1/2 sum J_i (1 - e_i) |v_i-| on fixed ground. A transfer may raise the energy: see
    `energy_gain`.

    Parameters
    ----------
    e
        The restitution of all contacts, or a tuple with one for each in the order of the model; in [0, 1].
    transfer
        g, in [0, 1].

    Examples
    --------
    >>> stops = saltus.System(model=saltus.TwoStops(stiffness=0.0), impact=saltus.NewtonImpact(e=0.5))
    >>> [float(event.velocity_after[0]) for event in saltus.simulate(stops, x=0.0, velocity=1.0, duration=4.0).events]
    [-0.5]
    """

    e: Any = 0.0
    transfer: float = 0.0

    def __post_init__(self) -> None:
        settle_numbers(self, "transfer", at_least=0.0, at_most=1.0)
        several = isinstance(self.e, (tuple, list))
        for i, value in enumerate(self.e if several else (self.e,)):
            check_number(f"e.{i}" if several else "e", value, at_least=0.0, at_most=1.0)
        object.__setattr__(self, "e", Factors(float(x) for x in self.e) if several else float(self.e))

    def restitution_matrix(self, model: Model) -> list[list[Any]]:
        """E; a contact's own restitution takes the place of the law's if it has one."""
        contacts = model.contacts
        factors = self.e if isinstance(self.e, Factors) else (self.e,) * len(contacts)
        if len(factors) != len(contacts):
            names = ", ".join(contact.name for contact in contacts)
            raise ParameterError(f"impact.e must have {len(contacts)} value(s), for {names}, got {len(factors)}", "impact.e")
        matrix: list[list[Any]] = [[self.transfer * (a.group == b.group) for a in contacts] for b in contacts]
        for i, (contact, factor) in enumerate(zip(contacts, factors, strict=True)):
            matrix[i][i] = factor if contact.restitution is None else contact.restitution
        return matrix


@answered
def energy_gain(model: Model, impact: ImpactLaw) -> dict[str, float]:
    """The largest relative gain of kinetic energy by an impact at each contact; the energy is not raised where it is <= 0.

    The contacts of all other coordinates are taken as closed and at rest. The rates of the gaps after the impact are then -E v-
    where an impulse acts, coordinates without a contact keep their momentum, and the gain is (v+' M v+) / (v-' M v-) - 1, on
    fixed ground and in the position where these contacts are closed. For two layers it is positive where
    M_ss e_s^2 + 2 cos(2 beta0) e_s g + M_jj g^2 > M_ss, s the layer that is hit.

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
    return {name: float(share) for name, share in energy_gains(model, impact).items()}


def energy_gains(model: Any, impact: Any, shape: tuple[int, ...] = ()) -> dict[str, np.ndarray]:
    """`energy_gain` of a model and a law, or of copies of them (see `substitute`) whose numbers are arrays of this shape."""
    contacts, names = model.contacts, model.coordinates
    places = [names.index(contact.coordinate) for contact in contacts]
    matrix, gain = impact.restitution_matrix(model), {}
    size, free = len(names), [k for k in range(len(names)) if k not in places]
    for s, contact in enumerate(contacts):
        before, after, q = np.zeros(size), [0.0] * size, [np.zeros(shape)] * size
        for j, other in enumerate(contacts):
            if j == s or other.coordinate != contact.coordinate:
                q[places[j]], after[places[j]] = q[places[j]] + other.position, other.sign * matrix[j][s]
        before[places[s]] = -contact.sign
        given = model.mass_matrix(q[0] if size == 1 else tuple(q))
        entries = np.broadcast_arrays(*after, *([given] if size == 1 else [entry for row in given for entry in row]))
        table = np.stack([entry.astype(float) for entry in entries], axis=-1)
        left, mass = table[..., :size].copy(), table[..., size:].reshape(*table.shape[:-1], size, size)
        if free:
            pushed = (mass @ (left - before)[..., None])[..., free, :]
            left[..., free] = -np.linalg.solve(mass[..., free, :][..., free], pushed)[..., 0]
        energy = [(v * (mass @ v[..., None])[..., 0]).sum(axis=-1) for v in (left, before)]
        gain[contact.name] = energy[0] / energy[1] - 1.0
    return gain
