"""A system: written and read back, its dotted paths, changed copies, and what is refused."""

import math
import pickle
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus import InelasticImpact, OneContactModel, TwoLayer
from saltus.errors import ParameterError
from saltus.systems import (
    IMPACTS,
    MODELS,
    EnergyRestitution,
    Harmonic,
    Load,
    MarginKind,
    Metainterface,
    Record,
    RockingBlock,
    System,
    VelocityReduction,
    WallOscillator,
    distinct_rows,
    register,
)
from saltus.systems.loads.signals import scaled

finite = st.floats(-1e6, 1e6)
positive = st.floats(1e-6, 1e6)
at_least_0 = st.floats(0, 1e6)
angle = st.floats(1e-3, 3.14)
ratios = {
    "damping": at_least_0,
    "stiffness_ratio": positive,
    "mass_ratio": at_least_0,
    "dissipation_ratio": at_least_0,
}
models = st.one_of(
    st.builds(Metainterface, beta0=angle, **ratios),
    st.builds(Metainterface, beta0=angle, damping=at_least_0, smoothing=positive),
    st.builds(TwoLayer, beta0=angle, **ratios),
    st.builds(RockingBlock, alpha=st.floats(1e-3, 1.57)),
    st.builds(WallOscillator, stiffness=at_least_0, damping=at_least_0, wall=finite),
)
impacts = st.one_of(
    st.builds(VelocityReduction, st.floats(0, 1)),
    st.builds(EnergyRestitution, st.floats(0.01, 1.0)),
    st.just(InelasticImpact()),
)
harmonics = st.builds(Harmonic, finite, finite, finite, st.integers(1, 9))


@st.composite
def records(draw, quantities):
    steps = draw(st.lists(st.floats(0.01, 10), min_size=4, max_size=8))
    values = draw(st.lists(finite, min_size=len(steps), max_size=len(steps)))
    quantity = draw(st.sampled_from(quantities))
    curves = {"velocity": ("spline", "linear", "monotone"), "displacement": ("spline", "monotone")}
    return Record(
        np.cumsum(steps),
        values,
        quantity,
        draw(finite),
        draw(st.sampled_from(["", "q.csv"])),
        draw(st.sampled_from(curves.get(quantity, ("",)))),
    )


@st.composite
def systems(draw):
    model = draw(models)
    channels = {}
    smoothed = getattr(model, "smoothing", None) is not None
    names = [name for name in model.channels if not (smoothed and name.startswith("lower_"))]
    for name in draw(st.lists(st.sampled_from(names), unique=True)):
        ground = name.startswith("ground")
        record = records(["displacement", "velocity", "acceleration"] if ground else ["force"])
        single = st.one_of(finite, harmonics, record)
        channels[name] = draw(st.one_of(single, st.builds(lambda a, b: a + b, harmonics, single)))
    impact = draw(impacts) if model.sides else VelocityReduction()
    impact = (
        VelocityReduction()
        if impact == InelasticImpact() and isinstance(model, WallOscillator)
        else impact
    )
    return System(model=model, load=Load(frequency=draw(positive), **channels), impact=impact)


EXAMPLE = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=Harmonic(amplitude=0.5) + 0.2, vertical=-0.5),
    impact=VelocityReduction(0.9),
)


@settings(deadline=None, max_examples=60)
@given(systems())
def test_every_system_survives_json_toml_and_pickling(system):
    assert System.from_json(system.to_json()) == system
    assert System.from_toml(system.to_toml()) == system
    assert pickle.loads(pickle.dumps(system)) == system
    again = System.from_json(system.to_json())
    assert hash(again) == hash(system)
    assert again.to_json() == system.to_json()


@settings(deadline=None, max_examples=60)
@given(systems(), st.integers(0, 999))
def test_every_number_has_a_path_that_reads_and_replaces_it(system, pick):
    paths = system.parameters
    path = sorted(paths)[pick % len(paths)]
    assert system.get(path) == paths[path]
    assert system.with_({path: system.get(path)}) == system
    smoothed = getattr(system.model, "smoothing", None) is not None  # its ratios may not change
    bound = (
        "order",
        "smoothing",
        *(("_ratio",) if smoothed else ()),
        *(() if system.model.sides else ("impact.e",)),
    )
    if not path.endswith(bound):
        changed = system.with_({path: 0.25})
        assert changed.get(path) == 0.25
        others = {p: v for p, v in changed.parameters.items() if p != path}
        assert others == {p: v for p, v in paths.items() if p != path}


