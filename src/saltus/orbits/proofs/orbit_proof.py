"""The proof of a periodic orbit: existence, uniqueness, open contacts, stability."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds import (
    Ball,
    Multipliers,
    NotProved,
    ProvedZero,
    Shooting,
    ShootingSettings,
    multipliers_of,
    prove_zero,
    return_map,
    rounded_ball,
    rounded_down,
    rounded_up,
)
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.segments import CannotProve, OrbitSegments
from saltus.result import Result, result_dataset

if TYPE_CHECKING:
    import xarray

ASSUMPTIONS = (
    "doubles are rounded to nearest (IEEE 754); fused multiply-adds are allowed",
    "the C library's sin, cos, exp, log, sinh, cosh, tanh, atan and pow are right within 3 units in "
    "the last place",
    "a product of matrices is a sum of products in some order",
    "the traced graph is the model, with its literal numbers as doubles",
)
MIRROR = "the system has the mirror symmetry that its model states"


@dataclass(frozen=True)
class ProofSettings:
    """When a proof refutes the orbit it was asked for."""

    # The orbit is taken to be solved within this, times the condition of its equations ...
    solved: float = 1e-12
    # ... but within these limits.
    least: float = 1e-11
    most: float = 1e-7


SETTINGS = ProofSettings()


@dataclass(frozen=True, eq=False, repr=False)
class OrbitProof(Result):
    """What is proved of a periodic orbit.

    Attributes
    ----------
    proved
        True: the orbit exists, alone in a box, and keeps its contact open between impacts.
        False: it is refuted, with the `reason`. None: neither was shown.
    reason
        Why it is not proved, or the empty text.
    impact_times, impact_speeds
        Middles and radii of the times of its impacts and of the speeds at which the gap closes, of
        the time that its equations cover, (impacts, 2).
    unique_within
        No other orbit of its signature has all unknowns (times, speeds, states at the nodes) within
        this.
    least_speed
        A lower bound of the speeds of its impacts; inf without impacts.
    stable
        True or False if it is proved, else None.
    moduli
        Middles and radii of the moduli of the multipliers over the time that its equations cover,
        (multipliers, 2); empty if they were not separated.
    assumptions
        What is taken for granted.
    steps
        The number of validated Taylor steps.
    seconds
        The processor time.

    Examples
    --------
    >>> proof = saltus.prove(orbit)
    >>> proof.proved, proof.stable
    (True, True)
    """

    proved: bool | None
    reason: str
    impact_times: np.ndarray
    impact_speeds: np.ndarray
    unique_within: float
    least_speed: float
    stable: bool | None
    moduli: np.ndarray
    assumptions: tuple[str, ...]
    steps: int
    seconds: float
    orbit: PeriodicOrbit = field(repr=False)
    radii: dict[str, float] = field(default_factory=dict, repr=False)
    shooting: Shooting | None = field(default=None, repr=False)
    zero: ProvedZero | None = field(default=None, repr=False)

    def _facts(self) -> dict[str, Any]:
        """The fields that a reader asks for first."""
        facts: dict[str, Any] = {"proved": self.proved, "stable": self.stable}
        if self.reason:
            facts["reason"] = self.reason
        if self.zero is not None:
            facts["unique_within"] = rounded_down(self.unique_within, 2)
            facts["least_speed"] = rounded_down(self.least_speed)
        return facts

    @property
    def statement(self) -> str:
        """The theorem in one paragraph, all of its numbers rounded outward."""
        if self.zero is None or not self.proved:
            return f"Nothing is proved: {self.reason}."
        orbit = self.orbit
        system = type(orbit.system.model).__name__
        closing = (
            f"on its mirror image after {orbit.signature.span:g} forcing periods"
            if orbit.symmetric
            else f"after {orbit.period} forcing period{'s' * (orbit.period > 1)}"
        )
        impacts = "; ".join(
            f"t = {rounded_ball(*when)} with speed {rounded_ball(*speed)}"
            for when, speed in zip(self.impact_times, self.impact_speeds, strict=True)
        )
        told = [
            f"{system} has a periodic orbit that closes {closing}"
            + (f", with impacts at {impacts}." if impacts else ", without impacts."),
            "No other orbit of this signature has all times, speeds and states at the nodes "
            f"within {rounded_down(self.unique_within, 2)} of it.",
            "Its contact is open between the impacts." if impacts else "Its contact stays open.",
            _of_stability(self.stable, self.moduli),
        ]
        if self.radii:
            radii = ", ".join(
                f"{name} within {rounded_up(radius)}" for name, radius in self.radii.items()
            )
            told.append(f"This holds for every {radii} of its double.")
        return " ".join(part for part in told if part)

    def to_xarray(self) -> xarray.Dataset:
        """The enclosures as a Dataset, with the statement as an attribute."""
        columns = {
            "impact_time": ("impact", self.impact_times[:, 0], "1", "time of the impact"),
            "impact_time_radius": ("impact", self.impact_times[:, 1], "1", "its radius"),
            "impact_speed": ("impact", self.impact_speeds[:, 0], "1", "closing speed"),
            "impact_speed_radius": ("impact", self.impact_speeds[:, 1], "1", "its radius"),
            "modulus": ("multiplier", self.moduli[:, 0], "1", "modulus of the multiplier"),
            "modulus_radius": ("multiplier", self.moduli[:, 1], "1", "its radius"),
            "unique_within": ((), self.unique_within, "1", "radius of uniqueness"),
        }
        facts = {
            "proved": _in_words(self.proved),
            "stable": _in_words(self.stable),
            "reason": self.reason,
            "statement": self.statement,
            "assumptions": "; ".join(self.assumptions),
        }
        return result_dataset("proof", columns, system=self.orbit.system, **facts)

    @cached_property
    def certificate(self) -> dict[str, Any]:
        """All that a program needs to check the proof again, without saltus; plain JSON.

        Raises
        ------
        ParameterError
            Nothing is proved.
        """
        from saltus.orbits.proofs.certificate import certificate_of

        return certificate_of(self)

    def check(self) -> bool:
        """Whether the inclusions of the certificate hold again: no search, no Newton's method."""
        from saltus.orbits.proofs.certificate import holds

        return holds(self)


