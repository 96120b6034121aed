"""XML of strangers: the elements of any document, or one sentence that names it."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.errors import ChefbotError
from chefbot.strict_xml import MAX_DEPTH, MAX_PARTS, parse_xml


class ThingError(ChefbotError):
    """The error of these tests."""


def parse(data: bytes) -> ET.Element:
    return parse_xml(data, "thing.xml", ThingError, "thing")


def refusal(data: bytes) -> str:
    with pytest.raises(ThingError) as caught:
        parse(data)
    sentence = str(caught.value)
    assert sentence.startswith("thing.xml: ") and "\n" not in sentence
    return sentence


NAMES = st.sampled_from(["robot", "link", "a", "b-1", "c.d"])
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["C"]), max_size=6)


@st.composite
def elements(draw: st.DrawFn, depth: int = 2) -> ET.Element:
    element = ET.Element(draw(NAMES), draw(st.dictionaries(NAMES, TEXTS, max_size=3)))
    element.text = draw(TEXTS)
    element.extend(draw(st.lists(elements(depth - 1), max_size=2)) if depth else [])
    return element


def parts(element: ET.Element) -> list[object]:
    return [element.tag, element.attrib, element.text or "", [parts(child) for child in element]]


@settings(max_examples=40)
@given(elements(), st.sampled_from(["utf-8", "utf-16", "us-ascii"]))
def test_a_written_document_reads_back(element: ET.Element, encoding: str) -> None:
    assert parts(parse(ET.tostring(element, encoding=encoding))) == parts(element)


@settings(max_examples=50)
@given(st.one_of(st.binary(max_size=60), st.text("<>/ab='&;!?[]- \n", max_size=40).map(str.encode)))
def test_any_bytes_give_a_document_or_one_sentence(data: bytes) -> None:
    try:
        parse(data)
    except ThingError as error:
        assert str(error).startswith("thing.xml: ")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "is not valid XML"),
        (b"<a>", "is not valid XML"),
        (b"<a></b>", "is not valid XML"),
        (b"<a/><b/>", "is not valid XML"),
        (b"<a x='1' x='2'/>", "is not valid XML"),
        (b"<a>&b;</a>", "is not valid XML"),
        (b"<a>\x00</a>", "is not valid XML"),
        (b"<?xml version='1.0' encoding='none-such'?><a/>", "is not valid XML"),
        (b"<!DOCTYPE a><a/>", "DOCTYPE"),
        (b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "DOCTYPE"),
        (b'<!DOCTYPE a SYSTEM "file:///etc/passwd"><a/>', "DOCTYPE"),
    ],
)
def test_what_is_not_a_plain_document_is_refused(data: bytes, reason: str) -> None:
    assert reason in refusal(data)


def nested(depth: int) -> bytes:
    return b"<a>" * depth + b"</a>" * depth


def test_elements_may_be_nested_up_to_a_bound() -> None:
    assert parse(nested(MAX_DEPTH)).tag == "a"
    sentence = refusal(nested(MAX_DEPTH + 1))
    assert f"nested more than {MAX_DEPTH} deep" in sentence and sentence.endswith("that is not a thing")
    flat = b"<a>" + b"<b></b>" * (2 * MAX_DEPTH) + b"</a>"
    assert len(parse(flat)) == 2 * MAX_DEPTH, "side by side they are not nested"


def test_elements_and_attributes_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_PARTS >= 100_000
    monkeypatch.setattr("chefbot.strict_xml.MAX_PARTS", 6)
    assert len(parse(b"<a x='1' y='2'><b/><b z='3'/></a>")) == 2
    for more in (b"<a x='1' y='2'><b/><b z='3'/><c/></a>", b"<a x='1' y='2'><b w=''/><b z='3'/></a>"):
        assert "more than 6 elements and attributes" in refusal(more)