def test_changes_apply_at_once_in_any_order():
    block = RockingBlock(alpha=0.2)
    smooth = System(model=Metainterface(beta0=1.4, smoothing=100.0))
    for system, changes in (
        (System(model=block), {"load.ground_horizontal": Harmonic(0.3), "load.frequency": 1.0}),
        (EXAMPLE, {"model": block, "load": Load()}),
        (smooth, {"model.mass_ratio": 1.0, "model.smoothing": None}),
        (EXAMPLE, {"load.horizontal": Harmonic(0.1), "load.horizontal.amplitude": 0.7}),
    ):
        first, second = (
            system.with_(dict(order)) for order in (changes.items(), reversed(changes.items()))
        )
        assert first == second
        assert all(
            first.get(path) == value for path, value in changes.items() if path != "load.horizontal"
        )


@pytest.mark.parametrize(
    "text",
    ["garbage", "[1]", "3", '{"model": 3}', '{"model": {"type": 3}}', '{"model": {"type": []}}'],
)
def test_what_is_no_system_in_json_is_refused_in_a_sentence(text):
    with pytest.raises(ParameterError):
        System.from_json(text)
    with pytest.raises(ParameterError, match="not the TOML of a system"):
        System.from_toml("= =")


def test_a_key_that_is_given_twice_is_refused():
    """As in TOML: of two values neither is meant more than the other."""
    text = EXAMPLE.to_json().replace('"beta0"', '"beta0": 1.0, "beta0"', 1)
    with pytest.raises(
        ParameterError, match="not the JSON of a system: the key 'beta0' is given twice"
    ):
        System.from_json(text)


def test_numbers_beyond_what_can_be_squared_are_refused():
    for path in ("model.damping", "load.horizontal.0.amplitude"):
        with pytest.raises(
            ParameterError, match=rf"^{path} must be at most 1e\+100 in size, got 1e\+200"
        ) as refusal:
            EXAMPLE.with_({path: 1e200})
        assert refusal.value.parameter == path


def test_an_impact_law_without_impacts_is_refused():
    with pytest.raises(ParameterError, match="has no impacts"):
        System(model=Metainterface(beta0=1.4, smoothing=50.0), impact=VelocityReduction(0.5))
    with pytest.raises(
        ParameterError,
        match="EnergyRestitution does not apply to the contacts of a TwoLayer; give NewtonImpact",
    ):
        System(model=TwoLayer(beta0=1.4), impact=EnergyRestitution(0.5))


def test_a_load_answers_only_to_names_of_channels():
    """IPython and pickle probe for names that begin with an underscore; they are not channels."""
    assert EXAMPLE.load.force(0.0) == 0.0
    with pytest.raises(AttributeError):
        _ = EXAMPLE.load._repr_pretty_


def test_paths_of_an_example_are_listed():
    assert set(EXAMPLE.parameters) >= {
        "model.beta0",
        "model.damping",
        "load.frequency",
        "load.horizontal.0.amplitude",
        "load.horizontal.1",
        "load.vertical",
        "impact.e",
    }
    assert EXAMPLE.get("load.vertical") == -0.5
    assert EXAMPLE.with_({"load.vertical": Harmonic(0.1)}).get("load.vertical.amplitude") == 0.1
    assert EXAMPLE.with_(impact=EnergyRestitution(0.5)).get("impact.r") == 0.5
    assert EXAMPLE.get("impact.e") == 0.9  # the original is as it was
    assert EXAMPLE.with_({"load.lower_vertical": 0.3}).get("load.lower_vertical") == 0.3


@pytest.mark.parametrize(
    ("path", "hint"),
    [
        ("model.beta", "'beta0'"),
        ("model.dampng", "'damping'"),
        ("lod.frequency", "'load.frequency'"),
        ("load.horizontal.0.amplitud", "'amplitude'"),
        ("impact.r", "known here: e"),
        ("model.beta0.x", "has no 'x'"),
        ("load.vertical.amplitude", "has no 'amplitude'"),
        ("", "no parameter ''"),
    ],
)
def test_a_wrong_path_is_answered_with_the_near_ones(path, hint):
    with pytest.raises(ParameterError, match=re.escape(hint)):
        EXAMPLE.with_({path: 1.0})
    with pytest.raises(ParameterError, match="no parameter"):
        EXAMPLE.get(path)


