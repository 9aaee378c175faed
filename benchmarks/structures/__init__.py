"""What a structure costs by its size, beside SciPy and Siconos: written to results/structures.md
with the rest, or alone by

    cd benchmarks && ../.venv/bin/python -m structures [--quick] [--again]

Each row is computed in a process of its own and kept in results/benchmarks/structures/ at the root,
so that a run that was broken off goes on where it was; `--again` computes all rows anew, and so
does another commit or another processor.
"""

from structures.beside import beside_structures

__all__ = ["beside_structures"]
