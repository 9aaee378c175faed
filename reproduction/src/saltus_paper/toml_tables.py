"""The tables in TOML that stand beside the code of this room."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any


@cache
def toml_table(*place: str) -> dict[str, Any]:
    """What is in a file, whose name comes last, after those of its folders."""
    return tomllib.loads(files("saltus_paper").joinpath(*place).read_text(encoding="utf-8"))
