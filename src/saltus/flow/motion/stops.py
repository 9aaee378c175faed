"""Why motions end, in one enumeration for a single motion and for ensembles."""

from __future__ import annotations

from enum import StrEnum


class Stop(StrEnum):
    """Why a motion ended: a word, and its `meaning` in a sentence.

    Examples
    --------
    >>> str(saltus.simulate(system, theta=0.3, periods=2).stop)
    'horizon'
    """

    meaning: str

    def __new__(cls, word: str, meaning: str) -> Stop:
        member = str.__new__(cls, word)
        member._value_, member.meaning = word, meaning
        return member

    HORIZON = "horizon", "the time asked for"
    REST = "rest", "the time asked for, at rest"
    LIMIT = "limit", "a margin of the model reached zero"
    CAPTURED = "captured", "proved to be captured at rest for all later loads"
    SETTLED = "settled", "repeats itself every `recurrence_period` forcing periods"
    NOT_UNIQUE = "not_unique", "the motion from rest at contact is not unique"
    NO_IMPACT = "no_impact", "the impact law has no velocity after the impact"
    NOT_FINITE = "not_finite", "the motion leaves the range of numbers"
    STALLED = "stalled", "the acceleration is singular"
    SINGULAR = "singular", "the mass matrix has no inverse"
    OUTSIDE = "outside", "the state at the start lies beyond the contact"
    UNRESOLVED = "unresolved", "impacts accumulate too slowly to be followed: more than a million in a unit of time"
