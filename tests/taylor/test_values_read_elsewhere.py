"""What a model's methods read besides their fields is in its equations: each change of it gives the
motion of a fresh process, x'' = -x - 2 d v from x = 1, v = 0.
"""

import importlib
import math
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

import saltus

D = 0.1
TABLE = np.array([0.1])
LISTED = [0.1]
NESTED: dict[str, Any] = {"damping": {"of": [0.1]}}
SPACE = SimpleNamespace(d=0.1)
NUMBERS = ModuleType("numbers_of_a_user")
NUMBERS.d = 0.1  # type: ignore[attr-defined]


@dataclass
class Settings:
    d: float = 0.1


SETTINGS = Settings()


def of_number() -> float:
    return D


def twice(d: float) -> float:
    return 2.0 * d


class WithoutFields(saltus.ContactModel):
    coordinates: ClassVar = ("x",)

    def force(self, t: Any, x: Any, v: Any, load: Any) -> Any:
        return -x - 2.0 * self.read() * v


@dataclass(frozen=True, kw_only=True)
class OfNumber(WithoutFields):
    def read(self) -> float:
        return D


@dataclass(frozen=True, kw_only=True)
class OfFunction(WithoutFields):
    def read(self) -> float:
        return of_number()


@dataclass(frozen=True, kw_only=True)
class OfArray(WithoutFields):
    def read(self) -> float:
        return float(TABLE[0])


@dataclass(frozen=True, kw_only=True)
class OfList(WithoutFields):
    def read(self) -> float:
        return sum(entry for entry in LISTED)


@dataclass(frozen=True, kw_only=True)
class OfNested(WithoutFields):
    def read(self) -> float:
        return NESTED["damping"]["of"][0]


@dataclass(frozen=True, kw_only=True)
class OfSpace(WithoutFields):
    def read(self) -> float:
        return SPACE.d


@dataclass(frozen=True, kw_only=True)
class OfSettings(WithoutFields):
    def read(self) -> float:
        return SETTINGS.d


@dataclass(frozen=True, kw_only=True)
class OfModule(WithoutFields):
    def read(self) -> float:
        return NUMBERS.d


@dataclass(frozen=True, kw_only=True)
class OfInner(WithoutFields):
    def read(self) -> float:
        return (lambda: D)()


@dataclass(frozen=True, kw_only=True)
class OfClass(WithoutFields):
    shares: ClassVar = [0.1]

    def read(self) -> float:
        return self.shares[0]


@dataclass(frozen=True, kw_only=True)
class WithField(WithoutFields):
    """Numbers of fields do not hide what is read beside them."""

    more: float = 0.0

    def read(self) -> float:
        return D + self.more


class NoDataclass(WithoutFields):
    def read(self) -> float:
        return D


def change(d: float) -> None:
    global D
    D = d
    TABLE[0] = d
    LISTED[0] = d
    NESTED["damping"]["of"][0] = d
    SPACE.d = d
    SETTINGS.d = d
    NUMBERS.d = d  # type: ignore[attr-defined]
    OfClass.shares[0] = d


def expected(d: float, time: float) -> float:
    rate = math.sqrt(1.0 - d * d)
    return math.exp(-d * time) * (math.cos(rate * time) + d / rate * math.sin(rate * time))


KINDS = (
    *(OfNumber, OfFunction, OfArray, OfList, OfNested, OfSpace, OfSettings, OfModule, OfInner),
    *(OfClass, WithField, NoDataclass),
)


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_that_a_method_reads_is_read_again_where_it_has_changed(kind: Any) -> None:
    kept = saltus.System(model=kind())
    try:
        for d in (0.1, 0.3, 0.1, 0.6):
            change(d)
            for system in (saltus.System(model=kind()), kept):
                motion = saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0)
                assert motion.x == pytest.approx(expected(d, 2.0), abs=1e-9)
    finally:
        change(0.1)


def test_a_function_that_is_defined_again_is_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a notebook, and what the new one reads is read again, too."""
    system = saltus.System(model=OfFunction())
    found = [saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0).x]
    monkeypatch.setitem(globals(), "of_number", lambda: twice(D))
    for d in (0.1, 0.25):
        change(d)
        found.append(saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0).x)
    monkeypatch.setitem(globals(), "twice", lambda d: 3.0 * d)
    found.append(saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0).x)
    change(0.1)
    assert found == pytest.approx([expected(d, 2.0) for d in (0.1, 0.2, 0.5, 0.75)], abs=1e-9)


def test_a_method_that_is_replaced_is_the_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    system = saltus.System(model=OfNumber())
    saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0)
    monkeypatch.setattr(OfNumber, "read", lambda self: 0.4)
    motion = saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0)
    assert motion.x == pytest.approx(expected(0.4, 2.0), abs=1e-9)


def test_a_value_that_a_class_closes_over_is_read_again() -> None:
    d = 0.1

    @dataclass(frozen=True, kw_only=True)
    class Inside(WithoutFields):
        def read(self) -> float:
            return d

    system = saltus.System(model=Inside())
    for d in (0.1, 0.5):
        motion = saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0)
        assert motion.x == pytest.approx(expected(d, 2.0), abs=1e-9)


def test_constants_of_an_installed_package_are_read_again_by_its_own_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "site-packages" / "models_of_a_group"
    folder.mkdir(parents=True)
    (folder / "constants.py").write_text("D = 0.1\n")
    (folder / "__init__.py").write_text(
        "from dataclasses import dataclass\n"
        "import saltus\n"
        "from . import constants\n"
        "@dataclass(frozen=True, kw_only=True)\n"
        "class Installed(saltus.ContactModel):\n"
        "    coordinates = ('x',)\n"
        "    def force(self, t, x, v, load):\n"
        "        return -x - 2.0 * constants.D * v\n"
    )
    monkeypatch.syspath_prepend(folder.parent)
    package = importlib.import_module("models_of_a_group")
    system = saltus.System(model=package.Installed())
    for d in (0.1, 0.5):
        package.constants.D = d
        motion = saltus.simulate(system, x=1.0, velocity=0.0, duration=2.0)
        assert motion.x == pytest.approx(expected(d, 2.0), abs=1e-9)
