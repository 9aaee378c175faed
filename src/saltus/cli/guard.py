"""Errors and interruptions end a command with one sentence and an exit status, without a traceback."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer

from saltus.cli.interrupt import INTERRUPTED, INTERRUPTION, interruptible
from saltus.errors import SaltusError, shortened

BAD_INPUT = 2


@contextmanager
def guarded() -> Iterator[None]:
    """Turn an error that a user can act on, or an interruption, into a sentence on stderr and an exit status."""
    try:
        with interruptible():
            yield
    except SaltusError as error:
        stop(str(error), BAD_INPUT)
    except KeyboardInterrupt as error:
        # Python records that an interrupt has left an exec of text, and `python -m` then dies of SIGINT; another exec clears it.
        exec("")
        stop(str(error) or INTERRUPTION, INTERRUPTED)  # a sweep says how to go on
    except BrokenPipeError:  # `saltus info ... | head`: typer ends this quietly
        raise
    except OSError as error:
        place = f"{error.filename} " if error.filename else ""
        stop(f"{place}cannot be read or written ({(error.strerror or str(error)).lower()})", BAD_INPUT)
    except MemoryError:
        stop("there is not enough memory for this; ask for fewer samples or periods", BAD_INPUT)
    except RecursionError:
        stop("what is given is nested too deeply", BAD_INPUT)


def stop(sentence: str, status: int) -> NoReturn:
    """Say `sentence` on stderr and end with `status`."""
    print(f"saltus: {shortened(sentence)}", file=sys.stderr, flush=True)
    raise typer.Exit(status)
