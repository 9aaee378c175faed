"""Special points along a curve that were noticed but not located, as data whose text is a sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.enumerations import Sentence


class MissedReason(Sentence):
    """The reason why a special point was not located. Its value is the text, in which a `Missed` fills in its numbers."""


class CurveMissed(MissedReason):
    """The reasons that any curve may have."""

    NOT_LOCATED = "{kind} between {first} and {last}"
    STABILITY = "a change of stability between {first} and {last}"


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
        first, last = (", ".join(f"{value:.9g}" for value in values) for values in (self.first, self.last))
        return str(self.reason.value.format(kind=self.kind, first=first, last=last, detail=self.detail))
