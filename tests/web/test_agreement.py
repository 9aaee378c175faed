"""The page's engine in node against Python: random systems of all models, event by event.

Both follow the same equations, and round differently. By how much rounding grows along a motion is
measured in Python, by starting it again beside its start; a motion is compared as long as this
stays small.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import saltus
from saltus.web import one_file
from saltus.web.description import page_parts

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed here")
Harmonic, Load, System = saltus.Harmonic, saltus.Load, saltus.System
NEAR = 1e-12
AT = [1.0, 5.0]  # times at which energies are compared


def shaken(rng, channel, **more):
    return Load(
        frequency=rng.uniform(0.5, 2.0),
        **{channel: Harmonic(rng.uniform(0.1, 1.0), phase=rng.uniform(0.0, 6.0))},
        **more,
    )


def cell(rng):
    load = shaken(rng, "horizontal", vertical=rng.uniform(-0.8, -0.2))
    model = saltus.Metainterface(
        beta0=rng.uniform(1.2, 1.5),
        damping=rng.uniform(0.02, 0.3),
        mass_ratio=rng.uniform(0.0, 0.5),
    )
    return System(model=model, load=load, impact=saltus.VelocityReduction(rng.uniform(0.5, 1.0))), {
        "theta": 0.3
    }


def inelastic_cell(rng):
    load = shaken(rng, "ground_horizontal", vertical=rng.uniform(-0.6, -0.3))
    model = saltus.Metainterface(beta0=rng.uniform(1.3, 1.5), damping=rng.uniform(0.02, 0.3))
    return System(model=model, load=load, impact=saltus.InelasticImpact()), {"theta": 0.2}


def wall(rng):
    load = Load(
        frequency=rng.uniform(0.6, 2.0),
        force=[Harmonic(rng.uniform(0.2, 1.0)), Harmonic(0.2, order=2), 0.1],
    )
    model = saltus.WallOscillator(damping=rng.uniform(0.0, 0.3), wall=rng.uniform(-0.2, 0.5))
    return System(model=model, load=load, impact=saltus.EnergyRestitution(rng.uniform(0.3, 1.0))), {
        "x": -0.3
    }


def cornered(rng):
    """A load that jumps: its shape is a setting, of which a page has one."""
    force = [
        saltus.Square(rng.uniform(0.2, 1.0), phase=0.4, duty=0.3),
        saltus.Triangle(rng.uniform(0.2, 1.0), phase=-0.9),
    ]
    load = Load(frequency=rng.uniform(0.6, 2.0), force=force)
    model = saltus.WallOscillator(damping=rng.uniform(0.0, 0.3), wall=rng.uniform(-0.2, 0.5))
    return System(model=model, load=load, impact=saltus.EnergyRestitution(rng.uniform(0.3, 1.0))), {
        "x": -0.3
    }


def block(rng):
    pulse = saltus.OneSine(
        amplitude=rng.uniform(1.0, 2.0),
        frequency=rng.uniform(2.0, 6.0),
        start=rng.uniform(0.0, 1.0),
        quantity="acceleration",
    )
    system = System(
        model=saltus.RockingBlock(alpha=rng.uniform(0.1, 0.3)),
        load=Load(ground_horizontal=pulse),
        impact=saltus.VelocityReduction(rng.uniform(0.7, 0.95)),
    )
    return system, {"theta": 0.0}


def recorded(rng):
    """A block on a measured ground, whose scale and the block's slenderness are those of the
    page.
    """
    times = np.linspace(0.0, 12.0, 61)
    values = np.sin(1.3 * times) * np.exp(-0.1 * times) + 0.4 * np.cos(3.1 * times)
    record = saltus.Record(
        time=times, value=values - values[0], quantity="acceleration", scale=rng.uniform(0.2, 0.5)
    )
    system = System(
        model=saltus.RockingBlock(alpha=rng.uniform(0.2, 0.35)),
        load=Load(ground_horizontal=record),
        impact=saltus.VelocityReduction(rng.uniform(0.7, 0.95)),
    )
    return system, {"theta": 0.05}


def stops(rng):
    model = saltus.TwoStops(
        damping=rng.uniform(0.0, 0.2), left=-rng.uniform(0.2, 1.0), right=rng.uniform(0.3, 1.0)
    )
    law = saltus.NewtonImpact(e=rng.uniform(0.3, 0.9))
    return System(model=model, load=shaken(rng, "force"), impact=law), {"x": 0.1, "velocity": 0.3}


def pair(rng):
    model = saltus.ImpactPair(
        damping=rng.uniform(0.05, 0.3),
        mass_ratio=rng.uniform(0.05, 0.5),
        clearance=rng.uniform(0.3, 1.0),
    )
    system = System(
        model=model, load=shaken(rng, "force"), impact=saltus.NewtonImpact(e=rng.uniform(0.4, 0.8))
    )
    return system, {"z": 0.1, "x": 0.1}


def belt(rng):
    kinetic = rng.uniform(0.1, 0.4)
    model = saltus.BeltOscillator(
        kinetic=kinetic, static=kinetic + rng.uniform(0.0, 0.3), belt_speed=rng.uniform(-0.3, 0.5)
    )
    return System(model=model, load=shaken(rng, "force")), {"x": 0.0, "velocity": 0.05}


def layers(rng):
    load = shaken(rng, "horizontal", vertical=rng.uniform(-0.6, -0.3))
    model = saltus.TwoLayer(
        beta0=rng.uniform(1.3, 1.5),
        damping=rng.uniform(0.05, 0.3),
        mass_ratio=rng.uniform(0.0, 0.5),
    )
    law = saltus.NewtonImpact(e=rng.uniform(0.0, 0.5), transfer=rng.uniform(0.3, 0.9))
    return System(model=model, load=load, impact=law), {"theta_1": 0.2, "theta_2": 0.0}


def cells(rng):
    load = shaken(rng, "horizontal", vertical=rng.uniform(-0.6, -0.3))
    model = saltus.CellChain(
        cells=2,
        beta0=rng.uniform(1.3, 1.5),
        damping=rng.uniform(0.05, 0.3),
        coupling=rng.uniform(0.0, 0.3),
    )
    law = saltus.NewtonImpact(e=rng.uniform(0.0, 0.5), transfer=rng.uniform(0.3, 0.9))
    return System(model=model, load=load, impact=law), {
        "lower_1": 0.2,
        "upper_1": 0.0,
        "lower_2": 0.1,
        "upper_2": 0.0,
    }


def masses(rng):
    stiffness = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    stop = saltus.Contact(name="stop", coordinate=3, position=rng.uniform(0.1, 0.5), sign=-1)
    model = saltus.Structure(
        mass=np.eye(4),
        damping=0.05 * stiffness,
        stiffness=stiffness,
        contacts=[stop],
        forces={"force": 0},
        names=tuple("abcd"),
    )
    system = System(
        model=model, load=shaken(rng, "force"), impact=saltus.NewtonImpact(e=rng.uniform(0.3, 0.9))
    )
    return system, {name: rng.uniform(-0.03, 0.03) for name in model.coordinates}


KINDS = (
    cell,
    inelastic_cell,
    wall,
    cornered,
    block,
    recorded,
    stops,
    pair,
    belt,
    layers,
    cells,
    masses,
)


def length_of(system):
    return {"duration": 40.0} if system.load.period is None else {"periods": 20}


def started(system, start, shift=0.0):
    """The motion from a start that is moved by a little, or the sentence with which it is
    refused.
    """
    moved = {name: value + shift if value else value for name, value in start.items()}
    speeds = moved.pop("velocity", 0.0)
    try:
        return saltus.simulate(system, velocity=speeds, **moved, **length_of(system))
    except saltus.MotionError as error:
        return str(error)


def as_start(system, start):
    names = system.model.coordinates
    return {name: value for name, value in start.items() if name in names} | {
        f"{names[0]}_velocity": start.get("velocity", 0.0)
    }


def run_node(script, address, given, folder):
    """What a script beside this file prints as JSON, which is given an address and a file; bytes
    are given in base64.
    """
    file = Path(folder) / "given.json"
    file.write_text(json.dumps(given, default=lambda content: base64.b64encode(content).decode()))
    command = [
        str(NODE),
        "--experimental-default-type=module",
        str(Path(__file__).parent / script),
        address,
        str(file),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


def in_node(tasks, folder):
    return run_node("agreement.mjs", (one_file.PAGE / "engine.js").as_uri(), tasks, folder)


def events_of(motion):
    return [(event.time, str(event.kind)) for event in motion.events]


def compared(motion, beside, other):
    """How many events of a motion agree with those of the page, all of them as far as rounding lets
    them be known.
    """
    own, page, count = events_of(motion), other["events"], 0
    known = [events_of(each) for each in beside]
    for i, (time, kind) in enumerate(own):
        near = [events[i] for events in known if len(events) > i]
        if not near or any(other_kind != kind for _, other_kind in near):
            return count, False
        spread = max(abs(other_time - time) for other_time, _ in near)
        if spread > 1e-7:
            return count, False
        assert len(page) > i, (i, time, kind)
        assert page[i][1] == kind, (i, time, kind, page[i])
        assert abs(page[i][0] - time) <= NEAR * max(1.0, time) + 30.0 * spread, (
            i,
            time,
            kind,
            page[i],
            spread,
        )
        count += 1
    return count, True


def check_whole(system, motion, beside, other, at=AT):
    """A motion that rounding does not change: its end, its margins and its energy are the
    page's.
    """
    assert other["stop"] == motion.stop
    ends = [np.append(np.ravel(m.position), np.ravel(m.velocity)) for m in (motion, *beside)]
    spread = max(np.max(np.abs(end - ends[0])) for end in ends[1:])
    assert np.max(np.abs(other["end"] - ends[0])) <= NEAR + 100.0 * spread, (
        system,
        other["end"],
        ends,
    )
    allowed = 1e-9 + 1e4 * spread  # a margin that is passed slantwise is passed later or earlier
    for name, share in other["validity"]["share"].items():
        assert abs(share - motion.validity.share[name]) <= allowed, (
            system,
            name,
            other["validity"],
            motion.validity,
        )
        if name != motion.limit:  # at which it ends, so that rounding decides on which side
            assert (other["validity"]["first"][name] is None) == (
                motion.validity.first[name] is None
            ), (system, name)
    for time, energy in zip(at, other["energies"], strict=True):
        if energy is None or time > motion.time:  # a model need not have an energy
            continue
        assert abs(energy - kinetic_energy(system, motion, time)) <= allowed, (system, time)


def kinetic_energy(system, motion, time):
    """Of the model itself, at Python's state."""
    position, velocity = (np.reshape(each, (-1, 1))[:, 0] for each in motion.at([time])[:2])
    side = (
        motion.side
        if not system.model.sides
        else float(motion.dense.states(np.array([time]))[2][0]) or 1.0
    )
    state = (position[0], velocity[0]) if len(position) == 1 else (tuple(position), tuple(velocity))
    return system.model.kinetic_energy(time, *state, side, system.load)


