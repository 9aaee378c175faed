"""Large linear structures in few coordinates: the method of Craig and Bampton (AIAA Journal 6(7),
1968).

With the rows R of the displacements that are kept, b = R u, the displacements are

    u = U_b b + U_z z,    K U_b + R' F = 0,  R U_b = 1,    K U_z = M U_z w^2 - R' G,  R U_z = 0:

the static shapes of the kept displacements, and the slowest modes while these are held. Rows
without mass follow statically. A structure that the kept displacements do not hold has shapes of
K + s M in place of the static ones, with a small s.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from saltus.checks import check_memory
from saltus.errors import ParameterError, shown

# Structures of up to so many rows are reduced by dense matrices.
DENSE = 400
# The shift s of what nothing holds, as a share of the largest stiffness by the largest mass.
SHIFT = 1e-10
# The square of a frequency, in units of rounding of the largest, below which a mode is a motion of
# what nothing holds.
FLOATING = 10.0
ITERATIONS = 4  # of the search for such a mode
# A mass along a mode that is a smaller share of the largest is that of a mode without mass.
MASSLESS = 1e-13
SYMMETRIC = 1e-9  # the largest difference of two entries across the diagonal, as a share


class Shapes(NamedTuple):
    """The basis of a reduced structure, by its columns."""

    static: np.ndarray  # U_b, (rows, kept)
    modes: np.ndarray  # U_z, (rows, modes), of mass 1
    frequencies: np.ndarray  # w of the modes, (modes,)


def sparse_matrix(given: Any, name: str) -> Any:
    """A square matrix (rows, rows) of numbers in SciPy's compressed columns. A mass or a stiffness of
    which one triangle was given is completed; a damping need not be symmetric.

    Raises
    ------
    ParameterError
        No matrix of real numbers, one that is not square, or not finite.
    """
    import scipy.sparse as sp

    if isinstance(given, str):
        given = _in_file(given, name)
    try:
        found = sp.csc_array(given)
        kind = found.dtype.kind
    except (TypeError, ValueError):
        raise ParameterError(
            f"{name} must be a matrix of numbers, got {shown(given)}", name
        ) from None
    if kind == "c" and not np.abs(found.imag.data).max(initial=0.0):
        found = found.real
        kind = "f"
    if kind == "c":
        raise ParameterError(
            f"{name} is complex, which has no meaning for motions in time: give structural damping"
            " as a viscous damping with its loss at one frequency, C = imag(K) / omega",
            name,
        )
    if kind not in "fiub":
        raise ParameterError(f"{name} must be a matrix of numbers, got {shown(given)}", name)
    if found.shape[0] != found.shape[1] or not found.shape[0]:
        sizes = " x ".join(map(str, found.shape))
        raise ParameterError(f"{name} must be a square matrix, got one of {sizes}", name)
    found = sp.csc_array(found, dtype=float)
    if not np.isfinite(found.data).all():
        raise ParameterError(f"{name} must have finite numbers", name)
    upper = sp.triu(found, k=1)
    lower = sp.tril(found, k=-1)
    # SciPy counts stored zeros too
    counts = [int(np.count_nonzero(half.data)) for half in (upper, lower)]
    if name != "damping" and min(counts) == 0 < max(counts):
        found = sp.csc_array(found + (upper + lower).T)
    return found


def _in_file(path: str, name: str) -> Any:
    """A matrix in a file of Matrix Market (.mtx), or of SciPy's sparse matrices (.npz)."""
    import scipy.io
    import scipy.sparse as sp

    from saltus.files import reading

    if not path.endswith((".mtx", ".npz")):
        raise ParameterError(
            f"{name} must be a matrix, or a .mtx file or a .npz file of scipy.sparse.save_npz, "
            f"got {shown(path)}",
            name,
        )
    with reading(path, "a file of a matrix"):
        return scipy.io.mmread(path) if path.endswith(".mtx") else sp.load_npz(path)


def check_symmetric(matrix: Any, name: str) -> None:
    """Refuse a matrix that is not symmetric."""
    apart = abs(matrix - matrix.T)
    if apart.max() > SYMMETRIC * abs(matrix).max():
        entries = apart.tocoo()
        worst = int(np.argmax(entries.data))
        i = int(entries.row[worst])
        j = int(entries.col[worst])
        raise ParameterError(
            f"{name} must be symmetric, got {matrix[i, j]:g} in row {i}, column {j} and "
            f"{matrix[j, i]:g} in row {j}, column {i}",
            name,
        )


