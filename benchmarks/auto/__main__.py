"""The comparison with AUTO-07p alone."""

from __future__ import annotations

import sys

from machine import about

from auto.beside import beside_auto

quick = "--quick" in sys.argv
beside_auto(
    about(("saltus", "numpy", "scipy", "numba"), **({"quick": "yes"} if quick else {})), quick
)
