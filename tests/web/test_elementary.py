"""The page's own elementary functions against 40 digits, and the modules that LLVM writes."""

from __future__ import annotations

import json
import math
import shutil
import subprocess

import mpmath
import numpy as np
import pytest
from numba import njit

from saltus.errors import SaltusError
from saltus.taylor import compiled_part, elementary
from saltus.web import objects

RNG = np.random.default_rng(5)
NODE = shutil.which("node")
ARGUMENTS = {
    "sin": lambda n: np.concatenate(
        [RNG.uniform(-10, 10, n), RNG.uniform(-1e5, 1e5, n), 10.0 ** RNG.uniform(5, 308, n)]
    ),
    "exp": lambda n: np.concatenate([RNG.uniform(-745, 709.7, n), RNG.uniform(-1, 1, n)]),
    "log": lambda n: np.concatenate([10.0 ** RNG.uniform(-320, 308, n), RNG.uniform(0.5, 2, n)]),
    "sinh": lambda n: np.concatenate([RNG.uniform(-710, 710, n), RNG.uniform(-2, 2, n)]),
    "tanh": lambda n: RNG.uniform(-22, 22, 2 * n),
    "atan": lambda n: np.concatenate([RNG.uniform(-5, 5, n), 10.0 ** RNG.uniform(-5, 20, n)]),
}
ARGUMENTS |= {"cos": ARGUMENTS["sin"], "cosh": ARGUMENTS["sinh"]}
MOST = {"tanh": 2.1}  # units in the last place; a quotient of two of the others


@pytest.fixture(scope="module")
def functions():
    """The functions in plain Python."""
    return vars(elementary)


@pytest.fixture(scope="module")
def compiled():
    """The functions as numba compiles them for this machine, without fused multiply-adds."""
    space = {**vars(elementary), "jit": njit}
    exec(compile(compiled_part(elementary), "elementary", "exec"), space)
    return space


def error(found: float, exact: mpmath.mpf) -> float:
    """The error in units in the last place."""
    return (
        float(abs(mpmath.mpf(found) - exact) / math.ulp(float(abs(exact)))) if exact else abs(found)
    )


def errors_of(functions, name, count):
    function, exact = functions[f"{name}_function"], getattr(mpmath, name)
    with mpmath.workdps(350):
        return max(
            error(function(x), exact(mpmath.mpf(x))) for x in map(float, ARGUMENTS[name](count))
        )


@pytest.mark.parametrize("name", ["sin", "exp", "log"])
def test_elementary_functions_are_good_to_a_unit_in_the_last_place(functions, name):
    assert errors_of(functions, name, 300) < 1.0


@pytest.mark.thorough
@pytest.mark.parametrize("name", list(ARGUMENTS))
def test_elementary_functions_of_100000_arguments(compiled, name):
    assert errors_of(compiled, name, 35_000) < MOST.get(name, 1.0)


@pytest.mark.thorough
def test_powers_are_good_to_a_unit_in_the_last_place(compiled):
    pairs = zip(10.0 ** RNG.uniform(-10, 10, 20_000), RNG.uniform(-30, 30, 20_000), strict=True)
    with mpmath.workdps(60):
        worst = max(
            error(compiled["pow_function"](x, y), mpmath.power(mpmath.mpf(x), mpmath.mpf(y)))
            for x, y in pairs
        )
    assert worst < 1.0


def test_sines_near_their_zeros_keep_all_digits(functions):
    """The double nearest to a multiple of pi / 2 that is hardest to reduce (Kahan), and 355, which
    is near 113 pi.
    """
    hardest = 6381956970095103.0 * 2.0**797
    with mpmath.workdps(400):
        for x in (hardest, 355.0, 1e22):
            assert error(functions["sin_function"](x), mpmath.sin(mpmath.mpf(x))) < 1.0
            assert error(functions["cos_function"](x), mpmath.cos(mpmath.mpf(x))) < 1.0


def test_neighbours_and_powers_of_special_numbers(functions):
    for x, y in [(1.0, 2.0), (-1.0, 2.0), (1.0, 0.0), (5e-324, 0.0), (0.0, -1.0), (2.0, 2.0)]:
        assert functions["nextafter_function"](x, y) == math.nextafter(x, y)
    for x, y in [
        (-8.0, 3.0),
        (math.inf, -1.0),
        (0.5, math.inf),
        (1e300, 1.0),
        (-2.0, 1023.0),
        (5e-324, 0.5),
        (3.0, 0.0),
    ]:
        assert functions["pow_function"](x, y) == math.pow(x, y)
    assert math.isnan(functions["pow_function"](-8.0, 0.5))


TEXT = """
@table = global [2 x i32] [i32 40, i32 2]
declare i32 @other(i32)
define i32 @added(i32 %i) {
  %place = getelementptr i32, ptr @table, i32 %i
  %value = load i32, ptr %place
  %more = call i32 @other(i32 %value)
  ret i32 %more
}
define i32 @through(i32 %pointer, i32 %x) {
  %function = inttoptr i32 %pointer to ptr
  %value = call i32 %function(i32 %x)
  ret i32 %value
}
"""
OTHER = "define i32 @other(i32 %x) {\n  %y = add i32 %x, 7\n  ret i32 %y\n}\n"
NAMES = ["added", "through", "other"]
ROOM = 4096
RUN = """
const code = require("fs").readFileSync(process.argv[1]);
const memory = new WebAssembly.Memory({ initial: 2 });
const table = new WebAssembly.Table({ element: "anyfunc", initial: 8 });
const stack = new WebAssembly.Global({ value: "i32", mutable: true }, 65536);
const env = { __linear_memory: memory, __indirect_function_table: table, __stack_pointer: stack };
WebAssembly.instantiate(code, { env }).then(() => {
  const words = new Uint32Array(memory.buffer, 0, 4);
  const [added, through] = [table.get(words[0]), table.get(words[1])];
  console.log(JSON.stringify([added(0), added(1), through(words[2], 5), words[3]]));
});
"""


@pytest.mark.skipif(NODE is None, reason="node is not installed here")
def test_two_texts_become_one_module(tmp_path):
    """Data, a call from one text to the other, a call through the table, and the end of the data:
    behind four words, the bytes that are left unused, and the two numbers.
    """
    made = tmp_path / "made.wasm"
    made.write_bytes(objects.module([TEXT, OTHER], NAMES, room=ROOM))
    *values, end = json.loads(subprocess.check_output([NODE, "-e", RUN, str(made)]))
    assert values == [47, 9, 12]
    assert 4 * 4 + ROOM + 2 * 4 <= end < 4 * 4 + ROOM + 2 * 4 + 64


def test_a_function_that_is_nowhere_is_named():
    with pytest.raises(SaltusError, match="a page has no function 'other'"):
        objects.module([TEXT], ["added", "through"])
