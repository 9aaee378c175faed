"""A study as a TOML file: a system and how to simulate it, read with `load_study`.

Whatever is wrong with a file is refused with a ParameterError of one sentence: the file, the line and the dotted key. The keys
of a table are the fields of the dataclasses in `saltus.systems` and the arguments of the functions that answer a question, so
nothing is listed twice. The values become what `System.from_dict` takes. The format is described in docs/study.md.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
