"""Diagrams of a contact with losses: orbits that rest for a part of their period are branches too,
and come back from files.
"""

import math

import numpy as np
import pytest
from shared_systems import forced
from study_cases import AMPLITUDE

import saltus
from saltus import bifurcation_diagram
from saltus.branch_tables import branches_of
from saltus.orbits import orbits_of
from saltus.studies.diagram.diagram_study import confirmed
from saltus.studies.diagram.diagram_work import DiagramWork

SLOW = forced(H=0.15, W=0.2, e=0.3)
CRITICAL = 0.5 / math.tan(math.radians(80))  # Hcr: below it the load does not pull the contact open


def family():
    return saltus.continue_orbit(saltus.find_orbit(SLOW, theta=0.3), AMPLITUDE, (0.1, 0.3))


def test_a_family_that_rests_comes_back_bit_for_bit(tmp_path):
    import xarray as xr

    from saltus.files import write_dataset

    branch = family()
    path = write_dataset(tmp_path / "family.nc", branch.to_xarray())
    with xr.open_dataset(path, engine="h5netcdf") as file:
        back = orbits_of(file.load())
    assert len(back) == len(branch.orbits) > 5
    for orbit, other in zip(branch.orbits, back, strict=True):
        assert orbit.system == other.system
        assert np.array_equal(orbit.releases, other.releases)
        assert np.array_equal(orbit.rests, other.rests)
        assert np.array_equal(orbit.speeds, other.speeds)
        assert (orbit.amplitude, orbit.residual, orbit.stable) == (
            other.amplitude,
            other.residual,
            other.stable,
        )


def test_a_family_that_rests_is_confirmed_over_its_whole_period():
    """The release alone is the same for every orbit: that of another amplitude starts there too,
    and moves otherwise.
    """
    (data,) = confirmed([family()], DiagramWork(SLOW, AMPLITUDE))
    assert data["stable"].all()
    assert data["defect"].max() < 1e-10
    assert data["kept"].max() < 1e-8
    assert data["residual"].max() < 1e-10


@pytest.mark.thorough
def test_a_diagram_has_the_family_that_rests_and_the_one_that_does_not():
    tree = bifurcation_diagram(
        SLOW, AMPLITUDE, (0.05, 0.5), max_period=2, values=[0.07, 0.15, 0.45], starts=8
    )
    assert tree["search"]["at_rest"].values.tolist() == [8, 0, 0]  # only below Hcr = 0.088
    branches = [branch for _, branch in branches_of(tree)]
    assert len(branches) == 2
    resting = next(branch for branch in branches if "releases" in branch)
    moving = next(branch for branch in branches if "releases" not in branch)
    assert float(resting["parameter"].min()) == pytest.approx(CRITICAL, abs=1e-5)
    # beyond it the family goes on without rests
    last = float(resting["parameter"].where(resting["rest_share"] > 0.0).max())
    assert last == pytest.approx(float(moving["parameter"].min()), abs=1e-6)
