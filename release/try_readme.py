"""Run the blocks of the README and of the tour, and make one page, with nothing but the wheel:
`python try_readme.py CHECKOUT FOLDER`, from another folder than the checkout.

Of the checkout only these two pages and what runs their blocks are read; saltus is the installed one.
"""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

CHECKOUT, FOLDER = Path(sys.argv[1]), Path(sys.argv[2])
sys.path.insert(0, str(CHECKOUT / "tests" / "pages"))
os.environ["MPLBACKEND"] = "agg"

from code_blocks import Page, blocks  # noqa: E402

import saltus  # noqa: E402

if Path(saltus.__file__).is_relative_to(CHECKOUT):
    sys.exit("this is the checkout's saltus, not that of the wheel")


def command(*arguments):
    """`saltus` in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "saltus", *arguments],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "COLUMNS": "100", "NO_COLOR": "1"},
    )
    return SimpleNamespace(output=done.stdout + done.stderr)


# what a page's blocks need of pytest's fixture, with nothing to undo in a process of its own
patches = SimpleNamespace(
    setitem=lambda table, name, value: table.update({name: value}),
    chdir=os.chdir,
    syspath_prepend=lambda folder: sys.path.insert(0, str(folder)),
)
FOLDER.mkdir(parents=True, exist_ok=True)
pages = [CHECKOUT / "README.md", CHECKOUT / "docs" / "tour.md"]
for page in pages:
    Page(page, FOLDER, command, patches).run()
system = saltus.System(
    model=saltus.TwoStops(left=-0.5, right=0.5),
    load=saltus.Load(frequency=1.2, force=saltus.Harmonic(0.5)),
    impact=saltus.NewtonImpact(e=0.7),
)
made = saltus.page(system, path=FOLDER / "page.html")
if made.stat().st_size < 50_000:
    sys.exit("the page has no code")
kinds = [kind for page in pages for kind, *_ in blocks(page.read_text(encoding="utf-8"))]
print(
    f"{kinds.count('python') + kinds.count('console')} blocks of the README and the tour, and a"
    " page"
)
