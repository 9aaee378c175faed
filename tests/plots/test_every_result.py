"""Every result has a picture, a table, a MATLAB file, a file that is read back and a table of facts
in a notebook.

Which functions there are is read from the public face: of a new one the first test asks for its
result, or why it has none.
"""

import inspect
import itertools
import sys
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import scipy.io
import xarray
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from results_to_draw import FREE, RESULTS, SYSTEM, WITHOUT, chart
from test_public_face import answer, public, values_of

import saltus
from saltus import plots
from saltus.errors import ParameterError
from saltus.files import write_dataset
from saltus.plots.any_result import DRAWINGS, _by_content
from saltus.plots.curves import draw_special_curve
from saltus.result import Result

PANELS = (
    "saltus.simulate",
    "saltus.find_orbit",
    "saltus.free_orbit",
    "saltus.doubling_cascade",
    "saltus.chaotic_bands",
)
PANELS += ("saltus.response_spectrum", "saltus.bifurcation_diagram")
# Of the same class as another one that is drawn and written here.
SIBLINGS = ("saltus.bifurcation_diagram", "saltus.switch_branch", "attractors.unstable_manifold")
every_result = pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.thorough if name in SIBLINGS else ())
        for name in RESULTS
    ],
)


@pytest.fixture(scope="module")
def results():
    """The results by name, each made once."""
    made = {}

    def result(name):
        if name not in made:
            made[name] = RESULTS[name]()
        return made[name]

    return result


@pytest.fixture(scope="module")
def pictures(results):
    """The axes of each result's picture of its own, by name, each laid out once."""
    made = {}

    def axes(name):
        if name not in made:
            made[name] = saltus.plot(results(name))
            plots.figure_of(made[name]).draw_without_rendering()
        return made[name]

    return axes


def test_every_public_function_has_a_result_here_or_a_reason():
    functions = {
        name for name in public() if name.partition(".")[0] != "theory" and not name[0].isupper()
    }
    checked = {"theory"}  # formulas, which give numbers
    assert functions == {*RESULTS, *WITHOUT}, checked


@every_result
def test_a_result_is_drawn_into_axes_that_are_given(name, results):
    result, size = results(name), plt.rcParams["font.size"]
    figure = plt.figure()
    if name in PANELS:
        axes = saltus.plot(result, figure=figure)
        assert len(axes) <= 2
        assert all(isinstance(ax, Axes) and ax.figure is figure and ax.has_data() for ax in axes)
        figure.clear()
    ax = figure.subplots()
    assert saltus.plot(result, ax=ax) is ax
    assert figure.axes[0] is ax
    assert ax.has_data()
    assert ax.xaxis.label.get_fontsize() == size
    figure.draw_without_rendering()
    plt.close(figure)


def test_a_diagram_is_drawn_into_one_panel_or_into_a_plain_figure_whose_legend_covers_nothing(
    results,
):
    tree = results("saltus.response_spectrum")
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
    plt.close("all")


def test_an_option_that_a_picture_does_not_take_is_refused_with_those_that_it_does(results):
    motion = results("saltus.simulate")
    with pytest.raises(ParameterError, match="takes no 'figur'; did you mean 'figure'"):
        saltus.plot(motion, figur=None)
    with pytest.raises(ParameterError, match=r"takes no 'quantity'; known here: ax.* title"):
        saltus.plot(motion, quantity="largest_x")


def test_a_motion_and_a_branch_have_no_axes_in_common(results):
    both = (results("saltus.simulate"), results("saltus.continue_orbit"))
    with pytest.raises(ParameterError, match="a picture over time"):
        saltus.plot(both)


def numbers_on(axis):
    """The labels of the ticks of an axis that are to be seen."""
    low, high = sorted(axis.get_view_interval())
    # shared axes hide some
    ticks = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)
    return [
        label for place, label in ticks if low <= place <= high and label.get_window_extent().width
    ]


@every_result
def test_a_picture_of_its_own_names_every_axis_with_its_unit_and_cuts_no_text(name, pictures):
    axes = pictures(name)
    figure = plots.figure_of(axes)
    assert isinstance(figure, Figure)
    panels = np.ravel(axes).tolist()
    # panels that share the axis below them
    below = panels[-1] if "chaotic" in name or "diagram" in name else None
    assert all(
        ax.get_ylabel() and (ax.get_xlabel() or ax is not below or below is None) for ax in panels
    )
    # whose entries are named each
    if name not in ("saltus.sensitivities", "saltus.lyapunov_spectrum"):
        assert panels[-1].get_xlabel()
    angles = [
        label for ax in panels for label in (ax.get_xlabel(), ax.get_ylabel()) if "theta" in label
    ]
    assert all("(rad)" in label for label in angles), angles
    width, height = figure.get_size_inches() * figure.dpi
    for ax in panels:
        for text in (
            ax.xaxis.label,
            ax.yaxis.label,
            ax.title,
            *numbers_on(ax.xaxis),
            *numbers_on(ax.yaxis),
        ):
            box = text.get_window_extent()
            if text.get_text() and box.width:
                assert box.x0 > -1.0, text
                assert box.y0 > -1.0, text
                assert box.x1 < width + 1.0, text
                assert box.y1 < height + 1.0, text


