"""Texts in xacro's expressions: they are as Python makes them, and none grows without bound."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.design.export.xacro_text import (
    DICT_METHODS,
    MAX_FIELDS,
    MAX_STRING,
    MAX_WIDTH,
    TEXT_METHODS,
    RefusedError,
    filled,
    formatted,
)

VALUES = st.one_of(st.integers(-(10**9), 10**9), st.floats(-1e9, 1e9), st.text("abé_", max_size=8))
SPECS = st.text("<>^=+- #0123456789,_.bcdeEfFgGnosxX%é", max_size=7)
TEXTS = st.text("ab_ .1A", max_size=12)


@settings(max_examples=40)
@given(VALUES, SPECS)
def test_a_format_is_pythons_or_refused(value: object, spec: str) -> None:
    try:
        made = formatted(value, spec)
    except RefusedError:
        if not re.search(r"\d{4}|\.\d{3}", spec):  # not too wide
            with pytest.raises(ValueError):
                format(value, spec)
        return
    except (ValueError, OverflowError):
        with pytest.raises((ValueError, OverflowError)):
            format(value, spec)
        return
    assert made == format(value, spec) and len(made) <= 2 * MAX_WIDTH


@pytest.mark.parametrize(
    "spec", ["", ".3f", ">10", "*^30", "+d", "08.3f", "#x", "%", "999", "=+9", "_", ",.2f"]
)
def test_common_formats_are_not_refused(spec: str) -> None:
    for value in (3, 2.5, "text"):
        try:
            expected = format(value, spec)
        except ValueError:
            continue
        assert formatted(value, spec) == expected


@pytest.mark.parametrize("spec", ["1000", "9999d", ".999f", "{}", ">{w}", "%Y", "d d", "!r", "s.__class__"])
def test_wide_and_nested_formats_are_refused(spec: str) -> None:
    with pytest.raises(RefusedError, match="widths have up to three digits"):
        formatted(1, spec)


FORMS = st.lists(
    st.sampled_from(
        ["%d", "%5.2f", "%-8s", "%s", "%%", "x", " ", "%+d", "%08x", "%(a)s", "%", "%1000d", "%*d"]
    ),
    max_size=6,
).map("".join)


@settings(max_examples=40)
@given(FORMS, st.lists(VALUES, max_size=4))
def test_a_percent_form_is_pythons_or_refused(form: str, values: list[Any]) -> None:
    for given_values in (tuple(values), {"a": 1}):
        try:
            made = filled(form, given_values)
        except RefusedError:
            assert "%1000d" in form or "*" in form or form.replace("%%", "").count("%") > 0
            continue
        except (TypeError, ValueError, KeyError) as error:
            with pytest.raises(type(error)):
                form % given_values
            continue
        assert made == form % given_values


def test_fields_are_counted() -> None:
    assert filled("%d" * MAX_FIELDS, (1,) * MAX_FIELDS) == "1" * MAX_FIELDS
    with pytest.raises(RefusedError):
        filled("%d" * (MAX_FIELDS + 1), (1,) * (MAX_FIELDS + 1))
    with pytest.raises(RefusedError, match=f"more than {MAX_FIELDS} fields"):
        TEXT_METHODS["format"]("{}" * (MAX_FIELDS + 1), *range(MAX_FIELDS + 1))


@pytest.mark.parametrize(
    "form",
    [
        "{0.real}",
        "{a.__class__}",
        "{0[0]}",
        "{a[b]}",
        "{0!a}",
        "{:{}}",
        "{:1000}",
        "{:.100f}",
        "{a b}",
        "{1234}",
    ],
)
def test_fields_have_no_attributes_and_no_widths_from_elsewhere(form: str) -> None:
    with pytest.raises(RefusedError):
        TEXT_METHODS["format"](form, 1, 2, a={"b": 3}, b=4)


@pytest.mark.parametrize(
    "form", ["{}-{}", "{1}{0}", "{a!r} {b!s}", "{:>5}|{:.2f}", "{{}} {}", "no field", "{a:^9}"]
)
def test_plain_fields_are_filled_as_python_does(form: str) -> None:
    assert TEXT_METHODS["format"](form, 1.5, 2, a="x", b=4) == form.format(1.5, 2, a="x", b=4)


CALLS: dict[str, tuple[Any, ...]] = {
    "split": (), "rsplit": ("_",), "splitlines": (), "strip": (), "lstrip": ("a",), "rstrip": ("b",), "lower": (),
    "upper": (), "capitalize": (), "title": (), "startswith": ("a",), "endswith": ("b",), "find": ("1",),
    "rfind": ("1",), "count": ("a",), "partition": ("_",), "rpartition": ("_",), "isdigit": (), "isalpha": (),
    "isalnum": (), "removeprefix": ("a",), "removesuffix": ("b",), "replace": ("a", "bb"), "zfill": (9,),
}  # fmt: skip


@settings(max_examples=40)
@given(TEXTS)
def test_methods_of_texts_are_those_of_python(text: str) -> None:
    assert set(TEXT_METHODS) == {*CALLS, "format", "join", "index"}
    for name, arguments in CALLS.items():
        assert TEXT_METHODS[name](text, *arguments) == getattr(text, name)(*arguments)
    assert TEXT_METHODS["join"](text, ["x", "y", "z"]) == text.join(["x", "y", "z"])
    assert TEXT_METHODS["join"](text, (one for one in "xy")) == text.join("xy")


@pytest.mark.parametrize(
    ("name", "given", "length"),
    [
        ("replace", lambda n: ("a" * 100, "a", "b" * (n // 100 - 1)), MAX_STRING),
        ("join", lambda n: ("-" * (n // 100 - 1), ["b"] * 100), MAX_STRING - (MAX_STRING // 100 - 1)),
        ("zfill", lambda n: ("7", n), MAX_STRING),
    ],
)
def test_longer_texts_than_the_bound_are_refused(name: str, given: Any, length: int) -> None:
    made = TEXT_METHODS[name](*given(MAX_STRING))
    assert len(made) <= length and len(made) > 0.9 * MAX_STRING
    with pytest.raises(RefusedError, match=f"longer than {MAX_STRING} characters"):
        TEXT_METHODS[name](*given(MAX_STRING + 200))


def test_an_empty_pattern_is_counted_at_every_place() -> None:
    assert TEXT_METHODS["replace"]("ab", "", "-") == "-a-b-"
    with pytest.raises(RefusedError):
        TEXT_METHODS["replace"]("a" * 1000, "", "b" * 100)


def test_methods_of_dictionaries_return_lists_of_their_own() -> None:
    source = {"a": 1, "b": [2]}
    assert DICT_METHODS["keys"](source) == ["a", "b"] and DICT_METHODS["values"](source) == [1, [2]]
    assert DICT_METHODS["items"](source) == [("a", 1), ("b", [2])]
    assert DICT_METHODS["get"](source, "a") == 1 and DICT_METHODS["get"](source, "c") is None
    assert DICT_METHODS["get"](source, "c", 5) == 5
    DICT_METHODS["keys"](source).append("c")
    assert set(source) == {"a", "b"} and set(DICT_METHODS) == {"keys", "values", "items", "get"}
