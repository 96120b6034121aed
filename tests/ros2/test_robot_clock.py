"""The time that `now` means: that of the robot whose topic is used."""

from __future__ import annotations

import time

import pytest
from tests.support.waiting import PATIENCE

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools import robot_clock
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.robot_clock import RobotClock


def await_clock(node: RmwNode, topic: str) -> None:
    assert node.wire.graph.wait_for(lambda graph: topic in graph.topics(), PATIENCE)


@pytest.mark.parametrize("name", ["/kitchen/goal_pose", "/kitchen/arm/goal_pose"])
def test_a_simulated_robots_clock_is_that_of_its_namespace(wire: RmwContext, name: str) -> None:
    message = Clock(Time(12, 500_000_000))
    with RmwNode(wire, "tool") as node, RmwNode(wire, "simulator", "/kitchen") as simulator:
        publisher = simulator.publisher("clock", Clock, CLOCK)
        await_clock(node, "/kitchen/clock")
        clock = RobotClock(node, name)
        until = time.monotonic() + PATIENCE
        while not publisher.has_subscribers:
            assert time.monotonic() < until
            time.sleep(0.005)
        publisher.publish(message)
        assert clock.now().ns == message.clock.ns
        assert clock.now().ns == message.clock.ns  # the newest one stands until the next


def test_another_robots_clock_is_not_taken(wire: RmwContext) -> None:
    with RmwNode(wire, "tool") as node, RmwNode(wire, "simulator", "/kitchen") as simulator:
        simulator.publisher("clock", Clock, CLOCK)
        await_clock(node, "/kitchen/clock")
        before = time.time_ns()
        assert before <= RobotClock(node, "/bar/goal_pose").now().ns <= time.time_ns()


def test_a_silent_clock_is_an_error(wire: RmwContext, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_clock, "CLOCK_TIMEOUT", 0.1)
    with RmwNode(wire, "tool") as node, RmwNode(wire, "simulator") as simulator:
        simulator.publisher("clock", Clock, CLOCK)
        await_clock(node, "/clock")
        with pytest.raises(ToolError, match="the simulation stands still"):
            RobotClock(node, "/goal_pose").now()
