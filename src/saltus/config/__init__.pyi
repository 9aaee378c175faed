from .results import kind_of as kind_of
from .results import open_result as open_result
from .study import Ask as Ask
from .study import Study as Study
from .study import load_study as load_study
