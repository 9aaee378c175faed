"""The models with several contacts that come with saltus: the impact pair, and chains of cells."""

import collections
import math
import pickle
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus import CellChain, Contact, ContactModel, ImpactPair, NewtonImpact, TwoLayer, TwoStops
from saltus.checks import LIMITS
from saltus.errors import ParameterError
from saltus.flow import EventKind
from saltus.flow.contacts.complementarity import acting, by_exchange
from saltus.flow.programs import compiled
from saltus.systems import Harmonic, Load, System, VelocityReduction, energy_gain
from saltus.taylor.generated import llvm_text, object_code
from saltus.taylor.graph import is_long
from saltus.taylor.tracing import trace

COSINE = math.pi / 2  # the phase of a harmonic that makes it one
BETA80 = math.radians(80)


def test_the_impact_pair_follows_its_closed_form_with_two_impacts_a_period():
    """Impacts at W tau = phi + n pi, right and left in turn; between them the mass in the case
    moves with a constant speed V.

    With B = A / (k - W^2), w^2 = k and theta = pi w / W: on the way to the right z = B cos(W s +
    phi) + a cos(w s) + b sin(w s) and z + x = V (s - pi / (2 W)). Everything turns its sign after
    half a period. The impact gives the case 2 mu V: a (1 + cos theta) + b sin theta = 0 and b (1 +
    cos theta) - a sin theta = -2 mu V / w. x = -d at s = 0, and the restitution there, V - z' = e
    (V + 2 mu V + z'), give cos(phi) and sin(phi), whose squares add up to 1.
    """
    A, W, k, mu, e, d = 1.0, 0.8, 1.0, 0.2, 0.6, 1.5
    B, w, half = A / (k - W * W), math.sqrt(k), math.pi / W
    tangent = math.tan(w * half / 2)
    sine = -(1 + mu) * (1 - e) / ((1 + e) * B * W)  # sin phi = sine V, cos phi = d / B + cosine V
    cosine = (-half / 2 - mu * tangent / w) / B
    found = 0
    for V in np.roots([sine**2 + cosine**2, 2 * cosine * d / B, (d / B) ** 2 - 1.0]):
        if not (np.isreal(V) and V.real > 0):
            continue
        V = float(V.real)
        phi, a, b, s = (
            math.atan2(sine * V, d / B + cosine * V),
            mu * V * tangent / w,
            -mu * V / w,
            np.linspace(0, half, 300),
        )
        z = B * np.cos(W * s + phi) + a * np.cos(w * s) + b * np.sin(w * s)
        rate = -B * W * math.sin(phi) + b * w
        if not (np.abs(V * (s - half / 2) - z)[1:-1] < d).all():
            continue
        load = Load(frequency=W, force=Harmonic(amplitude=A, phase=COSINE))
        system = System(
            model=ImpactPair(mass_ratio=mu, stiffness=k, clearance=d),
            load=load,
            impact=NewtonImpact(e=e),
        )
        start = phi % (2 * math.pi) / W
        motion = saltus.simulate(
            system,
            z=z[0],
            x=-d,
            velocity=(rate, V - rate),
            time=start,
            duration=4.5 * half,
            tol=1e-14,
        )
        impacts = motion.events.of(EventKind.IMPACT)
        assert [event.contact for event in impacts] == ["right", "left", "right", "left"]
        for n, event in enumerate(impacts, 1):
            assert event.time - start == pytest.approx(n * half, abs=1e-10)
            np.testing.assert_allclose(
                event.velocity_after, np.array([rate, V - rate]) * (-1) ** n, rtol=0, atol=1e-10
            )
        np.testing.assert_allclose(motion.at(start + s[1:-1])[0][0], z[1:-1], rtol=0, atol=1e-10)
        found += 1
    assert found


def test_no_restitution_of_an_impact_pair_gains_energy():
    """Of the relative motion e^2 is left: T+ / T- = 1 - (1 - e^2) mu / (1 + mu) mu^-1 for the mass
    alone in motion.
    """
    for e, mu in ((0.0, 0.3), (0.5, 0.1), (1.0, 2.0)):
        gain = energy_gain(ImpactPair(mass_ratio=mu), NewtonImpact(e=e))
        assert gain["left"] == gain["right"] == pytest.approx(-(1 - e * e) / (1 + mu), abs=1e-14)


