"""Results do not depend on threads, order, neighbours, chunks or the width of a register, to the
last bit.
"""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lane_cases import FAMILIES, end_state

import saltus.flow.programs.lane_threads as lanes_run
from saltus.taylor.lane_vectors import WIDTH

OPTIONS = {"sample": ("state", "extrema", "impact_count", "speed"), "last": 3, "tol": 1e-12}
MANY = 2600  # more than two chunks


def cases_of(family, n=MANY):
    return FAMILIES[family](np.random.default_rng([3, *family.encode()]), n)


def same_bits(one, other):
    """Every variable, NaN equal to NaN, zeros with their sign; of the last periods only those that
    both keep.
    """
    kept = min(one.sizes.get("period", 0), other.sizes.get("period", 0))
    if kept:  # fewer than asked for where no trajectory has as many
        one, other = one.isel(period=slice(-kept, None)), other.isel(period=slice(-kept, None))
    assert list(one.data_vars) == list(other.data_vars)
    for name in one.data_vars:
        assert one[name].values.tobytes() == other[name].values.tobytes(), name


@pytest.fixture(scope="module", params=["paper", "records", "rocking"])
def reference(request):
    cases = cases_of(request.param)
    return cases, cases.in_lanes(threads=1, **OPTIONS)


@pytest.mark.parametrize("threads", [1, 2, pytest.param(3, marks=pytest.mark.thorough), 7])
def test_threads_change_nothing(reference, threads):
    cases, expected = reference
    same_bits(cases.in_lanes(threads=threads, **OPTIONS), expected)


def test_the_order_changes_nothing(reference):
    cases, expected = reference
    order = np.random.default_rng(0).permutation(len(cases))
    same_bits(cases.chosen(order).in_lanes(**OPTIONS), expected.isel(trajectory=order))


def test_neighbours_change_nothing(reference):
    cases, expected = reference
    for i in range(0, MANY, 97):
        same_bits(cases.chosen([i]).in_lanes(**OPTIONS), expected.isel(trajectory=[i]))
    rows = np.arange(5, 8)  # fewer than a register holds
    same_bits(cases.chosen(rows).in_lanes(**OPTIONS), expected.isel(trajectory=rows))


@pytest.mark.parametrize(
    ("smallest", "largest"),
    [(1, 1), pytest.param(7, 7, marks=pytest.mark.thorough), (1, 1000), (10**6, 10**6)],
)
def test_chunks_change_nothing(reference, smallest, largest, monkeypatch):
    cases, expected = reference
    settings = replace(lanes_run.SETTINGS, smallest_chunk=smallest, largest_chunk=largest)
    monkeypatch.setattr(lanes_run, "SETTINGS", settings)
    same_bits(cases.in_lanes(threads=2, **OPTIONS), expected)


@pytest.mark.parametrize("threads", [1, 2, 3, 64])
@pytest.mark.parametrize("count", [1, 8, 33, 100, 968, 40_001])
def test_chunks_are_all_trajectories_once(count, threads):
    rows = [row for chunk in lanes_run.chunks(count, threads) for row in range(count)[chunk]]
    assert rows == list(range(count))


def test_a_chunk_of_motions_of_which_much_is_kept_is_small():
    most = lanes_run.SETTINGS.most_samples
    for kept in (1, 64, 1000, 10**5):
        for chunk in lanes_run.chunks(50_000, 1, kept):
            assert chunk.stop - chunk.start <= max(lanes_run.SETTINGS.smallest_chunk, most // kept)


@pytest.mark.parametrize("count", [100, 968, 4000])
def test_no_thread_has_more_than_half_of_its_share_in_its_last_chunk(count):
    for threads in (2, 3):
        last = list(lanes_run.chunks(count, threads))[-1]
        assert last.stop - last.start <= max(count / threads / 2, lanes_run.SETTINGS.smallest_chunk)
        assert len(list(lanes_run.chunks(count, threads))) >= threads


def test_what_is_sampled_changes_nothing_in_the_rest(reference):
    cases, expected = reference
    bare = cases.in_lanes(tol=1e-12, sample=())
    same_bits(bare, expected[list(bare.data_vars)])


def test_tangents_change_nothing_but_rounding():
    cases = cases_of("paper", 300)
    plain, with_tangent = cases.in_lanes(tol=1e-14), cases.in_lanes(tol=1e-14, sensitivities=())
    np.testing.assert_array_equal(plain.stop, with_tangent.stop)
    close = (
        np.abs(end_state(plain, cases.system) - end_state(with_tangent, cases.system)).max(axis=1)
        < 1e-11
    )
    assert close.mean() > 0.97


# --- widths ------------------------------------------------------------------

WIDE = """
import sys
import numpy as np
from lane_cases import FAMILIES, end_state
from saltus.flow import stop_names
from saltus.taylor.lane_vectors import WIDTH
cases = FAMILIES["paper"](np.random.default_rng(8), 400)
ensemble = cases.in_lanes(tol=1e-14, sample=("state", "extrema"))
state, extrema = end_state(ensemble, cases.system), np.stack([ensemble.largest_theta, ensemble.smallest_theta])
stop = stop_names(ensemble).values
np.savez(sys.argv[1], width=WIDTH, state=state, extrema=extrema, stop=stop, impact_count=ensemble.impact_count)
"""


def run_with_width(width, folder):
    """The same ensemble in a process of its own, with a register of `width` doubles."""
    environment = os.environ | {
        "SALTUS_LANES": str(width),
        "PYTHONPATH": os.pathsep.join(
            [
                str(Path(__file__).parent),
                str(Path(__file__).parents[1]),
                os.environ.get("PYTHONPATH", ""),
            ]
        ),
    }
    file = folder / f"width{width}.npz"
    subprocess.run(
        [sys.executable, "-c", WIDE, str(file)], env=environment, check=True, timeout=600
    )
    return np.load(file)


@pytest.mark.thorough
def test_every_width_of_register_gives_the_same_bits(tmp_path):
    """The host's own and one other; all of them with SALTUS_WIDTHS=all, as each compiles the lanes
    anew.
    """
    widths = (
        (1, 2, 4, 8, 16)
        if os.environ.get("SALTUS_WIDTHS") == "all"
        else (WIDTH, 2 if WIDTH != 2 else 1)
    )
    results = {width: run_with_width(width, tmp_path) for width in widths}
    assert [int(r["width"]) for r in results.values()] == list(widths)
    one = results[widths[0]]
    for width, other in results.items():
        for name in ("stop", "impact_count"):
            np.testing.assert_array_equal(one[name], other[name])
        for name in ("state", "extrema"):
            equal = (one[name] == other[name]).mean()
            worst = np.abs(one[name] - other[name]).max()
            assert one[name].tobytes() == other[name].tobytes(), (
                f"width {width}: {name} {equal:.4f} equal, worst {worst:.2g}"
            )
    assert len(set(one["stop"].tolist())) >= 2
