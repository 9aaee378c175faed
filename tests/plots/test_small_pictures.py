"""Pictures in the width of a column: panels that can be read, all kinds of special points, and no
entry of a legend that nothing has.
"""

import numpy as np
import pytest

import saltus


@pytest.fixture(scope="module")
def spectrum():  # type: ignore[no-untyped-def]
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1),
        load=saltus.Load(frequency=2.5, force=saltus.Harmonic(0.5)),
        impact=saltus.VelocityReduction(0.8),
    )
    return saltus.response_spectrum(
        system,
        bounds=(1.15, 1.6),
        effort="quick",
        max_period=1,
        values=[1.3, 1.5],
        starts=4,
        switch=False,
        bands=False,
    )


@pytest.mark.parametrize("size", ["column", "page"])
def test_panels_of_a_diagram_are_high_enough_to_be_read(spectrum, size: str) -> None:  # type: ignore[no-untyped-def]
    axes = saltus.plot(spectrum, size=size)
    figure = axes[0].figure
    figure.draw_without_rendering()
    width, height = 25.4 * figure.get_size_inches()
    assert width == pytest.approx({"column": 90.0, "page": 190.0}[size])
    for ax in axes:
        assert ax.get_position().height * height > 30.0


def test_a_legend_names_no_kind_of_special_point_that_is_not_drawn(spectrum) -> None:  # type: ignore[no-untyped-def]
    axes = saltus.plot(spectrum, size="column")
    kinds = set(spectrum["special"]["kind"].values.tolist())
    assert {"GR", "LP"} <= kinds
    marks = {line.get_marker() for line in axes[0].lines if line.get_linestyle() == "None"}
    from saltus.plots.response import MARKS

    inside = {
        str(kind)
        for kind, at in zip(
            spectrum["special"]["kind"].values,
            spectrum["special"]["special_parameter"].values,
            strict=True,
        )
        if kind in MARKS and 1.15 <= at <= 1.6
    }
    assert {MARKS[kind]["marker"] for kind in inside} <= marks


def test_a_branch_without_unstable_motions_has_none_in_its_legend() -> None:
    system = saltus.System(
        model=saltus.WallOscillator(damping=0.1, wall=5.0),
        load=saltus.Load(frequency=2.0, force=saltus.Harmonic(0.5)),
        impact=saltus.VelocityReduction(0.8),
    )
    branch = saltus.continue_orbit(saltus.find_orbit(system, x=0.0), "load.frequency", (1.8, 2.2))
    assert np.all(branch.stable)
    (legend,) = saltus.plot(branch).figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["stable"]
