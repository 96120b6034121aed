"""Tests that the web UI runs apart from the base: its death stops remote driving, and it comes back as it was."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import msgspec
import pytest
from tests.chaos.launch_process import LaunchProcess, report, run_chefbot, wait_for
from tests.support.waiting import PATIENCE, in_time
from websockets.sync.client import ClientConnection, connect

from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.runtime.launch import built_in_launches, load_launch
from chefbot.safety.velocity_limiter import VelocityLimiterParams
from chefbot.supervision.heartbeat import MAX_SILENCE, PROGRESSING, HeartbeatMonitor
from chefbot.supervision.worker_process import WorkerSpec
from chefbot.ui.access.audit_log import audit_path, read_entries
from chefbot.ui.access.visitors import ENGINEER, SECRET_VARIABLE, TokenKey
from chefbot.ui.web_ui import WebUiDevice

SECRET = "the secret of these tests"
COOKIE = {"Cookie": f"chefbot={TokenKey(SECRET).token(ENGINEER)}"}
STOP_MS = 400.0
"""The base's own command timeout of 300 ms and two periods of its command."""
HUNG_MS = 700.0
"""The same, and the robot's deceleration."""


class Robot:
    """A launch of a simulated robot with its web UI at the network, and what its wheels were commanded."""

    def __init__(self, launch: LaunchProcess, node: Any, port: int) -> None:
        self.launch, self.port = launch, port
        self.speeds: list[tuple[float, float]] = []
        node.subscription("/wheel_speeds", WheelSpeeds, self._on_speeds)

    def _on_speeds(self, message: WheelSpeeds) -> None:
        self.speeds.append((time.monotonic(), abs(message.left) + abs(message.right)))

    @property
    def drives(self) -> bool:
        return bool(self.speeds) and self.speeds[-1][1] > 0.0

    def browser(self) -> ClientConnection:
        """Connect as a phone does, again until it succeeds."""
        url, began = f"ws://127.0.0.1:{self.port}/live", time.monotonic()
        while True:
            with suppress(OSError, Exception):
                return self._stack.enter_context(
                    connect(url, additional_headers=COOKIE, open_timeout=5.0, max_size=None)
                )
            assert time.monotonic() < began + PATIENCE
            time.sleep(0.1)

    _stack = ExitStack()


@contextmanager
def simulated_robot() -> Iterator[Robot]:
    os.environ[SECRET_VARIABLE] = SECRET
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    arguments = ("launch", "chefbot_empty_world", f"port:={port}", "page.host:=0.0.0.0")
    try:
        with run_chefbot(*arguments) as (launch, node), ExitStack() as stack:
            robot = Robot(launch, node, port)
            robot._stack = stack
            yield robot
    finally:
        del os.environ[SECRET_VARIABLE]


def drive(robot: Robot, browser: ClientConnection) -> None:
    """Drive until the wheels are commanded to turn."""

    def repeated() -> bool:
        browser.send('{"do":"drive","v":0.5,"w":0}')
        time.sleep(0.05)
        return robot.drives

    wait_for(repeated)


def stopped_after(robot: Robot, since: float) -> float:
    """Return the time from `since` to the first command of standstill, ms."""
    wait_for(lambda: any(at > since and speed == 0.0 for at, speed in robot.speeds))
    return 1e3 * (next(at for at, speed in robot.speeds if at > since and speed == 0.0) - since)


@pytest.mark.rotated("launches of several processes")
@pytest.mark.slow
@pytest.mark.timed
def test_a_dead_page_stops_remote_driving_and_is_back() -> None:
    with simulated_robot() as robot:
        browser = robot.browser()
        for name, limit in ((signal.SIGKILL, STOP_MS), (signal.SIGSTOP, HUNG_MS)):
            drive(robot, browser)
            page = robot.launch.child("page")
            assert page is not None
            began = time.monotonic()
            os.kill(page, name)
            took = stopped_after(robot, began)
            wait_for(lambda dead=page: robot.launch.child("page") not in (None, dead))
            browser = robot.browser()  # the same port, and the same token
            report(f"{name.name}: stands after {took:.0f} ms, back after {time.monotonic() - began:.1f} s")
            assert in_time(took, limit)
        browser.send(json.dumps({"do": "stop", "id": "again"}))
        wait_for(lambda: "again" in _stop_layer(browser)["confirmed"])
        output = robot.launch.stop()
    actions = [entry.action for entry in read_entries(audit_path("chefbot"))]
    assert actions.count("drive") >= 2 and "stop" in actions
    assert SECRET not in audit_path("chefbot").read_text() and COOKIE["Cookie"] not in output
    assert "Warning: not encrypted" in re.sub(r"\s+", " ", output)


def _stop_layer(browser: ClientConnection) -> dict[str, Any]:
    while True:
        data = browser.recv(timeout=PATIENCE)
        if isinstance(data, str) and json.loads(data).get("layer") == "stop":
            value: dict[str, Any] = json.loads(data)["value"]
            return value


def test_launches_that_drive_serve_the_page_in_its_own_process() -> None:
    """Elsewhere it has nothing to protect: no base in the launch, or another machine."""
    alone = {"model_robot", "remote_page"}
    for name in built_in_launches():
        launch = load_launch(name)
        pages = [entry for entry in launch.nodes.values() if entry.kind.endswith(":WebUiDevice")]
        assert all((entry.process == "page") == (name not in alone) for entry in pages), name
        assert not (name in alone and "base" in launch.nodes)


def test_only_a_process_of_the_page_alone_may_be_late() -> None:
    """Remote driving ends by the base's command timeout before; what navigates stops the robot as soon as ever."""
    launch = load_launch("gmapping_demo")
    with_page = {**launch.nodes, "page": msgspec.structs.replace(launch.nodes["page"], process="slam")}
    for nodes, process, expected in (
        (launch.nodes, "page", WebUiDevice.max_silence),
        (launch.nodes, "slam", MAX_SILENCE),
        (with_page, "slam", MAX_SILENCE),
    ):
        spec = WorkerSpec(msgspec.structs.replace(launch, nodes=nodes), process, ".", 0, 7447)
        assert spec.max_silence == expected
        monitor = HeartbeatMonitor(spec.max_silence)
        monitor.update(PROGRESSING, 0.02)
        late = 0.0
        while not monitor.is_unresponsive:
            late += 0.02
            monitor.update(b"", 0.02)
        assert expected < late < expected + 0.04
    assert VelocityLimiterParams().timeout < WebUiDevice.max_silence


def test_an_invalid_secret_is_reported_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from chefbot.errors import UserError

    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    monkeypatch.setenv(SECRET_VARIABLE, "short")
    with pytest.raises(UserError, match="at least 20 characters"):
        TokenKey.from_environment()
