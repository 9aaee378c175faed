"""What all tests share: random cases are the same in every run."""

import gc

from hypothesis import settings
from hypothesis.internal.conjecture import providers

settings.register_profile("the same in every run", derandomize=True)
settings.load_profile("the same in every run")

# Among random numbers Hypothesis mixes those that stand in the sources of the modules that have
# been imported: they depend on the tests that ran before in the same process. It also reads all of
# the generated sources, for ten seconds in each process.
if hasattr(providers, "_get_local_constants") and hasattr(providers, "_local_constants"):
    providers._get_local_constants = lambda: providers._local_constants


def pytest_collection_finish() -> None:
    """What has been imported stays: garbage is not looked for in it, and less often, as that takes
    a tenth of the time.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000)
