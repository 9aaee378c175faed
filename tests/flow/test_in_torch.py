"""Motions in PyTorch: the derivatives are those of `sensitivities` in both modes, for one motion
and for many; what has none is refused."""

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
TIMES = [0.5, 3.0, 7.0, 9.5]


@pytest.fixture
def torch():
    return pytest.importorskip("torch")


def known_of(**length):
    return saltus.sensitivities(
        SYSTEM, theta=0.3, velocity=0.1, parameters=sorted(VALUES), **length
    )


def vector_function(function):
    """The same of one vector: the values by their sorted paths, then the start."""
    return lambda x: function(dict(zip(sorted(VALUES), x[:3], strict=True)), x[3:])


@pytest.mark.parametrize("length", [{"periods": 2}, {"duration": 12.0}])
def test_the_state_at_the_end_has_the_derivatives_of_sensitivities(torch, length):
    end, known = vector_function(saltus.to_torch(SYSTEM, **length)), known_of(**length)
    point = torch.tensor([VALUES[path] for path in sorted(VALUES)] + START, dtype=torch.float64)
    assert len(known.motion.impacts) >= 2
    assert np.array_equal(end(point), known.motion.final_state)
    expected = np.hstack([known.parameters, known.state])
    for jacobian in (
        torch.func.jacfwd(end),
        torch.func.jacrev(end),
        lambda x: torch.autograd.functional.jacobian(end, x),
    ):
        assert np.allclose(jacobian(point), expected, rtol=1e-12, atol=1e-12)


def test_the_gradient_of_states_at_times_is_the_quotient_of_differences(torch):
    states = vector_function(saltus.to_torch(SYSTEM, times=TIMES, tol=1e-15))
    point = torch.tensor(
        [VALUES[path] for path in sorted(VALUES)] + START, dtype=torch.float64, requires_grad=True
    )
    assert states(point).shape == (4, 2)
    (states(point) ** 2).sum().backward()
    for i, step in enumerate(1e-5 * torch.eye(5, dtype=torch.float64)):
        with torch.no_grad():
            beside = [float((states(point + sign * step) ** 2).sum()) for sign in (1, -1)]
        assert float(point.grad[i]) == pytest.approx((beside[0] - beside[1]) / 2e-5, rel=1e-7)


@pytest.mark.parametrize("asked", [{"periods": 2}, {"times": [2.0, 9.0]}])
def test_many_motions_are_those_that_are_followed_alone(torch, asked, monkeypatch):
    together = []
    monkeypatch.setattr(
        differentiable,
        "simulate_many",
        lambda *a, **b: together.append(b) or saltus.simulate_many(*a, **b),
    )
    function, starts = (
        saltus.to_torch(SYSTEM, **asked),
        torch.tensor([[0.3, 0.0], [0.1, 0.2], [-0.2, 0.0]]).double(),
    )

    def of(e, start):
        return function({"load.frequency": 1.0, "impact.e": e}, start)

    for mode in (lambda f, **_: f, torch.func.jacfwd, torch.func.jacrev):
        one = mode(of, argnums=(0, 1)) if mode in (torch.func.jacfwd, torch.func.jacrev) else of
        losses = torch.tensor([0.95, 0.9, 0.85], dtype=torch.float64)
        found, known = (
            torch.vmap(one)(losses, starts),
            [one(*each) for each in zip(losses, starts, strict=True)],
        )
        pairs = (
            zip(found, zip(*known, strict=True), strict=True) if one is not of else [(found, known)]
        )
        for leaf, leaves in pairs:
            assert torch.allclose(leaf, torch.stack(list(leaves)), rtol=1e-10, atol=1e-10)
    assert bool(together) == ("periods" in asked)
    assert torch.equal(of(0.9, starts), torch.vmap(of, in_dims=(None, 0))(0.9, starts))
    grid = function({"impact.e": losses[:, None]}, starts)  # each loss with each start
    assert torch.allclose(
        grid[1, 2], function({"impact.e": 0.9}, starts[2]), rtol=1e-10, atol=1e-10
    )


def test_a_start_without_derivative_does_not_spoil_the_parameters(torch):
    """A ball that lies on the floor stays there under any weight; from beside it, without loss, it
    would bounce for ever.
    """
    ball = saltus.System(
        model=saltus.WallOscillator(stiffness=0.0, wall=0.0), load=saltus.Load(force=1.0)
    )
    end, weight, start = (
        saltus.to_torch(ball, duration=3.0),
        torch.tensor(1.0, requires_grad=True),
        torch.zeros(2),
    )
    (by_weight,) = torch.autograd.grad(end({"load.force": weight}, start)[0], weight)
    assert by_weight == 0.0
    assert by_weight.dtype == torch.float32  # as its number was given
    _, moved = torch.func.jvp(
        lambda force: end({"load.force": force}, start), (weight.detach(),), (torch.tensor(1.0),)
    )
    assert torch.equal(moved, torch.zeros(2).double())
    assert torch.isnan(torch.func.jacrev(lambda x: end({}, x))(start)).any()


def test_second_derivatives_are_refused(torch):
    end = saltus.to_torch(SYSTEM, periods=1)
    with pytest.raises(ParameterError, match="no second ones"):
        torch.autograd.functional.hessian(lambda start: end({}, start).sum(), torch.tensor(START))


def test_what_has_no_meaning_is_said_in_a_sentence(torch):
    end = saltus.to_torch(SYSTEM, periods=1)
    with pytest.raises(ParameterError, match="start must be 2 numbers"):
        end(VALUES, [0.3])
    with pytest.raises(ParameterError, match=r"did you mean.*model\.damping"):
        end({"model.dampin": 0.1}, START)
    with pytest.raises(ParameterError, match="by dotted paths"):
        end([0.1], START)
    with pytest.raises(ParameterError, match=r"e must lie in"):
        end({"impact.e": 1.5}, START)
    with pytest.raises(ParameterError, match="say how long"):
        saltus.to_torch(SYSTEM)


def test_without_pytorch_the_function_says_what_to_install():
    program = (
        "import sys; sys.modules['torch'] = None; import saltus; s = "
        "saltus.System(model=saltus.WallOscillator());"
    )
    program += (
        "f = saltus.to_torch(s, duration=1.0)\ntry: f({}, [-1.0, 0.0])\nexcept "
        "saltus.ParameterError as e: print(e)"
    )
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert told.strip() == 'to_torch needs PyTorch: pip install ".[torch]"'
