"""Launches that join a robot: which one they choose, what they refuse, and when they start again."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import msgspec
import pytest
from tests.support.waiting import PATIENCE

from chefbot.bridge.robot_time import RobotTime
from chefbot.design.export.urdf import urdf
from chefbot.errors import UserError
from chefbot.launcher.join import JoinedRobot, join_robot, joining_node_name, watch_robot
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.rosgraph_msgs import Clock
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import CLOCK, TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.clock import FollowerClock
from chefbot.runtime.launch import Launch, load_launch
from chefbot.runtime.loop import Loop

ROBOT = load_robot("chefbot_lidar")
Start = Callable[..., ExitStack]


@pytest.fixture
def robot(port: int) -> Iterator[Start]:
    """`robot("/robot1", "page")` is a robot's launch with a node; what it returns ends it."""
    running = ExitStack()

    def start(space: str = "/", *nodes: str, simulated: bool = False, description: str = "") -> ExitStack:
        one = running.enter_context(ExitStack())
        there = one.enter_context(RmwContext(port=port, router=False))
        leader = one.enter_context(RmwNode(there, "chefbot", space))
        if simulated:
            clock = leader.publisher("clock", Clock, CLOCK)
            ended = threading.Event()
            one.callback(ended.set)

            def publish_time() -> None:
                while not ended.wait(0.02):
                    clock.publish(Clock(Time.of(time.monotonic_ns())))

            threading.Thread(target=publish_time, daemon=True).start()
        for name in nodes:
            one.enter_context(RmwNode(there, name, space))
        if description:
            leader.publisher("robot_description", String, TRANSIENT_LOCAL_QOS).publish(String(description))
        return one

    with running:
        yield start


def guest(**args: str) -> Launch:
    launch = load_launch("remote_page")
    return msgspec.structs.replace(launch, args={**launch.args, **args})


def met(wire: RmwContext, launch: Launch) -> tuple[JoinedRobot, list[str]]:
    reported: list[str] = []
    meeting = join_robot(wire, launch, ROBOT, reported.append)
    assert meeting is not None
    return meeting, reported


@pytest.mark.slow
def test_the_only_robot_is_joined_with_its_namespace_and_time(wire: RmwContext, robot: Start) -> None:
    robot("/robot1", "base", simulated=True, description=urdf(ROBOT))
    meeting, reported = met(wire, guest())
    assert meeting.launch.args["namespace"] == "/robot1"
    assert meeting.launch.clock == "simulation"
    assert reported == ["Joined robot /robot1, in its simulated time."]
    with RmwNode(wire, "listener", "/robot1") as node:
        robot_time = RobotTime(node)
        loop = Loop(robot_time.clock, robot_time.start_ns)
        robot_time.attach(loop)
        assert isinstance(robot_time.clock, FollowerClock)
        loop.schedule(robot_time.start_ns + 200_000_000, 0, loop.stop)
        loop.run()
        assert loop.now_ns == robot_time.start_ns + 200_000_000


@pytest.mark.slow
def test_one_of_several_robots_must_be_named(wire: RmwContext, robot: Start) -> None:
    robot("/robot1")
    robot("/robot2")
    with pytest.raises(UserError, match=r"several robots, /robot1, /robot2; choose with namespace:=NAME"):
        join_robot(wire, guest(), ROBOT, lambda _: None)
    meeting, reported = met(wire, guest(namespace="/robot2"))
    assert meeting.launch.args["namespace"] == "/robot2"
    assert meeting.launch.clock == "wall" and reported == ["Joined robot /robot2."]


@pytest.mark.slow
def test_another_robot_type_and_duplicate_names_are_refused(wire: RmwContext, robot: Start) -> None:
    with (
        robot("/robot1", description=urdf(load_robot("chefbot"))),
        pytest.raises(UserError, match="is a chefbot, not"),
    ):
        met(wire, guest())
    assert wire.graph.wait_for(
        lambda graph: not any(one.name == "chefbot" for one in graph.nodes()), PATIENCE
    )
    robot("/robot1", "remote_page")
    with pytest.raises(UserError, match="/robot1/remote_page runs already"):
        met(wire, guest())


@pytest.mark.slow
def test_joining_before_the_robot_starts_waits_with_a_notice(wire: RmwContext, robot: Start) -> None:
    reported: queue.Queue[str] = queue.Queue()
    threading.Timer(3.0, robot).start()
    meeting = join_robot(wire, guest(), ROBOT, reported.put)
    assert meeting is not None and meeting.zid
    assert reported.get() == "Waiting for a robot on the wire."
    assert reported.get() == "Joined a robot."


@pytest.mark.slow
def test_a_restarted_robot_is_a_new_one(wire: RmwContext, robot: Start) -> None:
    first = robot("/robot1")
    meeting, _ = met(wire, guest())
    stopped = threading.Event()
    with watch_robot(wire, meeting, stopped.set) as restarted:
        first.close()
        assert not stopped.wait(1.5)  # gone is not restarted: its link may be cut
        robot("/robot1")
        assert stopped.wait(PATIENCE) and restarted.is_set()


def test_each_joined_process_has_its_own_node() -> None:
    assert joining_node_name(guest()) == "chefbot_remote_page"
    launch = load_launch("several_machines", {"slam": "nuc.local", "screen": ""})
    assert joining_node_name(launch) == "chefbot_nuc_local"
