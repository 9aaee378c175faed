"""The errors that saltus raises for a user to act on; each message says what was wrong, where, and
what would be right.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

LONGEST = 380  # the most characters of a sentence, as names from a file may have any length
# the most characters of a name that is compared with known ones, and of their list
LONGEST_NAME = 80
LONGEST_LIST = 200


class SaltusError(Exception):
    """The base of every error that saltus raises on purpose; the command line prints it as one
    sentence.

    Parameters
    ----------
    message
        The sentence; a long one is shortened.

    Examples
    --------
    >>> issubclass(saltus.ParameterError, saltus.SaltusError)
    True
    """

    def __init__(self, message: str = "") -> None:
        super().__init__(shortened(message))


class ParameterError(SaltusError, ValueError):
    """A value, a name or a combination of them that has no meaning for the system.

    `parameter` is the dotted path of the wrong one, such as "load.frequency" or "max_period", or
    None if it is not a single one.

    Parameters
    ----------
    message
        One sentence: what was wrong, where, and what would be right.
    parameter
        The dotted path of the wrong parameter, or None if it is not a single one.

    Examples
    --------
    >>> saltus.Metainterface(beta0=80.0)
    Traceback (most recent call last):
        ...
    saltus.errors.ParameterError: beta0 must lie in (0, pi) rad, got 80.0 (degrees?)
    """

    def __init__(self, message: str, parameter: str | None = None) -> None:
        super().__init__(message)
        self.parameter = parameter

    def inside(self, owner: str) -> ParameterError:
        """The error with the path of the parameter as a part of `owner`: "model.beta0 must ..." for
        "beta0 must ...".

        Parameters
        ----------
        owner
            The path of the part that contains the parameter, such as "model".
        """
        message = str(self)
        if self.parameter is None:
            return ParameterError(f"{owner}: {message}", owner)
        path = f"{owner}.{self.parameter}"
        subject = f"{self.parameter} "
        predicate = message.removeprefix(subject)
        return ParameterError(
            f"{path}: {message}" if predicate == message else f"{path} {predicate}", path
        )


class TraceError(SaltusError, TypeError):
    """A model uses an operation that cannot be expanded in a Taylor series.

    The sentence begins with the method, and the file and line of what it refuses, where these are
    in code of a user's own: "Pendulum.force (pendulum.py:12): ...".

    Examples
    --------
    >>> issubclass(saltus.TraceError, saltus.SaltusError)
    True
    """

    has_place = False

    def put_at(self, place: str) -> None:
        """Begin the sentence with the place of what it refuses, unless it has one.

        Parameters
        ----------
        place
            The method, file and line, such as "Pendulum.force (pendulum.py:12)".
        """
        if not self.has_place:
            self.args = (shortened(f"{place}: {self}"),)
            self.has_place = True


class MotionError(SaltusError, RuntimeError):
    """A motion cannot be continued: it is not unique, an impact has no solution, or the numbers
    overflow.

    Examples
    --------
    >>> sliding = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=0.5))
    >>> saltus.simulate(sliding, theta=0.0, duration=1.0)
    Traceback (most recent call last):
        ...
    saltus.errors.MotionError: the motion from rest at contact at time 0 is not unique: ...
    """

    status: int | None = None  # the kernel's reason, of a motion that it could not continue


class SweepError(SaltusError, RuntimeError):
    """A sweep that cannot go on, or that ended without some of its chunks; what was computed is
    kept.

    `failures` are the chunks that failed (`saltus.sweep.Failure`); `dataset` has the computed
    chunks if no store keeps them, else it is None.

    Parameters
    ----------
    message
        One sentence.
    failures
        The chunks that failed, each a `saltus.sweep.Failure`.
    dataset
        The chunks that were computed, if no store keeps them.

    Examples
    --------
    >>> issubclass(saltus.SweepError, saltus.SaltusError)
    True
    """

    def __init__(self, message: str, failures: Iterable[Any] = (), dataset: Any = None) -> None:
        super().__init__(message)
        self.failures = tuple(failures)
        self.dataset = dataset


def near(name: str, known: Iterable[str], also: Iterable[str] = ()) -> str:
    """The end of a sentence about an unknown `name`: the similar names, or all known ones if none
    is similar.

    Names in `also`, the arguments of the function that is asked, are proposed in the same way, and
    listed behind.
    """
    import difflib

    also = tuple(also)
    # users write the text of an enumeration's member, not its repr
    known = sorted(str(name) for name in known)
    asked = str(name)[:LONGEST_NAME]
    # theta is near threads, but is not meant
    further = difflib.get_close_matches(asked, also, n=3, cutoff=0.7)
    close = difflib.get_close_matches(asked, [*known, *further], n=3, cutoff=0.6)
    if close:
        return "did you mean " + " or ".join(repr(c) for c in close) + "?"
    arguments = f"; the arguments are {_listed(also)}" if also else ""
    return f"known here: {_listed(known)}{arguments}"


def _listed(names: Iterable[str]) -> str:
    listed = ", ".join(sorted(names)) or "none"
    return (
        listed
        if len(listed) <= LONGEST_LIST
        else listed[:LONGEST_LIST].rpartition(", ")[0] + ", ..."
    )


def shown(value: Any, most: int = 60) -> str:
    """A value in the form in which a sentence shows it: on one line and not longer than `most`
    characters.
    """
    if isinstance(value, int) and abs(value) >= 10**20:
        return "a very large number"  # Python itself refuses to write some of them
    # the rest would not be seen
    value = value[:most] if isinstance(value, (str, bytes, list, tuple)) else value
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a user's own class may raise anything
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= most else text[: most - 3] + "..."


def shortened(sentence: str) -> str:
    """A sentence on one line, cut to `LONGEST` characters, of letters that can be printed: bytes of
    a damaged file may be quoted in it."""
    line = " ".join(sentence.split())
    line = line if line.isprintable() else "".join(c if c.isprintable() else "?" for c in line)
    return (
        line
        if len(line) <= LONGEST
        else f"{line[: LONGEST * 2 // 3]} ... {line[-LONGEST // 3 + 5 :]}"
    )


def printable(text: str, most: int = 400) -> str:
    """Text from a file, for a terminal: on one line, without control characters, not longer than
    `most` characters.
    """
    plain = "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in text[: most + 1])
    return plain if len(plain) <= most else plain[: most - 3] + "..."
