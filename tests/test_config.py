"""Strict YAML into typed structs: every fault is one sentence that names file and key."""

from typing import Annotated, Any

import msgspec
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.config import MAX_BYTES, ConfigError, build, parse_yaml, read_bytes
from chefbot.errors import name_hint


class Inner(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    length: Annotated[float, msgspec.Meta(gt=0, le=10, extra={"unit": "m"})]
    ratio: float = 1.0


class Outer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    inner: Inner
    name: str = "x"
    count: Annotated[int, msgspec.Meta(ge=1, le=9)] = 1
    short: Annotated[str, msgspec.Meta(pattern="^[a-z]$", extra={"form": "a small letter"})] = "a"
    maybe: Inner | None = None
    many: list[Inner] = []
    by_name: dict[str, Inner] = {}


def parse(text):
    return build(parse_yaml(text.encode(), "file f.yaml"), Outer, "file f.yaml")


def read(path):
    return parse(read_bytes(path, "thing file").decode())


def fault(text):
    with pytest.raises(ConfigError) as caught:
        parse(text)
    sentence = str(caught.value)
    assert sentence.startswith("file f.yaml") and "\n" not in sentence
    return sentence


def test_units_are_parsed_where_expected():
    value = parse(
        "inner: {length: 9 cm}\nmaybe: {length: 1 ft}\nmany: [{length: 2 m}]\nby_name: {a: {length: 5 mm}}"
    )
    lengths = [p.length for p in (value.inner, value.maybe, value.many[0], value.by_name["a"])]
    assert lengths == pytest.approx([0.09, 0.3048, 2.0, 0.005])


@pytest.mark.parametrize(
    ("text", "key", "reason"),
    [
        ("inner: {length: 9}", "inner.length", "no unit"),
        ("inner: {length: 9 kg}", "inner.length", "not a quantity in m"),
        ("inner: {length: 9 parsnips}", "inner.length", "quantity"),
        ("inner: {length: [9 cm]}", "inner.length", "must be a quantity"),
        ("inner: {length: true}", "inner.length", "must be a quantity"),
        ("inner: {length: }", "inner.length", "nothing"),
        ("inner: {length: nan m}", "inner.length", ""),
        ("inner: {length: inf m}", "inner.length", ""),
        ("inner: {length: -1 m}", "inner.length", "-1 m must be above 0 m"),
        ("inner: {length: 1e400 m}", "inner.length", ""),
        ("inner: {length: 11 m}", "inner.length", "11 m must be at most 10 m"),
        ("inner: {length: 1 m, ratio: .nan}", "inner.ratio", "finite"),
        ("inner: {length: 1 m, ratio: -.inf}", "inner.ratio", "finite"),
        ("inner: {length: 1 m, ratio: x}", "inner.ratio", "a number, not a text"),
        ("inner: {lenght: 1 m}", "inner.lenght", "did you mean 'length'"),
        ("inner: {length: 1 m}\nnmae: y", "nmae", "did you mean 'name'"),
        ("inner: {length: 1 m}\n5: y", "5", "unknown key"),
        ("inner: {}", "inner.length", "missing"),
        ("name: y", "inner", "missing"),
        ("inner: 5", "inner", "section"),
        ("inner: {length: 1 m}\nmaybe: 5", "maybe", "section"),
        ("inner: {length: 1 m}\nmany: [{length: 2 s}]", "many[0].length", "quantity in m"),
        ("inner: {length: 1 m}\nby_name: {a: {length: 2 s}}", "by_name.a.length", "quantity in m"),
        ("inner: {length: 1 m}\ncount: 10", "count", "10 must be at most 9"),
        ("inner: {length: 1 m}\ncount: 1.5", "count", "a whole number"),
        ("inner: {length: 1 m}\nname: 5", "name", "a text, not a whole number"),
        ("inner: {length: 1 m}\nname: yes", "name", "a text, not true or false; write it in quotes"),
        ("inner: {length: 1 m}\nname: 2026-12-02", "name", "a text, not a date; write it in quotes"),
        ("inner: {length: 1 m}\nshort: Ä", "short", "'Ä' must be a small letter"),
        ("", "the file", "section"),
        ("- 1", "the file", "section"),
    ],
)
def test_an_error_names_file_key_and_reason(text, key, reason):
    sentence = fault(text)
    assert key in sentence and reason in sentence


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("inner: {length: 1 m}\nname: a\nname: b", "line 3"),
        ("inner: {length: 1 m, length: 2 m}", "'length' is given twice"),
        ("a: &a [1]\nb: *a", "anchors"),
        ("a: &a {x: 1}\nb: {<<: *a}", "anchors"),
        ("inner: {length: 1 m", "line"),
        ("? [a, b]\n: 1", "key"),
        ("a: !!python/object:os.system x", "not valid YAML"),
        ("a\tb: \t- x\n\t", "line"),
        ("[" * 100_000, "nested"),
        ("a: " + "9" * 10_000, "impossible number"),
        ("a: 2020-13-45", "not valid YAML"),
        ("a: !!timestamp x", "not valid YAML"),
        ("a: !!bool x", "not valid YAML"),
        ("a: !!int ''", "not valid YAML"),
        ("a: !!binary '\xe4'", "not valid YAML"),
        ("a: !!pairs x", "not valid YAML"),
        ("a: !!set [b]", "not valid YAML"),
        ("%YAML 9.9\n---\na: 1", ""),
        ("--- 1\n--- 2", "document"),
    ],
)
def test_yaml_aliases_and_tags_are_refused(text, reason):
    assert reason in fault(text)


