"""Runs a robot with two web UIs."""

from __future__ import annotations

import threading

from chefbot.msgs.std_msgs import Bool
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.remote.web_ui_client import WebUiClient
from tests.chaos.launch_process import free_port
from tests.support.nodes import WITHOUT_SENSORS

BASE = NodeEntry(kind="chefbot.nodes.drive_base:DriveBaseNode", params=WITHOUT_SENSORS)


class Robot:
    """Two web UIs in a running loop, with or without a drive base; records the messages of the emergency stop."""

    def __init__(self, *, base: bool) -> None:
        self.system = NodeContainer(Loop(PacedClock(1.0)), load_robot("chefbot_lidar"), 1)
        pages = {
            name: NodeEntry(kind="chefbot.ui.web_ui:WebUiDevice", params={"port": free_port()})
            for name in ("here", "there")
        }
        nodes = {**pages, "base": BASE} if base else pages
        self.system.launch(Launch(name="test", description="", args={}, nodes=nodes))
        self.stop_states: list[bool] = []
        self.stop_requests: list[bool] = []
        loop = self.system.loop
        loop.subscribe("emergency_stop", "test", lambda message: self.stop_states.append(message.data))  # type: ignore[attr-defined]
        loop.subscribe("stop_request", "test", lambda message: self.stop_requests.append(message.data))  # type: ignore[attr-defined]
        self._thread = threading.Thread(target=loop.run)
        self._thread.start()

    def page(self, name: str) -> WebUiClient:
        return WebUiClient(self.system.nodes[name].url)  # type: ignore[attr-defined]

    def publish(self, topic: str, value: bool) -> None:
        loop = self.system.loop
        loop.post(lambda: loop.publish(topic, Bool(value), "wire", from_device=True))

    def stop(self) -> None:
        self.system.loop.stop()
        self._thread.join()
        self.system.stop()
