"""Records in files: each format as its publisher describes it, made here from known samples.

The headings are those of published files: CSMIP's V2 of station 89486 (20 December 2022), whose
three components also gave the peaks that its headings state; COSMOS 1.20 of AK.BMR (30 November
2018), with 42000 samples in 210 s, raw steps of 20 ms and processed ones of 5 ms; and of PEER's AT2
the four that are found in public repositories.
"""

import time

import numpy as np
import pytest

from saltus import PhysicalBlock, System, load_study, simulate
from saltus.errors import ParameterError
from saltus.systems import Load, Record

RNG = np.random.default_rng(3)
STEP, ACCELERATION = 0.02, np.round(200.0 * RNG.normal(size=43), 3)  # s, cm/s^2


def lines_of(numbers, each, form):
    return ["".join(form % x for x in numbers[i : i + each]) for i in range(0, len(numbers), each)]


def peer(
    heading="ACCELERATION TIME SERIES IN UNITS OF G",
    said="NPTS=     43, DT=   .0200 SEC,",
    numbers=ACCELERATION / 980.665,
):
    title = ["PEER NGA STRONG MOTION DATABASE RECORD", "Synthetic, 1/1/2000, Station X, 90"]
    return "\n".join([*title, heading, said, *lines_of(numbers, 5, "%15.7E")])


def csmip(said="in cm/sec2. (8f10.3)", components=3, form="%10.3f"):
    """A V2 file of CSMIP: for each component 25 lines of text, 7 of whole numbers, 13 of others,
    and three blocks of samples.
    """
    text = []
    for k in range(components):
        text += (
            ["Corrected accelerogram  points of the heading"] * 25
            + ["    0" * 16] * 7
            + [" " * 6 + "1.00"] * 13
        )
        for name, factor in (("accel", 1.0), ("veloc", 0.1), ("displ", 0.01)):
            rate = {"accel": "/sec2", "veloc": "/sec", "displ": ""}[name]
            text.append(
                f"   43 points of {name} data equally spaced at  .020 sec,"
                f" {said.replace('/sec2', rate)}"
            )
            text += lines_of((k + 1) * factor * ACCELERATION, 8, form)
        text.append(f"/&  ----------  End of data for channel {k + 1}  ----------")
    return "\n".join(text)


def cosmos(
    raw=0.005, processed=20.0, said="units=cm/s^2 (4),Format=(10F8.2)", numbers=ACCELERATION
):
    reals = np.full(100, -999.0)
    reals[33], reals[61] = raw, processed
    text = ["Corrected acceleration   (Format v01.20 with 13 text lines) Src: 02"] + ["..."] * 12
    text += ["  100 Integer-header values follow on 10 lines, Format= (10I8)"] + [
        "    -999" * 10
    ] * 10
    text += [
        " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
        *lines_of(reals, 5, "%15.6f"),
    ]
    text += ['   1 Comment line(s) follow, each starting with a "|":', "| made for a test"]
    text += [f"      43 acceleration pts, approx   1 secs, {said}", *lines_of(numbers, 10, "%8.2f")]
    return "\n".join([*text, "End-of-data for Chan  1 acceleration"])


def read(tmp_path, text, **options):
    (tmp_path / "r.txt").write_text(text)
    return Record.read(tmp_path / "r.txt", source="r.txt", **options)


def one_a_line(text):
    """The same file with its samples below one another, as the files of version 1.20 have them."""
    head, _, numbers = text.partition("(1E15.6)\n")
    numbers, _, tail = numbers.partition("\nEnd")
    return f"{head}(1E15.6)\n" + "\n".join(f"{x:15.6e}" for x in ACCELERATION) + "\nEnd" + tail


