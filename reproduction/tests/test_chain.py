"""The chain of eight cells: the waves of a row, their multipliers from one cell, and what the
chapter says of them.
"""

import numpy as np
import pytest
from picture_checks import check_provenance, clipped

from saltus import simulate
from saltus_paper import ClaimVerdict
from saltus_paper.figures.chain import FIGURE, measured_traces
from saltus_paper.figures.chain_waves import (
    PERIOD,
    angles_at,
    at_load,
    begun,
    chain,
    largest,
    shapes,
    transverse,
    turning,
    wave_numbers,
)


@pytest.mark.parametrize("cells", [2, 5, 8])
def test_waves_are_those_of_the_differences_between_neighbours(cells):
    """Their matrix is built from the springs one by one."""
    springs = np.diff(np.eye(cells), axis=0)
    values, vectors = np.linalg.eigh(springs.T @ springs)
    np.testing.assert_allclose(wave_numbers(cells), values, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(shapes(cells) * vectors.T, axis=1)), 1.0, atol=1e-12)


def test_without_springs_a_wave_has_the_multipliers_of_the_cell():
    orbit = at_load(0.1)
    values = np.linalg.eigvals(transverse(orbit, np.zeros(1))[0])
    np.testing.assert_allclose(
        np.sort_complex(values), np.sort_complex(orbit.multipliers), atol=1e-9
    )


def test_waves_of_eight_cells_grow_as_the_equations_of_one_cell_say():
    data = measured_traces()
    np.testing.assert_allclose(data["found"], data["expected"], atol=1e-6)


def test_cells_part_below_a_load_and_not_above_it():
    """At kappa = 0.1: the wave of largest multiplier grows by it at Hhat = 0.06; at 0.149 all die
    away.
    """
    for load, grows in ((0.06, True), (0.149, False)):
        one = at_load(load)
        multiplier = np.abs(largest(transverse(one, 0.1 * wave_numbers()))[1:]).max()
        assert bool(multiplier > 1.1) is grows
        time, state = turning(one)
        states = state + 1e-6 * np.stack(
            [np.random.default_rng(3).standard_normal(8), np.zeros(8)], axis=1
        )
        system = chain(load, 0.1)
        motion = simulate(system, **begun(system, states, time), periods=40, tol=1e-12)
        spread = np.ptp(angles_at(motion, time + PERIOD * np.array([20, 40])), axis=0)
        assert (spread[1] / spread[0]) ** (1 / 20) == pytest.approx(multiplier, rel=0.02)


@pytest.mark.thorough
def test_the_chapter_holds_and_its_picture_is_whole():
    data = FIGURE.compute(**FIGURE.quick)
    check_provenance(FIGURE.name, data)
    claims = FIGURE.claims(data)
    assert [claim.id for claim in claims if claim.verdict is not ClaimVerdict.HOLDS] == []
    assert len(claims) == 6
    assert clipped(FIGURE.draw(data)) == []
