"""Ctrl-C that ends a command whatever code it interrupts."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

INTERRUPTED = 130  # 128 + SIGINT, as shells have it
INTERRUPTION = "interrupted; no file was left half-written"
REMINDER_AFTER = 1.0  # s; enough for the clean-up after an interrupt, before it is raised again


@contextmanager
def interruptible() -> Iterator[None]:
    """Let SIGINT end the block with a KeyboardInterrupt.

    Python raises the KeyboardInterrupt in whatever code is running, where it can be lost: a callback from C drops it, and the
    import of an extension module turns it into an ImportError. So it is raised again until the block ends, and any error that it
    causes is treated as the interrupt. A process that ignores SIGINT continues to ignore it.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN or threading.current_thread() is not threading.main_thread():
        yield
        return
    reminders: list[threading.Timer] = []

    def interrupt(*_: Any) -> NoReturn:
        reminder = threading.Timer(REMINDER_AFTER, _remind)
        reminder.daemon = True
        reminder.start()
        reminders.append(reminder)
        raise KeyboardInterrupt

    hook = sys.unraisablehook
    sys.unraisablehook = lambda lost: None if lost.exc_type is KeyboardInterrupt else hook(lost)
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    except Exception as error:
        if reminders:
            raise KeyboardInterrupt from error
        raise
    finally:
        signal.signal(signal.SIGINT, before)
        for reminder in reminders:
            reminder.cancel()
        sys.unraisablehook = hook


def _remind() -> None:
    """Send SIGINT to the main thread itself, so that it wakes from waiting."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:
        _thread.interrupt_main()
