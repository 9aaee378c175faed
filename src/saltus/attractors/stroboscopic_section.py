"""The stroboscopic section of a system: its states at phase 0 of the load, and the certificate that
a motion that repeats itself there is on an attracting orbit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import MotionError, ParameterError
from saltus.flow import EventKind, Stop, motions_from, nearest_return, simulate, stroboscopic
from saltus.orbits import (
    PeriodicOrbit,
    Signature,
    equations_of,
    find_orbit,
    orbit_from,
    relays_at,
)
from saltus.systems import (
    Load,
    System,
    arguments_of,
    check_system,
    units_with_sides,
)


def with_clock(system: System) -> System:
    """The system with a forcing period, which fixes the stroboscopic section: its load's, or 2 pi
    under a constant load.

    Equilibria are then orbits of period 1.

    Raises
    ------
    ParameterError
        Something that is no system, or a load of records or pulses, which never repeats.
    """
    check_system(
        system,
        "the search of attractors",
        several_contacts=True,
        multipliers=True,
        switches=True,
        resets=True,
        relays=True,
    )
    check_periodic(system)
    if system.load.frequency is not None:
        return system
    return System(
        model=system.model, load=Load(frequency=1.0, **system.load.channels), impact=system.impact
    )


def check_periodic(system: System) -> None:
    """Refuse loads by records of samples and by pulses, under which motions have no long-term
    behaviour.

    Raises
    ------
    ParameterError
        The load does not repeat; the error names the channel.
    """
    for name, signal in system.load.channels.items():
        if signal.once:
            kind = next(
                type(term).__name__ for term in getattr(signal, "terms", (signal,)) if term.once
            )
            raise ParameterError(
                (
                    f"load.{name} is a {kind}, which does not repeat, so nothing settles under it; "
                    "use Harmonic"
                ),
                f"load.{name}",
            )


def is_constant(load: Load) -> bool:
    """Whether no channel varies: the section is then the phase plane, and orbits of period 1 are
    equilibria.
    """
    return not any(signal.periodic for signal in load.channels.values())


def is_unforced(system: System) -> bool:
    """Whether nothing that acts on a system varies with time: its motions may be shifted in time,
    and a cycle of it has no forcing period, whatever the base frequency of its load is.
    """
    for signal in system.load.channels.values():
        for term in getattr(signal, "terms", (signal,)):
            if term.once or (term.periodic and getattr(term, "amplitude", 1.0) != 0.0):
                return False
    return True


def without_clock(system: System) -> System:
    """A system on which nothing acts that varies with time, under a load without a frequency."""
    if system.load.frequency is None:
        return system
    channels = {
        name: float(signal.derivative(0.0, system.load.frequency))
        for name, signal in system.load.channels.items()
    }
    return System(model=system.model, load=Load(**channels), impact=system.impact)


# states of a cycle that stand for its curve
CURVE_STATES = 2048


def cycle_states(orbit: PeriodicOrbit) -> np.ndarray:
    """The states of a cycle over a period, (n, d), evenly spaced in time."""
    motion = orbit.motion()
    times = np.linspace(motion.start, motion.time, CURVE_STATES, endpoint=False)
    position, velocity = motion.at(times)
    states = np.concatenate([np.atleast_2d(position), np.atleast_2d(velocity)]).T
    states[:, states.shape[1] - len(orbit.system.model.first_order) :] = 0.0
    return np.concatenate([states, relays_at(motion, times)], axis=1)


def section_of(orbit: PeriodicOrbit) -> np.ndarray:
    """The state of an orbit at phase 0, and behind it the sides of relays."""
    return np.append(orbit.section_state, state_sides(orbit))


def state_sides(orbit: PeriodicOrbit) -> list[float]:
    """The sides of relays of an orbit at phase 0, +1 or -1."""
    return [1.0 if on else -1.0 for on in orbit.remembered.get("relays", {}).values()]


def certify_cycle(system: System, state: np.ndarray) -> Certificate:
    """The cycle on which a motion from a state (d,) settles, of a system on which nothing acts that
    varies with time.
    """
    free = without_clock(system)
    try:
        orbit = find_orbit(free, **arguments_of(free, state))
    except MotionError:
        return Certificate(None, np.inf, SETTINGS.slow)
    return Certificate(orbit, 0.0, SETTINGS.slow)  # the motion was followed until it is there


def section_states(
    system: System, states: np.ndarray, periods: float, tol: float = 1e-13
) -> np.ndarray:
    """The states after 1, 2, ...

    forcing periods from states (n, d) at phase 0, (n, periods, d); or after half a period.
    """
    return stroboscopic(system, motions_from(system, states, periods=periods, last="all", tol=tol))


@dataclass(frozen=True)
class CertificateSettings:
    """How well an orbit must agree with a motion."""

    residual: float = 1e-9  # The largest residual of its equations.
    # The largest distance of the orbit from itself after a period of direct simulation, and from
    # the states of the motion.
    defect: float = 1e-6
    # The largest distance from the states of a motion that approaches it slowly.
    slow: float = 1e-3
    approach: int = 64  # Forcing periods over which such a motion must come nearer to it.
    neutral: float = 1e-9  # A multiplier this near to 1 does not show that an orbit attracts.
    # The longest step in a forcing period, in natural units, of a motion that may creep: in n
    # periods a step becomes as short as 1/n^2.
    step: float = 1e-4


SETTINGS = CertificateSettings()


@dataclass(frozen=True, eq=False)
class Certificate:
    """The orbit on which a motion is, as far as one was found, and how near it is."""

    orbit: PeriodicOrbit | None
    distance: float  # between states of the motion and of the orbit at phase 0, the nearest ones
    within: float  # the largest distance at which the motion counts as being on the orbit

    @property
    def doubt(self) -> str | None:
        """Why the motion is not certified to be on the orbit; None if it is."""
        orbit = self.orbit
        if orbit is None:
            return "Newton's method finds no orbit there"
        if not orbit.admissible or not orbit.residual < SETTINGS.residual:
            return f"no admissible orbit solves the equations there (residual {orbit.residual:.1g})"
        if orbit.grazes:
            return "the orbit there touches the contact without speed, and has no multipliers"
        if orbit.creeps:
            return (
                "it creeps to where it sticks for good: the largest multiplier there, "
                f"{abs(orbit.multipliers[0]):.9g}, is 1 within its own accuracy"
            )
        largest = orbit.largest_multiplier
        if not orbit.stable or largest > 1.0 - SETTINGS.neutral:
            return f"the orbit there does not attract: its largest multiplier is {largest:.9g}"
        if not orbit.defect < SETTINGS.defect:
            return f"in direct simulation the orbit there misses itself by {orbit.defect:.1g}"
        if not self.distance < self.within:
            return f"the orbit found passes {self.distance:.1g} beside the motion"
        return None

    @property
    def sound(self) -> bool:
        """Whether the motion is on an attracting orbit."""
        return self.doubt is None

    @property
    def evidence(self) -> dict[str, Any]:
        """The numbers, by name."""
        if self.orbit is None:
            return {}
        multiplier = self.orbit.largest_multiplier
        return {
            "residual": self.orbit.residual,
            "largest_multiplier": multiplier,
            "largest_exponent": math.log(multiplier) / self.orbit.duration
            if multiplier > 0.0
            else -math.inf,
            "defect": self.orbit.defect,
            "distance": self.distance,
            "amplitude": self.orbit.amplitude,
            "impacts": self.orbit.impact_count,
        }


def certify(
    system: System, state: np.ndarray, period: int | None, max_period: int = 16
) -> Certificate:
    """The orbit of a motion with this state (d,) at phase 0, which repeats itself after `period`
    forcing periods.

    Without a period, that of the nearest return within `max_period` is tried; the motion may then
    be farther from the orbit, as it is still on its way to it.
    """
    later = section_states(system, state[None], period or max_period, tol=1e-12)[0]
    states = np.concatenate([[state], later])
    units = units_with_sides(system)
    q = period or nearest_return(states[::-1], max_period, units)
    orbit = solved_orbit(system, state, q, admissible=False)
    within = SETTINGS.defect if period else SETTINGS.slow
    if orbit is None:
        return Certificate(None, np.inf, within)
    apart = np.abs((states[:q] - section_of(orbit)) / units).max(axis=1)
    return Certificate(orbit, float(apart.min()), within)


def approached_orbit(
    system: System, state: np.ndarray, max_period: int, within: float
) -> PeriodicOrbit | None:
    """The stable orbit to which a motion from a state (d,) at phase 0 comes slowly, as beside a
    period doubling or a torus; None where Newton's method finds none.

    The motion must be near the orbit and come nearer to it.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.
    state
        The state.
    max_period
        The longest period of the orbit, in forcing periods.
    within
        How far the motion may be from the orbit, as a share of the orbit's amplitude.
    """
    later = section_states(system, state[None], SETTINGS.approach, tol=1e-12)[0]
    states = np.concatenate([[state], later])
    units = units_with_sides(system)
    orbit = solved_orbit(system, state, nearest_return(states[::-1], max_period, units))
    if orbit is None or not orbit.stable or orbit.period > max_period:
        return None
    q = orbit.period
    apart = np.abs((states - section_of(orbit)) / units).max(axis=1)
    apart = apart[int(np.argmin(apart[:q])) :: q]  # at the phase of the orbit's own state
    quarter = max(1, len(apart) // 4)
    is_near = apart[0] <= within * orbit.size / orbit.equations.natural.length
    return orbit if is_near and apart[-quarter:].max() < apart[:quarter].max() else None


def creeping_orbit(system: System, states: np.ndarray) -> PeriodicOrbit | None:
    """The orbit towards which a motion with these last states (kept, d) at phase 0 creeps, slower and
    slower, to stick there for good; None if it does not.
    """
    if not system.model.frictions or len(states) < 2:
        return None
    last = np.abs((states[-1] - states[-2]) / units_with_sides(system)).max()
    if not last < SETTINGS.step:  # also for nan
        return None
    orbit = solved_orbit(system, states[-1], 1)
    return orbit if orbit is not None and orbit.creeps else None


def solved_orbit(
    system: System, state: np.ndarray, period: int, admissible: bool = True
) -> PeriodicOrbit | None:
    """The orbit of this period near a motion from a state (d,) at phase 0; None if Newton's method
    finds none.
    """
    try:
        orbit = orbit_from(
            equations_of(system, Signature((), 1)), arguments_of(system, state), period
        )
    except MotionError:
        return None
    return orbit if orbit is not None and (orbit.admissible or not admissible) else None


def stays_at_rest(system: System, state: np.ndarray) -> bool:
    """Whether contacts or frictions hold a state (d,) at rest over a whole forcing period; it then
    stays, as the load repeats.
    """
    if not system.model.holds_coordinates:
        return False
    motion = simulate(system, **arguments_of(system, state), periods=1, dense=False)
    lets_go = (EventKind.IMPACT, EventKind.RELEASE, EventKind.SLIP)
    return motion.stop is Stop.REST and not any(event.kind in lets_go for event in motion.events)
