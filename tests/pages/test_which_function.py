"""The table "Which function for my question" has every public function, and no other name."""

import inspect
import re
from pathlib import Path

import saltus

PAGE = Path(__file__).parents[2] / "docs" / "which_function.md"
# of what has no question of its own
WITHOUT_A_QUESTION = {
    "branch_of": "reads a branch out of a spectrum",
    "branches_of": "reads the branches out of a spectrum",
    "capture_speed": "a bound that `simulate_many(until='rest')` uses",
    "chaotic_bands": "a part of `response_spectrum`",
    "doubling_cascade": "a part of a bifurcation diagram",
    "attractors_along": "a part of a bifurcation diagram",
    "excludes_tori": "a part of `classify`",
    "zero_one_test": "a part of `classify`",
    "energy_gain": "a check of an impact law",
    "explore": "`page` in a notebook",
    "load_study": "reads a file of a study",
    "phase_portrait": "draws autonomous motions",
    "register": "names a model in files",
    "show_progress": "an argument of others",
    "stable_manifold": "of `separatrices`, under a load",
    "stop_names": "reads the column `stop`",
    "from_sympy": "makes a model",
}


def test_every_function_answers_a_question():
    named = set(re.findall(r"`saltus\.(\w+)", PAGE.read_text(encoding="utf-8")))
    public = set(saltus.__all__)
    assert named <= public, named - public
    functions = {name for name in public if inspect.isroutine(getattr(saltus, name))}
    unnamed = functions - named
    assert unnamed == set(WITHOUT_A_QUESTION), unnamed ^ set(WITHOUT_A_QUESTION)