def test_stops_that_leave_no_room_are_refused():
    with pytest.raises(ParameterError, match="left must lie below right = 1, got 1"):
        TwoStops(left=1.0)


def chain(cells, *, impact=None, **numbers):
    numbers = {"beta0": BETA80, "coupling": 0.3, "mass_ratio": 0.5, "damping": 0.05} | numbers
    load = Load(frequency=1.1, vertical=-0.4, horizontal=Harmonic(amplitude=0.3))
    return System(
        model=CellChain(cells=cells, **numbers), load=load, impact=impact or NewtonImpact(e=0.4)
    )


def state(cells, seed=1):
    """One open layer in each cell, the other closed."""
    rng, theta = np.random.default_rng(seed), np.zeros(2 * cells)
    for cell in range(cells):
        upper = int(rng.integers(2))
        theta[2 * cell + upper] = (-1) ** upper * rng.uniform(0.05, 0.4)
    return theta


def follow(system, theta, duration=12.0, **more):
    start = dict(zip(system.model.coordinates, theta, strict=True))
    return saltus.simulate(
        system, **start, velocity=(0.0,) * len(theta), duration=duration, tol=1e-14, **more
    )


@pytest.mark.parametrize(
    ("cells", "impact"),
    [
        pytest.param(5, NewtonImpact(e=0.4), marks=pytest.mark.thorough),
        (3, NewtonImpact(e=0.2, transfer=0.5)),
        pytest.param(3, VelocityReduction(0.9), marks=pytest.mark.thorough),
    ],
)
def test_cells_without_coupling_move_as_each_by_itself(cells, impact):
    system, theta = chain(cells, coupling=0.0, impact=impact), state(cells)
    together, times = follow(system, theta), np.linspace(0.0, 12.0, 200)
    numbers = {"beta0": BETA80, "mass_ratio": 0.5, "damping": 0.05}
    alone = System(model=TwoLayer(**numbers), load=system.load, impact=impact)
    impacts = 0
    for cell in range(cells):
        own = saltus.simulate(
            alone, theta=tuple(theta[2 * cell : 2 * cell + 2]), duration=12.0, tol=1e-14
        )
        np.testing.assert_allclose(
            together.at(times)[0][2 * cell : 2 * cell + 2], own.at(times)[0], rtol=0, atol=1e-11
        )
        impacts += len(own.impacts)
    assert impacts > 3


def test_a_chain_keeps_its_energy_without_damping_and_with_lossless_impacts():
    """Kinetic energy, that of all springs, and that of a constant vertical load V = -0.5 on both
    masses of every cell.
    """
    load = Load(frequency=1.0, vertical=-0.5)
    model = CellChain(cells=4, beta0=BETA80, coupling=0.4, mass_ratio=0.7, stiffness_ratio=0.8)
    motion = follow(
        System(model=model, load=load, impact=NewtonImpact(e=1.0)),
        state(4, seed=2) + np.tile([0.02, -0.03], 4),
        10.0,
    )
    theta, velocity = motion.at(np.linspace(0.0, 10.0, 300))
    height = sum(np.sin(BETA80 + theta[i]) + np.sin(BETA80 - theta[i + 1]) for i in range(0, 8, 2))
    energy = (
        model.kinetic_energy(0.0, theta, velocity, 1, load)
        + model.potential_energy(theta)
        + 0.5 * height
    )
    assert len(motion.impacts) > 10
    np.testing.assert_allclose(energy, energy[0], rtol=0, atol=1e-11)


@pytest.mark.parametrize("cells", [2, pytest.param(4, marks=pytest.mark.thorough)])
def test_a_chain_looks_the_same_from_its_other_end(cells):
    system, theta = chain(cells), state(cells, seed=3)
    ahead = follow(system, theta)
    back = follow(system, theta.reshape(cells, 2)[::-1].ravel())
    assert len(ahead.impacts) > 2
    np.testing.assert_allclose(
        np.reshape(ahead.position, (cells, 2)),
        np.reshape(back.position, (cells, 2))[::-1],
        atol=1e-10,
    )


