"""The instants at which a periodic load pulls a resting system off its contact; they alone
determine the motion after rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.checks import answered
from saltus.errors import ParameterError
from saltus.systems import ContactModel, Load, System, check_system, mass_and_force

# per forcing period and order of the highest harmonic: the contact acceleration has no narrower
# peak
RELEASE_SAMPLES = 64


@dataclass(frozen=True)
class Release:
    """A release: a root of a contact acceleration, from which on it pulls, so that rest ends.

    Attributes
    ----------
    time
        Its instant in the forcing period, in [0, T).
    side
        The side on which the gap then opens; with several contacts the number of the contact, from
        1 on.
    peak
        The largest pull before the acceleration presses again; where it is 0 the release is lost.

    Examples
    --------
    >>> resting = system.with_({"load.horizontal.amplitude": 0.15, "impact.e": 0.3})
    >>> first = saltus.flow.load_releases(resting)[0]
    >>> float(0.15 * np.sin(first.time) / saltus.theory.critical_horizontal(np.deg2rad(80), -0.5))  # the load is at Hcr
    0.9999999999999999
    """

    time: float
    side: int
    peak: float

    def peak_near(self, system: System, phase: float) -> float:
        """The first peak of the contact acceleration on its side after a phase of the load, even if
        it does not pull there.

        Parameters
        ----------
        system
            The system, or one with other numbers.
        phase
            The phase of the load, rad.
        """
        period = system.load.period
        assert period is not None
        after = [
            ((2.0 * np.pi * t / period - phase) % (2.0 * np.pi), value)
            for t, value in _peaks(system, self.side)
        ]
        return min(after)[1] if after else float("-inf")


def contact_pull(system: System, side: int) -> Callable[[Any], Any]:
    """The second derivative of the gap of a system at rest at the contact, on a side, as a function
    of time.

    The system stays at rest while it is negative on all sides. With several contacts `side` is the
    number of a contact, from 1 on, and the function is the force along the contact's sign with all
    contacts closed.
    """
    model = system.model
    load = system.load
    if model.contacts:
        held = model.contacts[side - 1]
        names = model.coordinates
        place = {contact.coordinate: float(contact.position) for contact in model.contacts}
        position = [place.get(name, 0.0) for name in names]
        i = names.index(held.coordinate)
        return lambda t: (
            held.sign
            * np.asarray(_force_at_rest(system.contact_model, t, position, load)[i], dtype=float)
        )
    contact = float(model.contact)
    one = system.one_contact
    rate = float(one.gap(contact + 1.0, side)) - float(one.gap(contact, side))
    return lambda t: (
        rate * np.asarray(model.acceleration(t, contact, 0.0, float(side), load), dtype=float)
    )


def _force_at_rest(model: ContactModel, t: Any, position: list[float], load: Load) -> list[Any]:
    """r(t, q, 0), as a list."""
    one = len(position) == 1
    q, v = (position[0], 0.0) if one else (tuple(position), (0.0,) * len(position))
    return mass_and_force(model, t, q, v, load)[1]


@answered
def load_releases(system: System) -> tuple[Release, ...]:
    """The releases of one forcing period, in the order of time; none for a load that always
    presses, always pulls or has no period.

    For load (i) of the metainterface with equal layers, the releases to side +1 are at sin(Omega t)
    = Hcr / Hhat, with Hcr = abs(V / tan(beta0)), and those to side -1 half a period later.

    Parameters
    ----------
    system
        What moves, under a load with a frequency.

    Examples
    --------
    >>> resting = system.with_({"load.horizontal.amplitude": 0.15, "impact.e": 0.3})
    >>> [release.side for release in saltus.flow.load_releases(resting)]
    [1, -1]
    """
    check_system(system, "load_releases", several_contacts=True)
    if system.dependent:
        raise ParameterError(
            "load_releases is for systems whose contacts can all be closed, and here gaps depend "
            "on others",
            "system",
        )
    system = system.in_gap_coordinates
    if system.load.period is None:
        return ()
    sides = system.model.sides or range(1, 1 + len(system.model.contacts))
    found = [release for side in sides for release in _of_side(system, side)]
    return tuple(sorted(found, key=lambda release: release.time))


def _grid(system: System) -> np.ndarray:
    period = system.load.period
    assert period is not None
    orders = [
        getattr(term, "order", 1)
        for s in system.load.channels.values()
        for term in getattr(s, "terms", (s,))
    ]
    count = RELEASE_SAMPLES * max(orders, default=1)
    return np.arange(count) * (period / count)


def _peaks(system: System, side: int) -> list[tuple[float, float]]:
    """The maxima of the contact acceleration on a side: their times and values."""
    from scipy.optimize import minimize_scalar

    pull = contact_pull(system, side)
    times = _grid(system)
    values = np.broadcast_to(pull(times), times.shape)
    step = times[1]
    peaks = []
    for i in np.flatnonzero((values >= np.roll(values, 1)) & (values > np.roll(values, -1))):
        best = minimize_scalar(lambda t: -float(pull(t)), bounds=(times[i] - step, times[i] + step), method="bounded",
                               options={"xatol": 1e-10 * step})  # fmt: skip
        at_sample = (float(times[i]), float(values[i]))
        peaks.append(max((float(best.x), -float(best.fun)), at_sample, key=lambda peak: peak[1]))
    return peaks


def _of_side(system: System, side: int) -> list[Release]:
    """The releases to a side: the rising roots before peaks that pull, each once, with the largest
    of its peaks.
    """
    from scipy.optimize import brentq

    pull = contact_pull(system, side)
    period = system.load.period
    times = _grid(system)
    assert period is not None
    step = times[1]
    roots = dict[float, float]()
    for time, peak in _peaks(system, side):
        if peak <= 0.0:
            continue
        low = next((t for t in time - step * np.arange(1, times.size) if pull(t) < 0.0), None)
        if low is None:
            continue
        root = (
            float(brentq(lambda t: float(pull(t)), low, time, xtol=1e-15 * period, rtol=1e-15))
            % period
        )
        known = next(
            (
                t
                for t in roots
                if abs((t - root + 0.5 * period) % period - 0.5 * period) < 1e-9 * period
            ),
            root,
        )
        roots[known] = max(peak, roots.get(known, 0.0))
    return [Release(time, side, peak) for time, peak in roots.items()]
