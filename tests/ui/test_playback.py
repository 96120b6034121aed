"""A recorded log in the web UI: it plays, jumps and pauses, and commands nothing."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.chaos.launch_process import free_port
from tests.support.waiting import PATIENCE
from tests.ui.chromium import NO_GPU, needs_chromium, open_tab
from websockets.sync.client import connect

from chefbot.incidents.files import Incident, save_incident
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.std_msgs import Bool, Float64, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Context
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import RecordedLog, read_log
from chefbot.ui.missions.history_device import history_path
from chefbot.ui.playback.log_player import LogPlayer
from chefbot.ui.playback.playback_device import ONLY_PLAYBACK, PlaybackDevice
from chefbot.ui.web_ui_params import WebUiParams

SECOND = 1_000_000_000
LENGTH = 60
ROBOT = load_robot("chefbot")
INCIDENT = Incident(robot="chefbot", time="2026-01-31T09:05:00Z", sentence="A box.", by="anna")


def recorded() -> Iterator[Publication]:
    """A robot that drives along x at 0.5 m/s for a minute, with an order from the 20th second on."""
    for tenth in range(LENGTH * 10 + 1):
        now_ns = 1000 * SECOND + tenth * SECOND // 10
        stamped = TransformStamped.of(now_ns, "map", "base_link", SE2(0.05 * tenth, 0.0, 0.0))
        yield Publication("tf", TFMessage((stamped,)), "wire", True, now_ns, False)
        if tenth == 550:
            yield Publication("phase", String("The patrol has ended."), "wire", True, now_ns, True)
            yield Publication("emergency_stop", Bool(True), "wire", True, now_ns, True)
        if tenth == 200:
            status = DeliveryStatus(state="driving", place="table_1", description="On the way to table 1.")
            yield Publication("delivery_status", status, "wire", True, now_ns, True)


@pytest.fixture
def log(tmp_path: Path) -> RecordedLog:
    return read_log(save_incident(tmp_path, INCIDENT, recorded(), ROBOT, 7))


class Show:
    """A playback that runs in a thread, and a browser's connection to it."""

    def __init__(self, log: RecordedLog) -> None:
        self.system = NodeContainer(Loop(WallClock(), time.time_ns()), ROBOT, 7)
        context = Context("page", self.system.loop, ROBOT, self.system.transforms, 7)
        self.device = PlaybackDevice(context, WebUiParams(port=free_port()))
        self.device.player, self.device.title = LogPlayer(log.messages), "An incident"
        self.device.start()
        self._thread = threading.Thread(target=self.system.loop.run, daemon=True)
        self._thread.start()
        self.url = self.device.url
        layers = "robot,delivery,playback,status"
        address = f"{self.url.replace('http', 'ws')}live?layers={layers}"
        self._open = ExitStack()
        self.browser = self._open.enter_context(
            connect(address, open_timeout=PATIENCE, close_timeout=1.0, max_size=None)
        )
        self.latest: dict[str, Any] = {}

    def send(self, **command: Any) -> None:
        self.browser.send(json.dumps(command))

    def until(self, done: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Receive until the latest layers are as expected."""
        while not done(self.latest):
            message = json.loads(self.browser.recv(timeout=PATIENCE))
            self.latest["refused" if "refused" in message else message["layer"]] = message.get(
                "refused", message.get("value")
            )
        return self.latest

    def close(self) -> None:
        self._open.close()
        self.system.loop.stop()
        self._thread.join(PATIENCE)
        self.device.stop()


@pytest.fixture
def show(log: RecordedLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Show]:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "state"))
    shown = Show(log)
    yield shown
    shown.close()


@pytest.mark.slow
def test_a_log_plays_at_its_pace(show: Show) -> None:
    show.send(do="playback", rate=20)
    show.until(lambda latest: (latest.get("robot") or {}).get("x", 0.0) > 5.0)
    latest = show.until(lambda latest: (latest.get("playback") or {}).get("rate") == 20)
    assert (latest["playback"]["length"], latest["playback"]["title"]) == (LENGTH, "An incident")
    latest = show.until(lambda latest: latest["playback"]["rate"] == 0)
    assert latest["playback"]["time"] == LENGTH, "it pauses at the end"
    show.until(lambda latest: latest["robot"]["x"] == pytest.approx(30.0))
    show.until(lambda latest: (latest.get("delivery") or {}).get("step") == "On the way to table 1.")
    show.send(do="playback", rate=1)
    show.until(lambda latest: latest["playback"]["time"] < 10.0 and latest["robot"]["x"] < 5.0)
    show.send(do="playback", time=1e9, rate=20)
    show.until(lambda latest: latest["playback"]["time"] == LENGTH and latest["playback"]["rate"] == 0)


def test_a_recording_adds_nothing_to_the_history_of_the_robot(show: Show) -> None:
    show.send(do="playback", time=30.0)
    show.until(lambda latest: (latest.get("delivery") or {}).get("state") == "driving")
    assert not history_path(ROBOT.name).exists()


@pytest.mark.slow
def test_a_jump_shows_what_was_known_then(show: Show) -> None:
    show.send(do="playback", time=50, rate=0)
    show.until(lambda latest: (latest.get("robot") or {}).get("x") == pytest.approx(25.0))
    show.until(lambda latest: (latest.get("delivery") or {}).get("place") == "table_1")
    show.until(lambda latest: (latest.get("playback") or {}).get("time") == 50)
    show.send(do="playback", time=10)
    show.until(lambda latest: latest["robot"]["x"] == pytest.approx(5.0))
    show.until(lambda latest: latest["delivery"] is None)
    assert show.until(lambda latest: latest["status"]["clock"] == 1010)["playback"]["rate"] == 0


@pytest.mark.slow
def test_a_jump_back_forgets_what_came_later(show: Show) -> None:
    show.send(do="playback", time=58, rate=0)
    show.until(lambda latest: (latest.get("status") or {}).get("stopped") is True)
    show.send(do="playback", time=30)
    show.until(lambda latest: latest["status"]["phase"] == "On the way to table 1.")
    show.send(do="playback", time=10)
    latest = show.until(lambda latest: latest["status"]["phase"] == "" and latest["status"]["clock"] == 1010)
    assert not latest["status"]["stopped"] and latest["status"]["reason"] == ""


@pytest.mark.parametrize(
    "command",
    [
        {"do": "goal", "x": 1, "y": 1, "yaw": 0},
        {"do": "stop", "id": "a"},
        {"do": "deliver", "tables": ["table_1"]},
        {"do": "save_incident"},
    ],
)
def test_a_recording_takes_no_commands(show: Show, command: dict[str, Any]) -> None:
    show.send(**command)
    assert show.until(lambda latest: "refused" in latest)["refused"] == ONLY_PLAYBACK


def test_messages_that_cannot_be_shown_are_counted(log: RecordedLog, tmp_path: Path) -> None:
    strangers = (
        Publication("other", Float64(float("nan")), "wire", True, 1000 * SECOND, False),
        Publication("phase", String("fine"), "wire", True, 1000 * SECOND, False),
    )
    other = read_log(save_incident(tmp_path / "other", INCIDENT, strangers, ROBOT, 7))
    broken = [
        log.messages[0]._replace(kind="acme_msgs/msg/Unknown"),
        log.messages[0]._replace(data=b"\0\1\0\0x"),
    ]
    shown = Show(RecordedLog(ROBOT, 7, [*other.messages, *broken]))
    shown.until(lambda latest: (latest.get("status") or {}).get("phase") == "fine")
    shown.close()
    assert shown.device.skipped == 3


@pytest.mark.slow
@needs_chromium
def test_the_slider_and_the_button_in_a_browser(show: Show) -> None:
    with open_tab(show.url, NO_GPU) as tab:
        tab.wait_for("!document.getElementById('playback').hidden")
        for hidden in ("footer", "#tools", "#serve", "#stick", "#keys", "#is-at-box", "#incident-box"):
            assert tab.evaluate(f"getComputedStyle(document.querySelector('{hidden}')).display") == "none"
        show.device._server.set_layer("camera", np.zeros((24, 32, 3), np.uint8))
        tab.wait_for("document.getElementById('camera').offsetHeight >= 24")
        tab.evaluate("document.getElementById('playback-run').click()")
        tab.wait_for("document.getElementById('playback-run').textContent === 'Play'")
        slide = "const t = document.getElementById('playback-time'); t.value = 42; t.oninput(); t.onchange();"
        tab.evaluate(f"(() => {{ {slide} }})()")
        tab.wait_for("document.getElementById('playback-position').textContent === '00:42.0 of 01:00.0'")
        tab.wait_for("document.getElementById('step').textContent === 'On the way to table 1.'")
        tab.call(
            "Input.dispatchKeyEvent", type="keyDown", key="Escape", code="Escape"
        )  # nobody can stop the robot of a recording, so no alarm that it is not stopped
        assert tab.evaluate("[sessionStorage.length, document.body.classList.contains('stopped')]") == [
            0,
            False,
        ]
        assert tab.errors() == []
