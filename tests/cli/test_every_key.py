"""Every key of a study with every kind of bad value: one sentence before anything is computed, or
it has a meaning.
"""

import math

import pytest
import tomli_w

from saltus.config.study import QUESTIONS, keys_of

SYSTEM = {
    "model": {"type": "Metainterface", "beta0": 1.4, "damping": 0.1},
    "load": {"frequency": 1.0, "horizontal": {"amplitude": 0.5}, "vertical": -0.5},
}
ASKS = {
    "phase_portrait": {},
    "response_spectrum": {"bounds": [0.5, 1.0]},
    "bifurcation_diagram": {"path": "load.frequency", "bounds": [0.5, 1.0]},
    "attractors": {},
    "basins": {},
    "stability_chart": {"horizontal": [0.1, 0.2], "vertical": [-0.5, -0.4]},
}
BAD = (
    *(1e22, 1e308, -1e308, 9223372036854775807, -1, 0, 0.5, 1e-320, math.nan, math.inf, True),
    *(
        "",
        "x" * 5000,
        "[bold]",
        "1e3",
        [],
        [1e22],
        [math.nan, 1],
        ["a", "b"],
        [[1]],
        {},
        {"from": 0, "to": 1, "count": 10**9},
    ),
    *(
        {"from": 1e308, "to": -1e308, "count": 3},
        {"self": 1},
        [1, 2, 3],
        [[-1e308, 1e308], [-1e308, 1e308]],
    ),
)
PLACES = [
    *(
        ("model", key)
        for key in ("type", "beta0", "damping", "stiffness_ratio", "nothing", "x" * 5000)
    ),
    *(
        ("load", key)
        for key in ("frequency", "horizontal", "vertical", "self", "frequency.x", "x" * 5000)
    ),
    *(
        ("load.horizontal", key)
        for key in ("amplitude", "mean", "phase", "order", "file", "time", "value", "self")
    ),
    *(("impact", key) for key in ("type", "e", "r", "self")),
    *(
        ("simulate", key)
        for key in (
            "theta",
            "velocity",
            "periods",
            "duration",
            "tol",
            "time",
            "side",
            "stop_at",
            "samples",
        )
    ),
    *((kind, key) for kind in QUESTIONS for key in sorted(keys_of(kind, ("theta",)))),
]
MUST_BE_REFUSED = [
    ("response_spectrum", "seed", 1e22),
    ("bifurcation_diagram", "starts", 1e308),
    ("attractors", "starts", 1e308),
    ("attractors", "starts", 9223372036854775807),
    ("attractors", "seed", 1e22),
    ("stability_chart", "periods", 1e22),
    ("stability_chart", "starts", 1_000_000_000),
    ("phase_portrait", "samples", 1e15),
    ("basins", "periods", 1e15),
    ("load", "self", 1),
    ("load.horizontal", "order", 1e9),
    ("simulate", "periods", 1e22),
]


class Computed(Exception):
    """The checks are over."""


@pytest.fixture
def asked(saltus, tmp_path, monkeypatch):
    """Ask with one key changed: the sentence with which it is refused, or None where it would be
    computed.
    """
    import saltus.cli.run_command as command
    from saltus.flow.lanes import ensemble
    from saltus.flow.motion import simulate as simulation

    def begun(*_, **__):
        raise Computed

    def computed(*_, **__):
        pytest.fail("something was computed while the study was checked")

    monkeypatch.setattr(command, "computed", begun)
    monkeypatch.setattr("saltus.cli.run_command.simulate_study", begun)
    monkeypatch.setattr(simulation, "follow", computed)
    monkeypatch.setattr(ensemble, "compile_driver_aside", computed)

    def ask(part, key, value):
        kind = part if part in ASKS else "simulate"
        study = {name: dict(table) for name, table in SYSTEM.items()} | {
            kind: dict(ASKS.get(kind, {"theta": 0.3, "periods": 3}))
        }
        if part == "load.horizontal":
            study["load"]["horizontal"] = {"amplitude": 0.5, key: value}
        else:
            study.setdefault(part, {"type": "VelocityReduction"} if part == "impact" else {})[
                key
            ] = value
        (tmp_path / "study.toml").write_text(tomli_w.dumps(study))
        try:
            result = saltus("run", tmp_path / "study.toml", "-o", tmp_path / "out")
        except Computed:
            return None
        assert result.exit_code == 2
        *_, sentence = result.stderr.splitlines()
        assert sentence.startswith("saltus: ")
        assert len(sentence) < 400
        assert not (tmp_path / "out").exists()
        return sentence

    return ask


@pytest.mark.parametrize(("part", "key"), PLACES, ids=lambda text: f"{text:.20}")
def test_a_bad_value_is_refused_in_one_sentence_before_anything_is_computed(asked, part, key):
    refused = [asked(part, key, value) for value in BAD]
    assert sum(sentence is not None for sentence in refused) > len(BAD) // 4


@pytest.mark.parametrize(("part", "key", "value"), MUST_BE_REFUSED)
def test_what_no_machine_can_do_is_refused(asked, part, key, value):
    sentence = asked(part, key, value)
    assert sentence is not None
    assert key in sentence
