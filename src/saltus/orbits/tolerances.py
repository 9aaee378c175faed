"""All tolerances with which orbits, impacts and instants are compared, with their reasons."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OrbitTolerances:
    """Differences below which two things are the same."""

    touch: float = 1e-9  # A gap or a speed below this is 0, at a grazing; grazings are located more precisely than that.
    pair: float = 1e-4  # Phases and speeds of two impacts that vanish together: they fall as a square root of the parameter.
    touching_state: float = 1e-7  # States a period apart of an orbit that touches: they are known to the root of rounding only.
    grazing_orbits: float = 1e-5  # The unknowns of two orbits that coincide where both graze.
    same_orbit: float = 1e-6  # Extrema and speeds of impact of one orbit that was found twice.
    image: float = 1e-6  # An orbit and its own image: rounding alone makes a smaller difference.
    halves: float = 1e-7  # The halves of a symmetric orbit: solved to 1e-12, but near a grazing Newton's method leaves more.
    switching: float = 1e-5  # Phases of two events of one contact that vanish together: speeds fall as the third power of these.
    release: float = 1e-9  # Instants of a release, in forcing periods: releases are isolated, and known to rounding.
    # Moduli of multipliers on the unit circle: those without damping, and at a special point that is located to rounding.
    on_circle: float = 1e-9
    load: float = 1e-12  # Values of a load and of its mirror image half a period later.


TOLERANCES = OrbitTolerances()
