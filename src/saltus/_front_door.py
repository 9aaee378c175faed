"""The front door of a room: the names that its `__init__.pyi` lists, each imported when it is first
used.

A room imports another one only through these names. Nothing is loaded before it is needed, so
`import saltus` stays light.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib import import_module
from types import FunctionType, ModuleType
from typing import Any

from lazy_loader import attach_stub

from saltus.errors import ParameterError, near

# rooms all of whose functions are for users, besides those that `saltus` itself names
FOR_USERS = ("saltus.theory",)


# what other packages call what is here
MEANT = {
    **dict.fromkeys(("integrate", "solve", "solveivp", "odeint", "run", "trajectory"), "simulate"),
    **dict.fromkeys(("ensemble", "montecarlo"), "simulate_many"),
    **dict.fromkeys(("continuation", "continuebranch", "follow"), "continue_orbit"),
    **dict.fromkeys(("shoot", "shooting", "periodicorbit", "floquet"), "find_orbit"),
    **dict.fromkeys(("bifurcation", "bifurcations"), "bifurcation_diagram"),
    **dict.fromkeys(("lyapunov", "lyapunovexponent", "exponents"), "lyapunov_spectrum"),
    **dict.fromkeys(("basins", "basin"), "basins_of_attraction"),
    **dict.fromkeys(("attractor", "attractorset"), "find_attractors"),
    **dict.fromkeys(("read", "open"), "load"),
    **dict.fromkeys(("gradient", "jacobian"), "sensitivities"),
}


def front_door(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package whose public names are those of the stub
    beside its `__init__`.

    Raises
    ------
    AttributeError
        Raised by `__getattr__` for an unknown name; the error gives similar names.
    """
    load, names, public = attach_stub(package, file)
    sys.modules[package].__class__ = Room

    def get(name: str) -> Any:
        if name.startswith("__") or name in public:
            found = load(name)
            if package in FOR_USERS or name in vars(sys.modules["saltus"]).get("__all__", ()):
                # lazy_loader 0.6 keeps there what it has loaded
                found = vars(sys.modules[package])[name] = _answering(found)
            return found
        if os.path.exists(os.path.join(os.path.dirname(file), f"{name}.py")):
            raise AttributeError(name)  # Python asks for the name of a file, which it then imports
        meant = MEANT.get(name.lower().replace("_", ""))
        hint = f"did you mean {meant!r}?" if meant in public else near(name, public)
        raise AttributeError(f"{package} has no {name!r}; {_elsewhere(name) or hint}")

    return get, names, public


def _elsewhere(name: str) -> str:
    """Which room has a name behind its door, or `saltus` itself; empty if none has."""
    here = os.path.dirname(__file__)
    if name in vars(sys.modules["saltus"]).get("__all__", ()):
        return "it is in saltus"
    for room in sorted(os.listdir(here)):
        stub = os.path.join(here, room, "__init__.pyi")
        if os.path.exists(stub):
            with open(stub, encoding="utf-8") as lines:
                if any(line.split()[-1:] == [name] for line in lines if line.startswith("from ")):
                    return f"it is in saltus.{room}"
    return ""


class Room(ModuleType):
    """A package of saltus; if it is called by mistake, the error names the functions that may be
    meant.

    It is pickled by its name, as cloudpickle sends the modules that functions of notebooks use.
    """

    def __reduce__(self) -> tuple[Callable[[str], ModuleType], tuple[str]]:
        return import_module, (self.__name__,)

    def __call__(self, *given: Any, **named: Any) -> Any:
        own = self.__name__.rpartition(".")[2]
        doors = (vars(sys.modules["saltus"]).get("__all__", ()), self.__all__)
        meant = next(
            (
                found
                for door in doors
                if (found := [n for n in door if own[:-1] in n and n.islower() and n != own])
            ),
            [],
        )
        hint = near(own, meant) if meant else "use one of its functions"
        raise ParameterError(f"{self.__name__} is a package, not a function; {hint}")


def _answering(found: Any) -> Any:
    """A public function or a dataclass, made to refuse arguments that it does not have; anything
    else is returned as it is.
    """
    own = vars(found).get("__init__") if hasattr(found, "__dataclass_fields__") else found
    if not isinstance(own, FunctionType) or hasattr(own, "answers"):
        return found
    from saltus.checks import answered

    answering: Any = answered(own)
    if own is not found:
        found.__init__ = answering
        return found
    setattr(sys.modules[found.__module__], found.__name__, answering)  # pickle looks for it there
    return answering
