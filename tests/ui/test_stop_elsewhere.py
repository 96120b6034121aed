"""Two pages of one robot, as on two machines: STOP shows on both, and the base alone says how it stands."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from tests.chaos.launched import free_port
from tests.waiting import PATIENCE

from chefbot.msgs.std_msgs import Bool
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.commands import Resume, Stop
from chefbot.ui.pending_requests import STOP_UNCONFIRMED
from chefbot.ui.web_ui_client import WebUiClient

BASE = NodeEntry(kind="chefbot.nodes.drive_base:DriveBaseNode")


class Robot:
    """Two pages in a loop that runs, and a base unless it has died."""

    def __init__(self, *, base: bool) -> None:
        self.system = NodeContainer(Loop(PacedClock(1.0)), load_robot("chefbot_lidar"), 1)
        pages = {
            name: NodeEntry(kind="chefbot.ui.web_ui:WebUiDevice", params={"port": free_port()})
            for name in ("here", "there")
        }
        nodes = {**pages, "base": BASE} if base else pages
        self.system.launch(Launch(name="test", description="", args={}, nodes=nodes))
        self.said: list[bool] = []
        self.asked: list[bool] = []
        loop = self.system.loop
        loop.subscribe("emergency_stop", "test", lambda one: self.said.append(one.data))  # type: ignore[attr-defined]
        loop.subscribe("stop_request", "test", lambda one: self.asked.append(one.data))  # type: ignore[attr-defined]
        self._thread = threading.Thread(target=loop.run)
        self._thread.start()

    def page(self, name: str) -> WebUiClient:
        return WebUiClient(self.system.nodes[name].url)  # type: ignore[attr-defined]

    def say(self, topic: str, word: bool) -> None:
        loop = self.system.loop
        loop.post(lambda: loop.publish(topic, Bool(word), "wire", from_device=True))

    def stop(self) -> None:
        self.system.loop.stop()
        self._thread.join()
        self.system.stop()


@pytest.fixture
def robot(request: pytest.FixtureRequest) -> Iterator[Robot]:
    one = Robot(base=getattr(request, "param", True))
    yield one
    one.stop()


def shows(page: WebUiClient, **wanted: object) -> bool:
    """Whether the page's status does so before long."""
    for _ in range(200):
        status = page.latest.get("status")
        if status and wanted.items() <= status.items():
            return True
        page.receive(PATIENCE)
    return False


def test_stop_pressed_on_one_page_shows_on_the_other_and_either_takes_it_back(robot: Robot) -> None:
    with robot.page("here") as here, robot.page("there") as there:
        assert shows(here, stopped=False)
        here.send(Stop())
        assert shows(there, stopped=True, reason="Emergency stop was pressed.")
        assert shows(here, stopped=True, stop_pending=False)
        there.send(Resume())
        assert shows(here, stopped=False)
        assert shows(there, stopped=False)
    assert robot.said == [False, True, False]
    assert robot.asked[-1] is False


def test_a_stop_from_a_stranger_counts_and_is_taken_back_on_a_page_only(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        robot.say("emergency_stop", True)
        assert shows(page, stopped=True)
        robot.say("emergency_stop", False)
        page.receive(PATIENCE)
        assert shows(page, stopped=True)
        assert robot.said[-2:] == [False, True]  # the last word is the base's
        page.send(Resume())
        assert shows(page, stopped=False)


@pytest.mark.parametrize("robot", [False], indirect=True)
def test_a_stop_that_nobody_confirms_is_asked_for_until_somebody_does(robot: Robot) -> None:
    with robot.page("here") as page:
        assert shows(page, stopped=False)
        page.send(Stop())
        assert shows(page, stopped=False, stop_pending=True)
        assert shows(page, stopped=False, stop_pending=True, reason=STOP_UNCONFIRMED)
        assert len(robot.asked) > 3 and all(robot.asked)
        robot.say("emergency_stop", True)
        assert shows(page, stopped=True, stop_pending=False)
        count = len(robot.asked)
        page.receive(PATIENCE)
        assert len(robot.asked) == count
