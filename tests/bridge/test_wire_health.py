"""What the wire lost is warned of while it is new, and counted on."""

from __future__ import annotations

from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.support.bridged_loop import launch_of
from tests.support.network import admit

from chefbot.bridge.bridge import Bridge
from chefbot.bridge.membership_health import MembershipHealth
from chefbot.bridge.wire_health import RECENT_NS, WireHealth
from chefbot.fleet.keyring import Keyring
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus
from chefbot.msgs.std_msgs import Float64
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.errors import QUEUE_FULL, ErrorCounter
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

SECOND = 1_000_000_000


@pytest.fixture
def parts() -> SimpleNamespace:
    """Health with all that it reports to; `published` is what came into the loop."""
    published: list[DiagnosticStatus] = []
    graph, tally = SimpleNamespace(mismatches=list), ErrorCounter()
    own = SimpleNamespace(full_name="/robot", publisher=lambda *_: SimpleNamespace(has_subscribers=False))
    there: Any = SimpleNamespace(
        own_rosout=SimpleNamespace(log=lambda *_: None), own=own, foreign_publishers=lambda _: []
    )
    inbox: Any = SimpleNamespace(
        publish=lambda topic, message: published.append(message.status[0]) if topic == "diagnostics" else None
    )
    health = WireHealth(tally, graph, there, inbox)  # type: ignore[arg-type]
    return SimpleNamespace(health=health, tally=tally, graph=graph, published=published)


def test_a_burst_is_a_warning_for_a_while_then_only_counted(parts: SimpleNamespace) -> None:
    dropped = f"/tf: send {QUEUE_FULL}"
    parts.tally.add(dropped)
    for second in range(20):
        parts.health.publish(second * SECOND)
    total = "1 messages were rejected or lost since the start"
    overloaded = "this computer is too slow, messages are lost on /tf"
    assert [(one.level, one.message) for one in parts.published] == [(WARN, overloaded), (OK, total)]
    parts.tally.add(dropped)
    parts.health.publish(20 * SECOND)
    assert (parts.published[-1].level, parts.published[-1].values[0].value) == (WARN, "2")


def test_the_message_names_what_is_lost_now_and_not_how_often(parts: SimpleNamespace) -> None:
    """A sentence that changed each second would move the web UI in which it is read."""
    for second in range(8):
        parts.tally.add("/tf: not of its type")
        parts.health.publish(second * SECOND)
    assert {one.message for one in parts.published} == {"/tf: not of its type"}
    for topic in ("/odom", "/map", "/scan"):
        parts.tally.add(f"{topic}: receive {QUEUE_FULL}")
    parts.tally.add("/plan: not of its type")
    parts.health.publish(RECENT_NS + 8 * SECOND)
    expected = (
        "this computer is too slow, messages are lost on /map, /odom and 1 more; /plan: not of its type"
    )
    assert (parts.published[-1].message, parts.published[-1].hardware_id) == (expected, "/robot")


def test_a_qos_mismatch_is_a_warning_as_long_as_it_lasts(parts: SimpleNamespace) -> None:
    parts.graph.mismatches = lambda: ["/scan: best effort does not reach reliable"]
    parts.health.check_graph()
    for second in range(0, 3 * RECENT_NS // SECOND):
        parts.health.publish(second * SECOND)
    assert [one.level for one in parts.published] == [WARN]
    parts.graph.mismatches = list
    parts.health.check_graph()
    parts.health.publish(4 * RECENT_NS)
    assert parts.published[-1].level == OK


def test_a_member_of_a_fleet_reports_its_certificate(tmp_path: Path) -> None:
    """Status `fleet` beside status `wire`, in the loop and in the log when it becomes a problem."""
    published: list[tuple[DiagnosticStatus, ...]] = []
    logged: list[str] = []
    own = SimpleNamespace(full_name="/robot", publisher=lambda *_: SimpleNamespace(has_subscribers=False))
    there: Any = SimpleNamespace(
        own_rosout=SimpleNamespace(log=lambda _, text, __: logged.append(text)),
        own=own,
        foreign_publishers=lambda _: [],
    )
    inbox: Any = SimpleNamespace(publish=lambda _, message: published.append(message.status))
    office = Keyring(tmp_path / "office")
    office.create_fleet("hotel", datetime.now(UTC))
    robot = admit(tmp_path, office, "robot1", "robot")
    graph: Any = SimpleNamespace(mismatches=list)
    health = WireHealth(ErrorCounter(), graph, there, inbox, MembershipHealth(robot))
    for second in range(20, 23):
        health.publish(second * SECOND)
    (statuses,) = published
    assert [(one.name, one.level) for one in statuses] == [("wire", OK), ("fleet", OK)] and logged == []
    robot.accept(office.remove("robot1"))
    for second in range(23, 26):
        health.publish(second * SECOND)
    assert [(one.name, one.level) for one in published[-1]] == [("wire", OK), ("fleet", ERROR)]
    assert len(published) == 2
    assert ["removed or replaced" in text for text in logged] == [True]


def test_messages_before_the_first_nodes_are_not_counted_as_lost(port: int) -> None:
    """Nobody can have subscribed to them yet; a launch that starts slowly is not reported as one that loses."""
    system = NodeContainer(Loop(PacedClock(1.0)), load_robot("chefbot"), 5)
    with RmwContext(port=port) as wire, closing(Bridge(system, wire, simulated=True)) as bridge:
        for number in range(100):
            system.loop.publish("double", Float64(number), "doubler")
        system.launch(launch_of(("doubler",)))
        bridge.represent(system.nodes.values())
        assert bridge.flush()
        assert bridge.errors.counts() == {}
    system.stop()
