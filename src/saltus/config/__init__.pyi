from .questions import Ask
from .settings import Settings
from .study import Study, load_study

__all__ = ["Ask", "Settings", "Study", "load_study"]
