"""A call of `simulate` does what depends on its start alone: what follows from the system is kept
with it.

Work is counted in calls of functions, which are the same on every machine.
"""

import math
import pickle
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from shared_systems import forced

from saltus import (
    Harmonic,
    Load,
    Model,
    NewtonImpact,
    ParameterError,
    System,
    TwoLayer,
    WallOscillator,
    simulate,
)

LAYERS = System(
    model=TwoLayer(beta0=1.4, damping=0.1, mass_ratio=0.2),
    load=Load(frequency=1.0, vertical=-0.5, horizontal=Harmonic(amplitude=0.4)),
    impact=NewtonImpact(e=0.5),
)
CASES = {
    "one contact": (forced(), {"theta": 0.3}, 65),
    "two layers": (LAYERS, {"theta_1": 0.1, "theta_2": -0.05}, 125),
}
stiffness = 1.0


def calls(function):
    """The functions of Python that are called, by their names."""
    names = []
    sys.setprofile(
        lambda frame, event, _: names.append(frame.f_code.co_qualname) if event == "call" else None
    )
    try:
        function()
    finally:
        sys.setprofile(None)
    return names


@pytest.mark.parametrize("name", CASES)
def test_a_second_motion_of_a_system_checks_and_traces_nothing_of_it(name):
    system, start, most = CASES[name]
    simulate(system, periods=1, **start)
    again = calls(lambda: simulate(system, periods=1, **start))
    assert not {
        "trace",
        "children",
        "numbers",
        "record_table",
        "Structure.prepare",
        "_check_class",
        "energy_gain",
    } & {*again}
    assert len(again) < most


def test_arguments_are_checked_whenever_they_are_others():
    system, margins = forced(), ["kinematic_limit"]
    simulate(system, theta=0.3, periods=1, stop_at=margins)
    margins.append("no_margin")
    with pytest.raises(ParameterError, match="no_margin"):
        simulate(system, theta=0.3, periods=1, stop_at=margins)
    for name, wrong in {"periods": True, "tol": 1.0, "time": math.nan, "side": 2}.items():
        with pytest.raises(ParameterError, match=name):
            simulate(system, theta=0.3, **{"periods": 1, name: wrong})
    assert (
        simulate(system, theta=0.3, periods=1).time
        == simulate(system, theta=0.3, periods=1, time=0.0).time
        != 0.0
    )


@pytest.mark.parametrize("dense", [True, False])
def test_a_motion_is_its_own_whatever_is_simulated_next(dense):
    first, others = (simulate(forced(), theta=0.3, periods=3, dense=dense) for _ in range(2))
    simulate(forced(), theta=0.5, periods=3, dense=dense)
    # its buffers are filled several times
    long = simulate(forced(), theta=0.3, periods=400, dense=dense)
    assert len(first.events) > 0
    np.testing.assert_array_equal(first.events.times, others.events.times)
    np.testing.assert_array_equal(long.events.times[: len(first.events)], first.events.times)
    assert (np.diff(long.events.times) > 0).all()
    if dense:
        times = np.linspace(0.0, first.time, 50)
        np.testing.assert_array_equal(first.at(times[:-1]), long.at(times[:-1]))


def test_impacts_and_margins_are_made_when_they_are_read():
    motion = simulate(forced(), theta=0.3, periods=5)
    assert not {"impacts", "validity"} & vars(motion).keys()
    assert len(motion.impacts) == sum(event.kind == "impact" for event in motion.events) > 0
    assert motion.impacts is motion.impacts


def test_what_is_kept_with_a_system_is_no_part_of_it():
    system = forced()
    before = pickle.dumps(system)
    simulate(system, theta=0.3, periods=1)
    assert pickle.dumps(system) == before
    assert system == pickle.loads(before)
    twin = system.with_({"load.horizontal.amplitude": 0.7})
    one, other = (
        simulate(s, theta=0.3, periods=3).final_state
        for s in (twin, forced().with_({"load.horizontal.amplitude": 0.7}))
    )
    assert np.array_equal(one, other)
    assert not np.array_equal(one, simulate(system, theta=0.3, periods=3).final_state)


def test_threads_share_a_system_and_not_what_the_kernel_writes():
    starts = [{"theta_1": 0.1 + 0.01 * i, "theta_2": -0.05} for i in range(8)]
    alone = [simulate(LAYERS, periods=20, **start).final_state for start in starts]
    with ThreadPoolExecutor(4) as pool:
        together = list(
            pool.map(lambda start: simulate(LAYERS, periods=20, **start).final_state, starts)
        )
    assert np.array_equal(alone, together)


