"""What the wire lost is warned of while it is new, and counted on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from chefbot.bridge.wire_health import RECENT_NS, WireHealth
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticStatus
from chefbot.ros2.rmw.errors import ErrorCounter

SECOND = 1_000_000_000


@pytest.fixture
def parts() -> SimpleNamespace:
    """Health with all that it speaks to; `told` is what came into the loop."""
    told: list[DiagnosticStatus] = []
    graph, tally = SimpleNamespace(mismatches=list), ErrorCounter()
    own = SimpleNamespace(publisher=lambda *_: SimpleNamespace(has_subscribers=False))
    there: Any = SimpleNamespace(
        own_rosout=SimpleNamespace(log=lambda *_: None), own=own, foreign_publishers=lambda _: []
    )
    inbox: Any = SimpleNamespace(publish=lambda _, message: told.append(message.status[0]))
    return SimpleNamespace(health=WireHealth(tally, graph, there, inbox), tally=tally, graph=graph, told=told)  # type: ignore[arg-type]


def test_a_burst_is_a_warning_for_a_while_then_only_counted(parts: SimpleNamespace) -> None:
    parts.tally.add("/tf: send queue is full, the oldest message is dropped")
    for second in range(20):
        parts.health.publish(second * SECOND)
    assert [one.level for one in parts.told] == [WARN, OK]
    assert all(one.message.startswith("1 messages rejected or lost") for one in parts.told)
    parts.tally.add("/tf: send queue is full, the oldest message is dropped")
    parts.health.publish(20 * SECOND)
    assert (parts.told[-1].level, parts.told[-1].values[0].value) == (WARN, "2")


def test_a_qos_mismatch_is_a_warning_as_long_as_it_lasts(parts: SimpleNamespace) -> None:
    parts.graph.mismatches = lambda: ["/scan: best effort does not reach reliable"]
    parts.health.check_graph()
    for second in range(0, 3 * RECENT_NS // SECOND):
        parts.health.publish(second * SECOND)
    assert [one.level for one in parts.told] == [WARN]
    parts.graph.mismatches = list
    parts.health.check_graph()
    parts.health.publish(4 * RECENT_NS)
    assert parts.told[-1].level == OK
