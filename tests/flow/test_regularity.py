"""What a contact does to a motion is known from the traced expressions; what is proved of it holds
for the motion's map.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from shared_systems import rocking, walled
from soft_stops import SoftStop, soft_stop

from saltus import OneContactModel
from saltus.flow import ContactRegularity, contact_regularity, program, simulate
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    RockingBlock,
    System,
    VelocityReduction,
    numbers,
)

IMPACT, JUMP, CONTINUOUS = ContactRegularity


def regularity(system, free=()):
    return contact_regularity(
        program(system).trace, tuple(value for _, value in numbers(system)), free
    )


@dataclass(frozen=True, kw_only=True)
class Rewritten(SoftStop):
    """The soft stop with its spring's force as the difference of two forces from x = 0: continuous
    in exact arithmetic alone.
    """

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        beyond = (1 - side) / 2
        pull = (self.stiffness + beyond * self.stop) * x - self.stop * self.edge * beyond
        return load.force(t) - self.damping * velocity - pull


class Relay(OneContactModel):
    """x'' = -x - sign(x): a force that jumps."""

    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -x - side


class Smooth(OneContactModel):
    """x'' = sin(1 - x) - sin(1 + x) tanh(x) / ..., the same expression on both sides in other
    words.
    """

    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return np.sin(1.0 - side * x) * np.cos(side * velocity) - 2.0 * abs(x)


def metainterface(e=1.0, **load):
    impact = VelocityReduction(e)
    return System(
        model=Metainterface(beta0=1.4, damping=0.1), load=Load(frequency=1.0, **load), impact=impact
    )


@pytest.mark.parametrize(
    ("system", "expected"),
    [
        (soft_stop(), CONTINUOUS),
        # its force jumps by 0.3 v, so by nothing at zero speed
        (soft_stop(damper=0.3), CONTINUOUS),
        (soft_stop(preload=0.2), JUMP),
        (soft_stop(preload=1e-300), JUMP),
        (soft_stop(e=0.9), IMPACT),
        (soft_stop(e=1.0 - 2.0**-53), IMPACT),
        (soft_stop(Rewritten, stop=3.1, edge=0.7), CONTINUOUS),
        (System(model=Relay()), JUMP),
        (System(model=Smooth()), CONTINUOUS),
        # V = 0: both layers are pushed alike
        (metainterface(horizontal=Harmonic(0.5)), CONTINUOUS),
        (metainterface(horizontal=Harmonic(0.5), vertical=-0.5), JUMP),
        (metainterface(horizontal=Harmonic(0.5), vertical=Harmonic(0.0)), CONTINUOUS),
        (metainterface(0.9, horizontal=Harmonic(0.5)), IMPACT),
        (walled(), IMPACT),
        (rocking(), IMPACT if rocking().impact != VelocityReduction(1.0) else JUMP),
        (System(model=RockingBlock(alpha=0.2), impact=VelocityReduction(1.0)), JUMP),
        (System(model=Metainterface(beta0=1.4, smoothing=50.0)), CONTINUOUS),  # without a contact
        # the identity, but not provably
        (System(model=Metainterface(beta0=1.4), impact=EnergyRestitution(1.0)), IMPACT),
    ],
)
def test_regularity_is_known_from_the_expressions(system, expected):
    assert regularity(system) is expected


def test_what_varies_along_a_branch_is_not_taken_as_the_number_that_it_is():
    load = {"horizontal": Harmonic(0.5), "vertical": 0.0}
    assert (
        regularity(metainterface(**load), ("load.horizontal.amplitude", "load.frequency"))
        is CONTINUOUS
    )
    assert regularity(metainterface(**load), ("load.vertical",)) is JUMP
    assert regularity(metainterface(**load), ("impact.e",)) is IMPACT
    assert regularity(soft_stop(), ("model.edge", "model.stop", "model.damping")) is CONTINUOUS


@pytest.mark.parametrize(
    ("numbers_of", "power"),
    [
        ({}, 1.5),
        ({"damper": 0.4}, 1.5),
        ({"preload": -0.3}, 0.5),
        ({"preload": 0.4}, 0.5),
        ({"e": 0.8}, 0.5),
    ],
)
def test_the_term_of_a_grazing_in_the_map_has_the_power_that_its_contact_has(numbers_of, power):
    """x'' = 0 up to the stop, thrown at it with the depth d to come: what the stop adds to the
    motion goes as d^power.

    The force -0.5 turns the motion round 1 after the start; without the stop the end would be a
    parabola's.
    """
    system = soft_stop(
        edge=0.0, stiffness=0.0, damping=0.0, stop=2.0, amplitude=0.0, mean=-0.5, **numbers_of
    )
    depths, shift = np.array([1e-4, 1e-5, 1e-6]), []
    for depth in depths:
        # the free motion's highest point is x + v^2 / (2 0.5), after a time of 1
        speed, duration = 0.5, 2.0
        start = depth - speed**2
        motion = simulate(system, x=start, velocity=speed, duration=duration, tol=1e-14)
        free = np.array([start + speed * duration - 0.25 * duration**2, speed - 0.5 * duration])
        shift.append(np.abs([motion.x - free[0], motion.velocity - free[1]]).max())
    slopes = np.diff(np.log(shift)) / np.diff(np.log(depths))
    assert slopes == pytest.approx([power, power], abs=0.05)
    assert math.isfinite(shift[-1])
