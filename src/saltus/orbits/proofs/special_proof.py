"""The proof of a special point: a fold, a period doubling, a symmetry breaking or a grazing, with
an enclosure of its parameter."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.bounds import (
    Ball,
    NotProved,
    ProvedZero,
    Shooting,
    ShootingSettings,
    Unknowns,
    prove_zero,
    rounded_ball,
    varied,
    verified_zero,
)
from saltus.bounds import only_one as only_one_of
from saltus.orbits.beyond.special_point import SpecialKind, SpecialPoint
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.certificate import differences, special_certificate_of
from saltus.orbits.proofs.orbit_proof import (
    assumptions_of,
    in_words,
    of_radii,
    radii_columns,
    shooting_of,
    took_nodes,
    with_proof,
    within,
)
from saltus.orbits.segments.segments import CannotProve
from saltus.result import Result

if TYPE_CHECKING:
    import xarray

KERNEL = "kernel of "  # before the name of an unknown: that component of the kernel vector
MEANINGS = {
    SpecialKind.LP: "a simple quadratic fold",
    SpecialKind.PD: "a multiplier that passes -1 with speed",
    SpecialKind.BPC: "a multiplier of the half period that passes -1 with speed",
    SpecialKind.GR: "a quadratic contact without speed that the branch passes with speed",
}


@dataclass(frozen=True, eq=False, repr=False)
class SpecialProof(Result):
    """What is proved of a special point.

    Attributes
    ----------
    proved
        True, or None where it was not shown.
    reason
        Why it is not proved, or the empty text.
    kind
        The kind of the point.
    path
        The parameter along the branch.
    parameter
        Middle and radius of its value, (2,).
    unique_within
        Radii by the kind of unknown, in its own unit: no other orbit with this property has its
        parameter, all unknowns of its impacts and nodes and its kernel vector within them.
    only_within
        The same, whatever the kernel vector; empty where it was not shown.
    assumptions
        What is taken for granted.
    seconds
        The processor time.

    Examples
    --------
    >>> saltus.prove(branch.special[0]).proved
    True
    """

    proved: bool | None
    reason: str
    kind: str
    path: str
    parameter: np.ndarray
    unique_within: dict[str, float]
    only_within: dict[str, float]
    assumptions: tuple[str, ...]
    seconds: float
    special: SpecialPoint = field(repr=False)
    radii: dict[str, float] = field(default_factory=dict, repr=False)
    shooting: Shooting | None = field(default=None, repr=False)
    zero: ProvedZero | None = field(default=None, repr=False)

    def _facts(self) -> dict[str, Any]:
        facts: dict[str, Any] = {"kind": self.kind, "proved": self.proved}
        if self.reason:
            facts["reason"] = self.reason
        if self.zero is not None:
            facts[self.path] = rounded_ball(*self.parameter)
        return facts

    @property
    def statement(self) -> str:
        """The theorem in one paragraph, all of its numbers rounded outward."""
        if not self.proved:
            return f"Nothing is proved: {self.reason}."
        meaning = MEANINGS[SpecialKind[self.kind]]
        model = type(self.special.orbit.system.model).__name__
        orbit = self.special.orbit
        alone = self.only_within or self.unique_within
        whatever = ", whatever its kernel vector," if self.only_within else ""
        told = [
            f"{model} has a periodic orbit of {orbit.period} forcing "
            f"period{'s' * (orbit.period > 1)} with {meaning} ({self.kind}) at {self.path} = "
            f"{rounded_ball(*self.parameter)}. No other one of this signature{whatever} lies, at "
            f"its impacts and at the nodes between them, within {within(alone)} of it.",
            *of_radii(self.radii),
        ]
        return " ".join(told)

    def to_xarray(self) -> xarray.Dataset:
        """The orbit's dataset with the enclosure, and with the statement as an attribute."""
        columns = {
            "enclosed_parameter": ("enclosed", self.parameter[:1], self.path),
            "enclosed_parameter_radius": ("enclosed", self.parameter[1:], "its radius"),
            **radii_columns(self.unique_within),
        }
        facts = {
            "proved": in_words(self.proved),
            "special_kind": self.kind,
            "path": self.path,
            "reason": self.reason,
            "statement": self.statement,
            "assumptions": "; ".join(self.assumptions),
        }
        return with_proof(self.special.orbit.to_xarray(), "special_proof", columns, facts)

    @cached_property
    def certificate(self) -> dict[str, Any]:
        """All that a program needs to check the proof again, without saltus; plain JSON.

        Raises
        ------
        ParameterError
            Nothing is proved.
        """
        return special_certificate_of(self)

    def check(self) -> bool:
        """Whether all that the proof and its certificate say holds when it is computed anew. It
        takes the system of the orbit and the boxes of the certificate, and makes no search.
        """
        again = _again(self)
        return self.proved is True and again is not None and not differences(self, again)


