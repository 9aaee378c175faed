"""The mirror symmetry of a forced system: the mirror image of every motion, half a forcing period
later, is a motion too.

The image of an orbit is the same orbit half a period later and, if its period q is odd, mirrored.
An orbit that is its own image is symmetric (q odd), or a shorter one that is gone round twice (q
even).
"""

from __future__ import annotations

import cmath

import numpy as np

from saltus.checks import answered
from saltus.continuation import Corrected, between
from saltus.errors import ParameterError
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.signature import TOLERANCES
from saltus.systems import (
    Constant,
    Harmonic,
    Load,
    Signal,
    System,
    check_system,
    is_its_image_later,
    mirror_of,
    natural_units,
)


@answered
def is_symmetric(system: System) -> bool:
    """Whether the mirror image of every motion, half a forcing period later, is a motion too:
    2 c - theta(t + T/2) for theta(t), with the mirror's centre c.

    It is if the system has a mirror symmetry, declared by its model or found in its equations, and
    the mirrored load is the load half a period later (errata 18).

    Parameters
    ----------
    system
        What moves, under a load with a frequency.

    Examples
    --------
    >>> saltus.orbits.is_symmetric(system)
    True
    """
    check_system(system, "is_symmetric", several_contacts=True, switches=True)
    return has_symmetry(system)


def has_symmetry(system: System) -> bool:
    """`is_symmetric`; False where multipliers hold contacts, as their images are not known."""
    mirrored = system.mirrored()
    if mirrored is None or system.load.period is None:
        return False
    alike = all(
        _half_a_period_later(mirrored.load, system.load, name) for name in system.load.channels
    )
    return alike and is_its_image_later(system)


def _half_a_period_later(one: Load, other: Load, name: str) -> bool:
    """Whether a channel of one load is that of the other half a period later, up to a constant
    position of the ground.
    """
    if one.channels[name].repeats or other.channels[name].repeats:
        return _values_half_a_period_later(one, other, name)
    first = _harmonics(one.channels[name])
    second = _harmonics(other.channels[name])
    if first is None or second is None:
        return False
    orders = {*first, *second} - ({0} if name.startswith("ground") else set())
    pairs = [(first.get(n, 0.0), (-1) ** n * second.get(n, 0.0)) for n in orders]
    largest = max((abs(amplitude) for pair in pairs for amplitude in pair), default=0.0)
    return all(abs(a - b) <= TOLERANCES.load * largest for a, b in pairs)


def _values_half_a_period_later(one: Load, other: Load, name: str) -> bool:
    """The same of channels with corners, by their values between these: a polynomial has few, and
    harmonics beside it are told apart by as many."""
    corners = np.concatenate([one.corners, other.corners, other.corners - 0.5]) % 1.0
    corners = np.unique(np.append(corners, [0.0, 0.5]))
    ends = np.append(corners[1:], 1.0)
    wide = ends - corners > 1e-9
    shares = np.linspace(0.05, 0.95, 9)
    phases = 2.0 * np.pi * (corners[wide, None] + (ends - corners)[wide, None] * shares).ravel()
    first = np.broadcast_to(one.channels[name].derivative(phases, 1.0), phases.shape)
    second = np.broadcast_to(other.channels[name].derivative(phases + np.pi, 1.0), phases.shape)
    moved = np.mean(first - second) if name.startswith("ground") else 0.0
    largest = np.abs(second).max()
    return bool(np.abs(first - second - moved).max() <= TOLERANCES.load * largest)


def _harmonics(signal: Signal) -> dict[int, complex] | None:
    """The complex amplitudes of a signal, by the order of the harmonic; None for signals that are
    not harmonic.
    """
    if isinstance(signal, Constant):
        return {0: signal.value}
    if isinstance(signal, Harmonic):
        return {0: signal.mean, signal.order: signal.amplitude * cmath.exp(1j * signal.phase)}
    total: dict[int, complex] = {}
    for term in getattr(signal, "terms", (None,)):
        amplitudes = None if term is None else _harmonics(term)
        if amplitudes is None:
            return None
        for order, amplitude in amplitudes.items():
            total[order] = total.get(order, 0.0) + amplitude
    return total


# Rounding moves the centre of a mirror by less than this share of its value and of a length.
CENTRE_ROUNDING = 1e-9


