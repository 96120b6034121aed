"""Values change in a robot file's text; all else stays as the person wrote it."""

from __future__ import annotations

import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from chefbot.design.sizing.robot_file_editor import Change, changed, headed, value_of
from chefbot.robot.load import built_in_robots, find_robot

TEXT = """# A robot.
name: one

body:
  payload: 2 kg     # of food
  radius: 15 cm
plates:
  notch: {length: 10 cm, depth: 25 mm}   # open

# What drives it.
motor:
  title: a motor    # of mine
  voltage: 12 V

  stall_torque: 1 N m

# Behind.
drive:
  max_speed: 0.35 m/s"""


def test_only_the_value_and_its_comment_change() -> None:
    new = changed(TEXT, [Change(("body", "payload"), "6 kg", "asked for")])
    differing = [
        (a, b) for a, b in zip(TEXT.splitlines(), new.splitlines(), strict=True) if a != b
    ]  # fmt: skip
    assert differing == [("  payload: 2 kg     # of food", "  payload: 6 kg               # asked for")]


def test_a_value_in_braces_keeps_the_braces() -> None:
    new = changed(TEXT, [Change(("plates", "notch", "length"), "160 mm", "why")])
    assert re.search(r"\n  notch: {length: 160 mm, depth: 25 mm} +# open\n", new)


def test_a_section_becomes_a_name_and_its_neighbours_stay() -> None:
    new = changed(TEXT, [Change(("motor",), "pololu_37d_70", "chosen")])
    assert "\n# What drives it.\nmotor: pololu_37d_70          # chosen\n\n# Behind.\ndrive:\n" in new
    assert "stall_torque" not in new


def test_the_last_line_may_lack_its_newline() -> None:
    assert changed(TEXT, [Change(("drive", "max_speed"), "1 m/s")]).endswith("\n  max_speed: 1 m/s\n")


def test_a_comment_at_the_end_stays_above_a_new_section() -> None:
    new = changed(TEXT + "\n# The end.", [Change(("driver",), "l298n", "chosen")])
    assert new.endswith("max_speed: 0.35 m/s\n# The end.\n\ndriver: l298n                 # chosen\n")


@pytest.mark.parametrize("name", built_in_robots())
def test_a_robot_file_keeps_every_other_line(name: str) -> None:
    text = find_robot(name).read_text()
    new = changed(text, [Change(("body", "payload"), "1.25 kg")])
    kept = [line for line in text.splitlines() if line and "payload:" not in line]
    assert [line for line in new.splitlines() if line in kept] == kept


def test_the_heading_is_replaced() -> None:
    assert headed(TEXT, ["B.", "C."]).startswith("# B.\n# C.\nname: one\n")


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("body", "clearance"), "  radius: 15 cm\n  clearance: 3 cm             # why\nplates:"),
        (("plates", "notch", "corner"), "{length: 10 cm, depth: 25 mm, corner: 3 cm} # open\n"),
        (("plates", "material"), "# open\n  material: 3 cm              # why\n\n# What drives it."),
        (("wheels", "diameter"), "max_speed: 0.35 m/s\n\nwheels:\n  diameter: 3 cm              # why\n"),
        (("driver",), "max_speed: 0.35 m/s\n\ndriver: 3 cm                  # why\n"),
    ],
)
def test_a_missing_key_is_added(path: tuple[str, ...], line: str) -> None:
    new = changed(TEXT, [Change(path, "3 cm", "why")])
    assert line in new
    assert value_of(TEXT, path) is None
    assert value_of(new, path) == "3 cm"


PATHS = [
    ("wheels", "width"),
    ("body", "clearance"),
    ("plates", "notch", "corner"),
    ("body", "payload"),
    ("body", "radius"),
    ("plates", "notch", "depth"),
    ("motor", "voltage"),
    ("drive", "max_speed"),
]


@given(st.lists(st.tuples(st.sampled_from(PATHS), st.integers(1, 999)), max_size=8))
def test_the_text_parses_to_the_changed_values(changes: list[tuple[tuple[str, ...], int]]) -> None:
    wanted = yaml.safe_load(TEXT)
    for path, number in changes:
        section = wanted
        for key in path[:-1]:
            section = section.setdefault(key, {})
        section[path[-1]] = f"{number} mm"
    new = changed(TEXT, [Change(path, f"{number} mm", "so") for path, number in changes])
    assert yaml.safe_load(new) == wanted