FILES = {
    "AT2": (peer(), 1e-7),
    "old AT2": (
        peer("ACCELERATION TIME HISTORY IN UNITS OF G", "   43    0.0200    NPTS, DT"),
        1e-7,
    ),
    "units below": (peer("NPTS= 43, DT= .02 SEC", "ACCELERATION IN UNITS OF G"), 1e-7),
    "CSMIP": (csmip(), 1e-12),
    "older CSMIP": (csmip("(UNITS: CM/SEC/SEC)").upper(), 1e-12),
    "CSMIP without units": (csmip("").replace("sec, ", "SEC."), 1e-12),
    "COSMOS": (cosmos(), 1e-4),
    "COSMOS, step of the raw samples": (cosmos(raw=0.02, processed=-999.0), 1e-4),
    "COSMOS, one number a line": (
        one_a_line(cosmos(said="units=cm/sec2(04),Format=(1E15.6)")),
        1e-4,
    ),
    "COSMOS, not corrected": (cosmos().replace("acceleration pts,", "uncor. accel. pts,"), 1e-4),
    "COSMOS, samples in a second": (
        cosmos(raw=-999.0).replace("pts, approx   1 secs, units=", "pts a   50 pts/sec, Units="),
        1e-4,
    ),
    "AT2 without spaces": (peer().replace("  ", " ").replace(" -", "-"), 1e-7),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_gives_its_samples_in_seconds_and_metres(tmp_path, name):
    text, rounding = FILES[name]
    record = read(tmp_path, text)
    assert record.quantity == "acceleration"
    np.testing.assert_allclose(record.time, STEP * np.arange(43), rtol=1e-14)
    np.testing.assert_allclose(record.value, 0.01 * ACCELERATION, rtol=0, atol=rounding)


def test_numbers_that_touch_each_other_are_parted_by_their_format(tmp_path):
    """Columns of 8 with 2 decimals have no spaces from -1000 on."""
    numbers = np.full(43, -1234.56)
    assert read(tmp_path, cosmos(numbers=numbers)).value == pytest.approx(0.01 * numbers)


def test_a_v2_file_has_several_quantities_and_components(tmp_path):
    record = read(tmp_path, csmip(), quantity="velocity", component=2)
    np.testing.assert_allclose(record.value, 0.01 * 2 * 0.1 * ACCELERATION, atol=6e-6)
    assert record.quantity == "velocity"
    assert read(tmp_path, csmip(), quantity="displacement", component=3).quantity == "displacement"


def test_a_velocity_and_a_displacement_of_peer(tmp_path):
    assert read(tmp_path, peer("VELOCITY TIME SERIES IN UNITS OF CM/S")).quantity == "velocity"
    record = read(tmp_path, peer("DISPLACEMENT TIME SERIES IN UNITS OF CM", numbers=ACCELERATION))
    np.testing.assert_allclose(record.value, 0.01 * ACCELERATION, rtol=1e-6)


def test_two_columns_have_the_units_that_are_given(tmp_path):
    text = "t,a\n0,0\n0.5,0.25\n1,0"
    assert (read(tmp_path, text).quantity, read(tmp_path, text).value[1]) == ("force", 0.25)
    for units, factor in (
        ("g", 9.80665),
        ("cm/s2", 0.01),
        ("gal", 0.01),
        ("cm/sec/sec", 0.01),
        ("m/s^2", 1.0),
    ):
        record = read(tmp_path, text, units=units)
        assert (record.quantity, record.value[1]) == ("acceleration", pytest.approx(0.25 * factor))
    scaled = read(tmp_path, text, quantity="acceleration", scale=3.0, time_scale=2.0)
    assert (scaled.derivative(1.0, None, 2), scaled.time[-1]) == (pytest.approx(0.75), 2.0)


@pytest.mark.parametrize("degree", [0, 1, 3])
def test_a_baseline_is_a_polynomial_that_is_fitted_by_least_squares(tmp_path, degree):
    """What is left is orthogonal to all powers of the time, and is the same with any polynomial
    added.
    """
    time = STEP * np.arange(43)
    drift = np.polyval([0.5, -2.0, 30.0, 7.0][3 - degree :], time)
    plain, drifted = (
        read(
            tmp_path,
            "\n".join(f"{t},{a!r}" for t, a in zip(time, (ACCELERATION + d).tolist(), strict=True)),
            units="m/s2",
            baseline=degree,
        )
        for d in (0.0, drift)
    )
    np.testing.assert_allclose(drifted.value, plain.value, atol=1e-9)
    assert [plain.value @ time**k for k in range(degree + 1)] == pytest.approx(
        [0.0] * (degree + 1), abs=1e-9
    )


def test_a_study_reads_the_same_files(tmp_path):
    (tmp_path / "X.AT2").write_text(peer())
    body = PhysicalBlock(half_width=0.3, half_height=1.5)
    expected = body.system(Load(ground_horizontal=Record.read(tmp_path / "X.AT2", baseline=1)))
    (tmp_path / "study.toml").write_text(
        f"[model]\ntype = 'RockingBlock'\nalpha = {body.alpha!r}\n[load]\nground_horizontal = {{"
        f" file = 'X.AT2', baseline = 1, time_scale = {body.frequency!r}, scale ="
        f" {1 / body.gravity!r} }}\n"
    )
    system = load_study(tmp_path / "study.toml").system
    assert isinstance(system, System)
    for t in (0.3, 1.1):
        assert system.load.ground_horizontal.acceleration(t) == pytest.approx(
            expected.load.ground_horizontal.acceleration(t)
        )
    ends = [simulate(each, theta=0.0, duration=3.0) for each in (system, expected)]
    assert ends[0].theta == pytest.approx(ends[1].theta, abs=1e-10)


REFUSED = {
    "words": (
        "once upon a time\nthere was a block\n",
        'line 2 must be two finite numbers, got the text "there was a block"; saltus reads AT2',
    ),
    "cut short": (
        peer(numbers=ACCELERATION[:20]),
        "file 'r.txt' has 20 of the 43 samples that its headings promise",
    ),
    "letters": (peer().replace("E-", "K-"), "line 5 must be numbers, got the text"),
    "no units": (
        peer("ACCELERATION (G)"),
        "does not say in its headings in which units it is; give them, such as units",
    ),
    "no step": (peer(said="NPTS= 43, DT= 0.0 SEC"), "samples 0 s apart; the step must be above 0"),
    "counts": (
        cosmos(said="units=counts (50),Format=(10F8.2)"),
        "file 'r.txt': units 'counts' are not known; known here: cm",
    ),
    "no fitting step": (
        cosmos(raw=-999.0, processed=-999.0),
        "43 samples in about 1 s, and no step in the headings above fits",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_record_is_told_what_is_wanted(tmp_path, name):
    text, problem = REFUSED[name]
    with pytest.raises(ParameterError) as caught:
        read(tmp_path, text)
    assert problem in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"units": "furlong"}, "units 'furlong' are not known"),
        ({"units": "cm"}, "the samples are said to be both displacement and acceleration"),
        ({"quantity": "force"}, "the samples are said to be both force and acceleration"),
        ({"baseline": -1}, "baseline must"),
        ({"component": 0}, "component must"),
        ({"time_scale": 0.0}, "time_scale must lie in"),
    ],
)
def test_options_that_contradict_the_file_are_refused(tmp_path, options, problem):
    with pytest.raises(ParameterError, match=problem):
        read(tmp_path, peer(), **options)


