"""Motions in JAX: the derivatives are those of `sensitivities` and of differences, in both modes;
what has none is refused.
"""

import subprocess
import sys

import numpy as np
import pytest

import saltus
from saltus.errors import ParameterError
from saltus.flow.lanes import differentiable

SYSTEM = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(0.9),
)
VALUES = {"model.damping": 0.1, "load.frequency": 1.0, "impact.e": 0.9}
START = [0.3, 0.1]


@pytest.fixture
def jax():
    """JAX with 64 bits, as it was afterwards."""
    found = pytest.importorskip("jax")
    before = found.config.jax_enable_x64
    found.config.update("jax_enable_x64", True)
    yield found
    found.config.update("jax_enable_x64", before)


@pytest.mark.parametrize("length", [{"periods": 2}, {"duration": 12.0}])
def test_the_state_at_the_end_has_the_derivatives_of_sensitivities(jax, length):
    end = saltus.to_jax(SYSTEM, **length)
    known = saltus.sensitivities(SYSTEM, theta=0.3, velocity=0.1, parameters=VALUES, **length)
    assert len(known.motion.impacts) >= 2
    followed = saltus.simulate(SYSTEM, theta=0.3, velocity=0.1, **length)
    assert np.array_equal(end(VALUES, START), followed.final_state)
    # Derivatives are computed by a kernel of its own, whose sums are rounded in another order.
    assert np.allclose(known.motion.final_state, followed.final_state, rtol=0, atol=1e-14)
    for mode in (jax.jacfwd, jax.jacrev):
        by_values, by_start = jax.jit(mode(end, argnums=(0, 1)))(VALUES, np.array(START))
        assert np.allclose(by_start, known.state, rtol=1e-12, atol=1e-12)
        assert np.allclose(
            np.transpose([by_values[path] for path in VALUES]),
            known.parameters,
            rtol=1e-12,
            atol=1e-12,
        )


def test_a_gradient_is_the_quotient_of_differences(jax):
    times = np.array([0.5, 3.0, 7.0, 9.5])
    states = saltus.to_jax(SYSTEM, times=times, tol=1e-15)

    def size(values, start):
        return (states(values, start) ** 2).sum()

    by_values, by_start = jax.grad(size, argnums=(0, 1))(VALUES, np.array(START))
    for path, value in VALUES.items():
        beside = [float(size(VALUES | {path: value + h}, START)) for h in (1e-5, -1e-5)]
        assert float(by_values[path]) == pytest.approx((beside[0] - beside[1]) / 2e-5, rel=1e-7)
    for i in range(2):
        beside = [float(size(VALUES, np.array(START) + h * np.eye(2)[i])) for h in (1e-5, -1e-5)]
        assert float(by_start[i]) == pytest.approx((beside[0] - beside[1]) / 2e-5, rel=1e-7)


def test_a_product_with_the_transpose_is_the_same_from_both_sides(jax):
    """u . (J v) = (J' u) . v, with several contacts and states at one time."""
    stops = saltus.System(
        model=saltus.TwoStops(damping=0.05),
        load=saltus.Load(frequency=1.3, force=saltus.Harmonic(amplitude=2.0)),
        impact=saltus.NewtonImpact(e=0.8),
    )
    states, values, start = (
        saltus.to_jax(stops, times=9.0),
        {"load.frequency": 1.3},
        np.array([0.2, 0.0]),
    )
    along, across = ({"load.frequency": 0.7}, np.array([-0.4, 0.9])), np.array([1.1, -0.3])
    _, pushed = jax.jvp(states, (values, start), along)
    by_values, by_start = jax.vjp(states, values, start)[1](jax.numpy.asarray(across))
    expected = float(by_values["load.frequency"]) * 0.7 + by_start @ along[1]
    assert len(saltus.simulate(stops, x=0.2, duration=9.0).impacts) > 3
    assert across @ pushed == pytest.approx(float(expected), rel=1e-12)


