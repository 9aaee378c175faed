"""What pages say, read in node for each kind of page: a block that overturns, a structure, a model
of one's own; which numbers have sliders, and between which ends; and the jumps of a sweep.
"""

from dataclasses import dataclass, field

import numpy as np
import pytest
from test_agreement import NODE, run_node
from what_works.model_classes import NAMES, model_class, system_of
from what_works.refused import REFUSED

import saltus
from saltus.flow import PortableMotion
from saltus.web import one_file
from saltus.web.description import description as description_of
from saltus.web.study_page import _motion, page_content

pytestmark = pytest.mark.skipif(NODE is None, reason="node is not installed here")
# nothing is struck there; the block is moved by the acceleration of its ground alone; one contact
# has no other one to which it could pass speed
WITHOUT_EFFECT = {
    "smooth": {"impact.e"},
    "smooth, square wave": {"impact.e"},
    "belt": {"impact.e"},
    "belt, no load": {"impact.e"},
    "rocking block": {"load.ground_horizontal.mean"},
    "structure with a contact": {"impact.transfer"},
}
WITH_PAGES = [name for name in NAMES if (name, "page") not in REFUSED]


def words(tasks, folder):
    """What pages say, each given by its system, its start, its length and maybe a sweep."""
    given = []
    for system, start, length, sweep in tasks:
        state = dict(start)
        asked = {"periods": None, "duration": None} | length
        motion = _motion(system, state.pop("velocity", 0.0), state, asked, 1e-12, 0.0)
        wasm, description = page_content(system, motion, "", [])
        given.append({"wasm": wasm, "description": description, "sweep": sweep})
    return run_node("words.mjs", one_file.PAGE.as_uri(), given, folder)


def overturning(amplitude=0.5):
    pulse = saltus.OneSine(amplitude=amplitude, frequency=4.0, start=0.5, quantity="acceleration")
    return saltus.System(
        model=saltus.RockingBlock(alpha=np.deg2rad(15)),
        load=saltus.Load(ground_horizontal=pulse),
        impact=saltus.VelocityReduction(e=0.9),
    )


@dataclass(frozen=True, kw_only=True)
class Swing(saltus.OneContactModel):
    """A pendulum at a wall that ends where it is upright, with a landmark on its way."""

    wall: float = -0.3
    restitution: float = field(default=0.8, metadata=saltus.number_range(at_least=0, at_most=1))

    coordinates = ("phi",)
    channels = ("torque",)
    sides = (1,)
    stops = ("upright",)
    margin_kinds = {  # noqa: RUF012
        "upright": saltus.systems.MarginKind.LIMIT,
        "level": saltus.systems.MarginKind.LANDMARK,
    }

    @property
    def contact(self):
        return self.wall

    def margins(self, t, phi, velocity, acceleration, side, load):
        return {"upright": np.pi - phi, "level": np.pi / 2 - phi}

    def margin_names(self, load):
        return ("upright", "level")

    def acceleration(self, t, phi, velocity, side, load):
        return load.torque(t) - np.sin(phi)

    def gap(self, phi, side):
        return phi - self.wall

    def reset(self, t, velocity, side, load, impact):
        return side, -self.restitution * velocity


def swinging():
    return saltus.System(model=Swing(), load=saltus.Load(torque=0.0))


def test_a_block_that_overturns_says_so(tmp_path):
    system = overturning()
    motion = saltus.simulate(system, theta=0.0, duration=20.0)
    (said,) = words([(system, {"theta": 0.0}, {"duration": 20.0}, None)], tmp_path)
    assert motion.limit == "overturned"
    assert f"The block overturns at {motion.time:.6g}." in said["summary"]
    assert said["atEnd"] == {"kind": "limit", "text": "The block overturns here: the motion ends."}
    assert said["atStart"]["kind"] == "fine"
    for wrong in ("not passed", "no such mechanism", "margin"):
        assert wrong not in said["summary"] + said["atEnd"]["text"]


def test_a_block_that_stands_says_that_its_margin_is_not_passed(tmp_path):
    (said,) = words([(overturning(0.4), {"theta": 0.0}, {"duration": 20.0}, None)], tmp_path)
    assert "overturned: not passed." in said["summary"]
    assert "overturns" not in said["summary"]


def test_a_model_of_ones_own_names_the_margin_that_ends_it_and_passes_others(tmp_path):
    system = swinging()
    start = {"phi": 0.0, "velocity": 2.5}  # more than 2, with which it would come to rest upright
    motion = saltus.simulate(system, **start, duration=20.0)
    (said,) = words([(system, start, {"duration": 20.0}, None)], tmp_path)
    assert motion.limit == "upright"
    assert (
        f"It ends at {motion.time:.6g}, where the margin “upright” reaches zero." in said["summary"]
    )
    assert f"level: passed first at {motion.validity.first['level']:.6g}" in said["summary"]
    assert said["atEnd"]["text"] == "The margin “upright” is zero here: the motion ends."
    ends = {slider["path"]: (slider["low"], slider["high"]) for slider in said["sliders"]}
    assert ends["model.restitution"] == (0.0, 1.0)


