"""What `saltus run` prints of an answer."""

import numpy as np
import xarray

from saltus.branch_tables import branch_tables
from saltus.cli.summaries import summarise


def test_a_branch_that_begins_at_its_own_image_has_the_period_of_its_other_orbits():
    branch = xarray.Dataset(
        {
            "period": ("point", [1, 2, 2]),
            "parameter": ("point", [0.87, 0.9, 0.95]),
            "stable": ("point", np.ones(3, dtype=int)),
        }
        | {
            "kind": ("special", np.empty(0, dtype=str)),
            "special_parameter": ("special", np.empty(0)),
        }
    )
    bands = xarray.Dataset({name: ("band", np.empty(0)) for name in ("low", "high", "exponent")})
    tree = xarray.DataTree.from_dict(branch_tables([branch]) | {"bands": bands})
    tree.attrs["path"] = "load.frequency"
    (line,) = summarise("response_spectrum", tree)
    assert line.startswith("branch 0: period 2, load.frequency 0.87 to 0.95, 3 of 3 points stable")
