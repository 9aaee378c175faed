"""What a curve says in a sentence: why it ends, and why a special point that was noticed on it
could not be located.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from saltus.enumerations import Sentence

# What stands in the places of numbers where a reason is printed without its `End`.
PLACES = {"parameter": "...", "kind": "special point", "detail": "..."}


class EndReason(Sentence):
    """A reason for which a curve ends.

    Its value is the sentence, in which the numbers of an `End` are filled in.
    """

    def __str__(self) -> str:
        text = re.sub(r"\{(\w+)[^}]*\}", lambda place: PLACES[place[1]], str(self.value))
        return text.replace("......", "...")


class CurveEnd(EndReason):
    """The reasons that any curve may have.

    Examples
    --------
    >>> [end.reason.name for end in branch.ends]
    ['BOUND', 'BOUND']
    """

    BOUND = "bound {detail}{parameter:g}"
    CLOSED = "closes"
    MOST_POINTS = "more than {detail} points"
    NO_STEP = (
        "the steps shrink to nothing: the {detail} has a singularity that is none of the "
        "known kinds"
    )
    NOT_LOCATED = "a {kind} that could not be located"


@dataclass(frozen=True)
class End:
    """An end of a curve: its reason, the parameter there, and the special point and detail that its
    sentence mentions.

    Attributes
    ----------
    reason
        Why; a member of `CurveEnd` or of `saltus.orbits.OrbitEnd`.
    parameter
        The parameter's value there, of the one that is followed.
    kind
        The special point that is named in the reason, if there is one.
    detail
        A further word or number of the sentence.

    Examples
    --------
    >>> branch.ends[0].parameter, str(branch.ends[0])
    (0.8, 'bound 0.8')
    """

    reason: EndReason
    parameter: float | None = None
    kind: str = ""
    detail: str = ""

    def __repr__(self) -> str:
        return f"End({str(self)!r})"

    def __str__(self) -> str:
        return str(
            self.reason.value.format(parameter=self.parameter, kind=self.kind, detail=self.detail)
        )


class MissedReason(Sentence):
    """The reason why a special point was not located.

    Its value is the text, in which a `Missed` fills in its numbers.
    """


class CurveMissed(MissedReason):
    """The reasons that any curve may have."""

    NOT_LOCATED = "{kind} between {first} and {last}"
    STABILITY = "a change of stability between {first} and {last}"
    JUMP = "a change of stability near {first} by a jump, which is no special point"


@dataclass(frozen=True, eq=False)
class Missed:
    """A special point between two neighbouring points of a curve that was noticed but not located.

    Attributes
    ----------
    reason
        Why it could not be located.
    kind
        The kind whose test function changes its sign, if it is one.
    first
        The parameters at the first of the two points between which it lies.
    last
        The parameters at the last point.
    detail
        A further word or number of the sentence.

    Examples
    --------
    >>> branch.missed  # all that a test function told was located
    ()
    """

    reason: MissedReason
    kind: str
    first: np.ndarray
    last: np.ndarray
    detail: str = ""

    def __str__(self) -> str:
        first, last = (
            ", ".join(f"{value:.9g}" for value in values) for values in (self.first, self.last)
        )
        return str(
            self.reason.value.format(kind=self.kind, first=first, last=last, detail=self.detail)
        )
