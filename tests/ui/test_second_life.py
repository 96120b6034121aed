"""The page's process died and is there again: a STOP that was pressed stays pressed, and everybody sees it."""

from __future__ import annotations

import socket

import pytest

from chefbot.msgs.std_msgs import Bool
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import LAST_WORDS
from chefbot.runtime.system import System
from chefbot.ui.page import PageDevice


@pytest.mark.parametrize("pressed", [True, False])
def test_stop_outlives_the_page(pressed: bool) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    system = System(Loop(StepClock()), load_robot("chefbot"), 1)
    entry = NodeEntry(kind="chefbot.ui.page:PageDevice", params={"port": port})
    system.launch(Launch(name="again", about="", args={}, nodes={"page": entry}))
    try:
        said: list[bool] = []
        system.loop.subscribe("emergency_stop", "test", lambda one: said.append(one.data))  # type: ignore[attr-defined]
        system.loop.publish(LAST_WORDS + "emergency_stop", Bool(pressed), "wire", from_device=True)
        system.loop.run(until_ns=system.loop.now_ns + 1_000_000)
        assert said == [True] * pressed  # it never takes one back by itself
        page = system.nodes["page"]
        assert isinstance(page, PageDevice)
        assert page._status(None).stopped == pressed
    finally:
        system.stop()
