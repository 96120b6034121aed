"""Clients and servers of other distributions: their actions have other fields, so other hashes and other keys."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from functools import partial

import numpy as np
import pytest
import zenoh
from tests.support.waiting import PATIENCE, wait_for
from zenoh import handlers

from chefbot.msgs.action_msgs import (
    CANCEL_GOAL_TERMINATED,
    CANCEL_NONE,
    CANCEL_REJECTED,
    CANCEL_UNKNOWN_GOAL,
    STATUS_CANCELED,
    STATUS_SUCCEEDED,
    CancelGoal,
    CancelGoal_Request,
    CancelGoal_Response,
    GoalInfo,
)
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.editions import convert, older_editions
from chefbot.msgs.idl.fields import fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import FollowPath, Spin, Spin_Feedback, Spin_Goal, Spin_Result
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.action_client import ActionClient, new_goal_id
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.attachment import SIZE, Attachment, parse
from chefbot.ros2.rmw.liveliness import CLIENT
from chefbot.ros2.rmw.names import InterfaceType, topic_key
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools.node import info_lines

JAZZY, EARLY_JAZZY = older_editions("nav2_msgs/action/Spin")
GID = bytes(range(16))


class Turner:
    """Serves `/spin`, remembers the goals and ends them at once unless they are to turn by more than 10 rad."""

    def __init__(self, node: RmwNode) -> None:
        self.goals: list[Spin_Goal] = []
        self.stubborn = False
        self.ends: list[threading.Timer] = []
        self.server = ActionServer(node, "/spin", Spin, self.accept, lambda _: not self.stubborn)

    def accept(self, goal_id: UUID, goal: Spin_Goal) -> bool:
        self.goals.append(goal)
        self.server.execute(goal_id)
        self.server.publish_feedback(goal_id, Spin_Feedback(goal.target_yaw))
        if goal.target_yaw <= 10.0:
            self.ends.append(threading.Timer(0.2, partial(self.end, goal_id, STATUS_SUCCEEDED)))
            self.ends[-1].start()
        return True

    def end(self, goal_id: UUID, status: int) -> None:
        self.server.finish(goal_id, status, Spin_Result(error_code=703, error_msg="a wall"))


@pytest.fixture
def turner(wire: RmwContext) -> Iterator[Turner]:
    with RmwNode(wire, "controller") as node:
        turner = Turner(node)
        yield turner
        for end in turner.ends:
            end.join()


def call(peer: zenoh.Session, key: str, request: Message) -> bytes:
    """Exactly one reply, which repeats number and gid; called again until the peer knows of the server."""
    (reply,) = wait_for(lambda: replies_to(peer, key, request))
    assert reply.ok is not None and reply.ok.attachment is not None
    assert str(reply.ok.key_expr) == key
    attachment = reply.ok.attachment.to_bytes()
    assert len(attachment) == SIZE and parse(attachment)[::2] == (7, GID)
    return reply.ok.payload.to_bytes()


def replies_to(peer: zenoh.Session, key: str, request: Message) -> list[zenoh.Reply]:
    """As rmw_client_data.cpp queries: all complete, no consolidation."""
    got: queue.Queue[zenoh.Reply] = queue.Queue()
    done = threading.Event()
    peer.get(
        key,
        handlers.Callback(got.put, done.set),
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=request.to_cdr(),
        attachment=Attachment(7, 1, GID).pack(),
        timeout=PATIENCE,
    )
    assert done.wait(PATIENCE)
    return [got.get_nowait() for _ in range(got.qsize())]


def key_of(part: str, kind: object) -> str:
    return topic_key(0, f"/spin/_action/{part}", InterfaceType.of(kind))  # type: ignore[arg-type]


def names(kind: type[Message]) -> list[str]:
    return [one.name for one in fields_of(kind)]


def test_each_ros_distribution_has_its_interfaces() -> None:
    assert names(Spin.goal) == ["target_yaw", "time_allowance", "disable_collision_checks"]
    assert names(JAZZY.goal) == names(EARLY_JAZZY.goal) == ["target_yaw", "time_allowance"]
    assert names(JAZZY.result) == ["total_elapsed_time", "error_code", "error_msg"]
    assert names(EARLY_JAZZY.result) == ["total_elapsed_time", "error_code"]
    assert names(FollowPath.result) == ["result", "error_code", "error_msg"]
    assert len({one.send_goal_service.type_hash for one in (Spin, JAZZY, EARLY_JAZZY)}) == 2
    assert ros_type(JAZZY.send_goal_service.event) == "nav2_msgs/action/Spin_SendGoal_Event"
    assert older_editions("chefbot_msgs/action/Deliver") == ()
    assert convert(JAZZY.goal(1.0), Spin_Goal).to_cdr() == Spin_Goal(1.0).to_cdr()


@pytest.mark.parametrize("form", [Spin, JAZZY, EARLY_JAZZY], ids=["kilted", "jazzy", "early jazzy"])
@pytest.mark.slow
def test_a_bare_client_of_each_distribution_is_served(turner: Turner, peer: zenoh.Session, form) -> None:
    received: queue.Queue[bytes] = queue.Queue()
    peer.declare_subscriber(
        key_of("feedback", form.feedback_message), lambda sample: received.put(sample.payload.to_bytes())
    )
    goal_id = new_goal_id()
    sent = call(peer, key_of("send_goal", form.send_goal_service), form.send_goal(goal_id, form.goal(2.5)))
    assert form.send_goal_service.response.from_cdr(sent).accepted
    request = form.get_result_service.request(goal_id)
    got = form.get_result_service.response.from_cdr(
        call(peer, key_of("get_result", form.get_result_service), request)
    )
    assert (got.status, got.result.error_code) == (STATUS_SUCCEEDED, 703)
    assert getattr(got.result, "error_msg", "a wall") == "a wall"
    message = form.feedback_message.from_cdr(received.get(timeout=PATIENCE))
    assert (message.goal_id.key, message.feedback.angular_distance_traveled) == (goal_id.key, 2.5)
    assert turner.goals[-1].target_yaw == 2.5 and not turner.goals[-1].disable_collision_checks


def test_several_interface_editions_are_not_a_type_mismatch(turner: Turner, wire: RmwContext) -> None:
    assert wire.graph.wait_for(lambda graph: "/spin" in graph.actions(), PATIENCE)
    goals = "/spin/_action/send_goal"
    assert wire.graph.wait_for(lambda graph: len(graph.services()[goals].types) == 2, PATIENCE)
    assert info_lines(wire.graph, "/controller").count("  /spin  nav2_msgs/action/Spin") == 1
    with RmwNode(wire, "jazzy") as node:
        node.client("/spin/_action/send_goal", JAZZY.send_goal_service)
        node.client("/spin/_action/get_result", EARLY_JAZZY.get_result_service)
        assert wire.graph.wait_for(
            lambda graph: "/jazzy" in {one.full_name for one in graph.nodes()}, PATIENCE
        )
        assert wire.graph.mismatches() == []
        newer = InterfaceType("nav2_msgs/action/Spin_SendGoal", "RIHS01_" + "1" * 64)
        node.announce(CLIENT, "/spin/_action/send_goal", newer)
        assert wire.graph.wait_for(lambda graph: len(graph.mismatches()) > 0, PATIENCE)
        assert "in two versions" in wire.graph.mismatches()[0]


class OldServer:
    """`/spin` as Nav2 of early Jazzy serves it."""

    def __init__(self, node: RmwNode) -> None:
        base = "/spin/_action/"
        self.feedback = node.publisher(base + "feedback", EARLY_JAZZY.feedback_message)
        node.server(base + "send_goal", EARLY_JAZZY.send_goal_service, self.accept)
        node.server(base + "get_result", EARLY_JAZZY.get_result_service, self.end)
        node.server(base + "cancel_goal", CancelGoal, lambda call: call.respond(CancelGoal_Response()))

    def accept(self, call) -> None:
        call.respond(EARLY_JAZZY.send_goal_service.response(True, Time()))
        feedback = EARLY_JAZZY.feedback(call.request.goal.target_yaw)
        self.feedback.publish(EARLY_JAZZY.feedback_message(call.request.goal_id, feedback))

    def end(self, call) -> None:
        result = EARLY_JAZZY.result(error_code=701)
        call.respond(EARLY_JAZZY.get_result_service.response(STATUS_CANCELED, result))


def test_a_server_of_another_distribution_is_called_correctly(wire: RmwContext, port: int) -> None:
    with RmwContext(port=port, router=False) as far, RmwNode(far, "behavior_server") as theirs:
        client_node = RmwNode(wire, "finder")
        client = ActionClient(client_node, "spin", Spin)
        OldServer(theirs)
        assert wire.graph.wait_for(lambda _: client.served, PATIENCE)
        feedback: queue.Queue[Spin_Feedback] = queue.Queue()
        status, result = client.send_goal_async(Spin_Goal(1.5), feedback.put).result.result(PATIENCE)
        assert (status, result.error_code, type(result)) == (STATUS_CANCELED, 701, Spin_Result)
        assert feedback.get(timeout=PATIENCE).angular_distance_traveled == 1.5
        assert wire.graph.mismatches() == []
        client_node.close()


def cancel(peer: zenoh.Session, goal: GoalInfo) -> CancelGoal_Response:
    return CancelGoal_Response.from_cdr(
        call(peer, key_of("cancel_goal", CancelGoal), CancelGoal_Request(goal))
    )


def begin(peer: zenoh.Session) -> GoalInfo:
    """A goal that lasts."""
    goal_id = new_goal_id()
    key = key_of("send_goal", Spin.send_goal_service)
    sent = call(peer, key, Spin.send_goal(goal_id, Spin_Goal(99.0)))
    return GoalInfo(goal_id, Spin.send_goal_service.response.from_cdr(sent).stamp)


@pytest.mark.slow
def test_cancel_semantics_and_replies_equal_rcl_action(turner: Turner, peer: zenoh.Session) -> None:
    nobody, everybody = GoalInfo(new_goal_id()), GoalInfo(UUID(np.zeros(16, np.uint8)))
    assert cancel(peer, nobody).return_code == CANCEL_UNKNOWN_GOAL
    assert cancel(peer, everybody).return_code == CANCEL_NONE
    first, second, third = begin(peer), begin(peer), begin(peer)
    turner.stubborn = True
    assert cancel(peer, GoalInfo(first.goal_id)).return_code == CANCEL_REJECTED
    turner.stubborn = False
    response = cancel(peer, GoalInfo(UUID(np.zeros(16, np.uint8)), second.stamp))
    assert response.return_code == CANCEL_NONE
    assert [one.goal_id.key for one in response.goals_canceling] == [first.goal_id.key, second.goal_id.key]
    assert [one.stamp.ns for one in response.goals_canceling] == [first.stamp.ns, second.stamp.ns]
    assert cancel(peer, GoalInfo(second.goal_id)).return_code == CANCEL_GOAL_TERMINATED
    assert [one.goal_id.key for one in cancel(peer, everybody).goals_canceling] == [third.goal_id.key]
    turner.end(third.goal_id, STATUS_CANCELED)
    assert cancel(peer, GoalInfo(third.goal_id)).return_code == CANCEL_GOAL_TERMINATED