def test_what_a_v2_file_does_not_have_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="has 3 components of acceleration, and no number 4"):
        read(tmp_path, csmip(), component=4)
    with pytest.raises(ParameterError, match="has samples of acceleration, and none of velocity"):
        read(tmp_path, cosmos(), quantity="velocity")
    with pytest.raises(ParameterError, match="does not exist"):
        Record.read(tmp_path / "none.AT2")


STEPS_IN_SECONDS = ("0.0200 SEC", "2.0D-02 SEC", "2.0e-2", "20 MSEC", "20  ms")
STEPS_REFUSED = (
    *("2/100 SEC", "0,02 SEC", "2.0 E-02", "0.02*1", "0.02 HZ", "0.02, MSEC", "0.02 SEC*2"),
    *("1.2.3", "", "SEC"),
)
UNITS_OF_G = {"G": 9.80665, "g.": 9.80665, "CM/S**2": 0.01, "(CM / SEC / SEC)": 0.01, "M/S^2": 1.0}
UNITS_REFUSED = (
    *("G/10", "g*100", "10**-3 G", "MM/S2 (x 1000)", "CM/SEC 2", "CM/S^3", "G, TIMES 1000"),
    *("G  TIMES 2", "0.1 G", "MG"),
)


def refusal(tmp_path, text, **options):
    with pytest.raises(ParameterError) as caught:
        read(tmp_path, text, **options)
    sentence = str(caught.value)
    assert len(sentence) <= 400
    assert sentence.isprintable()
    return sentence


