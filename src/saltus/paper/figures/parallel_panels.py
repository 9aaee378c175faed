"""The panels of a figure, computed on all cores, a process for each that is free."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

from saltus.flow import available_cores


def each(make: Callable[..., Any], values: Mapping[str, Any], /, longest: str = "last", **options: Any) -> dict[str, Any]:
    """`make(value, **options)` for every value, by the value's name.

    Those that take `longest` are begun first: the "first" or the "last" of the figure. Branches are followed by one core, so
    panels beside one another use what a single one would leave idle.
    """
    cores = min(available_cores(), len(values))
    if cores < 2:
        return {name: make(value, **options) for name, value in values.items()}
    with ProcessPoolExecutor(cores, mp_context=multiprocessing.get_context("spawn"), initializer=_deaf) as pool:
        order = list(values.items()) if longest == "first" else list(values.items())[::-1]
        made = {name: pool.submit(partial(make, value, **options)) for name, value in order}
        try:
            return {name: made[name].result() for name in values}
        except BaseException:  # interrupted, or a panel failed: the others are of no use any more
            pool.shutdown(wait=False, cancel_futures=True)
            for child in multiprocessing.active_children():
                child.terminate()
            raise


def _deaf() -> None:
    """Leave Ctrl-C, which reaches every process of a terminal, to the one that knows what to say."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
