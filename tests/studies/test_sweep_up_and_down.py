"""A parameter swept up and down: jumps where closed forms and branches have them, hysteresis
between.
"""

import numpy as np
import pytest

import saltus
from saltus.bounds import proved_speeds
from saltus.cli.summaries import summarise
from saltus.config import load_study
from saltus.errors import ParameterError
from saltus.orbits import SpecialKind
from saltus.plots import figure_of
from saltus.plots.motion import draw_sweep

DAMPING, FORCE = 0.1, 0.2


def oscillator(frequency=1.0, force=FORCE, wall=1.0):
    return saltus.System(
        model=saltus.WallOscillator(stiffness=1.0, damping=DAMPING, wall=wall),
        load=saltus.Load(frequency=frequency, force=saltus.Harmonic(force)),
        impact=saltus.VelocityReduction(0.8),
    )


def linear_gain(w):
    """The amplitude of x'' + 0.1 x' + x = sin(w t)."""
    return 1 / np.hypot(1 - w**2, DAMPING * w)


def upper_grazing():
    """The frequency above resonance at which the linear amplitude is that of the wall: (1 - u)^2 +
    c^2 u = F^2, u = w^2.
    """
    return np.sqrt(max(np.roots([1.0, DAMPING**2 - 2, 1 - FORCE**2])))


@pytest.fixture(scope="module")
def swept():
    return saltus.frequency_sweep(oscillator(), np.linspace(1.02, 1.5, 49), x=0.1)


def jumps(data, way):
    """(before, after) of the jumps of one direction."""
    chosen = data.jump_direction == way
    return list(zip(data.jump_before[chosen].values, data.jump_after[chosen].values, strict=True))


def test_on_the_way_down_the_jump_is_where_the_linear_motion_grazes_the_wall(swept):
    ((before, after),) = jumps(swept, "down")
    assert before - after < 1.1e-5  # a thousandth of the step
    # beside it transients touch the wall as well
    assert 0.5 * (before + after) == pytest.approx(upper_grazing(), abs=2e-5)


def test_on_the_way_up_the_jump_is_the_fold_of_the_branch(swept):
    ((before, after),) = jumps(swept, "up")
    branch = saltus.continue_orbit(
        saltus.find_orbit(oscillator(1.1), x=1.0), "load.frequency", (1.05, 1.4)
    )
    folds = [s.parameter for s in branch.special if s.kind == SpecialKind.LP]
    assert any(before <= fold <= after for fold in folds)


def test_hysteresis_is_between_the_jumps_and_nowhere_else(swept):
    ((low, _),), ((high, _),) = jumps(swept, "down"), jumps(swept, "up")
    apart = swept.hysteresis.values.astype(bool)
    inside = (swept.value > low) & (swept.value < high)
    assert (apart == inside.values).all()
    assert apart.any()


def test_without_impacts_both_ways_are_the_linear_response(swept):
    for way in ("up", "down"):
        one = swept.sel(direction=way)
        free = one.impact_count == 0
        assert one.amplitude[free].values == pytest.approx(
            FORCE * linear_gain(one.value[free].values), rel=1e-8
        )
        assert free.sum() > 15


def test_the_speeds_of_capture_of_all_values_are_proved_together(monkeypatch):
    """One proof takes as long for one value as for a hundred; without a jump two ways of 12 values
    need three.
    """
    proofs = []
    monkeypatch.setattr(
        "saltus.bounds.proved_speeds", lambda *given: proofs.append(0) or proved_speeds(*given)
    )
    data = saltus.frequency_sweep(oscillator(), np.linspace(1.2, 1.25, 12), x=0.1)
    assert data.sizes["jump"] == 0
    assert 0 < len(proofs) <= 3


def test_any_parameter_of_the_load_is_swept():
    frequency = 1.2
    grid = np.linspace(0.05, 0.6, 56)
    data = saltus.frequency_sweep(oscillator(frequency), grid, path="load.force.amplitude", x=0.0)
    ((before, after),) = jumps(data, "up")
    assert 0.5 * (before + after) == pytest.approx(1 / linear_gain(frequency), abs=3e-5)
    assert data.hysteresis.any()


