"""A small diagram that several tests look at."""

import pytest
from study_cases import detached


@pytest.fixture(scope="session")
def spectrum():
    """The DataTree of that diagram; not to be changed."""
    return detached()


@pytest.fixture(scope="session")
def branches(spectrum):
    """The datasets of its branches."""
    return [spectrum[name].to_dataset() for name in sorted(spectrum.children) if name.startswith("branch_")]