def covered(figure, ax):
    """The legends of a figure that lie on drawn points of axes, or on the axes of another one."""
    inside = [] if ax.get_legend() is None else [ax.get_legend()]
    points = [
        ax.transData.transform(line.get_xydata())
        for line in ax.lines
        if line.get_visible() and line.get_transform() == ax.transData and len(line.get_xydata())
    ]
    points = np.concatenate(points) if points else np.empty((0, 2))
    points = points[np.isfinite(points).all(axis=1)]
    panel = ax.get_window_extent()
    for legend in inside + list(figure.legends):
        box = legend.get_window_extent()
        within = (points > [box.x0, box.y0]).all(axis=1) & (points < [box.x1, box.y1]).all(axis=1)
        if (legend in inside and within.any()) or (legend not in inside and box.overlaps(panel)):
            yield legend


@every_result
def test_no_legend_of_a_picture_of_its_own_covers_a_curve(name, pictures):
    axes = pictures(name)
    figure = plots.figure_of(axes)
    for ax in np.ravel(axes).tolist():
        assert not list(covered(figure, ax)), name


@every_result
def test_numbers_on_an_axis_do_not_overlap(name, pictures):
    for ax in np.ravel(pictures(name)).tolist():
        boxes = [label.get_window_extent() for label in numbers_on(ax.xaxis)]
        assert all(one.x1 < other.x0 for one, other in itertools.pairwise(boxes)), ax.get_xlabel()


def each(result):
    """A result, or those of a tuple."""
    return result if isinstance(result, tuple) else (result,)


@every_result
def test_a_result_becomes_files_and_tables(name, results, tmp_path):
    """What is read back is what was written, with its kind; MATLAB's file has every variable; and a
    table has rows.
    """
    for result in each(results(name)):
        data = result.to_xarray() if isinstance(result, Result) else result
        assert isinstance(data, (xarray.Dataset, xarray.DataTree))
        assert data.attrs.get("saltus_version") or isinstance(data, xarray.DataTree)
        assert (
            "<table>" in result._repr_html_() if isinstance(result, Result) else data._repr_html_()
        )
        path = write_dataset(tmp_path / "result.nc", data)
        back = saltus.load(path)
        assert back.equals(data)
        assert back.attrs.get("kind") == data.attrs.get("kind")
        assert isinstance(plots.figure_of(saltus.plot(back)), Figure)
        read = scipy.io.loadmat(saltus.to_mat(tmp_path / "result", result))
        wanted = data.data_vars if isinstance(data, xarray.Dataset) else data.children
        assert {str(variable).replace(".", "_")[:63] for variable in wanted} <= set(read)
        if isinstance(result, Result):
            table = result.to_pandas()
            assert len(table)
            assert len(table.columns)


def test_a_result_that_is_an_object_is_a_result():
    """So it has a table for pandas and one for notebooks."""
    functions = (
        getattr(saltus, name)
        for name in saltus.__all__
        if name in {key.partition(".")[2] for key in RESULTS}
    )
    gives = {inspect.signature(function).return_annotation for function in functions}
    for name in gives - {
        "xarray.Dataset",
        "xarray.DataTree",
        "tuple[Separatrix, ...]",
        "tuple[Branch, ...]",
    }:
        rooms = (saltus.attractors, saltus.flow, saltus.orbits, saltus.studies)
        found = next((getattr(room, name) for room in rooms if hasattr(room, name)), None)
        assert found is None or issubclass(found, Result), name


def test_samples_are_even_and_include_both_ends():
    motion = saltus.simulate(SYSTEM, theta=0.3, periods=2)
    samples = motion.samples(5)
    assert samples.time == pytest.approx(np.linspace(0.0, motion.time, 5))
    assert samples.position[0, -1] == motion.theta
    assert list(motion.to_pandas(samples.time)["theta"]) == pytest.approx(
        samples.position[0].tolist()
    )


def test_what_has_no_picture_is_told():
    with pytest.raises(ParameterError, match="nothing draws a result of the kind 'other'"):
        saltus.plot(xarray.Dataset(attrs={"kind": "other"}))
    with pytest.raises(ParameterError, match="over one or two dimensions"):
        saltus.plot(saltus.simulate_many(SYSTEM, theta=0.3, periods=3))


