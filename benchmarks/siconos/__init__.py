"""Siconos as a peer: time stepping of both layers, beside the exact events of saltus.

`make bench` runs it with the rest; alone it is `python -m siconos [--quick]` in the folder
benchmarks/. It writes siconos.md, siconos.json and siconos.png to benchmarks/results/.
"""

from siconos.beside import beside_siconos

__all__ = ["beside_siconos"]