def prove_special(
    point: SpecialPoint,
    radii: dict[str, float] | None = None,
    steps: ShootingSettings | None = None,
) -> SpecialProof:
    """The proof of a special point; `prove` says what it is."""
    began = time.process_time()
    orbit = point.orbit
    paths = orbit.equations.paths
    kinds = [kind.value for kind in MEANINGS]
    path = paths[0] if paths else ""
    if point.kind not in kinds:
        reason = f"a {point.kind} is not proved yet; proved are {', '.join(kinds)}"
        return _unproved(point, path, reason, began)
    if len(paths) != 1:
        return _unproved(point, path, "a point in two parameters is not proved yet", began)
    made = _equations_of(point, path, radii, steps)
    if isinstance(made, CannotProve):
        return _unproved(point, path, made.reason, began)
    zero = prove_zero(made, precise=True)
    if isinstance(zero, NotProved):
        return _unproved(point, path, zero.reason, began)
    return _theorem_of(point, path, made, zero, dict(radii or {}), began)


def _equations_of(
    point: SpecialPoint,
    path: str,
    radii: dict[str, float] | None,
    steps: ShootingSettings | None,
) -> Shooting | CannotProve:
    """The equations of which a special point is a regular zero."""
    if point.kind == SpecialKind.GR:
        return _touching(point, path, radii, steps)
    theta = 1.0 if point.kind == SpecialKind.LP else -1.0
    return _singular(point.orbit, theta, path, radii, steps)


def _theorem_of(
    point: SpecialPoint,
    path: str,
    shooting: Shooting,
    zero: ProvedZero,
    radii: dict[str, float],
    began: float,
) -> SpecialProof:
    """What follows of a special point from the zero of its equations."""
    opened = shooting.is_open(zero.enclosure, zero.box)
    only: dict[str, float] = {}
    box = only_one_of(shooting, zero) if opened and point.kind != SpecialKind.GR else None
    if box is not None:
        named = shooting.by_name(box).items()
        only = {name: radius for name, radius in named if not name.startswith(KERNEL)}
    return SpecialProof(
        proved=True if opened else None,
        reason="" if opened else "the contact was not shown to be open between impacts",
        kind=str(point.kind),
        path=path,
        parameter=np.array([zero.middle[-1], zero.radius[-1]]),
        unique_within=shooting.by_name(zero.unique),
        only_within=only,
        assumptions=assumptions_of(point.orbit.symmetric, zero),
        seconds=time.process_time() - began,
        special=point,
        radii=radii,
        shooting=shooting,
        zero=zero,
    )


def _again(proof: SpecialProof) -> SpecialProof | None:
    """The proof from the orbit's own system and equations, with the boxes, nodes and pins of a
    proof; None where they prove nothing.
    """
    point = proof.special
    shooting = proof.shooting
    zero = proof.zero
    if shooting is None or zero is None:
        return None
    path = point.orbit.equations.paths[0]
    anew = _equations_of(point, path, proof.radii, shooting.settings)
    if isinstance(anew, CannotProve) or not took_nodes(anew, shooting):
        return None
    if not _took_pin(anew, shooting):
        return None
    verified = verified_zero(anew, zero.middle, zero.radius, zero.unique, zero.precise)
    if isinstance(verified, NotProved):
        return None
    return _theorem_of(point, path, anew, verified, proof.radii, 0.0)


def _took_pin(first: Shooting, second: Shooting) -> bool:
    """Whether the pin of the second equations is one of the same unknowns, and no kernel vector of
    zeros meets it; the first then take it. Its numbers are those of a guess.
    """
    assert first.pins
    assert second.pins
    (row, goal), (other, other_goal) = first.pins[0], second.pins[0]
    same = other.shape == row.shape and bool(other.any()) and not other[row == 0.0].any()
    same = same and bool(other_goal) == bool(goal)
    first.pins = second.pins if same else first.pins
    return same


