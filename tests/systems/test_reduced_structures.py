"""`Structure.reduced`: large structures in few coordinates."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from scipy.linalg import eigh

import saltus
from saltus.systems import natural_units


def bar(rows: int, held: bool = True) -> tuple[sp.csc_array, sp.csc_array]:
    """Mass and stiffness of a bar of length, density and wave speed 1, held at its left end."""
    ones = np.ones(rows)
    diagonal = 2.0 * ones
    diagonal[-1] = 1.0
    masses = ones / rows
    masses[-1] *= 0.5
    if not held:
        diagonal[0] = 1.0
        masses[0] *= 0.5
    stiffness = rows * sp.diags_array([diagonal, -ones[1:], -ones[1:]], offsets=[0, 1, -1])
    return sp.csc_array(sp.diags_array(masses)), sp.csc_array(stiffness)


def frequencies(structure: saltus.Structure) -> np.ndarray:
    squares = eigh(structure.stiffness.array, structure.mass.array, eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0))


def wall(row: int, position: float = 0.1) -> saltus.Contact:
    return saltus.Contact(name="wall", coordinate=row, position=position, sign=-1)


def settled(structure: saltus.Structure, force: float) -> np.ndarray:
    """The displacements of all rows under a constant force."""
    pushed = np.linalg.solve(structure.stiffness.array, force * np.array(structure.forces["push"]))
    return structure.basis.array @ pushed


@pytest.mark.parametrize("rows", [400, 3000])
def test_a_bar_has_the_natural_frequencies_of_its_closed_form(rows: int) -> None:
    """(2 k - 1) pi / 2 of a bar, here of its masses and springs. The k-th mode left out adds 1 /
    k^4, so that twice as many modes leave an eighth of the error. Small matrices are dense."""
    mass, stiffness = bar(rows)
    discrete = 2.0 * rows * np.sin((2.0 * np.arange(1, 4) - 1.0) * np.pi / (4.0 * rows))
    errors = []
    for modes in (12, 24):
        reduced = saltus.Structure.reduced(mass, stiffness, modes=modes, contacts=[wall(rows - 1)])
        assert len(reduced.coordinates) == modes + 1
        errors.append(frequencies(reduced)[:3] / discrete - 1.0)
    assert (np.array(errors) > 0.0).all()  # a reduced structure is stiffer
    assert errors[0].max() < 3e-4
    assert errors[0] / errors[1] == pytest.approx(np.full(3, (24.5 / 12.5) ** 3), rel=0.1)


def test_with_all_modes_motions_are_those_of_the_whole_structure() -> None:
    mass, stiffness = bar(12)
    damping = 0.01 * stiffness
    parts = {"contacts": [wall(11, 0.05)], "forces": {"push": 5}}
    load = saltus.Load(frequency=1.4, push=saltus.Harmonic(0.1))
    ends = []
    for model in (
        saltus.Structure(
            mass=mass.toarray(), stiffness=stiffness.toarray(), damping=damping.toarray(), **parts
        ),
        saltus.Structure.reduced(mass, stiffness, damping, modes=11, **parts),
    ):
        system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(0.6))
        begin = model.start(0.01 * np.sin(np.arange(12)), velocity=0.02)
        motion = saltus.simulate(system, **begin, periods=4)
        ends.append((len(motion.impacts), model.displacements(motion.position)))
    assert ends[0][0] == ends[1][0] > 0
    assert ends[0][1] == pytest.approx(ends[1][1], abs=1e-10)


def test_static_deflections_under_kept_loads_are_exact() -> None:
    mass, stiffness = bar(2000)
    reduced = saltus.Structure.reduced(
        mass, stiffness, modes=3, contacts=[wall(1999)], keep=[700], forces={"push": 700}
    )
    assert reduced.coordinates[0] == "x1999"
    expected = 0.3 * np.minimum(np.arange(1, 2001), 701) / 2000.0
    assert settled(reduced, 0.3) == pytest.approx(expected, abs=1e-10)


def test_rows_without_mass_follow_statically() -> None:
    """Guyan's condensation is exact then: the matrices without these rows."""
    mass, stiffness = bar(40)
    masses = mass.diagonal()
    masses[::2] = 0.0
    rest = np.arange(1, 40, 2)
    gone = np.arange(0, 40, 2)
    dense = stiffness.toarray()
    condensed = dense[np.ix_(rest, rest)] - dense[np.ix_(rest, gone)] @ np.linalg.solve(
        dense[np.ix_(gone, gone)], dense[np.ix_(gone, rest)]
    )
    squares = eigh(condensed, np.diag(masses[rest]), eigvals_only=True)
    reduced = saltus.Structure.reduced(
        sp.diags_array(masses), stiffness, modes=19, contacts=[wall(39)]
    )
    assert frequencies(reduced) == pytest.approx(np.sqrt(squares), rel=1e-9)
    with pytest.raises(saltus.ParameterError, match="modes must be at most 19, as others have no"):
        saltus.Structure.reduced(sp.diags_array(masses), stiffness, modes=20, contacts=[wall(39)])


