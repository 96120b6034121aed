"""The YAML loader for files of strangers: plain data as PyYAML has it, and refusals, with libyaml and without."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.strict_yaml import MAX_DIGITS, MAX_NODES, MAX_TAG_LINES, _PythonLoader, load_strict


def load_in_python(text: str) -> Any:
    """Load as where PyYAML has no libyaml."""
    return yaml.load(text, Loader=_PythonLoader)


both = pytest.mark.parametrize("load", [load_strict, load_in_python])
Load = Callable[[str], Any]
PLAIN: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)


@both
@settings(max_examples=40)
@given(value=PLAIN)
def test_plain_data_reads_back(load: Load, value: object) -> None:
    assert load(yaml.safe_dump(value)) == value


@both
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a: 1\na: 2", "'a' is given twice"),
        ("x: {a: 1, b: {c: 1, c: 2}}", "'c' is given twice"),
        ("- {1: a, 1: b}", "1 is given twice"),
        ("a: &b 1\nc: *b", "anchors are not allowed"),
        ("a: &b {c: 1}\nd: {<<: *b}", "anchors are not allowed"),
        ("&a [*a]", "anchors are not allowed"),
        ("? [a, b]\n: 1", "a key is not a name"),
        ("? {a: 1}\n: 1", "a key is not a name"),
        ("? !!null ''\n: 1", "a key is not a name"),
        ("a: !!python/object/apply:os.getcwd []", "could not determine a constructor"),
        ("a: !thing 1", "could not determine a constructor"),
    ],
)
def test_what_is_not_plain_data_is_refused(load: Load, text: str, reason: str) -> None:
    with pytest.raises(yaml.MarkedYAMLError) as caught:
        load(text)
    assert reason in str(caught.value.problem)
    assert caught.value.problem_mark is not None, "so that the line can be named"


@both
def test_the_same_key_may_be_in_two_mappings(load: Load) -> None:
    assert load("a: {c: 1}\nb: {c: 2}\nc: 3") == {"a": {"c": 1}, "b": {"c": 2}, "c": 3}


@both
@pytest.mark.parametrize("digit", ["9", "0b1", "0x1"])
def test_numbers_have_a_limited_length(load: Load, digit: str) -> None:
    longest = digit + "1" * (MAX_DIGITS - len(digit))
    assert load(f"a: {longest}")["a"] == int(longest, 0)
    with pytest.raises(yaml.YAMLError, match=f"an impossible number of {MAX_DIGITS + 1} characters"):
        load(f"a: {longest}1")


@both
@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("1.5", f"1{'0' * MAX_DIGITS}.5"),
        ("1.0e+5", f"1.{'0' * MAX_DIGITS}e+5"),
        ("1:59", f"1{':59' * MAX_DIGITS}"),
        ("1:59.5", f"1{':59' * MAX_DIGITS}.5"),
    ],
)
def test_the_length_counts_for_every_form_of_a_number(load: Load, short: str, long: str) -> None:
    assert isinstance(load(f"a: {short}")["a"], int | float)
    with pytest.raises(yaml.YAMLError, match=f"an impossible number of {len(long)} characters"):
        load(f"a: {long}")


def test_keys_and_values_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_NODES >= 50_000
    monkeypatch.setattr("chefbot.strict_yaml.MAX_NODES", 7)
    assert load_strict("a: 1\nb: [2, 3]") == {"a": 1, "b": [2, 3]}  # the mapping, two keys, and four values
    for load in (load_strict, load_in_python):
        with pytest.raises(yaml.YAMLError, match="more than 7 keys and values"):
            load("a: 1\nb: [2, 3, 4]")


def test_few_tag_directives_are_read_and_many_are_refused() -> None:
    lines = [f"%TAG !{k}! tag:example.org,2000:" for k in range(MAX_TAG_LINES + 1)]
    assert load_strict("\n".join(lines[:-1]) + "\n---\na: 1") == {"a": 1}
    with pytest.raises(yaml.YAMLError, match=f"more than {MAX_TAG_LINES} %TAG directives"):
        load_strict("\n".join(lines) + "\n---\na: 1")
