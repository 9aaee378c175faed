"""Mutations of the ball arithmetic: its source with one bound made smaller, one sign turned, or the
rounding of one function left out, run without compiling.
"""

from __future__ import annotations

import ast
import copy
import inspect
import sys
from collections.abc import Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

SMALLER = 0.9
# Names and calls that are bounds of rounding.
ROUNDING = {"EPS": 0.0, "TINY": 0.0, "UP": 1.0}


class Mutation:
    """One change of a module's source: the function it is in, what it changes, and its line."""

    def __init__(self, function: str, kind: str, node: ast.AST, number: int) -> None:
        self.function = function
        self.kind = kind
        self.number = number
        self.text = ast.unparse(node)

    @property
    def name(self) -> str:
        """The function, the kind, and the expression as it was."""
        return f"{self.function}: {self.kind}: {self.text}"


class _Turned(ast.NodeTransformer):
    """Applies the mutation with one number, and collects them all on the way."""

    def __init__(self, functions: tuple[str, ...], wanted: int | None = None) -> None:
        self.functions = functions
        self.wanted = wanted
        self.found: list[Mutation] = []
        self.inside: list[str] = []

    def _is_wanted(self, kind: str, node: ast.AST) -> bool:
        number = len(self.found)
        self.found.append(Mutation(".".join(self.inside), kind, node, number))
        return number == self.wanted

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        self.inside.append(node.name)
        self.generic_visit(node)
        self.inside.pop()
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        self.inside.append(node.name)
        if ".".join(self.inside) in self.functions:
            names = [part.id for part in ast.walk(node) if isinstance(part, ast.Name)]
            rounds = any(name in ROUNDING for name in names)
            unrounded = rounds and self._is_wanted("no rounding", node.args)
            self.generic_visit(node)
            if unrounded:
                node = _Unrounded().visit(node)
        self.inside.pop()
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        text = ast.unparse(node)
        signed = isinstance(node.op, (ast.Add, ast.Sub)) and not _counts(text)
        if signed and self._is_wanted("sign turned", node):
            turned = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
            return ast.BinOp(node.left, turned, node.right)
        self.generic_visit(node)
        return node

    def visit_Return(self, node: ast.Return) -> ast.AST:
        value = node.value
        exact = ("np.nan", "0.0")
        pair = isinstance(value, ast.Tuple) and len(value.elts) == 2
        bounded = pair and ast.unparse(value.elts[1]) not in exact
        if bounded and self._is_wanted("smaller", node):
            value.elts[1] = _times(value.elts[1])
            return node
        self.generic_visit(node)
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        bounded = ast.unparse(node.func) == "Ball" and len(node.args) == 2
        if bounded and self._is_wanted("smaller", node):
            node.args[1] = _times(node.args[1])
            return node
        self.generic_visit(node)
        return node


class _Unrounded(ast.NodeTransformer):
    """The bounds of rounding are left out."""

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Constant(ROUNDING[node.id]) if node.id in ROUNDING else node


def _times(node: ast.expr) -> ast.expr:
    return ast.BinOp(ast.Constant(SMALLER), ast.Mult(), node)


def _counts(text: str) -> bool:
    """Whether an expression only counts terms of a bound of rounding or places in an array."""
    letters = {"n", "k", "j", "high", "low", "size", "i", "order", "d", "count", "depth"}
    names = {node.id for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Name)}
    return bool(names) and names <= letters


def mutations_of(module: ModuleType, functions: tuple[str, ...]) -> Iterator[Mutation]:
    """All mutations of some functions of a module."""
    visitor = _Turned(functions)
    visitor.visit(ast.parse(inspect.getsource(module)))
    return iter(visitor.found)


def mutated(module: ModuleType, functions: tuple[str, ...], number: int | None) -> Any:
    """The module's names with one mutation, or as they are."""
    tree = copy.deepcopy(ast.parse(inspect.getsource(module)))
    tree = ast.fix_missing_locations(_Turned(functions, number).visit(tree))
    names: dict[str, Any] = {"__name__": module.__name__ + "_mutated"}
    text = ast.unparse(tree).replace(
        "from saltus.taylor import cached_jit, jit",
        "jit = lambda work: work\ncached_jit = lambda signature: jit",
    )

    made = ModuleType(names["__name__"])
    sys.modules[made.__name__] = made
    exec(compile(text, made.__name__, "exec"), vars(made))
    del sys.modules[made.__name__]
    return SimpleNamespace(**vars(made))
