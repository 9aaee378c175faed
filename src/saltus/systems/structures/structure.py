"""A linear structure given by its matrices, with contacts, surfaces and frictions at some of its
points.

With the rows R of what is local (R u is what contacts keep on one side, surfaces pass and frictions
rub), the displacements u are

    u = T_b b + T_z z,    b = R u,    T_b = M^-1 R' (R M^-1 R')^-1,

where the columns of T_z are the modes of the structure whose local displacements b are held. Then
T' M T is block-diagonal: an impact changes no velocity but those of b, and what contacts hold is
held without touching the amplitudes z of the modes,

    z'' = g_z f(t) - w^2 z - D_z z' - K_zb b - D_zb b',    M_b b'' = g_b f(t) - K_b b - D_b b' -
    K_bz z - D_bz z' + reactions.

All numbers of these equations are data of the compiled code, none is part of it; neither is the
number of modes, each of which has a record of its coefficients.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from saltus.checks import LIMITS, answered, check_count, check_number
from saltus.errors import ParameterError, near, shown
from saltus.systems.contracts.contact_model import (
    Contact,
    ContactModel,
    Friction,
    Relay,
    Surface,
)
from saltus.systems.contracts.model import Count, first_of_largest, is_zero
from saltus.systems.files.matrix_files import matrices_in
from saltus.systems.files.record_files import (
    ConstantNumbers,
    check_independent,
    check_matrices,
    check_range_of,
    read_array,
)
from saltus.systems.impact_laws import Coefficients, NamedParts, RowNumbers, Vectors
from saltus.systems.loads.signals import Setting
from saltus.systems.structures.eigenmodes import eigenmodes_of
from saltus.systems.structures.reduction import check_symmetric, shapes_of, sparse_matrix
from saltus.systems.structures.switched import (
    NamedNumbers,
    Shares,
    SwitchedForce,
    Terms,
    check_named,
    displacements_in,
    independent,
    read_functions,
    value_of_product,
)

MODE = "mode_"  # begins the names of the amplitudes
# The names of the arrays in files, and what they are called in papers.
IN_FILES = {
    "mass": ("mass", "M"),
    "stiffness": ("stiffness", "K"),
    "damping": ("damping", "C", "D"),
}


@dataclass(frozen=True, eq=False)
class Modes:
    """A structure in local displacements and amplitudes of modes: the matrices T, T' M T, ...

    of the module's docstring.
    """

    basis: np.ndarray  # T, of which the first columns are T_b
    mass: np.ndarray  # M_b
    stiffness: np.ndarray  # T' K T
    damping: np.ndarray | None  # T' C T; None without damping
    coupled: bool  # whether damping couples the modes
    forces: np.ndarray  # T' g, a column for each channel
    inverse: np.ndarray  # of T: R, and T_z' M

    def coefficients(self, shares: np.ndarray, whole: bool) -> list[float]:
        """The numbers of the local equations, in the order in which `Equations` reads them; of the
        `whole` structure also those of the modes. `shares` has the coefficients of displacements
        that follow from the local ones.
        """
        m = len(self.mass)
        damped = [] if self.damping is None else [self.damping[:m, :m]]
        found = [
            self.mass,
            self.stiffness[:m, :m],
            *damped,
            self.forces[:m],
            shares,
            *([self.records()] if whole else []),
        ]
        return [float(x) for block in found for x in block.ravel()]

    def records(self) -> np.ndarray:
        """The number of modes, a record for each of them in the order of `ModeRecord`, and D by
        rows where it couples them.
        """
        m = len(self.mass)
        damping = self.damping
        found = [np.diag(self.stiffness)[m:, None], self.stiffness[m:, :m], self.forces[m:]]
        if damping is not None:
            found += [np.diag(damping)[m:, None], damping[:m, m:].T, damping[m:, :m]]
        among = damping[m:, m:].ravel() if damping is not None and self.coupled else np.zeros(0)
        return np.concatenate([[len(found[0])], np.hstack(found).ravel(), among])


class ModeRecord:
    """The places in a mode's record, for m local displacements and some channels."""

    def __init__(self, m: int, channels: int, damped: bool) -> None:
        self.square = 0
        self.stiffness = range(1, 1 + m)
        self.forces = range(1 + m, 1 + m + channels)
        at = 1 + m + channels
        self.damping = at if damped else None
        self.local_damping = range(at + 1, at + 1 + m)
        self.by_local = range(at + 1 + m, at + 1 + 2 * m)
        self.size = at + (1 + 2 * m if damped else 0)


# Squares of frequencies that differ by less than this times the rounding of the largest one are
# equal: their modes may be turned freely, and rounding does.
EQUAL = 8.0
# Entries of a mode that differ by less, as a share of the largest, are equally large.
TIED = 1e-6


