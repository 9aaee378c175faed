"""A structure from its matrices: its coordinates and equations, what it refuses, and how it is
written.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

import saltus


def chain(size: int, damping: float = 0.02) -> dict[str, np.ndarray]:
    """The matrices of equal masses between springs, the first of which is fixed."""
    stiffness = 2.0 * np.eye(size) - np.eye(size, k=1) - np.eye(size, k=-1)
    stiffness[-1, -1] = 1.0
    return {"mass": np.eye(size), "stiffness": stiffness, "damping": damping * stiffness}


STOP = saltus.Contact(name="stop", coordinate=2, position=0.3, sign=-1)
SOFT = saltus.Surface(name="soft", coordinate=0, position=0.1, stiffness=5.0, damping=0.1)
LOAD = saltus.Load(frequency=0.6, drive=saltus.Harmonic(0.1))


@dataclass(frozen=True, kw_only=True)
class ThreeMasses(saltus.ContactModel):
    """The same chain of three masses, with its equations written out."""

    coordinates = ("x0", "x1", "x2")
    channels = ("drive",)
    contacts = (saltus.Contact(name="stop", coordinate="x2", position=0.3, sign=-1),)
    surfaces = (saltus.Surface(name="soft", coordinate="x0", position=0.1),)

    damper: float = 0.02

    def force(self, t, q, v, load, sides):
        pulled = [2 * q[0] - q[1], 2 * q[1] - q[0] - q[2], q[2] - q[1]]
        slowed = [2 * v[0] - v[1], 2 * v[1] - v[0] - v[2], v[2] - v[1]]
        found = [-k - self.damper * c for k, c in zip(pulled, slowed, strict=True)]
        found[0] += load.drive(t) - 0.5 * (1 + sides.soft) * (5.0 * (q[0] - 0.1) + 0.1 * v[0])
        return tuple(found)


def test_motion_is_that_of_the_model_written_out() -> None:
    structure = saltus.Structure(**chain(3), contacts=[STOP], surfaces=[SOFT], forces={"drive": 0})
    law = saltus.NewtonImpact(e=0.7)
    moved = saltus.simulate(
        saltus.System(model=structure, load=LOAD, impact=law),
        **structure.start([0.05, 0.1, 0.2], [0.0, 0.1, -0.3]),
        periods=12,
    )
    written = saltus.simulate(
        saltus.System(model=ThreeMasses(), load=LOAD, impact=law),
        x0=0.05,
        x1=0.1,
        x2=0.2,
        velocity=(0.0, 0.1, -0.3),
        periods=12,
    )
    assert len(moved.impacts) == len(written.impacts) == 9
    assert np.abs(moved.impacts.time - written.impacts.time).max() < 1e-12
    assert np.abs(structure.displacements(moved.position) - written.position).max() < 1e-12
    assert np.abs(structure.displacements(moved.velocity) - written.velocity).max() < 1e-12


def test_derivatives_are_those_of_the_model_written_out() -> None:
    structure, law = (
        saltus.Structure(**chain(3), contacts=[STOP], surfaces=[SOFT], forces={"drive": 0}),
        saltus.NewtonImpact(e=0.7),
    )
    asked = {"parameters": ["load.frequency", "load.drive.amplitude", "impact.e"], "periods": 6}
    own = saltus.sensitivities(
        saltus.System(model=structure, load=LOAD, impact=law),
        **structure.start([0.05, 0.1, 0.2], [0.0, 0.1, -0.3]),
        **asked,
    )
    written = saltus.sensitivities(
        saltus.System(model=ThreeMasses(), load=LOAD, impact=law),
        x0=0.05,
        x1=0.1,
        x2=0.2,
        velocity=(0.0, 0.1, -0.3),
        **asked,
    )
    assert len(own.motion.impacts) == 5
    basis = np.kron(np.eye(2), structure.displacements(np.eye(3)))
    assert np.abs(basis @ own.parameters - written.parameters).max() < 1e-11
    assert np.abs(basis @ own.state @ np.linalg.inv(basis) - written.state).max() < 1e-11


def test_coordinates_are_local_displacements_and_held_modes() -> None:
    given = chain(6)
    tip = saltus.Contact(name="tip", coordinate=[0.0, 0.0, 0.0, 0.0, -1.0, 1.0], position=-1.0)
    structure = saltus.Structure(**given, contacts=[tip])
    assert structure.coordinates == ("tip", *(f"mode_{i}" for i in range(1, 6)))
    u = np.linspace(-0.5, 1.0, 6)
    start = structure.start(u)
    assert start["tip"] == pytest.approx(u[5] - u[4], abs=1e-15)
    assert (
        np.abs(structure.displacements([start[name] for name in structure.coordinates]) - u).max()
        < 1e-14
    )
    basis = structure.displacements(np.eye(6))
    reduced = basis.T @ given["mass"] @ basis
    assert np.abs(reduced[1:, 1:] - np.eye(5)).max() < 1e-14
    assert np.abs(reduced[0, 1:]).max() < 1e-14


def test_kinetic_energy_is_that_of_the_displacements() -> None:
    given = chain(5)
    given["mass"] = given["mass"] + 0.2 * given["stiffness"]
    structure = saltus.Structure(
        **given, contacts=[STOP, saltus.Contact(name="other", coordinate=4, position=1.0, sign=-1)]
    )
    rates = np.arange(1.0, 6.0)
    energy = structure.kinetic_energy(0.0, (0.0,) * 5, tuple(rates), 1, saltus.Load())
    u = structure.displacements(rates)
    assert energy == pytest.approx(u @ given["mass"] @ u / 2, rel=1e-13)


def test_a_structure_with_other_numbers_is_not_traced_anew() -> None:
    from saltus.taylor.generated import structure_key

    def key(damping, *contacts):
        model = saltus.Structure(**chain(4, damping), contacts=contacts, forces={"drive": 0})
        return structure_key(saltus.System(model=model, load=LOAD))

    assert key(0.02, STOP) == key(0.5, STOP)
    assert key(0.02, STOP) != key(0.02, STOP, SOFT_WALL)


@pytest.mark.parametrize("coupled", [False, True])
def test_a_structure_of_another_size_has_the_same_code(coupled: bool) -> None:
    from saltus.flow.programs.compiled import structure_functions
    from saltus.flow.programs.compiled_lanes import lane_functions
    from saltus.taylor.generated import functions_text
    from saltus.taylor.tracing import trace

    def code(size: int) -> str:
        model = saltus.Structure(
            **chain_of(size, coupled), contacts=[STOP], surfaces=[SOFT], forces={"drive": 0}
        )
        traced = trace(saltus.System(model=model, load=LOAD))
        return functions_text([*structure_functions(traced), *lane_functions(traced)])

    assert code(4) == code(9)


def chain_of(size: int, coupled: bool) -> dict[str, np.ndarray]:
    """The chain, with a damping that is no combination of mass and stiffness, so that it couples
    the modes, or without.
    """
    given = chain(size)
    given["damping"][0, 0] += float(coupled)
    return given


def driven(size: int, coupled: bool) -> tuple[saltus.System, list[dict]]:
    """A chain against its stop, and starts that hit it."""
    model = saltus.Structure(**chain_of(size, coupled), contacts=[STOP], forces={"drive": 0})
    starts = [
        model.start(0.2, 0.1 * np.arange(1.0, size + 1) * factor)
        for factor in (0.8, 1.0, 1.3, 2.0, 3.0)
    ]
    return saltus.System(model=model, load=LOAD, impact=saltus.NewtonImpact(e=0.7)), starts


def followed_together(system: saltus.System, starts: list[dict], **asked) -> xr.Dataset:
    """The motions of an ensemble from these starts."""
    columns = {name: [start[name] for start in starts] for name in system.model.coordinates}
    return saltus.simulate_many(
        system, **columns, velocity=[*np.array([start["velocity"] for start in starts]).T], **asked
    )


@pytest.mark.parametrize("coupled", [False, True])
def test_ensembles_of_two_sizes_follow_their_own_motions(coupled: bool) -> None:
    for size in (4, 9):  # the second with the code of the first
        system, starts = driven(size, coupled)
        found = followed_together(system, starts, periods=4, tol=1e-12)
        ends = np.array([found[name] for name in system.model.coordinates])
        motions = [saltus.simulate(system, **start, periods=4) for start in starts]
        assert min(len(motion.impacts) for motion in motions) >= 4
        assert np.abs(ends - np.array([motion.position for motion in motions]).T).max() < 1e-10


@pytest.mark.thorough
@pytest.mark.parametrize("coupled", [False, True])
def test_an_ensemble_has_the_derivatives_of_its_motions(coupled: bool) -> None:
    (system, starts), paths = driven(3, coupled), ["load.frequency", "impact.e"]
    found = followed_together(system, starts, periods=2, tol=1e-12, sensitivities=paths).derivative
    for start, own in zip(starts, found.values, strict=True):
        alone = saltus.sensitivities(system, parameters=paths, **start, periods=2)
        assert len(alone.motion.impacts) > 0
        assert (
            np.abs(own - np.hstack([alone.state, alone.parameters])).max()
            < 1e-9 * np.abs(own).max()
        )


def test_the_series_of_derivatives_are_as_long_for_any_size() -> None:
    from saltus.flow.programs.compiled import structure_functions
    from saltus.taylor.generated import llvm_text
    from saltus.taylor.tracing import trace

    def length(size: int) -> int:
        model = saltus.Structure(
            **chain(size), contacts=[STOP], surfaces=[SOFT], forces={"drive": 0}
        )
        functions = structure_functions(
            trace(saltus.System(model=model, load=LOAD), sensitivities=("load.drive.amplitude",))
        )
        return len(llvm_text([each for each in functions if each.name == "series"]))

    assert length(24) < 1.01 * length(4)


SOFT_WALL = saltus.Contact(name="wall", coordinate=0, position=-2.0)


def test_numbers_of_its_parts_are_parameters() -> None:
    structure = saltus.Structure(
        **chain(3), contacts=[STOP], surfaces=[SOFT], forces={"drive": {0: 1.0, "x2": 0.5}}
    )
    system = saltus.System(model=structure, load=LOAD)
    moved = system.with_(
        {"model.contacts.stop.position": 0.5, "model.surfaces.soft.stiffness": 7.0}
    )
    assert moved.parameters["model.contacts.stop.position"] == 0.5
    assert moved.model.surfaces[0].stiffness == 7.0
    assert not [path for path in system.parameters if "coefficients" in path]


@pytest.mark.parametrize("text", ["json", "toml"])
def test_a_structure_is_read_back_as_it_was_written(text: str) -> None:
    structure = saltus.Structure(
        **chain(3),
        contacts=[STOP],
        surfaces=[SOFT],
        forces={"drive": 0},
        points={"mean": [0.3] * 3},
    )
    system = saltus.System(model=structure, load=LOAD)
    assert getattr(saltus.System, f"from_{text}")(getattr(system, f"to_{text}")()) == system


@pytest.mark.parametrize("name", ["chain.npz", "chain.mat"])
def test_matrices_of_files(tmp_path, name: str) -> None:
    given, path = chain(3), tmp_path / name
    called = dict(zip(("M", "K", "C"), given.values(), strict=True))
    if path.suffix == ".npz":
        np.savez(path, **called)
    else:
        from scipy.io import savemat

        savemat(path, called)
    assert saltus.Structure(file=str(path), contacts=[STOP]) == saltus.Structure(
        **given, contacts=[STOP]
    )


GOOD = chain(3)
REFUSED = {
    "mass must be a square matrix, got one of 2 x 3": {"mass": np.eye(3)[:2]},
    "stiffness must be 3 x 3 as the mass is, got 2 x 2": {"stiffness": np.eye(2)},
    "mass must be symmetric, got 0.1 in row 0, column 1": {
        "mass": np.eye(3) + 0.1 * np.eye(3, k=1)
    },
    "mass must be positive definite, and its least eigenvalue is -1": {
        "mass": np.diag([1.0, -1.0, 1.0])
    },
    "stiffness must be symmetric": {"stiffness": np.eye(3) + np.eye(3, k=1)},
    "stiffness must be finite; it holds nan or inf": {"stiffness": np.diag([1.0, np.nan, 1.0])},
    "damping must be rows of numbers": {"damping": "strong"},
    "mass is missing": {"mass": None},
    "at most 200 rows, got 201": {"mass": np.eye(201), "stiffness": np.eye(201), "damping": None},
    "contacts.stop: there is no row 7; the rows are 0 to 2": {
        "contacts": [saltus.Contact(name="stop", coordinate=7, position=1.0)]
    },
    "contacts.stop: no row is called 'tip'": {
        "contacts": [saltus.Contact(name="stop", coordinate="tip", position=1.0)]
    },
    "forces.drive must have 3 numbers, one for each row": {"forces": {"drive": [1.0, 2.0]}},
    "the displacement both follows from x0, x1": {
        "contacts": [
            saltus.Contact(name="a", coordinate=0, position=-1.0),
            saltus.Contact(name="b", coordinate=1, position=-1.0),
            saltus.Contact(name="both", coordinate={0: 1.0, 1: 1.0}, position=-2.0),
        ]
    },
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_what_is_no_structure_is_refused(sentence: str) -> None:
    with pytest.raises(saltus.ParameterError) as error:
        saltus.Structure(**{**GOOD, **REFUSED[sentence]})
    assert sentence in str(error.value)


@pytest.mark.parametrize("size", [1, 2, 40])
def test_free_flight_is_the_exponential_of_the_matrices(size: int) -> None:
    """With a damping that couples the modes, without contacts that are reached."""
    from scipy.linalg import expm

    rng = np.random.default_rng(size)
    mass, stiffness, damping = (
        x @ x.T / size + np.eye(size) for x in rng.normal(size=(3, size, size))
    )
    far = saltus.Contact(name="far", coordinate=0, position=-100.0)
    structure = saltus.Structure(
        mass=mass, stiffness=stiffness, damping=0.1 * damping, contacts=[far]
    )
    u, v = rng.normal(size=(2, size))
    end = saltus.simulate(saltus.System(model=structure), **structure.start(u, v), duration=3.0)
    inverse, zero = np.linalg.inv(mass), np.zeros((size, size))
    flow = expm(
        3.0 * np.block([[zero, np.eye(size)], [-inverse @ stiffness, -0.1 * inverse @ damping]])
    )
    found = np.append(
        structure.displacements(np.atleast_1d(end.position)),
        structure.displacements(np.atleast_1d(end.velocity)),
    )
    assert np.abs(found - flow @ np.append(u, v)).max() < 1e-11


def test_a_study_names_the_file_of_the_matrices_beside_it(tmp_path) -> None:
    np.savez(tmp_path / "chain.npz", **chain(3))
    text = """
    [model]
    type = "Structure"
    file = "chain.npz"
    forces = { drive = 0 }
    contacts = [{ name = "stop", coordinate = 2, position = 0.3, sign = -1 }]
    [load]
    frequency = 0.6
    drive = { amplitude = 0.1 }
    """
    (tmp_path / "study.toml").write_text(text)
    system = saltus.load_study(tmp_path / "study.toml").system
    assert system.model == saltus.Structure(**chain(3), contacts=[STOP], forces={"drive": 0})


def test_the_energies_of_contact_friction_and_soft_stop_close() -> None:
    belt = saltus.Friction(name="belt", coordinate=1, kinetic=0.05, static=0.08, ground_speed=0.1)
    structure = saltus.Structure(
        **chain(4), contacts=[STOP], surfaces=[SOFT], friction=[belt], forces={"drive": 3}
    )
    system = saltus.System(model=structure, load=LOAD, impact=saltus.NewtonImpact(e=0.5))
    motion = saltus.simulate(system, **structure.start(), periods=10)
    assert len(motion.events) > 20
    assert abs(float(saltus.energies(motion, periods=10).attrs["defect"])) < 1e-12


def test_a_structure_without_modes_is_proved_to_stay_at_rest() -> None:
    """A mass that its spring presses on a wall with 0.1 stays there under less."""
    from saltus.bounds import keeps_rest

    wall = saltus.Contact(name="wall", coordinate=0, position=0.1)
    model = saltus.Structure(mass=[[2.0]], stiffness=[[1.0]], contacts=[wall], forces={"push": 0})
    system = saltus.System(model=model, load=saltus.Load(frequency=0.7, push=saltus.Harmonic(0.05)))
    assert keeps_rest(system, {"load.push.amplitude": np.array([0.05, 0.2])}).tolist() == [
        True,
        False,
    ]


def test_a_structure_has_no_resets():
    part = saltus.Surface(name="valve", coordinate="x2", after_event="kicked")
    with pytest.raises(saltus.ParameterError, match="valve: a Structure does not follow an after"):
        saltus.Structure(**chain(3), surfaces=[part])


def test_a_structure_of_one_coordinate_shows_its_displacement() -> None:
    """A free mass of 4 moves by 0.3 + 2 t, also where its state is a number."""
    stop = saltus.Contact(name="stop", coordinate=0, position=-1.0)
    mass = saltus.Structure(mass=[[4.0]], stiffness=[[0.0]], contacts=(stop,))
    start = mass.start(displacement=0.3, velocity=2.0)
    motion = saltus.simulate(saltus.System(model=mass), **start, duration=1.5)
    np.testing.assert_allclose(mass.displacements(motion.position), [3.3], rtol=1e-13)
