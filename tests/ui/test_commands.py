"""Tests that commands of the web UI are parsed strictly and invalid ones rejected with a message."""

from __future__ import annotations

import json
import math
from typing import Any

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chefbot.errors import UserError
from chefbot.ui.command_types import OperatorCommand
from chefbot.ui.commands import KINDS, NAMES, Deliver, Drive, Goal, PutZone, parse_command

json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=8) | st.sampled_from(NAMES),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=12,
)
near_commands = st.dictionaries(
    st.sampled_from(["x", "y", "yaw", "v", "w", "name", "tables", "extra"]), json_values, max_size=5
).flatmap(lambda fields: st.sampled_from(NAMES).map(lambda name: {"do": name, **fields}))


def test_every_command_round_trips_through_json() -> None:
    samples: dict[str, Any] = {
        "x": 1.5,
        "y": -2.0,
        "yaw": 3.0,
        "v": 0.5,
        "w": -1.0,
        "name": "kitchen",
        "file": "kitchen",
        "tables": ["table_1"],
        "seen": ["table_1", "table_2"],
        "seen_change": "a-b-b",
        "when": "now",
        "place": "table_1",
        "choice": "go_on",
        "order": "page 1",
        "id": "a-b-c",
        "pressed": "12",
        "n": 7,
        "pin": "2468",
        "places": ["kitchen", "table_1"],
        "layers": ["map", "scan"],
        "rounds": 3,
        "without_stops": True,
        "person": 7,
        "note": "a box",
        "time": 12.5,
        "rate": 2.0,
        "label": "窗边 3",
        "corners": [(0.0, 0.0), (1.0, 0.0), (1.0, 1.5)],
        "speed": 0.2,
        "direction": 1.5,
        "preview": True,
        "moved": False,
        "topics": ["/odom"],
        "nodes": ("/base",),
        "node": "/base",
        "on": True,
        "replace": True,
        "continued": True,
        "strokes": [[(0.0, 0.0), (1.0, 0.5)]],
        "width": 0.1,
        "brush": "wall",
        "other_x": 4.0,
        "other_y": 4.0,
        "angle": 0.5,
        "value": 0.5,
    }
    for kind in KINDS:
        samples["kind"] = "keep_out" if kind is PutZone else "room"
        command = kind(**{field: samples[field] for field in kind.__struct_fields__})
        assert parse_command(msgspec.json.encode(command).decode()) == command


@example('{"do":""')
@given(st.text(max_size=60) | json_values.map(json.dumps) | near_commands.map(json.dumps))
def test_any_text_is_a_bounded_command_or_is_rejected(text: str) -> None:
    try:
        command = parse_command(text)
    except UserError as error:
        assert len(str(error)) < 400
        return
    assert isinstance(command, OperatorCommand)
    numbers = [value for value in msgspec.structs.asdict(command).values() if isinstance(value, float)]
    assert all(math.isfinite(value) and abs(value) <= 10_000 for value in numbers)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ('{"do": "goal", "x": NaN, "y": 0, "yaw": 0}', "not JSON"),
        ('{"do": "goal", "x": 1e999, "y": 0, "yaw": 0}', "goal"),
        ('{"do": "goal", "x": 1e6, "y": 0, "yaw": 0}', "10000"),
        ('{"do": "drive", "v": 1.01, "w": 0}', "at most 1"),
        ('{"do": "drive", "v": 1}', "missing"),
        ('{"do": "stop", "later": true}', "later"),
        ('{"do": "deliver", "tables": []}', "deliver"),
        ('{"do": "go_plaec", "name": "kitchen"}', "go_place"),
        ('{"name": "kitchen"}', "known"),
        ("[" * 60_000, "refused"),
        ('{"do": "goal", "x": ' + "[" * 60_000, "refused"),
        ("", "not JSON"),
    ],
)
def test_an_invalid_command_is_rejected_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        parse_command(text)


def test_plain_commands_parse() -> None:
    assert parse_command('{"do":"goal","x":1,"y":2,"yaw":-3}') == Goal(1.0, 2.0, -3.0)
    assert parse_command('{"do":"deliver","tables":["table_2","table_7"]}') == Deliver(["table_2", "table_7"])
    assert parse_command('{"do":"drive","v":0,"w":0}') == Drive(0.0, 0.0)
    assert Drive(0.0, 0.0).is_zero
    assert not Drive(0.0, 0.1).is_zero