def test_a_field_of_a_heading_is_read_whole_or_refused(tmp_path):
    """Of a number or a unit no part is left out: `1.0D-02` is no 1, and `g*100` no g."""
    for step in STEPS_IN_SECONDS:
        assert read(tmp_path, peer(said=f"NPTS= 43, DT= {step}")).time[1] == pytest.approx(STEP)
    for step in STEPS_REFUSED:
        assert "line 4 must" in refusal(tmp_path, peer(said=f"NPTS= 43, DT= {step}")), step
    for count in ("43", "43.0"):
        assert len(read(tmp_path, peer(said=f"NPTS= {count}, DT= .02")).time) == 43
    for count in ("4,000", "4E1", "4 3", "-43", "x", "9" * 300):
        assert "samples" in refusal(tmp_path, peer(said=f"NPTS= {count}, DT= .02"))
    for unit, factor in UNITS_OF_G.items():
        found = read(tmp_path, peer(f"ACCELERATION TIME SERIES IN UNITS OF {unit}"))
        np.testing.assert_allclose(found.value, factor * ACCELERATION / 980.665, atol=1e-6)
    for unit in UNITS_REFUSED:
        heading = f"ACCELERATION TIME SERIES IN UNITS OF {unit}"
        assert "are not known" in refusal(tmp_path, peer(heading)), unit
        # units that are given count
        assert read(tmp_path, peer(heading), units="g").quantity == "acceleration"
    remark = "ACCELERATION TIME HISTORY IN UNITS OF G. FILTER POINTS: HP=0.2 Hz LP=30.0 Hz"
    np.testing.assert_array_equal(read(tmp_path, peer(remark)).value, read(tmp_path, peer()).value)


def test_headings_of_v2_files_are_read_whole_or_refused(tmp_path):
    milliseconds = csmip().replace(" .020 sec", " 20 msec")
    np.testing.assert_array_equal(read(tmp_path, milliseconds).time, read(tmp_path, csmip()).time)
    for said in ("in g/10. (8f10.3)", "in 0.1 cm/sec2. (8f10.3)", "(units: mg)", "times 10"):
        assert "are not known" in refusal(tmp_path, csmip(said)), said
    assert "width above 0" in refusal(tmp_path, csmip("in cm/sec2. (8f0)"))
    assert "with its unit" in refusal(tmp_path, csmip().replace(" .020 sec", " 1/50 sec"))
    for wrong in ("approx 1.2.3 secs", "approx secs", "approx   1 hours"):
        text = cosmos().replace("approx   1 secs", wrong)
        assert "must have a duration and units" in refusal(tmp_path, text), wrong
    assert "are not known" in refusal(tmp_path, cosmos(said="units=0.1 cm/s2,Format=(10F8.2)"))


def test_a_component_that_a_file_does_not_have_is_refused(tmp_path):
    for text in (peer(), "0,0\n1,1\n"):
        assert "has one component, and no number 2" in refusal(tmp_path, text, component=2)


def test_reading_takes_a_time_that_grows_with_the_size_alone(tmp_path):
    """Words and lines of a million letters are refused within the time of reading them."""
    head = "\n".join(peer().splitlines()[:4]) + "\n"
    n = 1_000_000
    cells = ("1" * n + "x", "+1" * n + "x", "1.1." * n, "1e" * n, " " * n + "x")
    texts = [head + cell for cell in cells]
    texts += [f"NPTS={' ' * n}DT=\n1 2\n", "1" * n + " points of accel data equally spaced at"]
    texts += [f"ACC {'UNITS OF ' * n}\nNPTS= 4, DT= .1\n1 2 3 4\n", "1 real-header" + " " * n]
    begun = time.process_time()
    for text in texts:
        refusal(tmp_path, text)
    assert time.process_time() - begun < 5.0  # quadratic ones took hours
    assert "has 0 of the 43 samples" in refusal(tmp_path, head)
