"""The command line: `saltus simulate`, `run`, `plot`, `status`, `info`, `doctor` and `reproduce`, each in the file of its name.

Only typer and rich are imported before a command runs, so that help is immediate.
"""

from saltus.cli.app import main

__all__ = ["main"]
