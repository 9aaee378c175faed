"""Whether an output is up to date: a key from what made it, and the fingerprints of what it
left.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import saltus
from saltus_paper.claims.claim import Claim
from saltus_paper.claims.claim_tables import claim_tables
from saltus_paper.figures.figure import PaperFigure

# on whose versions the digits may depend
PACKAGES = ("numpy", "numba", "scipy", "xarray", "matplotlib")
FOLDER = ".saltus"  # inside the output folder


def key(figure: PaperFigure) -> str:
    """A fingerprint of saltus' version, the sources of the figure and of all it imports, its title,
    parameters and claims.
    """
    digest = hashlib.sha256(saltus.__version__.encode())
    for module in sorted(closure(figure.module)):
        digest.update(module.encode() + b"\0" + _source(module) + b"\0")
    claims = {id: asdict(entry) for id, entry in claim_tables().get(figure.name, {}).items()}
    digest.update(
        json.dumps([figure.title, dict(figure.parameters), claims], sort_keys=True).encode()
    )
    return digest.hexdigest()


@cache
def closure(module: str) -> frozenset[str]:
    """`module` and the modules of saltus and of this package that it imports, directly or not, at
    its top or in functions.
    """
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name in found or _path(name) is None:
            continue
        found.add(name)
        waiting += _imports(name)
    return frozenset(found)


@cache
def _imports(module: str) -> list[str]:
    names: list[str] = []
    for node in ast.walk(ast.parse(_source(module))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names += [node.module, *(_home(node.module, alias.name) for alias in node.names)]
    return [name for name in names if name.startswith(("saltus.", "saltus_paper."))]


def _home(package: str, name: str) -> str:
    """The module that defines a name which a package gives, behind as many front doors as there
    are.
    """
    module = _behind_the_door(package).get(name)
    if module is None:
        return f"{package}.{name}"
    return _home(module, name) if name in _behind_the_door(module) else module


@cache
def _behind_the_door(package: str) -> dict[str, str]:
    """The modules of the names that a room's front door gives, as its stub lists them."""
    path = _path(package)
    stub = None if path is None else path.with_suffix(".pyi")
    if stub is None or path is None or path.name != "__init__.py" or not stub.exists():
        return {}
    imports = [
        node
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom) and node.module
    ]
    return {alias.name: f"{package}.{node.module}" for node in imports for alias in node.names}


@cache
def _path(module: str) -> Path | None:
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(spec.origin) if spec is not None and spec.origin else None


@cache
def _source(module: str) -> bytes:
    path = _path(module)
    return path.read_bytes() if path else b""


def as_made(figure: PaperFigure, folder: Path) -> PaperFigure:
    """The figure at the effort at which it was made; the standard one where there is no record."""
    record = read(figure, folder)
    return figure.at("quick") if record is not None and record.get("effort") == "quick" else figure


def up_to_date(figure: PaperFigure, folder: Path) -> bool:
    """Whether every output is there, unchanged, and made by what `key` stands for."""
    record = read(figure, folder)
    return record is not None and record.get("key") == key(figure) and intact(figure, folder)


def intact(figure: PaperFigure, folder: Path) -> bool:
    """Whether every output is there as its record has it, and the claims can be read, whatever
    sources made them.
    """
    record = read(figure, folder)
    prints = record.get("files") if record else None
    if (
        record is None
        or not isinstance(prints, dict)
        or any(fingerprint(folder / name) != prints.get(name, "") for name in figure.files())
    ):
        return False
    try:
        claims(figure, folder)
        return math.isfinite(record["seconds"]) and isinstance(record["versions"], dict)
    except (
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
    ):  # by another version of saltus, or by somebody else
        return False


def read(figure: PaperFigure, folder: Path) -> dict[str, Any] | None:
    """The record that `write` left, or None where there is none that can be read."""
    try:
        record = json.loads((folder / FOLDER / f"{figure.name}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return record if isinstance(record, dict) else None


def claims(figure: PaperFigure, folder: Path) -> list[Claim]:
    """The claims of a figure that is up to date, as recorded when it was made."""
    record = read(figure, folder)
    return [Claim.from_dict(row) for row in record["claims"]] if record else []


def write(figure: PaperFigure, folder: Path, made: Iterable[Claim], seconds: float) -> None:
    """Record what made the figure's outputs, with which versions and in which time, their
    fingerprints and claims.

    It is written last, so that an interrupted run leaves none.
    """
    files = {name: fingerprint(folder / name) for name in figure.files()}
    versions = {name: version(name) for name in ("saltus", *PACKAGES)}
    record = {
        "key": key(figure),
        "files": files,
        "seconds": round(seconds, 1),
        "versions": versions,
        "effort": figure.effort,
    }
    record["claims"] = [claim.to_dict() for claim in made]
    saltus.save(folder / FOLDER / f"{figure.name}.json", json.dumps(record, indent=1))


def fingerprint(path: Path) -> str | None:
    """The SHA-256 of a file, or None where there is none."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
