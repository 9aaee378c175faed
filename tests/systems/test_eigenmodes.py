"""Structures whose fast modes are heavily damped are followed in eigenmodes: beside the exponential
of their matrices, beside their own Taylor series, and in ensembles."""

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

import saltus
from saltus.systems.structures import eigenmodes

# in parts of the stiffness: the fastest of six modes dies out 2000 times as fast as the first one
# turns
DAMPING = 0.02


def beam(elements: int = 3) -> dict[str, np.ndarray]:
    """The matrices of a cantilever of length 1 in cubic elements, of unit mass and bending
    stiffness; its tip is row -2.
    """
    s, size = 1.0 / elements, 2 * elements + 2
    bent = np.array(
        [
            [12, 6 * s, -12, 6 * s],
            [6 * s, 4 * s**2, -6 * s, 2 * s**2],
            [-12, -6 * s, 12, -6 * s],
            [6 * s, 2 * s**2, -6 * s, 4 * s**2],
        ]
    )
    heavy = np.array(
        [
            [156, 22 * s, 54, -13 * s],
            [22 * s, 4 * s**2, 13 * s, -3 * s**2],
            [54, 13 * s, 156, -22 * s],
            [-13 * s, -3 * s**2, -22 * s, 4 * s**2],
        ]
    )
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for i in range(elements):
        at = slice(2 * i, 2 * i + 4)
        mass[at, at] += heavy * s / 420
        stiffness[at, at] += bent / s**3
    return {
        "mass": mass[2:, 2:],
        "stiffness": stiffness[2:, 2:],
        "damping": DAMPING * stiffness[2:, 2:],
    }


def on(parts: dict[str, list], e: float = 0.6, **given: np.ndarray) -> saltus.System:
    """A beam that is pushed at its tip near its first resonance."""
    model = saltus.Structure(**(given or beam()), forces={"push": 4}, **parts)
    load = saltus.Load(frequency=3.4, push=saltus.Harmonic(0.02))
    return saltus.System(
        model=model, load=load, **({"impact": saltus.NewtonImpact(e=e)} if model.contacts else {})
    )


STOP = {"contacts": [saltus.Contact(name="stop", coordinate=4, position=0.02, sign=-1)]}
FAR = {"contacts": [saltus.Contact(name="stop", coordinate=4, position=1.0, sign=-1)]}
SOFT = {
    "surfaces": [
        saltus.Surface(name="above", coordinate=4, position=0.02, stiffness=40.0, damping=0.1),
        saltus.Surface(name="below", coordinate=4, position=-0.02, sign=-1, stiffness=20.0),
    ]
}


def by_series(monkeypatch: pytest.MonkeyPatch, *arguments, **options) -> saltus.Motion:
    """The same motion by the structure's own Taylor series."""
    parts, *rest = arguments
    with monkeypatch.context() as changed:
        changed.setattr(saltus.Structure, "eigenmodes", lambda *given: np.zeros(0))
        system = on(parts, *rest)
        return saltus.simulate(system, **system.model.start(), **options)


def test_free_motion_is_the_exponential_of_the_matrices_in_few_steps() -> None:
    system, given = on(FAR), beam()
    motion = saltus.simulate(system, **system.model.start(displacement=0.01), periods=4, tol=1e-13)
    slope, size = np.zeros((14, 14)), 6
    slope[:6, 6:12] = np.eye(size)
    slope[6:12, :6], slope[6:12, 6:12] = (
        -np.linalg.solve(given["mass"], given[name]) for name in ("stiffness", "damping")
    )
    slope[6:12, 12] = np.linalg.solve(given["mass"], 0.02 * np.eye(size)[4])
    slope[12, 13], slope[13, 12] = 3.4, -3.4  # sine and cosine
    start = np.concatenate([np.full(6, 0.01), np.zeros(7), [1.0]])
    end = expm(slope * motion.time) @ start
    # how far the last bit of the matrices' numbers moves the end, which no program can know better
    random = np.random.default_rng(0)
    ulps = np.finfo(float).eps / 2 * random.choice([-1, 1], (8, *slope.shape))
    moved = np.max(
        [np.abs(expm(slope * (1 + u) * motion.time) @ start - end) for u in ulps], axis=0
    )
    assert moved[:12].max() < 1e-11
    for found, part in ((motion.position, slice(6)), (motion.velocity, slice(6, 12))):
        apart = np.abs(system.model.displacements(found) - end[part]).max()
        assert apart < 2.0 * moved[part].max() + 1e-13
    assert len(motion.dense.start) < 250  # by Taylor series more than 5000


