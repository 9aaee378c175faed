"""The front door of a room: the names that its `__init__.pyi` lists, each imported when it is first used.

A room imports another one only through these names. Nothing is loaded before it is needed, so `import saltus` stays light.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lazy_loader import attach_stub

from saltus.errors import near


def front_door(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` and `__all__` of a package whose public names are those of the stub beside its `__init__`.

    Raises:
        AttributeError: by `__getattr__`, of a name that is not there, with the names that are near to it.
    """
    load, names, public = attach_stub(package, file)

    def get(name: str) -> Any:
        if name.startswith("__") or name in public:
            return load(name)
        raise AttributeError(f"{package} has no {name!r}; {near(name, public)}")

    return get, names, public
