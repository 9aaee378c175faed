"""Bad studies: one sentence with the file and the dotted key, what was wrong and what would be
right.
"""

import os

import pytest

from saltus.config import load_study
from saltus.errors import ParameterError

MODEL = '[model]\ntype = "Metainterface"\nbeta0 = "80 deg"\n'
QUAKE = (
    '[model]\ntype = "RockingBlock"\nalpha = 0.2\n[load]\nground_horizontal = { file = '
    '"q.csv", quantity = "acceleration" }\n'
)


def refusal(tmp_path, text):
    path = tmp_path / "study.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ParameterError) as caught:
        load_study(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message[len(str(path)) :]


def beta0(value):
    return f'[model]\ntype = "Metainterface"\nbeta0 = {value}\n'


def simulate(*lines):
    return MODEL + "[simulate]\n" + "\n".join(lines) + "\n"


CASES = {
    "no_model": ("[load]\nvertical = 1\n", "has no [model]"),
    "part": (MODEL + "[laod]\nvertical = 1\n", "unknown key 'laod'; did you mean 'load'?"),
    "type_missing": ("[model]\nbeta0 = 1\n", "model.type is missing"),
    "type_near": ('[model]\ntype = "Metainterfase"\n', "did you mean 'Metainterface'?"),
    "type_number": ("[model]\ntype = 3\n", "model.type must be text in quotes"),
    "model_no_table": ("model = 3\n", "model must be a table of keys and values, got 3"),
    "key_near": (MODEL + "dampning = 0.1\n", "unknown key model.dampning; did you mean 'damping'?"),
    "key_missing": (
        '[model]\ntype = "Metainterface"\n',
        "model.beta0 is missing; Metainterface needs it",
    ),
    "misspelt_required": (beta0(1).replace("beta0", "beta_0"), "did you mean 'beta0'?"),
    "degrees": (beta0(80), "model.beta0 must lie in (0, pi) rad, got 80.0 (degrees?)"),
    "beta0_zero": (beta0(0), "model.beta0 must lie in (0, pi) rad, got 0.0"),
    "beta0_degrees": (beta0('"180 deg"'), "model.beta0 must lie in (0, pi) rad"),
    "unit": (beta0('"80 degree s"'), 'model.beta0 must be an angle such as "80 deg", "1.4 rad"'),
    "quoted_angle": (beta0('"1.4"'), 'model.beta0 must be an angle such as "80 deg", "1.4 rad"'),
    "nan": (beta0("nan"), "model.beta0 must be a finite number, got nan"),
    "inf": (MODEL + "damping = -inf\n", "model.damping must be a finite number, got -inf"),
    "negative": (MODEL + "damping = -0.1\n", "model.damping must lie in [0, inf), got -0.1"),
    "string": (
        MODEL + 'damping = "0.1"\n',
        'model.damping must be a number, got the text "0.1"; write it without quotes: 0.1',
    ),
    "angle_for_number": (
        MODEL + 'damping = "1 deg"\n',
        'model.damping must be a number, got the text "1 deg"',
    ),
    "switch": (MODEL + "damping = true\n", "model.damping must be a number, got true"),
    "date": (
        MODEL + "damping = 2022-01-01\n",
        "model.damping must be a number, got a date or a time",
    ),
    "list": (MODEL + "damping = [1]\n", "model.damping must be a number, got a list"),
    "huge": (
        MODEL + f"damping = {10**400}\n",
        "model.damping must be a finite number, got a very large number",
    ),
    "large": (
        MODEL + "damping = 1e308\n",
        "model.damping must be at most 1e+100 in size, got 1e+308",
    ),
    "large_load": (
        MODEL + "[load]\nfrequency = 1\nvertical = { amplitude = -1e101 }\n",
        "load.vertical.amplitude must be at most 1e+100 in size, got -1e+101",
    ),
    "no_module": (
        '[model]\ntype = "../x:Y"\n',
        'model.type: the text "../x" is no Python file, such as my_model.py',
    ),
    "one_contact": (
        MODEL + '[impact]\ntype = "NewtonImpact"\ne = 0.5\n',
        (
            "a Metainterface passes its contact and does not bounce there, so that impact.e must be"
            " 0, got 0.5"
        ),
    ),
    "smoothing": (
        MODEL + "smoothing = 100\nmass_ratio = 1\n",
        "model.smoothing is for symmetric layers only",
    ),
    "e": (
        MODEL + '[impact]\ntype = "VelocityReduction"\ne = 1.2\n',
        "impact.e must lie in [0, 1], got 1.2",
    ),
    "impact_type": (
        MODEL + '[impact]\ntype = "Hertz"\n',
        "EnergyRestitution, InelasticImpact, NewtonImpact, PoissonImpact, VelocityReduction",
    ),
    "channel": (
        MODEL + "[load]\nvertcal = 1\n",
        "Metainterface does not read load.vertcal; did you mean 'vertical'",
    ),
    "channel_dunder": (MODEL + "[load]\n__class__ = 1\n", 'load has no channel "__class__"'),
    "channel_dotted": (
        MODEL + "[load]\nvertical.amplitud = 1\n",
        "unknown key load.vertical.amplitud; did you mean 'amplitude'?",
    ),
    "no_frequency": (
        MODEL + "[load]\nvertical = { amplitude = 1 }\n",
        "so load.frequency must be given",
    ),
    "frequency": (MODEL + "[load]\nfrequency = 0\n", "load.frequency must lie in (0, inf), got 0"),
    "frequency_text": (MODEL + '[load]\nfrequency = "1"\n', "write it without quotes: 1"),
    "order": (
        MODEL + "[load]\nfrequency = 1\nvertical = { amplitude = 1, order = 1.5 }\n",
        "load.vertical.order must be a whole number",
    ),
    "in_a_list": (
        MODEL + "[load]\nfrequency = 1\nvertical = [\n  0.1,\n  { amplitude = nan },\n]\n",
        "load.vertical.1.amplitude must be a finite",
    ),
    "empty_list": (MODEL + "[load]\nvertical = []\n", "load.vertical is an empty list"),
    "both": (
        simulate("periods = 1", "duration = 2") + "[load]\nfrequency = 1\n",
        "both periods and duration",
    ),
    "neither": (simulate("theta = 1"), "simulate needs periods (of the load) or duration"),
    "periods_constant": (simulate("periods = 3"), "simulate.periods needs load.frequency"),
    "periods_negative": (
        simulate("periods = -3"),
        "simulate.periods must lie in (0, 1e+12], got -3",
    ),
    "duration_nan": (
        simulate("duration = nan"),
        "simulate.duration must be a finite number, got nan",
    ),
    "coordinate": (simulate("x = 3", "duration = 1"), "unknown key simulate.x"),
    "tol": (
        simulate("duration = 1", "tol = 0.1"),
        "simulate.tol must lie in [1e-15, 1e-06], got 0.1",
    ),
    "side": (simulate("duration = 1", "side = 2"), "simulate.side must be 1 (theta > 0) or -1"),
    "samples": (simulate("duration = 1", "samples = 1"), "simulate.samples must lie in [2, "),
    "samples_half": (
        simulate("duration = 1", "samples = 2.5"),
        "simulate.samples must be a whole number, got 2.5",
    ),
    "margin": (simulate("duration = 1", 'stop_at = "line_limits"'), "did you mean 'line_limit'"),
    "control": (
        '[model]\n"a\\r\\nb\\u2028" = 1\ntype = "Metainterface"\n',
        r"unknown key model.a\r\nb\u2028; known here",
    ),
    "syntax": ("[model\n", "line 1, column 7 is not valid TOML"),
    "value": ("a = \n", "line 1, column 5 is not valid TOML: invalid value"),
    "twice": ("a = 1\na = 2\n", "line 2, column 6 is not valid TOML"),
    "binary": (b"\xff\xfe\x00", "is not a text file"),
    "deep": ("a = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
    "digits": ("a = " + "9" * 5000, "is not valid TOML"),
    "json": ('{"model": 1}', "line 1, column 1 is not valid TOML"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_bad_study_is_refused_in_one_sentence(tmp_path, name):
    text, problem = CASES[name]
    message = refusal(tmp_path, text)
    assert message.startswith(": ")
    assert problem in message


def test_what_is_no_study_is_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "large.toml").write_bytes(b"#" * 10_000_001)
    for path, problem in (
        ("/dev/zero", "is no file"),
        (tmp_path / "pipe.toml", "is no file"),
        (tmp_path / "large.toml", "10000001 bytes"),
    ):
        with pytest.raises(ParameterError, match=problem):
            load_study(path)


RECORDS = {
    "unsorted": ("0,0\n1,1\n0.5,1\n", "line 3 has 0.5 after 1; sort the file"),
    "repeated": ("t,a\n0,0\n1,1\n1,1\n", "line 4 has 1 after 1; sort the file"),
    "too_few": ("t,a\n0,0\n", "needs at least 2 samples, got 1"),
    "empty": ("", "needs at least 2 samples, got 0"),
    "nan": ("0,0\n1,nan\n", 'line 2 must be two finite numbers, got the text "1,nan"'),
    "words": ("time,a\nunit,m\n0,0\n", "line 2 must be two finite numbers"),
    "decimal_commas": ("0,0,0,1\n0,5,1,2\n", "line 2 must be two finite numbers"),
    "one_column": ("0\n1\n2\n", "line 2 must be two finite numbers"),
    "grouped": ("0,0\n1_0,1\n", 'line 2 must be two finite numbers, got the text "1_0,1"'),
    "other_digits": ("0,0\n\u0661,1\n", "line 2 must be two finite numbers"),
    "long_cell": ("0,0\n1," + "1" * 200_000 + "\n", "line 2 must be two finite numbers"),
    "long_words": ("0,0\n1," + "x" * 200_000 + "\n", "line 2 must be two finite numbers"),
}


@pytest.mark.parametrize("name", RECORDS)
def test_a_bad_record_is_refused_with_its_line(tmp_path, name):
    content, problem = RECORDS[name]
    (tmp_path / "q.csv").write_text(content)
    message = refusal(tmp_path, QUAKE)
    assert message.startswith(": load.ground_horizontal")
    assert "q.csv" in message
    assert problem in message
    assert len(message) < 400


def test_records_that_cannot_be_read(tmp_path):
    assert "load.ground_horizontal.file 'q.csv' does not exist" in refusal(tmp_path, QUAKE)
    (tmp_path / "q.csv").mkdir()
    assert "is no file" in refusal(tmp_path, QUAKE)
    (tmp_path / "q.csv").rmdir()
    (tmp_path / "q.csv").write_bytes(b"\xff\x00\xfe")
    assert "is not a text file" in refusal(tmp_path, QUAKE)
    assert "is no file" in refusal(tmp_path, QUAKE.replace("q.csv", "/dev/zero"))
    os.mkfifo(tmp_path / "pipe")
    assert "is no file" in refusal(tmp_path, QUAKE.replace("q.csv", "pipe"))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (
            'quantity = "acceleration"',
            (
                "load.ground_horizontal takes a record of displacement, velocity or acceleration, "
                "got quantity='force'"
            ),
        ),
        (
            'quantity = "accelleration"',
            "load.ground_horizontal.quantity must be one of force, displacement",
        ),
        ("quantity = 3", "load.ground_horizontal.quantity must be text in quotes"),
        ('quantity = "acceleration", time = [1]', "has both file and time; keep one of them"),
        ('quantity = "acceleration", scal = 1', "did you mean 'scale'"),
    ],
)
def test_a_records_other_keys_are_checked(tmp_path, change, problem):
    (tmp_path / "q.csv").write_text("0,0\n1,1\n")
    text = QUAKE.replace(', quantity = "acceleration"', "" if "takes" in problem else f", {change}")
    assert problem in refusal(tmp_path, text)


def test_files_that_are_no_study(tmp_path):
    for path, problem in (
        (tmp_path / "none.toml", "there is no such file"),
        (tmp_path, "is a folder"),
        (tmp_path / "a\0b", "cannot be read"),
    ):
        with pytest.raises(ParameterError, match=problem):
            load_study(path)


OWN = {
    "no_file": (
        "other.py:A",
        "",
        "there is no file other.py; paths are relative to the study file",
    ),
    "no_class": (
        "own.py:Dufing",
        "class Model: pass\n",
        'own.py has no class "Dufing"; known here: none',
    ),
    "near": (
        "own.py:Dufing",
        "import saltus.systems as s\nclass Duffing(s.Model): pass\n",
        "did you mean 'Duffing'?",
    ),
    "syntax": (
        "own.py:A",
        "x = 1\ndef (:\n",
        "own.py cannot be imported (its line 2): SyntaxError",
    ),
    "raises": (
        "own.py:A",
        "\n\nraise KeyError('a\\nb')\n",
        "own.py cannot be imported (its line 3): KeyError",
    ),
    "exits": (
        "own.py:A",
        "import sys\nsys.exit(5)\n",
        "own.py cannot be imported (its line 2): SystemExit: 5",
    ),
    "stops": (
        "own.py:A",
        "raise GeneratorExit\n",
        "own.py cannot be imported (its line 1): GeneratorExit",
    ),
    "no_model": (
        "own.py:A",
        "class A: pass\n",
        "A in own.py must be a dataclass that inherits saltus.systems.Model",
    ),
    "module": (
        "no_such_module_of_ours:A",
        "",
        "module 'no_such_module_of_ours' cannot be imported: ModuleNotFoundError",
    ),
    "taken": (
        "own.py:Metainterface",
        (
            "import dataclasses, saltus.systems as s\n@dataclasses.dataclass\nclass "
            "Metainterface(s.Model): pass\n"
        ),
        "which saltus has already; give it another name",
    ),
}


@pytest.mark.parametrize("name", OWN)
def test_a_bad_model_of_ones_own_is_refused(tmp_path, name):
    kind, content, problem = OWN[name]
    (tmp_path / "own.py").write_text(content)
    message = refusal(tmp_path, f'[model]\ntype = "{kind}"\n')
    assert message.startswith(": model.type: ")
    assert problem in message
