from .questions import Ask
from .results import kind_of, load, open_result, save, to_mat
from .study import Study, load_study

__all__ = ["Ask", "Study", "kind_of", "load", "load_study", "open_result", "save", "to_mat"]
