"""The proof of a special point: a fold, a period doubling, a symmetry breaking or a grazing, with
an enclosure of its parameter."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
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
)
from saltus.bounds import only_one as only_one_of
from saltus.orbits.branches.special_point import SpecialKind, SpecialPoint
from saltus.orbits.orbit import PeriodicOrbit
from saltus.orbits.proofs.orbit_proof import (
    ASSUMPTIONS,
    MIRROR,
    in_words,
    radii_columns,
    shooting_of,
    with_proof,
    within,
)
from saltus.orbits.proofs.segments import CannotProve
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
        whatever = " whatever its kernel vector," if self.only_within else ""
        return (
            f"{model} has a periodic orbit of {orbit.period} forcing "
            f"period{'s' * (orbit.period > 1)} with {meaning} ({self.kind}) at {self.path} = "
            f"{rounded_ball(*self.parameter)}. No other one of this signature,{whatever} lies, at "
            f"its impacts and at the nodes between them, within {within(alone)} of it."
        )

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
    grazes = point.kind == SpecialKind.GR
    made = (
        _touching(point, path, radii, steps)
        if grazes
        else _singular(orbit, 1.0 if point.kind == SpecialKind.LP else -1.0, path, radii, steps)
    )
    if isinstance(made, CannotProve):
        return _unproved(point, path, made.reason, began)
    zero = prove_zero(made)
    if isinstance(zero, NotProved):
        return _unproved(point, path, zero.reason, began)
    opened = made.is_open(zero.enclosure, zero.box)
    only: dict[str, float] = {}
    if opened and not grazes:
        box = only_one_of(made, zero)
        radii_by_name = {} if box is None else made.by_name(box)
        only = {
            name: radius for name, radius in radii_by_name.items() if not name.startswith(KERNEL)
        }
    return SpecialProof(
        proved=True if opened else None,
        reason="" if opened else "the contact was not shown to be open between impacts",
        kind=str(point.kind),
        path=path,
        parameter=np.array([zero.middle[-1], zero.radius[-1]]),
        unique_within=made.by_name(zero.unique),
        only_within=only,
        assumptions=(*ASSUMPTIONS, *((MIRROR,) * orbit.symmetric)),
        seconds=time.process_time() - began,
        special=point,
        shooting=made,
        zero=zero,
    )


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
        assumptions=ASSUMPTIONS,
        seconds=time.process_time() - began,
        special=point,
    )
