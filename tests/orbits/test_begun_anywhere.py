"""A branch is the same wherever it is begun: beside each of its special points and at them, in all
asked ranges.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from branch_relations import differences

import saltus

FREQUENCY = "load.frequency"

MASS = np.diag([0.7646688191164817, 1.1858846655960238, 1.0011892675018181])
STIFFNESS = np.array(
    [
        [1.2601392739006574, -0.3, 0.0],
        [-0.3, 1.2579292869700531, -0.3],
        [0.0, -0.3, 1.283370593995393],
    ]
)
FORCE = np.array([0.4054277715718066, 0.2642687586324064, 0.42111793669222275])
PLACES = np.array([0.75, 1.5, 2.25])


@dataclass(frozen=True, kw_only=True)
class Row(saltus.ContactModel):
    """Three bodies between two walls; the last gap follows from the others."""

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b", "c")
    channels: ClassVar[tuple[str, ...]] = ("force",)
    contacts = (
        saltus.Contact(name="left", coordinate="a"),
        saltus.Contact(name="ab", coordinate={"b": 1.0, "a": -1.0}, position=0.3),
        saltus.Contact(name="bc", coordinate={"c": 1.0, "b": -1.0}, position=0.3),
        saltus.Contact(name="right", coordinate="c", sign=-1, position=3.0),
    )

    def mass_matrix(self, q):
        return MASS.tolist()

    def force(self, t, q, v, load):
        away = [q[i] - PLACES[i] for i in range(3)]
        return tuple(
            FORCE[i] * load.force(t)
            - sum(STIFFNESS[i, j] * away[j] for j in range(3))
            - 0.12 * v[i]
            for i in range(3)
        )


def touching_frequency():
    """Where the linear motion, whose amplitudes are those of (K - W^2 M + i c W) a = f, just
    touches a contact.
    """
    from scipy.optimize import brentq

    def room(w):
        a = np.linalg.solve(STIFFNESS - w**2 * MASS + 0.12j * w * np.eye(3), FORCE)
        gaps = [0.75 - abs(a[0]), 0.45 - abs(a[1] - a[0]), 0.45 - abs(a[2] - a[1])]
        return min(*gaps, 0.75 - abs(a[2]))

    return brentq(room, 1.62, 1.7, xtol=1e-14)


def test_a_grazing_is_passed_from_both_of_its_sides_and_is_where_the_linear_motion_has_it():
    """On the side with an impact multipliers grow without bound, and just beyond the grazing the
    orbits without one are so near to them that a branch seems to come back along itself.
    """
    frequency = 1.655
    load = saltus.Load(frequency=frequency, force=saltus.Harmonic(1.0, phase=0.3))
    system = saltus.System(model=Row(), load=load, impact=saltus.NewtonImpact(0.5))
    linear = np.linalg.solve(
        STIFFNESS - frequency**2 * MASS + 0.12j * frequency * np.eye(3), FORCE
    ) * np.exp(0.3j)
    q, v = PLACES + linear.imag, (1j * frequency * linear).imag
    orbit = saltus.find_orbit(
        system, a=float(q[0]), b=float(q[1]), c=float(q[2]), velocity=tuple(map(float, v))
    )
    for impacts in (0, 1):
        assert orbit.impact_count == impacts
        branch = saltus.continue_orbit(orbit, FREQUENCY, (1.65, 1.6571))
        assert [end.parameter for end in branch.ends] == [1.6571, 1.6571]
        (grazing,) = branch.special
        assert grazing.kind == "GR"
        assert grazing.parameter == pytest.approx(touching_frequency(), abs=1e-10)
        orbit = max(
            (other for other in branch.orbits if other.frequency < 1.6565),
            key=lambda other: (other.impact_count, other.frequency),
        )


def wall_branch():
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.8)),
        impact=saltus.VelocityReduction(0.8),
    )
    return saltus.continue_orbit(saltus.find_orbit(system, x=0.0), FREQUENCY, (0.5, 1.8))


def test_a_branch_of_a_wall_is_the_same_begun_beside_each_of_its_special_points():
    branch = wall_branch()
    assert len(branch.special) > 4
    assert differences(branch, FREQUENCY, (0.5, 1.8), ((0.6, 1.6),)) == []


def test_a_branch_begun_at_a_special_point_lists_it_and_goes_on_to_both_sides():
    branch = wall_branch()
    for special in branch.special:
        at = special.parameter
        again = saltus.continue_orbit(special.orbit, FREQUENCY, (at - 0.02, at + 0.02))
        assert any(
            point.kind == special.kind and abs(point.parameter - at) < 1e-8
            for point in again.special
        )
        assert [end.reason.name for end in again.ends] == ["BOUND", "BOUND"]


@dataclass(frozen=True, kw_only=True)
class Ball(saltus.ContactModel):
    """A ball on a shaken table below a ceiling."""

    top: float = 2.2
    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("ground",)

    @property
    def contacts(self):
        table = saltus.Contact(name="table", coordinate={"x": 1.0, "ground": -1.0})
        return table, saltus.Contact(name="ceiling", coordinate="x", sign=-1, position=self.top)

    def force(self, t, x, v, load):
        return -1.0 - 0.05 * v


def ball_whose_rests_end(shares):
    """A motion whose impacts die away within a period, all of its numbers times these shares."""
    top, amplitude, e, frequency, x = np.array([2.2, 0.9, 0.6, 1.615, 0.8]) * shares
    load = saltus.Load(frequency=frequency, ground=saltus.Harmonic(amplitude))
    system = saltus.System(model=Ball(top=top), load=load, impact=saltus.NewtonImpact(e=e))
    return saltus.find_orbit(system, x=x)


# two of twelve with which the last bits once decided otherwise
@pytest.mark.parametrize("case", [8, 11])
def test_whether_a_rest_vanishes_does_not_hang_on_the_last_bits(case):
    """Beyond it impacts grow, and may die away again: what the neighbours 1e-9 away have is
    rounding, and the kind of the point is what its own orbit has, a rest without duration."""
    shares = 1.0 + 1e-13 * np.random.default_rng(0).uniform(-1.0, 1.0, (12, 5))[case]
    branch = saltus.continue_orbit(ball_whose_rests_end(shares), FREQUENCY, (1.6149, 1.6152))
    assert [str(point.kind) for point in branch.special] == ["CH", "CH"]
    assert [end.reason.name for end in branch.ends] == ["REST_VANISHES", "REST_VANISHES"]


def test_a_branch_of_dying_impacts_ends_at_the_ends_of_its_rests_for_every_asked_range():
    orbit = ball_whose_rests_end(1.0)
    seen = set()
    for bounds in ((1.6149, 1.6152), (1.5, 2.0)):
        branch = saltus.continue_orbit(orbit, FREQUENCY, bounds)
        assert [str(point.kind) for point in branch.special] == ["CH", "CH"]
        assert [end.reason.name for end in branch.ends] == ["REST_VANISHES", "REST_VANISHES"]
        seen.add(tuple(round(point.parameter, 9) for point in branch.special))
    assert len(seen) == 1