def check(seed, each, kinds, folder):
    rng = np.random.default_rng(seed)
    tasks, known = [], []
    for kind in kinds:
        made = [kind(rng) for _ in range(each)]
        wasm, description = page_parts(made[0][0])
        motions = [
            {
                "values": system.parameters,
                "start": as_start(system, start),
                **length_of(system),
                "at": AT,
            }
            for system, start in made
        ]
        tasks.append({"wasm": wasm, "description": description, "motions": motions})
        known.append(made)
    counts, whole = 0, 0
    for made, found in zip(known, in_node(tasks, folder), strict=True):
        for (system, start), other in zip(made, found, strict=True):
            motion, *beside = (
                started(system, start, shift) for shift in (0.0, 1e-14, -1e-14, 3e-14)
            )
            if isinstance(motion, str):
                assert other["reason"] == motion
                continue
            followed = [each for each in beside if not isinstance(each, str)]
            count, complete = compared(motion, followed, other)
            counts += count
            if complete and len(followed) == len(beside):
                whole += 1
                check_whole(system, motion, beside, other)
    return counts, whole


@dataclass(frozen=True, kw_only=True)
class Pendulum(saltus.OneContactModel):
    """A pendulum at a wall, with a drawing of its own."""

    length: float = 1.0
    wall: float = -0.3

    coordinates = ("phi",)
    channels = ("torque",)
    sides = (1,)

    @property
    def contact(self):
        return self.wall

    def acceleration(self, t, phi, velocity, side, load):
        return load.torque(t) - 0.05 * velocity - np.sin(phi) / self.length

    def gap(self, phi, side):
        return phi - self.wall

    def reset(self, t, velocity, side, load, impact):
        return side, -impact.velocity_after(self, t, velocity, side, side, load)

    def drawing(self, position):
        bob = [self.length * np.sin(position[0]), -self.length * np.cos(position[0])]
        bar = saltus.systems.Shape("line", np.array([[0.0, 0.0], bob]), "bar")
        return [bar, saltus.systems.Shape("circle", np.array([bob]), "mass", 0.1 * self.length)]