def test_get_names_near_whole_paths():
    with pytest.raises(
        ParameterError, match=r"no parameter 'load.frequncy'; did you mean 'load.frequency'"
    ):
        EXAMPLE.get("load.frequncy")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: EXAMPLE.with_({"model.damping": -1.0}),
            r"damping must lie in \[0, inf\), got -1.0",
        ),
        (
            lambda: EXAMPLE.with_({"load.horzontal": 1.0}),
            "does not read load.horzontal; did you mean 'horizontal'",
        ),
        (lambda: EXAMPLE.with_({"load.frequency": None}), "load.frequency must be given"),
        (
            lambda: System(model=RockingBlock(alpha=0.3), load=Load(vertical=1.0)),
            "RockingBlock does not read load.vertical",
        ),
        (
            lambda: System(model=WallOscillator(), load=Load(horizontal=1.0)),
            "known here: force, frequency",
        ),
        (lambda: System(model=Metainterface), "^model must be a Model"),
        (lambda: System(model=EXAMPLE.model, load={"vertical": 1}), "^load must be a Load"),
        (lambda: System(model=EXAMPLE.model, impact=0.9), "^impact must be an ImpactLaw"),
        (lambda: System.from_dict({"load": {}}), "a system needs a model"),
        (lambda: System.from_dict({"model": {"beta0": 1.0}}), "model.type is missing"),
        (
            lambda: System.from_dict({"model": {"type": "Metainterfce"}}),
            "did you mean 'Metainterface'",
        ),
        (lambda: System.from_dict({"model": {"type": "Metainterface"}}), "model.beta0 is missing"),
        (
            lambda: System.from_dict({"model": {"type": "TwoLayer", "beta0": 1.0, "dampng": 1}}),
            "did you mean 'damping'",
        ),
        (lambda: System.from_dict({"modl": {}}), "did you mean 'model'"),
        (lambda: System.from_dict({"model": 3}), "model must be a table"),
        (
            lambda: System.from_dict({**EXAMPLE.to_dict(), "impact": {"type": "Bounce"}}),
            "impact.type 'Bounce' is not known",
        ),
        (
            lambda: System.from_dict({**EXAMPLE.to_dict(), "load": {"vertical": {"amplitud": 1}}}),
            "'amplitude'",
        ),
    ],
)
def test_impossible_systems_are_refused_in_a_sentence(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@pytest.mark.parametrize("cls", [Metainterface, TwoLayer])
@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"beta0": 80.0}, r"beta0 must lie in \(0, pi\) rad, got 80.0 \(degrees\?\)"),
        ({"beta0": 0.0}, r"beta0 must lie in \(0, pi\) rad, got 0.0$"),
        ({"beta0": math.pi}, r"beta0 must lie in \(0, pi\) rad"),
        ({"beta0": math.nan}, "got nan"),
        ({"beta0": math.inf}, "got inf"),
        ({"beta0": "1.4"}, "beta0 must be a number"),
        ({"beta0": True}, "beta0 must be a number"),
        ({"beta0": 1.4, "damping": -0.1}, r"damping must lie in \[0, inf\), got -0.1"),
        ({"beta0": 1.4, "damping": math.nan}, "damping"),
        (
            {"beta0": 1.4, "stiffness_ratio": 0.0},
            r"stiffness_ratio must lie in \(0, inf\), got 0.0",
        ),
        ({"beta0": 1.4, "mass_ratio": -1.0}, "mass_ratio"),
        ({"beta0": 1.4, "dissipation_ratio": -1.0}, "dissipation_ratio"),
    ],
)
def test_impossible_parameters_are_refused_in_a_sentence(cls, fields, message):
    with pytest.raises(ParameterError, match=message):
        cls(**fields)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RockingBlock(alpha=math.pi / 2), r"alpha must lie in \(0, pi/2\) rad"),
        (lambda: RockingBlock(alpha=20.0), r"got 20.0 \(degrees\?\)"),
        (lambda: WallOscillator(stiffness=-1.0), "stiffness"),
        (lambda: WallOscillator(damping=-1.0), "damping"),
        (lambda: WallOscillator(wall=math.inf), "wall must be finite, got inf"),
        (lambda: Metainterface(beta0=1.4, smoothing=0.0), r"smoothing must lie in \(0, inf\)"),
    ],
)
def test_impossible_parameters_of_the_other_models_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


