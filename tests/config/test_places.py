"""Every refusal carries the dotted path of the parameter, by which its place in a file is found
without reading its sentence.
"""

import math

import pytest

from saltus import phase_portrait, response_spectrum, stability_chart
from saltus.checks import check_bounds, check_count, check_number, checked_by
from saltus.errors import ParameterError
from saltus.flow import simulate
from saltus.systems import (
    Harmonic,
    Load,
    Metainterface,
    RockingBlock,
    System,
    VelocityReduction,
    check_along,
    check_path,
)

SYSTEM = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=Harmonic(amplitude=0.5), vertical=-0.5),
)

REFUSED = {
    "beta0": lambda: Metainterface(beta0=80),
    "smoothing": lambda: Metainterface(beta0=1.4, mass_ratio=1.0, smoothing=10.0),
    "alpha": lambda: RockingBlock(alpha=-1.0),
    "e": lambda: VelocityReduction(2.0),
    "order": lambda: Harmonic(1.0, order=0),
    "load.frequency": lambda: Load(frequency=-1.0),
    "load.vertical": lambda: Load(vertical="down"),
    "load.vertcal": lambda: System(model=Metainterface(beta0=1.4), load=Load(vertcal=1.0)),
    "model.damping": lambda: SYSTEM.with_({"model.damping": -1.0}),
    "model.dampng": lambda: SYSTEM.with_({"model.dampng": 1.0}),
    "load.horizontal.amplitude": lambda: SYSTEM.with_({"load.horizontal.amplitude": math.nan}),
    "load.horizontal.order": lambda: System.from_dict(
        {
            "model": {"type": "Metainterface", "beta0": 1.4},
            "load": {"frequency": 1.0, "horizontal": {"amplitude": 1, "order": 0}},
        }
    ),
    "model.type": lambda: System.from_dict({"model": {"type": "Metainterfase"}}),
    "tol": lambda: simulate(SYSTEM, theta=0.1, periods=1, tol=1.0),
    "theta": lambda: simulate(SYSTEM, theta=math.inf, periods=1),
    "duration": lambda: simulate(SYSTEM, theta=0.1, duration=-1.0),
    "bounds": lambda: response_spectrum.check(SYSTEM, bounds=(2.0, 1.0)),
    "path": lambda: response_spectrum.check(SYSTEM, "load.frequenzy"),
    "values": lambda: response_spectrum.check(SYSTEM, values=[100.0]),
    "rows": lambda: stability_chart.check(SYSTEM, rows=0),
    "paths": lambda: stability_chart.check(SYSTEM, paths=("load.vertical", "a.b")),
    "horizontal": lambda: stability_chart.check(SYSTEM, horizontal=[1.0, 0.0]),
    "samples": lambda: phase_portrait.check(SYSTEM.with_({"load.horizontal": 0.0}), samples=1),
}


@pytest.mark.parametrize("parameter", REFUSED)
def test_a_refusal_names_its_parameter(parameter):
    with pytest.raises(ParameterError) as refused:
        REFUSED[parameter]()
    assert refused.value.parameter == parameter


def test_an_owner_puts_its_name_before_that_of_the_part():
    refusal = ParameterError("beta0 must lie in (0, pi)", "beta0").inside("model")
    assert (str(refusal), refusal.parameter) == ("model.beta0 must lie in (0, pi)", "model.beta0")
    refusal = ParameterError("this load has no frequency", "frequency").inside("load")
    assert (str(refusal), refusal.parameter) == (
        "load.frequency: this load has no frequency",
        "load.frequency",
    )
    refusal = ParameterError("no such thing").inside("basins")
    assert (str(refusal), refusal.parameter) == ("basins: no such thing", "basins")


@pytest.mark.parametrize(
    ("check", "problem"),
    [
        (lambda: check_number("x", 2.0, at_most=1.0), r"x must lie in \(-inf, 1\], got 2.0"),
        (lambda: check_number("x", True), "x must be a finite number, got True"),
        (lambda: check_count("n", 2.5, 1), "n must be a whole number, got 2.5"),
        (lambda: check_bounds((1.0, 1.0)), "bounds must be two numbers, the smaller one first"),
        (lambda: check_path(SYSTEM, "model"), "model is not a number"),
        (
            lambda: check_along(SYSTEM, "model.beta0", (1.0, 9.0), "bounds"),
            "bounds reach beyond what the system allows",
        ),
    ],
)
def test_what_a_check_says(check, problem):
    with pytest.raises(ParameterError, match=problem):
        check()


def test_a_checked_function_begins_only_with_arguments_that_pass():
    begun = []

    @checked_by(lambda count, values, **more: check_count("count", count, 1) or list(values))
    def compute(count, *, values=(), **more):
        begun.append((count, list(values), more))
        return count

    assert compute(2, values=iter([1, 2]), name=3) == 2
    assert begun == [(2, [1, 2], {"name": 3})]  # an iterator is looked at twice
    compute.check(1)
    for call in (compute, compute.check):
        with pytest.raises(ParameterError, match="count must lie in"):
            call(0)
    assert len(begun) == 1
