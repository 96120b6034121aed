"""The emergency stop of the drive base: who presses and releases it, what it publishes, and what a restart keeps."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.base_bench import TICK, BaseBench

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.safety.command_multiplexer import CommandSource
from chefbot.safety.stop_latch import (
    BOARD_BACK,
    BOARD_LOST,
    ESTOP_RESTORED,
    ESTOP_STATE_UNKNOWN,
    PRESSED,
    PRESSED_BY_TOPIC,
    RELEASED,
)

BEFORE = EmergencyStopStatus(Header(), True, False, Time(3), "before")


def bench(**restored: Any) -> BaseBench:
    return BaseBench(sensors=False, restored=restored)


def driving(**restored: Any) -> BaseBench:
    base = bench(**restored)
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed > 0.25
    return base


def states(base: BaseBench) -> list[bool]:
    return [message.data for message in base.messages("emergency_stop")]


def sentences(base: BaseBench) -> list[str]:
    return [status.description for status in base.messages("stop_status")]


def test_at_the_start_the_state_is_published_once() -> None:
    base = bench()
    base.run(TICK)
    assert states(base) == [False]
    base.run(1.0)
    assert states(base) == [False] and [one.active for one in base.messages("stop_status")] == [False]


def test_a_request_stops_the_wheels_at_once_and_holds() -> None:
    base = driving()
    base.send("stop_request", Bool(True))
    assert base.speed == 0.0 and states(base) == [False, True] and sentences(base)[-1] == PRESSED
    base.send("stop_request", Bool(True))
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed == 0.0 and states(base) == [False, True]
    base.send("stop_request", Bool(False))
    assert states(base) == [False, True, False] and sentences(base)[-1] == RELEASED
    base.run(1.0)
    assert base.speed == 0.0, "no command resumes"
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed > 0.25
    assert base.texts("base/notice") == []


def test_a_stop_of_another_node_counts_and_its_release_does_not() -> None:
    base = driving()
    base.send("emergency_stop", Bool(True))
    assert base.speed == 0.0 and sentences(base)[-1] == PRESSED_BY_TOPIC
    base.run(TICK)
    base.send("emergency_stop", Bool(False))
    assert base.messages("stop_status")[-1].active and states(base)[-1] is True, (
        "it reports again that it is pressed"
    )
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed == 0.0


def test_its_own_message_is_not_taken_for_a_foreign_one() -> None:
    """Release and press quickly follow each other: the base receives its own messages of both."""
    base = driving()
    for pressed in (True, False, True, False):
        base.loop.publish("stop_request", Bool(pressed), "page")
    base.run(0.0)
    assert not base.messages("stop_status")[-1].active and sentences(base)[-1] == RELEASED
    base.run(TICK)
    base.send("emergency_stop", Bool(True))
    assert sentences(base)[-1] == PRESSED_BY_TOPIC


def test_a_foreign_stop_counts_straight_after_own_messages() -> None:
    """Before the next command is due: the own messages have arrived, so this one is not among them."""
    base = driving()
    for pressed in (True, False):
        base.send("stop_request", Bool(pressed))
    base.send("emergency_stop", Bool(True))
    assert base.messages("stop_status")[-1].active and sentences(base)[-1] == PRESSED_BY_TOPIC


def test_a_lost_own_message_hides_no_foreign_stop() -> None:
    """What has not come back until the next command is due does not come any more."""
    base = driving()
    base.node._own_stops.append(True)
    base.run(TICK, "cmd_vel_nav", 0.3)
    base.send("emergency_stop", Bool(True))
    assert base.speed == 0.0 and sentences(base)[-1] == PRESSED_BY_TOPIC


def test_foreign_release_straight_after_own_press_is_overridden() -> None:
    base = driving()
    base.send("stop_request", Bool(True))
    base.run(TICK)
    count = len(states(base))
    base.send("emergency_stop", Bool(False))
    assert states(base)[count:] == [False, True]


def test_the_state_of_before_a_restart_holds() -> None:
    base = bench(stop_status=BEFORE, restarted=Empty())
    base.run(1.0, "cmd_vel_nav", 0.3)
    (status,) = base.messages("stop_status")
    assert status.active and status.pressed_at.sec == 3 and status.description == ESTOP_RESTORED
    assert base.speed == 0.0 and base.texts("base/notice") == [ESTOP_RESTORED] and states(base) == [True]


def test_a_restart_without_a_stop_drives_on() -> None:
    released = EmergencyStopStatus(Header(), False, False, Time(3), "before")
    base = driving(stop_status=released, restarted=Empty())
    assert states(base) == [False] and base.messages("stop_status")[0].pressed_at.sec == 3


def test_a_restart_that_lost_the_state_is_a_stop() -> None:
    base = bench(restarted=Empty())
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed == 0.0 and base.texts("base/notice") == [ESTOP_STATE_UNKNOWN]
    assert [status.active for status in base.messages("stop_status")] == [True]


def test_a_lost_board_holds_the_robot_until_it_is_back() -> None:
    base = driving()
    base.send("board_connected", Bool(True))
    assert base.speed > 0.25, "as at every start"
    base.send("board_connected", Bool(False))
    assert base.speed == 0.0 and sentences(base)[-1] == BOARD_LOST
    base.send("stop_request", Bool(False))
    assert base.messages("stop_status")[-1].active
    base.send("board_connected", Bool(True))
    assert sentences(base)[-1] == BOARD_BACK and states(base)[-1] is False
    assert base.texts("base/notice") == [BOARD_LOST, BOARD_LOST, BOARD_BACK]
    base.run(1.0)
    assert base.speed == 0.0
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed > 0.25


@pytest.mark.parametrize("topic", ["cmd_vel_teleop", "cmd_vel_nav"])
def test_a_command_during_a_stop_does_not_count_later(topic: str) -> None:
    base = bench()
    base.send("stop_request", Bool(True))
    base.twist(topic, 0.3)
    base.send("stop_request", Bool(False))
    base.run(0.5)
    assert base.speed == 0.0


@pytest.mark.parametrize("topic", ["cmd_vel_teleop", "cmd_vel_nav"])
def test_a_command_before_a_stop_does_not_resume(topic: str) -> None:
    """However short the stop was: the command would still be young."""
    base = bench()
    base.run(1.0, topic, 0.3)
    base.send("stop_request", Bool(True))
    base.send("stop_request", Bool(False))
    for _ in range(4):
        base.run(TICK)
        assert base.twist_out == (0.0, 0.0)


def test_during_a_stop_no_command_reaches_the_wheels() -> None:
    """Commands are refused where they come in; one that were accepted all the same would not count either."""
    base = bench()
    base.send("stop_request", Bool(True))
    base.node._commands.accept(CommandSource.TELEOP, 0.3, 0.5, base.loop.now_ns, stopped=False)
    base.run(0.2)
    assert base.twist_out == (0.0, 0.0)


def test_a_late_joining_subscriber_receives_the_state() -> None:
    """A web UI that is opened while the robot stands gets the stop, its cause and the reason at once."""
    base = bench()
    base.send("stop_request", Bool(True))
    base.run(1.0)
    latched = {one.topic: one.message for one in base.loop.latched()}
    assert latched["emergency_stop"].data and latched["stop_status"].description == PRESSED
    driven = BaseBench()
    driven.run(1.0, "cmd_vel_nav", 0.3)
    latched = {one.topic: one.message for one in driven.loop.latched()}
    assert latched["base/stop_reason"].data == driven.texts("base/stop_reason")[-1]
    assert latched["collision_monitor/reason"].data == driven.texts("collision_monitor/reason")[-1]
