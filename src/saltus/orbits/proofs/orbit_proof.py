"""The proof of a periodic orbit: existence, uniqueness, open contacts, stability."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
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
    verified_zero,
)
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.certificate import ROOM, certificate_of, differences
from saltus.orbits.segments.resting_segments import rest_by
from saltus.orbits.segments.segments import (
    CannotProve,
    OrbitSegments,
    Rest,
    events_of,
    least_speed,
)
from saltus.result import Result
from saltus.systems import numbers

if TYPE_CHECKING:
    import xarray

ASSUMPTIONS = (
    "doubles are rounded to nearest (IEEE 754); fused multiply-adds are allowed",
    (
        "the C library's sin, cos, exp, log, sinh, cosh, tanh, atan and pow are right within 3"
        " units in the last place"
    ),
    "a product of matrices is a sum of products in some order",
    "the traced graph is the model, with its literal numbers as doubles",
)
MIRROR = "the system has the mirror symmetry that its model states"
FLINT = "the balls of FLINT contain what they stand for"


def assumptions_of(symmetric: bool, zero: ProvedZero | None = None) -> tuple[str, ...]:
    """What is taken for granted of an orbit, symmetric or not, and of its zero."""
    precise = zero is not None and zero.precise
    return (*ASSUMPTIONS, *((MIRROR,) * symmetric), *((FLINT,) * precise))


# In natural scales: an orbit that lies farther from the enclosed one, beside a fold, may be another.
NEARBY = 1e-5


@dataclass(frozen=True)
class ProofSettings:
    """When a proof refutes the orbit it was asked for."""

    # The orbit is taken to be solved within this, times the condition of its equations ...
    solved: float = 1e-12
    # ... but within these limits; its own equations are solved within the first of them.
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
        Radii by the kind of unknown, in its own unit: no other orbit of its signature has all times
        and speeds of its impacts, and all coordinates and velocities at the nodes, within them.
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
    rests_by
        At each rest, by when infinitely many further impacts are over at the latest, (rests,).
    releases
        Middles and radii of the times at which the contact opens after each rest, (rests, 2).

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
    unique_within: dict[str, float]
    least_speed: float
    stable: bool | None
    moduli: np.ndarray
    assumptions: tuple[str, ...]
    steps: int
    seconds: float
    rests_by: np.ndarray
    releases: np.ndarray
    orbit: PeriodicOrbit = field(repr=False)
    radii: dict[str, float] = field(default_factory=dict, repr=False)
    made: OrbitSegments | None = field(default=None, repr=False)
    shooting: Shooting | None = field(default=None, repr=False)
    zero: ProvedZero | None = field(default=None, repr=False)

    def _facts(self) -> dict[str, Any]:
        """The fields that a reader asks for first."""
        facts: dict[str, Any] = {"proved": self.proved, "stable": self.stable}
        if self.reason:
            facts["reason"] = self.reason
        if self.zero is not None:
            facts["unique_within"] = within(self.unique_within)
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
            (
                "No other orbit of this signature lies, at its impacts and at the nodes between"
                f" them, within {within(self.unique_within)} of it."
            ),
            "Its contact is open between the impacts." if impacts else "Its contact stays open.",
            *self._rests_in_words(),
            _of_stability(self.stable, self.moduli),
        ]
        told += of_radii(self.radii)
        return " ".join(told)

    def _rests_in_words(self) -> list[str]:
        """A sentence for each rest."""
        return [
            f"Infinitely many further impacts are over by t = {rounded_up(float(end), 9)}; then its"
            f" contact is closed until t = {rounded_ball(*map(float, release))}."
            for end, release in zip(self.rests_by, self.releases, strict=True)
        ]

    def to_xarray(self) -> xarray.Dataset:
        """The orbit's dataset with the enclosures, and with the statement as an attribute."""
        columns = {
            "enclosed_time": ("enclosed", self.impact_times[:, 0], "time of an impact"),
            "enclosed_time_radius": ("enclosed", self.impact_times[:, 1], "its radius"),
            "enclosed_speed": ("enclosed", self.impact_speeds[:, 0], "closing speed"),
            "enclosed_speed_radius": ("enclosed", self.impact_speeds[:, 1], "its radius"),
            "modulus": ("enclosed_multiplier", self.moduli[:, 0], "modulus of a multiplier"),
            "modulus_radius": ("enclosed_multiplier", self.moduli[:, 1], "its radius"),
            **radii_columns(self.unique_within),
        }
        facts = {
            "proved": in_words(self.proved),
            "stability": in_words(self.stable),
            "reason": self.reason,
            "statement": self.statement,
            "assumptions": "; ".join(self.assumptions),
        }
        return with_proof(self.orbit.to_xarray(), "proof", columns, facts)

    @cached_property
    def certificate(self) -> dict[str, Any]:
        """All that a program needs to check the proof again, without saltus; plain JSON.

        Raises
        ------
        ParameterError
            Nothing is proved.
        """
        return certificate_of(self)

    def check(self) -> bool:
        """Whether all that the proof and its certificate say holds when it is computed anew. It
        takes the system of the orbit and the boxes of the certificate, and makes no search.
        """
        again = _again(self)
        return self.proved is True and again is not None and not differences(self, again)


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
    zero = prove_zero(shooting, precise=True)
    if isinstance(zero, NotProved):
        return _without_zero(orbit, zero.reason, began, shooting)
    return theorem_of(orbit, made, shooting, zero, dict(radii or {}), began)


