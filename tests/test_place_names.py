"""Tests of the names of places as people read them."""

import pytest

from chefbot.place_names import display_name, with_labels

LABELS = {"table_1": "Window", "table_12": "窗边 3", "bar": r"Bar \1 (left)"}


@pytest.mark.parametrize(("place", "label", "expected"), [("table_3", "", "table 3"), ("table_3", "A", "A")])
def test_a_label_replaces_the_name(place: str, label: str, expected: str) -> None:
    assert display_name(place, label) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("On the way to table 1.", "On the way to Window."),
        ("table_1, table 12 and table 2", "Window, 窗边 3 and table 2"),
        ("table 1: nobody took the food", "Window: nobody took the food"),
        ("in the bar; a barrel", r"in the Bar \1 (left); a barrel"),
    ],
)
def test_a_sentence_gets_the_labels_of_its_places(text: str, expected: str) -> None:
    assert with_labels(text, LABELS) == expected


def test_without_labels_a_sentence_stays_as_it_is() -> None:
    assert with_labels("table_1 in 3 m", {}) == "table_1 in 3 m"
