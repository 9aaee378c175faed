"""Special points: of branches, where the number or stability of orbits changes, and of curves of
such points (codimension 2).
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any

from saltus.continuation import EndReason, MissedReason, Zero
from saltus.orbits.orbit import PeriodicOrbit
from saltus.result import RowTable

UserFunction = Callable[[PeriodicOrbit], float]


class SpecialKind(StrEnum):
    """The kinds of special points. The zero of a model's margin or of a user's function has the
    name of this function as its kind.

    Points of codimension 1 lie on branches, points of codimension 2 on curves of special points in
    two parameters.

    Examples
    --------
    >>> saltus.orbits.SpecialKind.LP == "LP", saltus.orbits.SpecialKind.CP.codimension
    (True, 2)
    """

    description: str
    codimension: int

    LP = "LP", "fold (limit point)"
    PD = "PD", "period doubling"
    BPC = "BPC", "branch point: symmetry breaking, or a crossing of branches"
    NS = "NS", "Neimark-Sacker"
    GR = "GR", "grazing"
    RL = (
        "RL",
        (
            "a release at which the load just reaches what holds the contact closed: the excursion"
            " after it shrinks to rest"
        ),
    )
    CH = (
        "CH",
        (
            "the impacts die away just at the instant of the next release: the rest between them"
            " has no duration"
        ),
    )
    SW = (
        "SW",
        "switching: a contact's release, or its closing, appears or is lost, or an event comes to"
        " a corner of the load",
    )
    GS = (
        "GS",
        "grazing-sliding: the sliding velocity touches 0; beyond, the mass sticks for a while",
    )
    CS = (
        "CS",
        (
            "crossing-sliding: at a reversal of the sliding direction a phase of sticking appears"
            " or is lost"
        ),
    )
    SS = (
        "SS",
        (
            "switching-sliding: before a phase of sticking a reversal of the sliding direction"
            " appears or is lost"
        ),
    )
    AS = "AS", "adding-sliding: within a phase of sticking a phase of sliding appears or is lost"
    CP = "CP", "cusp: two folds meet", 2
    GPD = (
        "GPD",
        "degenerate period doubling: the doubled orbit changes the side on which it lies",
        2,
    )
    DBPC = (
        "DBPC",
        "degenerate symmetry breaking: the unsymmetric orbits change the side on which they lie",
        2,
    )
    LP_GR = "LP-GR", "fold and grazing at once", 2
    PD_GR = "PD-GR", "period doubling and grazing at once", 2
    BPC_GR = "BPC-GR", "symmetry breaking and grazing at once", 2
    LP_PD_GR = (
        "LP-PD-GR",
        "a grazing at which folds and period doublings of the orbits with more impacts both end",
        2,
    )
    LP_BPC_GR = "LP-BPC-GR", "the same, with symmetry breakings of symmetric orbits", 2
    GR_GR = "GR-GR", "two grazings at once", 2
    NS_GR = "NS-GR", "Neimark-Sacker and grazing at once", 2
    SW_GR = "SW-GR", "grazing and another change of the orbit's events at once", 2
    LP_SW = (
        "LP-SW",
        "fold where the events of the orbit change, as a contact's release appears or is lost",
        2,
    )
    PD_SW = "PD-SW", "period doubling where they change", 2
    BPC_SW = "BPC-SW", "symmetry breaking where they change", 2
    NS_SW = "NS-SW", "Neimark-Sacker where they change", 2
    SW_SW = "SW-SW", "two changes of the orbit's events at once, no grazings", 2

    def __new__(cls, code: str, description: str, codimension: int = 1) -> SpecialKind:
        """A kind is equal to its code, a string."""
        kind = str.__new__(cls, code)
        kind._value_ = code
        kind.description = description
        kind.codimension = codimension
        return kind


class OrbitEnd(EndReason):
    """The reasons why branches of orbits and curves of special points end, in addition to those of
    any curve (`CurveEnd`).

    Examples
    --------
    >>> len(saltus.orbits.OrbitEnd) > 5
    True
    """

    START = "start"
    GROWING = "is still followed"
    BORN = "{kind} at {parameter:.9g}"
    FIRST = "the first {kind}"
    UNSTABLE = "is no longer stable"
    SHRINKS = "shrinks to rest"
    EQUILIBRIUM = "shrinks to an equilibrium at {parameter:.9g}, of which it is born"
    RELAY_CHATTERS = (
        "at {parameter:.9g} the two functions of a relay meet, so that it goes on and off without"
        " end: the cycle shrinks to nothing"
    )
    RELAY_TURNS = (
        "at {parameter:.10g} the motion just reaches a function of a relay: beyond, the relay has"
        " its other side at the end of the round, and these orbits are none"
    )
    GROWS = (
        "at {parameter:.10g} its amplitude has grown to {detail}, as without end at a resonance"
        " without damping"
    )
    CONNECTION = (
        "its period grows without end at {parameter:.9g}, where it leaves an equilibrium and comes"
        " back to one"
    )
    IMAGE = "meets its own image at a {kind}"
    GRAZES_ANOTHER = "ends at a grazing of the {detail}"
    COMES_BACK = (
        "comes back onto itself at {parameter:.9g}: between two branches that nearly meet it has"
        " gone over from one to the other; use a smaller step"
    )
    ALONG_ITSELF = (
        "comes back along itself: from {parameter:.9g} on its orbits are those that it has already,"
        " in the other direction; an event that leads on in two ways, or a step that was too long,"
        " has turned it round"
    )
    MANY_IMPACTS = "more than {detail} impacts a period"
    ACCUMULATES = "grazings accumulate near {parameter:.9g}: {detail} impacts and more"
    REPELS = "the orbit repels too strongly to be followed: its largest multiplier is {detail}"
    TWO_AT_ONCE = (
        "several contacts act at one instant, or impacts at a contact begin to die away: motions"
        " beside it have other equations"
    )
    NOT_UNIQUE = (
        "an impact loses its speed while both sides push outward: the motion is not unique there"
    )
    GRAZES_INTO_REST = "the orbit shrinks to rest"
    NO_OTHER_EVENTS = (
        "at {parameter:.10g} the events of the motion change, and no orbits with other events"
        " continue the branch"
    )
    NOT_CONTINUOUS = (
        "at {parameter:.10g} an event appears or is lost at which the motion is not continuous:"
        " neighbours end up {detail} apart"
    )
    TURNS = (
        "at {parameter:.10g} the sliding in a contact stops just at an impact: beyond, it turns"
        " round before this impact, where impacts die away before ever earlier ones, and the"
        " multipliers jump at each of them"
    )
    NO_SECTION = (
        "at {parameter:.10g} an event comes to the phase at which the state is given, and no other"
        " phase would do"
    )
    STICKS = (
        "from {parameter:.10g} on the mass sticks for good; it may then rest anywhere near that"
        " place"
    )
    NOT_ISOLATED = (
        "from {parameter:.10g} on an orbit has others beside it at the same parameters, as that of"
        " a mass which nothing holds: they are no branch"
    )
    NO_MOTION = "the motion cannot be followed {detail} the grazing"
    NO_DIRECTION = "neither direction after the grazing leads to orbits of the system"
    MEETS_GRAZING = "meets another grazing: {kind}"
    MEETS_CHANGE = "meets another change of the orbit's events: {kind}"
    REFUSED = "the system ends there: {detail}"
    NO_PULL = (
        "shrinks to rest at {parameter:.10g}: from there on the load no longer pulls the contact"
        " open"
    )
    REST_VANISHES = (
        "at {parameter:.10g} a rest has no duration left; beyond, the load pulls before the impacts"
        " have died away, and what follows is a branch of its own"
    )


class OrbitMissed(MissedReason):
    """What may go wrong along a branch of orbits, in addition to what may be missed along any curve
    (`CurveMissed`).
    """

    IMPOSSIBLE_PAIR = (
        "{kind} near {first}: a complex pair of multipliers has the modulus {detail}, although"
        " areas of states never grow (errata 22), so the multipliers are wrong there"
    )


class SpecialPoint(Zero):
    """A special point of a branch or of a curve, with its orbit and its evidence.

    Attributes
    ----------
    kind
        One of `SpecialKind`, or the name of a margin or a function.
    point
        The point, with its `orbit` and its parameters.
    evidence
        How well it is located.

    Examples
    --------
    >>> sorted(round(point.parameter, 6) for point in branch.special if point.kind == "LP")
    [0.848485, 0.908811]
    """

    @property
    def orbit(self) -> PeriodicOrbit:
        """The orbit."""
        orbit: PeriodicOrbit = self.point.orbit
        return orbit

    @property
    def amplitude(self) -> float:
        """max abs(theta) of the orbit."""
        return self.orbit.amplitude

    @property
    def defect(self) -> float:
        """The distance of the orbit from itself a period later, by direct simulation."""
        return self.orbit.defect

    @property
    def note(self) -> str:
        """What it is besides, or what else begins there, in words; empty if there is nothing."""
        found: str = self.orbit.equations.note(self.kind, self.point)
        return found

    def _repr_html_(self) -> str:
        return SpecialPoints([self])._repr_html_()

    def __repr__(self) -> str:
        place = ", ".join(f"{value:.12g}" for value in self.parameters)
        return (
            f"SpecialPoint(kind='{self.kind}',"
            f" {'parameter' if len(self.parameters) == 1 else 'parameters'}={place},"
            f" amplitude={self.amplitude:.9g}, period {self.orbit.period:.9g},"
            f" {self.orbit.impact_count} impacts, bracket"
            f" {self.evidence.bracket:.1g}{self.note and '; ' + self.note})"
        )


class SpecialPoints(RowTable, tuple[SpecialPoint, ...]):
    """The special points of a branch, a tuple that is shown as a table."""

    __slots__ = ()

    def _table(self) -> dict[str, Any]:
        columns: dict[str, Any] = {"kind": [str(point.kind) for point in self]}
        count = max((len(point.parameters) for point in self), default=1)
        names = ["parameter"] if count == 1 else [f"parameter_{i}" for i in range(count)]
        columns |= {name: [point.parameters[i] for point in self] for i, name in enumerate(names)}
        columns |= {
            "amplitude": [point.amplitude for point in self],
            "period": [point.orbit.period for point in self],
        }
        columns |= {"impacts": [point.orbit.impact_count for point in self]}
        columns |= {"bracket": [point.evidence.bracket for point in self]}
        proofs = [point.evidence.proof for point in self]
        if any(proof is not None for proof in proofs):
            columns["proved"] = [proof is not None and bool(proof.proved) for proof in proofs]
        return columns
