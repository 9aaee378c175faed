"""The tangent of a traced motion: its derivatives to the state at the start and to parameters, as expressions of the graph.

Column j of the tangent is the derivative to the j-th initial coordinate, then to the j-th initial velocity, then to the number
at the j-th dotted path. With u = dq/dc and z = dv/dc it obeys, along an arc, u' = z and

    z' = a_q u + a_v z + a_c.

All derivatives are at a fixed time. If c is the forcing frequency W, one must note that the kernel's time counts from `origin`,
whole forcing periods after 0, and that a load depends on n W (origin + t). Therefore a_c = a_W + (origin / W) a_t, where a_t
leaves out the records.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from saltus.errors import ParameterError, near
from saltus.systems import Harmonic, Pulse, System, numbers
from saltus.taylor.graph import Expr, differentiate, number, ordered

if TYPE_CHECKING:
    from saltus.taylor.tracing import Trace

FREQUENCY = "load.frequency"


def check_paths(system: System, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Check that each of the dotted paths to differentiate to names a number that can vary.

    Raises
    ------
    ParameterError
        A path leads to no number of the system (the message has similar paths), or to an order, or is given twice.
    """
    known = [path for path, _ in numbers(system)]
    for path in paths:
        if path not in known:
            system.get(str(path))  # refuses a path to a part that does not exist
            below = [name for name in known if name.startswith(f"{path}.")]
            raise ParameterError(f"{path} is not a number, so there is no derivative to it; {near(str(path), below or known)}")
        owner = system.get(path.rpartition(".")[0])
        if isinstance(owner, Pulse) and path.rpartition(".")[2] in owner.moving:
            raise ParameterError(
                f"{path} moves the instants at which the load is not smooth, so there are no derivatives to it; take another"
            )
        if path.endswith(".order") and isinstance(owner, Harmonic):
            raise ParameterError(f"{path} is a whole number, so there is no derivative to it; choose another parameter")
    if len(set(paths)) < len(paths):
        raise ParameterError(f"each parameter may be named once, got {paths!r}")
    return tuple(paths)


def extend(trace: Trace, paths: tuple[str, ...]) -> None:
    """Append the tangent's columns to a trace as further coordinates; coordinate dof + j dof + d is u_d of column j."""
    own = list(trace.acceleration)
    trace.paths, trace.columns = paths, 2 * trace.dof + len(paths)
    for path, order in list(trace.records):  # the time derivative at a jump of the motion needs these
        if (path, order + 1) not in trace.records:
            trace.records.append((path, order + 1))
    for j in range(trace.columns):
        trace.acceleration += [derivative_along(trace, a, j) for a in own]


def tangent_leaves(trace: Trace, j: int) -> tuple[list[Expr], list[Expr]]:
    """The leaves for u and z of column j, as coordinates and velocities."""
    places = range(trace.dof * (1 + j), trace.dof * (2 + j))
    return [Expr("coordinate", (), i) for i in places], [Expr("velocity", (), i) for i in places]


def derivative_along(trace: Trace, root: Expr, j: int) -> Expr:
    """The derivative of an expression of the motion along column j, at a fixed time."""
    total = partial_derivative(trace, root, j)
    for i, (u, z) in enumerate(zip(*tangent_leaves(trace, j), strict=True)):
        total = total + differentiate(root, Expr("coordinate", (), i)) * u
        total = total + differentiate(root, Expr("velocity", (), i)) * z
    return total


def partial_derivative(trace: Trace, root: Expr, j: int) -> Expr:
    """The partial derivative of an expression to column j's parameter, at a fixed time and state; 0 for the state's columns."""
    if j < 2 * trace.dof:
        return number(0.0)
    path = trace.paths[j - 2 * trace.dof]
    leaf = Expr("parameter", (), trace.parameters.index(path))
    derivative = differentiate(root, leaf)
    if path == FREQUENCY:
        derivative = derivative + Expr("origin") / leaf * differentiate(root, Expr("time"))
    return derivative


def time_derivative(trace: Trace, root: Expr) -> Expr:
    """The partial derivative of an expression to the time, records included."""
    total = differentiate(root, Expr("time"))
    for node in ordered([root]):
        if node.op == "record":
            path, order = trace.records[node.value]
            total = total + differentiate(root, node) * Expr("record", (), trace.records.index((path, order + 1)))
    return total
