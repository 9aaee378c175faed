"""Say what is still missing before saltus can be cited: `python release/publication.py`.

`publication.toml` beside this file is the one place to fill in; status 1 while something is empty
or does not stand where readers look for it. `make release-check` runs it last.
"""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
# where each entry must stand once it is known
PLACES = {
    "repository": ("README.md", "CITATION.cff", "pyproject.toml"),
    "site": ("README.md", "pyproject.toml"),
    "doi": ("README.md", "CITATION.cff"),
    "contact": ("CODE_OF_CONDUCT.md",),
    "authors": ("CITATION.cff", "paper/paper.md", ".zenodo.json"),
}


def missing(root: Path = ROOT) -> list[str]:
    """A sentence for each entry that is empty, and for each place that does not have it."""
    given = tomllib.loads((root / "release" / "publication.toml").read_text(encoding="utf-8"))
    sentences = []
    for name, places in PLACES.items():
        value = given.get(name)
        if not value:
            sentences.append(f"release/publication.toml: {name} is empty")
            continue
        words = [value] if isinstance(value, str) else [each["family-names"] for each in value]
        for place in places:
            text = (root / place).read_text(encoding="utf-8")
            sentences += [f"{place} does not have {word}" for word in words if word not in text]
    return sentences


if __name__ == "__main__":
    found = missing()
    print("\n".join(found) or "Everything that readers need to cite saltus is filled in.")
    sys.exit(bool(found))
