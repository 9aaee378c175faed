"""Where a result comes from: the attributes that every dataset of saltus carries."""

from __future__ import annotations

from typing import Any


def provenance(system: Any = None, *, tol: float | None = None, seed: int | None = None, **more: Any) -> dict[str, Any]:
    """`saltus_version`, `system` (as JSON), `tol` and `seed`, as far as there are such, then whatever else is to be said."""
    from saltus import __version__

    known = {"system": None if system is None else system.to_json(), "tol": tol, "seed": seed}
    return {"saltus_version": __version__, **{name: value for name, value in known.items() if value is not None}, **more}