def keeps_symmetry(system: System, path: str) -> bool:
    """Whether a system is symmetric and stays so, about the same centre and with the same images in
    coordinates of gaps, as the parameter at `path` changes."""
    if not has_symmetry(system):
        return False
    inner = mirror_of(system.in_gap_coordinates)
    assert inner is not None, "a symmetric system has a mirror"
    centre = np.array(inner.centre)
    value = float(system.get(path))
    for share in (1e-3, -1e-3):
        try:
            # a share of the value, as its unit is not known; of 0 any number is beside it
            beside = system.with_({path: value * (1 + share) if value else share})
        except ParameterError:  # on one side of a limit of the parameter
            continue
        other = mirror_of(beside.in_gap_coordinates) if has_symmetry(beside) else None
        if other is not None and not np.array_equal(other.turn, inner.turn):
            return False  # as where it changes a factor in a sum
        if other is not None and other.centre == inner.centre:
            return True
        if other is not None:
            lengths = natural_units(system.in_gap_coordinates).lengths
            # the parameter moves by a thousandth, and rounding moves the centre by far less
            apart = np.abs(np.array(other.centre) - centre)
            return bool((apart <= CENTRE_ROUNDING * (lengths + np.abs(centre))).all())
    return False


# Shares of the last step: at the end itself the equations are singular.
NEAR_THE_END = (0.99, 0.95, 0.9)
# A shorter last step has no point nearer to the end: its tangent would be rounding.
LAST_STEP = 1e-3


def asymmetry(point: OrbitPoint) -> np.ndarray | None:
    """The difference of an orbit's image from the orbit itself, in natural units.

    None where the signature rules out that the orbit is its own image, or its equations imply it (a
    symmetric signature).
    """
    if point.halves is None:
        return None
    units = point.curve.equations.halved.units.unknowns
    return np.asarray((point.halves[1] - point.halves[0]) / units)


def on_family(point: OrbitPoint, parent: OrbitPoint) -> OrbitPoint | None:
    """The parent's orbit at which a family ends, as a solution of the family's own equations, in
    which both its halves are alike.

    There the family turns back along its images: the tangent leads from the family's `point` beside
    it to that point's image.

    Returns
    -------
    OrbitPoint | None
        The last point of the family's branch; None where the motion cannot be followed.
    """
    difference = asymmetry(point)
    equations = parent.orbit.equations
    assert difference is not None
    unknowns = equations.repeated(parent.solution.unknowns)
    tangent = equations.alternating(difference * equations.units.unknowns)
    found = point.curve.known(unknowns, parent.solution.values)
    if found is None:
        return None
    tangent = np.append(tangent, np.zeros(len(parent.solution.values)))
    last: OrbitPoint = point.curve.point_at(found, tangent / point.curve.norm(tangent))
    return last


def beside_image(point: OrbitPoint, last: OrbitPoint) -> OrbitPoint | None:
    """A point of a family between `point` and its end `last`, as near to the end as the equations
    can be solved.
    """
    chord = last.place - point.place
    if point.curve.norm(chord) < LAST_STEP:
        return None
    for share in NEAR_THE_END:
        beside: OrbitPoint | None = point.curve.solve(
            between(point, last, share), chord / point.curve.norm(chord)
        )
        if beside is not None and not falls_onto_image(point, beside):
            return beside
    return None


