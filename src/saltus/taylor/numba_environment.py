"""The check of environment variables of numba with which saltus cannot work."""

from __future__ import annotations

import os

from saltus.errors import SaltusError


def check_environment() -> None:
    """Refuse settings that would make numba fail with its own message when it is imported, or, without its compiler, much later.

    Raises
    ------
    SaltusError
        NUMBA_DISABLE_JIT is set, or NUMBA_NUM_THREADS is no count.
    """
    disabled, threads = os.environ.get("NUMBA_DISABLE_JIT", "0"), os.environ.get("NUMBA_NUM_THREADS", "1")
    if disabled not in ("", "0"):
        raise SaltusError("the environment has NUMBA_DISABLE_JIT set, but saltus is nothing without its compiler; unset it")
    if not (threads.isdecimal() and int(threads) > 0):
        raise SaltusError(f"the environment has NUMBA_NUM_THREADS={threads[:20]!r}, which is no number of threads; unset it")
