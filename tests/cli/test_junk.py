"""Whatever a study file holds, it is a study or is refused in one sentence: never a traceback."""

import math
import tempfile
from pathlib import Path

import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from saltus.config import load_study
from saltus.errors import ParameterError

NAMES = (
    "type beta0 damping stiffness_ratio smoothing alpha wall frequency horizontal vertical"
    " amplitude order phase mean file time value quantity scale e r theta x velocity periods"
    " duration tol side stop_at samples Metainterface RockingBlock WallOscillator TwoLayer"
    " VelocityReduction EnergyRestitution InelasticImpact force acceleration line_limit __class__"
    " self saltus:x os:path a.py:B"
)
WORDS = st.sampled_from(NAMES.split(" "))
NUMBERS = st.sampled_from(
    [0, 1, -1, 0.5, 1e-8, 20, 1e308, -0.0, math.nan, math.inf, 10**30, True, 2**63 - 1]
)
VALUES = st.one_of(
    WORDS,
    NUMBERS,
    st.text(max_size=5),
    st.floats(),
    st.dates(),
    st.sampled_from(["80 deg", "1.4 rad", "9 degree s"]),
)
KEYS = WORDS | st.text(max_size=3)
TREES = st.recursive(
    VALUES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=6,
)
PARTS = st.dictionaries(KEYS, TREES, max_size=5)
MODELS = PARTS | st.builds(lambda more: {"type": "Metainterface", "beta0": 1.4, **more}, PARTS)
STUDIES = st.fixed_dictionaries(
    {},
    optional={
        "model": MODELS,
        "load": PARTS | TREES,
        "impact": PARTS | TREES,
        "simulate": PARTS | TREES,
        "x": TREES,
    },
)


def attempt(content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_bytes(content)
        try:
            return load_study(path)
        except ParameterError as error:
            message = str(error)
        sentence = message.startswith(str(path)) and len(message.splitlines()) == 1
        assert sentence, message
        return None


@settings(deadline=None, max_examples=100)
@given(
    st.binary(max_size=60)
    | st.text(max_size=60).map(lambda text: text.encode("utf-8", "surrogatepass"))
)
def test_junk_bytes(content):
    assert attempt(content) is None


@settings(deadline=None, max_examples=80)
@given(STUDIES)
def test_junk_tables(tables):
    attempt(tomli_w.dumps(tables).encode())


@settings(deadline=None, max_examples=60)
@given(STUDIES, st.data())
def test_damaged_studies(tables, data):
    good = tomli_w.dumps({"model": {"type": "Metainterface", "beta0": 1.4}, **tables}).encode()
    at = data.draw(st.integers(0, len(good)))
    attempt(
        good[:at] + data.draw(st.binary(max_size=2)) + good[at + data.draw(st.integers(0, 3)) :]
    )


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(STUDIES)
def test_the_command_line_answers_junk_without_a_traceback(saltus, tables):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_bytes(tomli_w.dumps(tables).encode())
        result = saltus("info", path)
    assert result.exit_code in (0, 2)
    assert result.exit_code == 0 or len(result.stderr.splitlines()) == 1