def test_the_springs_of_a_chain_give_the_gradient_of_their_energy():
    model, theta, load = CellChain(cells=3, beta0=BETA80, coupling=0.7), state(3) + 0.01, Load()
    without = CellChain(cells=3, beta0=BETA80, coupling=0.0)
    still = np.zeros(6)
    force = np.array(model.force(0.0, theta, still, load)) - np.array(
        without.force(0.0, theta, still, load)
    )

    def energy(x):
        return model.potential_energy(x) - without.potential_energy(x)

    step = 1e-6 * np.eye(6)
    slope = [(energy(theta + h) - energy(theta - h)) / 2e-6 for h in step]
    np.testing.assert_allclose(force, -np.array(slope), atol=1e-9)


def test_a_chain_with_symmetric_starts_moves_as_one_cell():
    """Equal cells pull on each other with nothing."""
    system = chain(2)
    motion = follow(system, [0.2, 0.0, 0.2, 0.0])
    one = System(
        model=TwoLayer(beta0=BETA80, mass_ratio=0.5, damping=0.05),
        load=system.load,
        impact=system.impact,
    )
    own = saltus.simulate(one, theta=(0.2, 0.0), duration=12.0, tol=1e-14)
    np.testing.assert_allclose(motion.position, 2 * list(own.position), atol=1e-11)


def test_eight_contacts_have_a_bit_each_in_datasets():
    system, theta = chain(4), state(4)
    motion = follow(system, theta, duration=5.0)
    closed = motion.to_xarray().closed_contacts
    assert closed.flag_masks[-1] == 128
    assert closed.values[0] == sum(1 << i for i, x in enumerate(theta) if x == 0.0)
    starts = {
        name: np.array([x, x]) for name, x in zip(system.model.coordinates, theta, strict=True)
    }
    many = saltus.simulate_many(system, **starts, velocity=(np.zeros(2),) * 8, duration=5.0)
    assert many.closed_contacts.values.tolist() == [motion.side - 1] * 2
    for name, x in zip(system.model.coordinates, motion.position, strict=True):
        np.testing.assert_allclose(many[name].values.ravel(), x, rtol=0, atol=1e-9)


class ManyContacts(ContactModel):
    """More contacts than a whole number has bits."""

    coordinates = tuple(f"q{i}" for i in range(65))
    contacts = tuple(Contact(name=name, coordinate=name) for name in coordinates)

    def force(self, t, q, velocity, load):
        return q


def test_more_contacts_than_can_be_noted_are_refused():
    with pytest.raises(
        ParameterError, match="ManyContacts has 65 contacts, and at most 64 can be followed"
    ):
        System(model=ManyContacts())


def test_chains_are_read_from_files_and_survive_them():
    system = chain(11)
    assert System.from_toml(system.to_toml()) == System.from_json(system.to_json()) == system
    assert pickle.loads(pickle.dumps(system)) == system
    assert system.parameters["model.coupling"] == 0.3


def test_the_number_of_cells_is_part_of_the_structure():
    system = chain(3)
    assert "model.cells" not in system.parameters
    assert len(system.with_({"model.cells": 5}).model.contacts) == 10
    with pytest.raises(
        ParameterError, match=r"model\.cells is not a number, so it cannot be varied"
    ):
        saltus.simulate_many(system, parameters={"model.cells": [2.0, 3.0]}, duration=1.0)
    for cells in (0, 33, 2.5):
        with pytest.raises(ParameterError, match="cells must"):
            CellChain(beta0=1.4, cells=cells)


