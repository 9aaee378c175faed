"""Within what orbits, impacts and instants are the same: all tolerances by which orbits are compared, with their reasons."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OrbitTolerances:
    """Differences below which two things are one."""

    touch: float = 1e-9  # A gap or a speed below this is a grazing; grazings are located more precisely than that.
    pair: float = 1e-4  # Two impacts vanish together whose phases and speeds differ by less: these go as a square root.
    touching_state: float = 1e-7  # States a period apart where an orbit touches, which is known only to the square root.
    grazing_orbits: float = 1e-5  # The unknowns of two orbits that coincide where both graze.
    same_orbit: float = 1e-6  # Extrema and speeds of impact of one orbit that was found twice.
    image: float = 1e-6  # Rounding alone makes an orbit differ from its own image by less than this.
    halves: float = 1e-7  # The halves of a symmetric orbit: solved to 1e-12, but near a grazing Newton's method leaves more.
    switching: float = 1e-5  # Phases of two events of one contact that vanish together: their speeds go as the third power.
    release: float = 1e-9  # Instants of a release, in forcing periods: releases are isolated, and known to rounding.
    load: float = 1e-12  # Values of a load and of its mirror image half a period later.


TOLERANCES = OrbitTolerances()
