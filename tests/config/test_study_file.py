"""What a study file may say, and that it becomes the system that Python would have written."""

import math

import numpy as np
import pytest

from saltus import InelasticImpact
from saltus.config import load_study
from saltus.systems import (
    EnergyRestitution,
    Harmonic,
    Load,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
)


@pytest.fixture
def study(tmp_path):
    def load(text, **files):
        for name, content in files.items():
            (tmp_path / name.replace("_py", ".py").replace("_csv", ".csv")).write_text(content)
        path = tmp_path / "study.toml"
        path.write_text(text)
        return load_study(path)

    return load


TEN_LINES = """
[model]
type = "Metainterface"
beta0 = "80 deg"
damping = 0.1
[load]
frequency = 1.0
horizontal = { amplitude = 0.5 }
vertical = -0.5
[simulate]
theta = 0.3
periods = 20
"""


def test_ten_lines_are_the_system_of_the_python_interface(study):
    read = study(TEN_LINES)
    assert read.system == System(
        model=Metainterface(beta0=np.deg2rad(80), damping=0.1),
        load=Load(frequency=1.0, horizontal=Harmonic(amplitude=0.5), vertical=-0.5),
        impact=VelocityReduction(1.0),
    )
    assert read.name == "study"
    assert read.settings().arguments == {"theta": 0.3, "periods": 20.0}


@pytest.mark.parametrize(
    ("written", "radians"),
    [
        ('"80 deg"', math.radians(80)),
        ('"80deg"', math.radians(80)),
        ('"80°"', math.radians(80)),
        ('"1.4 rad"', 1.4),
        ('" 8e1 deg "', math.radians(80)),
        ("1.4", 1.4),
        ("1", 1.0),
    ],
)
def test_angles_are_degrees_or_radians(study, written, radians):
    assert (
        study(f'[model]\ntype = "Metainterface"\nbeta0 = {written}\n').system.model.beta0 == radians
    )


def test_every_angle_may_be_in_degrees(study):
    read = study(
        '[model]\ntype = "RockingBlock"\nalpha = "15 deg"\n[load]\nfrequency = 2\nground_horizontal'
        ' = { amplitude = 0.1, phase = "90 deg" }\n[simulate]\ntheta = "-5 deg"\nduration = 3\n'
    )
    assert read.system.model == RockingBlock(alpha=math.radians(15))
    assert read.system.get("load.ground_horizontal.phase") == math.pi / 2
    assert read.settings().arguments | {"duration": 3.0} == {"duration": 3.0} | {
        "theta": math.radians(-5)
    }


def test_a_list_is_the_sum_of_its_signals(study):
    read = study(
        '[model]\ntype = "Metainterface"\nbeta0 = 1\n[load]\nfrequency = 1\nhorizontal = [0.2, {'
        " amplitude = 0.5, order = 3 }]\n"
    )
    assert read.system.load == Load(
        frequency=1.0, horizontal=Harmonic(amplitude=0.5, order=3).__radd__(0.2)
    )


@pytest.mark.parametrize(
    ("table", "law"),
    [
        ('type = "EnergyRestitution"\nr = 0.9', EnergyRestitution(0.9)),
        ('type = "InelasticImpact"', InelasticImpact()),
        ('type = "VelocityReduction"', VelocityReduction(1.0)),
    ],
)
def test_impact_laws(study, table, law):
    assert (
        study(f'[model]\ntype = "Metainterface"\nbeta0 = 1\n[impact]\n{table}\n').system.impact
        == law
    )


def test_the_wall_oscillator_starts_at_x(study):
    read = study(
        '[model]\ntype = "WallOscillator"\nwall = 0.5\n[load]\nforce = 0.1\n[simulate]\nx ='
        " -0.2\nduration = 4\n"
    )
    assert read.system.model == WallOscillator(wall=0.5)
    assert read.settings().arguments["x"] == -0.2


def test_all_settings(study):
    settings = study(
        '[model]\ntype = "Metainterface"\nbeta0 = 1\n[simulate]\ntheta = -0.1\nvelocity ='
        ' 2\nduration = 3\ntol = 1e-8\ntime = 1.5\nside = -1\nstop_at = ["line_limit",'
        ' "reaction"]\nsamples = 11\n'
    ).settings()
    assert settings.arguments == {
        "theta": -0.1,
        "velocity": 2.0,
        "duration": 3.0,
        "tol": 1e-8,
        "time": 1.5,
        "side": -1,
        "stop_at": ("line_limit", "reaction"),
    }
    assert settings.samples == 11


def test_what_a_run_is_given_takes_the_place_of_the_file_s_own(study):
    read = study(
        '[model]\ntype = "Metainterface"\nbeta0 = 1\n[simulate]\ntheta = 0.1\nduration = 3\ntol ='
        " 1e-8\n"
    )
    motion = read.run(duration=0.5, tol=1e-10)
    assert (motion.time, motion.tol) == (0.5, 1e-10)


@pytest.mark.parametrize(
    "content",
    [
        "0,0\n0.5,1\n1,-1\n",
        "time,acceleration\n0,0\n0.5,1\n1,-1\n",
        "# a quake\n\ntime;a\n0;0;9\n0.5;1;9\n1;-1;9\n",
        "0 0\n0.5 1\n1 -1",
        "t\ta\n0\t0\r\n0.5\t1\r\n1\t-1\r\n",
        "\ufeff0,0\n0.5,1\n1,-1\n",
    ],
)
def test_records_are_read_from_two_columns(study, content):
    text = '[model]\ntype = "RockingBlock"\nalpha = 0.2\n[load.ground_horizontal]\nfile = "q.csv"\n'
    text += 'quantity = "acceleration"\nscale = 2\n'
    assert study(text, q_csv=content).system.load.channels["ground_horizontal"] == Record(
        [0, 0.5, 1], [0, 1, -1], quantity="acceleration", scale=2.0
    )


OWN = """
from dataclasses import dataclass, field
from saltus.systems import Model

@dataclass(frozen=True, slots=True, kw_only=True)
class Duffing(Model):
    cubic: float
    tilt: float = field(default=0.0, metadata={"unit": "rad"})
    channels = ("force",)

    def acceleration(self, t, theta, velocity, side, load):
        return load.force(t) - theta - self.cubic * theta**3
"""


def test_a_model_of_ones_own_is_a_class_in_a_file_beside_the_study(study):
    read = study(
        '[model]\ntype = "own.py:Duffing"\ncubic = 0.5\ntilt = "90 deg"\n[load]\nforce = 1\n',
        own_py=OWN,
    )
    assert (read.system.model.cubic, read.system.model.tilt) == (0.5, math.pi / 2)
    assert read.system.model.acceleration(0.0, 2.0, 0.0, 1, read.system.load) == 1 - 2 - 4
    # so that motion.nc can be read back
    assert System.from_json(read.system.to_json()) == read.system


def test_a_model_may_come_from_an_installed_module(study):
    read = study('[model]\ntype = "saltus.systems:WallOscillator"\nwall = 2\n')
    assert read.system.model == WallOscillator(wall=2.0)
