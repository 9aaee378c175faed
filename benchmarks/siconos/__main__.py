"""The comparison with Siconos alone."""

from __future__ import annotations

import sys

from machine import about

from siconos.beside import beside_siconos

quick = "--quick" in sys.argv
beside_siconos(about(("saltus", "numpy", "numba"), **({"quick": "yes"} if quick else {})), quick)
