"""Where a rest has no duration left, or a release is no longer made: how the motion, and with it a
branch, goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from saltus.continuation import Evidence
from saltus.flow import load_releases
from saltus.orbits.beyond.orbit_curve import OrbitPoint
from saltus.orbits.beyond.special_point import SpecialKind, SpecialPoint
from saltus.orbits.contract.equations import Restart
from saltus.systems import arguments_of


@dataclass(frozen=True)
class RestSettings:
    """How far ahead the end of a rest is looked beyond, and how the loss of a release is
    located.
    """

    # Shares of the parameter's value (of a third of its range where that is 0) at which orbits are
    # looked for beyond the end of a rest, tried in turn.
    after_rest: tuple[float, ...] = (1e-5, 1e-4, 1e-3)
    # Ahead of an orbit that has nearly shrunk to rest the loss of its release is looked for from
    # this share of the range on, doubled so many times, and located to this relative precision; the
    # peak of the pull from this phase before the release.
    nearest_loss: float = 1e-9
    doublings: int = 24
    narrow: float = 1e-12
    behind: float = 0.05


SETTINGS = RestSettings()


def as_the_motion_goes_on(point: OrbitPoint) -> Restart:
    """Beyond the end of a rest: the impacts no longer die away, and the orbit has many of them.
    Ever more of them come towards the end of the rest, where grazings accumulate. The orbits are
    then those of a branch of its own, which is begun a little farther ahead."""
    way = point.tangent[-len(point.parameters) :]
    sizes = np.abs(point.parameters)
    way = way / np.linalg.norm(way / np.where(sizes > 0.0, sizes, point.curve.scales))
    state = arguments_of(point.orbit.system, point.orbit.section_state) | point.orbit.remembered
    values = [point.parameters + distance * way for distance in SETTINGS.after_rest]
    return Restart(state, values)


def last_release(point: OrbitPoint) -> SpecialPoint | None:
    """The parameter ahead of an orbit that has nearly shrunk to rest at which the load only just
    pulls a single contact open (RL); None where it is not near."""
    from scipy.optimize import brentq

    equations = point.curve.equations
    orbit = point.orbit
    value = point.parameter
    known = () if orbit.system.model.holds_coordinates else load_releases(orbit.system)
    if not known:
        return None

    def pull(at: float) -> float:
        """The least of the peaks of the pull after these releases, with the parameter at a
        value.
        """
        system = equations.system_at(np.array([at]))
        turns = [(release, release.time * orbit.frequency) for release in known]
        return min(release.peak_near(system, phase - SETTINGS.behind) for release, phase in turns)

    reach = SETTINGS.nearest_loss * point.curve.scales[0]
    before = pull(value)
    for _ in range(SETTINGS.doublings):
        beyond = value + reach * np.sign(point.tangent[-1])
        if (after := pull(beyond)) < 0.0:
            narrow = SETTINGS.narrow * abs(beyond)
            lost = float(brentq(pull, value, beyond, xtol=narrow, rtol=1e-15))
            place = np.append(point.place[:-1], lost)
            evidence = Evidence(point.residual, (narrow,), before, after, pull(lost))
            return SpecialPoint(SpecialKind.RL, replace(point, place=place), evidence)
        reach *= 2.0
    return None