@pytest.mark.parametrize("rows", [60, 1500])
def test_what_nothing_holds_moves_as_a_body(rows: int) -> None:
    """A free bar whose gap is the difference of two of its displacements."""
    mass, stiffness = bar(rows, held=False)
    stretch = saltus.Contact(name="stretch", coordinate={0: 1.0, rows - 1: -1.0}, position=-0.2)
    reduced = saltus.Structure.reduced(mass, stiffness, modes=6, contacts=[stretch])
    found = frequencies(reduced)
    assert found[0] < 1e-3 * found[1]
    discrete = 2.0 * rows * np.sin(np.pi * np.arange(1, 3) / (2.0 * (rows - 1)))
    assert found[1:3] == pytest.approx(discrete, rel=2.0 / rows)
    moved = saltus.simulate(
        saltus.System(model=reduced, impact=saltus.NewtonImpact(0.5)),
        **reduced.start(0.0, velocity=1.0),
        duration=2.0,
    )
    assert reduced.displacements(moved.position) == pytest.approx(np.full(rows, 2.0), rel=1e-6)


def test_a_triangle_a_file_and_the_whole_matrix_are_the_same(tmp_path: Path) -> None:
    mass, stiffness = bar(30)
    sp.save_npz(tmp_path / "mass.npz", mass)
    scipy.io.mmwrite(tmp_path / "stiffness.mtx", sp.coo_matrix(stiffness), symmetry="symmetric")
    whole = saltus.Structure.reduced(mass, stiffness, modes=4, contacts=[wall(29)])
    for given in (
        (mass, sp.triu(stiffness)),
        (mass, sp.tril(stiffness)),
        (str(tmp_path / "mass.npz"), str(tmp_path / "stiffness.mtx")),
    ):
        other = saltus.Structure.reduced(*given, modes=4, contacts=[wall(29)])
        assert frequencies(other) == pytest.approx(frequencies(whole), rel=1e-12)


def test_units_scale_what_is_reduced() -> None:
    mass, stiffness = bar(800)
    lengths = []
    for scale in (1.0, 1e6):
        model = saltus.Structure.reduced(
            mass * scale, stiffness * scale, modes=5, contacts=[wall(799)], forces={"push": 799}
        )
        load = saltus.Load(frequency=1.0, push=saltus.Harmonic(0.1 * scale))
        system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(0.5))
        lengths.append(natural_units(system).length)
        assert frequencies(model)[0] == pytest.approx(np.pi / 2.0, rel=5e-4)
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)


