"""A diagram is saved and comes back without loss, its orbits too: bit for bit, and ready to be
continued.
"""

import numpy as np
import pytest
import xarray as xr
from shared_systems import forced, walled
from study_cases import FREQUENCY

import saltus
from saltus import search_orbits
from saltus.errors import ParameterError
from saltus.files import write_dataset
from saltus.orbits import orbits_of

FACTS = (
    "amplitude",
    "highest",
    "lowest",
    "residual",
    "slowest",
    "clearance",
    "stable",
    "symmetric",
    "period",
    "admissible",
    "grazes",
)


def reloaded(data, folder):
    """What a file gives back."""
    path = write_dataset(folder / "branch.nc", data)
    with xr.open_dataset(path, engine="h5netcdf") as file:
        return file.load()


def through_a_grazing():
    """Symmetric, from two to six impacts at H = 0.5, Omega = 0.28463."""
    orbit = saltus.find_orbit(forced(H=0.5), theta=0.3)
    return saltus.continue_orbit(orbit, FREQUENCY, (0.283, 1.0))


def from_none_to_one_impact():
    """An oscillator that comes to touch its wall: points without sides beside others with one."""
    return saltus.continue_orbit(
        saltus.find_orbit(walled(wall=0.7), x=0.2), "load.force.amplitude", (0.1, 0.8)
    )


def test_a_tree_comes_back_from_netcdf_as_it_was(spectrum, tmp_path):
    path = write_dataset(tmp_path / "spectrum.nc", spectrum)
    with xr.open_datatree(path, engine="h5netcdf") as file:
        assert file.load().identical(spectrum)


@pytest.mark.parametrize("make", [through_a_grazing, from_none_to_one_impact])
def test_orbits_come_back_bit_for_bit(make, tmp_path):
    branch = make()
    crossings = {orbit.signature.impact_count for orbit in branch.orbits}
    assert len(crossings) > 1
    back = orbits_of(reloaded(branch.to_xarray(), tmp_path))
    assert len(back) == len(branch.orbits)
    for orbit, other in zip(branch.orbits, back, strict=True):
        assert orbit.signature == other.signature
        assert orbit.system == other.system
        assert {name: getattr(orbit, name) for name in FACTS} == {
            name: getattr(other, name) for name in FACTS
        }
        assert np.array_equal(orbit.solution.unknowns, other.solution.unknowns)
        assert np.array_equal(orbit.multipliers, other.multipliers, equal_nan=True)
        assert np.array_equal(orbit.impact_times, other.impact_times)
        assert orbit.start() == other.start()


def test_a_branch_goes_on_from_a_file(tmp_path):
    branch = saltus.continue_orbit(
        saltus.find_orbit(forced(H=0.5), theta=0.3), FREQUENCY, (0.95, 1.1)
    )
    last = orbits_of(reloaded(branch.to_xarray(), tmp_path))[0]
    further = saltus.continue_orbit(last, FREQUENCY, (0.7, 1.1))
    folds = [point.parameter for point in further.special if point.kind == "LP"]
    assert sorted(folds) == pytest.approx([0.848485265597, 0.908810732539], abs=1e-10)


def test_the_orbits_of_a_curve_come_back_too(tmp_path):
    branch = saltus.continue_orbit(
        saltus.find_orbit(forced(H=0.5), theta=0.3), FREQUENCY, (0.8, 1.1)
    )
    fold = next(point for point in branch.special if point.kind == "LP")
    curve = saltus.continue_special(fold, "load.horizontal.amplitude", (0.45, 0.55))
    back = orbits_of(reloaded(curve.to_xarray(), tmp_path))
    assert len(back) == len(curve.points)
    for orbit, other in zip(curve.orbits, back, strict=True):
        assert np.array_equal(orbit.solution.values, other.solution.values)
        assert orbit.system == other.system
        assert orbit.residual == other.residual
        assert np.array_equal(orbit.multipliers, other.multipliers)


def test_what_is_no_branch_is_refused(spectrum):
    with pytest.raises(
        ParameterError, match=r"dataset must be the dataset of a branch.*lacks 'unknowns'"
    ):
        orbits_of(spectrum["attractors"].to_dataset())
    branch = saltus.branch_of(spectrum, 0)
    with pytest.raises(ParameterError, match="lacks 'system'"):
        orbits_of(branch.drop_attrs())


def test_orbits_that_repel_are_kept_too(tmp_path):
    """Unstable orbits cannot be simulated into; their unknowns are all there is."""
    found = search_orbits(forced(H=1.0), FREQUENCY, [2.4], max_period=3, starts=16, repelling=3)
    repelling = next(orbit for orbit in found.orbits if not orbit.stable)
    branch = saltus.continue_orbit(repelling, FREQUENCY, (2.39, 2.41))
    back = orbits_of(reloaded(branch.to_xarray(), tmp_path))
    assert not any(orbit.stable for orbit in back)
    assert max(orbit.defect for orbit in back) < 1e-9
