"""Quasi-periodic motion: whether a system can have it at all (errata 22), and whether a motion is of this kind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from saltus.attractors.orbit_certificate import certify
from saltus.attractors.stroboscopic_section import check_periodic
from saltus.attractors.zero_one import FEWEST_OF_BANDS, ZeroOne, zero_one_of_bands
from saltus.bounds import area_contraction, enclose, leaves_over_a_period, on_side
from saltus.flow import ContactRegularity, contact_regularity, find_recurrence
from saltus.orbits import PeriodicOrbit
from saltus.systems import System, check_system
from saltus.taylor import trace


def excludes_tori(system: System) -> str | None:
    """Why a system with one coordinate has no quasi-periodic motion, as a sentence; None where it may have one (errata 22).

    Under one forcing frequency a quasi-periodic motion lies on closed curves that the stroboscopic map P (or, where a curve is
    mapped to another one, a power of it) carries onto themselves. There is none where

    * P is continuous on the plane of states, in which the states before and after an impact are one point. It is discontinuous
      only if the contact pushes away on both sides at one instant, as motions beside the state of rest then leave to different
      sides: for equal layers, where V cos(beta0) > 0. It is continuous with bounces from one wall, with a contact that changes
      neither the velocity nor the acceleration, and without a contact;
    * and P shrinks areas: da/dv < 0 on every side, and no impact raises the speed.

    For then P maps the curve onto itself and, being continuous, the area within the curve onto at least the same area, although
    it shrinks areas. Both conditions are checked by interval bounds over the whole forcing period and all states. They are
    sufficient, not necessary: if the bounds decide nothing, the system may have tori.

    Parameters
    ----------
    system
        What moves, with one coordinate, under a load with a frequency.

    Raises
    ------
    ParameterError
        Something that is no system; a load by records or pulses.

    Examples
    --------
    >>> saltus.excludes_tori(system) is not None  # the damping shrinks areas
    True
    """
    check_system(system, "excludes_tori", several_contacts=True)
    check_periodic(system)
    if not system.model.has_state_plane:
        return None
    rate = area_contraction(system)
    continuous = None if rate is None or rate == 0.0 else _continuous(system)
    if continuous is None:
        return None
    assert rate is not None
    if system.load.period is None:
        return f"under constant loads a motion of one coordinate has no room for a torus, and {continuous} and areas shrink"
    left = math.exp(-rate * system.load.period)
    return (
        f"the stroboscopic map is continuous, as {continuous}, and it shrinks areas, in a forcing period to at most {left:.3g} "
        "of what they were, so that it has no invariant closed curve (errata 22)"
    )


def _continuous(system: System) -> str | None:
    """Why the stroboscopic map is continuous, as a part of a sentence; None if the contact may push away on both sides."""
    traced = trace(system)
    if traced.side_count == 0:
        return "the motion has no contact"
    if traced.side_count == 1:
        return "a bounce from one wall joins its states before and after without a gap"
    if contact_regularity(traced, tuple(system.parameters.values())) is ContactRegularity.CONTINUOUS:
        return "neither the velocity nor the acceleration changes at the contact"
    assert traced.contact_acceleration is not None
    pushes = enclose([on_side(s, traced.contact_acceleration) for s in (1, -1)], leaves_over_a_period(system))
    if not np.all(np.minimum(*(push.hi for push in pushes)) < 0.0):
        return None
    if np.all(np.maximum(*(push.hi for push in pushes)) < 0.0):
        return "the load presses on the contact from both sides at all times"
    return "the load never pushes away from the contact on both sides at once"


ORDER = 0.2  # the 0-1 test shows a regular motion where its K is below this, on every n-th state too


@dataclass(frozen=True, eq=False)
class RegularMotion:
    """What is known of a motion whose largest exponent may be 0: an orbit that it approaches slowly, or that it is on a torus."""

    orbit: PeriodicOrbit | None  # an attracting orbit that passes the motion
    zero_one: ZeroOne | None  # the 0-1 test, if it shows order and nothing excludes a torus


def regular_motion(system: System, state: np.ndarray, periods: int, tol: float) -> RegularMotion:
    """Whether a motion from a state (d,) whose largest exponent is 0, as far as that is known, is on a torus.

    It is if nothing excludes tori, if the 0-1 test of its coordinate sees order in all of the states at phase 0 and in every n-th
    of them, and if no attracting orbit is near, which it might approach slowly.
    """
    if periods < FEWEST_OF_BANDS or excludes_tori(system) is not None:
        return RegularMotion(None, None)
    ends = find_recurrence(system, state[None], periods, kept=periods, tol=tol)
    if not ends.unsettled[0]:
        return RegularMotion(None, None)
    found = zero_one_of_bands(ends.states[0, :, 0])
    if found.K >= ORDER:
        return RegularMotion(None, None)
    certificate = certify(system, ends.last[0], None)
    return RegularMotion(certificate.orbit, None) if certificate.sound else RegularMotion(None, found)