def test_a_function_is_asked_of_the_motion_on_which_each_value_is_left():
    """P = c (w X)^2 / 2 of the linear motion; with impacts what the load gives on the orbit."""
    grid = np.linspace(1.3, 1.6, 4)
    data = saltus.frequency_sweep(
        oscillator(wall=50.0), grid, x=0.0, functions={"power": saltus.mean_dissipated_power}
    )
    assert data.power.values == pytest.approx(
        np.tile(DAMPING * (grid * FORCE * linear_gain(grid)) ** 2 / 2, (2, 1)), rel=1e-6
    )
    seen = saltus.frequency_sweep(
        oscillator(), [1.05, 1.1], x=1.0, functions={"impacts": lambda motion: len(motion.impacts)}
    )
    assert (seen.impacts == seen.impact_count).all()
    assert (seen.impacts > 0).any()


def test_falling_values_are_swept_down_first():
    """From rest at 1.5 the linear motion is kept down to where it grazes; begun at 1.02 the sweep
    is on the impacting one.
    """
    down, up = (
        saltus.frequency_sweep(oscillator(), grid, x=0.1)
        for grid in (np.linspace(1.5, 1.02, 9), np.linspace(1.02, 1.5, 9))
    )
    assert (down.value == up.value).all()
    assert (np.diff(down.value) > 0).all()
    later = {"value": 1.2, "method": "nearest"}
    assert down.amplitude.sel(direction="down").sel(**later) == pytest.approx(
        FORCE * linear_gain(1.2), rel=1e-6
    )
    assert np.array(jumps(down, "down")) == pytest.approx(np.array(jumps(up, "down")), abs=1e-4)
    assert np.array(jumps(down, "up")) == pytest.approx(np.array(jumps(up, "up")), abs=1e-4)


@pytest.mark.parametrize("place", [1.5, 20.0])
def test_a_start_beyond_the_contact_is_refused_as_by_simulate(place):
    with pytest.raises(ParameterError) as refused:
        saltus.frequency_sweep(oscillator(), [1.0, 1.1], x=place)
    with pytest.raises(ParameterError) as expected:
        saltus.simulate(oscillator(), periods=1, x=place)
    assert str(refused.value) == str(expected.value)
    assert "lies beyond the contact at x = 1" in str(refused.value)
    with pytest.raises(ParameterError, match="lies beyond the contact at x = 1"):
        saltus.classify(oscillator(), x=place)


@pytest.mark.thorough
def test_a_slow_sweep_follows_the_response_within_its_rate():
    grid = np.linspace(1.3, 1.6, 601)
    data = saltus.frequency_sweep(
        oscillator(1.3, wall=50.0), grid, periods=1, stop_early=False, x=0.0
    )
    late = data.sel(direction="down")
    assert (late.periods == 1).all()
    assert late.amplitude.values == pytest.approx(FORCE * linear_gain(grid), rel=0.02)
    assert not data.sizes["jump"]


def test_a_sweep_ends_where_a_margin_ends_the_motion_and_goes_back_from_there():
    block = saltus.System(
        model=saltus.RockingBlock(alpha=0.3),
        load=saltus.Load(frequency=2.0, ground_horizontal=saltus.Harmonic(0.01)),
        impact=saltus.VelocityReduction(0.8),
    )
    data = saltus.frequency_sweep(
        block,
        np.linspace(0.02, 2.0, 12),
        path="load.ground_horizontal.amplitude",
        theta=0.0,
        periods=200,
    )
    reached = np.isfinite(data.amplitude.sel(direction="up").values)
    assert 0 < reached.sum() < 12
    assert (np.diff(reached.astype(int)) <= 0).all()
    assert (np.isfinite(data.amplitude.sel(direction="down").values) == reached).all()
    assert (data.outcome.values[:, ~reached] == "").all()


