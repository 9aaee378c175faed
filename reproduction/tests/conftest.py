"""What all tests of the reproduction share: the settings of those of saltus, and the command line."""

import pytest
from command_line import refused, saltus, started

__all__ = ["refused", "saltus", "started"]


@pytest.fixture(scope="session", autouse=True)
def _speed_measured_for_a_moment():
    """Each reproduction measures the speed of the machine for half a second; of how long it takes no test asks for a digit."""
    with pytest.MonkeyPatch.context() as here:
        here.setattr("saltus_paper.expected_time.MEASURED", 0.01)
        yield