STARTS = [
    (0.3, 0.0),
    (0.3, -0.4),
    (-0.2, 0.1),
    (0.0, 0.2),
    (0.0, 0.0),
    (1e-9, 0.0),
    (7.0, 0.0),
    (0.3, 0),
]
SYSTEMS = {
    "lossless": (forced(), {}),
    "comes to rest": (forced(H=0.1, e=0.5), {}),
    "ends at a limit": (forced(), {"stop_at": ("kinematic_limit",)}),
    "without a load": (System(model=WallOscillator(wall=10.0, damping=0.1), load=Load()), {}),
    "without a contact": None,
}


@pytest.mark.filterwarnings("ignore:.*radians:UserWarning")
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_motion_that_is_asked_for_again_is_the_same(name):
    """The third motion of a system from any start takes a shorter way through Python."""
    system, more = SYSTEMS[name] or (System(model=Global()), {})
    coordinate = system.model.coordinates[0]
    more = more | ({"periods": 7} if system.load.period else {"duration": 40.0})

    def motion(start, whose):
        return simulate(whose, **{coordinate: start[0]}, velocity=start[1], dense=False, **more)

    for start in [*STARTS, *STARTS]:
        first, again = motion(start, system.with_()), motion(start, system)
        one, other = (
            {key: x for key, x in vars(m).items() if key not in ("system", "events")}
            for m in (first, again)
        )
        assert one == other
        assert len(first.events) == len(again.events)
        assert all(a == b for a, b in zip(first.events, again.events, strict=True))
    for start in STARTS[:4]:
        longer = "MotionRequest.__init__" in calls(lambda start=start: motion(start, system))
        found = motion(start, system)
        # more events than the buffers of one call hold take the longer way too
        assert longer == (found.limit is not None or len(found.events) > 150)


def test_what_is_wrong_is_refused_however_often_a_system_was_followed():
    system = forced()
    for _ in range(4):
        simulate(system, theta=0.3, periods=1, dense=False)
    for wrong, word in (
        ({"theta": math.nan}, "theta"),
        ({"tehta": 0.3}, "theta"),
        ({"theta": 0.3, "x": 1.0}, "'x'"),
    ):
        with pytest.raises(ParameterError, match=word):
            simulate(system, periods=1, dense=False, **wrong)
    with pytest.raises(ParameterError, match="velocity"):
        simulate(system, theta=0.3, velocity=math.inf, periods=1, dense=False)
    wall = System(model=WallOscillator(), load=Load())
    for _ in range(4):
        simulate(wall, x=-0.5, duration=1.0, dense=False)
    with pytest.raises(ParameterError, match="beyond the contact"):
        simulate(wall, x=9.0, duration=1.0, dense=False)


@dataclass(frozen=True, kw_only=True)
class Global(Model):
    """x'' = - stiffness x, with the number of this module."""

    damping: float = 0.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -stiffness * x - self.damping * velocity


@dataclass(kw_only=True)
class Changeable(Model):
    """x'' = - stiffness x, whose number can be changed."""

    stiffness: float = 1.0
    coordinates: ClassVar[tuple[str, ...]] = ("x",)

    def acceleration(self, t, x, velocity, side, load):
        return -self.stiffness * x


def test_a_number_that_a_model_reads_from_its_module_is_read_at_every_call(monkeypatch):
    system = System(model=Global())
    assert simulate(system, x=1.0, duration=1.0).x == pytest.approx(np.cos(1.0), abs=1e-12)
    monkeypatch.setattr(sys.modules[__name__], "stiffness", 4.0)
    assert simulate(system, x=1.0, duration=1.0).x == pytest.approx(np.cos(2.0), abs=1e-12)
    for _ in range(4):
        simulate(system, x=1.0, duration=1.0, dense=False)
    monkeypatch.setattr(sys.modules[__name__], "stiffness", 1.0)
    assert simulate(system, x=1.0, duration=1.0, dense=False).x == pytest.approx(
        np.cos(1.0), abs=1e-12
    )


def test_nothing_is_kept_of_a_system_that_can_change():
    system = System(model=Changeable())
    assert simulate(system, x=1.0, duration=1.0).x == pytest.approx(np.cos(1.0), abs=1e-12)
    system.model.stiffness = 4.0
    assert simulate(system, x=1.0, duration=1.0).x == pytest.approx(np.cos(2.0), abs=1e-12)


def test_further_changes_of_the_load_alone_check_no_model_again():
    LAYERS.with_({"load.horizontal.amplitude": 0.2})
    made = calls(lambda: LAYERS.with_({"load.horizontal.amplitude": 0.3}))
    assert "check_contact_model" not in made
    assert "check_contact_model" in calls(lambda: LAYERS.with_({"model.mass_ratio": 0.3}))