def prove_orbit(
    orbit: PeriodicOrbit,
    radii: dict[str, float] | None = None,
    steps: ShootingSettings | None = None,
) -> OrbitProof:
    """The proof of an orbit; `prove` says what it is."""
    began = time.process_time()
    made = orbit.equations.segments_to_prove(orbit.solution)
    if isinstance(made, CannotProve):
        return _without_zero(orbit, made.reason, began)
    shooting = shooting_of(orbit, made, radii=radii, settings=steps)
    zero = prove_zero(shooting)
    if isinstance(zero, NotProved):
        return _without_zero(orbit, zero.reason, began, shooting)
    multipliers = multipliers_of(return_map(shooting, zero.enclosure))
    refuted = _refutation(shooting, zero, made)
    opened = refuted is None and shooting.is_open(zero.enclosure, zero.box)
    events = zero.box[: shooting.event_unknowns].reshape(-1, shooting.event_size)
    least = float(events[:, 1].low.min()) if made.free_time else np.inf
    reason = refuted or ("" if opened else "the contact was not shown to be open between impacts")
    if not reason and not least > 0.0:
        opened = False
        reason = "an impact was not shown to have a speed"
    return _proof(
        orbit, shooting, zero, multipliers, opened, refuted is not None, reason, radii, began
    )


def shooting_of(
    orbit: PeriodicOrbit,
    made: OrbitSegments,
    *,
    path: str | None = None,
    radii: dict[str, float] | None = None,
    guess: np.ndarray | None = None,
    pins: list[tuple[np.ndarray, float]] | None = None,
    settings: ShootingSettings | None = None,
) -> Shooting:
    """The equations of the segments of an orbit, in balls."""
    return Shooting(
        orbit.equations.system_at(orbit.solution.values),
        made.segments,
        made.guess if guess is None else guess,
        orbit.signature.span,
        path=path,
        radii=radii,
        pins=pins,
        free_time=made.free_time,
        settings=settings,
    )


