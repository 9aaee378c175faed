"""The command line: `saltus simulate`, `run`, `plot`, `status`, `info` and `doctor`, and commands
that other packages add.

Only typer and rich are imported before a command runs, so that help is immediate.
"""

import os
import signal
from typing import Any

from saltus._front_door import front_door
from saltus.cli.guard import INTERRUPTED, INTERRUPTION

__getattr__, __dir__, __all__ = front_door(__name__, __file__)


def main() -> None:
    """The entry point of the command `saltus`.

    An interruption that falls outside a command, as while modules are loaded or options are read,
    ends the process at once, with the sentence and the status of one within: there is nothing to
    clean up, and typer would say nothing.
    """
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _end)
    from saltus.cli.app import begin

    begin()


def _end(*_: Any) -> None:
    os.write(2, f"saltus: {INTERRUPTION}\n".encode())
    os._exit(INTERRUPTED)
