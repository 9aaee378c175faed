"""Orbits that come to rest by infinitely many impacts at one contact: their segments, and the proof
of what no segment shows, the accumulation and the rest.

A rest forgets everything, so that nothing has to close.
A release is a zero of the contact's acceleration; the first impacts after it solve a triangular
system, and the last segment of an excursion, which is no motion, has the equations of the next
release at its end.

After the last of these impacts, at t with the speed s, let the acceleration of the gap lie in [-a1,
-a0], a0 > 0, for all times up to t + W, gaps up to g and speeds up to s. Let impacts return at most
e of a speed. A flight that begins with the speed u lasts at most 2 u / a0, rises at most u^2 / (2
a0), and ends with at most u sqrt(a1 / a0). With r = e sqrt(a1 / a0) < 1 all impacts are over by t +
2 e s / (a0 (1 - r)), if this is less than t + W and if e^2 s^2 / (2 a0) < g. The contact then stays
closed while the acceleration there is below 0, up to its next zero, which it passes rising: this is
the next release.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.bounds import TIME, Ball, Gap, Segment, Shooting, Tape, Unknowns, coordinate, velocity
from saltus.orbits.segments.one_contact_segments import IMPACT, SIDE, refused
from saltus.orbits.segments.segments import CannotProve, OrbitSegments, Rest, names_of_states
from saltus.systems import System
from saltus.taylor import Expr, differentiate, number, substitute, trace

POSITION = coordinate(0)
RATE = velocity(0)


@dataclass(frozen=True)
class RestSettings:
    """How an excursion is cut into resolved impacts and the accumulation after them."""

    resolved: int = 6  # impacts of an excursion that are resolved, at most
    # An impact with less of the largest speed is left to the accumulation.
    slow: float = 1e-4
    # The windows W tried for the accumulation, each as a multiple of the last one.
    first_window: float = 4.0  # of 2 e s / a at the last impact
    longer: float = 2.0
    windows: int = 6
    halvings: int = 14  # of a time of rest, on which a sign is bounded
    # Before a release the acceleration is shown to rise on this share of the rest, then on half.
    rising: float = 0.5
    rising_tries: int = 8


SETTINGS = RestSettings()


def resting_segments(
    system: System, excursions: np.ndarray, times: np.ndarray, speeds: np.ndarray, span: float
) -> OrbitSegments | CannotProve:
    """The segments of an orbit with rests at one contact.

    Parameters
    ----------
    system
        The system.
    excursions
        The times of the releases and of the ends of the accumulations after them, (rests, 2).
    times, speeds
        The impacts of one period, (impacts,).
    span
        The period of the orbit, in forcing periods.
    """
    traced = trace(system)
    reason = refused(traced)
    if reason is None and traced.side_count > 1:
        reason = "rests between two sides of a contact are not proved yet"
    if reason is not None:
        return CannotProve(reason)
    side = float(system.model.every_side[0])

    def on_side(root: Expr | None) -> Expr:
        assert root is not None
        return substitute(root, {SIDE: side})

    period = 2.0 * np.pi * span / float(system.load.frequency or 1.0)
    assert traced.contact is not None
    contact = traced.contact
    acceleration = on_side(traced.acceleration[0])
    rate = on_side(traced.gap_rate)
    speed = Unknowns(system)[1]
    closing = {RATE: number(-1.0) / rate * speed, POSITION: contact}
    after = substitute(on_side(traced.velocity_after), closing)
    held = {POSITION: contact, RATE: number(0.0)}
    held_pull = substitute(rate * acceleration, held)
    impact = (POSITION - contact, RATE + speed / rate)
    release = (held_pull, speed + number(0.0))
    guess: list[tuple[float, float]] = []
    segments: list[Segment] = []
    rests: list[Rest] = []
    releases: list[int] = []
    sign = float(np.sign(system.one_contact.inward(int(side))))
    for begin, end in sorted(excursions, key=lambda pair: pair[0] % period):
        since = (times - begin) % period
        inside = np.flatnonzero(since <= end - begin)
        first = begin % period
        inside = inside[np.argsort(since[inside], kind="stable")][: SETTINGS.resolved]
        fast = speeds[inside] > SETTINGS.slow * speeds[inside].max(initial=0.0)
        inside = inside[fast]
        if not len(inside):
            return CannotProve("an excursion without impacts is not proved yet")
        releases.append(len(guess))
        guess.append((float(first), 0.0))
        guess += [(float(first + since[i]), float(speeds[i])) for i in inside]
        free = Gap(0, sign, contact, 3, 1)
        segments.append(Segment((acceleration,), (contact, number(0.0)), impact, (free,)))
        bounce = Segment((acceleration,), (contact, after), impact, (Gap(0, sign, contact, 1, 1),))
        segments += [bounce] * (len(inside) - 1)
        segments.append(Segment((number(0.0),), (contact, after), release, ()))
        last = len(guess) - 1
        following = len(guess) if len(rests) + 1 < len(excursions) else 0
        rests.append(
            Rest(
                last,
                following,
                rate * acceleration,
                held_pull,
                differentiate(held_pull, TIME),
                rate * after,
                differentiate(rate * after, speed),
                contact,
                rate,
            )
        )
    names = (IMPACT,) * len(guess)
    states = names_of_states(system.model.coordinates)
    return OrbitSegments(
        tuple(segments),
        np.array(guess),
        names,
        states,
        rests=tuple(rests),
        releases=tuple(releases),
    )


def rest_by(shooting: Shooting, box: Ball, rest: Rest) -> float | None:
    """By when all impacts before a rest are over, if it is proved that they are and that the contact
    then stays closed until the next release; else None.
    """
    size = shooting.event_size
    time = box[size * rest.last]
    speed = box[size * rest.last + 1]
    release = box[size * rest.release]
    if rest.release == 0:
        release = release + shooting.period
    known = shooting.parameters[None]
    ends = _accumulation(shooting, known, time, speed, rest)
    if ends is None or not ends < float(release.low):
        return None
    tape = Tape([rest.held_pull])
    rising = Tape([number(-1.0) * rest.held_rate])
    share = SETTINGS.rising
    for _ in range(SETTINGS.rising_tries):
        near = float(release.low) - share * (float(release.low) - ends)
        if _negative(rising, known, near, float(release.high), SETTINGS.halvings):
            closed = _negative(tape, known, ends, near, SETTINGS.halvings)
            return ends if closed else None
        share *= 0.5
    return None


def _accumulation(
    shooting: Shooting, known: Ball, time: Ball, speed: Ball, rest: Rest
) -> float | None:
    """By when all impacts after one with a speed at a time are over; None if that is not shown."""
    nothing = Ball(np.zeros((1, 1)))
    fast = float(speed.high)
    whole = Ball(np.array([0.5 * fast]), np.array([0.5 * fast * (1.0 + 1e-10)]))
    at_rest = Ball(np.array([0.0]))
    tape = Tape([rest.position, rest.rate])
    place = tape.values(known, Ball(time.middle[None]), nothing, nothing)[0]

    def values(roots: list[Expr], window: float, gap: float, unknown: Ball) -> Ball:
        """Balls of some roots over the window, gaps and closing or opening speeds."""
        begin = float(time.low)
        times = _between(begin, begin + window)
        position = place[0] + _between(0.0, gap) / place[1]
        velocity_ = _between(-fast, fast) / place[1]
        leaves = Ball(
            np.concatenate([known.middle[0], times.middle, unknown.middle])[None],
            np.concatenate([known.radius[0], times.radius, unknown.radius])[None],
        )
        return Tape(roots).values(leaves, times, position.reshape(1, 1), velocity_.reshape(1, 1))[0]

    law = [rest.restitution]
    start = values([rest.pull], 0.0, 0.0, at_rest)[0]
    if not float(start.high) < 0.0:
        return None
    window = SETTINGS.first_window * 2.0 * fast / -float(start.high)
    for _ in range(SETTINGS.windows):
        gap = fast * fast / -float(start.high)
        pull = values([rest.pull], window, gap, at_rest)[0]
        returned = values(law, window, 0.0, whole)[0]
        stops = values([rest.speed_after], window, 0.0, at_rest)[0]
        # The speed after an impact is 0 at the speed 0, and grows with it.
        lawful = float(returned.low) >= 0.0 and float(np.abs(stops.middle) + stops.radius) < 1e-280
        if lawful and float(pull.high) < 0.0:
            least = -pull.high  # a0
            ratio = (Ball(-float(pull.low)) / Ball(float(least))).sqrt() * float(returned.high)
            flight = Ball(2.0 * fast) * float(returned.high) / Ball(float(least))
            over = time + flight / (Ball(1.0) - ratio)
            rise = Ball(fast) * float(returned.high)
            height = rise * rise / (2.0 * Ball(float(least)))
            in_time = float(over.high) < float(time.low) + window
            if float(ratio.high) < 1.0 and in_time and float(height.high) < gap:
                return float(over.high)
        window *= SETTINGS.longer
    return None


def _between(low: float, high: float) -> Ball:
    """A ball that contains an interval."""
    middle = 0.5 * (low + high)
    return Ball(np.array([middle]), np.array([0.5 * (high - low) + 1e-15 * (abs(low) + abs(high))]))


def _negative(tape: Tape, known: Ball, low: float, high: float, halvings: int) -> bool:
    """Whether the root of a tape, of the time alone, is below 0 on an interval, by bisection."""
    nothing = Ball(np.zeros((1, 1)))
    if float(tape.values(known, _between(low, high), nothing, nothing)[0, 0].high) < 0.0:
        return True
    middle = 0.5 * (low + high)
    return halvings > 0 and (
        _negative(tape, known, low, middle, halvings - 1)
        and _negative(tape, known, middle, high, halvings - 1)
    )
