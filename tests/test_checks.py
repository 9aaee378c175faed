"""Refusals that many functions share name the function, the argument, and what would be right."""

import inspect
import math
import pickle
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction

import numpy as np
import pytest

import saltus
from saltus import checks
from saltus.checks import check_kind, check_memory, check_work, free_memory
from saltus.errors import ParameterError, SaltusError, near
from saltus.public_functions import answered, checked_by


@checked_by(lambda **arguments: None)
def searched(system, *, window=None, starts=8):
    return starts


@pytest.mark.parametrize(
    ("given", "named", "sentence"),
    [
        ((1,), {"windw": 2}, r"searched\(\) has no argument 'windw'; did you mean 'window'\?$"),
        ((1,), {"region": 2}, r"searched\(\) has no argument 'region'; known here: starts, system, window$"),
        ((), {}, r"searched\(\) missing a required argument: 'system'$"),
        ((1, 2), {}, r"searched\(\) too many positional arguments$"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_with_the_name_of_the_function(given, named, sentence):
    with pytest.raises(ParameterError, match=sentence):
        searched(*given, **named)


def test_an_object_of_another_kind_is_refused_with_the_function_that_gives_the_right_one():
    check_kind("orbit", 1.0, int, float)
    with pytest.raises(ParameterError, match=r"^orbit must be an int, as find_orbit gives it, got 'x'$") as refusal:
        check_kind("orbit", "x", int, float, source="find_orbit")
    assert refusal.value.parameter == "orbit"


@pytest.mark.parametrize(
    ("function", "more", "name"),
    [
        (saltus.continue_orbit, ("load.frequency", (0.2, 3.0)), "orbit"),
        (saltus.continue_special, ("load.vertical",), "special"),
        (saltus.switch_branch, ((0.2, 3.0),), "special"),
        (saltus.doubling_cascade, ((0.2, 3.0),), "first"),
        (saltus.stable_manifold, (), "orbit"),
    ],
)
def test_what_is_no_orbit_or_special_point_is_refused(function, more, name):
    with pytest.raises(ParameterError, match=f"^{name} must be a .*gives it, got 3$"):
        function(3, *more)


@pytest.mark.parametrize("step", [0, -0.1, float("nan"), 1e4, "long"])
def test_a_step_that_leads_nowhere_is_refused(step):
    forced = SYSTEM.with_({"load.horizontal": saltus.Harmonic(amplitude=0.5), "load.vertical": -0.5, "model.damping": 0.1})
    orbit = saltus.find_orbit(forced, theta=0.3)
    with pytest.raises(ParameterError, match=r"^step must (lie|be a number) in "):
        saltus.continue_orbit(orbit, "load.frequency", (0.9, 1.1), step=step)


def test_near_names_are_those_that_a_user_writes():
    colour = StrEnum("colour", ["RED", "GREEN"])
    assert near("rd", colour) == "did you mean 'red'?"
    assert near("grean", colour, ("greens",)) == "did you mean 'green' or 'greens'?"
    assert near("x", colour, ("blue",)) == "known here: green, red"


# --- every public function ---------------------------------------------------------------------------------------------------

SYSTEM = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(frequency=1.0))


def functions():
    """The public functions of saltus, by their names."""
    return {name: getattr(saltus, name) for name in saltus.__all__ if inspect.isfunction(getattr(saltus, name))}


@pytest.mark.parametrize("name", functions())
def test_a_misspelt_argument_is_answered_with_the_near_name(name):
    function = functions()[name]
    known = [p.name for p in inspect.signature(function).parameters.values() if p.kind is p.KEYWORD_ONLY]
    for argument in known:
        with pytest.raises(ParameterError, match=rf"'?{argument}'?") as refusal:
            function(SYSTEM, **{f"{argument}_": 1})
        assert len(str(refusal.value)) < 400


@pytest.mark.parametrize("name", functions())
def test_objects_of_a_wrong_kind_are_answered_with_the_name_of_the_argument(name):
    function = functions()[name]
    needed = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty and p.kind < p.VAR_POSITIONAL]
    if not needed or name in ("load_study",):  # its argument may be any path
        return
    for wrong in (object(), 3, "text", None, [1, 2], {"a": 1}):
        with pytest.raises(SaltusError) as refusal:
            function(*[wrong for _ in needed])
        assert len(str(refusal.value)) < 400


def test_a_package_that_is_called_names_the_function_that_is_meant():
    with pytest.raises(ParameterError, match=r"saltus.attractors is a package, not a function; did you mean 'find_attractors'"):
        saltus.attractors(SYSTEM)
    with pytest.raises(ParameterError, match=r"saltus.theory is a package, not a function"):
        saltus.theory()


def test_a_public_function_can_be_pickled():
    assert pickle.loads(pickle.dumps(saltus.simulate)) is saltus.simulate


def test_a_mistake_of_saltus_stays_one():
    def mistaken(count: int) -> None:
        raise AttributeError("a mistake")

    with pytest.raises(AttributeError, match="a mistake"):
        answered(mistaken)(3)
    with pytest.raises(ParameterError, match=r"^count must be a whole number, got 'x'$"):
        answered(mistaken)("x")


def test_memory_and_work_are_estimated(monkeypatch):
    monkeypatch.setattr(checks, "free_memory", lambda: 1e9)
    check_memory("starts", 0.7e9, "starts")
    with pytest.raises(ParameterError, match=r"^starts is too large: 9 starts need about 0.9 GB of memory, and 1 GB are free$"):
        check_memory("starts", 0.9e9, "9 starts")
    with pytest.raises(ParameterError, match=r"^starts is too large: 1000000 starts need about 2.05 GB"):
        saltus.find_attractors(SYSTEM, starts=1_000_000)
    with pytest.raises(ParameterError, match=r"^periods is too large: 1e\+06 periods of a motion kept whole \(dense=False"):
        saltus.simulate(SYSTEM, theta=0.1, periods=1_000_000)
    with pytest.raises(ParameterError, match=r"take about 40 days of one core"):
        check_work("periods", 1e6, 1e7)
    with pytest.raises(ParameterError, match=r"^threads must lie in \[1, 1024\], got 100000$"):
        saltus.simulate_many(SYSTEM, theta=[0.1], periods=1, threads=10**5)


def test_the_free_memory_is_told():
    assert 1e6 < free_memory() < 1e15


# --- one argument that does not fit, the others as they should be ------------------------------------------------------------

UNFIT = (
    *(None, "x", "", b"x", -1, 0.5, math.nan, math.inf, 10**30, 1j, [], {}, (), [1, 2, 3], ["a"], [[]], [None], {"a": 1}, {1.0}),
    *(np.array([]), np.zeros((2, 2)), np.array(["a"]), np.array(0.3), object(), len, int, Fraction(1, 3), Decimal(1), range(3)),
)
FORCED = SYSTEM.with_({"load.horizontal": saltus.Harmonic(0.3), "load.vertical": -0.5, "model.damping": 0.1})


def methods():
    """Public methods, classes and functions with arguments that fit, by what is called."""
    motion, orbit = saltus.simulate(FORCED, theta=0.3, periods=2), saltus.find_orbit(FORCED, theta=0.1)
    branch = saltus.continue_orbit(orbit, "load.frequency", (0.99, 1.01))
    return {
        "System.with_": (FORCED.with_, {"changes": {"load.frequency": 1.0}}),
        "System.get": (FORCED.get, {"path": "load.frequency"}),
        "System": (saltus.System, {"model": FORCED.model, "load": FORCED.load, "impact": FORCED.impact}),
        "Record": (saltus.Record, {"time": [0.0, 1.0], "value": [0.0, 1.0], "quantity": "force", "scale": 1.0, "source": ""}),
        "Harmonic": (saltus.Harmonic, {"amplitude": 0.1, "mean": 0.0, "phase": 0.0, "order": 1}),
        "Load": (saltus.Load, {"frequency": 1.0, "horizontal": 0.1}),
        "Motion.at": (lambda times: motion.at(times), {"times": 1.0}),
        "Motion.to_xarray": (motion.to_xarray, {"times": [1.0]}),
        "Branch.at": (branch.at, {"value": 1.0}),
        "is_symmetric": (saltus.orbits.is_symmetric, {"system": FORCED}),
        "load_releases": (saltus.flow.load_releases, {"system": FORCED}),
        "defects": (saltus.orbits.defects, {"orbits": [orbit]}),
        "simulate": (saltus.simulate, {"system": FORCED, "theta": 0.3, "periods": 1, "stop_at": (), "tol": 1e-10}),
        "sensitivities": (saltus.sensitivities, {"system": FORCED, "theta": 0.3, "periods": 1, "parameters": ()}),
    }


def test_one_argument_that_does_not_fit_is_answered_by_a_sentence_or_meant():
    wrong = []
    for name, (function, fitting) in methods().items():
        for argument in fitting:
            for unfit in UNFIT:
                try:
                    function(**{**fitting, argument: unfit})
                except SaltusError as refusal:
                    wrong += [] if len(str(refusal)) < 400 else [(name, argument, unfit, "a long sentence")]
                except Exception as error:
                    wrong.append((name, argument, unfit, repr(error)))
    assert not wrong
