"""AUTO-07p as a peer: the branch of the smoothed equation, beside the exact one of saltus.

`make bench` runs it with the rest; alone it is `python -m auto [--quick]` in the folder
benchmarks/. It writes auto.md, auto.json and auto.png to benchmarks/results/.
"""

from auto.beside import beside_auto

__all__ = ["beside_auto"]
