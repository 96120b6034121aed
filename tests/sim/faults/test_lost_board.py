"""A board that is unplugged and back: nothing resumes by itself, and a new goal is accepted without Release STOP."""

from __future__ import annotations

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import EmergencyStopStatus, NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.safety.stop_latch import BOARD_BACK, BOARD_LOST
from chefbot.sim.faults.events import BoardUnplugged
from chefbot.sim.faults.node_faults import inject

SECOND = 1_000_000_000
LOST_S, BACK_S, NEW_GOAL_S, END_S = 5.0, 10.0, 12.0, 24.0
ARGUMENTS = {"headless": "true", "people": "0", "pictures": "0", "world": "room", "robot": "chefbot_lidar"}


class LostBoard:
    """A robot on its way to a goal whose board is unplugged from LOST_S to BACK_S."""

    def __init__(self) -> None:
        self.system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 3)
        self.notices: list[str] = []
        self.status = EmergencyStopStatus()
        self.navigation = NavigationStatus()
        self.pose = SE2(0.0, 0.0, 0.0)
        self.system.loop.add_observer(self._observe)
        launch = load_launch("gmapping_demo", ARGUMENTS)
        self.system.launch(inject(launch, [BoardUnplugged(at=LOST_S, until=BACK_S)]))
        self.run(2.0)
        self.send_goal(0.8)

    def _observe(self, publication: Publication) -> None:
        message = publication.message
        if publication.topic == "base/notice" and isinstance(message, String):
            self.notices.append(message.data)
        elif isinstance(message, EmergencyStopStatus):
            self.status = message
        elif isinstance(message, NavigationStatus):
            self.navigation = message
        elif publication.topic == "ground_truth" and isinstance(message, Odometry):
            self.pose = message.pose.pose.se2

    def run(self, until_s: float) -> None:
        self.system.loop.run(until_ns=round(until_s * SECOND))

    def send_goal(self, x: float) -> None:
        header = Header.of(self.system.loop.now_ns, "map")
        goal = PoseStamped(header, Pose.of(SE2(x, 0.0, 0.0)))
        self.system.loop.publish("goal_pose", goal, "operator", from_device=True)

    def press(self, pressed: bool) -> None:
        self.system.loop.publish("stop_request", Bool(pressed), "operator", from_device=True)


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
def test_a_new_goal_is_driven_to_after_the_board_is_back() -> None:
    robot = LostBoard()
    robot.run(LOST_S + 1.5)
    assert (robot.status.active, robot.status.description) == (True, BOARD_LOST)
    assert robot.navigation.state == "idle"
    robot.press(False)  # Release STOP does not help without a board
    robot.run(NEW_GOAL_S)
    assert (robot.status.active, robot.status.description) == (False, BOARD_BACK)
    assert robot.notices == [BOARD_LOST, BOARD_LOST, BOARD_BACK]
    stood = robot.pose
    robot.run(NEW_GOAL_S + 3.0)
    assert robot.pose.distance(stood) < 0.01
    robot.send_goal(0.8 if stood.x < 0.4 else 0.0)
    robot.run(END_S)
    assert robot.pose.distance(stood) > 0.2


@pytest.mark.rotated("sensor faults during a goal")
@pytest.mark.slow
def test_a_press_while_the_board_is_lost_outlasts_it() -> None:
    robot = LostBoard()
    robot.run(LOST_S + 1.5)
    robot.press(True)
    robot.run(NEW_GOAL_S)
    assert robot.status.active
    robot.press(False)
    robot.run(NEW_GOAL_S + 0.5)
    assert not robot.status.active
