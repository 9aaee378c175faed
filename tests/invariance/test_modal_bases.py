"""The modes of a structure are one basis, whoever computes them, and files notice another one."""

import os
import subprocess
import sys

import numpy as np
import pytest

import saltus
from saltus.systems import mode_sums


def chain(n):
    return 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def plate(n):
    return np.kron(chain(n), np.eye(n)) + np.kron(np.eye(n), chain(n))


def ring(n):
    matrix = 2.2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    matrix[0, -1] = matrix[-1, 0] = -1.0
    return matrix


# matrices with equal frequencies, with mirror images, or with both, and the row of a stop
STIFFNESS = {
    "chain": (chain(12), 11),
    "chain with the stop in its middle": (chain(11), 5),
    "plate": (plate(4), 10),
    "odd plate": (plate(3), 4),
    "ring": (ring(8), 0),
    "pendulums": (np.diag([1.0, 1.0, 2.0]), 2),
}


def structure(stiffness, row):
    stop = saltus.Contact(name="stop", coordinate=row, position=0.2, sign=-1)
    return saltus.Structure(
        mass=np.eye(len(stiffness)), stiffness=stiffness, contacts=[stop], forces={"f": 0}
    )


def basis(model):
    return np.array([model.displacements(unit) for unit in np.eye(len(model.coordinates))]).T


@pytest.mark.parametrize("name", STIFFNESS)
def test_noise_of_rounding_does_not_change_the_modes(name):
    stiffness, row = STIFFNESS[name]
    known = basis(structure(stiffness, row))
    rng = np.random.default_rng(1)
    for _ in range(5):
        noise = 1e-15 * rng.normal(size=stiffness.shape)
        found = basis(structure(stiffness + noise + noise.T, row))
        np.testing.assert_allclose(found, known, atol=1e-9)


@pytest.mark.parametrize("name", STIFFNESS)
def test_they_are_modes(name):
    """u = T z with the stop held: K T_z - T_z w^2 acts at the stop alone, and T_z' T_z = 1."""
    stiffness, row = STIFFNESS[name]
    shapes = basis(structure(stiffness, row))[:, 1:]
    np.testing.assert_allclose(shapes.T @ shapes, np.eye(shapes.shape[1]), atol=1e-12)
    pushes = np.delete(stiffness @ shapes, row, axis=0)
    shapes = np.delete(shapes, row, axis=0)
    squares = (shapes * pushes).sum(axis=0)
    np.testing.assert_allclose(pushes, shapes * squares, atol=1e-12)
    assert (np.diff(squares) > -1e-12).all()


PRINTED = """
import sys
sys.path[:0] = {paths!r}
import numpy as np
from test_modal_bases import STIFFNESS, basis, structure
print(np.concatenate([basis(structure(*each)).ravel() for each in STIFFNESS.values()]).tolist())
"""


@pytest.mark.parametrize("kernel", ["Haswell", "Nehalem"])
def test_another_kernel_of_blas_finds_the_same_modes(kernel):
    here = [basis(structure(*each)).ravel() for each in STIFFNESS.values()]
    code = PRINTED.format(paths=[os.path.dirname(__file__), *sys.path])
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "OPENBLAS_CORETYPE": kernel},
        capture_output=True,
        text=True,
        check=True,
    )
    there = np.fromstring(run.stdout.strip().strip("[]"), sep=",")
    np.testing.assert_allclose(there, np.concatenate(here), atol=1e-9)


def test_a_file_whose_modes_are_others_is_refused(tmp_path, monkeypatch):
    stiffness, row = STIFFNESS["chain"]
    model = saltus.Structure(
        mass=np.eye(12),
        stiffness=stiffness,
        damping=0.05 * stiffness,
        contacts=[saltus.Contact(name="stop", coordinate=row, position=0.2, sign=-1)],
        forces={"f": 0},
    )
    system = saltus.System(
        model=model,
        load=saltus.Load(frequency=0.24, f=saltus.Harmonic(0.05)),
        impact=saltus.NewtonImpact(e=0.6),
    )
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, **model.start()), "load.frequency", (0.2399, 0.2401)
    )
    saltus.save(tmp_path / "branch.nc", branch)
    assert len(saltus.orbits.orbits_of(saltus.load(tmp_path / "branch.nc"))) == len(branch.orbits)
    turned = [-x if i == 3 else x for i, x in enumerate(mode_sums(model))]
    monkeypatch.setattr("saltus.result.mode_sums", lambda model: turned)
    with pytest.raises(saltus.ParameterError, match="amplitudes are of other modes of Structure"):
        saltus.orbits.orbits_of(saltus.load(tmp_path / "branch.nc"))
