"""The command line: `saltus simulate`, `saltus info` and `saltus reproduce`.

Only typer and rich are imported before a command runs, so that help is immediate.
"""

from saltus.cli.app import main

__all__ = ["main"]
