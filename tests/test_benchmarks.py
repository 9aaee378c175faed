"""The benchmarks: comparing at equal achieved error, on power laws with known answers, and what
AUTO-07p is told and says.
"""

import ctypes
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
equal, harmonic_balance, measure, reference, report = (
    __import__(name) for name in ("equal", "harmonic_balance", "measure", "reference", "report")
)
from auto import case, diagram, exact, program, section, verdicts  # noqa: E402
from peers.peer import AbsentError  # noqa: E402
from structures.beside import at_error  # noqa: E402
from structures.case import by_scipy  # noqa: E402
from structures.row import bar, displaced  # noqa: E402
from tasks import one_motion  # noqa: E402

ERRORS = np.array([1e-4, 1e-6, 1e-9, 1e-13])


@settings(deadline=None, max_examples=50)
@given(order=st.floats(0.5, 20.0), cost=st.floats(1e-3, 1e3), target=st.floats(1e-13, 1e-4))
def test_a_power_law_is_interpolated_exactly(order: float, cost: float, target: float) -> None:
    (time,) = measure.equal_error(ERRORS, cost * ERRORS ** (-1 / order), [target])
    assert time == pytest.approx(cost * target ** (-1 / order), rel=1e-9)


def test_a_looser_target_costs_the_cheapest_point_and_a_tighter_one_is_not_reached() -> None:
    times = measure.equal_error(ERRORS, [1.0, 2.0, 3.0, 4.0], [1e-2, 1e-13, 1e-14])
    assert times[0] == 1.0
    assert times[1] == pytest.approx(4.0)
    assert math.isnan(times[2])


def test_a_setting_that_another_one_beats_in_error_and_time_does_not_count() -> None:
    # 1e-3 at 2 s is dearer and worse than 1e-5 at 1 s, as where a loose tolerance loses a motion
    errors, times = [1e-3, 1e-5, 1e-9], [2.0, 1.0, 3.0]
    assert measure.equal_error(errors, times, [1e-3])[0] == 1.0
    assert measure.equal_error([*errors, float("nan")], [*times, 0.1], [1e-9])[0] == pytest.approx(
        3.0
    )


def test_a_code_that_never_ran_right_has_no_time() -> None:
    assert np.isnan(measure.equal_error([float("nan")], [1.0], [1e-6, 1e-9])).all()


