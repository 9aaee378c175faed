"""A mistake in a user's own class is one sentence when `System` is made, whatever its contract."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import saltus
from saltus.errors import TraceError


def _class(**methods):
    class Own(saltus.ContactModel):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)
        channels: ClassVar[tuple[str, ...]] = ("force",)
        contacts: ClassVar[tuple] = (saltus.Contact(name="wall", coordinate="x"),)
        frictions: ClassVar[tuple] = (saltus.Friction(name="rub", coordinate="x", kinetic=0.1),)

        def force(self, t, q, velocity, load):
            return load.force(t) - q

    for name, method in methods.items():
        setattr(Own, name, method)
    return dataclass(frozen=True, kw_only=True)(Own)


LOAD = saltus.Load(frequency=1.0, force=saltus.Harmonic(1.0))


@pytest.mark.parametrize(
    ("method", "says"),
    [
        (
            {"force": lambda self, t, q, velocity, load: load.force(t) - q[0]},
            r"Own\.force \(test_user_code\.py:\d+\) failed: TypeError: .*; with one coordinate .* write q, not q\[0\]",
        ),
        (
            {"mass_matrix": lambda self, q: 1.0 / 0},
            r"Own\.mass_matrix \(test_user_code\.py:\d+\) failed: ZeroDivisionError: ",
        ),
        (
            {"normal_forces": lambda self, t, q, velocity, load: [][0]},
            r"Own\.normal_forces \(test_user_code\.py:\d+\) failed: IndexError: ",
        ),
    ],
    ids=["force", "mass_matrix", "normal_forces"],
)
def test_a_mistake_names_the_method(method, says):
    with pytest.raises(TraceError, match=says):
        saltus.System(model=_class(**method)(), load=LOAD, impact=saltus.NewtonImpact(e=0.5))


def _soft(x):
    return x if x > 0.0 else 0.0


@pytest.mark.parametrize(
    ("force", "at", "wrong", "right"),
    [
        (
            lambda self, t, q, velocity, load: -q if q > 0.0 else q,
            None,
            "may not branch on its state or parameters",
            ": write np.where(x > 0.0, a, b)",
        ),
        (
            lambda self, t, q, velocity, load: -math.sin(q),
            None,
            "has no number yet",
            ": use NumPy's functions, not math's; allowed are",
        ),
        (
            lambda self, t, q, velocity, load: -np.interp(q, [0, 1], [0, 2]),
            None,
            "np.interp cannot be traced",
            "; allowed are + - * /, powers, abs, and NumPy's sqrt",
        ),
        (
            lambda self, t, q, velocity, load: -np.floor(velocity),
            None,
            "np.floor cannot be traced",
            "; allowed are",
        ),
        (
            lambda self, t, q, velocity, load: -_soft(q),
            _soft,
            "may not branch on its state or parameters",
            ": write np.where(x > 0.0, a, b)",
        ),
    ],
    ids=["if", "math", "numpy", "numpy of a velocity", "a function beside the class"],
)
def test_a_refusal_says_where_what_and_then_what_would_be_right(force, at, wrong, right):
    with pytest.raises(TraceError) as refusal:
        saltus.System(model=_class(force=force)(), load=LOAD, impact=saltus.NewtonImpact(e=0.5))
    said = str(refusal.value)
    line = (at or force).__code__.co_firstlineno + (1 if at else 0)
    assert said.startswith(f"Own.force (test_user_code.py:{line}): ")
    assert 0 < said.index(wrong) < said.index(right)
    assert " ... " not in said  # it is not cut


def test_a_branch_of_a_smooth_model_is_told_of_the_side_of_a_contact():
    @dataclass(frozen=True, kw_only=True)
    class Bent(saltus.Model):
        coordinates: ClassVar[tuple[str, ...]] = ("x",)

        def acceleration(self, t, x, velocity, side, load):
            return -x if x > 0.0 else 0.0

    with pytest.raises(TraceError) as refusal:
        saltus.System(model=Bent())
    said = str(refusal.value)
    assert said.startswith("Bent.acceleration (test_user_code.py:")
    assert "write np.where" not in said  # which would be refused next
    assert said.index("may not branch") < said.index("use `side`") < said.index("a ContactModel")


def test_a_force_without_contacts_may_have_switches_too():
    with pytest.raises(TraceError) as refusal:
        saltus.System(
            model=_class(
                contacts=(),
                frictions=(),
                force=lambda self, t, q, velocity, load: -q if velocity > 0.0 else q,
            )()
        )
    said = str(refusal.value)
    assert "(if, and, or, min, max): write np.where(x > 0.0, a, b)" in said
    assert said.endswith("; dry friction may be a Friction")


def test_a_line_of_no_file_is_left_out():
    texts = {}
    exec("def force(self, t, q, velocity, load): return -q if q > 0.0 else q", texts)
    with pytest.raises(TraceError, match=r"^Own\.force: a traced model may not branch"):
        saltus.System(
            model=_class(force=texts["force"])(), load=LOAD, impact=saltus.NewtonImpact(e=0.5)
        )