def test_numpy_numbers_are_stored_as_plain_ones():
    model = Metainterface(beta0=np.deg2rad(80), damping=np.float32(0.5), mass_ratio=1)
    assert type(model.beta0) is type(model.damping) is type(model.mass_ratio) is float
    assert "np." not in repr(model)


def test_mirrored_systems_keep_everything_but_the_horizontal_load():
    mirrored = EXAMPLE.mirrored()
    assert mirrored.mirrored() == EXAMPLE
    assert mirrored.get("load.horizontal.0.amplitude") == -0.5
    assert mirrored.get("load.vertical") == -0.5
    assert (
        System(model=Metainterface(beta0=1.4, mass_ratio=0.5), load=EXAMPLE.load).mirrored() is None
    )


def test_models_and_laws_of_ones_own_are_registered_by_name():
    class Pendulum(OneContactModel):
        pass

    class Sticky(VelocityReduction):
        pass

    try:
        assert register(Pendulum) is Pendulum
        assert register(Sticky) is Sticky
        assert MODELS["Pendulum"] is Pendulum
        assert IMPACTS["Sticky"] is Sticky
        with pytest.raises(ParameterError, match="register takes a Model or an ImpactLaw"):
            register(dict)
    finally:
        MODELS.pop("Pendulum", None)
        IMPACTS.pop("Sticky", None)


def test_a_bare_model_says_what_it_lacks():
    class Bare(OneContactModel):
        pass

    with pytest.raises(NotImplementedError, match="Bare must define acceleration"):
        Bare().acceleration(0.0, 0.0, 0.0, 1, Load())
    with pytest.raises(ParameterError, match="Bare defines no kinetic_energy"):
        EnergyRestitution(0.5).velocity_after(Bare(), 0.0, 1.0, 1, -1, Load())


@pytest.mark.parametrize(
    "model",
    [Metainterface(beta0=1.4), TwoLayer(beta0=1.4), RockingBlock(alpha=0.2), WallOscillator()],
)
def test_a_model_says_what_it_means_to_pass_each_of_its_margins(model):
    still = 0.0 if len(model.coordinates) == 1 else (0.0, 0.0)
    margins = model.margins(0.0, still, still, still, (*model.sides, 1)[0], Load())
    assert set(model.margin_kinds) == set(margins)
    assert model.margin_kind("one that a user wrote") is MarginKind.ASSUMPTION
    assert set(model.stops) <= {
        name for name in margins if model.margin_kind(name) is MarginKind.LIMIT
    }


class Lopsided(Metainterface):
    """A model that states a mirror symmetry whatever its layers are."""

    def mirror(self, load):
        reversed_ = {
            n: scaled(s, -1.0) if n.endswith("horizontal") else s for n, s in load.channels.items()
        }
        return Load(frequency=load.frequency, **reversed_)


@pytest.mark.parametrize(
    "numbers",
    [{"stiffness_ratio": 2.0}, {"mass_ratio": 0.1}, {"damping": 0.1, "dissipation_ratio": 3.0}],
)
def test_a_mirror_that_is_no_symmetry_is_refused(numbers):
    load = Load(frequency=1.0, horizontal=Harmonic(0.3), vertical=-0.5)
    assert System(model=Lopsided(beta0=1.4), load=load).mirrored() is not None
    with pytest.raises(ParameterError, match="mirror is not a symmetry"):
        System(model=Lopsided(beta0=1.4, **numbers), load=load).mirrored()


@pytest.mark.parametrize("size", [0, 1, 300])
@pytest.mark.parametrize("count", [1, 3])
def test_different_rows_are_those_of_numpy(count, size):
    columns = list(np.random.default_rng(1).integers(-2, 3, (count, size)) * 0.1)
    rows, place = distinct_rows(columns)
    expected, there = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_array_equal(place, there.reshape(-1))
