"""What simulate_many takes and what it refuses: shapes, named dimensions, no trajectories, columns;
a sentence for a mistake.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import mutually_broadcastable_shapes
from lane_cases import Duffing

import saltus
from saltus.errors import ParameterError, SaltusError
from saltus.flow import share_cores, stop_names
from saltus.flow.lanes.options import read_threads
from saltus.systems import Harmonic, Load, Metainterface, Record, System, WallOscillator

SYSTEM = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=Harmonic(0.3), vertical=-0.5),
)
STEADY = System(
    model=Metainterface(beta0=1.4, damping=0.1),
    load=Load(frequency=1.0, horizontal=0.1, vertical=-0.5),
)
TIMELESS = System(
    model=Metainterface(beta0=1.4, damping=0.1), load=Load(horizontal=0.1, vertical=-0.5)
)
ANGLES = np.linspace(-0.5, 0.5, 5)
FEW = settings(max_examples=60, deadline=None)


def run(system=SYSTEM, **arguments):
    return saltus.simulate_many(system, **({"theta": ANGLES, "periods": 1} | arguments))


def one(theta, velocity=0.0, system=SYSTEM, **arguments):
    return saltus.simulate(
        system,
        theta=float(theta),
        velocity=float(velocity),
        dense=False,
        **({"periods": 1} | arguments),
    )


# --- shapes ------------------------------------------------------------------


@FEW
@given(
    mutually_broadcastable_shapes(num_shapes=4, min_dims=0, max_dims=3, max_side=3),
    st.integers(0, 2**31),
)
def test_arrays_broadcast_as_numpys(shapes, seed):
    rng = np.random.default_rng(seed)
    theta, velocity, amplitude, time = (
        rng.uniform(0.1, 0.5, shape) for shape in shapes.input_shapes
    )
    ensemble = run(
        theta=theta,
        velocity=velocity,
        parameters={"load.horizontal.amplitude": amplitude},
        time=time,
        periods=0.2,
    )
    assert ensemble.theta.shape == shapes.result_shape
    assert ensemble.theta.dims == (
        ("trajectory",) if len(shapes.result_shape) == 1 else ensemble.theta.dims
    )
    whole = np.broadcast_arrays(theta, velocity, amplitude, time)
    assert all(a.shape == shapes.result_shape for a in whole)
    if whole[0].size:
        i = np.unravel_index(seed % whole[0].size, whole[0].shape) if whole[0].shape else ()
        system = SYSTEM.with_({"load.horizontal.amplitude": float(whole[2][i])})
        motion = one(whole[0][i], whole[1][i], system, time=float(whole[3][i]), periods=0.2)
        assert float(ensemble.theta.values[i]) == pytest.approx(motion.theta, abs=1e-10)
        assert float(ensemble.time.values[i]) == pytest.approx(motion.time, abs=1e-12)


def test_numbers_alone_give_a_dataset_without_dimensions():
    ensemble = run(theta=0.3)
    assert ensemble.theta.shape == ()
    assert ensemble.sampled_theta.dims == ("period",)
    assert float(ensemble.theta) == pytest.approx(one(0.3).theta, abs=1e-11)


@pytest.mark.parametrize("shape", [(0,), (0, 3), (2, 0)])
@pytest.mark.parametrize(
    "options",
    [{}, {"until": ("rest", "settled"), "sensitivities": ("load.frequency",), "last": "all"}],
)
def test_no_trajectories_are_an_ensemble_too(shape, options):
    everything = ("state", "extrema", "impact_count", "speed")
    fractions = []
    ensemble = run(
        theta=np.zeros(shape),
        sample=everything,
        progress=lambda done, _: fractions.append(done),
        **options,
    )
    assert ensemble.theta.shape == shape
    assert ensemble.sampled_theta.shape[: len(shape)] == shape
    assert fractions == [0.0, 1.0]


def test_lists_and_whole_numbers_are_arrays():
    floats = run(theta=[0.0, 1.0], velocity=np.array([1.0, 0.0]))
    for theta, velocity in (
        ([0, 1], [1, 0]),
        (np.array([0, 1], dtype=np.int8), np.array([1, 0], dtype=np.float32)),
    ):
        xarray.testing.assert_equal(run(theta=theta, velocity=velocity), floats)


def test_shapes_that_do_not_broadcast_are_named():
    with pytest.raises(ParameterError, match=r"theta \(3,\), velocity \(4,\)"):
        run(theta=np.zeros(3), velocity=np.zeros(4))


# --- named dimensions --------------------------------------------------------


def test_named_dimensions_broadcast_by_name_and_keep_their_coordinates():
    theta = xarray.DataArray(ANGLES, dims="start", coords={"start": [10, 20, 30, 40, 50]})
    amplitude = xarray.DataArray([0.1, 0.2, 0.3], dims="load.horizontal.amplitude")
    ensemble = run(theta=theta, parameters={"load.horizontal.amplitude": amplitude})
    assert dict(ensemble.theta.sizes) == {"start": 5, "load.horizontal.amplitude": 3}
    np.testing.assert_array_equal(ensemble.start, [10, 20, 30, 40, 50])
    np.testing.assert_array_equal(ensemble["load.horizontal.amplitude"], amplitude)
    motion = one(ANGLES[3], system=SYSTEM.with_({"load.horizontal.amplitude": 0.2}))
    chosen = ensemble.sel({"start": 40, "load.horizontal.amplitude": 0.2})
    assert float(chosen.theta) == pytest.approx(motion.theta, abs=1e-11)


def test_named_and_plain_arrays_give_the_same_numbers():
    theta, velocity = xarray.DataArray(ANGLES, dims="a"), xarray.DataArray(ANGLES[:3], dims="b")
    named, plain = (
        run(theta=theta, velocity=velocity),
        run(theta=ANGLES[:, None], velocity=ANGLES[None, :3]),
    )
    np.testing.assert_array_equal(named.transpose("a", "b", ...).theta.values, plain.theta.values)
    swapped = run(theta=theta.expand_dims({"b": 3}), velocity=velocity)
    np.testing.assert_array_equal(swapped.transpose("a", "b", ...).theta.values, plain.theta.values)


@pytest.mark.parametrize(
    "velocity",
    [
        xarray.DataArray(ANGLES[:3], dims="a"),
        xarray.DataArray(ANGLES, dims="a", coords={"a": ANGLES + 1}),
        ANGLES,
    ],
)
def test_dimensions_that_do_not_fit_are_refused(velocity):
    with pytest.raises(ParameterError):
        run(theta=xarray.DataArray(ANGLES, dims="a", coords={"a": ANGLES}), velocity=velocity)


@pytest.mark.parametrize(
    "dimension", ["period", "state", "column", "theta", "velocity", "stop", "time"]
)
def test_a_dimension_named_as_a_result_is_refused(dimension):
    theta = xarray.DataArray(ANGLES, dims=dimension)
    with pytest.raises(ParameterError, match=dimension):
        run(theta=theta, sensitivities=())


ENDLESS = {"periods": 10**12}  # so that what is refused is refused before it runs


@pytest.mark.parametrize(
    "name",
    ["theta", "time", "stop", "start_theta", "overall_largest_theta", "sampled_velocity", "state"],
)
@pytest.mark.parametrize("along", [True, False])
def test_a_coordinate_named_as_a_result_is_refused_before_anything_runs(name, along):
    theta = xarray.DataArray(ANGLES, dims="a").assign_coords(
        {name: ("a", ANGLES) if along else 0.3}
    )
    with pytest.raises(ParameterError, match=f"coordinate cannot be called '{name}'"):
        run(theta=theta, **ENDLESS)


def test_a_result_goes_on_from_where_it_ended():
    theta = xarray.DataArray(ANGLES, dims="initial_theta")
    velocity = xarray.DataArray(ANGLES[:3], dims="initial_velocity")
    first = run(theta=theta, velocity=velocity, time=0.7, periods=1.25, tol=1e-14)
    then = run(theta=first.theta, velocity=first.velocity, time=first.time, periods=2, tol=1e-14)
    whole = run(theta=theta, velocity=velocity, time=0.7, periods=3.25, tol=1e-14)
    np.testing.assert_allclose(then.theta, whole.theta, atol=1e-11)
    np.testing.assert_allclose(then.time, whole.time, rtol=1e-14)
    # the labels that the dimensions came with
    np.testing.assert_array_equal(then.initial_theta, ANGLES)
    for name in ("theta", "velocity", "time"):
        xarray.testing.assert_equal(
            then[f"start_{name}"].drop_attrs(), first[name].drop_attrs().rename(f"start_{name}")
        )
    assert "start_theta" not in first  # its coordinate says it
    again = run(
        theta=then.theta,
        velocity=then.velocity.sel(initial_velocity=ANGLES[0]),
        time=then.time.mean(),
    )
    np.testing.assert_array_equal(again.start_theta, then.theta)
    assert again.start_velocity.dims == ("initial_theta", "initial_velocity")


def test_coordinates_on_which_arguments_do_not_agree_are_left_out():
    theta = xarray.DataArray(ANGLES, dims="a").assign_coords(run=1, place=2)
    ensemble = run(
        theta=theta, velocity=xarray.DataArray(ANGLES, dims="a").assign_coords(run=3, place=2)
    )
    assert set(ensemble.coords) == {"place"}


def test_a_coordinate_does_not_say_other_parameters_than_there_were():
    path = "load.horizontal.amplitude"
    sweep = run(theta=0.3, parameters={path: xarray.DataArray([0.1, 0.2], dims=path)})
    with pytest.raises(ParameterError, match="other values than the system's"):
        run(theta=sweep.theta, **ENDLESS)
    with pytest.raises(ParameterError, match="other values than parameters give"):
        run(theta=sweep.theta, parameters={path: sweep[path].drop_vars(path) + 0.1}, **ENDLESS)
    with pytest.raises(ParameterError, match="other values than parameters give"):
        run(theta=sweep.theta, parameters={path: 0.2}, **ENDLESS)
    np.testing.assert_array_equal(
        run(theta=sweep.theta, parameters={path: sweep[path]})[path], [0.1, 0.2]
    )
    one_of_them = run(SYSTEM.with_({path: 0.2}), theta=sweep.theta.sel({path: 0.2}))
    assert (
        float(
            one_of_them.start_theta
            if "start_theta" in one_of_them
            else one_of_them.attrs["start_theta"]
        )
        == sweep.theta[1]
    )


def test_a_result_can_be_written_and_read(tmp_path):
    theta = xarray.DataArray(ANGLES, dims="start", coords={"start": np.arange(5)})
    ensemble = run(
        theta=theta,
        sample=("state", "extrema", "impact_count", "speed"),
        last="all",
        periods=3,
        sensitivities=(),
    )
    ensemble.to_netcdf(tmp_path / "ensemble.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "ensemble.nc", engine="h5netcdf") as read:
        np.testing.assert_array_equal(read.theta, ensemble.theta)
        assert read.sizes == ensemble.sizes
        assert System.from_json(read.attrs["system"]) == SYSTEM


# --- columns -----------------------------------------------------------------


def test_orders_of_harmonics_may_be_a_column_of_whole_numbers():
    orders = np.array([1.0, 2.0, 3.0])
    ensemble = run(theta=0.3, parameters={"load.horizontal.order": orders})
    for i, order in enumerate(orders):
        motion = one(0.3, system=SYSTEM.with_({"load.horizontal.order": int(order)}))
        assert float(ensemble.theta[i]) == pytest.approx(motion.theta, abs=1e-11)


def test_a_frequency_column_changes_the_forcing_period_even_of_constant_loads():
    frequency = np.array([0.5, 1.0, 3.0])
    ensemble = run(STEADY, theta=0.3, parameters={"load.frequency": frequency}, periods=2.25)
    np.testing.assert_allclose(ensemble.time, 2.25 * 2 * np.pi / frequency, rtol=1e-14)
    for i, value in enumerate(frequency):
        motion = one(0.3, system=STEADY.with_({"load.frequency": value}), periods=2.25)
        assert float(ensemble.theta[i]) == pytest.approx(motion.theta, abs=1e-11)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordered(Duffing):
    """A Duffing oscillator of which no number may be 0.5, and whose damping is less than its cubic
    term.
    """

    def __post_init__(self):
        if 0.5 in (self.damping, self.cubic) or self.damping >= self.cubic:
            raise ParameterError(
                f"damping and cubic must not be 0.5, and damping must be less, got {self!r}"
            )


def test_every_row_of_columns_is_checked_and_as_a_whole():
    system = System(
        model=Ordered(damping=0.1, cubic=1.0), load=Load(frequency=1.0, force=Harmonic(0.1))
    )

    def columns(damping, cubic):
        return {"model.damping": np.asarray(damping), "model.cubic": np.asarray(cubic)}

    taken = saltus.simulate_many(
        system, x=0.1, periods=0.1, parameters=columns([2.0, 0.4, 3.0], [3.0, 0.7, 4.0])
    )
    assert taken.sizes["trajectory"] == 3  # alone, the first damping would not do
    for bad in (
        columns([0.1, 0.5, 0.9], [1.0, 1.0, 1.0]),
        columns([0.1, 0.7, 0.1], [1.0, 0.6, 0.2]),
        columns(0.3, [0.4, 0.2]),
    ):
        with pytest.raises(ParameterError, match="must be less"):
            saltus.simulate_many(system, x=0.1, parameters=bad, **ENDLESS)


def test_every_parameter_may_be_a_column():
    numbers = SYSTEM.parameters
    columns = {path: np.full(3, value) for path, value in numbers.items()}
    np.testing.assert_array_equal(
        run(theta=0.3, parameters=columns).theta, np.full(3, run(theta=0.3).theta)
    )


def test_starts_beyond_the_wall_end_at_once_and_disturb_no_others():
    system = System(model=WallOscillator(wall=0.2), load=Load(frequency=1.0, force=Harmonic(0.1)))
    ensemble = saltus.simulate_many(system, x=np.array([0.1, 0.3, 0.2, -1.0]), periods=1)
    assert stop_names(ensemble).values.tolist()[1] == "outside"
    alone = saltus.simulate_many(system, x=np.array([0.1, 0.2, -1.0]), periods=1)
    np.testing.assert_array_equal(ensemble.x.values[[0, 2, 3]], alone.x)


# --- refusals ----------------------------------------------------------------

BAD = {
    "nan": {"theta": np.array([0.1, np.nan])},
    "infinite": {"velocity": np.inf},
    "text": {"theta": "a"},
    "nothing": {"theta": None},
    "complex": {"theta": np.array([1j])},
    "ragged": {"theta": [[1], [1, 2]]},
    "objects": {"theta": [object()]},
    "two velocities": {"velocity": (0.1, 0.2, 0.3), "theta": np.zeros(2)},
    "unknown path": {"parameters": {"load.vertikal": 0.1}},
    "path to a part": {"parameters": {"load.horizontal": ANGLES}},
    "path to nothing": {"parameters": {"": ANGLES}},
    "path to None": {"parameters": {"model.smoothing": ANGLES}},
    "path that is a number": {"parameters": {3: ANGLES}},
    "list of paths": {"parameters": ["load.vertical"]},
    "text for paths": {"parameters": "load.vertical"},
    "a number for paths": {"parameters": 0},
    "nothing for paths": {"parameters": ()},
    "value refused at the end": {"parameters": {"model.beta0": np.linspace(1.0, 4.0, 5)}},
    "value refused inside": {"parameters": {"model.beta0": np.array([1.0, 2.0, 80.0, 2.0, 1.0])}},
    "impact factor": {"parameters": {"impact.e": np.linspace(0.0, 1.1, 5)}},
    "no frequency": {"parameters": {"load.frequency": np.linspace(0.0, 1.0, 5)}},
    "broken order": {"parameters": {"load.horizontal.order": np.linspace(1, 2, 5)}},
    "order 0": {"parameters": {"load.horizontal.order": np.arange(5)}},
    "unknown coordinate": {"phi": ANGLES},
    "no length": {"periods": None},
    "two lengths": {"duration": 1.0},
    "negative length": {"periods": -1},
    "nan length": {"periods": np.nan},
    "endless": {"periods": np.inf},
    "length per trajectory": {"periods": ANGLES},
    "longer than can be counted": {"periods": 1e17},
    "later than can be counted": {"time": 1e300},
    "rough": {"tol": 1e-3},
    "tolerances": {"tol": ANGLES},
    "unknown sample": {"sample": ("stat",)},
    "no samples": {"sample": None},
    "a number for samples": {"sample": (3,)},
    "unknown end": {"until": "res"},
    "a number for ends": {"until": 3},
    "last -1": {"last": -1},
    "last 1.5": {"last": 1.5},
    "last word": {"last": "al"},
    "last None": {"last": None},
    "last array": {"last": ANGLES},
    "side 2": {"side": 2},
    "sides": {"side": np.array([1, -1])},
    "no threads": {"threads": 0},
    "half a thread": {"threads": 1.5},
    "threads word": {"threads": "2"},
    "unknown sensitivity": {"sensitivities": ("load.vertikal",)},
    "sensitivity twice": {"sensitivities": ("load.vertical", "load.vertical")},
    "a number for sensitivities": {"sensitivities": 3},
    "sensitivity to an order": {"sensitivities": ("load.horizontal.order",)},
    "unknown margin": {"stop_at": "lin_limit"},
    "a number for margins": {"stop_at": 3},
}


@pytest.mark.parametrize("mistake", BAD)
def test_mistakes_are_refused_in_one_sentence(mistake):
    with pytest.raises(ParameterError) as caught:
        run(**BAD[mistake])
    assert 10 < len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)


def test_forcing_periods_need_a_frequency():
    with pytest.raises(ParameterError, match="no frequency"):
        run(TIMELESS)
    with pytest.raises(ParameterError):
        run(TIMELESS, periods=None, duration=1.0, parameters={"load.frequency": 1.0})
    assert run(TIMELESS, periods=None, duration=1.0).sizes["trajectory"] == 5


def test_a_missing_coordinate_is_named():
    with pytest.raises(ParameterError, match="needs theta"):
        saltus.simulate_many(SYSTEM, periods=1)


junk = st.one_of(
    st.none(),
    st.text(max_size=4),
    st.floats(allow_nan=True),
    st.integers(-5, 10**30),
    st.binary(max_size=2),
    st.lists(st.one_of(st.text(max_size=2), st.floats(-1, 1)), max_size=3),
    st.dictionaries(st.text(max_size=3), st.floats(-1, 1), max_size=2),
    st.complex_numbers(),
)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(
        [
            "theta",
            "velocity",
            "time",
            "parameters",
            "tol",
            "side",
            "sample",
            "last",
            "until",
            "sensitivities",
            "threads",
        ]
    ),
    junk,
)
def test_junk_is_refused_or_taken_but_never_a_traceback_of_another_kind(argument, value):
    if argument == "threads" and isinstance(value, int) and value > 4:
        value = 4
    if argument == "time" and isinstance(value, (int, float)) and abs(value) > 1e9:
        value = 1e300
    try:
        ensemble = run(**{"theta": 0.1, "periods": 0.1, argument: value})
    except SaltusError:
        pass
    else:
        finite = np.isfinite(ensemble.theta.values) | ~np.isin(
            stop_names(ensemble).values, ["horizon", "rest"]
        )
        assert finite.all()


@FEW
@given(
    theta=st.floats(-1e100, 1e100),  # larger ones are refused where they are given
    velocity=st.floats(-1e100, 1e100),
    amplitude=st.floats(-1e100, 1e100),
    damping=st.floats(0, 1e100),
    frequency=st.floats(-5, 5).map(lambda x: 10.0**x),
)
def test_numbers_of_any_size_end_with_a_reason(theta, velocity, amplitude, damping, frequency):
    columns = {
        "load.horizontal.amplitude": amplitude,
        "model.damping": np.array([damping]),
        "load.frequency": frequency,
    }
    ensemble = run(theta=theta, velocity=velocity, parameters=columns, periods=None, duration=1e-3)
    name = stop_names(ensemble).values[0]
    assert name in ("horizon", "rest", "not_finite", "stalled", "not_unique")
    if name in ("horizon", "rest"):
        assert np.isfinite([float(ensemble.theta[0]), float(ensemble.velocity[0])]).all()


def test_a_record_and_a_model_without_contact_take_columns_too():
    load = Load(
        force=Record(np.arange(5.0), np.array([0.0, 1.0, -1.0, 0.5, 0.0]), quantity="force")
    )
    scale = np.array([-1.0, 0.0, 2.0])
    ensemble = saltus.simulate_many(
        System(model=Duffing(), load=load),
        x=0.2,
        duration=4.5,
        parameters={"load.force.scale": scale},
    )
    for i, value in enumerate(scale):
        system = System(model=Duffing(), load=load).with_({"load.force.scale": value})
        assert float(ensemble.x[i]) == pytest.approx(
            saltus.simulate(system, x=0.2, duration=4.5).x, abs=1e-11
        )


def test_processes_that_compute_at_the_same_time_share_the_cores(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda process: set(range(8)), raising=False)
    monkeypatch.setattr("saltus.flow.programs.lane_threads._sharing", [lambda: 1])
    assert read_threads(None) == 8
    for processes, threads in ((2, 4), (3, 2), (8, 1), (20, 1), (0, 8)):
        share_cores(lambda count=processes: count)
        assert (read_threads(None), read_threads(5)) == (threads, 5)