def test_complementarity_problems_are_solved_by_exchanges_as_by_trying_all_sets():
    """Positive definite problems with 2 to 9 rows, whose only solution is the set that violates
    nothing.
    """
    rng = np.random.default_rng(3)
    for size in range(2, 10):
        factor = rng.normal(size=(size, size))
        matrix, right = factor @ factor.T + 0.1 * np.eye(size), rng.normal(size=size)
        block, z, tried = np.zeros((size, 2 * size + 1)), np.zeros(size), np.zeros(size)
        solved, bits = by_exchange(matrix, right, size, 1e-12, block, z)
        found = [
            b
            for b in range(1 << size)
            if acting(matrix, right, size, b, block, tried) and solves(matrix, right, tried)
        ]
        assert solved
        assert found == [bits]
        assert ((z > 0.0) == [bool(bits >> i & 1) for i in range(size)]).all()


def solves(matrix, right, z):
    return (z > -1e-12).all() and (right + matrix @ z > -1e-10).all()


@pytest.mark.parametrize("cells", [6, pytest.param(32, marks=pytest.mark.thorough)])
def test_cells_that_move_alike_move_as_one_for_any_number_of_them(cells):
    """All contacts close at one instant, and rest together: more contacts than are tried, and as
    many as a number has bits.
    """
    load = Load(vertical=-0.4)
    numbers = {"beta0": BETA80, "mass_ratio": 0.5, "damping": 0.05}
    one = System(model=TwoLayer(**numbers), load=load, impact=NewtonImpact(e=0.2))
    many = System(
        model=CellChain(cells=cells, coupling=0.3, **numbers), load=load, impact=NewtonImpact(e=0.2)
    )
    alone, times = saltus.simulate(one, theta=(0.2, -0.1), duration=8.0), np.linspace(0.0, 8.0, 50)
    start = dict(zip(many.model.coordinates, [0.2, -0.1] * cells, strict=True))
    motion = saltus.simulate(many, **start, velocity=(0.0,) * 2 * cells, duration=8.0)
    assert len(alone.impacts) > 3
    closings = collections.Counter(motion.impacts.time.tolist())
    assert max(closings.values()) == cells
    for cell in range(cells):
        np.testing.assert_allclose(
            motion.at(times)[0][2 * cell : 2 * cell + 2], alone.at(times)[0], rtol=0, atol=1e-8
        )


def test_equations_of_many_coordinates_move_alike_without_the_passes_of_llvm(monkeypatch):
    """The order of operations stays, and so the motion up to rounding; what is compiled so depends
    on the coordinates.
    """
    assert [is_long(trace(chain(cells))) for cells in (3, 4, 5)] == [False, False, True]
    assert [is_long(trace(chain(cells), sensitivities=())) for cells in (2, 4, 5)] == [
        False,
        False,
        True,
    ]
    theta, made, codes = state(2), [], set()
    for most in (LIMITS.optimised, 0):
        monkeypatch.setattr("saltus.taylor.graph.LIMITS", replace(LIMITS, optimised=most))
        monkeypatch.setattr(compiled, "_structures", {})
        system = chain(2)  # another one, as a system remembers its code
        assert is_long(trace(system)) == (most == 0)
        made.append(follow(system, theta, duration=6.0))
        codes.add(*(structure.functions for _, structure in compiled._structures.values()))
    assert len(codes) == 2
    assert len(made[0].impacts) == len(made[1].impacts) > 2
    np.testing.assert_allclose(made[0].at(6.0), made[1].at(6.0), rtol=0, atol=1e-13)


@pytest.mark.thorough
def test_equations_of_64_coordinates_compile_in_less_than_a_minute():
    system = chain(32)
    began = time.process_time()
    traced = trace(system)
    assert object_code(llvm_text(compiled.structure_functions(traced)), is_long(traced))
    assert time.process_time() - began < 60.0


def test_derivatives_of_each_further_cell_add_the_same_text():
    """Their columns are one loop, and matrices are written for their entries alone: the code grows
    as the number of cells.
    """
    length = {}
    for cells in (2, 3, 4):
        functions = compiled.structure_functions(
            trace(chain(cells), sensitivities=("model.coupling",))
        )
        length[cells] = np.array([len(llvm_text([each])) for each in functions])
    first, second = length[3] - length[2], length[4] - length[3]
    # one is 2 % longer where numbers get a digit more
    np.testing.assert_allclose(second, first, rtol=0.02, atol=200)


