"""The rows of structures alone."""

from __future__ import annotations

import sys

from machine import about

from structures.beside import beside_structures

quick = "--quick" in sys.argv
head = about(("saltus", "numpy", "scipy", "numba"), **({"quick": "yes"} if quick else {}))
beside_structures(head, quick, again="--again" in sys.argv)