def test_exponents_over_two_dimensions_are_a_map():
    columns = {
        "load.frequency": xarray.DataArray([1.0, 1.1], dims="W"),
        "load.vertical": xarray.DataArray([-0.5, -0.4, -0.3], dims="V"),
    }
    axes = saltus.plot(saltus.lyapunov_many(SYSTEM, columns, theta=0.3, periods=32))
    assert "Omega" in axes.get_xlabel()
    assert "mathcal{V}" in axes.get_ylabel()
    ends = saltus.plot(saltus.simulate_many(SYSTEM, theta=0.3, periods=3, parameters=columns))
    assert ends.get_xlabel() == axes.get_xlabel()


def test_a_free_orbit_and_a_chart_keep_what_they_are():
    assert (
        saltus.free_orbit(FREE, 0.2).to_xarray().attrs["period"]
        == saltus.free_orbit(FREE, 0.2).period
    )
    assert chart().attrs["kind"] == "stability_chart"


def test_every_function_that_draws_a_whole_result_takes_axes():
    whole = {*plots.DRAWINGS.values(), draw_special_curve}
    for draw in whole:
        assert "ax" in inspect.signature(draw).parameters, draw


def test_a_picture_stands_below_the_cell_of_a_notebook_and_one_in_own_axes_does_not(monkeypatch):
    pictures, shell = [], SimpleNamespace(kernel=None)
    display = SimpleNamespace(Image=lambda data: data, display=pictures.append)
    motion = saltus.simulate(SYSTEM, theta=0.3, periods=1)
    ax = Figure().subplots()
    with monkeypatch.context() as notebook:
        notebook.setitem(
            sys.modules,
            "IPython",
            SimpleNamespace(get_ipython=lambda: shell, display=display, version_info=(9, 0)),
        )
        saltus.plot(motion)
        assert len(pictures) == 1
        assert pictures[0].startswith(b"\x89PNG")
        saltus.plot(motion, ax=ax)
        del shell.kernel  # a terminal of IPython
        saltus.plot(motion)
    assert len(pictures) == 1


def drawn(results):
    """Each function that draws, with a dataset that it draws."""
    found = {}
    for name in RESULTS:
        result = results(name)
        for each in result if isinstance(result, tuple) else (result,):
            data = each.to_xarray() if hasattr(each, "to_xarray") else each
            found[DRAWINGS.get(str(data.attrs.get("kind", ""))) or _by_content(data)] = data
    return found


@pytest.mark.filterwarnings("ignore")  # of Matplotlib, where values are meant that it cannot show
def test_every_argument_of_what_draws_answers_every_value(results):
    """As the public functions do: a picture, or one sentence."""
    functions, wrong = drawn(results), []
    named = {
        getattr(plots, name) for name in plots.__all__ if hasattr(getattr(plots, name), "answers")
    }
    # tests/test_public_face.py asks these
    assert named - set(functions) <= {saltus.plot, saltus.animate}
    for draw, data in functions.items():
        first, *others = inspect.signature(draw).parameters.values()
        for parameter, value in ((p, value) for p in others for value in values_of(p)):
            try:
                refusal = str(answer(draw, {first.name: data, parameter.name: value}))
            except Exception as error:
                wrong.append((draw.__name__, parameter.name, value, repr(error)))
                continue
            if len(refusal) >= 400:
                wrong.append((draw.__name__, parameter.name, value, f"is long: {refusal}"))
        with pytest.raises(ParameterError, match="did you mean") as misspelt:
            draw(data, **{[first, *others][-1].name + "_": 1})
        assert misspelt.value.parameter.endswith("_")
    assert not wrong, "\n".join(
        f"{name}({parameter}={value!r:.30}) {what:.200}" for name, parameter, value, what in wrong
    )


def test_a_diagram_made_in_python_says_of_what_kind_it_is_and_a_curve_shows_no_raw_arrays(results):
    assert results("saltus.response_spectrum").attrs["kind"] == "response_spectrum"
    assert results("saltus.bifurcation_diagram").attrs["kind"] == "bifurcation_diagram"
    first = results("saltus.separatrices")[0]
    assert "array(" not in repr(first)
    assert f"saddle={first.saddle}" in repr(first)


def test_a_legend_of_two_results_names_what_both_show(results):
    together = (results("saltus.continue_orbit"), results("saltus.frequency_sweep"))
    texts = []
    for parts in (together, together[::-1]):
        figure = saltus.plot(parts).figure
        legends = [*figure.legends, *filter(None, [figure.axes[0].get_legend()])]
        texts.append({text.get_text() for legend in legends for text in legend.get_texts()})
    assert texts[0] == texts[1]
    assert {"up", "down"} <= texts[0]
    assert any("stable" in text for text in texts[0])
