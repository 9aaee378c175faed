"""What all tests of the reproduction share: the settings of those of saltus, and the command
line.
"""

import shutil

import pytest
from command_line import refused, saltus, started

__all__ = ["refused", "saltus", "started"]


@pytest.fixture(scope="session", autouse=True)
def _speed_measured_for_a_moment():
    """Each reproduction measures the speed of the machine for half a second; of how long it takes
    no test asks for a digit.
    """
    with pytest.MonkeyPatch.context() as here:
        here.setattr("saltus_paper.expected_time.MEASURED", 0.01)
        yield


@pytest.fixture(scope="session")
def _of_three_parts(tmp_path_factory):
    from saltus_paper import reproduce

    folder = tmp_path_factory.mktemp("three_parts")
    reproduce(["fig02", "fig08", "table1"], folder)
    return folder


@pytest.fixture(scope="module")
def results(_of_three_parts, tmp_path_factory):
    """The reproduction of three parts of the paper, which a process makes once, in a folder of the
    file of tests.
    """
    return shutil.copytree(_of_three_parts, tmp_path_factory.mktemp("results") / "results")
