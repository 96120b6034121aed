"""Tests of the ROS graph on the page: topics are found, watched, and their numbers drawn as curves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.ros2.tools.inspection_views import GraphSummary, TopicSummary, TopicValue
from chefbot.ui.commands import Inspect

UP = "!document.body.classList.contains('offline')"
GRAPH = GraphSummary(
    ("/base", "/slam"),
    (
        TopicSummary("/odom", ("nav_msgs/msg/Odometry",), ("/base",), ("/slam",)),
        TopicSummary("/scan", ("sensor_msgs/msg/LaserScan",), ("/base",), ()),
    ),
)
ODOMETRY = {"pose": {"x": 1.5, "y": -2.0}, "frame": "odom"}


@pytest.fixture
def tab(page: Any) -> Iterator[Tab]:
    show_a_room(page.server)
    page.server.set_layer("graph", GRAPH)
    with open_tab(page.url, NO_GPU) as one:
        one.wait_for(UP)
        one.evaluate("document.getElementById('inspect-tab').click()")
        one.wait_for("document.querySelectorAll('#topic-list button').length === 2")
        yield one


def pressed(name: str) -> str:
    return (
        "[...document.querySelectorAll('#topic-list button')]"
        f".find((one) => one.firstChild.textContent === '{name}').click()"
    )


@pytest.mark.slow
@needs_chromium
def test_topics_are_filtered_by_name_type_and_node(tab: Tab) -> None:
    for text, count in (("laserscan", 1), ("/slam", 1), ("/base", 2), ("nothing", 0)):
        tab.evaluate(
            f"document.getElementById('topic-filter').value = '{text}';"
            "document.getElementById('topic-filter').oninput()"
        )
        assert tab.evaluate("document.querySelectorAll('#topic-list button').length") == count
    assert tab.evaluate("document.getElementById('graph-note').textContent") == "2 nodes, 2 topics"


@pytest.mark.slow
@needs_chromium
def test_a_watched_topic_shows_its_values_and_curves(tab: Tab, page: Any) -> None:
    tab.evaluate(pressed("/odom"))
    command = page.next_command()
    while command != Inspect(["/odom"]):
        command = page.next_command()
    page.server.set_layer("values", (TopicValue("/odom", 50.0, 36000.0, 3, 1.0, ODOMETRY),))
    tab.wait_for("document.querySelector('.watched small').textContent.includes('50.0 Hz, 36.0 kB/s')")
    tab.evaluate("document.querySelectorAll('.watched button:not(.close)')[0].click()")
    for second in range(2, 6):
        value = {"pose": {"x": 1.5 + second, "y": -2.0}, "frame": "odom"}
        page.server.set_layer("values", (TopicValue("/odom", 50.0, 36000.0, second, float(second), value),))
        tab.wait_for(
            f"document.getElementById('curve-cursor').textContent.includes('/odom pose.x: {1.5 + second:.5f}')"
        )
    assert not tab.evaluate("document.getElementById('curves').hidden")
    tab.evaluate("document.querySelector('.watched .close').click()")
    tab.wait_for("!document.querySelector('.watched') && document.getElementById('curves').hidden")
    assert tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_numbers_can_be_pressed_while_they_change(tab: Tab, page: Any) -> None:
    """The elements stay the same while the message keeps its fields."""
    tab.evaluate(pressed("/odom"))
    page.server.set_layer("values", (TopicValue("/odom", 50.0, 36000.0, 3, 1.0, ODOMETRY),))
    tab.wait_for("document.querySelectorAll('.watched button').length === 3")
    tab.evaluate("window.before = document.querySelectorAll('.watched button')[1]")
    changed = {"pose": {"x": 7.25, "y": 0.0}, "frame": "odom"}
    page.server.set_layer("values", (TopicValue("/odom", 50.0, 36000.0, 4, 2.0, changed),))
    tab.wait_for("document.querySelectorAll('.watched button')[1].textContent === '7.25000'")
    assert tab.evaluate("document.querySelectorAll('.watched button')[1] === window.before")
