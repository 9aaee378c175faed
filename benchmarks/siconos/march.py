"""Motions of both layers and of bodies by Siconos, for the Python that has it: march.py EQUATIONS
TASKS ANSWERS, files of JSON.

Moreau and Jean's time stepping with theta = 1/2, Newton's method in each step, a linear
complementarity problem for the impulses. The loop over steps is Siconos' own, in C++; seconds are
processor time of that loop alone. Nothing of saltus is imported here.
"""

import json
import sys
import time

import numpy as np

import siconos.kernel as sk


def march(equations, task):
    """The state at the end, and the seconds of each round."""
    seconds = []
    for _ in range(task["rounds"]):
        if "mass" in task:
            bodies, model = linear_bodies(equations, task)
            simulation = time_stepping(model, task)
            start = time.process_time()
            simulation.run()
            seconds = [time.process_time() - start]
            return {
                "state": [*bodies.q(), *bodies.velocity()],
                "time": simulation.startingTime(),
                "seconds": seconds,
            }
        layers = sk.LagrangianDS(np.array(task["opening"]), np.array(task["velocity"]))
        layers.setzPtr(np.array(task["numbers"]))
        layers.setComputeMassFunction(equations, "mass")
        layers.setComputeFIntFunction(equations, "internal")
        layers.setComputeJacobianFIntqFunction(equations, "internal_by_opening")
        layers.setComputeJacobianFIntqDotFunction(equations, "internal_by_velocity")
        model = sk.NonSmoothDynamicalSystem(0.0, task["duration"])
        model.insertDynamicalSystem(layers)
        for row, e in zip(np.eye(2), task["e"], strict=True):
            model.link(
                sk.Interaction(sk.NewtonImpactNSL(e), sk.LagrangianLinearTIR(row[None, :])), layers
            )
        simulation = time_stepping(model, task)
        start = time.process_time()
        simulation.run()
        seconds.append(time.process_time() - start)
    return {
        "state": [*layers.q(), *layers.velocity()],
        "time": simulation.startingTime(),
        "seconds": seconds,
    }


def time_stepping(model, task):
    """Moreau and Jean's scheme for a model."""
    steps = sk.TimeDiscretisation(0.0, task["duration"] / task["steps"])
    simulation = sk.TimeStepping(model, steps, sk.MoreauJeanOSI(0.5), sk.LCP())
    simulation.setNewtonTolerance(1e-12)
    simulation.setNewtonMaxIteration(20)
    return simulation


def linear_bodies(equations, task):
    """M q'' + C q' + K q = f with the gaps H q + b >= 0, a row each, and their restitution; f is
    constant, or a sine that acts on the first coordinate."""
    mass, stiffness = (np.array(task[name], dtype=float) for name in ("mass", "stiffness"))
    damping = np.array(task.get("damping", 0.0 * mass), dtype=float)
    bodies = sk.LagrangianLinearTIDS(
        np.array(task["position"]), np.array(task["velocity"]), mass, stiffness, damping
    )
    if "wave" in task:
        bodies.setzPtr(np.array(task["wave"]))
        bodies.setComputeFExtFunction(equations, "wave")
    else:
        bodies.setFExtPtr(np.array(task["force"], dtype=float))
    model = sk.NonSmoothDynamicalSystem(0.0, task["duration"])
    model.insertDynamicalSystem(bodies)
    for row, offset, e in zip(task["rows"], task["offsets"], task["e"], strict=True):
        relation = sk.LagrangianLinearTIR(
            np.array([row], dtype=float), np.array([offset], dtype=float)
        )
        model.link(sk.Interaction(sk.NewtonImpactNSL(e), relation), bodies)
    return bodies, model


if __name__ == "__main__":
    with open(sys.argv[2]) as tasks:
        answers = [march(sys.argv[1], task) for task in json.load(tasks)]
    with open(sys.argv[3], "w") as file:
        json.dump(answers, file)
