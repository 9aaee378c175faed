"""Generated functions to machine code without inference: the few statements that `emit.py` writes, as LLVM's instructions.

Numbers are int64 or double, arrays are C-contiguous, indices are not negative, and every variable has one type: nothing has to be
found out. numba, which needs seconds for a structure's recurrences, sees one call a function and keeps its cache. Known are
assignments to names, elements and tuples of them, `+=` and the like, `if`, `for` over a range (step 1 or -1), `return`,
arithmetic, comparisons, `and`, `x if c else y`, `min`, `max`, the functions of `math`, and calls of helpers written in the same
way.
"""

from __future__ import annotations

import ast
import inspect
import math
import operator
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from saltus.taylor.private_numba import pointed_jit

LONG, DOUBLE, BOOL = ir.IntType(64), ir.DoubleType(), ir.IntType(1)
FUSED = ("contract", "nsz")
ARITHMETIC: dict[type, tuple[str, str]] = {ast.Add: ("add", "fadd"), ast.Sub: ("sub", "fsub"), ast.Mult: ("mul", "fmul")}
COMPARISONS: dict[type, str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


def lowered_jit(signature: Any, fused: bool = True, python: bool = False) -> Callable[[Any], Any]:
    """Compile a generated function for one signature, as `jit.pointed_jit` does."""

    def compiled(function: Any) -> Any:
        names = ", ".join(inspect.signature(function).parameters)
        space = {**function.__globals__, "_lowered": _intrinsic(function, names, signature, fused)}
        first = "\n" * (function.__code__.co_firstlineno - 1)  # numba's cache knows functions by file, name and line
        text = f"{first}def {function.__name__}({names}):\n    return _lowered({names})\n"
        exec(compile(text, function.__code__.co_filename, "exec"), space)
        wrapper = space[function.__name__]
        wrapper.__module__, wrapper.__qualname__ = function.__module__, function.__qualname__
        return pointed_jit(signature, fused, python)(wrapper)

    return compiled


def _intrinsic(function: Any, names: str, signature: Any, fused: bool) -> Any:
    def typed(typing: Any, *arguments: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            writer = _Writer(context, builder, function.__globals__, fused)
            given = [writer.argument(*each) for each in zip(signature.args, args, strict=True)]
            return writer.returned(signature.return_type, writer.call(function, given))

        return signature.return_type(*arguments), code

    space: dict[str, Any] = {"typed": typed}
    exec(f"def typed_(typing, {names}):\n    return typed(typing, {names})\n", space)  # numba reads the number of arguments
    return intrinsic(space["typed_"])


@dataclass(frozen=True)
class _Array:
    """A C-contiguous array, or a part of one: where its first element is, and its lengths."""

    data: Any
    shape: tuple[Any, ...]


class _Writer:
    """Writes the body of a function; helpers that it calls are written in its place."""

    def __init__(self, context: Any, builder: Any, space: dict[str, Any], fused: bool) -> None:
        self.context, self.builder, self.space = context, builder, space
        self.flags = FUSED if fused else ()
        self.names: dict[str, Any] = {}

    # --- arguments and results ---------------------------------------------------------------------------------------------

    def argument(self, kind: Any, value: Any) -> Any:
        """An argument of numba's as a number, an array, or a tuple of them."""
        if isinstance(kind, types.Array):
            made = self.context.make_array(kind)(self.context, self.builder, value)
            return _Array(made.data, tuple(cgutils.unpack_tuple(self.builder, made.shape, kind.ndim)))
        if isinstance(kind, types.BaseTuple):
            parts = cgutils.unpack_tuple(self.builder, value, len(kind))
            return tuple(self.argument(each, part) for each, part in zip(kind, parts, strict=True))  # type: ignore[call-overload]
        return value

    def returned(self, kind: Any, value: Any) -> Any:
        """What a function returns, as numba has it."""
        if kind == types.void:
            return self.context.get_dummy_value()
        if isinstance(kind, types.BaseTuple):
            return self.context.make_tuple(self.builder, kind, [self.double(part) for part in value])
        return self.double(value)

    def call(self, function: Any, args: list[Any]) -> Any:
        """The value of a function's `return`, which is its last statement."""
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        outer, self.names = self.names, {}
        for argument, value in zip(tree.args.args, args, strict=True):
            self.bind(argument.arg, value)
        *body, last = [statement for statement in tree.body if not _is_text(statement)]
        for statement in body:
            self.statement(statement)
        result = None
        if not isinstance(last, ast.Return):
            self.statement(last)
        elif last.value is not None:
            result = self.value(last.value)
        self.names = outer
        return result

    # --- statements --------------------------------------------------------------------------------------------------------

    def statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign):
            (target,) = node.targets
            self.assign(target, self.value(node.value))
        elif isinstance(node, ast.AugAssign):
            load = ast.parse(ast.unparse(node.target), mode="eval").body
            self.assign(node.target, self.arithmetic(node.op, self.value(load), self.value(node.value)))
        elif isinstance(node, ast.If):
            assert not node.orelse, "a generated `if` has no `else`"
            with self.builder.if_then(self.value(node.test)):
                for inner in node.body:
                    self.statement(inner)
        elif isinstance(node, ast.For):
            self.loop(node)
        elif isinstance(node, ast.Expr):
            self.value(node.value)
        else:
            raise NotImplementedError(f"the statement {ast.unparse(node)!r} in generated code")

    def assign(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Tuple):
            for part, one in zip(target.elts, value, strict=True):
                self.assign(part, one)
        elif isinstance(target, ast.Name):
            self.bind(target.id, value)
        else:
            assert isinstance(target, ast.Subscript)
            self.builder.store(self.double(value), self.element(target).data)

    def bind(self, name: str, value: Any) -> None:
        """Give a name a value; numbers live in memory until LLVM has put them into registers."""
        if isinstance(value, (_Array, tuple)):
            self.names[name] = value
            return
        if name not in self.names:
            self.names[name] = cgutils.alloca_once(self.builder, value.type, name=name)
        self.builder.store(value, self.names[name])

    def loop(self, node: ast.For) -> None:
        """for k in range(stop), range(start, stop) or range(start, stop, -1)."""
        assert isinstance(node.target, ast.Name)
        assert isinstance(node.iter, ast.Call)
        given = [self.value(argument) for argument in node.iter.args]
        start, stop = (ir.Constant(LONG, 0), given[0]) if len(given) == 1 else (given[0], given[1])
        assert len(given) < 3 or ast.unparse(node.iter.args[2]) == "-1", "a generated range has no step but -1"
        step, sign = (given[2], ">") if len(given) == 3 else (ir.Constant(LONG, 1), "<")
        counter = cgutils.alloca_once(self.builder, LONG)
        self.builder.store(start, counter)
        head, body, end = (self.builder.append_basic_block(name) for name in ("head", "body", "end"))
        self.builder.branch(head)
        self.builder.position_at_end(head)
        self.builder.cbranch(self.builder.icmp_signed(sign, self.builder.load(counter), stop), body, end)
        self.builder.position_at_end(body)
        self.bind(node.target.id, self.builder.load(counter))
        for inner in node.body:
            self.statement(inner)
        self.builder.store(self.builder.add(self.builder.load(counter), step, flags=("nsw",)), counter)
        self.builder.branch(head)
        self.builder.position_at_end(end)

    # --- expressions -------------------------------------------------------------------------------------------------------

    def value(self, node: ast.expr) -> Any:
        """The value of an expression: one of LLVM's, an array, a tuple, or None for a helper that returns nothing."""
        kind = type(node).__name__.lower()
        write = getattr(self, f"value_{kind}", None)
        if write is None:
            raise NotImplementedError(f"the expression {ast.unparse(node)!r} in generated code")
        return write(node)

    def value_constant(self, node: Any) -> Any:
        return ir.Constant(LONG if isinstance(node.value, int) else DOUBLE, node.value)

    def value_name(self, node: Any) -> Any:
        known = self.names[node.id]
        return known if isinstance(known, (_Array, tuple)) else self.builder.load(known)

    def value_tuple(self, node: Any) -> Any:
        return tuple(self.value(part) for part in node.elts)

    def value_attribute(self, node: Any) -> Any:
        if isinstance(node.value, ast.Name) and node.value.id == "math":
            return ir.Constant(DOUBLE, getattr(math, node.attr))
        assert node.attr == "size"
        (length,) = self.value(node.value).shape
        return length

    def value_subscript(self, node: Any) -> Any:
        found = self.element(node)
        return found if found.shape else self.builder.load(found.data)

    def element(self, node: ast.Subscript) -> _Array:
        """An element of an array, or what is left of it when the first indices are given."""
        array = self.value(node.value)
        index = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        offset = ir.Constant(LONG, 0)
        for i, length in enumerate(array.shape):
            offset = self.builder.mul(offset, length, flags=("nsw",))
            if i < len(index):
                offset = self.builder.add(offset, self.value(index[i]), flags=("nsw",))
        return _Array(self.builder.gep(array.data, [offset], inbounds=True), array.shape[len(index) :])

    def value_binop(self, node: Any) -> Any:
        return self.arithmetic(node.op, self.value(node.left), self.value(node.right))

    def arithmetic(self, op: ast.operator, a: Any, b: Any) -> Any:
        if a.type == b.type == LONG and type(op) in ARITHMETIC:
            return getattr(self.builder, ARITHMETIC[type(op)][0])(a, b, flags=("nsw",))
        a, b = self.double(a), self.double(b)
        if isinstance(op, ast.Pow):
            return self.known(operator.pow, a, b)
        if isinstance(op, ast.Div):
            return self.builder.fdiv(a, b, flags=self.flags)
        return getattr(self.builder, ARITHMETIC[type(op)][1])(a, b, flags=self.flags)

    def value_unaryop(self, node: Any) -> Any:
        value = self.value(node.operand)
        if isinstance(node.op, ast.UAdd):
            return value
        assert isinstance(node.op, ast.USub)
        return self.builder.neg(value) if value.type == LONG else self.builder.fneg(value, flags=self.flags)

    def value_compare(self, node: Any) -> Any:
        (op,), (right,) = node.ops, node.comparators
        return self.comparison(COMPARISONS[type(op)], self.value(node.left), self.value(right))

    def comparison(self, op: str, a: Any, b: Any) -> Any:
        if a.type == b.type == LONG:
            return self.builder.icmp_signed(op, a, b)
        compare = self.builder.fcmp_unordered if op == "!=" else self.builder.fcmp_ordered
        return compare(op, self.double(a), self.double(b))

    def value_boolop(self, node: Any) -> Any:
        assert isinstance(node.op, ast.And)
        first, *rest = [self.value(part) for part in node.values]
        for other in rest:
            first = self.builder.and_(first, other)
        return first

    def value_ifexp(self, node: Any) -> Any:
        """Both values are computed: nothing that is generated can fail."""
        chosen, a, b = self.value(node.test), self.value(node.body), self.value(node.orelse)
        if a.type != b.type:
            a, b = self.double(a), self.double(b)
        return self.builder.select(chosen, a, b)

    def value_call(self, node: Any) -> Any:
        args = [self.value(argument) for argument in node.args]
        if isinstance(node.func, ast.Attribute):
            return self.known(getattr(math, node.func.attr), *(self.double(argument) for argument in args))
        if node.func.id in ("min", "max"):
            a, b = args
            if a.type != b.type:
                a, b = self.double(a), self.double(b)
            return self.builder.select(self.comparison("<" if node.func.id == "min" else ">", b, a), b, a)  # as Python chooses
        helper = self.space[node.func.id]
        return self.call(getattr(helper, "py_func", helper), args)

    def known(self, function: Any, *args: Any) -> Any:
        """A function of numbers that numba knows."""
        signature = types.float64(*[types.float64] * len(args))
        kind = self.context.typing_context.resolve_value_type(function)
        kind.get_call_type(self.context.typing_context, signature.args, {})
        return self.context.get_function(kind, signature)(self.builder, args)

    def double(self, value: Any) -> Any:
        """A number as a double."""
        return value if value.type == DOUBLE else self.builder.sitofp(value, DOUBLE)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
