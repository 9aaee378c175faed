"""Both kernels and the functions of every class of models are compiled for the page, on every
machine to the same bytes.

These tests need no browser and no node: what a page lacks is read from what the modules import.
"""

import os
from pathlib import Path

import numba
import pytest
from what_works.model_classes import NAMES, model_class, system_of
from what_works.refused import REFUSED

import saltus
from saltus.web import objects
from saltus.web.description import page_parts

# What each kernel is given by a structure: nothing, as functions are places of the page's table.
KERNELS = {"one contact": False, "several contacts": True}
OTHER_MACHINES = {
    "AVX2": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx,+avx2,+fma,-avx512f"},
    "SSE": {"NUMBA_CPU_NAME": "nehalem", "NUMBA_CPU_FEATURES": "+sse4.2,-avx,-avx2,-fma"},
}


# what each module takes from the page
SHARED = {"__linear_memory", "__indirect_function_table", "__stack_pointer"}


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_kernel_of_the_page_calls_nothing_that_is_not_in_it(kernel):
    imported = _imports(objects.kernel_code(KERNELS[kernel]))
    assert imported
    assert imported <= SHARED


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_kernel_of_the_page_names_no_folder_of_this_machine(kernel):
    """Where numba lies is in its exceptions, one of them of `int_power`."""
    code = objects.kernel_code(KERNELS[kernel])
    assert str(Path(numba.__file__).parent).encode() not in code
    assert b"numbers.py" not in code


@pytest.mark.parametrize("name", NAMES)
def test_every_class_of_models_has_a_page_or_is_refused_in_one_sentence(name, tmp_path):
    system, start = system_of(name), model_class(name).whole_start
    if (name, "page") in REFUSED:
        with pytest.raises(saltus.ParameterError, match=REFUSED[name, "page"]):
            saltus.page(system, path=tmp_path / "page.html", **start)
        return
    content, described = page_parts(system)
    kernel, structure = described["engine"]["code_sizes"]
    assert len(content) == kernel + structure
    assert _imports(content[:kernel]) <= SHARED
    assert _imports(content[kernel:]) <= SHARED | set(objects.KERNEL_FUNCTIONS)
    assert described["engine"]["several"] == system.model.holds_coordinates
    assert saltus.page(system, path=tmp_path / "page.html", **start).stat().st_size > 50_000


def _imports(code):
    """The names that a module imports: its second section, behind the types."""
    assert code[:8] == b"\0asm\1\0\0\0"
    at = 8

    def number():
        nonlocal at
        value = shift = 0
        while True:
            byte, at = code[at], at + 1
            value, shift = value | (byte & 0x7F) << shift, shift + 7
            if byte < 0x80:
                return value

    def text():
        nonlocal at
        size = number()
        at += size
        return code[at - size : at].decode()

    kind, at = code[at], at + 1
    assert kind == 1
    size = number()
    at += size
    kind, at = code[at], at + 1
    assert kind == 2
    number()
    names = set()
    for _ in range(number()):
        text()
        names.add(text())
        kind, at = code[at], at + 1
        if kind == 0:  # a function and its type
            number()
        elif kind == 3:  # a global: its type, and whether it changes
            at += 2
        else:  # a table with its kind, or a memory, and their limits
            at += kind == 1
            bounded = number() & 1
            number()
            if bounded:
                number()
    return names


def check_other_machines(several, monkeypatch, machines):
    """A kernel's module is the same to the last byte where another processor is named, and
    where Python orders its sets otherwise.
    """
    known = objects.kernel_code(several)
    for number, name in enumerate(machines):
        for key, value in OTHER_MACHINES[name].items():
            monkeypatch.setitem(os.environ, key, value)
        monkeypatch.setitem(os.environ, "PYTHONHASHSEED", str(number + 1))
        assert objects._made_elsewhere(several) == known, name


def test_the_kernel_of_one_contact_is_the_same_on_every_machine(monkeypatch):
    check_other_machines(False, monkeypatch, ["SSE"])


@pytest.mark.thorough
def test_both_kernels_are_the_same_on_every_machine(monkeypatch):
    for several in KERNELS.values():
        check_other_machines(several, monkeypatch, OTHER_MACHINES)


def test_the_functions_of_a_structure_are_the_same_for_any_number_of_lanes():
    """They are written for one number at a time and without fused multiply-adds."""
    written = {
        function.name: function.arithmetic.unfused()
        for name in ("one contact", "both layers")
        for function in saltus.flow.PortableMotion(system_of(name)).functions()
    }
    assert {arithmetic.width for arithmetic in written.values()} == {1}
    assert not any(arithmetic.fused for arithmetic in written.values())
