"""Draw the images of the README and of the tutorials: `python docs/draw_images.py [NAME ...]`.

A tutorial saves its pictures by its own code; they are copied from there, so that an image shows
what the page computes. Names are those of tutorials, or `readme`; without any, all are drawn.
"""

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl

DOCS = Path(__file__).parent
IMAGES = DOCS / "images"
sys.path.insert(0, str(DOCS.parent / "tests" / "pages"))
mpl.use("agg")

from code_blocks import blocks  # noqa: E402

import saltus  # noqa: E402


def run(page):
    """The names that the Python of a page leaves."""
    names = {"__name__": "page"}
    for kind, code, _, line in blocks(page.read_text(encoding="utf-8")):
        if kind == "python":
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(code, f"{page.name}:{line}", "exec"), names)
    return names


def readme():
    """The branch of the README's oscillator, and a film of one of its orbits."""
    names = run(DOCS.parent / "README.md")
    axes = saltus.plot(names["branch"], size=(150, 62), legend="right")
    saltus.save(IMAGES / "impact_oscillator.png", axes, dpi=150)
    orbit = saltus.find_orbit(names["system"], x=0.0)
    saltus.animate(orbit, IMAGES / "impact_oscillator.gif", seconds=2.6, fps=20)


def shown(page):
    """The names of the images that a page shows."""
    return re.findall(r"\(\.\./images/([\w.]+)\)", page.read_text(encoding="utf-8"))


def tutorial(page):
    """The images that a page shows, saved by its own code."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        run(page)
        for name in shown(page):
            if os.path.exists(name):
                shutil.copy(name, IMAGES / name)


if __name__ == "__main__":
    pages = {page.stem: page for page in sorted((DOCS / "tutorials").glob("*.md")) if shown(page)}
    for asked in sys.argv[1:] or ["readme", *pages]:
        readme() if asked == "readme" else tutorial(pages[asked])
