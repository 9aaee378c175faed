"""Where a result comes from: the attributes of every dataset of saltus, and the check whether they belong to a system."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError
from saltus.files import parsed_json

if TYPE_CHECKING:
    from saltus.systems import System

# Raised whenever the same request gives other numbers than before: results of another version are refused and not continued.
RESULT_VERSION = 14


def provenance(system: System | None = None, *, tol: float | None = None, seed: int | None = None, **more: Any) -> dict[str, Any]:
    """The attributes `saltus_version`, `result_version`, `system` and `equations` (as JSON), `tol` and `seed`, as far as they are
    given, and further ones.

    The system's JSON has its numbers, and `equations` a digest of each part of its equations (`saltus.taylor.equations_of`).
    """
    from saltus import __version__

    kept: dict[str, Any] = {"saltus_version": __version__, "result_version": RESULT_VERSION}
    if system is not None:
        kept |= {"system": system.to_json()} | identity(system)
    return kept | {name: value for name, value in (("tol", tol), ("seed", seed)) if value is not None} | more


def identity(system: System) -> dict[str, Any]:
    """The attributes that `check_provenance` compares, `result_version` and `equations`, for parts that are computed elsewhere.

    Raises
    ------
    TraceError
        A model that cannot be traced.
    """
    from saltus.taylor import equations_of

    return {"result_version": RESULT_VERSION, "equations": json.dumps(equations_of(system))}


def check_provenance(attributes: Mapping[str, Any], system: System, what: str, remedy: str = "compute it again") -> None:
    """Refuse a result, `what`, whose attributes are not those of this system and of this version of saltus.

    Raises
    ------
    ParameterError
        The error names the version or the part of the equations that differs, and the `remedy`.
    """
    differ = "; ".join(_differences(attributes, system))
    if differ:
        raise ParameterError(f"{what} is not of what is computed now: {differ}; {remedy}")


def _differences(attributes: Mapping[str, Any], system: System) -> Iterator[str]:
    version, name = attributes.get("result_version"), type(system.model).__name__
    if version != RESULT_VERSION:
        by = f"saltus {attributes['saltus_version']}" if "saltus_version" in attributes else "another saltus"
        yield f"it is by {by}, whose results are of version {version if version is not None else 1}, and here of {RESULT_VERSION}"
        return
    try:
        there = dict(parsed_json(attributes["equations"]))
    except (KeyError, TypeError, ValueError):
        yield f"it does not say of which equations of {name} it is"
        return
    here = json.loads(identity(system)["equations"])
    changed = [part for part in here if here[part] != there.get(part)]
    if changed:
        yield f"the {' and the '.join(changed)} of {name} {'has' if len(changed) == 1 else 'have'} changed since"
