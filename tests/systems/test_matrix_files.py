"""Matrices in files are those that NumPy and SciPy wrote, and a damaged file is one sentence."""

import base64
import itertools
import json
import os
import random
import sys
import time
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse

import saltus
from saltus.errors import ParameterError
from saltus.systems.files.matrix_files import matrices_in

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))
import bad_inputs

THOROUGH = int(os.environ.get("SALTUS_CASES", "20000"))
NAMES = {"mass": ("mass", "M"), "stiffness": ("stiffness", "K"), "damping": ("damping", "C")}
MASS = np.diag([1.0, 2.0, 3.0])
STIFFNESS = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])


def files_of(folder, m=MASS, k=STIFFNESS):
    """The same matrices in all the ways in which SciPy and NumPy write them."""
    more = {"C": 0.1 * k, "title": "a text", "options": {"step": 1.0}, "list": [1, "a"]}
    for packed in (False, True):
        for name, made in (("full", np.asfortranarray), ("sparse", scipy.sparse.csc_matrix)):
            path = folder / f"{name}{packed}.mat"
            scipy.io.savemat(path, {**more, "M": made(m), "K": made(k)}, do_compression=packed)
            yield path
    np.savez(folder / "plain.npz", mass=m, stiffness=np.asfortranarray(k), C=0.1 * k)
    np.savez_compressed(folder / "packed.npz", M=m, K=k, damping=0.1 * k, more=np.zeros(10**6))
    yield from (folder / "plain.npz", folder / "packed.npz")


@pytest.mark.parametrize("size", [1, 3, 40])
def test_matrices_are_read_as_they_were_written(tmp_path, size):
    rng = np.random.default_rng(size)
    m, k = rng.normal(size=(2, size, size))
    m[np.abs(m) < 0.5] = 0.0
    for path in files_of(tmp_path, m, k):
        found = matrices_in(str(path), NAMES)
        np.testing.assert_array_equal(found["mass"], m)
        np.testing.assert_array_equal(found["stiffness"], k)
        np.testing.assert_array_equal(found["damping"], 0.1 * k)


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", "?"])
def test_numbers_of_every_kind_are_read(tmp_path, kind):
    numbers = (
        np.arange(9).reshape(3, 3) % 2 if kind == "?" else np.arange(9).reshape(3, 3)
    ).astype(kind)
    path = tmp_path / "kinds.mat"
    scipy.io.savemat(path, {"M": numbers, "K": scipy.sparse.csc_matrix(numbers.astype(float))})
    np.savez(tmp_path / "kinds.npz", M=numbers, K=numbers)
    for each in (path, tmp_path / "kinds.npz"):
        found = matrices_in(str(each), NAMES)
        np.testing.assert_array_equal(found["mass"], numbers.astype(float))
        np.testing.assert_array_equal(found["stiffness"], numbers.astype(float))


def sentence_of(function, *given, **named):
    """The sentence of a refusal, checked to be one; None where there is none."""
    begun = time.process_time()
    try:
        function(*given, **named)
    except ParameterError as error:
        sentence = str(error)
        assert sentence.isprintable()
        assert len(sentence) <= 400
    else:
        sentence = None
    assert time.process_time() - begun < 10.0
    return sentence


@pytest.mark.parametrize(
    "count", [300, pytest.param(THOROUGH, marks=pytest.mark.thorough)], ids=["few", "many"]
)
def test_a_damaged_file_is_one_sentence(tmp_path, count):
    rng = random.Random(f"matrices {count}")
    files = [path for path in files_of(tmp_path) if path.stat().st_size < 10_000]
    refused = 0
    for _ in range(count):
        path = rng.choice(files)
        content = path.read_bytes()
        for _ in range(rng.choice((1, 1, 2))):
            content = bad_inputs.damaged(rng, content)
        bad = tmp_path / f"bad{path.suffix}"
        bad.write_bytes(content)
        refused += sentence_of(saltus.Structure, file=str(bad)) is not None
    assert refused > count / 2


def test_what_is_no_such_file_is_told(tmp_path):
    np.save(tmp_path / "one.npy", MASS)
    np.savez(tmp_path / "objects.npz", M=np.array([[None]]), K=STIFFNESS)
    scipy.io.savemat(tmp_path / "old.mat", {"M": MASS, "K": STIFFNESS}, format="4")
    contents = {
        "empty.npz": b"",
        "empty.mat": b"",
        "array.npz": (tmp_path / "one.npy").read_bytes(),
        "new.mat": b"MATLAB 7.3 MAT-file".ljust(512),
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    for name in (*contents, "objects.npz", "old.mat", "none.mat"):
        sentence = sentence_of(saltus.Structure, file=str(tmp_path / name))
        assert name in str(sentence)
    assert "-v7" in sentence_of(saltus.Structure, file=str(tmp_path / "new.mat"))


def test_no_more_is_unpacked_than_a_structure_may_have(tmp_path):
    """A few hundred kilobytes that promise one number, or millions, take no gigabyte."""
    many = np.zeros((4000, 4000))
    np.savez_compressed(tmp_path / "large.npz", M=many, K=many)
    scipy.io.savemat(tmp_path / "large.mat", {"M": many, "K": many}, do_compression=True)
    lies = base64.b64encode(zlib.compress(bytes(4 * 10**7))).decode()
    table = {"type": "Structure", "mass": f"float64 1x1 {lies}", "stiffness": [[1.0]]}
    text = json.dumps({"model": table})
    asks = (
        lambda: saltus.Structure(file=str(tmp_path / "large.npz")),
        lambda: saltus.Structure(file=str(tmp_path / "large.mat")),
        lambda: saltus.System.from_json(text),
    )
    for ask in asks:
        tracemalloc.start()
        assert sentence_of(ask) is not None
        assert tracemalloc.get_traced_memory()[1] < 1e7
        tracemalloc.stop()


@pytest.mark.parametrize("field", ["mass", "stiffness", "damping"])
def test_complex_matrices_are_refused_by_naming_the_damping(tmp_path, field):
    """Structural damping K (1 + i eta) would be lost, and the motion undamped."""
    given = {"mass": MASS, "stiffness": STIFFNESS, "damping": 0.1 * STIFFNESS}
    given[field] = given[field] * (1.0 + 0.1j)
    scipy.io.savemat(tmp_path / "complex.mat", given)
    np.savez(tmp_path / "complex.npz", **given)
    asks = ({"file": str(tmp_path / "complex.mat")}, {"file": str(tmp_path / "complex.npz")}, given)
    for named in asks:
        sentence = sentence_of(saltus.Structure, **named)
        assert field in sentence
        assert "damping" in sentence
        assert "complex" in sentence


def test_matrices_of_anything_but_numbers_are_refused():
    bad = ([["1.0"]], [[None]], np.ma.masked_array([[1.0]], mask=True), [[np.nan]], {"a": 1}, "x")
    for field, value in itertools.product(("mass", "stiffness"), bad):
        assert sentence_of(
            saltus.Structure, **{"mass": [[1.0]], "stiffness": [[1.0]], field: value}
        )
