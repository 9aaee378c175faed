"""Models of a user's own: channels, side-dependent coefficients, several coordinates; numbers that
change compile nothing.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from saltus import OneContactModel
from saltus.errors import ParameterError, SaltusError
from saltus.flow import simulate
from saltus.flow.programs.compiled import _structures
from saltus.systems import Harmonic, Load, Model, System, VelocityReduction, WallOscillator
from saltus.systems.serial import MODELS, register
from saltus.taylor.cache import cache_directory


@dataclass(frozen=True, slots=True, kw_only=True)
class Bilinear(OneContactModel):
    """x'' + c_s x' + k_s x = wind + gust, with one spring and one damper on each side; it crosses x
    = 0 with v+ = e v-.
    """

    left: float
    right: float
    damping: float = 0.0

    coordinates: ClassVar[tuple[str, ...]] = ("x",)
    channels: ClassVar[tuple[str, ...]] = ("wind", "gust")

    def acceleration(self, t: Any, x: Any, velocity: Any, side: Any, load: Load) -> Any:
        stiffness = self.right * (1 + side) / 2 + self.left * (1 - side) / 2
        return load.wind(t) + load.gust(t) - self.damping * (2 - side) * velocity - stiffness * x


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair(Model):
    """Two equal masses on equal springs, coupled by a third: x'' = -k x - c (x - y) + force, y'' =
    -k y - c (y - x).
    """

    spring: float
    coupling: float

    coordinates: ClassVar[tuple[str, ...]] = ("x", "y")
    channels: ClassVar[tuple[str, ...]] = ("force",)

    def acceleration(self, t, position, velocity, side, load):
        x, y = position
        pull = self.coupling * (x - y)
        return -self.spring * x - pull + load.force(t), -self.spring * y + pull


FREE = System(model=Bilinear(left=4.0, right=1.0), load=Load(wind=0.0, gust=0.0))
PAIR = System(model=Pair(spring=1.0, coupling=0.3), load=Load(frequency=0.7, force=Harmonic(0.0)))


def test_free_motion_of_the_bilinear_oscillator_is_two_half_waves():
    for left, right, e in ((4.0, 1.0, 1.0), (9.0, 0.3, 0.7)):
        system = FREE.with_(
            {"model.left": left, "model.right": right, "impact": VelocityReduction(e)}
        )
        period = math.pi / math.sqrt(left) + math.pi / math.sqrt(right)
        motion = simulate(system, x=0.5, duration=5 * period)
        first = 0.5 * math.pi / math.sqrt(right)
        rights = first + period * np.arange(5)
        assert motion.impacts.time[::2] == pytest.approx(rights, abs=1e-11)
        assert motion.impacts.time[1::2] == pytest.approx(
            rights + math.pi / math.sqrt(left), abs=1e-11
        )
        speeds = 0.5 * math.sqrt(right) * e ** np.arange(10)
        assert np.abs(motion.impacts.velocity_before) == pytest.approx(speeds, rel=1e-12)
        assert motion.x == pytest.approx(0.5 * e**10, abs=1e-11)


def test_side_dependent_damping_and_two_loads_follow_the_closed_form_on_each_side():
    system = FREE.with_({"model.damping": 0.1, "load.wind": 0.2, "load.gust": 0.1})
    for x, side in ((0.6, 1), (-0.4, -1)):
        stiffness, damping = (1.0, 0.1) if side > 0 else (4.0, 0.3)
        rest, decay = 0.3 / stiffness, damping / 2
        omega = math.sqrt(stiffness - decay**2)
        t = np.linspace(0.0, 0.3, 7)
        a = x - rest
        expected = rest + np.exp(-decay * t) * a * (
            np.cos(omega * t) + decay / omega * np.sin(omega * t)
        )
        assert simulate(system, x=x, duration=0.3).at(t)[0] == pytest.approx(expected, abs=1e-13)


def test_coupled_oscillators_follow_their_modes():
    together, apart = 1.0, math.sqrt(1.6)  # frequencies of x + y and of x - y
    motion = simulate(PAIR, x=0.3, y=-0.1, velocity=(0.2, 0.4), duration=60.0, tol=1e-14)
    t = np.linspace(0, 60, 50)
    total = 0.2 * np.cos(together * t) + 0.6 * np.sin(together * t) / together
    difference = 0.4 * np.cos(apart * t) - 0.2 * np.sin(apart * t) / apart
    position, velocity = motion.at(t)
    assert position.shape == velocity.shape == (2, 50)
    assert position[0] == pytest.approx((total + difference) / 2, abs=1e-12)
    assert position[1] == pytest.approx((total - difference) / 2, abs=1e-12)
    assert (motion.x, motion.y) == pytest.approx(tuple(position[:, -1]), abs=1e-14)
    one_position, one_velocity = motion.at(1.0)
    assert one_position.shape == one_velocity.shape == (2,)


def test_driven_pair_reaches_over_its_first_period_what_the_modes_say():
    omega, amplitude = 0.7, 0.5
    system = PAIR.with_({"load.force.amplitude": amplitude})
    motion = simulate(system, x=0.0, y=0.0, velocity=(0.0, 0.0), periods=3)
    expected = []
    for squared in (1.0, 1.6):  # z'' + w^2 z = A sin(Omega t), from rest
        w = math.sqrt(squared)
        t = motion.time
        expected.append(
            amplitude / (squared - omega**2) * (math.sin(omega * t) - omega / w * math.sin(w * t))
        )
    assert motion.x == pytest.approx((expected[0] + expected[1]) / 2, abs=1e-12)
    assert motion.y == pytest.approx((expected[0] - expected[1]) / 2, abs=1e-12)


def test_numbers_that_change_neither_trace_nor_compile(tmp_path, monkeypatch):
    simulate(FREE, x=0.1, duration=0.1)
    known = set(_structures)
    # a folder of its own, as other workers write into the common one
    monkeypatch.setenv("SALTUS_CACHE_DIR", str(tmp_path))
    for i in range(5):
        changed = FREE.with_(
            {"model.left": 1 + i, "model.right": 0.5 + i, "load.wind": -i, "impact.e": 1 / (i + 1)}
        )
        simulate(changed, x=0.1, duration=0.1, tol=10.0 ** -(6 + 2 * i), time=float(i))
    assert set(_structures) == known
    assert not [path for path in cache_directory().rglob("*") if path.is_file()]


def test_whole_numbers_move_as_their_floats_do():
    @dataclass(frozen=True, kw_only=True)
    class Unchecked(Bilinear):
        pass

    ends = {
        simulate(
            System(model=Unchecked(left=left, right=right), load=Load(wind=0)), x=x, duration=t
        ).x
        for left, right, x, t in ((4, 1, 1, 3), (4.0, 1.0, 1.0, 3.0))
    }
    assert len(ends) == 1


def test_registered_model_is_read_back_from_its_file():
    register(Bilinear)
    try:
        system = FREE.with_({"model.left": 2.5})
        assert System.from_json(system.to_json()) == system
    finally:
        del MODELS["Bilinear"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Tabulated(Model):
    """x'' = - sum factors[n] x^(n + 1): the array is read while the model is traced."""

    factors: np.ndarray
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return sum(-float(f) * x ** (n + 1) for n, f in enumerate(self.factors))


def test_an_array_in_a_model_is_not_taken_from_another_one():
    from generated_functions import Generated

    from saltus.taylor import structure_key

    one, four = (System(model=Tabulated(factors=np.array([f]))) for f in (1.0, 4.0))
    assert structure_key(one) != structure_key(four)
    assert [Generated(s).coefficients(0.0, 0.5, 0.0, 3)[0, 2] for s in (one, four)] == [-0.25, -1.0]


@pytest.mark.parametrize(
    ("gap", "message"),
    [
        ("1 - x**2", "one contact point, not two stops"),
        # odd about the contact: 0 there and linear by its values
        ("(1 - x) - (1 - x)**3", "one contact point, not two stops"),
        ("np.sinh(1 - x)", "one contact point, not two stops"),
        ("1 - 0 * x", "must depend on the coordinate"),
        ("2 - x", "must be 0 at"),
    ],
)
def test_a_gap_that_does_not_fit_its_contact_is_refused(gap, message):
    class Stops(WallOscillator):
        def gap(self, x, side):
            return eval(gap, {"np": np}, {"x": x})

    with pytest.raises(SaltusError, match=message):
        simulate(System(model=Stops()), x=0.0, duration=1.0)


def test_a_gap_that_is_linear_in_other_words_is_the_same_gap():
    class Rewritten(WallOscillator):
        def gap(self, x, side):
            return ((self.wall + 1.0) ** 2 - (x + 1.0) * (self.wall + 1.0)) / (1.0 + self.wall)

    load, start = Load(frequency=1.0, force=Harmonic(0.8)), {"x": 0.2, "periods": 5}
    one, other = (
        simulate(System(model=cls(wall=0.5), load=load), **start)
        for cls in (WallOscillator, Rewritten)
    )
    assert len(one.impacts) > 3
    assert other.impacts.time == pytest.approx(one.impacts.time, abs=1e-9)


@dataclass(frozen=True)
class Wall(OneContactModel):
    """A wall at x = 0 whose reset is that of a passage."""

    coordinates = ("x",)
    sides = (1,)

    def acceleration(self, t, x, velocity, side, load):
        return -1.0 - x


class Sticky(Wall):
    def reset(self, t, velocity, side, load, impact):
        # a bounce that forgets to turn the sign
        return side, impact.velocity_after(self, t, velocity, side, side, load)


class Leading(Wall):
    def reset(self, t, velocity, side, load, impact):
        return 3 * side, -velocity


class Numbered(Wall):
    sides = (1, 2)


@pytest.mark.parametrize("make", [lambda: System(model=Wall()), lambda: register(Wall)])
def test_a_wall_without_a_reset_is_refused_before_it_moves(make):
    with pytest.raises(ParameterError, match="define reset"):
        make()
    assert "Wall" not in MODELS


def test_sides_that_no_contact_has_are_refused():
    with pytest.raises(ParameterError, match="sides must be"):
        System(model=Numbered())


@pytest.mark.parametrize("model", [Sticky(), Leading()])
def test_a_reset_that_leads_beyond_the_contact_is_refused_before_the_first_impact(model):
    with pytest.raises(
        SaltusError,
        match="beyond the contact" if isinstance(model, Sticky) else "leads from side 1 to side 3",
    ):
        simulate(System(model=model), x=1.0, duration=1e-3)
