"""Messages of msgspec's validation in plain English: whatever a file may have in the place of another value."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from chefbot.validation_text import validation_text

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda part: st.lists(part, max_size=4) | st.dictionaries(st.text(max_size=3), part, max_size=3),
    max_leaves=6,
)


class Content(msgspec.Struct, forbid_unknown_fields=True):
    whole: int = 0
    number: float = 0.0
    switch: bool = False
    name: Annotated[str, Meta(pattern="^[a-z]+$")] = "a"
    title: Annotated[str, Meta(min_length=1)] = "a"
    parts: Annotated[list[int], Meta(min_length=2)] | None = None
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind: Literal["x", "y"] = "x"
    count: Annotated[int, Meta(ge=3)] = 3
    rates: dict[str, float] | None = None
    given: str | float = ""


class Needed(msgspec.Struct):
    port: str


def text_of(kind: type, content: Any) -> str:
    """Return the sentence for content that does not fit."""
    with pytest.raises(msgspec.ValidationError) as error:
        msgspec.convert(content, kind, strict=True)
    return validation_text(str(error.value).partition(" - at `$")[0])


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("whole", "many", "must be a whole number, not a text"),
        ("whole", 1.5, "must be a whole number, not a decimal number"),
        ("number", None, "must be a number, not empty"),
        ("switch", 1, "must be true or false, not a whole number"),
        ("name", "A 1", "must be a text of the form ^[a-z]+$"),
        ("title", "", "must have at least 1 characters"),
        ("parts", [1], "must have at least 2 entries"),
        ("parts", "a", "must be a list or empty, not a text"),
        ("pose", [1, 2], "must have 3 entries, not 2"),
        ("kind", "z", "unknown value 'z'"),
        ("count", 1, "must be at least 3"),
        ("rates", [1], "must be a section with keys or empty, not a list"),
        ("given", [1], "must be a number or a text, not a list"),
    ],
)
def test_a_value_that_does_not_fit_is_explained(key: str, value: Any, sentence: str) -> None:
    assert text_of(Content, {key: value}) == sentence


def test_a_missing_key_is_named() -> None:
    assert text_of(Needed, {}) == "the key 'port' is missing"


@given(st.sampled_from(Content.__struct_fields__), VALUES)
def test_no_message_shows_a_type_of_python(key: str, value: Any) -> None:
    try:
        msgspec.convert({key: value}, Content, strict=True)
    except msgspec.ValidationError as error:
        text = validation_text(str(error).partition(" - at `$")[0])
        assert "`" not in text and "Expected" not in text


def test_another_message_stays() -> None:
    assert (
        validation_text("JSON is malformed: trailing characters") == "JSON is malformed: trailing characters"
    )
