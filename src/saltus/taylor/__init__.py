"""From a model's Python to its Taylor series in machine code: traced, differentiated, written,
compiled and cached.

The path of an equation. `tracing.py` runs a model once on symbols, which gives a graph of shared
nodes (`graph.py`), and differentiates it where a tangent is asked for. `memory.py` lists the nodes
on tapes, operands first, and has the places of the code's arguments. Of a structure's functions,
each with its tapes, `generated.py` makes LLVM's text: `series.py` (Taylor coefficients) and
`instant` (values at one instant) write the instructions by the rules of `rules.py`. They are
written for one motion on plain doubles, and for an ensemble on vectors with one double for each
lane. The columns of a tangent are loops there, whose slopes are series of the motion (`Loops`).
`generated.py` also compiles it by llvmlite, without numba. `vectors.py` has the arithmetic on which
it is written; `lane_vectors.py` gives numba the same vectors for the ensemble's own loops. There is
no second generator, and each function has one rule.

Kernels, which no model changes, are compiled by numba (`kernels.py`, `private_numba.py`) and call a
structure's functions by their addresses (`numba_types.py`).

Assumptions of the generated code. The time enters through the load only, as a local time that
restarts with every forcing period. Expressions that are expanded in series hold no comparisons; on
one side of a contact they are analytic wherever they are finite. Parts that depend on parameters
alone are computed once for a motion (`shared_constants`). Series may use fused multiply-adds;
values at an instant never do, so that the difference of two equal products is 0. One motion divides
and uses the C library's sine and cosine, so that every coefficient is good to rounding; lanes
multiply by reciprocals.

How an elementary function is added: by one entry in `FUNCTIONS` (`rules.py`), NumPy's function and
its slope, as `"atan": Function(np.arctan, lambda u, y: 1.0 / (1.0 + u * u), increasing=True)`.
Tracing, derivatives, both widths and the bounds follow from it; for a function that does not
increase, the bounds need an entry in `bounds/intervals.py`. The test `tests/taylor/test_series.py`
goes through the table and compares the coefficients with power series in 40 digits.

How code is cached: in the user's cache directory (`cache.py`). A structure's object file has the
digest of its functions' tapes, of the sources that write their code, of llvmlite's version and of
the processor in its name; a kernel's file that of its text and of the sources that compile it, and
numba keeps the machine code beside it; a wheel may have this code (`shipped.py`). Numbers are arguments, so that new numbers never compile
anything. Interfaces of numba that are not public are used in `private_numba.py` alone.
"""

from saltus._front_door import front_door
from saltus.checks import check_environment

check_environment()
__getattr__, __dir__, __all__ = front_door(__name__, __file__)
