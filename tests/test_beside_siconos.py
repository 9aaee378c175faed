"""The benchmark beside Siconos: what it is told, what it answers, and what is said where it is not
installed.
"""

import ctypes
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

import saltus

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from peers.peer import AbsentError
from siconos import beside, case, picture, program


def test_the_equations_given_to_siconos_are_those_of_the_model(tmp_path: Path) -> None:
    """M, r with the signs of the openings, and both derivatives of r, by differences."""
    try:
        library = ctypes.CDLL(f"{program.compiled(tmp_path)}.so")
    except AbsentError as reason:
        pytest.skip(str(reason))
    one, t, rng, signs = case.CASES[3], 0.7, np.random.default_rng(5), np.array([1.0, -1.0])
    numbers, model, load = np.array(one.numbers), one.system.model, one.system.load

    def call(name: str, size: int, *arrays: np.ndarray) -> np.ndarray:
        out = np.zeros(size)
        places = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, out)]
        time = [] if name == "mass" else [ctypes.c_double(t)]
        getattr(library, name)(
            *time, 2, *places, len(numbers), ctypes.c_void_p(numbers.ctypes.data)
        )
        return out

    for _ in range(5):
        x, v = rng.uniform(0, 0.8, 2), rng.uniform(-1, 1, 2)
        mass = np.array(model.mass_matrix(x * signs), dtype=float) * np.outer(signs, signs)
        force = np.array(model.force(t, x * signs, v * signs, load)) * signs
        np.testing.assert_allclose(call("mass", 4, x).reshape(2, 2), mass, rtol=1e-14)
        np.testing.assert_allclose(call("internal", 2, x, v), -force, rtol=1e-13, atol=1e-15)
        for name, at in (("internal_by_opening", 0), ("internal_by_velocity", 1)):
            for j in range(2):
                ahead, back = [x.copy(), v.copy()], [x.copy(), v.copy()]
                ahead[at][j] += 1e-6
                back[at][j] -= 1e-6
                slope = (call("internal", 2, *ahead) - call("internal", 2, *back)) / 2e-6
                np.testing.assert_allclose(call(name, 4, x, v)[2 * j : 2 * j + 2], slope, atol=1e-8)


def test_siconos_comes_to_our_motions_at_first_order() -> None:
    counts = (500, 1000, 2000, 4000, 8000)
    chosen = (case.CASES[1], case.CASES[3])
    try:
        answers = iter(program.march([one.task(count, 1) for one in chosen for count in counts]))
    except AbsentError as reason:
        pytest.skip(str(reason))
    for one in chosen:
        exact = one.end(beside.EXACT)
        errors = [float(np.abs(np.array(next(answers)["state"]) - exact).max()) for _ in counts]
        assert errors[-1] < 2e-3
        steps = [
            {"step": one.duration / count, "error": error}
            for count, error in zip(counts, errors, strict=True)
        ]
        assert 0.7 < beside.order(steps) < 1.4


@dataclass(frozen=True, kw_only=True)
class Heap(saltus.ContactModel):
    """Three bodies on a line over a floor, with springs between neighbours, and gravity."""

    stiffness: float = 4.0
    size: float = 0.2

    coordinates: ClassVar[tuple[str, ...]] = ("a", "b", "c")
    masses: ClassVar[tuple[float, ...]] = (1.0, 0.6, 1.7)

    @property
    def contacts(self):
        floor = saltus.Contact(name="floor", coordinate="a", position=self.size)
        return floor, *(
            saltus.Contact(name=high + low, coordinate={high: 1.0, low: -1.0}, position=self.size)
            for low, high in ("ab", "bc")
        )

    def mass_matrix(self, q):
        return np.diag(self.masses).tolist()

    def force(self, t, q, velocity, load):
        pulls = [self.stiffness * (q[1] - q[0]), self.stiffness * (q[2] - q[1])]
        first, second, third = self.masses
        return pulls[0] - first, pulls[1] - pulls[0] - second, -pulls[1] - third


