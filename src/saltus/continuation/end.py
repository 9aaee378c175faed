"""The reasons why curves end, as data whose text is a sentence."""

from __future__ import annotations

from dataclasses import dataclass

from saltus.enumerations import Sentence


class EndReason(Sentence):
    """A reason for which a curve ends. Its value is the sentence, in which the numbers of an `End` are filled in."""


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
    NO_STEP = "the steps shrink to nothing: the {detail} has a singularity that is none of the known kinds"
    NOT_LOCATED = "a {kind} that could not be located"


@dataclass(frozen=True)
class End:
    """An end of a curve: its reason, the parameter there, and the special point and detail that its sentence mentions.

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

    def __str__(self) -> str:
        return str(self.reason.value.format(parameter=self.parameter, kind=self.kind, detail=self.detail))
