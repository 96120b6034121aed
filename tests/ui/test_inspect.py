"""Tests of the ROS graph on the page: topics are found, watched, and their numbers drawn as curves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from tests.support.web_ui import show_a_room
from tests.ui.chromium import NO_GPU, Tab, needs_chromium, open_tab

from chefbot.ros2.tools.inspection_views import (
    GraphSummary,
    LogLine,
    NodeParameters,
    ParameterView,
    TopicSummary,
    TopicValue,
)
from chefbot.ui.commands import Inspect, InspectCell, OperatorCommand, SetParameter
from chefbot.ui.display.views import CandidatesView, CellView, FrameView

UP = "!document.body.classList.contains('offline')"
GRAPH = GraphSummary(
    ("/base", "/slam"),
    (
        TopicSummary("/odom", ("nav_msgs/msg/Odometry",), ("/base",), ("/slam",)),
        TopicSummary("/scan", ("sensor_msgs/msg/LaserScan",), ("/base",), ()),
    ),
    parameter_nodes=("/base",),
)
PARAMETERS = (
    ParameterView("radius", "double", 0.2, "of the robot", read_only=True),
    ParameterView("speed", "double", 0.3, "maximum speed, m/s", low=0.0, high=1.0),
    ParameterView("enabled", "bool", True),
    ParameterView("weights", "double array", [1.0, 2.0]),
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
def test_every_topic_shows_the_rate_that_was_measured(tab: Tab, page: Any) -> None:
    rates = (
        "[...document.querySelectorAll('#topic-list button')].map((one) => one.lastChild.textContent.trim())"
    )
    assert tab.evaluate(rates) == ["", ""]
    odom, scan = (
        msgspec.structs.replace(topic, hz=hz) for topic, hz in zip(GRAPH.topics, (49.96, 0.0), strict=True)
    )
    page.server.set_layer("graph", msgspec.structs.replace(GRAPH, topics=(odom, scan)))
    tab.wait_for(f"{rates}[0] === '50.0 Hz'")
    assert tab.evaluate(rates)[1] == "< 0.5 Hz"


@pytest.mark.slow
@needs_chromium
def test_a_watched_topic_shows_its_values_and_curves(tab: Tab, page: Any) -> None:
    tab.evaluate(pressed("/odom"))
    command = page.next_command()
    while command != Inspect(["/odom"]):
        command = page.next_command()
    page.server.set_layer("values", (TopicValue("/odom", 50.0, 36000.0, 3, 1.0, ODOMETRY),))
    tab.wait_for("document.querySelector('.watched small').textContent.includes('50.0 Hz, 36.0 kB/s')")
    assert tab.evaluate("document.querySelector('.watched p').textContent") == "/base → /slam"
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


MANY = GraphSummary(
    ("/base", "/slam", "/planner", "/logger"),
    (
        TopicSummary("/camera/depth/image", ("sensor_msgs/msg/Image",), ("/base",), ("/slam",)),
        TopicSummary("/camera/depth/info", ("sensor_msgs/msg/CameraInfo",), ("/base",), ()),
        TopicSummary("/cmd_vel", ("geometry_msgs/msg/Twist",), ("/planner",), ("/base",)),
        TopicSummary("/map", ("nav_msgs/msg/OccupancyGrid",), ("/slam",), ("/planner",)),
        TopicSummary("/rosout", ("rcl_interfaces/msg/Log",), ("/base", "/slam"), ("/logger",)),
        TopicSummary("/slam/pose", ("geometry_msgs/msg/Pose",), ("/slam",), ()),
    ),
)


@pytest.mark.slow
@needs_chromium
def test_topics_are_a_tree_whose_branches_stay_closed(tab: Tab, page: Any) -> None:
    page.server.set_layer("graph", MANY)
    tab.wait_for("document.querySelectorAll('#topic-list [data-topic]').length === 6")
    texts = "[...document.querySelectorAll('#topic-list summary')].map((one) => one.textContent)"
    assert tab.evaluate(texts) == ["/camera", "/depth"]
    leaf = "document.querySelector('[data-topic=\"{}\"]').firstChild.textContent"
    assert tab.evaluate(leaf.format("/camera/depth/info")) == "/info"
    assert tab.evaluate(leaf.format("/slam/pose")) == "/slam/pose", "a branch with one topic is not a branch"
    tab.evaluate("document.querySelector('#topic-list details').open = false")
    tab.wait_for("!document.querySelector('#topic-list details').open")
    tab.evaluate("document.querySelector('[data-topic=\"/map\"]').click()")
    page.server.set_layer("values", (TopicValue("/map", 2.0, 100.0, 3, 1.0, {"x": 1.0}),))
    tab.wait_for("document.querySelector('[data-topic=\"/map\"]').textContent.endsWith(' 2.0 Hz')")
    page.server.set_layer("graph", GRAPH)
    tab.wait_for("document.querySelectorAll('#topic-list [data-topic]').length === 2")
    page.server.set_layer("graph", MANY)
    tab.wait_for("document.querySelectorAll('#topic-list [data-topic]').length === 6")
    assert not tab.evaluate("document.querySelector('#topic-list details').open") and tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_the_node_graph_runs_along_the_flow_of_data(tab: Tab, page: Any) -> None:
    page.server.set_layer("graph", MANY)
    tab.evaluate("document.getElementById('node-graph-open').click()")
    tab.wait_for("document.querySelectorAll('#node-graph-picture [data-node]').length === 3")
    assert tab.evaluate("document.activeElement.id") == "node-graph-close"
    place = "document.querySelector('[data-node=\"/{}\"]').getBoundingClientRect().left"
    left = [tab.evaluate(place.format(node)) for node in ("base", "slam", "planner")]
    assert left == sorted(left) and len(set(left)) == 3
    assert tab.evaluate("document.querySelectorAll('#node-graph-picture > path').length") == 3
    tab.evaluate("document.querySelector('[data-node=\"/slam\"]').focus()")
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter")
    expected = "/slam receives /camera/depth/image; it sends /map, /rosout, /slam/pose."
    tab.wait_for(f"document.getElementById('node-graph-text').textContent === '{expected}'")
    assert tab.evaluate("document.querySelectorAll('#node-graph-picture > path.chosen').length") == 2
    tab.evaluate("document.getElementById('node-graph-close').click()")
    assert tab.evaluate("document.getElementById('node-graph').hidden") and tab.errors() == []


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


def command_of(page: Any, kind: type[OperatorCommand]) -> Any:
    """The next command of a kind that the web UI sends."""
    while not isinstance(command := page.next_command(), kind):
        pass
    return command


def changed(tab: Tab, selector: str, assignment: str, event: str = "change") -> None:
    """Change an element as a person does."""
    tab.evaluate(
        f"(() => {{ const one = document.querySelector('{selector}'); one.{assignment}; one.on{event}(); }})()"
    )


def opened(tab: Tab, box: str) -> None:
    tab.evaluate(f"document.getElementById('{box}').open = true")


def choose_base(tab: Tab) -> None:
    """Look at the parameters of the node /base."""
    opened(tab, "parameters-box")
    tab.wait_for("document.querySelectorAll('#parameter-node option').length === 2")
    changed(tab, "#parameter-node", "value = '/base'")


@pytest.mark.slow
@needs_chromium
def test_parameters_are_set_by_slider_box_and_list(tab: Tab, page: Any) -> None:
    choose_base(tab)
    while command_of(page, Inspect).nodes != ("/base",):
        pass
    page.server.set_layer("parameters", (NodeParameters("/base", PARAMETERS),))
    tab.wait_for("document.querySelectorAll('#parameter-list li').length === 4")
    names = "[...document.querySelectorAll('#parameter-list span')].map((one) => one.textContent)"
    assert tab.evaluate(names) == ["enabled", "speed", "weights", "radius"], (
        "those that can be set come first"
    )
    assert tab.evaluate("document.querySelector('#parameter-list output').textContent") == "0.2"
    for kind, shown, value in (
        ("range", "value = 0.7", 0.7),
        ("number", "value = 0.5", 0.5),
        ("checkbox", "checked = false", False),
        ("text", "value = '[3, 4]'", [3, 4]),
    ):
        changed(tab, f"#parameter-list [type={kind}]", shown)
        sent = command_of(page, SetParameter)
        assert (sent.node, sent.value) == ("/base", value)
    refused = "Node /base refuses it: it is too fast here"
    page.server.set_layer("parameters", (NodeParameters("/base", PARAMETERS, refused),))
    tab.wait_for(f"document.getElementById('parameter-note').textContent === '{refused}'")
    tab.wait_for("document.querySelector('#parameter-list [type=number]').value === '0.3'")
    assert tab.errors() == []


@pytest.mark.slow
@needs_chromium
def test_a_value_outside_the_bounds_is_not_sent(tab: Tab, page: Any) -> None:
    choose_base(tab)
    page.server.set_layer("parameters", (NodeParameters("/base", PARAMETERS),))
    tab.wait_for("document.querySelectorAll('#parameter-list li').length === 4")
    for value in (7, 0.4):
        changed(tab, "#parameter-list [type=number]", f"value = {value}")
    assert command_of(page, SetParameter).value == 0.4


@pytest.mark.slow
@needs_chromium
def test_a_slider_over_decades_is_logarithmic(tab: Tab, page: Any) -> None:
    choose_base(tab)
    weight = ParameterView("weight", "double", 1.0, low=0.1, high=100.0)
    page.server.set_layer("parameters", (NodeParameters("/base", (weight,)),))
    slider = "document.querySelector('#parameter-list [type=range]')?.value"
    tab.wait_for(f"Number({slider}).toFixed(2) === '0.34'")  # a third of three decades
    for position, value in ((0.66, 9.55), (0, 0.1), (1, 100.0)):
        changed(tab, "#parameter-list [type=range]", f"value = {position}")
        assert command_of(page, SetParameter).value == pytest.approx(value, rel=0.01)
    changed(tab, "#parameter-list [type=number]", "value = 0.25")
    assert command_of(page, SetParameter).value == 0.25


@pytest.mark.slow
@needs_chromium
def test_the_log_is_filtered_by_level_and_text(tab: Tab, page: Any) -> None:
    opened(tab, "log-box")
    lines = (
        LogLine(1.0, 20, "base", "starts"),
        LogLine(2.0, 30, "slam", "slow"),
        LogLine(3.0, 10, "slam", "details"),
    )
    page.server.set_layer("log", lines)
    texts = "[...document.querySelectorAll('#log-list li')].map((one) => one.textContent)"
    tab.wait_for(f"{texts}.length === 2")
    assert tab.evaluate(texts) == ["2.0 WARN slam slow", "1.0 INFO base starts"]
    changed(tab, "#log-level", "value = '30'")
    assert tab.evaluate(texts) == ["2.0 WARN slam slow"]
    changed(tab, "#log-filter", "value = 'base'", "input")
    assert tab.evaluate(texts) == []


@pytest.mark.slow
@needs_chromium
def test_transforms_are_a_tree_with_poses_and_ages(tab: Tab, page: Any) -> None:
    opened(tab, "transforms-box")
    identity, quarter = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.7071067811865476, 0.7071067811865476)
    page.server.set_layer(
        "fixed_frames", (FrameView(name="laser", parent="base_link", at=(0.1, 0, 0.2), turn=identity),)
    )
    moving = (
        FrameView(name="odom", parent="map", at=(0.0, 0.0, 0.0), turn=identity, time=8.0),
        FrameView(name="base_link", parent="odom", at=(1.0, 0.0, 0.0), turn=quarter, time=9.5),
    )
    page.server.set_layer("frames", moving)
    tab.wait_for("document.querySelectorAll('#transforms li').length === 4")
    nested = "document.querySelector('#transforms > li > ul > li > ul > li > ul > li').firstChild.textContent"
    assert tab.evaluate(nested) == "laser"
    text = tab.evaluate("document.getElementById('transforms').textContent")
    assert "base_link x 1.000 m, yaw 90.0 °, 0.0 s old" in text and "odom 0, 1.5 s old" in text
    assert "laser x 0.100 m, z 0.200 m, fixed" in text


@pytest.mark.slow
@needs_chromium
def test_a_pressed_cell_is_explained(tab: Tab, page: Any) -> None:
    tab.evaluate("document.querySelector('[data-tool=inspect_cell]').click()")
    tab.click("#canvas")
    assert isinstance(command_of(page, InspectCell), InspectCell)
    page.server.set_layer(
        "cell", CellView(x=1.0, y=2.0, size=0.05, cost=254, marks=(("lidar", 2.0), ("map", None)))
    )
    text = "document.getElementById('hint').textContent"
    tab.wait_for(f"{text}.startsWith('Cell 1.00, 2.00')")
    assert tab.evaluate(text) == "Cell 1.00, 2.00: cost 254 (an obstacle). Marked by: Lidar, 2.0 s ago; Map"
    page.server.set_layer("cell", CellView(x=90.0, y=2.0, size=0.05, cost=None))
    tab.wait_for(f"{text}.includes('outside the costmap')")


@pytest.mark.slow
@needs_chromium
def test_the_address_keeps_what_is_shown(page: Any) -> None:
    show_a_room(page.server)
    page.server.set_layer("graph", GRAPH)
    lines = ((0.0, 0.0, 1.0, 1.0), (0.0, 0.0, 1.0, -1.0))
    page.server.set_layer("candidates", CandidatesView(trajectories=lines, badness=(0.0, None)))
    wanted = "tab=inspect&x=1.50&y=-0.50&scale=80.0&layers=candidates,path&topics=/odom&curves=/odom+pose.x"
    with open_tab(f"{page.url}#{wanted}", NO_GPU) as tab:
        tab.wait_for(UP)
        while command_of(page, Inspect).topics != ["/odom"]:
            pass
        tab.wait_for("document.querySelector('.watched') !== null")
        assert tab.evaluate("document.querySelector('[data-tab=inspect]').ariaSelected") == "true"
        boxes = "[...document.querySelectorAll('#layer-list input:checked')].map((one) => one.dataset.layer)"
        assert "candidates" in tab.evaluate(boxes) and "path" not in tab.evaluate(boxes)
        tab.evaluate("document.querySelector('[data-layer=path]').click()")
        expected = wanted.replace("candidates,path", "candidates")
        tab.wait_for(f"location.hash === '#{expected}'")
        assert tab.errors() == []