def _refutation(shooting: Shooting, zero: ProvedZero, made: OrbitSegments) -> str | None:
    """Why the orbit that was asked for is certainly none; None if nothing speaks against it."""
    count = shooting.event_unknowns
    asked = made.guess.ravel()
    away = np.abs(asked - zero.middle[:count]) - 2.0 * zero.radius[:count]
    limit = np.clip(SETTINGS.solved * zero.condition, SETTINGS.least, SETTINGS.most)
    far = away / np.maximum(1.0, np.abs(asked))
    if far.max() > limit:
        return (
            f"the orbit as given does not solve the equations: the one that does lies more than "
            f"{rounded_down(float(away.max()), 2)} away"
        )
    pierced = shooting.pierced(zero.enclosure, zero.box)
    if pierced is not None:
        return f"it penetrates its contact: the gap is negative at t = {pierced:.6g}"
    events = zero.box[:count].reshape(-1, shooting.event_size)
    if made.free_time and bool((events[:, 1].high < 0.0).any()):
        return "an impact has a negative speed"
    return None


def _proof(
    orbit: PeriodicOrbit,
    shooting: Shooting,
    zero: ProvedZero,
    multipliers: Multipliers,
    opened: bool,
    refuted: bool,
    reason: str,
    radii: dict[str, float] | None,
    began: float,
) -> OrbitProof:
    events = zero.box[: shooting.event_unknowns].reshape(-1, shooting.event_size)
    times = pairs(events[:, 0]) if shooting.free_time else np.empty((0, 2))
    speeds = pairs(events[:, 1]) if shooting.free_time else np.empty((0, 2))
    least = float(events[:, 1].low.min()) if shooting.free_time else np.inf
    return OrbitProof(
        proved=False if refuted else (True if opened else None),
        reason=reason,
        impact_times=times,
        impact_speeds=speeds,
        unique_within=float(zero.unique.min()),
        least_speed=least,
        stable=multipliers.stable,
        moduli=np.array(multipliers.moduli).reshape(-1, 2),
        assumptions=(*ASSUMPTIONS, *((MIRROR,) * orbit.symmetric)),
        steps=len(shooting.steps),
        seconds=time.process_time() - began,
        orbit=orbit,
        radii=dict(radii or {}),
        shooting=shooting,
        zero=zero,
    )


def _without_zero(
    orbit: PeriodicOrbit, reason: str, began: float, shooting: Shooting | None = None
) -> OrbitProof:
    none = np.empty((0, 2))
    return OrbitProof(
        proved=None,
        reason=reason,
        impact_times=none,
        impact_speeds=none,
        unique_within=0.0,
        least_speed=np.nan,
        stable=None,
        moduli=none,
        assumptions=ASSUMPTIONS,
        steps=0 if shooting is None else len(shooting.steps),
        seconds=time.process_time() - began,
        orbit=orbit,
        shooting=shooting,
    )


def pairs(balls: Ball) -> np.ndarray:
    """Middles and radii, (n, 2)."""
    return np.stack([balls.middle, balls.radius], axis=-1)


def _of_stability(stable: bool | None, moduli: np.ndarray) -> str:
    kinds = {True: "It is asymptotically stable", False: "It is unstable"}
    told = kinds.get(stable, "Its stability is not decided") if stable is not None else ""
    told = told or "Its stability is not decided"
    if not len(moduli):
        return f"{told}."
    sizes = ", ".join(rounded_ball(*modulus) for modulus in moduli)
    return f"{told}: its multipliers have the moduli {sizes} over the time its equations cover."


def _in_words(value: bool | None) -> str:
    return "undecided" if value is None else str(value).lower()
