"""`saltus page` and `saltus explore`: the page of a study, with results from files, and opened."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

import saltus


def write_page(path: Path, results: Iterable[Path], output: Path | None, show: bool = False) -> None:
    """Write the page of the study at `path`, open it if it is to be shown, and print where it is.

    Raises
    ------
    SaltusError
        A bad study, a file that is no result of it, a page that cannot be made or written.
    """
    study = saltus.load_study(path)
    given = dict(study.simulate.arguments) if study.simulate else {}
    known = (*study.system.model.coordinates, "velocity", "periods", "duration", "tol", "time")
    settings = {name: value for name, value in given.items() if name in known}
    file = (Path("results") / study.name if show else Path()) / f"{study.name}.html" if output is None else output
    made = saltus.page(study.system, *map(saltus.load, results), path=file, title=study.name, **settings)
    opened = show and webbrowser.open(made.absolute().as_uri())
    said = "your browser opens it" if opened else "open it in a browser"
    Console(highlight=False).print(f"The page is {made}; {said}.", markup=False, soft_wrap=True)
