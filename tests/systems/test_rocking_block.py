"""The rocking block against the Lagrangian of a rigid rectangle, errata 10 and 11."""

import math

import pytest
import sympy as sp

from saltus.systems import Load, RockingBlock


@pytest.mark.parametrize("side", [1, pytest.param(-1, marks=pytest.mark.thorough)])
def test_errata_10_and_11_block_follows_from_its_lagrangian(symbols, is_zero, side):
    """T of a rectangle (I_G = M R^2 / 3) rocking about a corner on a moving ground, in units (4/3)
    M R^2 p^2, p^2 = 3 g / (4 R).

    The centre is at R (sin, cos)-wise from the corner; U = (4/3) R (zeta, nu) and gravity (4/3) M
    R^2 p^2 = M g R.
    """
    block, load, t = symbols.model(RockingBlock(alpha=0.3)), symbols.load, symbols.t
    s, alpha = sp.Integer(side), block.alpha
    angle, size = sp.Function("theta")(t), sp.Symbol("size", positive=True)
    tilt = alpha - s * angle
    zeta, nu = load.ground_horizontal(t), load.ground_vertical(t)
    # in units R: centre = (4/3) ground + (-s sin(tilt), cos(tilt)) about the corner under it
    x = sp.Rational(4, 3) * zeta - s * sp.sin(tilt)
    y = sp.Rational(4, 3) * nu + sp.cos(tilt)
    rate = sp.diff(angle, t)
    kinetic = sp.Rational(3, 4) * (sp.diff(x, t) ** 2 + sp.diff(y, t) ** 2 + rate**2 / 3) / 2
    lagrangian = kinetic - y
    equation = sp.diff(sp.diff(lagrangian, rate), t) - sp.diff(lagrangian, angle)
    q, v, a = s * size, sp.Symbol("v", real=True), sp.Symbol("a", real=True)
    names = [(sp.diff(angle, t, 2), a), (rate, v), (angle, q)]
    mine = block.acceleration(t, q, v, s, load)
    assert is_zero(equation.doit().subs(names).subs(a, mine))
    assert is_zero(kinetic.doit().subs(names) - block.kinetic_energy(t, q, v, s, load))
    # erratum 10: 4 zeta'^2 in the bracket, as printed, is another energy (it leaves the equation of
    # motion alone)
    printed = block.kinetic_energy(t, q, v, s, load) + sp.Rational(4, 3) * sp.diff(zeta, t) ** 2
    assert not is_zero(kinetic.doit().subs(names) - printed)
    # erratum 11: + zeta'' sin(...) in the equation of motion is not a solution
    wrong = mine + 2 * load.ground_horizontal.acceleration(t) * sp.cos(alpha - size)
    assert not is_zero(equation.doit().subs(names).subs(a, wrong))


def test_a_block_on_its_side_is_overturned():
    block = RockingBlock(alpha=0.3)
    assert "overturned" in block.stops
    for side in (1, -1):
        margins = [
            block.margins(0.0, side * x, 0.0, 0.0, side, Load())["overturned"]
            for x in (1.0, math.pi / 2, 1.6)
        ]
        assert margins[0] > 0 > margins[2]
        assert margins[1] == 0


def test_mirror_reverses_the_ground_sideways_only():
    block = RockingBlock(alpha=0.3)
    load = Load(ground_horizontal=0.4, ground_vertical=0.1)
    assert block.mirror(load) == Load(ground_horizontal=-0.4, ground_vertical=0.1)
    assert block.mirror(block.mirror(load)) == load
