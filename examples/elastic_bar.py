"""
An elastic bar hits a wall
==========================

A bar of length 1 and wave speed 1, in up to 100 linear elements, given by its mass and stiffness
matrices, meets a rigid wall. It leaves it when the pressure wave comes back from the free end,
after 2 L / c, whatever the restitution of the node at the wall: with a restitution the node bounces
some hundred times within this time, and each of its bounces matters less the finer the mesh.
"""

import matplotlib.pyplot as plt
import numpy as np

import saltus


def bar(elements, e):
    mass, ends = np.eye(elements + 1) / elements, [0, -1]
    stiffness = elements * (
        2 * np.eye(elements + 1) - np.eye(elements + 1, k=1) - np.eye(elements + 1, k=-1)
    )
    mass[ends, ends] /= 2
    stiffness[ends, ends] /= 2
    wall = saltus.Contact(name="wall", coordinate=0)  # of row 0 of the matrices
    return saltus.System(
        model=saltus.Structure(mass=mass, stiffness=stiffness, contacts=[wall]),
        impact=saltus.NewtonImpact(e=e),
    )


def contact_time(elements, e):
    system = bar(elements, e)
    motion = saltus.simulate(
        system, **system.model.start(displacement=1e-3, velocity=-1.0), duration=4.0
    )
    return motion.events[-1].time - 1e-3


meshes = np.array([12, 25, 50, 100])
for e in (0.0, 0.5, 0.9):
    times = np.array([contact_time(n, e) for n in meshes])
    plt.loglog(meshes, times - 2.0, "o-", label=f"e = {e:g}")
    r = 2 ** (-2 / 3)  # the error of a wave front in a chain falls as the power -2/3 of its length
    limit = (times[-1] - r * times[-2]) / (1 - r)
    print(
        f"e = {e:g}: in contact for {times[-1]:.5f} with 100 elements, for {limit:.5f} in the limit"
    )
    assert abs(limit - 2.0) < 0.004
plt.xlabel("elements")
plt.ylabel("contact time - 2 L / c")
plt.legend()
