"""Machine code of generated functions against the same text run by Python: every statement and every operation of models."""

import importlib.util
import inspect
import itertools
import math

import numpy as np
import pytest
from interpreted import Interpreted
from test_emit import LAYERS, LOAD, OPERATIONS, SYSTEMS

from saltus.flow.compiled import HEADER
from saltus.systems import Load, Metainterface, Model, Record, System
from saltus.taylor import records
from saltus.taylor.cache import MARKER

PYTHON = """
from saltus.taylor.llvm_lowering import lowered_jit as _lowered_jit


def lowered_jit(signature, **options):
    return _lowered_jit(signature, **{**options, "python": True})


"""
number = itertools.count()


@pytest.fixture
def compiled(tmp_path):
    """A function that compiles a text and returns its module."""

    def make(text):
        path = tmp_path / f"generated_{next(number)}.py"
        path.write_text(HEADER + PYTHON + text)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return make


def as_machine_code(generated, compiled):
    """The same structure, its functions compiled, with the interpreted one's numbers."""
    module = compiled(inspect.getsource(records).split(MARKER, 1)[1].split("\n", 1)[1] + generated.source)
    other = Interpreted.__new__(Interpreted)
    other.__dict__.update(generated.__dict__)
    other.scope = vars(module)
    return other


class EveryOperation(Model):
    """x'' = the sum of all operations that models may use."""

    coordinates = ("x",)
    channels = ("force",)
    sides = (1, -1)

    def acceleration(self, t, x, velocity, side, load):
        return sum(operation(x, velocity, load.force(t), 1.3, 0.6) for operation in OPERATIONS.values())


def close(one, two, ulps):
    return np.allclose(one, two, rtol=ulps * np.finfo(float).eps, atol=ulps * np.finfo(float).eps * np.abs(two).max())


def test_every_operation_gives_the_coefficients_that_python_gives(compiled):
    generated = Interpreted(System(model=EveryOperation(), load=LOAD))
    machine = as_machine_code(generated, compiled)
    for x, v, t in [(0.35, 0.55, 0.0), (0.2, -0.3, 2.1)]:
        expected = generated.coefficients(t, x, v, 10)
        radius = np.abs(expected).max() ** (-1 / 10)
        weights = radius ** np.arange(11)
        assert close(machine.coefficients(t, x, v, 10) * weights, expected * weights, 200)


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_models_functions_give_what_python_gives(compiled, name):
    generated = Interpreted(SYSTEMS[name], sensitivities=("load.frequency",))
    machine = as_machine_code(generated, compiled)
    for theta in (0.25, 0.4):
        for one, two in zip(machine.all(1.7, theta, -0.6, 8), generated.all(1.7, theta, -0.6, 8), strict=True):
            assert close(one, two, 100)
    for side in (1.0, -1.0):
        assert machine.reset(0.3, -0.7 * side, side) == generated.reset(0.3, -0.7 * side, side)  # bit for bit: fused=False
        assert close(machine.contact(0.3, 6, side), generated.contact(0.3, 6, side), 100)


def test_records_are_expanded_as_python_expands_them(compiled):
    model = Metainterface(**{name: LAYERS[name] for name in ("beta0", "damping")})
    ground = Record(np.linspace(0, 5, 40), np.sin(np.linspace(0, 9, 40)), quantity="displacement")
    generated = Interpreted(System(model=model, load=Load(ground_horizontal=ground)))
    machine = as_machine_code(generated, compiled)
    for piece in (3, 20):
        assert close(
            machine.coefficients(0.3, 0.2, 0.1, 8, piece=piece), generated.coefficients(0.3, 0.2, 0.1, 8, piece=piece), 1000
        )


STATEMENTS = """
@jit
def halved(values, k):
    return values[k] / 2


@lowered_jit(SIGNATURE, fused=False)
def f(n, x, values, table):
    total, count = 0.0, 0
    for i in range(n):
        count += i * 2 - 1
        total += values[i] ** 2 + x
    for i in range(1, n):
        for j in range(n - 1, i - 1, -1):
            table[i, j] -= values[max(j - 1, 0)] * -(i + j) / (1 + count)
    if n >= 3 and x < 1.0:
        total = total + (x if total > 2.0 else n)
    if n == 2:
        total = -min(total, x) + max(x, total) * math.inf
    values[0], values[1] = values[1], values[0]
    row = table[1]
    row[0] = halved(values, 1) + row.size + math.hypot(x, 2)
    return total, count + 1
"""


SIGNATURE = """
from numba import types
SIGNATURE = types.UniTuple(types.float64, 2)(
    types.int64, types.float64, types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
)
"""


def test_every_statement_does_what_python_does(compiled):
    scope = {"jit": lambda f: f, "lowered_jit": lambda *_, **__: lambda f: f, "SIGNATURE": None, "math": math}
    exec(STATEMENTS, scope)
    machine = compiled(SIGNATURE + STATEMENTS)
    for n, x in itertools.product([2, 3, 5], [-0.3, 0.5, 1.7]):
        results = []
        for run in (machine.f, scope["f"]):
            values, table = np.arange(1.0, n + 1) / 3, np.arange(n * n, dtype=float).reshape(n, n)
            results.append((run(n, x, values, table), values.tolist(), table.tolist()))
        assert results[0] == results[1]


def test_what_no_generated_text_has_is_refused(compiled):
    with pytest.raises(NotImplementedError, match="while"):
        compiled("@lowered_jit(CONSTANTS)\ndef f(p, c):\n    while p[0] > 1.0:\n        p[0] -= 1.0\n    return\n")


def test_a_range_with_another_step_is_refused(compiled):
    with pytest.raises(AssertionError, match="no step but -1"):
        compiled("@lowered_jit(CONSTANTS)\ndef f(p, c):\n    for i in range(0, 4, 2):\n        c[i] = p[i]\n    return\n")