def test_tasks_take_turns_and_every_round_counts() -> None:
    calls: list[str] = []
    timings = measure.interleave(
        {"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3
    )
    assert calls == ["a", "b"] * 4  # the first round warms up
    assert timings["a"].rounds == 3
    assert timings["a"].least <= timings["a"].low <= timings["a"].median <= timings["a"].high


def test_ratios_and_verdicts_follow_from_the_times() -> None:
    lanes = [{"peer": equal.OURS, "error": e, "median": 1.0} for e in (1e-7, 1e-15)]
    heyoka = [
        {"peer": "heyoka.py batch", "error": e, "median": t} for e, t in ((1e-7, 4.0), (1e-13, 8.0))
    ]
    found = equal.at_equal_error(lanes + heyoka)["heyoka.py batch"]
    assert found[0] == 4.0
    assert found[equal.TARGETS.index(1e-10)] == pytest.approx(math.sqrt(32.0))
    assert math.isnan(found[equal.TARGETS.index(1e-14)])
    (line,) = equal.asked({"work": lanes + heyoka, "startup": []})
    assert line == ("at equal error at least 5 times heyoka.py batch", "4 to 8 times", "no")


def test_one_motion_is_compared_at_equal_error_and_beside_what_it_was() -> None:
    times = {"heyoka.py scalar": 10.0, "saltus": 15.0, "saltus at ff7e16c": 40.0}
    rows = [
        {"code": code, "periods": n, "tol": tol, "error": tol, "least": n * least * tol ** (-1 / 6)}
        for code, least in times.items()
        for n in one_motion.PERIODS
        for tol in (1e-6, 1e-12)
    ]
    lines = report._one_motion(rows).splitlines()
    (line,) = (line for line in lines if line.startswith("| 20 | saltus |"))
    assert (
        line == "| 20 | saltus | 3,000 (1.5x) | 6,463 (1.5x) | 13,925 (1.5x) | 30,000 (1.5x) | 1x |"
    )
    assert "| 1 | saltus at ff7e16c | 400 (4.0x) |" in "\n".join(lines)


@pytest.mark.parametrize(
    ("x", "text"),
    [(0.0, "0"), (1.2345, "1.23"), (12345.6, "12,346"), (1e-9, "1.00e-09"), (math.nan, "-")],
)
def test_numbers_are_written_to_three_digits(x: float, text: str) -> None:
    assert report.number(x) == text


def test_the_reference_ends_are_those_of_saltus() -> None:
    import saltus

    system = saltus.System(
        model=saltus.Metainterface(beta0=reference.BETA0, damping=reference.DAMPING),
        load=saltus.Load(
            frequency=reference.FREQUENCY,
            horizontal=saltus.Harmonic(amplitude=reference.AMPLITUDE),
            vertical=reference.VERTICAL,
        ),
    )
    starts, known = reference.states(reference.MOTIONS), reference.exact()
    motions = [
        saltus.simulate(system, theta=x, velocity=v, periods=reference.PERIODS)
        for x, v in zip(*starts, strict=True)
    ]
    assert reference.errors([m.theta for m in motions], [m.velocity for m in motions]).max() < 1e-12
    assert [len(m.impacts) for m in motions] == known["impacts"].tolist()


# --- AUTO-07p

# A run of AUTO at H = 0.5 and B = 1000 on the 20 x 4 mesh, of which only the first points and the
# labelled ones are kept
RECORDED = Path(__file__).with_name("auto_fort7.txt")


@pytest.fixture
def objects() -> list[str]:
    try:
        return program.libraries()
    except AbsentError as reason:
        pytest.skip(str(reason))


def test_a_recorded_diagram_of_auto_is_read_whole() -> None:
    points = diagram.parse(RECORDED.read_text())
    known = case.KNOWN[0.5]
    assert points[0] == diagram.Point(3.0, 7.1019429784e-02, 4.7042285432e-14, True, "EP")
    assert [p.kind for p in points] == [
        "EP",
        "",
        "",
        "LP",
        "LP",
        "LP",
        "BP",
        "BP",
        "LP",
        "BP",
        "PD",
        "LP",
        "LP",
        "EP",
    ]
    assert points[4].stable is False  # between two folds
    assert all(error < 2e-4 for error in verdicts.fold_errors(points, known))  # of a mesh of 20
    row = verdicts.row(program.Run(points, 1.0), known)
    assert row["end"] == "turns round, back at 3"
    assert row["grazing"] == {"arrives": False, "turns": [], "beyond": False}
    assert row["impossible"] == 1  # the PD, on a symmetric orbit


def test_a_diagram_cut_off_loses_its_last_line_and_another_text_is_refused() -> None:
    text = RECORDED.read_text()
    assert len(diagram.parse(text.rstrip()[:-30])) == len(diagram.parse(text)) - 1
    with pytest.raises(ValueError, match="not a bifurcation diagram"):
        diagram.parse("segmentation fault")
    with pytest.raises(ValueError, match=r"no column PAR\(9\)"):
        diagram.parse(text.replace("PAR(9)", "PAR(7)"))


def test_an_exponent_without_its_letter_is_read() -> None:
    assert [diagram._number(x) for x in ("-1.7976+308", "1.5-104", "2.0E-016", "-3.5")] == [
        -1.7976e308,
        1.5e-104,
        2e-16,
        -3.5,
    ]


def _orbits(*points: tuple[float, str, float]) -> list[diagram.Point]:
    return [diagram.Point(omega, 1.0, mean, True, kind) for omega, kind, mean in points]


def test_only_labels_that_no_orbit_can_deserve_count_as_impossible() -> None:
    on_symmetric, on_asymmetric = 1e-5, 0.05
    branch = _orbits(
        (1.0, "PD", on_symmetric),
        (0.9, "PD", on_asymmetric),
        (0.8, "TR", on_asymmetric),
        (0.7, "BP", on_symmetric),
    )
    assert verdicts.impossible(branch) == 2


@settings(deadline=None, max_examples=50)
@given(shift=st.floats(-1e-3, 1e-3), others=st.lists(st.floats(1.2, 2.9), max_size=5))
def test_a_fold_is_held_against_the_nearest_known_one(shift: float, others: list[float]) -> None:
    known = case.KNOWN[0.5]
    branch = _orbits(*((omega, "LP", 0.0) for omega in [*others, known.folds[1] + shift]))
    first, second = verdicts.fold_errors(branch, known)
    assert first is None  # nothing within a hundredth of the lower one
    assert second == pytest.approx(abs(shift), abs=1e-15)


def test_a_passage_of_the_grazing_is_told_from_turning_at_it() -> None:
    known = case.KNOWN[0.5]
    smooth = _orbits((0.3, "", 0.0), (0.2850, "", 0.0), (0.27, "", 0.0))
    assert verdicts.at_grazing(smooth, known) == {"arrives": True, "turns": [], "beyond": True}
    lost = _orbits((0.3, "", 0.0), (0.28465, "LP", 0.0), (0.2846, "MX", 0.0))
    assert verdicts.at_grazing(lost, known) == {
        "arrives": True,
        "turns": [[0.28465, 1.0]],
        "beyond": False,
    }
    assert "one 2e-05 away, does not pass" in section._grazing(
        verdicts.at_grazing(lost, known), known
    )
    assert verdicts.at_grazing(smooth, case.KNOWN[1.0]) is None


def test_a_machine_without_auto_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from auto.beside import beside_auto

    monkeypatch.delenv("AUTO_DIR", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    beside_auto({}, quick=True, folder=tmp_path)
    assert "apt-get install auto-07p gfortran" in (tmp_path / "auto.md").read_text()
    assert not (tmp_path / "auto.png").exists()


def test_the_report_on_auto_tells_what_is_missing_and_draws_what_is_there(tmp_path: Path) -> None:
    from auto.picture import draw

    points = diagram.parse(RECORDED.read_text())
    curve = {"omega": [p.omega for p in points], "amplitude": [p.amplitude for p in points]}
    names = {"amplitude": 0.5, "sharpness": 1000.0, "mesh": "20 x 4", "timed": None, "curve": curve}
    rows = [names | verdicts.row(program.Run(points, 1.0), case.KNOWN[0.5])]
    exact = [{"lowest": 0.2, "fails": "too many impacts"}] * 2
    results = {
        "about": {},
        "version": "0",
        "auto": rows,
        "exact": {"0.5": exact, "1.0": exact},
        "curve": curve,
    }
    text = section.report(results)
    assert text.count("too many impacts") == 4
    assert (
        "| 1.00 | 14 | 3e-05, 1e-04 | does not get there | turns round, back at 3 | 6 / 3 / 1 / "
        "0 | 1 |"
    ) in text
    (tmp_path / "auto.png").write_bytes(draw(results))
    assert (tmp_path / "auto.png").stat().st_size > 10_000


def test_the_exact_branch_beside_auto_has_the_folds_that_both_are_compared_by() -> None:
    folds = [
        special.parameter for special in exact.follow(1.0, 0.7).special if special.kind == "LP"
    ]
    for known in case.KNOWN[1.0].folds:
        assert min(abs(fold - known) for fold in folds) < 1e-9


@pytest.mark.parametrize("amplitude", [0.5, 1.0])
def test_auto_starts_from_an_orbit_of_period_1(amplitude: float) -> None:
    orbit = case.first_orbit(amplitude)
    assert orbit.shape == (case.SAMPLES + 1, 5)
    assert np.abs(orbit[-1, 1:] - orbit[0, 1:]).max() < 1e-12
    half = case.SAMPLES // 2
    assert np.abs(orbit[half, 1:] + orbit[0, 1:]).max() < 1e-10  # and a symmetric one


def test_the_equations_given_to_auto_are_those_of_the_smoothed_model(
    objects: list[str], tmp_path: Path
) -> None:
    import saltus

    library = tmp_path / "equations.so"
    command = [
        "gfortran",
        "-shared",
        "-fPIC",
        "-std=legacy",
        "-fopenmp",
        str(program.EQUATIONS),
        "-o",
        str(library),
        *objects,
    ]
    subprocess.run(command, check=True, cwd=tmp_path, capture_output=True)
    func = ctypes.CDLL(str(library)).func_
    omega, amplitude, sharpness, time = 0.7, 0.9, 50.0, 0.4
    par = np.array(
        [omega, amplitude, sharpness, reference.VERTICAL, reference.DAMPING, reference.BETA0]
    )

    def field(u: np.ndarray, wanted: int = 0) -> tuple[np.ndarray, np.ndarray]:
        slope, jacobian, to_omega = (
            np.zeros(4),
            np.zeros((4, 4), order="F"),
            np.zeros((4, 36), order="F"),
        )
        whole, icp = [ctypes.byref(ctypes.c_int(x)) for x in (4, wanted)], (ctypes.c_int * 2)(1, 11)
        arrays = [
            array.ctypes.data_as(ctypes.c_void_p) for array in (u, par, slope, jacobian, to_omega)
        ]
        func(whole[0], arrays[0], icp, arrays[1], whole[1], *arrays[2:])
        return slope, jacobian

    model = saltus.Metainterface(
        beta0=reference.BETA0, damping=reference.DAMPING, smoothing=sharpness
    )
    load = saltus.Load(
        frequency=omega,
        horizontal=saltus.Harmonic(amplitude=amplitude),
        vertical=reference.VERTICAL,
    )
    for theta, velocity in ((0.01, 0.3), (-0.02, 1.0), (1.3, -0.4), (0.0, 0.5)):
        u = np.array([theta, velocity, math.sin(omega * time), math.cos(omega * time)])
        slope, jacobian = field(u, 1)
        exact = model.acceleration(time, theta, velocity, 1.0, load)
        assert slope == pytest.approx([velocity, exact, omega * u[3], -omega * u[2]], abs=1e-14)
        steps = np.eye(4) * 1e-6
        differences = np.column_stack([(field(u + h)[0] - field(u - h)[0]) / 2e-6 for h in steps])
        assert jacobian == pytest.approx(differences, abs=1e-6)


def test_the_folds_of_auto_come_to_the_exact_ones(objects: list[str]) -> None:
    with program.linked() as executable:
        text = program.constants(1.0, 200.0, program.Mesh(50), lowest=0.75)
        run = program.run(executable, case.first_orbit(1.0), text)
    assert run.fails == ""
    assert 0.7 < run.branch[-1].omega <= 0.75
    assert max(verdicts.fold_errors(run.branch, case.KNOWN[1.0])) < 1e-4
    assert verdicts.impossible(run.branch) == 0


@pytest.mark.thorough
def test_a_fit_and_one_by_differences_have_the_same_result_and_a_line_each_in_the_report() -> None:
    from tasks.fitting import NEAR, fits

    rows = fits(rounds=1)
    assert [row["unknowns"] for row in rows] == [1, 6]
    assert max(max(row["missed"], row["missed_by_differences"]) for row in rows) < NEAR
    assert report._fits(rows).count("\n| ") == 3
    assert not report._fits(None)


def test_a_structure_is_followed_alike_by_saltus_and_by_scipy() -> None:
    """Ten masses at a wall: ten forcing periods with their impacts and releases, which SciPy's
    events find.
    """
    assert np.abs(by_scipy(10, 1e-7) - displaced(bar(10), 1e-10)).max() < 1e-8


def test_what_the_smallest_steps_do_not_reach_is_extrapolated_at_first_order() -> None:
    steps = {"rows": [{"error": 1e-3 / k, "seconds": 1.0 * k} for k in (1, 2, 4)]}
    assert at_error(steps, 5e-4) == (pytest.approx(2.0), True)
    assert at_error(steps, 1e-5) == (pytest.approx(100.0), False)
    assert math.isnan(at_error({"fails": "over 60 s"}, 1e-5)[0])


def test_harmonic_balance_has_the_closed_form_of_a_linear_oscillator(monkeypatch) -> None:
    monkeypatch.setattr(harmonic_balance, "STOP", 0.0)
    balance = harmonic_balance.Balance(5)
    places = balance.curve()
    frequency = harmonic_balance.SEEN
    answer = harmonic_balance.FORCE / complex(
        1.0 - frequency**2, harmonic_balance.DAMPING * frequency
    )
    assert balance.largest(places) == pytest.approx(abs(answer), rel=1e-6)


def test_the_jacobian_of_harmonic_balance_is_that_of_differences() -> None:
    balance = harmonic_balance.Balance(4)
    place = np.append(0.3 * np.cos(np.arange(9.0)), 1.1)
    _, derivatives = balance.evaluate(place)
    for i, column in enumerate(derivatives.T):
        step = np.zeros(10)
        step[i] = 1e-6
        ahead, behind = (balance.evaluate(place + sign * step)[0] for sign in (1, -1))
        np.testing.assert_allclose(column, (ahead - behind) / 2e-6, atol=1e-4)
