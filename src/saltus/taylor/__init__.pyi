from .cache import cache_directory, compiled_part, digest, is_compiled, load_module, module_name, source_of
from .common_form import CommonForm
from .derivatives import FREQUENCY, derivative_along, partial_derivative, tangent_leaves, time_derivative
from .equations import equations_of
from .exact_algebra import Form, NoNormalForm, constant, constant_value, normal_form
from .generated import Case, function_text, generated_header
from .graph import RECORD_WIDTH, Expr, differentiate, is_steep, number, ordered, substitute
from .kernel_functions import cached_jit, inline_jit, jit, lean_jit
from .lane_vectors import (
    ALL,
    absolute,
    bits,
    first_lane,
    fma,
    get,
    lane_count,
    load,
    mask,
    maximum,
    minimum,
    put,
    replace,
    rough_exp2,
    rough_inverse,
    rough_log2,
    rough_root,
    select,
    splat,
    store,
    vector_lane,
    with_lane,
)
from .load_tables import record_table, record_tables
from .memory import Places
from .private_numba import entry_point, pointer, pointers
from .records import anchor, expand_record, own_records
from .rules import FUNCTIONS
from .series import Rows
from .system_structure import structure_key
from .tapes import shared_constants, tape
from .tracing import Trace, check_size, trace
from .vectors import CACHE_LINE, WIDTH

__all__ = [
    "ALL",
    "CACHE_LINE",
    "FREQUENCY",
    "FUNCTIONS",
    "RECORD_WIDTH",
    "WIDTH",
    "Case",
    "CommonForm",
    "Expr",
    "Form",
    "NoNormalForm",
    "Places",
    "Rows",
    "Trace",
    "absolute",
    "anchor",
    "bits",
    "cache_directory",
    "cached_jit",
    "check_size",
    "compiled_part",
    "constant",
    "constant_value",
    "derivative_along",
    "differentiate",
    "digest",
    "entry_point",
    "equations_of",
    "expand_record",
    "first_lane",
    "fma",
    "function_text",
    "generated_header",
    "get",
    "inline_jit",
    "is_compiled",
    "is_steep",
    "jit",
    "lane_count",
    "lean_jit",
    "load",
    "load_module",
    "mask",
    "maximum",
    "minimum",
    "module_name",
    "normal_form",
    "number",
    "ordered",
    "own_records",
    "partial_derivative",
    "pointer",
    "pointers",
    "put",
    "record_table",
    "record_tables",
    "replace",
    "rough_exp2",
    "rough_inverse",
    "rough_log2",
    "rough_root",
    "select",
    "shared_constants",
    "source_of",
    "splat",
    "store",
    "structure_key",
    "substitute",
    "tangent_leaves",
    "tape",
    "time_derivative",
    "trace",
    "vector_lane",
    "with_lane",
]