def shapes_of(mass: Any, stiffness: Any, rows: np.ndarray, modes: int) -> Shapes:
    """The static shapes of the displacements of these rows (kept, n), and so many of the slowest
    modes while they are held.

    Parameters
    ----------
    mass, stiffness
        Symmetric matrices in SciPy's compressed columns, (n, n).
    rows
        R, (kept, n).
    modes
        How many.

    Raises
    ------
    ParameterError
        There are not as many modes; the stiffness is not positive where the rows are held.
    """
    heaviest = abs(mass).max()
    if not heaviest > 0.0:
        raise ParameterError("mass must have numbers above 0, and all of them are 0", "mass")
    shift = 0.0
    solver = _Held(mass, stiffness, rows, shift)
    # without any stiffness the shift is all that holds the masses
    largest = abs(stiffness).max() / heaviest or 1.0
    if not abs(solver.slowest()) > FLOATING * np.finfo(float).eps * largest:
        shift = SHIFT * largest if stiffness.nnz else 1.0
        solver = _Held(mass, stiffness, rows, shift)
    static = solver.static()
    if not np.isfinite(static).all():
        raise ParameterError(
            "stiffness has rows without any number, or parts that nothing holds and that have no "
            "mass: leave them out",
            "stiffness",
        )
    squares, found = solver.modes(modes)
    squares = squares - shift
    if squares.min(initial=0.0) < -2.0 * shift:
        raise ParameterError(
            f"stiffness must not be negative: a mode has the square {squares.min():g} of its "
            f"frequency while contacts are held",
            "stiffness",
        )
    return Shapes(static, found, np.sqrt(np.maximum(squares, 0.0)))


class _Held:
    """A structure whose displacements of some rows are held: the solutions of

    [[K + s M, R'], [R, 0]] (u, F) = (right side).
    """

    def __init__(self, mass: Any, stiffness: Any, rows: np.ndarray, shift: float) -> None:
        import scipy.sparse as sp
        from scipy.sparse.linalg import splu

        self.mass = mass
        self.stiffness = stiffness + shift * mass if shift else stiffness
        self.rows = rows
        self.size = mass.shape[0]
        held = sp.csc_array(rows)
        blocks = [[self.stiffness, held.T], [held, None]]
        try:
            self._factors = splu(sp.block_array(blocks, format="csc"))
        except RuntimeError:  # it is exactly singular
            self._factors = None

    def slowest(self) -> float:
        """About the square of the lowest frequency, by inverse iterations; 0 where there is none."""
        if self._factors is None:
            return 0.0
        pad = np.zeros(len(self.rows))
        shape = np.cos(np.arange(self.size) ** 2.0)
        square = 0.0
        for _ in range(ITERATIONS):
            pushed = self.mass @ shape
            size = np.sqrt(abs(float(shape @ pushed)))
            solved = self._factors.solve(np.append(pushed, pad))[: self.size]
            grown = np.sqrt(abs(float(solved @ (self.mass @ solved))))
            if not (np.isfinite(grown) and grown > 0.0):
                return 0.0
            square = size / grown
            shape = solved / grown
        return square

    def static(self) -> np.ndarray:
        """The shapes with 1 along one row and 0 along the others, (n, kept); nan where there are
        none."""
        if self._factors is None:
            return np.full((self.size, len(self.rows)), np.nan)
        right = np.zeros((self.size + len(self.rows), len(self.rows)))
        right[self.size :] = np.eye(len(self.rows))
        return np.asarray(self._factors.solve(right)[: self.size])

    def modes(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The squares of the frequencies of the slowest modes, and their shapes of mass 1."""
        free = self.size - len(self.rows)
        if count > free:
            raise ParameterError(f"modes must be at most {free}, got {count}", "modes")
        if not count:
            return np.zeros(0), np.zeros((self.size, 0))
        squares, shapes = self._dense(count) if self.size <= DENSE else self._sparse(count)
        order = np.argsort(squares, kind="stable")
        return squares[order], shapes[:, order]

    def _dense(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        from scipy.linalg import eigh, null_space

        free = null_space(self.rows)
        mass = free.T @ (self.mass @ free)
        try:
            # masses may be 0, and stiffnesses are not
            shares, found = eigh(mass, free.T @ (self.stiffness @ free))
        except np.linalg.LinAlgError:
            raise ParameterError(
                "stiffness must not be negative where contacts are held, up to rounding",
                "stiffness",
            ) from None
        there = np.flatnonzero(shares > MASSLESS * shares.max())
        if count > len(there):
            raise ParameterError(
                f"modes must be at most {len(there)}, as others have no mass, got {count}", "modes"
            )
        chosen = there[-count:]
        return 1.0 / shares[chosen], free @ (found[:, chosen] / np.sqrt(shares[chosen]))

    def _sparse(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

        pad = np.zeros(len(self.rows))

        def solved(right: np.ndarray) -> np.ndarray:
            return np.asarray(self._factors.solve(np.append(right, pad))[: self.size])

        check_memory("modes", 8.0 * self.size * (3.0 * count + 20.0), "its modes")
        inverse = LinearOperator((self.size, self.size), matvec=solved, dtype=float)
        # a start that is held, the same in each call
        begin = solved(self.mass @ np.cos(np.arange(self.size) ** 2.0))
        most = min(self.size - 2, count)
        try:
            squares, shapes = eigsh(
                self.stiffness, most, M=self.mass, sigma=0.0, OPinv=inverse, v0=begin
            )
        except ArpackError as error:
            raise ParameterError(
                f"the {count} slowest modes were not found ({error}): take fewer", "modes"
            ) from error
        return squares, shapes