def test_a_drawing_of_the_models_own_is_traced_with_all_of_its_numbers(tmp_path):
    load = Load(frequency=0.8, torque=Harmonic(0.3))
    system = System(model=Pendulum(), load=load, impact=saltus.VelocityReduction(0.8))
    longer = system.with_({"model.length": 1.7})
    wasm, description = page_parts(system)
    motion = {"values": longer.parameters, "start": {"phi": 0.4}, "periods": 3, "at": AT}
    ((found,),) = in_node(
        [{"wasm": wasm, "description": description, "motions": [motion]}], tmp_path
    )
    for state, drawing in zip(found["states"], found["drawings"], strict=True):
        known = saltus.systems.drawing_of(longer, state[:1])
        assert [(shape["kind"], shape["role"]) for shape in drawing] == [
            (shape.kind, shape.role) for shape in known
        ]
        for shape, one in zip(drawing, known, strict=True):
            np.testing.assert_allclose(shape["points"], one.points, atol=1e-15)
        assert drawing[1]["radius"] == known[1].radius == 0.1 * 1.7


def test_a_ramp_far_from_0_and_short_pushes_with_its_amplitude(tmp_path):
    """A free mass has the speed amplitude (t - start - duration / 2). The difference of end and
    start has an error of 1e-4 in the second case.
    """
    cases = [(1.0, 1e-3), (1.0, 1e-12), (1000.0, 1e-9)]
    system = System(
        model=saltus.WallOscillator(stiffness=0.0, wall=1e9),
        load=Load(force=saltus.Ramp(amplitude=1.0, duration=1.0, start=1.0)),
        impact=saltus.VelocityReduction(1.0),
    )
    wasm, description = page_parts(system)
    motions = [
        {
            "values": {"load.force.start": start, "load.force.duration": duration},
            "start": {"x": 0.0, "x_velocity": 0.0},
            "duration": start + 10.0,
            "at": [],
        }
        for start, duration in cases
    ]
    task = {"wasm": wasm, "description": description, "motions": motions}
    (found,) = in_node([task], tmp_path)
    speeds = [motion["end"][1] for motion in found]
    expected = [10.0 - duration / 2.0 for _, duration in cases]
    np.testing.assert_allclose(speeds, expected, rtol=1e-12)


