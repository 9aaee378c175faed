"""The texts of the kernels: each is made of several files, whose names share one space."""

import ast
from collections import Counter

import pytest

from saltus.flow.programs import compiled, compiled_lanes

TEXTS = {
    "one contact": compiled.one_contact_text,
    "several contacts": compiled.contacts_text,
    "lanes of one contact": lambda: compiled_lanes.driver_text(False),
    "lanes of several contacts": lambda: compiled_lanes.driver_text(True),
    "helpers of one contact": lambda: compiled_lanes.helpers_text(False),
    "helpers of several contacts": lambda: compiled_lanes.helpers_text(True),
}


def names_of(text):
    """The names that the top level of a text gives to values and functions, each as often."""
    for statement in ast.parse(text).body:
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            yield statement.name
        for target in statement.targets if isinstance(statement, ast.Assign) else ():
            yield from (node.id for node in ast.walk(target) if isinstance(node, ast.Name))


@pytest.mark.parametrize("kernel", TEXTS)
def test_no_two_files_of_a_kernel_use_one_name(kernel):
    """The second one would be taken for both: motions would go on, with another number."""
    found = Counter(names_of(TEXTS[kernel]()))
    assert len(found) > 50
    assert [name for name, count in found.items() if count > 1] == []
