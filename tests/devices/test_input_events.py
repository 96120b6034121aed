"""Input events of Linux: decoding, ranges of axes, and which devices are gamepads."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.gamepad_teleop import GamepadEvent
from chefbot.devices.input_events import (
    ABS,
    EVENT,
    KEY,
    LONG_BITS,
    SYN,
    SYN_DROPPED,
    SYN_REPORT,
    AxisRange,
    DeviceState,
    EventDecoder,
    axis_names,
    find_gamepads,
)

STICK = AxisRange(0, 255, 15)


def record(kind: int, code: int, value: int) -> bytes:
    return EVENT.pack(0, 0, kind, code, value)


@given(st.binary(max_size=200), st.integers(1, 29))
def test_any_byte_stream_decodes_to_bounded_events(data: bytes, piece: int) -> None:
    whole = EventDecoder({}).decode(data)
    decoder, pieces = EventDecoder({}), list[GamepadEvent]()
    for at in range(0, len(data), piece):
        pieces += decoder.decode(data[at : at + piece])
    assert pieces == whole
    assert all(-1.0 <= event.value <= 1.0 for event in whole)


@given(
    st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1), st.integers(0, 1000), st.integers()
)
def test_a_position_is_within_its_range(minimum: int, maximum: int, flat: int, value: int) -> None:
    axis = AxisRange(minimum, maximum, flat)
    assert -1.0 <= axis.position(value) <= 1.0


@pytest.mark.parametrize(
    ("axis", "value", "position"),
    [
        (AxisRange(), 0, 0.0),
        (AxisRange(), -1, 0.0),
        (AxisRange(), -32768, -1.0),
        (AxisRange(), 32767, 1.0),
        (STICK, 127, 0.0),
        (STICK, 140, 0.0),
        (STICK, 255, 1.0),
        (STICK, 0, -1.0),
        (AxisRange(-1, 1), -1, -1.0),
        (AxisRange(5, 5), 5, 0.0),
    ],
)
def test_positions_of_common_axes(axis: AxisRange, value: int, position: float) -> None:
    assert axis.position(value) == pytest.approx(position, abs=1e-4)


def test_buttons_and_axes_have_the_names_of_their_meaning() -> None:
    data = record(KEY, 0x136, 1) + record(ABS, 0x01, 0) + record(KEY, 0x220, 1) + record(KEY, 0x2C0, 1)
    assert EventDecoder({0x01: STICK}).decode(data) == [
        GamepadEvent("button", "left_shoulder", 1.0),
        GamepadEvent("axis", "left_y", -1.0),
        GamepadEvent("axis", "dpad_y", -1.0),
        GamepadEvent("button", "704", 1.0),
    ]


def test_the_right_stick_of_both_kinds_of_gamepads() -> None:
    assert axis_names([0, 1, 2, 3, 4, 5])[0x03] == "right_x" and 0x05 not in axis_names([0, 1, 2, 3, 4, 5])
    assert axis_names([0, 1, 2, 5])[0x05] == "right_y"


def test_events_of_a_lost_report_are_left_out() -> None:
    decoder = EventDecoder({})
    data = record(SYN, SYN_DROPPED, 0) + record(KEY, 0x136, 1)
    assert decoder.decode(data) == [] and not decoder.lost
    assert decoder.decode(record(SYN, SYN_REPORT, 0) + record(KEY, 0x131, 1)) == [
        GamepadEvent("button", "east", 1.0)
    ]
    assert decoder.lost


def test_the_state_of_a_device_is_initial() -> None:
    state = DeviceState(frozenset([0x136]), {0x01: 255}, {0x01: STICK})
    events = EventDecoder(state.ranges).events_of(state)
    assert GamepadEvent("button", "left_shoulder", 1.0, True) in events
    assert GamepadEvent("button", "east", 0.0, True) in events
    assert events[-1] == GamepadEvent("axis", "left_y", 1.0, True)
    assert EventDecoder({}).events_of(DeviceState(frozenset(), {}, {})) == []


def test_only_devices_with_gamepad_buttons_are_gamepads(tmp_path: Path) -> None:
    def connect(name: str, *codes: int) -> None:
        path = tmp_path / name / "device" / "capabilities"
        path.mkdir(parents=True)
        bits = sum(1 << code for code in codes)
        longs = [bits >> LONG_BITS * i & (1 << LONG_BITS) - 1 for i in range(768 // LONG_BITS)]
        while len(longs) > 1 and not longs[-1]:
            longs.pop()
        (path / "key").write_text(" ".join(f"{word:x}" for word in reversed(longs)) + "\n")

    connect("event0", 1, 30, 57)  # a keyboard
    connect("event11", 0x130, 0x131, 0x136)
    connect("event2", 0x130)
    connect("event3", 0x120, 0x121)  # a joystick
    (tmp_path / "event4").mkdir()  # unplugged while it is looked for
    assert find_gamepads(tmp_path) == ["/dev/input/event2", "/dev/input/event11"]
    assert find_gamepads(tmp_path / "none") == []
