"""Results laid over a page with its real engine: what clicks and keys choose, against Python."""

from __future__ import annotations

import numpy as np
import pytest
import results_of_all_kinds as made
from computing_page import BROWSER, SETTLED, ComputingPage, click_at, field, state, text
from results_of_all_kinds import SYSTEM

import saltus

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium, Chrome or Edge is installed here"
)


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    """A page with a branch, a chart, basins and a manifold laid over it."""
    results = (made.branch(), made.chart(), made.basins(), made.manifold())
    file = saltus.page(
        SYSTEM, *results, path=tmp_path_factory.mktemp("page") / "results.html", theta=0.3
    )
    page = ComputingPage(str(BROWSER), tmp_path_factory.mktemp("profile"))
    page.open(file, 1440, 1000)
    yield page
    page.close()


@pytest.fixture
def page(window):
    window.errors.clear()
    window.evaluate(
        "saltusPage.replaceState({...saltusPage.first, selected: null}), "
        "document.activeElement.blur()"
    )
    choose(window, 0)
    yield window
    assert window.errors == []


def choose(page, result):
    """Choose the result that is shown."""
    page.evaluate(
        f"(() => {{ const c = document.querySelector('#result-choice'); c.value = '{result}'; "
        "c.dispatchEvent(new Event('change')); })()"
    )
    page.evaluate(SETTLED)


def end_of_motion(page):
    """The state at the end of the motion that the page shows."""
    return np.array(
        page.evaluate(
            "(() => { const m = saltusPage.session.motion; return [...m.state(m.time.last)]; })()"
        )
    )


def shows_the_orbit(page, point):
    """Check that the page shows an orbit of the branch: its number, start and period, what is said
    of it, and that it closes.
    """
    orbit, now = made.branch().orbits[point], state(page)
    assert now["selected"] == {"result": 0, "branch": 0, "point": point}
    assert now["values"][made.FREQUENCY] == made.branch().parameters[point]
    assert now["periods"] == orbit.period
    start = orbit.start()
    assert now["start"] == pytest.approx(
        {
            "theta": start["theta"],
            "theta_velocity": start["velocity"],
            "time": start.get("time", 0.0),
        },
        abs=1e-12,
    )
    np.testing.assert_allclose(end_of_motion(page), [start["theta"], start["velocity"]], atol=1e-8)
    said = text(page, "#orbit")
    assert f"frequency = {float(made.branch().parameters[point])!r}" in said
    assert f"period {orbit.period}, {'stable' if orbit.stable else 'unstable'}" in said
    assert said.split("multipliers ")[1].count(",") == len(orbit.multipliers) - 1
    assert "residual " in said


@pytest.mark.parametrize("stable", [True, False])
def test_a_click_on_a_branch_sets_the_parameter_and_shows_the_orbit(page, stable):
    branch = made.branch()
    inner = range(3, len(branch.points) - 3)
    point = max(
        (i for i in inner if branch.stable[i] == stable),
        key=lambda i: branch.amplitudes[i] if stable else -abs(branch.parameters[i] - 0.88),
    )
    click_at(page, "result", float(branch.parameters[point]), float(branch.amplitudes[point]))
    shows_the_orbit(page, page.evaluate("saltusPage.store.state.selected.point"))
    assert abs(state(page)["selected"]["point"] - point) <= 1  # of points that lie within a pixel
    assert bool(made.branch().stable[state(page)["selected"]["point"]]) == stable


def test_arrow_keys_step_along_the_branch_past_its_fold_and_stop_at_its_ends(page):
    branch = made.branch()
    fold = next(i for i in range(1, len(branch.points)) if branch.stable[i] != branch.stable[i - 1])
    page.evaluate(f"saltusPage.choice.orbit(saltusPage.results[0], 0, {fold - 1})")
    page.evaluate("saltusPage.plotOf('result').top.focus()")
    for step in (0, 1):
        page.press("ArrowRight", 39)
        shows_the_orbit(page, fold + step)
    page.press("ArrowLeft", 37)
    shows_the_orbit(page, fold)
    page.evaluate("saltusPage.choice.orbit(saltusPage.results[0], 0, 0)")
    page.press("ArrowLeft", 37)
    shows_the_orbit(page, 0)


def test_a_click_into_a_chart_starts_the_largest_motion_of_its_cell(page):
    choose(page, 1)
    data = made.chart()
    for horizontal, vertical in ((0.5, -0.5), (0.3, -1.0)):
        click_at(page, "result", horizontal, vertical)
        now = state(page)
        assert now["values"][made.AMPLITUDE] == horizontal
        assert now["values"]["load.vertical"] == vertical
        largest = page.evaluate(
            """(() => { const m = saltusPage.session.motion, T = saltusPage.session.period;
        const times = Float64Array.from({length: 4000}, (_, i) => m.time.last - 6 * T * (i / 4000));
        return Math.max(...m.sample(times).theta.map(Math.abs)); })()"""
        )
        assert largest == pytest.approx(
            float(data["amplitude"].sel(horizontal=horizontal, vertical=vertical)), rel=1e-5
        )
        assert state(page)["values"]["model.damping"] == 0.1


def test_a_click_sets_all_numbers_of_the_result_and_the_page_says_that_they_differ(page):
    page.type(field("model.damping"), "0.2")
    page.evaluate(SETTLED)
    assert text(page, "#differing") == "Computed for damping = 0.1; a click sets these numbers."
    branch = made.branch()
    click_at(page, "result", float(branch.parameters[5]), float(branch.amplitudes[5]))
    assert state(page)["values"]["model.damping"] == 0.1
    assert text(page, "#differing") == ""  # as the state has been drawn


def test_basins_and_manifolds_lie_beneath_the_phase_plane_while_the_numbers_are_theirs(page):
    def paper():
        """The share of the phase plane that is empty paper."""
        return page.evaluate("""(() => { const {base} = saltusPage.plotOf('phase');
        const copy = new OffscreenCanvas(base.width, base.height).getContext('2d', {willReadFrequently: true});
        copy.drawImage(base, 0, 0);
        const all = copy.getImageData(0, 0, base.width, base.height).data; let empty = 0;
        for (let i = 0; i < all.length; i += 4) if (Math.min(all[i], all[i + 1], all[i + 2]) === 255) empty++;
        return (4 * empty) / all.length; })()""")

    assert paper() < 0.5
    page.type(field("model.damping"), "0.2")
    page.evaluate(SETTLED)
    assert paper() > 0.7
