"""In which order the gallery shows the examples, and how each begins."""

import matplotlib.pyplot as plt

from saltus.plots.conventions import LOOK, RC

TASKS = (  # what people do after their first motion, named in the gallery's first paragraph
    *(
        "preloaded_stop",
        "at2_record",
        "overturning_spectrum",
        "harvester",
        "identification",
        "basins",
    ),
    *(
        "design_grid",
        "animation",
        "notebook",
        "mass_chain",
        "elastic_bar",
        "beam_on_stop",
        "beam_on_hard_stop",
        "ten_masses",
    ),
)
ORDER = (
    *(
        "quickstart",
        *TASKS,
        "potential_wells",
        "coming_to_rest",
        "rocking_block",
        "housner",
        "overturning",
        "bilinear",
    ),
    *(
        "duffing",
        "two_stops",
        "piezo_harvester",
        "belt",
        "wall_orbits",
        "up_and_down",
        "grazing",
        "orbits",
        "period_doubling",
    ),
    *(
        "resting_orbit",
        "response_spectrum",
        "chaos",
        "capture",
        "erosion",
        "ensemble",
        "stability_chart",
        "sensitivities",
    ),
    *("smoothing", "two_layers", "cell_chain", "impact_pair", "record", "physical_units"),
)


def place(name):
    """Where a file stands in the gallery; what is not listed comes last, by its name."""
    stem = name.rpartition("/")[2].removesuffix(".py")
    return (ORDER.index(stem) if stem in ORDER else len(ORDER), stem)


class InOrder:
    """The key by which sphinx-gallery sorts files."""

    def __init__(self, folder):
        self.folder = folder

    def __call__(self, name):
        return place(name)


def reset(_, __):
    """Every example begins with the house's settings, with letters that can be read on a thumbnail."""
    plt.rcdefaults()
    letters = {
        name: size + 3.0
        for name, size in RC.items()
        if name.endswith("size") and "major" not in name
    }
    plt.rcParams.update(
        RC | letters | {"figure.figsize": (5.6, 4.0), "figure.dpi": 100, "savefig.dpi": 140}
    )
    # those of saltus.plot first
    colours = [LOOK.stable, LOOK.unstable, LOOK.limit, "#e08214", "#7b5ea7", "#5f6b76"]
    plt.rcParams["axes.prop_cycle"] = plt.cycler(color=colours)
    plt.rcParams["figure.constrained_layout.use"] = True
