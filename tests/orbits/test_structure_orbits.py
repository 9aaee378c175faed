"""Orbits and branches of structures that are given by matrices, beside harmonic balance, closed
forms and an own integration.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve, minimize_scalar

import saltus
from saltus.orbits.contract.sampled_motion import SampledMotion
from saltus.orbits.equations.whole_motion import WholeMotionEquations

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 1.0]])
SQUARES, SHAPES = np.linalg.eigh(STIFFNESS)
FORCE, SPRING, HARMONICS = 0.02, 0.3, 15
WAVES = np.exp(
    1j * np.outer(np.arange(HARMONICS + 1), np.linspace(0.0, 2.0 * np.pi, 1024, endpoint=False))
)


def receptance(frequency):
    """The displacement of the second mass per force on it, without the stop."""
    of = np.asarray(frequency)[..., None]
    return np.sum(SHAPES[1] ** 2 / (SQUARES * (1.0 + 0.05j * of) - of**2), axis=-1)


def amplitude(frequency: float) -> float:
    """How far the second mass moves without the stop."""
    return float(FORCE * abs(receptance(frequency)))


def unbalanced(unknowns, size):
    """Harmonic balance of the second mass on a spring beyond 1, with a first harmonic of `size`;
    the last unknown is the frequency."""
    z, frequency = unknowns[:-1], unknowns[-1]
    x, k = z[: HARMONICS + 1] + 1j * np.append(0.0, z[HARMONICS + 1 :]), np.arange(HARMONICS + 1)
    second = (x @ WAVES).real
    pressed = np.fft.rfft(SPRING * np.maximum(second - 1.0, 0.0), norm="forward")[: HARMONICS + 1]
    error = x - receptance(frequency * k) * (FORCE * (k == 1) - np.where(k, 2, 1) * pressed)
    return np.append(np.append(error.real, error.imag[1:]), abs(x[1]) - size)


def balanced(size: float, near: np.ndarray) -> np.ndarray:
    """The harmonics and the frequency at which the first harmonic has this size."""
    found, _, success, _ = fsolve(unbalanced, near, args=(size,), xtol=1e-11, full_output=True)
    assert success == 1
    return found


@pytest.fixture(scope="module")
def soft() -> saltus.Branch:
    stop = saltus.Surface(name="stop", coordinate=1, position=1.0, stiffness=SPRING)
    pair = saltus.Structure(
        mass=np.eye(2),
        damping=0.05 * STIFFNESS,
        stiffness=STIFFNESS,
        surfaces=[stop],
        forces={"f": 1},
    )
    load = saltus.Load(frequency=0.5, f=saltus.Harmonic(FORCE, phase=np.pi / 2))
    system = saltus.System(model=pair, load=load)
    return saltus.continue_orbit(
        saltus.find_orbit(system, **pair.start()), "load.frequency", (0.45, 0.85)
    )


def test_an_orbit_is_as_far_from_a_soft_stop_as_its_amplitude_says(soft: saltus.Branch) -> None:
    free = [point for point in soft.points if not point.orbit.motion().events]
    assert len(free) > 20
    for point in free[::4]:
        units = point.orbit.equations.natural
        distance, what = SampledMotion.of(point.orbit.followed).nearest_touch(units)
        assert what == "gap"
        assert distance * units.length == pytest.approx(1.0 - amplitude(point.parameter), abs=1e-11)


def test_a_branch_meets_a_soft_stop_where_the_linear_amplitude_does_and_folds_where_harmonic_balance_does(
    soft: saltus.Branch,
) -> None:
    """The touch of the stop is no event of the branch, as its force is continuous."""
    assert [str(point.kind) for point in soft.special] == ["LP", "LP"]
    assert not soft.missed
    assert all(str(end).startswith("bound") for end in soft.ends)
    upper, lower = (point.parameter for point in soft.special)
    meets = brentq(lambda f: amplitude(f) - 1.0, 0.60, 0.618, xtol=1e-15)
    leaves = brentq(lambda f: amplitude(f) - 1.0, 0.619, 0.63, xtol=1e-15)
    # on the way to the upper fold the orbits touch the stop where the linear amplitude reaches it
    touching = [point.parameter for point in soft.points if point.orbit.motion().events]
    free = [point.parameter for point in soft.points if not point.orbit.motion().events]
    assert meets < min(touching)
    assert not any(meets < parameter < leaves for parameter in free)
    linear = np.zeros(2 * HARMONICS + 2)
    linear[-1], second = leaves, FORCE * receptance(leaves)
    linear[1], linear[HARMONICS + 1] = second.real, second.imag
    # from the linear motion on, with a larger first harmonic: through the lower fold to the upper
    # one
    known = [linear]

    def at(size: float, sign: float) -> float:
        known.append(
            balanced(size, min(known, key=lambda z: abs(np.hypot(z[1], z[HARMONICS + 1]) - size)))
        )
        return sign * known[-1][-1]

    for fold, sign, around in ((lower, 1.0, (1.001, 1.05)), (upper, -1.0, (1.15, 1.2))):
        for size in np.linspace(1.0, around[0], 3):
            at(size, sign)
        found = minimize_scalar(
            at, bounds=around, args=(sign,), method="bounded", options={"xatol": 1e-4}
        )
        assert sign * found.fun == pytest.approx(fold, abs=1e-6)


def test_orbits_of_many_coordinates_are_approached_without_derivatives(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Derivatives take as long as so many motions as there are unknowns: most orbits of a branch
    need them once.
    """
    asked = []
    derived = WholeMotionEquations._evaluated
    monkeypatch.setattr(
        WholeMotionEquations, "_evaluated", lambda *given: asked.append(0) or derived(*given)
    )
    stiffness = 2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1)
    stop = saltus.Surface(name="stop", coordinate=4, position=0.1, stiffness=0.3)
    chain = saltus.Structure(
        mass=np.eye(5),
        damping=0.1 * stiffness,
        stiffness=stiffness,
        surfaces=[stop],
        forces={"f": 0},
    )
    system = saltus.System(model=chain, load=saltus.Load(frequency=0.51, f=saltus.Harmonic(0.03)))
    orbit = saltus.find_orbit(system, **chain.start())
    assert len(orbit.motion().events) == 2
    asked.clear()
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.505, 0.52))
    assert len(asked) < 1.5 * len(branch.points)
    for point in branch.points[::8]:
        assert point.residual < 1e-13
        assert point.orbit.defect < 1e-12
        beside = point.place + 1e-3
        assert point.curve.residual(beside) == pytest.approx(
            point.curve.evaluate(beside, True).residual, abs=1e-12
        )


