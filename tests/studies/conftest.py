"""A small diagram that several tests look at."""

import pytest
from study_cases import detached

from saltus.branch_tables import branches_of


@pytest.fixture(scope="session")
def spectrum():
    """The DataTree of that diagram; not to be changed."""
    return detached()


@pytest.fixture(scope="session")
def branches(spectrum):
    """The datasets of its branches."""
    return [branch for _, branch in branches_of(spectrum)]