def test_a_number_that_no_equation_reads_has_no_slider_and_is_named(tmp_path):
    system = swinging()
    _, description = page_content(
        system, _motion(system, 2.5, {"phi": 0.0}, {"duration": 20.0}, 1e-12, 0.0), "", []
    )
    assert description["without_effect"] == ["impact.e"]
    assert description["impact"]["parameters"] == []
    ends = [
        saltus.simulate(system.with_({"impact.e": e}), phi=0.0, velocity=1.5, duration=20.0).phi
        for e in (0.2, 0.9)
    ]
    assert ends[0] == ends[1]
    (said,) = words([(system, {"phi": 0.0}, {"duration": 20.0}, None)], tmp_path)
    assert "impact.e" not in {slider["path"] for slider in said["sliders"]}


def row_of_masses(**more):
    """Four masses in a row, the second and the last of them with a stop."""
    stiffness = 2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    stiffness[2, 3] = stiffness[3, 2] = 0.0
    contacts = [
        saltus.Contact(name="tip", coordinate=3, position=0.6, sign=-1),
        saltus.Contact(name="inner", coordinate=1, position=-0.4),
    ]
    return saltus.Structure(
        mass=np.diag([1.0, 2.0, 3.0, 4.0]), stiffness=stiffness, contacts=contacts, **more
    )


def points_of(model):
    return description_of(PortableMotion(saltus.System(model=model)))["model"]["points"]


def test_a_structure_is_drawn_by_its_rows_with_what_couples_them():
    model = row_of_masses()
    points = points_of(model)
    assert [point["name"] for point in points] == ["x0", "x1", "x2", "x3"]
    assert [point["tie"] for point in points] == ["", "spring", "spring", ""]  # as in the stiffness
    u = np.array([0.1, -0.2, 0.3, 0.5])
    state = model.start(u)
    place = np.array([state[name] for name in model.coordinates])
    weights = np.array([point["weights"] for point in points])
    np.testing.assert_allclose(weights @ place, u, atol=1e-14)


def test_a_structure_with_named_points_is_drawn_by_these_and_its_contacts():
    model = row_of_masses(points={"mean": {0: 0.5, 2: 0.5}, "first": 0})
    points = points_of(model)
    assert [point["name"] for point in points] == ["mean", "first", "x3", "x1"]
    u = np.array([0.1, -0.2, 0.3, 0.5])
    state = model.start(u)
    place = np.array([state[name] for name in model.coordinates])
    weights = np.array([point["weights"] for point in points])
    np.testing.assert_allclose(weights @ place, [0.2, 0.1, 0.5, -0.2], atol=1e-14)


def test_rotations_of_a_beam_are_not_drawn_among_its_displacements():
    model = row_of_masses(names=["w1", "w2", "phi1", "w3"])
    assert [point["name"] for point in points_of(model)] == ["w1", "w2", "w3"]


def span_of(name):
    """How long the motion of a class is: a forcing period, where there is one."""
    return {"duration": 6.0} if system_of(name).load.period is None else {"periods": 1}


@pytest.fixture(scope="module")
def pages_of_all_classes(tmp_path_factory):
    tasks = [
        (system_of(name), model_class(name).whole_start, span_of(name), None) for name in WITH_PAGES
    ]
    return dict(zip(WITH_PAGES, words(tasks, tmp_path_factory.mktemp("pages")), strict=True))


@pytest.mark.parametrize("name", WITH_PAGES)
def test_sliders_are_the_numbers_of_the_system_within_what_it_takes(name, pages_of_all_classes):
    system, sliders = system_of(name), pages_of_all_classes[name]["sliders"]
    without = WITHOUT_EFFECT.get(name, set())
    assert {slider["path"] for slider in sliders} == set(system.parameters) - without
    for slider in sliders:
        assert slider["low"] < slider["high"], slider
        assert slider["refused"] == ["", "", ""], slider


@pytest.mark.parametrize("name", WITH_PAGES)
def test_a_page_says_how_many_impacts_there_are(name, pages_of_all_classes):
    motion = saltus.simulate(system_of(name), **model_class(name).whole_start, **span_of(name))
    counted = sum(str(event.kind) == "impact" for event in motion.events)
    said = pages_of_all_classes[name]["summary"]
    assert said.startswith(f"{counted} impact{'' if counted == 1 else 's'} up to time ")


def test_the_jumps_of_a_page_s_sweep_are_at_the_folds_of_the_branch(tmp_path):
    """The metainterface of Fig. 9b: a jump each way and a smooth flank.

    On the way down the amplitude rises before it jumps, so that the step has nearly no change.
    """
    system = saltus.System(
        model=saltus.Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=saltus.Load(frequency=0.85, horizontal=saltus.Harmonic(amplitude=0.5), vertical=-0.5),
    )
    sweep = {"path": "load.frequency", "low": 0.7, "high": 1.1, "count": 17, "periods": 60}
    (said,) = words([(system, {"theta": 0.3}, {"periods": 5}, sweep)], tmp_path)
    branch = saltus.continue_orbit(
        saltus.find_orbit(system, theta=0.3), "load.frequency", (0.7, 1.1)
    )
    folds = [point.parameter for point in branch.special if str(point.kind) == "LP"]
    jumps = said["swept"]["jumps"]
    assert [way for way, _, _ in jumps] == ["up", "down"]
    places = [0.5 * (one + other) for _, one, other in jumps]
    assert len(folds) == 2
    assert abs(places[0] - max(folds)) < 1e-3
    assert abs(places[1] - min(folds)) < 1e-3
    assert said["swept"]["said"].startswith("Jumps on the way up at 0.90")
