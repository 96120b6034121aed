"""Two pages of one robot, as on two machines: STOP shows on both."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from chefbot.msgs.std_msgs import Bool
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.system import System
from chefbot.ui.commands import Resume, Stop
from chefbot.ui.remote import RemotePage

PATIENCE = 20.0


@pytest.fixture
def system() -> Iterator[System]:
    """One page in a loop that runs."""
    one = System(Loop(PacedClock(1.0)), load_robot("chefbot_lidar"), 1)
    page = NodeEntry(kind="chefbot.ui.page:PageDevice", params={"port": 18480})
    one.launch(Launch(name="test", about="", args={}, nodes={"page": page}))
    thread = threading.Thread(target=one.loop.run)
    thread.start()
    yield one
    one.loop.stop()
    thread.join()
    one.stop()


def shows(page: RemotePage, stopped: bool) -> bool:
    """Whether the page does so before long."""
    for _ in range(200):
        status = page.latest.get("status")
        if status and status["stopped"] is stopped:
            return True
        page.receive(PATIENCE)
    return False


def test_stop_pressed_elsewhere_shows_here_and_can_be_taken_back(system: System) -> None:
    said: list[bool] = []
    system.loop.subscribe("emergency_stop", "test", lambda message: said.append(message.data))  # type: ignore[attr-defined]
    with RemotePage(system.nodes["page"].url) as page:  # type: ignore[attr-defined]
        assert shows(page, False)
        system.loop.post(lambda: system.loop.publish("emergency_stop", Bool(True), "wire", from_device=True))
        assert shows(page, True)
        page.send(Resume())
        assert shows(page, False)
        page.send(Stop())
        assert shows(page, True)
    assert said == [True, False, True]
