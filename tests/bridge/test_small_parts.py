"""Parts of the bridge: logging on /rosout, progress in simulated time, the operator's link, QoS of topics."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.bridge import operator_link
from chefbot.bridge.node_proxies import _publisher_qos, _subscription_qos
from chefbot.bridge.operator_link import LINK_TIMEOUT, LinkMonitorDevice
from chefbot.bridge.ports import Topic
from chefbot.bridge.rosout import Rosout, is_for_operator
from chefbot.bridge.sim_time_sync import MIN_PERIOD_NS, ProgressPublisher, subscribe_to_progress
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.rcl_interfaces import ERROR as LOG_ERROR
from chefbot.msgs.rcl_interfaces import INFO, Log
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.ros2.rmw.qos import DEFAULT, SENSOR_DATA, TF, TF_STATIC, TRANSIENT_LOCAL_QOS
from chefbot.runtime.loop import Publication

LEVELS = {OK: INFO, WARN: LOG_WARN, ERROR: LOG_ERROR}


def publication(topic: str, message: Message, time_ns: int = 0) -> Publication:
    one: Any = SimpleNamespace(topic=topic, message=message, time_ns=time_ns)
    return one


def rosout() -> tuple[Rosout, list[Log]]:
    logs: list[Log] = []
    node: Any = SimpleNamespace(
        full_name="/robot1/base", publisher=lambda *_: SimpleNamespace(publish=logs.append)
    )
    return Rosout(node), logs


@given(st.lists(st.tuples(st.sampled_from([OK, WARN, ERROR]), st.sampled_from("ab")), max_size=20))
def test_diagnostics_are_logged_only_when_they_change(reports: list[tuple[int, str]]) -> None:
    one, logs = rosout()
    expected, before = list[tuple[int, str]](), (OK, "")
    for level, text in reports:
        status = DiagnosticStatus(level, "lidar", text)
        one.log_publication(publication("diagnostics", DiagnosticArray(Header(), (status,))))
        if (level, text) != before and (level != OK or before[0] != OK):
            expected.append((LEVELS[level], f"lidar: {text}"))
        before = (level, text)
    assert [(log.level, log.msg) for log in logs] == expected
    assert {log.name for log in logs} <= {"robot1.base"}


def test_notices_are_logged_as_information() -> None:
    one, logs = rosout()
    notice = publication("base/notice", String("Stopped."), 5)
    one.log_publication(notice)
    one.log_publication(publication("other", String("no notice")))
    assert [(log.level, log.msg, log.stamp.ns) for log in logs] == [(INFO, "Stopped.", 5)]
    assert is_for_operator(notice) and not is_for_operator(publication("other", String()))


def test_progress_is_published_once_per_period() -> None:
    sent, arrived = list[int](), threading.Semaphore(0)
    callbacks: list[Any] = []

    def publish(header: Header) -> None:
        sent.append(header.stamp.ns)
        for callback in callbacks:
            callback(header)
        arrived.release()

    node: Any = SimpleNamespace(
        publisher=lambda *_: SimpleNamespace(publish=publish),
        subscription=lambda _, __, callback: callbacks.append(callback),
    )
    seen: list[tuple[str, int]] = []
    subscribe_to_progress(node, lambda process, reached: seen.append((process, reached)))
    one = ProgressPublisher(node, "slam")
    for reached in (0, 1, MIN_PERIOD_NS - 1, MIN_PERIOD_NS, MIN_PERIOD_NS + 1):
        one.publish(reached)
        if reached in (0, MIN_PERIOD_NS):
            assert arrived.acquire(timeout=60.0)
    assert sent == [0, MIN_PERIOD_NS] and seen == [("slam", 0), ("slam", MIN_PERIOD_NS)]


def test_a_silent_robot_is_a_lost_link(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = [0]
    monkeypatch.setattr(operator_link, "wall_ns", lambda: wall[0])
    link, notices = list[str](), list[str]()
    device: Any = LinkMonitorDevice.__new__(LinkMonitorDevice)
    device.link = SimpleNamespace(publish=lambda message: link.append(message.data))
    device.notice = SimpleNamespace(publish=lambda message: notices.append(message.data))
    device.start()
    for seconds, message in ((0.5, True), (1.4, False), (3.0, False), (3.1, True)):
        wall[0] = round(seconds * 1e9)
        if message:
            device.on_cmd_vel(Twist())
        device.publish_state()
    assert [bool(text) for text in link] == [False, False, True, False]
    assert notices == ["Connection to the robot lost.", "Connection to the robot restored."]
    assert LINK_TIMEOUT < 1.6


@pytest.mark.parametrize("latched", [True, False])
def test_topics_have_the_qos_of_their_type(latched: bool) -> None:
    def subscribed(kind: type[Message]) -> object:
        topic: Any = SimpleNamespace(kind=kind)
        assert "kind" in Topic._fields
        return _subscription_qos(topic, latched)

    assert subscribed(TFMessage) == (TF_STATIC if latched else TF)
    assert subscribed(LaserScan) == (TRANSIENT_LOCAL_QOS if latched else SENSOR_DATA)
    assert subscribed(String) == (TRANSIENT_LOCAL_QOS if latched else DEFAULT)
    assert _publisher_qos(String, latched) == (TRANSIENT_LOCAL_QOS if latched else DEFAULT)
