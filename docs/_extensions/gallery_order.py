"""In which order the gallery shows the examples, and how each begins."""

import matplotlib.pyplot as plt

from saltus.plots.conventions import LOOK, RC

GROUPS = {  # by subject, as the first paragraph of the gallery lists them
    "Impacts and stops": (
        "wall_orbits hammered grazing two_stops preloaded_stop impact_pair shaken_table up_and_down"
    ),
    "Rocking blocks and records": (
        "rocking_block housner overturning overturning_spectrum at2_record record falling_block"
    ),
    "Friction, backlash, soft stops": "belt stribeck rubbing_absorber backlash bilinear soft_stop",
    "Structures": "mass_chain ten_masses elastic_bar beam_on_stop beam_on_hard_stop large_beam_with_stop",
    "Harvesters and coordinates of first order": "harvester piezo_harvester",
    "Orbits, branches, spectra": (
        "orbits period_doubling resting_orbit proved_orbit proved_fold response_spectrum duffing square_wave smoothing"
    ),
    "Attractors and chaos": (
        "basins erosion capture chaos coming_to_rest potential_wells ensemble stability_chart"
    ),
    "The metainterface": "quickstart two_layers cell_chain physical_units",
    "Fits, design, other programs": "identification sensitivities design_grid from_sympy in_jax",
    "To show": "animation notebook",
}
ORDER = tuple(name for names in GROUPS.values() for name in names.split())


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
    """Every example begins with the house's settings, with letters that can be read on a
    thumbnail.
    """
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
