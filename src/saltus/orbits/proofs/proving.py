"""The verb `prove`: theorems about orbits, special points and branches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import overload

from saltus.bounds import ShootingSettings, rounded_up
from saltus.checks import check_count, check_number
from saltus.errors import ParameterError, SaltusError, near, shown
from saltus.orbits.beyond.special_point import SpecialPoint
from saltus.orbits.beyond.symmetry import is_symmetric
from saltus.orbits.branches.branch import Branch
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.branch_proof import BranchProof, prove_branch
from saltus.orbits.proofs.orbit_proof import OrbitProof, prove_orbit
from saltus.orbits.proofs.special_proof import SpecialProof, prove_special
from saltus.progress import Progress, silent
from saltus.systems import Harmonic, System, natural_units, numbers

# The equations of a proof are solved with dense matrices: more unknowns take minutes.
MOST_UNKNOWNS = 4000
# By so large a share each number is moved, to see whether the mirror symmetry holds without it.
MOVED = 0.1


@overload
def prove(
    result: PeriodicOrbit,
    *,
    radii: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
) -> OrbitProof:
    """Prove that an orbit exists, is alone near it, keeps its contacts open, and is stable or
    not.
    """


@overload
def prove(
    result: SpecialPoint,
    *,
    radii: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
) -> SpecialProof:
    """Prove a fold, a period doubling, a symmetry breaking or a grazing, and enclose its
    parameter.
    """


@overload
def prove(
    result: Branch,
    *,
    radii: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
    most_boxes: int = 2000,
    progress: Progress = silent,
) -> BranchProof:
    """Prove pieces of a branch, box by box, and its special points."""


def prove(
    result: PeriodicOrbit | SpecialPoint | Branch,
    *,
    radii: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
    most_boxes: int = 2000,
    progress: Progress = silent,
) -> OrbitProof | SpecialProof | BranchProof:
    """Prove by interval arithmetic that an orbit, a special point or a branch exists.

    Of an orbit: it exists, no other one of its signature is near, its contacts are open between
    impacts, and it is stable or unstable. Of a fold, a period doubling, a symmetry breaking or a
    grazing: an orbit with this property exists at a parameter that is enclosed, and it is regular.
    Of a branch: each of its special points, and that its points lie on connected curves of orbits.
    Each point is alone in one of many boxes along the arclength, with signs of its turns and with
    stability; some 20 to 50 boxes take a second. The motion is enclosed by Taylor steps with a
    bound of their remainder, and the zero of the shooting equations by Krawczyk's operator.

    Parameters
    ----------
    result
        An orbit, as from `find_orbit`, a special point of a branch, or a branch.
    radii
        By its path, how far a number of the system may lie from its double: the theorem holds for
        all of these values.
    step
        The longest Taylor step, in the time in which the system moves by itself; 0.35 by default.
    order
        The order of the Taylor steps; 36 by default.
    most_boxes
        After so many boxes the proof of a branch stops, and says so; with 0 only its special points
        are proved.
    progress
        Called with the share of a branch's points that are done.

    Returns
    -------
    OrbitProof | SpecialProof | BranchProof
        With `proved`: True, False where the orbit is refuted, or None with the `reason`; of a
        branch, an entry for each point.

    Raises
    ------
    ParameterError
        A result of another kind, a path that is no number of the system, or a negative radius; a
        radius on a whole number or, of a symmetric orbit, on a number that breaks the symmetry; a
        step so short that the equations have too many unknowns.

    Examples
    --------
    >>> proof = saltus.prove(orbit)
    >>> proof.proved, proof.stable
    (True, True)
    >>> saltus.prove(branch.special[0]).statement[:40]
    'Metainterface has a periodic orbit of 1 '

    References
    ----------
    R. Krawczyk, Computing 4 (1969); S. M. Rump, Acta Numerica 19 (2010); N. S. Nedialkov, K. R.
    Jackson and J. D. Pryce, Reliable Computing 7 (2001); K. Church and C. Fortin (2021) prove orbits
    of gravitational billiards, whose flights are parabolas.
    """
    check_proof(_system_of(result), radii, step, order, most_boxes)
    _check_mirror(result, radii or {})
    if step is not None:
        _check_step(result, float(step))
    default = ShootingSettings()
    settings = ShootingSettings(
        step=default.step if step is None else float(step),
        order=default.order if order is None else int(order),
    )
    widths = None if radii is None else dict(radii)
    if isinstance(result, PeriodicOrbit):
        return prove_orbit(result, widths, settings)
    if isinstance(result, SpecialPoint):
        return prove_special(result, widths, settings)
    return prove_branch(result, widths, settings, int(most_boxes), progress)


def _system_of(result: PeriodicOrbit | SpecialPoint | Branch) -> System:
    return _orbits_of(result)[0].system


def _orbits_of(result: PeriodicOrbit | SpecialPoint | Branch) -> list[PeriodicOrbit]:
    if isinstance(result, PeriodicOrbit):
        return [result]
    if isinstance(result, SpecialPoint):
        return [result.orbit]
    if isinstance(result, Branch):
        return [point.orbit for point in result.points]
    raise ParameterError(
        "prove takes a PeriodicOrbit, as from find_orbit, a SpecialPoint or a Branch, got "
        f"{shown(result)}",
        "result",
    )


def check_proof(
    system: System,
    radii: Mapping[str, float] | None,
    step: float | None,
    order: int | None,
    most_boxes: int = 0,
) -> None:
    """Refuse arguments of `prove` without meaning.

    Raises
    ------
    ParameterError
        The error has the argument and its value.
    """
    names = [name for name, _ in numbers(system)]
    for name, radius in (radii or {}).items():
        if name not in names:
            raise ParameterError(
                f"radii names {name!r}, which is not a number of the system; {near(name, names)}",
                f"radii.{name}",
            )
        check_number(f"radii.{name}", radius, at_least=0.0)
        owner, _, last = name.rpartition(".")
        if radius and last == "order" and isinstance(system.get(owner), Harmonic):
            raise ParameterError(
                f"{name} is a whole number, which has no values nearby; leave it out of radii",
                f"radii.{name}",
            )
    if step is not None:
        check_number("step", step, above=0.0)
    if order is not None:
        check_count("order", order, at_least=4)
    check_count("most_boxes", most_boxes, at_least=0)


def _check_mirror(
    result: PeriodicOrbit | SpecialPoint | Branch, radii: Mapping[str, float]
) -> None:
    """Refuse radii under which half a period of a symmetric orbit does not stand for the other."""
    names = [name for name, radius in radii.items() if radius]
    symmetric = [orbit for orbit in _orbits_of(result) if orbit.symmetric] if names else []
    if not symmetric:
        return
    system = symmetric[0].system
    for name in names:
        if not _is_symmetric_without(system, [name]):
            raise ParameterError(
                f"the orbit is symmetric, and with another {name} its mirror symmetry was not "
                f"shown; leave {name} out of radii",
                f"radii.{name}",
            )
    if not _is_symmetric_without(system, names):
        raise ParameterError(
            "the orbit is symmetric, and its mirror symmetry was not shown for other values "
            "of all numbers in radii together; leave some of them out",
            "radii",
        )


def _is_symmetric_without(system: System, names: list[str]) -> bool:
    """Whether the system has its mirror symmetry wherever some of its numbers are moved, one more
    than the other; what is 0 is moved by a share of the largest number."""
    values = dict(numbers(system))
    largest = max(abs(float(value)) for value in values.values())
    shown = False
    for sign in (1.0, -1.0):
        moved = {
            name: float(values[name]) + sign * MOVED / (1 + i) * (abs(values[name]) or largest)
            for i, name in enumerate(names)
        }
        try:
            other = system.with_(moved)
        except SaltusError:
            continue  # no value of this number; the other direction may be one
        if not is_symmetric(other):
            return False
        shown = True
    return shown


def _check_step(result: PeriodicOrbit | SpecialPoint | Branch, step: float) -> None:
    """Refuse a step with which the equations have more than MOST_UNKNOWNS unknowns."""
    for orbit in _orbits_of(result):
        states = 2 * len(orbit.system.model.coordinates)
        states *= 1 if isinstance(result, PeriodicOrbit) else 2  # with the kernel vector
        length = orbit.signature.span * 2.0 * math.pi / orbit.frequency
        # in units of `step`
        length /= natural_units(orbit.system).own_time
        if states * (length / step) > MOST_UNKNOWNS:
            least = states * length / MOST_UNKNOWNS
            raise ParameterError(
                f"step must be at least {rounded_up(least)} here, as shorter ones would give the"
                f" equations more than {MOST_UNKNOWNS} unknowns, got {step:g}",
                "step",
            )
