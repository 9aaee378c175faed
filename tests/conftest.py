"""What all tests share: random cases are the same in every run."""

from hypothesis import settings

settings.register_profile("the same in every run", derandomize=True)
settings.load_profile("the same in every run")