def test_a_study_asks_for_a_sweep_and_its_picture_and_summary_show_it(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("""
[model]
type = "WallOscillator"
damping = 0.1
[load]
frequency = 1.0
force = { amplitude = 0.2 }
[impact]
type = "VelocityReduction"
e = 0.8
[frequency_sweep]
values = { from = 1.02, to = 1.5, count = 25 }
x = 0.1
""")
    study = load_study(path)
    (ask,) = study.asks
    data = study.answer(ask, ask.function)
    lines = list(summarise(ask.kind, data))
    assert lines[0].startswith("25 values of load.frequency up and down; they differ at")
    assert [line.partition(":")[0] for line in lines[1:]] == ["up", "down"]
    (axes,) = figure_of(draw_sweep(data)).axes
    assert len(axes.texts) == 2  # an arrow for each jump


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"values": [1.0]}, "values must be two or more"),
        (
            {"values": [1.2, 1.0, 1.1]},
            r"must be numbers that rise, or all fall, .* got \[1.2, 1.0, 1.1\]",
        ),
        (
            {"values": [1.0, 1.2, 1.1]},
            r"must be numbers that rise, or all fall, .* got \[1.0, 1.2, 1.1\]",
        ),
        ({"values": [[1.0, 1.1]]}, "must be numbers that rise, or all fall"),
        ({"values": []}, "must be numbers that rise, or all fall"),
        (
            {"functions": {"power": 3.0}},
            "functions must be functions of a motion, and 'power' is 3.0",
        ),
        (
            {"functions": {"state": lambda motion: motion.final_state}},
            "functions must return a number, and 'state' returned",
        ),
        ({"path": "load.force"}, "not a number"),
        ({"periods": 0}, "periods"),
        ({"y": 0.3}, "no coordinate 'y'"),
        ({"velocity": np.nan}, "velocity"),
        ({"values": [-1.0, 1.0]}, "values reach beyond what the system allows"),
    ],
)
def test_a_sweep_without_meaning_is_refused(change, sentence):
    with pytest.raises(ParameterError, match=sentence):
        saltus.frequency_sweep(oscillator(), **({"values": [1.0, 1.1], "x": 0.0} | change))


def test_between_stops_what_was_asked_for_is_drawn():
    """The amplitude is that of the stops for all values; the impacts in a period and functions can
    be drawn too.
    """
    stops = saltus.System(
        model=saltus.TwoStops(damping=0.05),
        load=saltus.Load(frequency=1.0, force=saltus.Harmonic(0.4)),
        impact=saltus.NewtonImpact(0.6),
    )
    data = saltus.frequency_sweep(
        stops, [0.9, 1.0, 1.1], x=0.0, functions={"speed": lambda motion: abs(motion.velocity)}
    )
    assert np.ptp(data.amplitude.values) < 1e-9
    for quantity, name, label in (
        (None, "speed", "speed"),
        ("impact_count", "impact_count", "impact"),
    ):
        ax = draw_sweep(data, quantity)
        np.testing.assert_allclose(ax.lines[0].get_ydata(), data[name].sel(direction="up").values)
        assert label in ax.get_ylabel()
    with pytest.raises(ParameterError, match="quantity must be one of amplitude"):
        draw_sweep(data, "speeds")


def test_steps_that_may_be_jumps_are_swept_again_all_at_once(monkeypatch):
    """Each of both levels takes at most twice 32 ensembles, however many steps there are."""
    from saltus.studies import swept_parameter

    sizes = []

    def counted(system, states, *given, **named):
        sizes.append(len(states))
        return find_recurrence(system, states, *given, **named)

    find_recurrence = swept_parameter.find_recurrence
    monkeypatch.setattr(swept_parameter, "find_recurrence", counted)
    grid = np.array([1.02, 1.1, 1.2, 1.3, 1.4])
    data = saltus.frequency_sweep(oscillator(), grid, x=0.1)
    alone, together = sizes[: 2 * grid.size], sizes[2 * grid.size :]
    assert set(alone) == {1}
    assert together[0] == 2  # a step up and one down
    assert len(together) <= 2 * 32
    ((before, after),) = jumps(data, "down")
    assert 0.5 * (before + after) == pytest.approx(upper_grazing(), abs=2e-4)


def test_a_sweep_traces_a_system_of_several_contacts_for_its_proofs_at_most_once(monkeypatch):
    from saltus.bounds import capture

    traced, traces = capture.trace, []
    monkeypatch.setattr(capture, "trace", lambda *given: traces.append(0) or traced(*given))
    load = saltus.Load(frequency=1.0, force=saltus.Harmonic(2.0))
    stops = saltus.System(
        model=saltus.TwoStops(damping=0.05), load=load, impact=saltus.NewtonImpact(e=0.7)
    )
    data = saltus.frequency_sweep(stops, np.linspace(1.0, 1.1, 5), x=0.1, periods=20)
    assert data.amplitude.shape == (2, 5)
    assert len(traces) <= 1
