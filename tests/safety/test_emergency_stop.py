"""What autonomous motions query of the emergency stop: whether it is pressed, and whether it was since a time."""

from __future__ import annotations

import pytest

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Bool, Header
from chefbot.safety.emergency_stop import is_pressed, pressed_since


def test_it_is_pressed_from_its_first_message_on() -> None:
    assert is_pressed(None) is False
    assert is_pressed(Bool(True)) is True and is_pressed(Bool(False)) is False


@pytest.mark.parametrize(
    ("active", "pressed_s", "since"), [(True, 3, True), (False, 5, True), (False, 4, False)]
)
def test_a_press_counts_although_it_was_released(active: bool, pressed_s: int, since: bool) -> None:
    """A goal of second 4 does not go on after a stop that is active, or was pressed later."""
    status = EmergencyStopStatus(Header(), active, False, Time(pressed_s), "")
    assert pressed_since(status, 4_000_000_000) is since
    assert pressed_since(None, 0) is False
