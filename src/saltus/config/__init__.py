"""A study as a TOML file: a system and how to simulate it, read with `load_study`.

A file with an error is refused with a ParameterError of one sentence, with the file and the dotted
key. The keys of a table are the fields of the dataclasses in `saltus.systems` and the arguments of
the functions that answer a question, so that nothing is listed twice. The tables become the
dictionaries that `System.from_dict` takes. docs/study.md describes the format.
"""

from saltus._front_door import front_door

__getattr__, __dir__, __all__ = front_door(__name__, __file__)
