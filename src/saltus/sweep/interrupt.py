"""Interrupts that wait until the program can be left cleanly."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def deferred_interrupts() -> Iterator[Callable[[], None]]:
    """A context in which Ctrl-C raises nothing at once; the function that it yields raises KeyboardInterrupt if there was one.

    Python would raise it wherever the main thread happens to be: in a destructor of another library, where it is lost, or while a
    lock is being taken. Outside the main thread signals do not arrive, and the context changes nothing.
    """
    seen: list[int] = []

    def raise_if_interrupted() -> None:
        if seen:
            raise KeyboardInterrupt

    def remember(number: int, _: Any) -> None:
        seen.append(number)

    try:
        before = signal.signal(signal.SIGINT, remember)
    except ValueError:
        yield raise_if_interrupted
        return
    try:
        yield raise_if_interrupted
    finally:
        signal.signal(signal.SIGINT, before)
