"""The kinds of equations of orbits, and the equations of a signature."""

from __future__ import annotations

from saltus.orbits.contract.equations import ORBIT_TOLERANCE, OrbitEquations
from saltus.orbits.equations.contacts import ContactsEquations
from saltus.orbits.equations.cycles import PERIOD, CycleEquations, FamilyEquations
from saltus.orbits.equations.one_contact import OneContactEquations
from saltus.orbits.equations.whole_motion import WholeMotionEquations
from saltus.orbits.signature import Signature
from saltus.systems import System

# The kinds, in the order in which a motion is read with them: the first admissible orbit is taken.
# The equations from impact to impact are those of all systems that have no others. A cycle without
# a load has its own alone.
KINDS: list[type[OrbitEquations]] = [
    CycleEquations,
    ContactsEquations,
    OneContactEquations,
    WholeMotionEquations,
]


def kinds_of(system: System) -> list[type[OrbitEquations]]:
    """The kinds with which a motion of a system is read."""
    has_forcing = system.load.frequency is not None
    return [kind for kind in KINDS if kind.has_forcing == has_forcing]


def equations_of(
    system: System, signature: Signature, paths: tuple[str, ...] = (), tol: float = ORBIT_TOLERANCE
) -> OrbitEquations:
    """The equations of the orbits of a signature, along the parameters at `paths`."""
    if PERIOD in paths:
        return FamilyEquations(system, signature, paths, tol)
    return next(kind for kind in KINDS if kind.solves(system, signature))(
        system, signature, paths, tol
    )
