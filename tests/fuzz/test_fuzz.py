"""Whatever is given, the answer is a result or one sentence: no traceback, no file left, no work
begun that has no bounds.

The cases are the same in every run: 200 of each kind, and in `make thorough` 100 000 in all, or as
many of each kind as SALTUS_CASES says, in four pieces with a seed each.
"""

import os
import random
import resource
import time

import bad_inputs
import numpy as np
import pytest

import saltus
from saltus.errors import SaltusError
from saltus.systems import System

THOROUGH = int(os.environ.get("SALTUS_CASES", "20000"))
PIECES = [
    (200, 0),
    *(pytest.param(THOROUGH // 4, piece, marks=pytest.mark.thorough) for piece in range(1, 5)),
]
LONGEST, SLOWEST, LARGEST = 400, 10.0, 2e9  # characters, seconds, bytes


class Computed(BaseException):
    """The checks are over, and something would be computed."""


@pytest.fixture
def nothing_is_computed(monkeypatch):
    """Every motion ends the case, before it begins."""
    from saltus.flow.lanes import ensemble
    from saltus.flow.motion import simulate as simulation
    from saltus.orbits.equations import one_contact

    def begun(*_, **__):
        raise Computed

    monkeypatch.setattr(simulation, "follow", begun)
    monkeypatch.setattr(ensemble, "compile_driver_aside", begun)
    monkeypatch.setattr(one_contact.OneContactEquations, "evaluate", begun)


def answer(case: int, ask, *given, **named) -> str | None:
    """The sentence with which a case is refused, if it is."""
    begun, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        ask(*given, **named)
    except SaltusError as error:
        sentence = str(error)
    except Computed:
        sentence = None
    except Exception as error:
        pytest.fail(
            f"case {case}: {type(error).__name__}: {error!s:.300} for {given!r:.300} {named!r:.300}"
        )
    else:
        sentence = None
    assert sentence is None or len(sentence) < LONGEST, f"case {case}: {sentence}"
    assert time.process_time() - begun < SLOWEST, f"case {case}"
    assert 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < LARGEST, (
        f"case {case}"
    )
    return sentence


@pytest.mark.parametrize(("count", "piece"), PIECES)
def test_bad_studies(tmp_path, nothing_is_computed, count, piece):
    from saltus.cli.run_command import check
    from saltus.config import load_study

    path, rng, refused = tmp_path / "study.toml", random.Random(f"studies {piece}"), 0

    def run():
        study = load_study(path)
        for ask in study.asks:
            check(study, ask, tmp_path / "out")

    for case in range(count):
        path.write_bytes(bad_inputs.study(rng))
        refused += answer(case, run) is not None
        assert [file.name for file in tmp_path.iterdir()] == ["study.toml"]
    assert refused > count / 2


@pytest.mark.parametrize(("count", "piece"), PIECES)
def test_bad_records(tmp_path, count, piece):
    from saltus.config import load_study

    text = (
        '[model]\ntype = "Metainterface"\nbeta0 = 1.4\n[load]\nhorizontal = { file = "q.csv", '
        'quantity = "force" }\n'
    )
    (tmp_path / "study.toml").write_text(text)
    rng, refused = random.Random(f"records {piece}"), 0
    for case in range(count):
        (tmp_path / "q.csv").write_bytes(bad_inputs.record(rng))
        refused += answer(case, load_study, tmp_path / "study.toml") is not None
    assert refused > count / 3


@pytest.mark.parametrize(("count", "piece"), PIECES)
def test_bad_record_files(tmp_path, count, piece):
    """And what is read has as many finite numbers at times that rise as it says."""
    rng, refused = random.Random(f"record files {piece}"), 0
    for case in range(count):
        (tmp_path / "r.AT2").write_bytes(bad_inputs.record_file(rng))
        found = []
        sentence = answer(
            case, lambda into=found: into.append(saltus.Record.read(tmp_path / "r.AT2"))
        )
        assert sentence is None or sentence.isprintable()
        refused += sentence is not None
        for record in found:
            assert np.isfinite(record.value).all()
            assert (np.diff(record.time) > 0.0).all()
    assert count / 3 < refused < count


@pytest.mark.parametrize(("count", "piece"), PIECES)
def test_bad_json(count, piece):
    rng, refused = random.Random(f"json {piece}"), 0
    for case in range(count):
        refused += answer(case, System.from_json, bad_inputs.system_json(rng)) is not None
    assert refused > count / 2


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A store and a netCDF file with what saltus draws of them."""
    from saltus.cli.run_command import run_study

    folder = tmp_path_factory.mktemp("results")
    import tomli_w

    asks = {
        "stability_chart": bad_inputs.STUDY["stability_chart"],
        "simulate": {"theta": 0.3, "periods": 2},
    }
    (folder / "study.toml").write_text(
        tomli_w.dumps({name: bad_inputs.STUDY[name] for name in ("model", "load")} | asks)
    )
    run_study(folder / "study.toml", folder, False, None)
    return folder


@pytest.mark.parametrize(("count", "piece"), [(40, 0), *PIECES[1:]])
def test_damaged_results(results, tmp_path, count, piece):
    """A file of a store or a netCDF file is damaged: `status` and `plot` say so, or what is read is
    as it was.
    """
    from saltus.config import open_result
    from saltus.sweep import status

    rng = random.Random(f"results {piece}")
    store, motion = results / "stability_chart.zarr", results / "motion.nc"
    files = [motion] * 20 + sorted(file for file in store.rglob("*") if file.is_file())
    good = {path: open_result(path).load() for path in (store, motion)}
    for case in range(count):
        file = rng.choice(files)
        whole = motion if file == motion else store
        content = file.read_bytes()
        file.write_bytes(bad_inputs.damaged(rng, content))
        changed = file.read_bytes() != content
        read = []
        sentence = answer(case, lambda path=whole, into=read: into.append(open_result(path).load()))
        assert sentence is not None or not changed or file != motion, f"case {case}"
        # a space in JSON, say
        assert sentence is not None or read[0].identical(good[whole]), f"case {case}: {file}"
        if whole == store:
            answer(case, status, store)
            answer(case, status, store, verify=True)
        file.write_bytes(content)


def test_a_name_that_no_file_can_have_is_refused(tmp_path):
    """One case in some 2500 calls, of which a run that is not thorough met none."""
    long = "é" * 300
    for read in (saltus.load, saltus.load_study, saltus.sweep.status, saltus.sweep.open_store):
        assert answer(0, read, long) is not None
    assert answer(0, saltus.sweep.remove_store, long) is None  # there is none
    system = System.from_dict({name: bad_inputs.STUDY[name] for name in ("model", "load")})
    assert answer(0, saltus.stability_chart, system, store=tmp_path / long) is not None
