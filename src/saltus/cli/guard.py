"""How commands say how far they are, and how they end: errors and interruptions with one sentence
and an exit status.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

from saltus.errors import SaltusError, shortened

if TYPE_CHECKING:  # `saltus --help` imports no NumPy
    from saltus.progress import Progress

# the second is 128 + SIGINT, as shells have it
BAD_INPUT = 2
INTERRUPTED = 130
INTERRUPTION = "interrupted; no file was left half-written"
REMINDER_AFTER = 1.0  # s; enough for the clean-up after an interrupt, before it is raised again


@contextmanager
def interruptible() -> Iterator[None]:
    """Let SIGINT end the block with a KeyboardInterrupt.

    Python raises the KeyboardInterrupt in whatever code is running, where it can be lost: a
    callback from C drops it, and the import of an extension module turns it into an ImportError. So
    it is raised again until the block ends, and any error that it causes is treated as the
    interrupt. A process that ignores SIGINT continues to ignore it.
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


@contextmanager
def guarded() -> Iterator[None]:
    """Turn an error that a user can act on, or an interruption, into a sentence on stderr and an
    exit status.
    """
    try:
        with interruptible():
            yield
    except SaltusError as error:
        stop(str(error), BAD_INPUT)
    except KeyboardInterrupt as error:
        # Python records that an interrupt has left an exec of text, and `python -m` then dies of
        # SIGINT; another exec clears it.
        exec("")
        stop(str(error) or INTERRUPTION, INTERRUPTED)  # a sweep says how to go on
    except BrokenPipeError:  # `saltus info ... | head`: typer ends this quietly
        raise
    except OSError as error:
        place = f"{error.filename} " if error.filename else ""
        stop(
            f"{place}cannot be read or written ({(error.strerror or str(error)).lower()})",
            BAD_INPUT,
        )
    except MemoryError:
        stop("there is not enough memory for this; ask for fewer samples or periods", BAD_INPUT)
    except RecursionError:
        stop("what is given is nested too deeply", BAD_INPUT)


def stop(sentence: str, status: int) -> NoReturn:
    """Say `sentence` on stderr and end with `status`."""
    import typer

    print(f"saltus: {shortened(sentence)}", file=sys.stderr, flush=True)
    raise typer.Exit(status)


@contextmanager
def progress_bar(title: str) -> Iterator[Progress]:
    """A bar with a clock on a terminal; elsewhere a line on stderr whenever another step of the
    work begins.

    The commands of saltus draw theirs in this way; a command that another package adds can do the
    same.

    Parameters
    ----------
    title
        What the work is, before the name of the step.

    Yields
    ------
    Progress
        The `progress(fraction, what)` that the work calls; `what` names the step, and after a comma
        what changes in it.

    Examples
    --------
    >>> from saltus.cli import progress_bar
    >>> with progress_bar("spectrum") as progress:
    ...     ends = saltus.simulate_many(system, theta=[0.1, 0.3], periods=10, progress=progress)
    """
    from rich.console import Console
    from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    messages = Console(stderr=True, highlight=False)
    step = ""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=20),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=messages, transient=True, disable=not messages.is_terminal) as bar:
        task = bar.add_task(title, total=1.0)

        def show(fraction: float, what: str) -> None:
            nonlocal step
            bar.update(task, completed=fraction, description=f"{title}: {what}")
            if not messages.is_terminal and what.split(",")[0] != step:
                step = what.split(",")[0]
                print(f"{title}: {step}", file=messages.file, flush=True)

        show(0.0, "computing")
        yield show
