"""The verb `prove`: theorems about orbits, special points and branches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import overload

from saltus.bounds import ShootingSettings
from saltus.checks import check_count, check_number
from saltus.errors import ParameterError, shown
from saltus.orbits.branches.special_point import SpecialPoint
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.orbit_proof import OrbitProof, prove_orbit
from saltus.orbits.proofs.special_proof import SpecialProof, prove_special


@overload
def prove(
    result: PeriodicOrbit,
    *,
    within: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
) -> OrbitProof: ...


@overload
def prove(
    result: SpecialPoint,
    *,
    within: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
) -> SpecialProof: ...


def prove(
    result: PeriodicOrbit | SpecialPoint,
    *,
    within: Mapping[str, float] | None = None,
    step: float | None = None,
    order: int | None = None,
) -> OrbitProof | SpecialProof:
    """Prove by interval arithmetic that an orbit or a special point exists, alone in a box.

    Of an orbit: it exists, no other one of its signature is near, its contacts are open between
    impacts, and it is stable or unstable.
    Of a fold, a period doubling, a symmetry breaking or a grazing: an orbit with this property
    exists at a parameter that is enclosed, and it is regular.
    The motion is enclosed by Taylor steps with a bound of their remainder, and the zero of the
    shooting equations by Krawczyk's operator.

    Parameters
    ----------
    result
        An orbit, as from `find_orbit`, or a special point of a branch.
    within
        By its path, how far a number of the system may lie from its double: the theorem holds for
        all of these values.
    step
        The longest Taylor step, also times the forcing frequency; 0.45 by default.
    order
        The order of the Taylor steps; 36 by default.

    Returns
    -------
    OrbitProof | SpecialProof
        With `proved`: True, False where the orbit is refuted, or None with the `reason`.

    Raises
    ------
    ParameterError
        A result of another kind, a path that is no number of the system, a negative radius.

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
    default = ShootingSettings()
    if step is not None:
        check_number("step", step, above=0.0)
    if order is not None:
        check_count("order", order, at_least=4)
    settings = ShootingSettings(
        step=default.step if step is None else float(step),
        order=default.order if order is None else int(order),
    )
    radii = None if within is None else dict(within)
    if isinstance(result, PeriodicOrbit):
        return prove_orbit(result, radii, settings)
    if isinstance(result, SpecialPoint):
        return prove_special(result, radii, settings)
    raise ParameterError(
        f"prove takes a PeriodicOrbit, as from find_orbit, or a SpecialPoint of a branch, got "
        f"{shown(result)}",
        "result",
    )