def test_a_result_keeps_what_it_was_reduced_from(tmp_path: Path) -> None:
    mass, stiffness = bar(500)
    model = saltus.Structure.reduced(mass, stiffness, modes=3, contacts=[wall(499)])
    again = saltus.Structure(**model.to_table())
    assert again == model
    assert again.displacements([0.0, 1.0, 0.0, 0.0]) == pytest.approx(
        model.displacements([0.0, 1.0, 0.0, 0.0]), abs=0.0
    )


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"modes": 0.5}, "modes"),
        ({"modes": 500}, "modes"),
        ({"contacts": []}, "nothing is kept"),
        ({"mass": np.eye(3)}, "stiffness must be 10 x 10|must be 3 x 3"),
        ({"stiffness": np.eye(10) * 1j}, "is complex"),
        ({"stiffness": np.diag(np.full(10, np.nan))}, "finite"),
        ({"stiffness": "matrix.txt"}, ".mtx file"),
        ({"stiffness": "none.mtx"}, "none.mtx"),
        ({"stiffness": -np.eye(10)}, "negative"),
        ({"mass": np.eye(10) + np.diag(np.ones(9), 1) + 0.5 * np.diag(np.ones(9), -1)}, "symmetr"),
        ({"keep": [99]}, "there is no row 99"),
        ({"keep": [9]}, None),
        ({"keep": "x1"}, "keep must be a list"),
        ({"frictions": []}, "no argument 'frictions'; did you mean 'friction'"),
        ({"stiffness": None}, "stiffness"),
        ({"mass": [["a"]]}, "matrix of numbers"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(change: dict, sentence: str | None) -> None:
    mass, stiffness = bar(10)
    given = {"mass": mass, "stiffness": stiffness, "modes": 3, "contacts": [wall(9)]} | change
    if sentence is None:
        assert len(saltus.Structure.reduced(**given).coordinates) == 4
        return
    with pytest.raises(saltus.ParameterError, match=sentence):
        saltus.Structure.reduced(**given)


def test_a_motion_of_many_coordinates_is_printed_in_short() -> None:
    mass, stiffness = bar(100)
    model = saltus.Structure.reduced(mass, stiffness, modes=30, contacts=[wall(99)])
    system = saltus.System(model=model, impact=saltus.NewtonImpact(0.5))
    printed = repr(saltus.simulate(system, **model.start(0.01), duration=0.5))
    assert "mode_7=" in printed
    assert "23 more" in printed
    assert "mode_8=" not in printed
    assert printed.count(",") < 25


@pytest.mark.parametrize("rows", [4, 5, 9, 600])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_gap_between_two_rows_of_a_free_body_is_reduced(rows: int, place: int) -> None:
    """Rounding often leaves a solution of the static equations, though nothing holds the body."""
    mass, stiffness = bar(rows, held=False)
    gap = saltus.Contact(name="gap", coordinate={place: 1.0, rows - 1: -1.0}, position=-0.2)
    reduced = saltus.Structure.reduced(
        0.7 * mass, 0.7 * stiffness, modes=min(rows - 1, 6), contacts=[gap]
    )
    found = frequencies(reduced)
    assert found[0] < 1e-3 * found[1]
    first = 2.0 * rows * np.sin(np.pi / (2.0 * (rows - 1)))
    assert found[1] == pytest.approx(first, rel=2.0 / rows)


def test_a_damping_of_one_triangle_is_no_symmetric_one() -> None:
    mass = np.eye(2)
    stiffness = np.diag([1.0, 2.0])
    damping = np.array([[0.1, 0.8], [0.0, 0.1]])
    ends = []
    for model in (
        saltus.Structure(mass=mass, stiffness=stiffness, damping=damping, contacts=[wall(0, 0.5)]),
        saltus.Structure.reduced(mass, stiffness, damping, modes=1, contacts=[wall(0, 0.5)]),
    ):
        system = saltus.System(model=model, impact=saltus.NewtonImpact(0.5))
        motion = saltus.simulate(system, **model.start([0.1, 0.2], velocity=0.3), duration=2.0)
        ends.append(model.displacements(motion.position))
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


def test_masses_that_nothing_holds_or_joins_move_freely() -> None:
    reduced = saltus.Structure.reduced(
        np.eye(4), np.zeros((4, 4)), modes=3, contacts=[wall(3, 0.5)]
    )
    assert frequencies(reduced) == pytest.approx(np.zeros(4), abs=1e-6)
    with pytest.raises(saltus.ParameterError, match="all of them are 0"):
        saltus.Structure.reduced(np.zeros((4, 4)), np.eye(4), modes=3, contacts=[wall(3)])


@pytest.mark.parametrize("make", [saltus.Structure, saltus.Structure.reduced])
@pytest.mark.parametrize(
    ("name", "size"),
    [("mass", 1e-320), ("mass", 1e120), ("stiffness", 1e-310), ("stiffness", 1e200)],
)
def test_matrices_whose_products_are_no_numbers_are_refused(make, name, size):
    """They were followed with NumPy's warnings."""
    springs = np.array([[2.0, -1.0], [-1.0, 1.0]])
    given = {"mass": np.eye(2), "stiffness": springs}
    given[name] = given[name] * size
    modes = {} if make is saltus.Structure else {"modes": 1}
    stop = wall(1, 0.2)
    with pytest.raises(saltus.ParameterError, match=f"^{name} must have numbers of 1e-100 to 1e"):
        make(**given, **modes, contacts=[stop], forces={"f": 0})


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("unit", [1e-60, 1e-20, 1e20, 1e60])
def test_masses_of_any_unit_stand_beside_modes_of_mass_1(unit):
    """A row's mass beside a mode's of 1 made SciPy warn of an ill-conditioned matrix."""
    springs = np.array([[2.0, -1.0], [-1.0, 1.0]])
    stop = wall(1, 0.2)
    ends = []
    for size in (1.0, unit):
        model = saltus.Structure.reduced(
            size * np.diag([1.0, 0.5]), size * springs, modes=1, contacts=[stop], forces={"f": 0}
        )
        load = saltus.Load(frequency=1.1, f=saltus.Harmonic(0.3 * size))
        system = saltus.System(model=model, load=load, impact=saltus.NewtonImpact(e=0.6))
        motion = saltus.simulate(system, **model.start(), periods=4)
        ends.append([len(motion.impacts), *model.displacements(motion.position)])
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