def passes_image(a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether a step goes through an orbit that is its own image."""
    before = asymmetry(a)
    after = asymmetry(b)
    return (
        before is not None
        and after is not None
        and bool(before @ after < 0.0)
        and np.abs(before).max() > TOLERANCES.image
    )


def falls_onto_image(a: OrbitPoint, b: OrbitPoint) -> bool:
    """Whether a step has jumped from an orbit that is not its own image onto the branch of orbits
    that are.
    """
    before = asymmetry(a)
    after = asymmetry(b)
    return (
        before is not None
        and after is not None
        and bool(np.abs(before).max() > TOLERANCES.image > 100.0 * np.abs(after).max())
    )


def is_image(point: OrbitPoint, within: float = 1e-2 * TOLERANCES.image) -> bool:
    """Whether an orbit is its own image, although its equations do not imply it."""
    difference = asymmetry(point)
    return difference is not None and bool(np.abs(difference).max() < within)


def parent_of(point: OrbitPoint, within: float = TOLERANCES.grazing_orbits) -> OrbitPoint | None:
    """The orbit of the parent, over half of the period, of an orbit that is its own image up to
    `within`; None for other orbits."""
    if not is_image(point, within):
        return None
    equations = point.curve.equations.halved
    curve = point.curve.with_equations(equations)
    parent: OrbitPoint | None = curve.solve_at(
        point.place, np.append(np.zeros(equations.size), 1.0)
    )
    return parent


def repetition(point: OrbitPoint) -> str | None:
    """Which other orbit an orbit repeats, in words: a symmetric one, or one of a shorter period;
    None if it repeats none.
    """
    difference = asymmetry(point)
    if (
        point.orbit.signature.period % 2
        and difference is not None
        and np.abs(difference).max() < TOLERANCES.grazing_orbits
    ):
        return "symmetric orbit"
    periods = point.orbit.equations.shorter_period(point.solution, TOLERANCES.grazing_orbits)
    return None if periods is None else f"orbit of period {periods}"


def nearest(point: OrbitPoint, place: np.ndarray, other: OrbitPoint) -> np.ndarray | None:
    """A place on the curve of `point`, in the unknowns nearest to those of `other`; None if they
    cannot be compared so.
    """
    equations = point.curve.equations
    n = point.curve.equations.size
    unknowns = equations.nearest(place[:n], place[n:], other)
    return None if unknowns is None else np.concatenate([unknowns, place[n:]])


def half(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """An orbit that is its own mirror image, as a solution of the equations over half its period;
    None for other orbits.
    """
    equations = orbit.equations
    solution = orbit.solution
    both = equations.halves(solution, mirrored=True) if orbit.signature.period % 2 else None
    units = equations.halved.units.unknowns
    if both is None or np.abs((both[1] - both[0]) / units).max() > TOLERANCES.halves:
        return None
    found = PeriodicOrbit.near(equations.halved, both[0], solution.values)
    if found is None or orbit.signature.sides or orbit.signature.events:
        return found
    # without a list of events Newton's method may have found another orbit
    moved = np.abs((found.solution.unknowns - both[0]) / units).max()
    return found if moved < TOLERANCES.halves else None


def divide(orbit: PeriodicOrbit) -> PeriodicOrbit | None:
    """An orbit that repeats after a divisor of its period, as an orbit of this shorter period; None
    for other orbits.
    """
    unknowns = orbit.solution.unknowns
    for q in range(1, orbit.signature.period):
        short = orbit.signature.part(q)
        if short is None:
            continue
        shorter = orbit.equations.with_signature(short)
        found = PeriodicOrbit.near(shorter, unknowns[: shorter.size], orbit.solution.values)
        if found is None:
            continue
        moved = found.solution.unknowns - unknowns[: shorter.size]
        if np.abs(moved / shorter.units.unknowns).max() < TOLERANCES.halves:
            return found
    return None


def full_point(point: OrbitPoint) -> OrbitPoint:
    """A point with a symmetric orbit, on the curve of the equations over its full period."""
    n = point.orbit.equations.size
    other, unknowns = point.orbit.equations.over_full_period(point.place[:n])
    ahead = point.orbit.equations.repeated(point.place[:n] + point.tangent[:n])
    curve = point.curve.with_equations(other)
    found = curve.known(unknowns, point.parameters)
    assert found is not None, "a symmetric orbit can be followed over its full period"
    tangent = np.append(ahead - unknowns, point.tangent[n:])
    there: OrbitPoint = curve.point_at(found, tangent / curve.norm(tangent))
    return there


def half_point(point: OrbitPoint) -> OrbitPoint:
    """A point on the curve of the equations over half its period, if its orbit and the system are
    symmetric; else the point.
    """
    orbit = half(point.orbit) if point.curve.symmetric else None
    if orbit is None:
        return point
    curve = point.curve.with_equations(orbit.equations)
    solution = orbit.solution
    found = Corrected(
        np.append(solution.unknowns, solution.values), solution.evaluation, point.iterations
    )
    tangent = np.append(
        point.tangent[: orbit.equations.size], point.tangent[point.orbit.equations.size :]
    )
    there: OrbitPoint = curve.point_at(found, tangent / curve.norm(tangent))
    return there


def full_period(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """A symmetric orbit as a solution of the equations over its full period."""
    # Newton's method is not used: where the symmetry breaks these equations are singular.
    found = PeriodicOrbit.known(
        *orbit.equations.over_full_period(orbit.solution.unknowns), orbit.solution.values
    )
    assert found is not None, "a symmetric orbit can be followed over its full period"
    return found
