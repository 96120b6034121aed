"""Tests that the emergency stop ends autonomous motion and that nothing starts by itself after its release."""

from __future__ import annotations

import pytest
from tests.support.nodes import GOALS, WITHOUT_SENSORS, NodeRunner, StationaryRobot

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, ExplorationStatus
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.safety.emergency_stop import REFUSED


@pytest.mark.parametrize("name", GOALS)
def test_emergency_stop_aborts_the_goal_and_rejects_new_ones(name: str) -> None:
    robot = StationaryRobot()
    robot.send_goal(name)
    robot.run(0.0)
    assert robot.system.nodes["navigator" if name == "navigate_to_pose" else "controller"].__dict__[name].busy
    if name != "navigate_to_pose":  # which has no planner in this test
        assert robot.commands_motion()
    robot.request_stop(True)
    assert len(robot.results(name)) == 1
    assert not robot.commands_motion()
    robot.send_goal(name)
    robot.run(0.0)
    assert robot.results(name)[-1].result.error_msg == REFUSED and robot.results(name)[-1].result.error_code
    robot.request_stop(False)
    assert not robot.commands_motion()
    robot.send_goal(name)
    robot.run(0.0)
    assert len(robot.results(name)) == 2, "after the release a new goal is accepted"


@pytest.mark.parametrize(
    ("stopped", "pressed_at", "continues"), [(True, 5, False), (False, 5, False), (False, 3, True)]
)
def test_an_explorer_restarted_during_emergency_stop_stays_held(
    stopped: bool, pressed_at: int, continues: bool
) -> None:
    status = ExplorationStatus(Header(Time(4)), False)
    stop = EmergencyStopStatus(Header(), stopped, False, Time(pressed_at))
    restored = {"exploration_status": status, "stop_status": stop, "restarted": Empty()}
    runner = NodeRunner({"explorer": "chefbot.nodes.explorer:ExplorerNode"}, restored)
    runner.run(1.0)
    assert bool(runner.messages("spin/_action/send_goal")) == continues
    assert [status.done for status in runner.messages("exploration_status")] == [True] * (not continues)


def test_global_localization_fails_on_emergency_stop() -> None:
    runner = NodeRunner({"localizer": "chefbot.nodes.global_localizer:GlobalLocalizerNode"}, {})
    runner.run(1.0)
    assert runner.messages("spin/_action/send_goal")
    runner.loop.publish("emergency_stop", Bool(True), "base")
    runner.run(60.0)
    assert [localized.data for localized in runner.messages("localized")] == [False]
    assert len(runner.messages("spin/_action/send_goal")) == 1


class Base(NodeRunner):
    """The drive base with a joystick."""

    def __init__(self) -> None:
        super().__init__({"base": "chefbot.nodes.drive_base:DriveBaseNode"}, {}, {"base": WITHOUT_SENSORS})
        self.run(0.0)

    def hold(self, topic: str, v: float, times: int) -> bool:
        """Publish a velocity at 10 Hz and return whether the wheels turn at the end."""
        for _ in range(times):
            self.loop.publish(topic, Twist.of(v, 0.0), "client")
            self.run(0.1)
        return float(self.messages("wheel_speeds")[-1].left) > 0.0

    def request_stop(self, stop: bool) -> None:
        self.loop.publish("stop_request", Bool(stop), "web_ui")
        self.run(0.0)


@pytest.mark.parametrize("topic", ["cmd_vel_teleop", "cmd_vel_nav"])
@pytest.mark.parametrize("release", ["silence", "zero"])
def test_a_held_joystick_does_not_drive_after_emergency_stop(topic: str, release: str) -> None:
    base = Base()
    assert base.hold(topic, 0.2, 5)
    base.request_stop(True)
    assert not base.hold(topic, 0.2, 5)
    base.request_stop(False)
    assert not base.hold(topic, 0.2, 20)
    base.hold(topic, 0.0, 1) if release == "zero" else base.run(0.5)
    assert base.hold(topic, 0.2, 5)
