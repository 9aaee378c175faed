"""The equations of several contacts while one coordinate is free: those of the model with all
others held.
"""

import numpy as np
import pytest
from test_contact_models import chain
from test_contacts import layers

from saltus import TwoStops
from saltus.flow.programs.compiled import one_free
from saltus.systems import Load, System, reactions, solved_motion
from saltus.taylor import Expr, differentiate, substitute, trace

SYSTEMS = {
    "two layers": layers(
        mass_ratio=0.3, damping=0.2, stiffness_ratio=0.7, H=0.4, ground=0.1, W=1.3
    ),
    "a chain of two cells": chain(2),
}


def places(system, traced, rng, j):
    """A state in which only coordinate j is free, and the leaves of the one equation there."""
    own, numbers = traced.dof, dict(zip(traced.parameters, range(99), strict=False))
    sign = [contact.sign for contact in system.model.contacts]
    q, v, t = [0.0] * own, [0.0] * own, rng.uniform(0.0, 5.0)
    q[j], v[j] = sign[j] * rng.uniform(0.05, 1.0), rng.uniform(-1.0, 1.0)
    leaves = {Expr("parameter", (), place): system.get(path) for path, place in numbers.items()}
    leaves |= {Expr("free", (), i): float(i == j) for i in range(own)}
    leaves |= {
        Expr("coordinate", (), 0): q[j],
        Expr("velocity", (), 0): v[j],
        Expr("time"): t,
        Expr("origin"): 0.0,
    }
    return t, q, v, leaves


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_one_equation_is_the_models_with_all_others_held(name):
    """Its acceleration, and the reactions as P'' + ..., with P'' = dP/dq a + d^2 P/dq^2 v^2."""
    system, rng = SYSTEMS[name], np.random.default_rng(4)
    traced = trace(system, system.model.stops)
    equations, q0 = one_free(traced), Expr("coordinate", (), 0)
    for j in range(traced.dof):
        t, q, v, leaves = places(system, traced, rng, j)
        expected = solved_motion(
            system.model, t, q, v, system.load, [float(i == j) for i in range(traced.dof)]
        ).acceleration
        a = substitute(equations.acceleration, leaves).value
        assert abs(a - expected[j]) < 1e-13
        forces = reactions(system.model, t, q, v, expected, system.load)
        closed = [
            force
            for force, coordinate in zip(forces, traced.contact_coordinates, strict=True)
            if coordinate != j
        ]
        for half, rest, force in zip(equations.curved, equations.guards, closed, strict=False):
            slope = differentiate(half, q0)
            curved = (
                substitute(slope, leaves).value * a
                + substitute(differentiate(slope, q0), leaves).value * v[j] ** 2
            )
            assert abs(curved + substitute(rest, leaves).value - force) < 1e-12
        margins = system.model.margins(t, q, v, expected, 1, system.load)
        limits = sorted(margins[name] for name in system.model.stops)
        guards = [*equations.guards[len(equations.curved) :], *equations.constant_guards]
        np.testing.assert_allclose(
            sorted(substitute(guard, leaves).value for guard in guards), limits, rtol=0, atol=1e-14
        )


def test_reactions_of_two_layers_cost_no_product_of_series():
    """What the reduced model needs remains: the sine and the cosine of the angle, and one product
    with the horizontal load.
    """
    equations = one_free(trace(SYSTEMS["two layers"], ()))
    nodes = {id(n): n for root in equations.roots for n in below(root)}.values()
    products = [n for n in nodes if n.op == "mul" and all(arg.degree is None for arg in n.args)]
    functions = [n for n in nodes if n.op in ("sin", "cos") and n.args[0].degree is None]
    assert len(functions) == 2
    assert len(products) == 1


def below(root):
    yield root
    for arg in root.args:
        yield from below(arg)


def test_there_are_none_without_a_contact_for_each_coordinate():
    assert one_free(trace(System(model=TwoStops(), load=Load(frequency=1.0)), ())) is None
    # a tangent goes on in all coordinates
    assert one_free(trace(SYSTEMS["two layers"], (), ())) is None
