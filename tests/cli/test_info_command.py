"""`saltus info`: the closed forms, for any system that a study can name."""

import math
import re

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

SYSTEM = '[model]\ntype = "Metainterface"\nbeta0 = "80 deg"\n'


@pytest.fixture
def info(saltus, tmp_path):
    def run(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        result = saltus("info", path)
        assert result.exit_code == 0, result.stderr
        return result.stdout

    return run


def value(text, head):
    return float(re.search(rf"{re.escape(head)} +(-?[\d.e+-]+)", text)[1])


def test_a_metainterface_under_load(info):
    text = info(
        SYSTEM
        + "damping = 0.1\n[load]\nfrequency = 2\nhorizontal = { amplitude = 0.5 }\nvertical = "
        "-0.5\n"
    )
    assert value(text, "forcing period 2 pi / Omega") == pytest.approx(math.pi, rel=1e-7)
    assert value(text, "Hcr = |V / tan(beta0)|, the undeformed state is lost") == pytest.approx(
        0.5 / math.tan(math.radians(80)), rel=1e-7
    )
    stiffness = 1 - 0.5 * math.sin(math.radians(80))
    assert value(text, "apparent frequency, lower layer") == pytest.approx(
        math.sqrt(stiffness), rel=1e-7
    )
    assert "damping ratio 0.0701795" in text  # 0.1 / (2 sqrt(stiffness)) = 0.07017960
    assert value(text, "straight line, pi - beta0") == pytest.approx(math.radians(100), rel=1e-7)
    assert value(text, "kinematic limit, 2 (pi - beta0)") == pytest.approx(
        math.radians(200), rel=1e-7
    )
    assert "symmetric: the mirror image of a motion, half a period later, is a motion" in text
    assert len(re.findall(r"^ *-?[\d.]+ +-?[\d.]+ +(?:un)?stable", text, re.MULTILINE)) == 1


def test_a_buckled_metainterface_has_five_equilibria(info):
    """Errata 9 gives the outer one, and errata 23 the fold and the V below which they exist."""
    text = info(SYSTEM + f"[load]\nvertical = {-1.5 / math.sin(math.radians(80))}\n")
    rows = re.findall(r"^ *(-?[\d.]+) +-?[\d.]+ +((?:un)?stable) ", text, re.MULTILINE)
    assert [kind for _, kind in rows] == ["stable", "unstable", "stable", "unstable", "stable"]
    assert float(rows[4][0]) == pytest.approx(1.46272, abs=5e-6)
    assert float(rows[0][0]) == -float(rows[4][0])
    assert value(text, "deformed equilibria exist without any H for V below") == pytest.approx(
        -1.3563, abs=5e-5
    )


def test_the_fold_of_equilibria(info):
    text = info(SYSTEM + "[load]\nvertical = -1.2\n")
    assert value(text, "fold of equilibria, at |H|") == pytest.approx(0.1131, abs=5e-5)  # errata 23
    assert value(text, "Hcr = |V / tan(beta0)|, the undeformed state is lost") == pytest.approx(
        0.2116, abs=5e-5
    )


def test_the_period_is_that_of_the_studys_own_start(info):
    text = info(SYSTEM + '[load]\nvertical = -0.5\n[simulate]\ntheta = "1 deg"\nduration = 1\n')
    small = value(text, "the same, small angles: T0 (t-beta)")
    closing, stiffness = 0.5 * math.cos(math.radians(80)), 1 - 0.5 * math.sin(math.radians(80))
    # t-beta
    expected = 4 / math.sqrt(stiffness) * math.acos(1 / (1 + stiffness * math.radians(1) / closing))
    assert small == pytest.approx(expected, rel=1e-7)
    assert value(text, "undamped free period from theta = 0.0174533 rad") == pytest.approx(
        small, rel=1e-3
    )


@pytest.mark.parametrize(
    ("load", "said"),
    [
        ("vertical = -0.5", "symmetric: the mirror image of a motion is a motion"),
        ("horizontal = 0.5", "the load is not"),
        ("frequency = 1\nhorizontal = { amplitude = 1, order = 3 }", "half a period later"),
        ("frequency = 1\nhorizontal = { amplitude = 1, order = 2 }", "the load is not"),
        ("frequency = 1\nhorizontal = { amplitude = 1, mean = 0.1 }", "the load is not"),
        (
            "frequency = 1\nhorizontal = { amplitude = 1 }\nvertical = { amplitude = 1 }",
            "the load is not",
        ),
        (
            (
                "frequency = 1\nhorizontal = { amplitude = 1 }\nvertical = { amplitude = 1, order"
                " = 2 }"
            ),
            "half a period later",
        ),
        ("lower_horizontal = 0.5", "the model has no mirror image"),
    ],
)
def test_symmetry(info, load, said):
    assert said in info(SYSTEM + f"[load]\n{load}\n")


def test_unequal_layers_have_no_mirror_image(info):
    assert "none: the model has no mirror image" in info(SYSTEM + "stiffness_ratio = 2\n")


def test_the_rocking_block(info):
    text = info(
        '[model]\ntype = "RockingBlock"\nalpha = 0.1\n[simulate]\ntheta = 0.05\nduration = 1\n'
    )
    slender = 4 * math.acosh(1 / (1 - 0.05 / 0.1))  # Housner 1963
    assert value(text, "the same for a slender block") == pytest.approx(slender, rel=1e-7)
    assert value(text, "free rocking period from 0.05 rad (2.86479 deg)") == pytest.approx(
        slender, rel=0.1**2
    )
    assert value(text, "velocity factor of an inelastic impact (Housner)") == pytest.approx(
        1 - 1.5 * math.sin(0.1) ** 2, rel=1e-7
    )


def test_the_wall_oscillator(info):
    text = info(
        '[model]\ntype = "WallOscillator"\nstiffness = 4\ndamping = 1\nwall = 2\n[load]\nforce = '
        "3\n"
    )
    assert value(text, "natural frequency sqrt(k)") == 2
    assert value(text, "damping ratio c / (2 sqrt(k))") == 0.25
    assert value(text, "free period away from the wall") == pytest.approx(
        2 * math.pi / math.sqrt(4 - 0.25), rel=1e-7
    )
    assert "x = 0.75" in text
    assert "on the wall, x = 2" in info(
        '[model]\ntype = "WallOscillator"\nwall = 2\n[load]\nforce = 3\n'
    )


OWN = """
from dataclasses import dataclass
from saltus import OneContactModel

@dataclass(frozen=True, kw_only=True)
class Own(OneContactModel):
    stiffness: float
    channels = ("force",)

    def acceleration(self, t, x, velocity, side, load):
        {body}
"""


def test_a_model_that_cannot_be_traced_is_refused(refused, tmp_path):
    """Of which no motion could be computed: what it raises, where the study is."""
    (tmp_path / "own.py").write_text(OWN.format(body="raise ZeroDivisionError('by naught')"))
    (tmp_path / "study.toml").write_text('[model]\ntype = "own.py:Own"\nstiffness = 3\n')
    sentence = refused("info", tmp_path / "study.toml")
    assert (
        sentence == f"saltus: {tmp_path}/study.toml, model: Own.acceleration (own.py:11) failed: "
        "ZeroDivisionError: by naught"
    )


def test_a_model_of_ones_own_shows_what_every_model_has(info, tmp_path):
    (tmp_path / "own.py").write_text(OWN.format(body="return load.force(t) - self.stiffness * x"))
    text = info(
        '[model]\ntype = "own.py:Own"\nstiffness = 3\n[load]\nfrequency = 1\nforce = { amplitude '
        "= 1 }\n"
    )
    assert value(text, "model.stiffness") == 3
    # x'' = F - k x is odd in F and x, and both sides of its contact are alike
    assert "symmetric: the mirror image" in text


FORCE = st.one_of(
    st.floats(-3, 3),
    st.fixed_dictionaries(
        {"amplitude": st.floats(-2, 2)},
        optional={"mean": st.floats(-2, 2), "order": st.integers(1, 4)},
    ),
)
CHANNELS = (
    "horizontal",
    "vertical",
    "lower_horizontal",
    "lower_vertical",
    "ground_horizontal",
    "ground_vertical",
)
METAINTERFACES = st.fixed_dictionaries(
    {"type": st.just("Metainterface"), "beta0": st.floats(1e-3, 3.14)},
    optional={
        "damping": st.floats(0, 3),
        "stiffness_ratio": st.floats(1e-3, 50),
        "mass_ratio": st.floats(0, 5),
        "dissipation_ratio": st.floats(0, 3),
    },
)
LOADS = st.fixed_dictionaries(
    {"frequency": st.floats(1e-2, 20)}, optional=dict.fromkeys(CHANNELS, FORCE)
)
STARTS = st.fixed_dictionaries({"duration": st.just(1.0)}, optional={"theta": st.floats(-6, 6)})


@settings(
    deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(METAINTERFACES, LOADS, STARTS)
def test_no_metainterface_is_beyond_description(saltus, tmp_path, model, load, simulate):
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps({"model": model, "load": load, "simulate": simulate}))
    result = saltus("info", path)
    assert result.exit_code == 0
    # which a folder's random name may contain
    assert "nan" not in result.stdout.replace(str(path), "")


def test_a_bad_study_is_refused(refused, tmp_path):
    assert "there is no such file" in refused("info", tmp_path / "none.toml")
