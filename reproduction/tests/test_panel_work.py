"""The pool of the paper's panels: every part gets its own panels in their order, and what two parts
share is computed once.
"""

import os
import signal
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path

import pytest

from saltus.flow import available_cores
from saltus_paper.panel_work import compute_panels


def marked(folder: str, name: str, value: int) -> int:
    """The value, with a file for each time that it is computed."""
    (Path(folder) / f"{name}-{os.getpid()}-{len(list(Path(folder).iterdir()))}").touch()
    return value


def refuse() -> None:
    raise ZeroDivisionError


def number() -> int:
    return 7


def end() -> None:
    """End the process as the system does where memory is short."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_parts_get_their_panels_in_order_and_a_shared_one_is_computed_once(tmp_path: Path) -> None:
    shared = partial(marked, str(tmp_path), name="shared", value=3)
    parts = {
        "one": {"b": partial(marked, str(tmp_path), name="b", value=2), "a": shared},
        "two": {"d": partial(marked, str(tmp_path), name="shared", value=3)},
        "three": {"only": partial(marked, str(tmp_path), name="only", value=5)},
    }
    made = {part.name: part.panels for part in compute_panels(parts)}
    assert {part: list(panels.items()) for part, panels in made.items()} == {
        "one": [("b", 2), ("a", 3)],
        "two": [("d", 3)],
        "three": [("only", 5)],
    }
    assert len([path for path in tmp_path.iterdir() if path.name.startswith("shared")]) == 1


@pytest.mark.parametrize(
    "panels", [{"a": refuse}, {"a": refuse, "b": partial(int, 1)}], ids=["here", "in processes"]
)
def test_a_panel_that_fails_leaves_the_other_parts_alone(panels: dict) -> None:
    parts = {part.name: part for part in compute_panels({"bad": panels, "good": {"c": number}})}
    assert isinstance(parts["bad"].error, ZeroDivisionError)
    assert not parts["bad"].panels
    assert parts["good"].error is None
    assert parts["good"].panels == {"c": 7}


def test_a_process_that_is_ended_costs_its_own_panel_alone() -> None:
    """As where there is no memory left; all other panels that waited are computed."""
    good = {name: partial(int, value) for value, name in enumerate("abcdef")}
    parts = {
        part.name: part for part in compute_panels({"bad": {"x": end, "y": end}, "good": good})
    }
    assert isinstance(parts["bad"].error, BrokenProcessPool)
    assert parts["good"].panels == {name: value for value, name in enumerate("abcdef")}


def cores_beside(pipe: str, mode: str) -> int:
    """The cores that a panel may use while another one is computed, which opens the pipe too: each
    waits for the other.
    """
    with open(pipe, mode):
        return available_cores()


@pytest.mark.skipif(available_cores() < 2, reason="on one core panels come one after the other")
def test_panels_that_are_computed_at_the_same_time_share_the_cores(tmp_path: Path) -> None:
    pipe = str(tmp_path / "pipe")
    os.mkfifo(pipe)
    panels = {mode: partial(cores_beside, pipe, mode) for mode in ("r", "w")}
    (part,) = compute_panels({"part": panels})
    first, last = sorted(part.panels.values())
    assert first == available_cores() // 2
    assert last in (first, available_cores())  # one may be done before the other one has asked


def test_every_part_is_computed_once():
    # all of the paper, which the processes of the other tests need not import
    from saltus_paper.parts import FIGURES, ORDER

    assert sorted(ORDER) == sorted(FIGURES)
