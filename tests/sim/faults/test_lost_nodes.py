"""Nodes that are killed, hung or cut off while the robot drives: it stands, reports why, and arrives later."""

from __future__ import annotations

import pytest

from chefbot.control.waiting_state import SILENT
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.navigation.path_request import PLANNER_SILENT
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.faults.events import LinkCut, NodeFault, NodeHung, NodeKilled
from chefbot.sim.faults.node_faults import inject
from chefbot.sim.faults.schedule import describe

SECOND = 1_000_000_000
GOAL_S, LOST_S, BACK_S, END_S = 2.0, 4.0, 17.0, 40.0
STOPPED_S = 3.5
"""Longest time from a fault to standstill; localization may be silent for 2 s."""
GOAL = SE2(1.4, 0.0, 0.0)
ARGUMENTS = {"headless": "true", "people": "0", "pictures": "0", "world": "room", "robot": "chefbot_lidar"}
FAULTS: list[NodeFault] = [
    NodeKilled(node="planner", at=LOST_S, until=BACK_S),
    NodeKilled(node="gmapping", at=LOST_S, until=BACK_S),
    NodeHung(node="gmapping", at=LOST_S, until=BACK_S),
    LinkCut(link="gmapping", at=LOST_S, until=BACK_S),
]


class FaultyDrive:
    """A robot on its way to GOAL while a node fails; sentences with which it reports that."""

    def __init__(self, fault: NodeFault) -> None:
        self._system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 3)
        self.sentences: list[str] = []
        self.pose = SE2(0.0, 0.0, 0.0)
        self._system.loop.add_observer(self._observe)
        self._system.launch(inject(load_launch("gmapping_demo", ARGUMENTS), [fault]))
        self.run(GOAL_S)
        self.send_goal()

    def _observe(self, publication: Publication) -> None:
        message = publication.message
        if publication.topic == "base/notice" and isinstance(message, String):
            self.sentences.append(message.data)
        elif isinstance(message, NavigationStatus):
            self.sentences.append(message.reason)
        elif publication.topic == "ground_truth" and isinstance(message, Odometry):
            self.pose = message.pose.pose.se2

    def run(self, until_s: float) -> SE2:
        """Run until this time, and return the true pose."""
        self._system.loop.run(until_ns=round(until_s * SECOND))
        return self.pose

    def send_goal(self) -> None:
        goal = PoseStamped(Header.of(self._system.loop.now_ns, "map"), Pose.of(GOAL))
        self._system.loop.publish("goal_pose", goal, "operator", from_device=True)


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS, ids=describe)
def test_the_robot_stands_reports_why_and_arrives_later(fault: NodeFault) -> None:
    drive = FaultyDrive(fault)
    stood = drive.run(LOST_S + STOPPED_S)
    assert drive.run(BACK_S).distance(stood) < 0.01
    name = getattr(fault, "node", "")
    expected = f"{name} does not respond; the robot stops until it responds again." if name else SILENT
    assert expected in drive.sentences
    assert drive.run(END_S).distance(GOAL) < 0.35


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_planner_that_does_not_answer_is_named() -> None:
    drive = FaultyDrive(NodeHung(node="planner", at=LOST_S, until=BACK_S))
    drive.run(BACK_S)
    assert PLANNER_SILENT in drive.sentences


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_restarted_navigator_accepts_a_new_goal() -> None:
    drive = FaultyDrive(NodeKilled(node="navigator", at=LOST_S, until=BACK_S))
    stood = drive.run(LOST_S + STOPPED_S)
    assert drive.run(BACK_S + 3.0).distance(stood) < 0.01
    drive.send_goal()
    assert drive.run(END_S).distance(GOAL) < 0.35
