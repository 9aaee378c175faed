"""In which order the gallery shows the examples, and how each begins."""

import re
from pathlib import Path

import matplotlib.pyplot as plt

from saltus.plots.conventions import LOOK, RC

# the groups by subject, and in each its examples, stand once: in the gallery's first paragraph
HEADER = Path(__file__).parents[2] / "examples" / "GALLERY_HEADER.rst"
ORDER = tuple(re.findall(r"<(\w+)>`", HEADER.read_text(encoding="utf-8")))


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
