"""Tests that changed YAML files keep what a person wrote."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from ruamel.yaml.comments import CommentedMap

from chefbot.config import ConfigError, parse_yaml
from chefbot.storage.commented_yaml import write_section


def written(path: Path, entries: dict[str, dict[str, str]], known: dict[str, dict[str, str]]) -> str:
    as_yaml = {name: CommentedMap(entry) for name, entry in entries.items()}
    before = {name: CommentedMap(entry) for name, entry in known.items()}
    write_section(path, "test file", "things", as_yaml, before, CommentedMap(things=CommentedMap()))
    return path.read_text()


def test_a_new_file_has_the_entries(tmp_path: Path) -> None:
    assert written(tmp_path / "a.yaml", {"a": {"x": "1 m"}}, {}) == "things:\n  a:\n    x: 1 m\n"


def test_comments_and_unchanged_entries_stay_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    head = "# mine\nother: 1\nthings:\n  a: {x: 100 cm}   # the first\n"
    path.write_text(head + "  b: {x: 2 m, y: 1 m, z: 5 cm}\n  c: {x: 3 m}\n")
    known = {"a": {"x": "1 m"}, "b": {"x": "2 m", "y": "1 m", "z": "0.05 m"}, "c": {"x": "3 m"}}
    text = written(path, {"a": {"x": "1 m"}, "b": {"x": "5 m", "z": "0.05 m"}}, known)
    assert text == head + "  b: {x: 5 m, z: 5 cm}\n"


@given(st.text(st.characters(codec="utf-8", exclude_categories=["C"]), max_size=40))
@example("yes")
@example("Off")
@example("1:30")
@example("2026-12-02")
@example("~")
@example("0x1F")
def test_every_text_is_read_as_it_was_written(text: str) -> None:
    with TemporaryDirectory() as folder:
        path, known = Path(folder) / "a.yaml", dict[str, dict[str, str]]()
        for label in (text, "other", text):
            things = {"a": {"label": label}, "b": {"label": text}, "on": {"x": "1 m"}}
            written(path, things, known)
            assert parse_yaml(path.read_bytes(), "file")["things"] == things
            known = things


def test_a_file_that_cannot_be_changed_is_named_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("things:\n  a: {x: 1 m\n")
    with pytest.raises(ConfigError, match=r"test file .*a\.yaml cannot be changed: .* in line"):
        written(path, {}, {})
    assert path.read_text() == "things:\n  a: {x: 1 m\n"
