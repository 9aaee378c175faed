"""`saltus page`: the page of a study, with results from files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

import saltus


def write_page(path: Path, results: Iterable[Path], output: Path | None) -> None:
    """Write the page of the study at `path`, and print where it is.

    Raises
    ------
    SaltusError
        A bad study, a file that is no result of it, a page that cannot be made or written.
    """
    study = saltus.load_study(path)
    given = dict(study.simulate.arguments) if study.simulate else {}
    known = (*study.system.model.coordinates, "velocity", "periods", "duration", "tol", "time")
    settings = {name: value for name, value in given.items() if name in known}
    file = Path(f"{study.name}.html") if output is None else output
    made = saltus.page(study.system, *map(saltus.load, results), path=file, title=study.name, **settings)
    Console(highlight=False).print(f"The page is {made}; open it in a browser.", markup=False, soft_wrap=True)