def test_a_friction_without_force_has_no_events_on_a_page(tmp_path):
    """It had slips and turns there, which Python's motion has not."""
    load = Load(frequency=1.1, force=Harmonic(0.8))
    system = System(model=saltus.BeltOscillator(kinetic=0.2, static=0.3), load=load)
    idle = {"model.kinetic": 0.0, "model.static": 0.0}
    wasm, description = page_parts(system)
    motions = [
        {"values": values, "start": {"x": 0.0, "x_velocity": 0.4}, "periods": 6, "at": AT}
        for values in (idle, {})
    ]
    ((without, rubbed),) = in_node(
        [{"wasm": wasm, "description": description, "motions": motions}], tmp_path
    )
    assert without["events"] == []
    assert len(rubbed["events"]) > 5
    motion = saltus.simulate(system.with_(idle), x=0.0, velocity=0.4, periods=6)
    np.testing.assert_allclose(without["end"], [motion.position, motion.velocity], atol=1e-11)


def test_motions_of_the_page_are_those_of_python(tmp_path):
    """Both kernels, and two systems of each kind."""
    counts, whole = check(1, 2, KINDS, tmp_path)
    assert counts > 400
    assert whole >= 10


@pytest.mark.thorough
def test_300_random_motions_of_all_models_are_those_of_python(tmp_path):
    counts, whole = check(2, 30, KINDS, tmp_path)
    assert counts > 5000
    assert whole > 150
