"""Every key of a TOML text is found at its line."""

import tomllib

import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from saltus.config.source import key_lines

TEXT = '''# comment with a = [
"a b" = 1
[x.y]   # header
'k=1' = """two
lines = { z = 1 }""" # a = 2
c.d = { e = "}", f = [1, { g = 2 }] }
list = [
  1, # one
  "],",
  { h = 3 },
]
[[rows]]
p = 1979-05-27 07:32:00
[[rows]]
p = 'a # "b'
[rows.q]
r = 1
'''


def test_lines_of_a_text_with_everything():
    lines = key_lines(TEXT)
    expected = {
        ("a b",): 2,
        ("x",): 3,
        ("x", "y"): 3,
        ("x", "y", "k=1"): 4,
        ("x", "y", "c", "d"): 6,
        ("x", "y", "c", "d", "f", "1", "g"): 6,
        ("x", "y", "list"): 7,
        ("x", "y", "list", "1"): 9,
        ("x", "y", "list", "2", "h"): 10,
        ("rows", "0", "p"): 13,
        ("rows", "1", "p"): 15,
        ("rows", "1", "q", "r"): 17,
    }
    assert {keys: lines[keys] for keys in expected} == expected
    assert set(lines) == set(_paths(tomllib.loads(TEXT)))


def _paths(node, keys=()):
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*keys, str(key))
        yield from _paths(value, (*keys, str(key)))


NAMES = st.text(max_size=6)
LEAVES = st.one_of(st.booleans(), st.integers(-(10**9), 10**9), st.floats(), st.text(max_size=12), st.dates(), st.datetimes())
TABLES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3), max_leaves=12
)


@settings(deadline=None, max_examples=150)
@given(st.dictionaries(NAMES, TABLES, max_size=4))
def test_no_key_of_any_document_is_missed_or_invented(tables):
    text = tomli_w.dumps(tables, multiline_strings=True)
    text = text.replace("\r\n", "\n")  # as a file is read
    lines = key_lines(text)
    assert set(lines) == set(_paths(tomllib.loads(text)))
    assert all(1 <= line <= text.count("\n") + 1 for line in lines.values())
