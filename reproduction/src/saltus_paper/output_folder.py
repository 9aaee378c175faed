"""The folder that a reproduction is written to."""

from __future__ import annotations

import tempfile
from pathlib import Path

from saltus import ParameterError


def check_writable(folder: Path) -> None:
    """Refuse, before anything is computed, a folder in which no file can be made.

    Raises
    ------
    ParameterError
        The folder, or one above it, is a file or cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (FileExistsError, NotADirectoryError) as error:
        raise ParameterError(
            f"the output folder {folder} cannot be made: {error.filename} is a file; name "
            "another with --output"
        ) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ParameterError(
            f"the output folder {folder} cannot be written to ({reason.lower()}); name another "
            "with --output"
        ) from error
