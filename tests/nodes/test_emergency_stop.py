"""STOP ends whatever drives by itself; nothing that was wanted before or during it begins when it is released."""

from __future__ import annotations

import pytest
from tests.support.nodes import ORDERS, Life, Robot

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, ExplorationStatus
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.safety.emergency_stop import REFUSED


@pytest.mark.parametrize("name", ORDERS)
def test_emergency_stop_aborts_the_goal_and_refuses_new_ones(name: str) -> None:
    robot = Robot()
    robot.order(name)
    robot.run(0.0)
    assert robot.system.nodes["navigator" if name == "navigate_to_pose" else "controller"].__dict__[name].busy
    if name != "navigate_to_pose":  # there is no planner here
        assert robot.wants()
    robot.press(True)
    assert len(robot.outcomes(name)) == 1
    assert not robot.wants()
    robot.order(name)
    robot.run(0.0)
    assert robot.outcomes(name)[-1].result.error_msg == REFUSED and robot.outcomes(name)[-1].result.error_code
    robot.press(False)
    assert not robot.wants()
    robot.order(name)
    robot.run(0.0)
    assert len(robot.outcomes(name)) == 2, "after the release a new order counts"


@pytest.mark.parametrize(
    ("stopped", "pressed_at", "goes_on"), [(True, 5, False), (False, 5, False), (False, 3, True)]
)
def test_an_explorer_restarted_during_emergency_stop_stays_held(
    stopped: bool, pressed_at: int, goes_on: bool
) -> None:
    told = ExplorationStatus(Header(Time(4)), False)
    stop = EmergencyStopStatus(Header(), stopped, Time(pressed_at))
    words = {"exploration_status": told, "stop_status": stop, "restarted": Empty()}
    life = Life({"explorer": "chefbot.nodes.explorer:ExplorerNode"}, words)
    life.run(1.0)
    assert bool(life.heard("spin/_action/send_goal")) == goes_on
    assert [one.done for one in life.heard("exploration_status")] == [True] * (not goes_on)


def test_global_localization_fails_on_emergency_stop() -> None:
    life = Life({"finder": "chefbot.nodes.global_localizer:GlobalLocalizerNode"}, {})
    life.run(1.0)
    assert life.heard("spin/_action/send_goal")
    life.loop.publish("emergency_stop", Bool(True), "base")
    life.run(60.0)
    assert [one.data for one in life.heard("localized")] == [False]
    assert len(life.heard("spin/_action/send_goal")) == 1


class Base(Life):
    """The gate alone, and a stick that is held at some rate."""

    def __init__(self) -> None:
        super().__init__({"base": "chefbot.nodes.drive_base:DriveBaseNode"}, {})
        self.run(0.0)

    def hold(self, topic: str, v: float, times: int) -> bool:
        """Whether the wheels turned at the end."""
        for _ in range(times):
            self.loop.publish(topic, Twist.of(v, 0.0), "somebody")
            self.run(0.1)
        return float(self.heard("wheel_speeds")[-1].left) > 0.0

    def ask(self, press: bool) -> None:
        self.loop.publish("stop_request", Bool(press), "page")
        self.run(0.0)


@pytest.mark.parametrize("topic", ["cmd_vel_teleop", "cmd_vel_nav"])
@pytest.mark.parametrize("let_go", ["silence", "zero"])
def test_a_held_stick_does_not_drive_after_emergency_stop(topic: str, let_go: str) -> None:
    base = Base()
    assert base.hold(topic, 0.2, 5)
    base.ask(True)
    assert not base.hold(topic, 0.2, 5)
    base.ask(False)
    assert not base.hold(topic, 0.2, 20)
    base.hold(topic, 0.0, 1) if let_go == "zero" else base.run(0.5)
    assert base.hold(topic, 0.2, 5)