def canonical(shapes: np.ndarray, squares: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Modes (n, k) of a mass matrix as a basis that depends neither on rounding nor on who computes
    it.

    Modes of equal frequencies are those in which fixed weights of the rows, with the mass matrix,
    are diagonal, by rising value.
    The largest entry of each mode is positive; of several that are equally large, the first.
    """
    weights = fixed_weights(len(shapes))
    weighted = 0.5 * (mass * weights + (mass * weights).T)
    found = shapes.copy()
    rounding = EQUAL * len(shapes) * np.finfo(float).eps * np.abs(squares).max()
    ends = np.flatnonzero(np.diff(squares) > rounding) + 1
    for group in np.split(np.arange(len(squares)), ends):
        if len(group) > 1:
            part = found[:, group]
            _, turned = np.linalg.eigh(part.T @ weighted @ part)
            found[:, group] = part @ turned
    sizes = np.abs(found)
    first = np.argmax(sizes >= (1.0 - TIED) * sizes.max(axis=0), axis=0)
    return np.asarray(found * np.sign(found[first, range(found.shape[1])]))


def fixed_weights(count: int) -> np.ndarray:
    """Numbers between 0 and 1, (count,), without any symmetry: the fractions of n^2 times the golden
    ratio. Those of n times it have some: w_n + w_m depends on n + m alone."""
    return np.asarray((np.arange(1.0, count + 1.0) ** 2 * GOLDEN) % 1.0)


GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def mode_sums(model: Any) -> list[float]:
    """The sums of the displacements of each coordinate of a `Structure` with fixed weights, by which
    a reader of a file notices that its modes are others; none for other models."""
    modes = vars(model).get("_modes") if hasattr(model, "__dict__") else None
    if modes is None:
        return []
    return [float(x) for x in fixed_weights(len(modes.basis)) @ modes.basis]


@lru_cache(maxsize=64)
def modes_of(
    mass: ConstantNumbers,
    stiffness: ConstantNumbers,
    damping: ConstantNumbers | None,
    rows: ConstantNumbers,
    forces: ConstantNumbers,
) -> Modes:
    """The structure in local displacements and modes."""
    from scipy.linalg import eigh, null_space, solve

    m = mass.array
    k = stiffness.array
    r = rows.array
    # a power of 2 for each coordinate, as modes of mass 1 stand beside masses in a user's unit
    even = np.exp2(-np.round(0.5 * np.log2(np.diag(m))))
    inertial = np.zeros((len(m), 0))
    if len(r):
        weighted = even[:, None] * r.T
        inertial = even[:, None] * solve(even[:, None] * m * even, weighted, assume_a="pos")
    local = np.linalg.inv(r @ inertial) if len(r) else np.zeros((0, 0))
    free = null_space(r) if len(r) else np.eye(len(m))
    shapes = np.zeros((len(m), 0))
    if free.shape[1]:
        squares, found = eigh(free.T @ k @ free, free.T @ m @ free)
        shapes = canonical(free @ found, squares, m)
    basis = np.hstack([inertial @ local, shapes])
    count = len(r)
    rounding = 64.0 * len(m) * np.finfo(float).eps
    local = 0.5 * (local + local.T)
    local[np.abs(local) <= rounding * np.abs(local).max(initial=0.0)] = 0.0
    damped = None if damping is None else basis.T @ damping.array @ basis
    among = np.zeros((0, 0)) if damped is None else damped[count:, count:]
    coupled = np.abs(among - np.diag(np.diag(among))).max(initial=0.0) > rounding * np.abs(
        among
    ).max(initial=0.0)
    inverse = np.vstack([r, shapes.T @ m])  # as T' M T is block-diagonal
    return Modes(
        basis, local, basis.T @ k @ basis, damped, bool(coupled), basis.T @ forces.array, inverse
    )


class Equations:
    """The numbers of a structure's equations, or their symbols, by their places."""

    def __init__(self, structure: Structure) -> None:
        local, self.damped, self.coupled, _, shares = structure.form
        self._numbers = structure.coefficients
        self._at = 0
        self.local = len(local)
        self.size = len(structure.names)
        m = self.local
        modes = len(structure.names) - len(local)
        channels = len(structure.forces)
        self.mass = self._block(m, m)
        self.stiffness = self._block(m, m)
        self.damping = self._block(m, m) if self.damped else []
        self.forces = self._block(m, channels)
        self.shares = {
            name: (known, factors)
            for (name, known), factors in zip(shares, self._block(len(shares), m), strict=True)
        }
        self.record = ModeRecord(m, channels, self.damped)
        if not structure.is_written_out:
            self._numbers = structure.records.array
            self._at = 0
        self._at += 1
        self.records = self._block(modes, self.record.size)
        self.among = self._block(modes, modes) if self.coupled else []

    def _block(self, rows: int, columns: int) -> list[Any]:
        start, self._at = self._at, self._at + rows * columns
        return [self._numbers[start + i * columns : start + (i + 1) * columns] for i in range(rows)]


@dataclass(frozen=True, kw_only=True)
class Structure(ContactModel):
    """A linear structure of up to 200 coordinates u, with contacts, surfaces and frictions at some
    of its points, and forces that switch:

        M u'' + C u' + K u = sum over channels of g f(t) + the forces of surfaces + reactions +
        frictions + switched forces.

    Its coordinates are the displacements of contacts, surfaces and frictions, under their names.
    Those of switched forces and of functions are next, if they do not follow from these. Behind
    them are the amplitudes `mode_1`, `mode_2`, ... of its modes. The modes have mass 1, are
    those while these displacements are held, and the slowest is the first. `start` makes a state of
    displacements u, and `displacements` gives u.

    Parameters
    ----------
    mass, stiffness, damping
        M, K and C, (n, n); or M and K alone. Arrays, rows of numbers, or sparse matrices of SciPy.
    file
        Instead of them, the path of a `.npz` or `.mat` file in which they are called mass,
        stiffness and damping, or M, K and C.
    contacts, surfaces, friction
        `Contact`, `Surface` and `Friction`, whose `coordinate` is a row of the matrices, its number
        from 0 or its name, a point, or coefficients as a point has them. On the side +1 of a
        surface its `stiffness` and its `damping` act. The normal force of a friction is 1, so that
        its coefficients are forces. A surface may be one of the `functions`, and a `Relay` among
        the surfaces goes on and off where two of them rise through 0.
    functions
        By their names, what surfaces, relays and switched forces name: a sum of displacements,
        their rates, channels of the load and a constant, {"tip": 1.0, "tip_velocity": 0.2,
        "constant": -0.1}; or a list of such sums, whose product it is.
    switched
        `SwitchedForce`, each on a displacement and switched by the side of a surface or a relay.
    forces
        The vector g of each channel of the load by its name, as points are given.
    points
        Sums of displacements by their names: the coefficients of all rows, (n,), or of some, {0:
        1.0, "x5": -1.0}; or one row.
    names
        The names of the rows, by default x0, x1, ...
    basis
        The displacements of a larger model for each row, (rows of the larger model, n), which
        `displacements` and `start` then take and give; `reduced` finds it.
    coefficients, records, form
        Computed from the others and not to be given: the numbers of the equations, and which there
        are.

    Raises
    ------
    ParameterError
        Matrices that are not square, of different sizes, or not finite; a mass that is not
        symmetric and positive definite; a stiffness that is not symmetric; an unknown coordinate;
        local displacements that are not independent; a part that names a function or a surface that
        is not given, a function that no part names, or a surface with an `after_event`.

    Examples
    --------
    >>> pair = saltus.Structure(
    ...     mass=[[1.0, 0.0], [0.0, 2.0]], stiffness=[[2.0, -1.0], [-1.0, 1.0]],
    ...     contacts=[saltus.Contact(name="wall", coordinate=1, position=0.5, sign=-1)], forces={"drive": 0},
    ... )
    >>> pair.coordinates
    ('x1', 'mode_1')
    >>> moved = saltus.System(model=pair, impact=saltus.NewtonImpact(e=0.8))
    >>> motion = saltus.simulate(moved, **pair.start([0.0, 0.4]), duration=2.0)
    >>> positions, velocities = motion.at([0.5, 1.0])
    >>> pair.displacements(positions).shape
    (2, 2)
    """

    mass: Any = None
    stiffness: Any = None
    damping: Any = None
    file: str = ""
    contacts: Any = ()
    surfaces: Any = ()
    friction: Any = ()
    forces: Any = None
    points: Any = None
    names: tuple[str, ...] = ()
    basis: Any = None
    functions: Any = None
    switched: Any = ()
    # What follows from the others: numbers of the local equations; those of the modes, which
    # without local displacements are among the first; and which blocks of numbers there are, with
    # the names of the local displacements.
    coefficients: Any = dataclasses.field(default=None, repr=False)
    records: Any = dataclasses.field(default=None, repr=False)
    form: Any = dataclasses.field(default=None, repr=False)

    eigenmodes = eigenmodes_of  # the table that the kernel reads

    def __post_init__(self) -> None:
        given = (
            matrices_in(self.file, IN_FILES)
            if self.file
            else {name: getattr(self, name) for name in IN_FILES}
        )
        mass, stiffness, damping = (_matrix(given.get(name), name) for name in IN_FILES)
        check_matrices(
            {
                name: m.array
                for name, m in zip(IN_FILES, (mass, stiffness, damping), strict=True)
                if m is not None
            }
        )
        names = _names_of(self.names, len(mass.array))
        points = _vectors(self.points, "points", names)
        forces = _vectors(self.forces, "forces", names)
        given_parts = (self.contacts, self.surfaces, self.friction, self.switched)
        parts = _parts(*given_parts, names, points)
        functions = read_functions(self.functions, Terms(names, points, forces), Structure)
        check_named(parts["surfaces"], parts["switched"], functions)
        local, shares, rows = _local_displacements(parts, functions, names, points, forces)
        basis = _basis(self.basis, len(names))
        columns = np.array([*forces.values()]).reshape(len(forces), len(names)).T
        modes = modes_of(
            mass,
            stiffness,
            damping,
            ConstantNumbers(rows, "points"),
            ConstantNumbers(columns, "forces"),
        )
        pattern = tuple(tuple(bool(x) for x in row) for row in modes.mass)
        made = {
            "mass": mass,
            "stiffness": stiffness,
            "damping": damping,
            "file": "",
            "names": names,
            "basis": basis,
            "functions": functions,
            **parts,
        }
        made |= {
            "forces": Vectors(forces),
            "points": Vectors(points),
        }
        made |= {"records": ConstantNumbers(modes.records(), "records")}
        sharing = {
            name: tuple(bool(x) for x in row)
            for name, row in zip(shares.names, shares.rows, strict=True)
        }
        made |= {
            "form": (
                tuple(local),
                modes.damping is not None,
                modes.coupled,
                pattern,
                tuple(sharing.items()),
            )
        }
        vars(self).update(made, _modes=modes)
        numbers = Coefficients(modes.coefficients(shares.rows, self.is_written_out))
        vars(self)["coefficients"] = numbers

    @classmethod
    @answered
    def reduced(
        cls,
        mass: Any,
        stiffness: Any,
        damping: Any = None,
        *,
        modes: int,
        keep: Sequence[Any] = (),
        contacts: Any = (),
        surfaces: Any = (),
        friction: Any = (),
        forces: Any = None,
        points: Any = None,
        names: Sequence[str] = (),
        functions: Any = None,
        switched: Any = (),
    ) -> Structure:
        """A structure of thousands of rows in few coordinates, by the method of Craig and Bampton:
        the displacements of its contacts, surfaces and frictions and those that are kept, and its
        slowest modes while these are held.

        Static deflections under forces on the kept displacements are exact. Rows without mass, as
        rotations of lumped masses, follow statically. Take the double number of modes to see what
        the others change.

        Parameters
        ----------
        mass, stiffness, damping
            M, K and C, (rows, rows): arrays, sparse matrices of SciPy, or the paths of files of
            Matrix Market (`.mtx`) or of `scipy.sparse.save_npz` (`.npz`). One triangle of the mass
            and of the stiffness is enough.
        modes
            How many modes.
        keep
            Further rows or points that become coordinates of their own, as where loads act.
        contacts, surfaces, friction, forces, points, names, functions, switched
            As `Structure` takes them, for the rows of these matrices.

        Returns
        -------
        Structure
            Its rows are the kept displacements, under their names, and `amplitude_1`, ... of the
            modes. Its `displacements` are those of all rows of the matrices.

        Raises
        ------
        ParameterError
            Matrices that are not square, of different sizes, complex or not finite; mass or
            stiffness that is not symmetric; too many modes; nothing that is kept; or what
            `Structure` refuses.

        References
        ----------
        R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal
        6(7), 1968.

        Examples
        --------
        >>> import scipy.sparse as sp
        >>> n = 1000  # elements of a bar of length 1, density 1 and wave speed 1
        >>> ones = np.ones(n)
        >>> stiffness = n * sp.diags_array([2.0 * ones, -ones[1:], -ones[1:]], offsets=[0, 1, -1])
        >>> mass = sp.diags_array(ones / n)
        >>> wall = saltus.Contact(name="wall", coordinate=n - 1, position=0.1, sign=-1)
        >>> bar = saltus.Structure.reduced(mass, stiffness, modes=8, contacts=[wall])
        >>> len(bar.coordinates), len(bar.displacements([0.0] * 9))
        (9, 1000)
        """
        check_count("modes", modes, 0, LIMITS.coordinates)
        given = {"mass": mass, "stiffness": stiffness, "damping": damping}
        matrices = {
            name: sparse_matrix(matrix, name)
            for name, matrix in given.items()
            if matrix is not None or name != "damping"
        }
        size = matrices["mass"].shape[0]
        for name, matrix in matrices.items():
            if matrix.shape[0] != size:
                raise ParameterError(
                    f"{name} must be {size} x {size} as the mass is, got "
                    f"{matrix.shape[0]} x {matrix.shape[0]}",
                    name,
                )
            check_range_of(abs(matrix).max(), name)
            if name != "damping":
                check_symmetric(matrix, name)
        all_names = _names_of(names, size)
        all_points = _vectors(points, "points", all_names)
        all_forces = _vectors(forces, "forces", all_names)
        parts: dict[str, Any] = dict(
            _parts(contacts, surfaces, friction, switched, all_names, all_points)
        )
        read = read_functions(functions, Terms(all_names, all_points, all_forces), cls)
        check_named(parts["surfaces"], parts["switched"], read)
        local, shares, _ = _local_displacements(parts, read, all_names, all_points, all_forces)
        kept = dict.fromkeys(local)
        for name in shares.names:  # they follow from what is kept
            all_points.setdefault(name, _vector(name, all_names, name))
        for row in _each(keep, "keep"):
            known = isinstance(row, str) and row in all_points
            kept[row if known else all_names[_place(row, all_names, "keep")]] = None
        if not kept:
            raise ParameterError(
                "nothing is kept: give contacts, surfaces or frictions, or keep=[...] with rows or "
                "points",
                "keep",
            )
        rows = np.array([all_points.get(name) or _vector(name, all_names, name) for name in kept])
        check_independent(rows, tuple(kept))
        shapes = shapes_of(matrices["mass"], matrices["stiffness"], rows, int(modes))
        basis = np.hstack([shapes.static, shapes.modes])
        small = {name: basis.T @ (matrix @ basis) for name, matrix in matrices.items()}
        for name in ("mass", "stiffness"):
            small[name] = 0.5 * (small[name] + small[name].T)
        return cls(
            **small,
            **parts,
            functions=read,
            names=(*kept, *(f"amplitude_{i + 1}" for i in range(int(modes)))),
            forces={name: np.array(row) @ basis for name, row in all_forces.items()},
            points={
                name: np.array(row) @ basis for name, row in all_points.items() if name not in kept
            },
            basis=basis,
        )

    @property
    def coordinates(self) -> tuple[str, ...]:  # type: ignore[override]
        """The local displacements, then the amplitudes of the modes."""
        local = self.form[0]
        return (*local, *(f"{MODE}{i + 1}" for i in range(len(self.names) - len(local))))

    def shown_coordinate(self, load: Any) -> str | None:
        """The displacement that the load drives most directly, of contacts, surfaces, frictions and
        points. If none of them is as direct, it is the row of the matrices on which alone the load
        acts. Where the load drives none of them, it is the row that it drives most directly.

        Parameters
        ----------
        load
            The load of the system.
        """
        known = list(dict.fromkeys([*self.form[0], *self.points]))
        given = {name: load.channels[name] for name in self.forces if name in load.channels}
        moving = [name for name, signal in given.items() if signal.periodic or signal.once]
        driving = [np.array(self.forces[name]) for name in moving or given]
        shares = self._shares(known, driving)
        alone = {
            self.names[i]
            for row in driving
            for i in np.flatnonzero(row)
            if np.count_nonzero(row) == 1
        }
        if alone and shares.max(initial=0.0) < 1.0:
            return min(alone)
        if shares.any():
            return first_of_largest(known, shares)
        shares = self._shares(self.names, driving)
        return first_of_largest(self.names, shares) if shares.any() else min(known or self.names)

    def _shares(self, names: Sequence[str], driving: Sequence[np.ndarray]) -> np.ndarray:
        """How directly any of some forces drives each displacement, (names,): the cosine of their
        rows in the inverse of the mass, which does not depend on units."""
        if not len(names):
            return np.zeros(0)
        rows = np.array([self._row_of(name) for name in names])
        mass = np.asarray(self.mass.array)
        moved = np.linalg.solve(mass, rows.T)
        sizes = np.sqrt(np.einsum("ij,ji->i", rows, moved))
        shares = np.zeros(len(names))
        for force in driving:
            size = math.sqrt(float(force @ np.linalg.solve(mass, force)))
            found = np.abs(force @ moved)
            shares = np.maximum(
                shares,
                np.divide(found, sizes * size, out=np.zeros_like(found), where=sizes * size > 0),
            )
        # a cosine, of which the last digits are rounding
        return np.asarray(np.round(shares, 9))

    @property
    def point_names(self) -> tuple[str, ...]:
        """Its points that are no coordinates."""
        return tuple(name for name in self.points if name not in self.coordinates)

    def _row_of(self, name: str) -> np.ndarray:
        """The coefficients of all rows of a local displacement, a point or a row."""
        return np.array(self.points.get(name) or _vector(name, self.names, name))

    def weights_of(self, displacement: str) -> np.ndarray | None:
        """The weight of each coordinate in the displacement of a coordinate, a point, or a row of
        the matrices, (n,); None if none is called so.

        Parameters
        ----------
        displacement
            Its name.
        """
        found = super().weights_of(displacement)
        if found is None and displacement in (*self.points, *self.names):
            return np.asarray(self._row_of(displacement) @ vars(self)["_modes"].basis)
        return found

    def __getattr__(self, name: str) -> Any:
        """A function, in the place of a method of a class."""
        functions = vars(self).get("functions")
        if isinstance(functions, NamedNumbers) and name in functions.names:
            return partial(self._value_of, name)
        raise AttributeError(
            f"{type(self).__name__} has no attribute {name!r}", name=name, obj=self
        )

    def _value_of(self, name: str, t: Any, q: Any, velocity: Any, load: Any) -> Any:
        """The value of one of its functions."""
        own = Equations(self)
        local = {
            "displacement": list(q) if own.size > 1 else [q],
            "rate": list(velocity) if own.size > 1 else [velocity],
        }

        def value_of_term(term: str) -> Any:
            kind, of = meaning.meaning(term, name)
            if kind in local:
                return _sum_of_shares(self._shares_of(of, own), local[kind])
            return getattr(load, of)(t) if kind == "channel" else 1.0

        meaning = Terms(self.names, self.points, self.forces)
        return value_of_product(self.functions.named[name], value_of_term)

    def _shares_of(self, displacement: str, own: Equations) -> list[tuple[int, Any]]:
        """The places of the local displacements from which one follows, and its coefficients; of a
        local one itself."""
        if displacement in self.form[0]:
            return [(self.form[0].index(displacement), 1.0)]
        known, factors = own.shares[displacement]
        return [(i, x) for i, (x, there) in enumerate(zip(factors, known, strict=True)) if there]

    @property
    def channels(self) -> tuple[str, ...]:  # type: ignore[override]
        """The channels of the load."""
        return tuple(self.forces)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """Its frictions."""
        return tuple(self.friction)

    def to_table(self) -> dict[str, Any]:
        """Plain tables and texts, of which `Structure(**table)` makes it again."""
        table: dict[str, Any] = {
            name: m.packed()
            for name in (*IN_FILES, "basis")
            if (m := getattr(self, name)) is not None
        }
        for field in ("contacts", "surfaces", "friction", "switched"):
            if parts := getattr(self, field):
                table[field] = [_table_of(part) for part in parts]
        for field in ("forces", "points"):
            if rows := getattr(self, field):
                table[field] = {name: list(row) for name, row in rows.items()}
        if self.functions:
            table["functions"] = {
                name: each.named
                if isinstance(each, NamedNumbers)
                else [part.named for part in each]
                for name, each in self.functions.named.items()
            }
        return table | (
            {"names": list(self.names)} if self.names != _names_of((), len(self.names)) else {}
        )

    @property
    def local_count(self) -> int:
        """The number of coordinates whose equations are traced one by one, while those of the modes
        are loops.
        """
        return len(self.names) if self.is_written_out else len(self.form[0])

    @property
    def is_written_out(self) -> bool:
        """Whether the equations of the modes are traced one by one too: without local displacements,
        and with functions along which motions may slide. Then the accelerations depend on sums over
        modes in another way than linearly, which the loops do not follow.
        """
        sliding = (part.function is not None and not part.remembered for part in self.surfaces)
        return not self.form[0] or any(sliding)

    def mass_matrix(self, theta: Any) -> Any:
        """M_b, and 1 for each mode; M_b alone for the local coordinates of a trace."""
        own = Equations(self)
        if isinstance(theta, tuple) and hasattr(theta, "sum_over_modes"):
            known = self.form[3]
            return [
                [x if there else 0.0 for x, there in zip(*each, strict=True)]
                for each in zip(own.mass, known, strict=True)
            ]
        rows = [[float(i == j) for j in range(own.size)] for i in range(own.size)]
        for row, masses, known in zip(rows, own.mass, self.form[3], strict=False):
            row[: own.local] = [x if there else 0.0 for x, there in zip(masses, known, strict=True)]
        return rows[0][0] if own.size == 1 else rows

    def force(self, t: Any, theta: Any, velocity: Any, load: Any, *sides: Any) -> Any:
        """The forces on the local displacements and on the modes, without reactions and
        frictions.
        """
        own = Equations(self)
        q, v = (list(x) if own.size > 1 else [x] for x in (theta, velocity))
        m = own.local
        places = own.record
        records = own.records
        pushes = [getattr(load, name)(t) for name in self.forces]
        found = [_sum(own.forces[i], pushes) for i in range(m)]
        for i in range(m):
            found[i] = found[i] - _sum(own.stiffness[i], q[:m])
            if own.damped:
                found[i] = found[i] - _sum(own.damping[i], v[:m])
            if len(q) < own.size:
                rates = places.local_damping[i] if own.damped else None
                found[i] = found[i] - theta.sum_over_modes(places.size, places.stiffness[i], rates)
            else:
                found[i] = found[i] - _sum(
                    [record[places.stiffness[i]] for record in records], q[m:]
                )
                if own.damped:
                    found[i] = found[i] - _sum(
                        [record[places.local_damping[i]] for record in records], v[m:]
                    )
        for i, record in enumerate(records if len(q) == own.size else []):
            pushed = _sum([record[k] for k in places.forces], pushes)
            found.append(
                pushed
                - record[places.square] * q[m + i]
                - _sum([record[k] for k in places.stiffness], q[:m])
            )
            if own.damped:
                slowed = (
                    _sum(own.among[i], v[m:]) if own.coupled else record[places.damping] * v[m + i]
                )
                found[-1] = found[-1] - slowed - _sum([record[k] for k in places.by_local], v[:m])
        for surface in self.surfaces:
            if surface.coordinate is None:
                continue
            i = self.form[0].index(surface.coordinate)
            side = sides[0][surface.name]
            pressed = surface.stiffness * (q[i] - surface.position) + surface.damping * v[i]
            found[i] = found[i] - 0.5 * (1.0 + side) * pressed
        for each in self.switched:
            push = each.factor(sides[0][each.surface])
            if each.function is not None:
                push = push * self._value_of(each.function, t, theta, velocity, load)
            for i, share in self._shares_of(each.coordinate, own):
                found[i] = found[i] + (push if _is_whole(share) else share * push)
        return found[0] if own.size == 1 else tuple(found)

    def mode_equations(
        self, t: Any, theta: Any, velocity: Any, load: Any
    ) -> tuple[ModeRecord, bool, list[Any]]:
        """The places in a mode's record, whether D couples modes, and their inputs, each with its
        coefficient's place and a sign.

        Parameters
        ----------
        t, theta, velocity, load
            The time, the local displacements, their rates, and the load, as `force` takes them.
        """
        own = Equations(self)
        places = own.record
        found = [(x, k, -1.0) for x, k in zip(theta, own.record.stiffness, strict=True)]
        if own.damped:
            found += [(x, k, -1.0) for x, k in zip(velocity, places.by_local, strict=True)]
        found += [
            (getattr(load, name)(t), k, 1.0)
            for name, k in zip(self.forces, places.forces, strict=True)
        ]
        return places, own.coupled, found

    def kinetic_energy(self, t: Any, theta: Any, velocity: Any, side: Any, load: Any) -> Any:
        """u' M u' / 2 of the velocities u."""
        own = Equations(self)
        v = list(velocity) if own.size > 1 else [velocity]
        local = sum(v[i] * _sum(own.mass[i], v[: own.local]) for i in range(own.local))
        return 0.5 * (local + sum(x * x for x in v[own.local :]))

    def displacements(self, of: Any) -> np.ndarray:
        """The displacements u, (n,) or (n, times), of coordinates of this model; velocities u' of
        their rates. Those of all rows of the larger model, if it is `reduced`.

        Parameters
        ----------
        of
            Coordinates or their rates, as `Motion.at` gives them, (n,) or (n, times); of one
            coordinate also a number, as `Motion.position` is then.
        """
        given = np.asarray(of, dtype=float)
        if given.ndim == 0 and len(self.names) == 1:
            given = given[np.newaxis]
        if given.shape[:1] != (len(self.names),):
            raise ParameterError(
                f"displacements takes {len(self.names)} coordinates along the first axis, got "
                f"{shown(of)}",
                "of",
            )
        found = np.asarray(vars(self)["_modes"].basis @ given)
        return found if self.basis is None else np.asarray(self.basis.array @ found)

    def start(self, displacement: Any = 0.0, velocity: Any = 0.0) -> dict[str, Any]:
        """The state with these displacements u and velocities u', by the names of the arguments of
        `simulate`.

        Parameters
        ----------
        displacement, velocity
            Numbers for all rows of the matrices, (n,), or one for all of them; by default 0. Of a
            `reduced` structure those of the larger model, of which the nearest shape is taken.
        """
        if self.basis is not None:
            displacement = _nearest(self.basis.array, displacement, "displacement")
            velocity = _nearest(self.basis.array, velocity, "velocity")
        found = []
        for name, given in (("displacement", displacement), ("velocity", velocity)):
            vector = _vector(
                np.full(len(self.names), given) if np.ndim(given) == 0 else given, self.names, name
            )
            found.append([float(x) for x in vars(self)["_modes"].inverse @ vector])
        local = [
            (i, self.names.index(name)) for i, name in enumerate(self.form[0]) if name in self.names
        ]
        for values, given in zip(found, (displacement, velocity), strict=True):
            for i, row in local:  # exactly as given, so that what is at a contact is there
                values[i] = float(given if np.ndim(given) == 0 else given[row])
        return {
            **dict(zip(self.coordinates, found[0], strict=True)),
            "velocity": found[1] if len(found[1]) > 1 else found[1][0],
        }


def _sum(factors: Sequence[Any], values: Sequence[Any]) -> Any:
    """The sum of products."""
    total: Any = 0.0
    for factor, value in zip(factors, values, strict=True):
        if not is_zero(value):
            total = factor * value if is_zero(total) else total + factor * value
    return total


def _sum_of_shares(shares: Sequence[tuple[int, Any]], values: Sequence[Any]) -> Any:
    """A displacement, or its rate, by the local ones."""
    found = [values[i] if _is_whole(share) else share * values[i] for i, share in shares]
    return sum(found[1:], found[0])


def _is_whole(share: Any) -> bool:
    """Whether a coefficient is that of a local displacement itself."""
    return isinstance(share, float) and share == 1.0


# --- what is given -----------------------------------------------------------


def _matrix(given: Any, name: str) -> Any:
    """A matrix that was given, or None for a damping that was not."""
    if given is None and name != "damping":
        raise ParameterError(
            f"{name} is missing: a structure needs its mass and its stiffness, or a file with both",
            name,
        )
    return (
        given
        if given is None or isinstance(given, ConstantNumbers)
        else ConstantNumbers(given, name)
    )


def _vectors(given: Any, field: str, names: tuple[str, ...]) -> dict[str, RowNumbers]:
    """The coefficients of all rows of each force or point, by its name."""
    if given is not None and not isinstance(given, Mapping):
        raise ParameterError(
            f"{field} must be a dict of vectors by name, got {shown(given)}", field
        )
    return {name: _vector(row, names, f"{field}.{name}") for name, row in dict(given or {}).items()}


def _parts(
    contacts: Any,
    surfaces: Any,
    friction: Any,
    switched: Any,
    names: tuple[str, ...],
    points: dict[str, RowNumbers],
) -> dict[str, NamedParts]:
    """The parts of each kind on rows or points; sums of rows are added to the points."""
    return {
        field: NamedParts(_part(part, kind, field, names, points) for part in _each(given, field))
        for field, kind, given in (
            ("contacts", Contact, contacts),
            ("surfaces", Surface, surfaces),
            ("friction", Friction, friction),
            ("switched", SwitchedForce, switched),
        )
    }


def _local_displacements(
    parts: Mapping[str, Any],
    functions: NamedNumbers,
    names: tuple[str, ...],
    points: Mapping[str, RowNumbers],
    forces: Mapping[str, RowNumbers],
) -> tuple[list[str], Shares, np.ndarray]:
    """The displacements that become coordinates: those of contacts, surfaces and frictions, and of
    those of switched forces and functions what does not follow from others; with what follows, and
    the coefficients of the local ones.
    """

    def row_of(name: str) -> np.ndarray:
        return np.array(points.get(name) or _vector(name, names, name))

    held = dict.fromkeys(
        part.coordinate
        for field in ("contacts", "surfaces", "friction")
        for part in parts[field]
        if part.coordinate is not None
    )
    rows = {name: row_of(name) for name in held}
    check_independent(np.array([*rows.values()]).reshape(len(held), len(names)), tuple(held))
    rows |= {part.coordinate: row_of(part.coordinate) for part in parts["switched"]}
    terms = Terms(names, points, forces)
    rows |= {name: row_of(name) for name in displacements_in(functions, terms)}
    local, shares = independent(rows, tuple(held))
    own = np.array([rows[name] for name in local]).reshape(len(local), len(names))
    return local, shares, own


def _basis(given: Any, size: int) -> ConstantNumbers | None:
    """The displacements of a larger model for each row."""
    if given is None or isinstance(given, ConstantNumbers):
        return given
    found = ConstantNumbers(given, "basis")
    if found.array.ndim != 2 or found.array.shape[1] != size:
        raise ParameterError(
            f"basis must have {size} columns, one for each row of the mass, got {shown(given)}",
            "basis",
        )
    return found


def _nearest(basis: np.ndarray, given: Any, name: str) -> np.ndarray:
    """The numbers of the rows whose shape is nearest to displacements of the larger model, (rows,),
    or to one number for all of them."""
    wanted = read_array(np.full(len(basis), given) if np.ndim(given) == 0 else given, name)
    if wanted.shape != (len(basis),):
        raise ParameterError(
            f"{name} must have {len(basis)} numbers, one for each row of the larger model, or be "
            f"one number, got {shown(given)}",
            name,
        )
    return np.asarray(np.linalg.lstsq(basis, wanted, rcond=None)[0])


def _names_of(given: Any, size: int) -> tuple[str, ...]:
    """The names of the rows."""
    if isinstance(given, str) or not np.iterable(given):
        raise ParameterError(f"names must be a list of names, got {shown(given)}", "names")
    names = tuple(given) or tuple(f"x{i}" for i in range(size))
    for name in names:
        _check_name(name, "names")
    if len(names) != size or len(set(names)) < size:
        raise ParameterError(
            f"names must be {size} different names, one for each row of the mass, got "
            f"{shown(given)}",
            "names",
        )
    return names


def _check_name(name: Any, where: str) -> None:
    """Refuse a name that no coordinate can have."""
    if not (
        isinstance(name, str)
        and name.isidentifier()
        and name != "velocity"
        and not name.startswith(MODE)
    ):
        raise ParameterError(
            f"{where}: {shown(name)} is not a name for a coordinate: use names such as x1 or tip, "
            f"not "
            f"{MODE}1",
            where,
        )


def _vector(given: Any, names: tuple[str, ...], where: str) -> Any:
    """The coefficients of all rows, from themselves, from a row's name or number, or from a
    dictionary of some rows.
    """
    if isinstance(given, RowNumbers):
        return given
    if isinstance(given, (str, int, np.integer)) and not isinstance(given, bool):
        given = {given: 1.0}
    if isinstance(given, Mapping):
        row = [0.0] * len(names)
        for key, factor in given.items():
            row[_place(key, names, where)] = factor
        given = row
    values = read_array(given, where)
    if values.shape != (len(names),):
        raise ParameterError(
            f"{where} must have {len(names)} numbers, one for each row of the mass, got "
            f"{shown(given)}",
            where,
        )
    return RowNumbers(values.tolist())


def _place(key: Any, names: tuple[str, ...], where: str) -> int:
    """The number of a row that is given by its number or its name."""
    if isinstance(key, (int, np.integer)) and not isinstance(key, bool):
        if -len(names) <= key < len(names):
            return int(key) % len(names)
        raise ParameterError(
            f"{where}: there is no row {key}; the rows are 0 to {len(names) - 1}", where
        )
    if key not in names:
        raise ParameterError(
            f"{where}: no row is called {shown(key)}; {near(str(key), names)}", where
        )
    return names.index(key)


def _each(given: Any, field: str) -> Sequence[Any]:
    """The parts that were given, one or several."""
    if isinstance(given, (tuple, list)):
        return given
    raise ParameterError(f"{field} must be a list, got {shown(given)}", field)


def _part(
    part: Any, kind: Any, field: str, names: tuple[str, ...], points: dict[str, RowNumbers]
) -> Any:
    """A contact, surface or friction whose coordinate is the name of a row or of a point; a sum
    becomes a point with its name.
    """
    if kind is Surface and (
        isinstance(part, Relay) or (isinstance(part, Mapping) and "on" in part)
    ):
        kind = Relay
    if isinstance(part, Mapping):
        known = [each.name for each in fields(kind)]
        if unknown := [name for name in part if name not in known]:
            raise ParameterError(
                f"{field}: {kind.__name__} has no {shown(unknown[0])}; "
                f"{near(str(unknown[0]), known)}",
                field,
            )
        needed = [each.name for each in fields(kind) if each.default is MISSING]
        if "function" not in part and kind in (Surface, Contact, Friction):
            needed.append("coordinate")
        if not {*needed} <= part.keys():
            raise ParameterError(
                f"{field}: a {kind.__name__} needs a {' and a '.join(needed)}, got {shown(part)}",
                field,
            )
        part = kind(**part)
    if not isinstance(part, kind):
        raise ParameterError(f"{field} must be of class {kind.__name__}, got {shown(part)}", field)
    where = f"{field}.{part.name}"
    on = part.coordinate
    _check_name(part.name, where)
    if getattr(part, "after_event", None) is not None:
        raise ParameterError(
            f"{where}: a Structure does not follow an after_event; take a ContactModel with the same"
            " matrices in its force",
            where,
        )
    if isinstance(part, Relay):
        return part
    if isinstance(part, Surface) and on is None:
        return _surface_of_function(part)
    if on is None:
        raise ParameterError(
            f"{where}: a Structure has no distances and no rates, so the part needs a coordinate",
            where,
        )
    if isinstance(on, str) and (on in points or on in names):
        coordinate = on
    elif isinstance(on, (str, int, np.integer)):
        coordinate = names[_place(on, (*names, *points) if isinstance(on, str) else names, where)]
    else:
        if part.name in names or part.name in points:
            raise ParameterError(
                f"{where}: a row or a point is called {part.name} already; give the sum as a point",
                where,
            )
        points[part.name] = _vector(on, names, where)
        coordinate = part.name
    for each in fields(part):
        value = getattr(part, each.name)
        if each.name not in (*NO_NUMBERS, *TEXTS.get(kind, ())) and value is not None:
            check_number(f"{where}.{each.name}", value)
    made: Any = replace(part, coordinate=coordinate)
    if hasattr(made, "sign"):
        object.__setattr__(made, "sign", Count(int(made.sign)))
    return made


NO_NUMBERS = ("name", "coordinate", "sign", "group")
TEXTS: dict[Any, tuple[str, ...]] = {SwitchedForce: ("surface", "function")}


def _surface_of_function(part: Surface) -> Surface:
    """A surface of a function, whose fields that only a coordinate has are no numbers of the
    structure."""
    made = replace(part)
    object.__setattr__(made, "sign", Count(1))
    for name in ("position", "stiffness", "damping"):
        object.__setattr__(made, name, Setting(0.0))
    return made


def _table_of(part: Any) -> dict[str, Any]:
    """The fields of a contact, surface or friction that are not as they are by default."""
    table = {
        each.name: getattr(part, each.name)
        for each in fields(part)
        if getattr(part, each.name) != each.default
    }
    has_sign = part.coordinate is not None and hasattr(part, "sign")
    return table | ({"sign": int(part.sign)} if has_sign else {})
