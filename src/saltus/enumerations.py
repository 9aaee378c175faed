"""Enumerations whose members have a sentence: code compares the members, a reader gets the
sentences.
"""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Any, Self


class NumberedSentence(IntEnum):
    """Members that stand in arrays as numbers and whose `str` is a sentence: `HELD = 1, "it is at
    rest at the contact"`.
    """

    _value_: int
    sentence: str

    def __new__(cls, number: int, sentence: str = "") -> Self:
        """A member has its number as value, by which it is looked up."""
        member = int.__new__(cls, number)
        member._value_ = number
        member.sentence = sentence
        return member

    def __str__(self) -> str:
        return self.sentence


def flags(kind: type[NumberedSentence]) -> dict[str, Any]:
    """The attributes that say what the numbers of a variable mean, after the CF conventions."""
    return {
        "flag_values": [int(member) for member in kind],
        "flag_meanings": " ".join(member.name.lower() for member in kind),
    }


class Sentence(Enum):
    """Members whose value and whose `str` is a sentence, which may have places for numbers."""

    @property
    def code(self) -> str:
        """The member as a word for files."""
        return self.name.lower()

    def __str__(self) -> str:
        return str(self.value)
