"""A study as a TOML file: a system and how to simulate it, read with `load_study`.

Whatever is wrong with a file is said in one sentence with the file, the line and the dotted key. Parameters are those of the
dataclasses in `saltus.systems`; nothing is listed twice. The format is described in docs/study.md.
"""

from saltus.config.settings import Settings
from saltus.config.study import Study, load_study

__all__ = ["Settings", "Study", "load_study"]