@pytest.mark.parametrize(
    ("cells", "impact"),
    [
        (2, NewtonImpact(e=0.4)),
        pytest.param(2, VelocityReduction(0.9), marks=pytest.mark.thorough),
        (4, NewtonImpact(e=0.0, transfer=0.3)),
    ],
)
def test_chains_in_lanes_are_the_scalar_motions(cells, impact):
    """Impacts of one contact while others are closed or open, in lanes and one by one: to 1e-9 over
    two forcing periods.
    """
    system, starts = chain(cells, impact=impact), [state(cells, seed=seed) for seed in range(20)]
    names = system.model.coordinates
    columns = dict(zip(names, np.transpose(starts), strict=True))
    many = saltus.simulate_many(
        system, **columns, velocity=(0.0,) * len(columns), duration=6.0, tol=1e-14
    )
    for i, theta in enumerate(starts):
        motion = follow(system, theta, duration=6.0)
        there = [float(many[name][i]) for name in names]
        np.testing.assert_allclose(there, motion.position, rtol=0, atol=1e-9)


def test_an_impact_pair_in_lanes_moves_like_each_by_itself():
    system = System(
        model=ImpactPair(),
        load=Load(frequency=1.0, force=Harmonic(amplitude=0.5)),
        impact=NewtonImpact(e=0.6),
    )
    speeds = np.linspace(-1.0, 1.0, 21)
    many = saltus.simulate_many(
        system, z=0.1, x=0.2, velocity=(speeds, 0.5), duration=15.0, tol=1e-13
    )
    for i, speed in enumerate(speeds):
        motion = saltus.simulate(
            system, z=0.1, x=0.2, velocity=(speed, 0.5), duration=15.0, tol=1e-13
        )
        assert int(many.impact_count[i]) == len(motion.impacts) > 0
        np.testing.assert_allclose(
            [float(many.z[i]), float(many.x[i])], motion.position, rtol=0, atol=1e-9
        )


@dataclass(frozen=True, kw_only=True)
class BallsInARoom(ContactModel):
    """32 balls that fall, x_i'' = -1, below a ceiling at 9 and over a floor, with the floors of the
    last two balls last.
    """

    coordinates: ClassVar[tuple[str, ...]] = tuple(f"x{i}" for i in range(32))
    contacts: ClassVar[tuple[Contact, ...]] = (
        *(
            Contact(name=f"ceiling{i}", coordinate=f"x{i}", position=9.0, sign=-1)
            for i in range(32)
        ),
        *(Contact(name=f"floor{i}", coordinate=f"x{i}") for i in range(32)),
    )

    def force(self, t, theta, velocity, load):
        return (-1.0,) * 32


@pytest.mark.thorough
def test_the_last_of_64_contacts_closes_alone_and_with_the_one_before():
    """A ball from h hits at the time sqrt(2 h), and again after e times twice that; its bit is the
    sign of an integer.
    """
    system = System(model=BallsInARoom(), impact=NewtonImpact(e=0.5))
    high = {f"x{i}": 8.0 for i in range(30)}
    fall, lower = math.sqrt(2.0 * 0.7), math.sqrt(2.0 * 0.4)
    together = saltus.simulate(system, **high, x30=0.7, x31=0.7, duration=2.2 * fall)
    assert [event.contact for event in together.events.of(EventKind.IMPACT)] == [
        "floor30",
        "floor31",
    ] * 2
    np.testing.assert_allclose(
        together.impacts.time, [fall, fall, 2.0 * fall, 2.0 * fall], rtol=0, atol=1e-13
    )
    apart = saltus.simulate(system, **high, x30=0.7, x31=0.4, duration=1.7 * fall)
    assert [event.contact for event in apart.events.of(EventKind.IMPACT)] == [
        "floor31",
        "floor30",
        "floor31",
    ]
    np.testing.assert_allclose(apart.impacts.time, [lower, fall, 2.0 * lower], rtol=0, atol=1e-13)