def theorem_of(
    orbit: PeriodicOrbit,
    made: OrbitSegments,
    shooting: Shooting,
    zero: ProvedZero,
    radii: dict[str, float],
    began: float,
) -> OrbitProof:
    """What follows of an orbit from the zero of its equations."""
    rested = [rest_by(shooting, zero.box, rest) for rest in made.rests]
    multipliers = (
        Multipliers(True, ((0.0, 0.0),) * (2 * shooting.dof))  # a rest forgets everything
        if made.rests
        else multipliers_of(return_map(shooting, zero.enclosure))
    )
    refuted = _refutation(orbit, shooting, zero, made)
    opened = refuted is None and shooting.is_open(zero.enclosure, zero.box)
    if refuted is None and not opened:
        refuted = _penetration(shooting, zero)
    least = least_speed(shooting, zero.box, made)
    reason = refuted or ("" if opened else "the contact was not shown to be open between impacts")
    if not reason and not least > 0.0:
        opened = False
        reason = "an impact was not shown to have a speed"
    asked = np.abs(made.guess.ravel() - zero.middle[: made.guess.size])
    moved = bool((asked > NEARBY * shooting.scales[: made.guess.size]).any())
    if not reason and zero.precise and (moved or multipliers.stable not in (None, orbit.stable)):
        opened = False
        reason = "it lies so near a fold that which of two orbits was meant is not decided"
    if not reason and None in rested:
        opened = False
        reason = "an accumulation of impacts, or the rest after it, has no bound"
    if not opened and (made.rests or zero.precise):
        multipliers = Multipliers(None, ())
    impacts = events_of(shooting, zero.box, made)
    return OrbitProof(
        proved=False if refuted else (True if opened else None),
        reason=reason,
        impact_times=pairs(impacts[:, 0]) if made.free_time else np.empty((0, 2)),
        impact_speeds=pairs(impacts[:, 1]) if made.free_time else np.empty((0, 2)),
        unique_within=shooting.by_name(zero.unique),
        least_speed=least,
        stable=multipliers.stable,
        moduli=np.array(multipliers.moduli).reshape(-1, 2) * (1.0, ROOM),
        assumptions=assumptions_of(orbit.symmetric, zero),
        steps=len(shooting.steps),
        seconds=time.process_time() - began,
        rests_by=np.array([end for end in rested if end is not None]),
        releases=np.array(
            [pairs(_release_after(shooting, zero.box, rest)) for rest in made.rests]
        ).reshape(-1, 2),
        orbit=orbit,
        radii=radii,
        made=made,
        shooting=shooting,
        zero=zero,
    )


def _again(proof: OrbitProof) -> OrbitProof | None:
    """The proof from the orbit's own system and equations, with the boxes and nodes of a proof; None
    where they prove nothing.
    """
    shooting = proof.shooting
    zero = proof.zero
    names = [name for name, _ in numbers(proof.orbit.system)]
    if shooting is None or zero is None or not set(proof.radii) <= set(names):
        return None
    made = proof.orbit.equations.segments_to_prove(proof.orbit.solution)
    if isinstance(made, CannotProve):
        return None
    anew = shooting_of(proof.orbit, made, radii=proof.radii, settings=shooting.settings)
    if not took_nodes(anew, shooting):
        return None
    verified = verified_zero(anew, zero.middle, zero.radius, zero.unique, zero.precise)
    if isinstance(verified, NotProved):
        return None
    return theorem_of(proof.orbit, made, anew, verified, proof.radii, 0.0)


def took_nodes(first: Shooting, second: Shooting) -> bool:
    """Whether the steps of two equations are the same, but for roundings of the times of nodes; the
    first then takes those of the second.
    """
    untimed = [
        [replace(step, begin_time=0.0, close_time=0.0) for step in shooting.steps]
        for shooting in (first, second)
    ]
    one, other = (
        np.array([(step.begin_time, step.close_time) for step in shooting.steps])
        for shooting in (first, second)
    )
    same = untimed[0] == untimed[1] and np.allclose(one, other, rtol=1e-9, equal_nan=True)
    first.steps = second.steps if same else first.steps
    return same


