"""
A fit by optax, in JAX
======================

Gradients of motions with impacts in JAX: an optimiser of optax finds damping, restitution and start
of a metainterface; and the gradient of a mean over 200 motions, which lanes follow together. It
needs `pip install "saltus[jax]" optax`."""

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import optax

import saltus

jax.config.update("jax_enable_x64", True)  # motions are exact to more digits than 32 bits have

system = saltus.System(
    model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
    load=saltus.Load(frequency=1.0, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    impact=saltus.VelocityReduction(0.9),
)
times = np.linspace(0.0, 8.0, 81)
# what was measured
theta = saltus.simulate(system, theta=0.3, velocity=0.1, duration=8.0).at(times)[0]
states = saltus.to_jax(system, times=times)


def misfit(unknown):
    """The mean square of the difference from the data."""
    return jnp.mean((states(unknown["values"], unknown["start"])[:, 0] - theta) ** 2)


unknown = jax.tree.map(
    jnp.asarray, {"values": {"model.damping": 0.2, "impact.e": 0.8}, "start": np.array([0.35, 0.0])}
)
optimiser = optax.lbfgs()


@jax.jit
def improved(unknown, state):
    """What is unknown after one more step, with the misfit before it."""
    value, gradient = optax.value_and_grad_from_state(misfit)(unknown, state=state)
    moves, state = optimiser.update(
        gradient, state, unknown, value=value, grad=gradient, value_fn=misfit
    )
    return optax.apply_updates(unknown, moves), state, value


state, history = optimiser.init(unknown), [1.0]
while len(history) < 40 and history[-1] > 1e-20:
    unknown, state, value = improved(unknown, state)
    history.append(float(value))
print(f"after {len(history) - 1} steps: {jax.tree.map(np.asarray, unknown)}")
figure, ax = plt.subplots()
ax.semilogy(history[1:], "o-")
ax.set(xlabel="step of L-BFGS", ylabel="mean square of the misfit")
assert np.allclose(
    [*unknown["values"].values(), *unknown["start"]], [0.9, 0.1, 0.3, 0.1], atol=1e-9
)

starts = jnp.stack([jnp.linspace(0.05, 0.8, 200), jnp.zeros(200)], axis=1)
# in lanes, as simulate_many, with its derivatives
ends = jax.vmap(saltus.to_jax(system, periods=2), in_axes=(None, 0))
slope = jax.grad(lambda e: jnp.mean(ends({"impact.e": e}, starts)[:, 0] ** 2))(0.9)
losses = {"impact.e": np.array([[0.9 - 1e-5], [0.9 + 1e-5]])}
mean = (
    saltus.simulate_many(system, parameters=losses, theta=np.array(starts[:, 0]), periods=2).theta
    ** 2
).values.mean(axis=1)
assert np.isclose(slope, np.diff(mean) / 2e-5, rtol=1e-6)
