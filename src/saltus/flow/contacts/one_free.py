"""The motion of a model with several contacts while only one coordinate is free: one equation for every choice of it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest

from saltus.taylor import CommonForm, Expr, Trace, differentiate, number, substitute


@dataclass(frozen=True)
class OneFree:
    """The equations of the free coordinate, which they call coordinate 0; the leaves `free` say which one it is.

    A reaction has the form p(q) q'' + p'(q) q'^2 + ... with an entry p of the mass matrix, that is, P'' + ..., where P is the
    integral of p. If p is a sine or cosine this saves products of series. The guard of a closed contact is the sum of the second
    derivative of an entry of `curved` and an entry of `guards`.
    """

    acceleration: Expr
    curved: list[Expr]  # P of each closed contact
    guards: list[Expr]  # the remaining terms of their reactions, then the margins that change along the motion
    constant_guards: list[Expr]  # the other margins

    @property
    def roots(self) -> list[Expr]:
        """All expressions."""
        return [self.acceleration, *self.curved, *self.guards, *self.constant_guards]


def equations_of_one_free(trace: Trace, margins: list[Expr]) -> OneFree | None:
    """The equations with one free coordinate, if each coordinate has one contact; else None. `margins` have accelerations
    substituted.

    All contacts but that of the free coordinate are then closed, so that the other coordinates are constants. None is given for a
    trace with a tangent, because the derivatives of the other coordinates need not be constant.
    """
    own = trace.dof
    if (
        len(trace.signs) < 2
        or trace.friction_coordinates
        or sorted(trace.contact_coordinates) != list(range(own))
        or trace.columns
    ):
        return None
    common = CommonForm([Expr("free", (), j) for j in range(own)])
    accelerations, curved, changing, constant = [], [], [], []
    for j in range(own):
        leaves = _leaves(trace, j)
        accelerations.append(substitute(trace.acceleration[j], leaves))
        others = [root for root, coordinate in zip(trace.reactions, trace.contact_coordinates, strict=True) if coordinate != j]
        halves = [_halves(common, substitute(root, leaves | _accelerations(own, j)), accelerations[j]) for root in others]
        curved.append([half for half, _ in halves])
        limits = [substitute(root, leaves) for root in margins]
        changing.append([rest for _, rest in halves] + [limit for limit in limits if limit.degree != 0])
        constant.append([limit for limit in limits if limit.degree == 0])
    unified = [[common.of(row) for row in zip_longest(*rows, fillvalue=number(1.0))] for rows in (curved, changing, constant)]
    return OneFree(common.of(accelerations), *unified)


def _halves(common: CommonForm, reaction: Expr, acceleration: Expr) -> tuple[Expr, Expr]:
    """P and the remaining terms of a reaction p q'' + p' q'^2 + ... = P'' + ...; 0 and the reaction if p has no such integral."""
    q, v, a = (Expr(op, (), 0) for op in ("coordinate", "velocity", "acceleration"))
    factor = differentiate(reaction, a)
    integral = common.integral(factor, q)
    if integral is None:
        return number(0.0), substitute(reaction, {a: acceleration})
    return integral, substitute(reaction, {a: number(0.0)}) - differentiate(factor, q) * (v * v)


def _accelerations(own: int, j: int) -> dict[Expr, Expr]:
    """The substitution for the accelerations if only coordinate j is free."""
    return {Expr("acceleration", (), i): Expr("acceleration", (), 0) if i == j else number(0.0) for i in range(own)}


def _leaves(trace: Trace, j: int) -> dict[Expr, Expr]:
    """The substitution for coordinates, velocities and `free` if only coordinate j is free."""
    leaves = {}
    for i, position in zip(trace.contact_coordinates, trace.positions, strict=True):
        leaves[Expr("coordinate", (), i)] = Expr("coordinate", (), 0) if i == j else position
        leaves[Expr("velocity", (), i)] = Expr("velocity", (), 0) if i == j else number(0.0)
        leaves[Expr("free", (), i)] = number(1.0 if i == j else 0.0)
    return leaves
