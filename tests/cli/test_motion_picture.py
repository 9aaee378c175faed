"""The picture of a motion shows what the dataset holds."""

import math

import numpy as np
import pytest

import saltus
from saltus.plots import figure_of
from saltus.plots.motion import arcs, coordinates, draw_motion


def wall(**more):
    system = saltus.System(
        model=saltus.WallOscillator(wall=0.5), impact=saltus.VelocityReduction(0.8)
    )
    return saltus.simulate(system, x=-1.0, duration=10.0, **more)


def test_impacts_are_put_in_at_the_contact_with_both_velocities():
    motion = wall()
    time, position, velocity = arcs(motion.to_xarray(np.linspace(0, 10, 400)), "x")
    assert (np.diff(time) >= 0).all()
    gaps = np.flatnonzero(np.isnan(velocity))
    assert len(gaps) == len(motion.impacts) > 0
    # free fall from x = -1 reaches the wall with v^2 = 1 - 0.5^2, at x = -cos t
    assert time[gaps[0]] == pytest.approx(2 * math.pi / 3, abs=1e-12)
    assert velocity[gaps[0] - 1] == pytest.approx(math.sqrt(0.75), abs=1e-12)
    assert velocity[gaps[0] + 1] == pytest.approx(-0.8 * math.sqrt(0.75), abs=1e-12)
    np.testing.assert_allclose(position[gaps], 0.5, atol=1e-4)


def test_the_coordinates_are_told_from_their_velocities():
    assert coordinates(wall().to_xarray()) == ["x"]
    layers = saltus.System(model=saltus.TwoLayer(beta0=1.4), load=saltus.Load(vertical=0.5))
    motion = saltus.simulate(layers, theta_1=0.1, theta_2=-0.1, velocity=(0.0, 0.0), duration=0.1)
    assert coordinates(motion.to_xarray()) == ["theta_1", "theta_2"]
    figure = figure_of(draw_motion(motion.to_xarray()))
    assert len(figure.legends[0].get_texts()) == 2
    portrait = figure.axes[1]
    assert portrait.get_ylabel().count("dot") == 2


def test_the_last_forcing_period_is_drawn_on_top():
    system = saltus.System(
        model=saltus.Metainterface(beta0=1.4, damping=0.1),
        load=saltus.Load(frequency=2.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    motion = saltus.simulate(system, theta=0.3, periods=5)
    portrait = figure_of(draw_motion(motion.to_xarray())).axes[1]
    lines = [line for line in portrait.lines if len(line.get_xdata()) > 100]
    whole, last = sorted(lines, key=lambda line: line.get_zorder())
    assert len(whole.get_xdata()) > 4.5 * len(last.get_xdata())
    late = np.linspace(motion.time - math.pi, motion.time, 201)
    assert np.nanmax(last.get_xdata()) == pytest.approx(motion.at(late)[0].max(), abs=1e-6)


def test_limits_are_drawn_where_they_are_reached():
    system = saltus.System(
        model=saltus.Metainterface(beta0=math.radians(80)), load=saltus.Load(horizontal=5.0)
    )
    motion = saltus.simulate(system, theta=0.1, duration=6.0, stop_at=["kinematic_limit"])
    history = figure_of(draw_motion(motion.to_xarray())).axes[0]
    levels = {
        round(line.get_ydata()[0], 12) for line in history.lines if len(line.get_ydata()) == 2
    }
    assert round(math.radians(100), 12) in levels


def test_a_motion_of_no_length_can_be_drawn():
    motion = saltus.simulate(saltus.System(model=saltus.WallOscillator()), x=0.0, duration=0.0)
    draw_motion(motion.to_xarray())


def test_every_coordinate_of_a_chain_is_drawn_with_a_line_of_its_own():
    model = saltus.CellChain(cells=4, beta0=1.4, mass_ratio=0.2)
    system = saltus.System(model=model, load=saltus.Load(frequency=1.0, vertical=-0.5))
    start = dict.fromkeys(model.coordinates, 0.0) | {"lower_1": 0.2}
    figure = figure_of(
        draw_motion(saltus.simulate(system, **start, velocity=(0.0,) * 8, periods=2).to_xarray())
    )
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        rf"$\mathrm{{{name.replace('_', chr(92) + '_')}}}$" for name in model.coordinates
    ]
    lines = [line for line in figure.axes[0].lines if line.get_label().startswith("$")]
    assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == 8


def test_what_slides_is_no_coordinate():
    motion = saltus.simulate(
        saltus.System(model=saltus.BeltOscillator()), x=0.0, velocity=0.1, duration=20.0
    )
    assert coordinates(motion.to_xarray()) == ["x"]