def shooting_of(
    orbit: PeriodicOrbit,
    made: OrbitSegments,
    *,
    values: np.ndarray | None = None,
    path: str | None = None,
    radii: dict[str, float] | None = None,
    pins: list[tuple[np.ndarray, float]] | None = None,
    settings: ShootingSettings | None = None,
) -> Shooting:
    """The equations of the segments of an orbit, in balls, at other `values` of the branch's
    parameters than its own, if they are given.
    """
    return Shooting(
        orbit.equations.system_at(orbit.solution.values if values is None else values),
        made.segments,
        made.guess,
        made.event_names,
        made.state_names,
        orbit.signature.span,
        path=path,
        radii=radii,
        pins=pins,
        free_time=made.free_time,
        settings=settings,
    )


def _refutation(
    orbit: PeriodicOrbit, shooting: Shooting, zero: ProvedZero, made: OrbitSegments
) -> str | None:
    """Why the orbit that was asked for is certainly none; None if nothing speaks against it."""
    count = shooting.event_unknowns
    asked = made.guess.ravel()
    away = np.abs(asked - zero.middle[:count]) - 2.0 * zero.radius[:count]
    limit = np.clip(SETTINGS.solved * zero.condition, SETTINGS.least, SETTINGS.most)
    far = away / np.maximum(shooting.scales[:count], np.abs(asked))
    farthest = int(far.argmax())
    # Where the equations are nearly singular, an orbit solves them in doubles that far away too.
    if far[farthest] > limit and not zero.precise:
        return (
            f"the orbit as given does not solve the equations: the {shooting.names[farthest]} of"
            f" the one that does lies more than {rounded_down(float(away[farthest]), 2)} away"
        )
    # Some unknowns of an orbit are none of its proof, such as the coordinate that a contact holds.
    residual = orbit.solution.residual
    if residual > max(SETTINGS.least, orbit.equations.residual_floor):
        return (
            "the orbit as given does not solve the equations: they are off by"
            f" {rounded_down(residual, 2)} in natural units"
        )
    events = zero.box[:count].reshape(-1, shooting.event_size)
    if made.free_time and bool((events[:, 1].high < 0.0).any()):
        return "an impact has a negative speed"
    return None


def _penetration(shooting: Shooting, zero: ProvedZero) -> str | None:
    """Where the orbit certainly penetrates a contact, in words; None if that was not shown."""
    pierced = shooting.pierced(zero.enclosure, zero.box)
    if pierced is None:
        return None
    return f"it penetrates its contact: the gap is negative at t = {pierced:.6g}"


def _release_after(shooting: Shooting, box: Ball, rest: Rest) -> Ball:
    """The ball of the time of the release after a rest."""
    release = box[shooting.event_size * rest.release]
    return release + shooting.period if rest.release == 0 else release


def _without_zero(
    orbit: PeriodicOrbit, reason: str, began: float, shooting: Shooting | None = None
) -> OrbitProof:
    none = np.empty((0, 2))
    return OrbitProof(
        proved=None,
        reason=reason,
        impact_times=none,
        impact_speeds=none,
        unique_within={},
        least_speed=np.nan,
        stable=None,
        moduli=none,
        assumptions=assumptions_of(orbit.symmetric),
        steps=0 if shooting is None else len(shooting.steps),
        seconds=time.process_time() - began,
        rests_by=np.empty(0),
        releases=np.empty((0, 2)),
        orbit=orbit,
        shooting=shooting,
    )


def within(radii: dict[str, float]) -> str:
    """Radii by their names, in words, rounded down."""
    return ", ".join(f"{rounded_down(radius, 2)} ({name})" for name, radius in radii.items())


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


def of_radii(radii: dict[str, float]) -> list[str]:
    """For which systems a theorem holds, in words; nothing where it is one."""
    told = ", ".join(f"{name} within {rounded_down(radius)}" for name, radius in radii.items())
    return [f"This holds for every {told} of its double."] if radii else []


def in_words(value: bool | None) -> str:
    """True, false or undecided, as attributes and tables say it."""
    return "undecided" if value is None else str(value).lower()


def radii_columns(radii: dict[str, float]) -> dict[str, tuple[str, Any, str]]:
    """Radii of uniqueness with the names of their unknowns."""
    return {
        "unique_within": ("unknown", [*radii.values()], "radius in which it is unique"),
        "unknown_name": ("unknown", [*radii], "kind of the unknown"),
    }


def with_proof(
    dataset: xarray.Dataset,
    kind: str,
    columns: dict[str, tuple[str, Any, str]],
    facts: dict[str, Any],
) -> xarray.Dataset:
    """A dataset with further columns, each its dimension, values and name in words, and facts."""
    variables = {
        name: (dim, np.asarray(values), {"long_name": text})
        for name, (dim, values, text) in columns.items()
    }
    title = f"{kind.replace('_', ' ')} computed by saltus"
    return dataset.assign(variables).assign_attrs(facts | {"kind": kind, "title": title})
