"""A study as a TOML file: a system and how to simulate it, read with `load_study`.

Whatever is wrong with a file is said in one sentence with the file, the line and the dotted key. Parameters are those of the
dataclasses in `saltus.systems`; nothing is listed twice. The format is described in docs/study.md.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
