"""A mistake in a user's own class is one sentence when `System` is made, whatever its contract."""

from dataclasses import dataclass
from typing import ClassVar

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
            r"Own\.force failed: TypeError: .*; with one coordinate .* write q, not q\[0\]",
        ),
        ({"mass_matrix": lambda self, q: 1.0 / 0}, r"Own\.mass_matrix failed: ZeroDivisionError: "),
        (
            {"normal_forces": lambda self, t, q, velocity, load: [][0]},
            r"Own\.normal_forces failed: IndexError: ",
        ),
    ],
    ids=["force", "mass_matrix", "normal_forces"],
)
def test_a_mistake_names_the_method(method, says):
    with pytest.raises(TraceError, match=says):
        saltus.System(model=_class(**method)(), load=LOAD, impact=saltus.NewtonImpact(e=0.5))