@pytest.mark.parametrize("asked", [{"periods": 2}, {"times": [2.0, 9.0]}])
def test_many_motions_are_those_that_are_followed_alone(jax, asked, monkeypatch):
    together = []
    monkeypatch.setattr(
        differentiable,
        "simulate_many",
        lambda *a, **b: together.append(b) or saltus.simulate_many(*a, **b),
    )
    function, starts = (
        saltus.to_jax(SYSTEM, **asked),
        np.array([[0.3, 0.0], [0.1, 0.2], [-0.2, 0.0]]),
    )
    losses = np.array([0.95, 0.9, 0.85])

    def of(e, start):
        return function({"load.frequency": 1.0, "impact.e": e}, start)

    for mode in (lambda f, **_: f, jax.jacfwd, jax.jacrev):
        one = jax.jit(mode(of, argnums=(0, 1)))
        found, known = (
            jax.jit(jax.vmap(one))(losses, starts),
            [one(*each) for each in zip(losses, starts, strict=True)],
        )
        for one_leaf, leaves in zip(
            jax.tree.leaves(found), zip(*map(jax.tree.leaves, known), strict=True), strict=True
        ):
            assert np.allclose(one_leaf, np.array(leaves), rtol=1e-10, atol=1e-10)
    assert bool(together) == ("periods" in asked)
    one_system = jax.vmap(of, in_axes=(None, 0))(0.9, starts)
    assert one_system.shape == (3, 2) if "periods" in asked else (3, 2, 2)


def test_one_of_many_motions_that_cannot_go_on_is_refused_as_alone(jax):
    # from rest to both sides
    pushed = saltus.System(model=saltus.Metainterface(beta0=1.4), load=saltus.Load(vertical=1.0))
    many = jax.vmap(lambda start: saltus.to_jax(pushed, duration=1.0)({}, start))
    assert np.isfinite(many(np.array([[0.3, 0.0], [0.1, 0.0]]))).all()
    with pytest.raises(
        jax.errors.JaxRuntimeError, match="from rest at contact at time 0 is not unique"
    ):
        jax.block_until_ready(many(np.array([[0.3, 0.0], [0.0, 0.0]])))


def test_a_start_without_derivative_does_not_spoil_the_parameters(jax):
    """A ball that lies on the floor stays there under any weight; from beside it, without loss, it
    would bounce for ever.
    """
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0), load=saltus.Load(force=1.0)
    )
    end = saltus.to_jax(ball, duration=3.0)
    by_values, by_start = (
        jax.jacrev(lambda values: end(values, [0.0, 0.0])),
        jax.jacrev(lambda start: end({}, start)),
    )
    assert np.array_equal(by_values({"load.force": 1.0})["load.force"], [0.0, 0.0])
    assert np.isnan(by_start(np.zeros(2))).any()


def test_second_derivatives_are_refused(jax):
    end = saltus.to_jax(SYSTEM, periods=1)
    with pytest.raises(ParameterError, match="no second ones"):
        jax.hessian(lambda start: end({}, start).sum())(np.array(START))


def test_what_has_no_meaning_in_jax_is_said_in_a_sentence(jax):
    end = saltus.to_jax(SYSTEM, periods=1)
    with pytest.raises(ParameterError, match="start must be 2 numbers"):
        end(VALUES, [0.3])
    with pytest.raises(ParameterError, match=r"did you mean.*model\.damping"):
        end({"model.dampin": 0.1}, START)
    with pytest.raises(ParameterError, match="by dotted paths"):
        end([0.1], START)
    with pytest.raises(jax.errors.JaxRuntimeError, match=r"e must lie in"):
        jax.block_until_ready(end({"impact.e": 1.5}, START))
    jax.config.update("jax_enable_x64", False)
    with pytest.raises(
        ParameterError,
        match=r'32 bits here; first call jax.config.update\("jax_enable_x64", True\)',
    ):
        end(VALUES, START)


def test_a_length_is_asked_for_once():
    with pytest.raises(ParameterError, match="say how long"):
        saltus.to_jax(SYSTEM)
    with pytest.raises(ParameterError, match="leave out periods and duration"):
        saltus.to_jax(SYSTEM, times=[1.0], periods=2)
    with pytest.raises(ParameterError, match="not before the start, 2"):
        saltus.to_jax(SYSTEM, times=[1.0, 3.0], time=2.0)


def test_without_jax_the_function_says_what_to_install():
    program = (
        "import sys; sys.modules['jax'] = None; import saltus; s = "
        "saltus.System(model=saltus.WallOscillator());"
    )
    program += (
        "f = saltus.to_jax(s, duration=1.0)\ntry: f({}, [-1.0, 0.0])\nexcept "
        "saltus.ParameterError as e: print(e)"
    )
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert told.strip() == 'to_jax needs JAX: pip install ".[jax]"'