def test_a_sweep_has_the_extrema_of_each_coordinate() -> None:
    far = saltus.Contact(name="far", coordinate=1, position=50.0, sign=-1)
    pair = saltus.Structure(
        mass=np.eye(2),
        damping=0.05 * STIFFNESS,
        stiffness=STIFFNESS,
        contacts=[far],
        forces={"f": 1},
    )
    system = saltus.System(model=pair, load=saltus.Load(frequency=0.5, f=saltus.Harmonic(FORCE)))
    sweep = saltus.frequency_sweep(system, [0.5, 0.55], x1=0.0, mode_1=0.0)
    held = abs(np.linalg.solve(pair.displacements(np.eye(2)), np.linalg.solve(
        STIFFNESS * (1.0 + 0.05j * 0.5) - 0.25 * np.eye(2), [0.0, FORCE]
    )))  # fmt: skip
    assert held == pytest.approx([amplitude(0.5), held[1]], rel=1e-12)
    assert held[1] < 0.7 * held[0]
    for name, expected in zip(pair.coordinates, held, strict=True):
        for way in ("up", "down"):
            at = sweep.sel(direction=way, value=0.5)
            assert float(at[f"largest_{name}"]) == pytest.approx(expected, rel=1e-6)
            assert float(at[f"smallest_{name}"]) == pytest.approx(-expected, rel=1e-6)
    assert float(sweep.amplitude[0, 0]) == pytest.approx(amplitude(0.5), rel=1e-6)
    assert sweep.amplitude.attrs["long_name"] == "max abs(x1) in a period"
    short = saltus.frequency_sweep(system, [0.5, 0.55], periods=3, x1=0.0, mode_1=0.0)
    assert (short.outcome == "undecided").all()  # three periods are too few