@pytest.mark.parametrize(
    "e",
    [
        (0.7, 0.7, 0.7),
        pytest.param((0.0, 0.3, 0.0), marks=pytest.mark.thorough),
        pytest.param((0.9, 0.9, 0.9), marks=pytest.mark.thorough),
        (0.8, 0.0, 0.5),
    ],
)
def test_siconos_comes_to_our_motions_of_bodies_that_touch_at_first_order(
    e: tuple[float, ...],
) -> None:
    counts, duration = (1000, 2000, 4000, 8000, 16000), 0.9
    begin, speeds = (0.5, 1.1, 1.6), (-1.0, 0.3, -0.5)
    task = {
        "mass": np.diag(Heap.masses).tolist(),
        "stiffness": (4.0 * np.array([[1, -1, 0], [-1, 2, -1], [0, -1, 1]])).tolist(),
        "force": [-mass for mass in Heap.masses],
        "rows": [[1, 0, 0], [-1, 1, 0], [0, -1, 1]],
        "offsets": [-0.2] * 3,
        "e": e,
        "position": begin,
        "velocity": speeds,
        "duration": duration,
        "rounds": 1,
    }
    try:
        answers = program.march([task | {"steps": count} for count in counts])
    except AbsentError as reason:
        pytest.skip(str(reason))
    system = saltus.System(model=Heap(), impact=saltus.NewtonImpact(e=e))
    motion = saltus.simulate(
        system, **dict(zip("abc", begin, strict=True)), velocity=speeds, duration=duration
    )
    assert {event.contact for event in motion.events} >= {"floor", "ba", "cb"}
    errors = [
        float(np.abs(np.array(answer["state"]) - motion.final_state).max()) for answer in answers
    ]
    assert errors[-1] < 1e-3
    steps = [
        {"step": duration / count, "error": error}
        for count, error in zip(counts, errors, strict=True)
    ]
    assert 0.7 < beside.order(steps) < 1.4


def test_the_times_at_equal_error_are_those_of_power_laws(tmp_path: Path) -> None:
    """Seconds 1e-6 / step and an error of 2 steps: 1e-3 takes 2e-3 s, and 1e-5, beyond the smallest
    step, 0.2 s.
    """
    steps = [{"step": h, "error": 2 * h, "seconds": 1e-6 / h} for h in (1e-2, 1e-3, 1e-4)]
    ours = [
        {"tol": 1e-6, "error": 1e-8, "seconds": 1e-3},
        {"tol": 1e-8, "error": 1e-10, "seconds": 2e-3},
    ]
    equal = [beside._at(target, steps, ours) for target in beside.TARGETS]
    assert [at["siconos"] for at in equal] == pytest.approx([2e-3, 0.2])
    assert [at["step"] for at in equal] == pytest.approx([5e-4, 5e-6])
    assert [at["reached"] for at in equal] == [True, False]
    rows = [
        {
            "about": one.about,
            "impacts": 1,
            "order": 1.0,
            "siconos": steps,
            "saltus": ours,
            "equal": equal,
        }
        for one in case.CASES
    ]
    text = beside.report({"about": {}, "version": "0", "cases": rows})
    assert text.count("| 1e-05 | 1.00 | 200* | 5.00e-06* | 200* |") == len(case.CASES)
    (tmp_path / "siconos.png").write_bytes(picture.draw(rows))
    assert (tmp_path / "siconos.png").stat().st_size > 10_000


def test_a_machine_without_siconos_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def absent() -> str:
        raise AbsentError(f"no Python here has Siconos: {program.INSTALL}")

    monkeypatch.setattr(program, "interpreter", absent)
    beside.beside_siconos({}, quick=True, folder=tmp_path)
    assert "apt-get install python3-siconos gcc" in (tmp_path / "siconos.md").read_text()
    assert not (tmp_path / "siconos.png").exists()