def _singular(
    orbit: PeriodicOrbit,
    theta: float,
    path: str,
    radii: dict[str, float] | None,
    steps: ShootingSettings | None,
) -> Shooting | CannotProve:
    """The equations of an orbit with the multiplier `theta` at an unknown parameter, together with
    its kernel vector, which one row pins (Moore and Spence 1980).
    """
    made = orbit.equations.segments_to_prove(orbit.solution)
    if isinstance(made, CannotProve):
        return made
    if made.rests:
        return CannotProve("special points of orbits that rest are not proved yet")
    plain = shooting_of(orbit, made, settings=steps)
    kernel = _kernel(plain, theta)
    events, size = made.guess.shape
    guess = np.concatenate([made.guess, kernel[: made.guess.size].reshape(events, size)], axis=1)
    unknowns = Unknowns(orbit.equations.system_at(orbit.solution.values), made.free_time)
    segments = [varied(segment, unknowns, 1.0) for segment in made.segments[:-1]]
    segments.append(varied(made.segments[-1], unknowns, theta))
    d = len(made.state_names) // 2
    states = made.state_names
    kernel_states = tuple(f"{KERNEL}{name}" for name in states)
    larger = replace(
        made,
        segments=tuple(segments),
        guess=guess,
        event_names=tuple(
            (*names, *(f"{KERNEL}{name}" for name in names)) for names in made.event_names
        ),
        state_names=(*states[:d], *kernel_states[:d], *states[d:], *kernel_states[d:]),
    )
    probe = shooting_of(orbit, larger, path=path, radii=radii, pins=[], settings=steps)
    # A part of the kernel vector may be 0; its scale is then that of what it is a variation of.
    plain_scales = dict(zip(plain.names, plain.scales, strict=True))
    least = [plain_scales.get(name.removeprefix(KERNEL), 0.0) for name in probe.names]
    probe.scales = np.maximum(probe.scales, least)
    row = np.zeros(probe.size)
    goal = 0.0
    for i in range(events):
        scales = plain.scales[size * i : size * (i + 1)]
        row[2 * size * i + size : 2 * size * (i + 1)] = guess[i, size:] / scales**2
        goal += float(((guess[i, size:] / scales) ** 2).sum())
    probe.pins = [(row, goal)]
    return probe


def _kernel(plain: Shooting, theta: float) -> np.ndarray:
    """The kernel vector of the equations that are closed with a factor `theta`; in natural scales
    its largest entry of an event is 1.
    """
    enclosure = plain.enclose(Ball(plain.x0))
    matrix = enclosure.open_jacobian.middle.copy()
    width = plain.event_size
    matrix[:, :width] = theta * matrix[:, :width] + enclosure.start_jacobian.middle
    scaled = np.linalg.svd(matrix * plain.scales / plain.row_scales[:, None])[2][-1]
    return np.asarray(plain.scales * scaled / np.abs(scaled[: plain.event_unknowns]).max())


def _touching(
    point: SpecialPoint,
    path: str,
    radii: dict[str, float] | None,
    steps: ShootingSettings | None,
) -> Shooting | CannotProve:
    """The equations of an orbit that touches its contact at an unknown parameter: one event has no
    jump, and one row pins its speed to 0.
    """
    orbit = point.orbit
    equations: Any = orbit.equations
    made = equations.touching_segments(point.point)
    if isinstance(made, CannotProve):
        return made
    probe = shooting_of(orbit, made, path=path, radii=radii, pins=[], settings=steps)
    assert made.touching is not None
    row = np.zeros(probe.size)
    row[made.guess.shape[1] * made.touching + 1] = 1.0
    probe.pins = [(row, 0.0)]
    return probe


def _unproved(point: SpecialPoint, path: str, reason: str, began: float) -> SpecialProof:
    return SpecialProof(
        proved=None,
        reason=reason,
        kind=str(point.kind),
        path=path,
        parameter=np.array([point.parameter, np.inf]),
        unique_within={},
        only_within={},
        assumptions=assumptions_of(point.orbit.symmetric),
        seconds=time.process_time() - began,
        special=point,
    )
