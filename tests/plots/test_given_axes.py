"""Every result has a picture, in axes of one's own if they are given; the style of these is kept."""

import inspect

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import saltus
from saltus import plots
from saltus.errors import ParameterError
from saltus.orbits import SpecialKind

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=1.4, damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(0.3), vertical=-0.5),
)
FREE = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=-0.5))


def branch():
    return saltus.continue_orbit(saltus.find_orbit(SYSTEM, theta=0.1), "load.frequency", (0.8, 1.2))


def special_curve():
    fold = next(s for s in branch().special if s.kind == SpecialKind.LP)
    return saltus.continue_special(fold, "load.vertical", (-0.51, -0.49), first_bounds=(0.8, 1.2), most_points=10)


def grid():
    columns = {
        "load.frequency": xarray.DataArray([1.0, 1.1], dims="W"),
        "load.vertical": xarray.DataArray([-0.5, -0.4, -0.3], dims="V"),
    }
    return saltus.simulate_many(SYSTEM, theta=0.3, periods=3, parameters=columns)


RESULTS = {
    "motion": lambda: saltus.simulate(SYSTEM, theta=0.3, periods=3),
    "phase portrait": lambda: saltus.phase_portrait(FREE, starts=[(0.5, 0.0)], duration=5.0, samples=50),
    "spectrum": lambda: saltus.response_spectrum(SYSTEM, bounds=(0.9, 1.1), max_period=1, values=[1.0], starts=4, bands=False),
    "sweep": lambda: saltus.frequency_sweep(SYSTEM, [0.9, 1.0, 1.1], theta=0.3),
    "attractors": lambda: saltus.find_attractors(SYSTEM, starts=8),
    "along": lambda: saltus.attractors_along(SYSTEM, "load.frequency", [1.0, 1.05], starts=8),
    "basins": lambda: saltus.basins_of_attraction(SYSTEM, theta=[-0.5, 0.5], velocity=[-0.5, 0.5]),
    "chart": lambda: saltus.stability_chart(SYSTEM, horizontal=[0.1, 0.3], vertical=[-0.5, -0.4], starts=2, periods=60),
    "backbone": lambda: saltus.backbone(FREE, [0.1, 0.2]),
    "branch": branch,
    "special curve": special_curve,
    "ensemble": lambda: saltus.simulate_many(SYSTEM, theta=np.linspace(0.1, 0.3, 5), periods=3),
    "grid": grid,
}
PANELS = {"motion": 2, "spectrum": 2}  # in a figure; into axes that are given only the first one is drawn


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_is_drawn_into_axes_that_are_given(name):
    result, size = RESULTS[name](), plt.rcParams["font.size"]
    figure = plt.figure()
    if name in PANELS:
        axes = saltus.plot(result, figure=figure)
        assert len(axes) <= PANELS[name]
        assert all(isinstance(ax, Axes) and ax.figure is figure and ax.has_data() for ax in axes)
        figure.clear()
    ax = figure.subplots()
    ax.set_title("mine")
    assert saltus.plot(result, ax=ax) is ax
    assert figure.axes[0] is ax
    assert ax.has_data()
    assert ax.get_title() == "mine"
    assert ax.xaxis.label.get_fontsize() == size
    figure.canvas.draw()
    plt.close(figure)
    own = saltus.plot(result)
    assert isinstance(plots.figure_of(own), Figure)


def test_a_diagram_is_drawn_into_one_panel_or_into_a_plain_figure_whose_legend_covers_nothing():
    tree = RESULTS["spectrum"]()
    figure, ax = plt.subplots()
    assert saltus.plot(tree, ax=ax) is ax
    assert figure.axes == [ax]
    assert ax.get_legend() is not None
    figure = plt.figure()
    axes = saltus.plot(tree, figure=figure)
    figure.canvas.draw()
    (legend,) = figure.legends
    assert legend.get_window_extent().y1 <= min(ax.get_tightbbox().y0 for ax in axes) + 1
    assert legend.get_window_extent().width <= figure.bbox.width


def test_an_option_that_a_picture_does_not_take_is_refused_with_those_that_it_does():
    motion = RESULTS["motion"]()
    with pytest.raises(ParameterError, match="no argument 'figur'; did you mean 'figure'"):
        saltus.plot(motion, figur=None)


def test_what_has_no_picture_is_told():
    with pytest.raises(ParameterError, match="nothing draws a result of the kind 'other'"):
        saltus.plot(xarray.Dataset(attrs={"kind": "other"}))
    with pytest.raises(ParameterError, match="over one or two dimensions"):
        saltus.plot(saltus.simulate_many(SYSTEM, theta=0.3, periods=3))


def test_every_function_that_draws_a_whole_result_takes_axes_or_a_figure():
    whole = {*plots.DRAWINGS.values(), plots.draw_branch, plots.draw_special_curve, plots.draw_ensemble}
    for draw in whole:
        keys = inspect.signature(draw).parameters
        assert {"ax", "figure"} & set(keys), draw
