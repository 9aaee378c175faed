"""Branches on which each grazing adds a bounce to bounces that die away.

The places of the grazings converge to the parameter at which the bounces come to rest. A branch of
orbits that rest, begun on the other side, ends at this parameter with `CH`: an independent truth.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

import saltus
from saltus.orbits import SpecialKind


@dataclass(frozen=True, kw_only=True)
class CarriedMass(saltus.ContactModel):
    """A mass before a stop, which carries a second one on a spring and a dashpot."""

    stiffness: float
    damping: float
    between: float
    damping_between: float
    carried_stiffness: float = 1.0
    carried_mass: float
    stop: float = 0.4

    coordinates: ClassVar = ("x", "y")
    channels: ClassVar = ("force",)

    @property
    def contacts(self) -> Any:
        return (saltus.Contact(name="stop", coordinate="x", sign=-1, position=self.stop),)

    def mass_matrix(self, q: Any) -> Any:
        return [[1.0, 0.0], [0.0, self.carried_mass]]

    def force(self, t: Any, q: Any, v: Any, load: Any) -> Any:
        carried = self.between * (q[0] - q[1]) + self.damping_between * (v[0] - v[1])
        return (
            load.force(t) - self.stiffness * q[0] - self.damping * v[0] - carried,
            carried - self.carried_stiffness * q[1],
        )


# stiffness, damping, stiffness and damping between the masses, the carried mass
CASES = [
    (0.5, 0.1, 0.3, 0.05, 1.0),
    (1.0, 0.05, 0.5, 0.0, 1.0),
    *(
        pytest.param(case, marks=pytest.mark.thorough)
        for case in (
            (1.0, 0.2, 0.3, 0.05, 0.2),
            (0.5, 0.02, 0.5, 0.0, 0.2),
            (0.0, 0.2, 2.0, 0.05, 0.2),
            (0.5, 0.05, 0.5, 0.05, 0.2),
        )
    ),
]


def branch_over_restitution(case: Any, length: float, restitution: float) -> Any:
    """The branch over the coefficient of restitution, with lengths in units of 1/length."""
    stiffness, damping, between, damping_between, carried_mass = case
    system = saltus.System(
        model=CarriedMass(
            stiffness=stiffness,
            damping=damping,
            between=between,
            damping_between=damping_between,
            carried_mass=carried_mass,
            stop=0.4 * length,
        ),
        load=saltus.Load(frequency=0.9, force=saltus.Harmonic(0.5 * length)),
        impact=saltus.VelocityReduction(restitution),
    )
    orbit = saltus.find_orbit(system, x=0.0, y=0.0)
    return saltus.continue_orbit(orbit, "impact.e", (0.0, 1.0))


def end_called(branch: Any, code: str) -> Any:
    return next(end for end in branch.ends if str(end.reason.code) == code)


@pytest.mark.parametrize("case", CASES)
def test_grazings_towards_a_rest_end_a_branch_at_one_place_in_all_units(case: Any) -> None:
    usual, long = (branch_over_restitution(case, length, 0.7) for length in (1.0, 3.7))
    assert [zero.kind for zero in usual.special] == [zero.kind for zero in long.special]
    # the last bounces have speeds of 1e-6: their grazing is known to a small part of these
    assert [zero.parameter for zero in usual.special] == pytest.approx(
        [zero.parameter for zero in long.special], abs=1e-9
    )
    limits = [end_called(branch, "accumulates").parameter for branch in (usual, long)]
    assert limits[0] == pytest.approx(limits[1], abs=1e-9)


def test_the_limit_of_the_grazings_is_where_rest_begins() -> None:
    """Each bounce is so much shorter than the one before that six grazings give ten digits."""
    case = CASES[0]
    bouncing = branch_over_restitution(case, 1.0, 0.7)
    resting = branch_over_restitution(case, 1.0, 0.04)
    (change,) = (zero for zero in resting.special if zero.kind == SpecialKind.CH)
    assert end_called(resting, "rest_vanishes").parameter == pytest.approx(
        change.parameter, abs=1e-12
    )
    grazings = [zero.parameter for zero in bouncing.special if zero.kind == SpecialKind.GR]
    assert len(grazings) > 4
    assert min(grazings) > change.parameter
    limit = end_called(bouncing, "accumulates").parameter
    assert limit == pytest.approx(change.parameter, abs=1e-9)
    # far nearer than the last grazing: the limit is extrapolated
    assert abs(limit - change.parameter) < 0.1 * (min(grazings) - change.parameter)
