"""A plugin of mypy that sees misspelt options: `plugins = ["saltus.mypy_plugin"]` in its settings.

Functions such as `simulate` take coordinates by the names of the model, `x=0.1`, so that a misspelt
`tol=` would be read as a coordinate. The plugin marks names that are near an option's, as the
refusal at run time does.
"""

from __future__ import annotations

from collections.abc import Callable
from difflib import get_close_matches

from mypy.nodes import ARG_STAR2, CallExpr
from mypy.plugin import FunctionSigContext, Plugin
from mypy.types import FunctionLike

LIKENESS = 0.7  # that of the refusal: "tme" is `time`, "toll" is `tol`; "x" is like no option


class MisspeltOptions(Plugin):
    """Looks at the calls of functions of saltus."""

    def get_function_signature_hook(
        self, fullname: str
    ) -> Callable[[FunctionSigContext], FunctionLike] | None:
        """The look at a call of a function."""
        return _look if fullname.startswith("saltus.") else None


def _look(call: FunctionSigContext) -> FunctionLike:
    """Mark the names of a call that are no options and are near one."""
    signature = call.default_signature
    kinds = dict(zip(signature.arg_names, signature.arg_kinds, strict=True))
    if isinstance(call.context, CallExpr) and kinds.get("coordinates") is ARG_STAR2:
        options = [name for name in kinds if name and name != "coordinates"]
        for name, value in zip(call.context.arg_names, call.context.args, strict=True):
            near = get_close_matches(name, options, 1, LIKENESS) if name else []
            if near and name not in options:
                call.api.fail(f'"{name}" is no option; did you mean "{near[0]}"?', value)
    return signature


def plugin(version: str) -> type[Plugin]:
    """What mypy asks a plugin for."""
    return MisspeltOptions