CHAIN = 2.0 * np.eye(10) - np.eye(10, k=1) - np.eye(10, k=-1)
GAP, LOSS, PUSH = 0.2, 0.6, 0.05


def impacting_chain(frequency: float) -> saltus.System:
    """Ten masses in a row, of which the last one has a hard stop."""
    stop = saltus.Contact(name="stop", coordinate=9, position=GAP, sign=-1)
    chain = saltus.Structure(
        mass=np.eye(10), damping=0.05 * CHAIN, stiffness=CHAIN, contacts=[stop], forces={"f": 0}
    )
    load = saltus.Load(frequency=frequency, f=saltus.Harmonic(PUSH))
    return saltus.System(model=chain, load=load, impact=saltus.NewtonImpact(e=LOSS))


def monodromy(orbit: saltus.PeriodicOrbit) -> np.ndarray:
    """The derivatives of the displacements and velocities over a period, by matrix exponentials
    between the impacts and

        S = R + (f+ - R f-) n' / (n' f-)

    at each of them, with the rates f of the state before and after, the reflection R and the
    direction n of the stop.
    """
    start, chain, frequency = orbit.start(), orbit.system.model, orbit.frequency
    between = np.block([[np.zeros((10, 10)), np.eye(10)], [-CHAIN, -0.05 * CHAIN]])
    pushed = np.zeros((22, 22))  # and sin and cos of the load
    pushed[:20, :20], pushed[10, 20], pushed[20, 21], pushed[21, 20] = (
        between,
        PUSH,
        frequency,
        -frequency,
    )
    names, time = chain.coordinates, start.get("time", 0.0)
    place, rates = (
        chain.displacements(x)
        for x in ([start[name] for name in names], np.array(start["velocity"]))
    )
    state = np.concatenate([place, rates, [np.sin(frequency * time), np.cos(frequency * time)]])
    end, found, reflection = time + orbit.duration, np.eye(20), np.diag([1.0] * 19 + [-LOSS])
    for impact in [*(event.time for event in orbit.motion().events), end]:
        state, found, time = (
            expm((impact - time) * pushed) @ state,
            expm((impact - time) * between) @ found,
            impact,
        )
        if impact < end:
            assert state[9] == pytest.approx(GAP, abs=1e-9)
            before = (pushed @ state)[:20]
            state[:20] = reflection @ state[:20]
            jump = np.outer((pushed @ state)[:20] - reflection @ before, np.eye(20)[9]) / before[9]
            found = (reflection + jump) @ found
    return found


@pytest.mark.thorough
def test_special_points_of_ten_masses_are_those_of_their_monodromy_by_matrix_exponentials() -> None:
    system = impacting_chain(0.282)
    orbit = saltus.find_orbit(system, **system.model.start())
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.281, 0.2828))
    apart = {
        "LP": lambda values: np.abs(values - 1.0).min(),
        "NS": lambda values: np.abs(np.abs(values[np.abs(values.imag) > 1e-3]) - 1.0).min(),
    }
    assert {"LP", "NS", "GR"} <= {str(point.kind) for point in branch.special}
    for point in branch.special:
        if str(point.kind) in apart:
            assert apart[str(point.kind)](np.linalg.eigvals(monodromy(point.orbit))) < 1e-6
    # at a grazing they are infinite
    regular = [point for point in branch.points if np.isfinite(point.orbit.multipliers).all()]
    for point in regular[::10]:
        expected = np.linalg.eigvals(monodromy(point.orbit))
        assert abs(point.orbit.multipliers[0]) == pytest.approx(np.abs(expected).max(), rel=1e-6)