@pytest.mark.parametrize(
    ("parts", "e"),
    [(STOP, 0.6), (STOP, 0.0), (SOFT, 1.0)],
    ids=["bounces", "rests and releases", "soft"],
)
def test_events_are_those_of_the_taylor_series(
    monkeypatch: pytest.MonkeyPatch, parts: dict[str, list], e: float
) -> None:
    system = on(parts, e)
    assert system.model.eigenmodes(24).size > 0
    own = saltus.simulate(system, **system.model.start(), periods=6, tol=1e-13)
    other = by_series(monkeypatch, parts, e, periods=6, tol=1e-13)
    assert len(own.events) == len(other.events) > 9
    assert np.abs(np.subtract(own.events.times, other.events.times)).max() < 1e-11
    assert np.abs(np.subtract(own.position, other.position)).max() < 5e-13
    assert np.abs(np.subtract(own.velocity, other.velocity)).max() < 1e-12
    assert len(own.dense.start) < 0.3 * len(other.dense.start)


def test_ensembles_have_the_motions_of_simulate_also_with_other_springs() -> None:
    system = on(SOFT)
    stiffness, frequency = np.array([20.0, 40.0, 300.0]), np.array([3.0, 3.2, 3.4])
    for path, values in (
        ("model.surfaces.above.stiffness", stiffness),
        ("load.frequency", frequency),
    ):
        found = saltus.simulate_many(
            system, **system.model.start(), parameters={path: values}, periods=3, tol=1e-12
        )
        for i, value in enumerate(values):
            alone = saltus.simulate(
                system.with_({path: float(value)}), **system.model.start(), periods=3, tol=1e-12
            )
            assert float(found["x4"][i]) == pytest.approx(alone.position[0], abs=1e-12)


def test_eigenvalues_of_slow_modes_are_good_to_rounding_beside_fast_ones() -> None:
    a = eigenmodes.first_order_form(on(FAR).model, (), ())[0]
    values, vectors, inverse = eigenmodes.decoupled(a)
    with mpmath.workdps(40):
        exact, _ = mpmath.eig(mpmath.matrix(a.tolist()))
    rounding = 1e-14 if np.finfo(np.longdouble).eps < 1e-18 else 1e-10
    for value in values:
        assert min(abs(complex(each) - value) for each in exact) < rounding * abs(value)
    assert np.abs(vectors @ np.diag(values) @ inverse - a).max() < 1e-13 * np.abs(a).max()


def test_few_damped_and_nearly_defective_structures_keep_their_taylor_series() -> None:
    given = beam()
    light = given | {"damping": 1e-6 * given["stiffness"]}
    coupled = on(FAR, **light).model
    assert eigenmodes.longer_steps(coupled) < 2.0
    assert coupled.eigenmodes(24).size == 0
    assert eigenmodes.decoupled(np.array([[0.0, 1.0], [-1.0, -2.0]])) is None  # critical damping


def test_a_sweep_has_the_amplitudes_of_the_receptance() -> None:
    system, given = on(FAR), beam()
    sweep = saltus.frequency_sweep(
        system, [3.2, 3.8], periods=120, stop_early=False, max_period=1, **system.model.start()
    )
    for value, largest in zip(sweep.value.values, sweep.largest_x4.values.T, strict=True):
        dynamic = given["stiffness"] - value**2 * given["mass"] + 1j * value * given["damping"]
        assert np.abs(largest - abs(0.02 * np.linalg.inv(dynamic)[4, 4])).max() < 1e-9