def test_nested_yaml_aliases_do_not_expand():
    levels = ["a0: &a0 [x]"] + [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 8)]
    assert "anchors" in fault("\n".join(levels))


def test_configuration_files_load_or_are_refused(tmp_path):
    good = tmp_path / "f.yaml"
    good.write_text("inner: {length: 1 m}")
    assert read(good).inner.length == 1.0
    for name, reason in (("missing", "does not exist"), ("", "cannot be read"), ("a\0b", "cannot be read")):
        with pytest.raises(ConfigError, match=reason) as caught:
            read(tmp_path / name)
        assert str(caught.value).startswith("thing file")
    (tmp_path / "huge").write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(ConfigError, match="longer"):
        read_bytes(tmp_path / "huge", "thing file")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="UTF-8"):
        parse_yaml(read_bytes(tmp_path / "bytes", "thing file"), "thing file")


@settings(max_examples=200)
@given(st.text(max_size=60))
def test_any_text_gives_plain_data_or_one_sentence(text):
    try:
        parse_yaml(text.encode("utf-8", "surrogatepass"), "f")
    except ConfigError as error:
        assert str(error).startswith("f")


plain: st.SearchStrategy[Any] = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["inner", "length", "ratio", "name", "many", "by_name", "maybe", "count"])
            | st.integers()
            | st.none(),
            inner,
            max_size=4,
        )
    ),
    max_leaves=8,
)


@settings(max_examples=300)
@given(plain)
@pytest.mark.slow
def test_any_plain_data_gives_a_value_or_one_sentence(value):
    for data in (value, {"inner": value}, {"inner": {"length": "1 m"}, "many": value, "by_name": value}):
        try:
            result = build(data, Outer, "f")
        except ConfigError as error:
            assert str(error).startswith("f")
        else:
            assert 0 < result.inner.length <= 10
            assert parse(yaml.safe_dump({"inner": {"length": "1 m"}}))


def test_only_the_nearest_few_names_are_suggested() -> None:
    topics = [f"/robot1/topic_{n}" for n in range(40)] + ["/scan"]
    hint = name_hint("/qqq/zzz", topics)
    assert hint.startswith(" (of 41, the nearest: ") and hint.count(",") == 5
    assert name_hint("zzz", ["a", "b"]) == " (known: a, b)"
