"""Tests that the robot's solids are generated once on request, and the layers of the 3-D view."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import threading
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec

import httpx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.control.kinematics import wheel_speeds
from chefbot.design.export.urdf import urdf
from chefbot.errors import UserError
from chefbot.launcher.launch import run_launch
from chefbot.launcher.session import session, start
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.browser import url_for_view
from chefbot.ui.display.robot_view import make_glb, wheel_angles
from chefbot.ui.remote.web_ui_client import WebUiClient
from chefbot.ui.server import WebUiServer
from chefbot.ui.web_ui import WebUiDevice

ROBOT = load_robot("chefbot")
LOOPBACK = "127.0.0.1"
SECOND = 1_000_000_000


@contextmanager
def serve(model: object) -> Iterator[str]:
    server = WebUiServer(0, LOOPBACK, print, model)  # type: ignore[arg-type]
    yield server.start()
    server.stop()


def test_the_glb_is_built_once_on_first_request() -> None:
    calls: list[str] = []

    def make() -> bytes:
        calls.append(threading.current_thread().name)
        return b"glTF"

    with serve(make) as url:
        httpx.get(url)
        assert calls == []
        with ThreadPoolExecutor(4) as browsers:
            answers = list(browsers.map(lambda _: httpx.get(f"{url}robot.glb"), range(4)))
        assert {answer.content for answer in answers} == {b"glTF"}
        assert answers[0].headers["content-type"] == "model/gltf-binary"
        assert answers[0].headers["x-content-type-options"] == "nosniff"
    assert len(calls) == 1
    assert calls[0] != "operator page", "generation in this thread would delay an emergency stop"


@pytest.mark.slow
def test_an_invalid_robot_is_reported_in_one_sentence() -> None:
    def reject() -> bytes:
        raise UserError("robot.yaml: the notch lies outside the plate")

    with serve(reject) as url:
        answer = httpx.get(f"{url}robot.glb")
        assert (answer.status_code, answer.text) == (500, "robot.yaml: the notch lies outside the plate")
        assert httpx.get(url).status_code == 200
    with serve(None) as url:
        assert httpx.get(f"{url}robot.glb").status_code == 404


@pytest.mark.skipif(
    find_spec("chefbot.design.solids.glb") is None, reason="needs the robot's solids as meshes"
)
@pytest.mark.parametrize("name", ["chefbot", "chefbot_lidar"])
def test_every_link_with_mass_has_a_solid_in_the_glb(name: str) -> None:
    robot = load_robot(name)
    glb = make_glb(robot)
    (size,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + size])
    links_with_mass = {
        link.get("name") for link in ET.fromstring(urdf(robot)).iter("link") if len(link.findall("inertial"))
    }
    assert (
        {"base_link", "wheel_left_link"}
        <= links_with_mass
        <= {node.get("name") for node in document["nodes"]}
    )
    assert [buffer for buffer in document["buffers"] if "uri" in buffer] == []
    assert "images" not in document, "the content security policy forbids images from blobs"


def test_the_glb_needs_the_token_on_a_network() -> None:
    server = WebUiServer(0, "0.0.0.0", print, lambda: b"glTF")
    port = server.start().split(":")[2].split("/")[0]
    assert httpx.get(f"http://{LOOPBACK}:{port}/robot.glb").status_code == 403
    server.stop()


@given(st.floats(-0.5, 0.5), st.floats(-2.0, 2.0), st.floats(0.0, 500.0))
def test_wheel_angles_match_the_rolled_distance(v: float, w: float, seconds: float) -> None:
    turned = np.array(wheel_speeds(v, w, ROBOT)) * seconds
    ticks = np.rint(turned * ROBOT.motor.ticks_per_turn / (2 * np.pi)).astype(int)
    shown = wheel_angles(WheelTicks(Header(), *ticks.tolist()), ROBOT)
    angles = np.array([shown["wheel_left_joint"], shown["wheel_right_joint"]])
    assert (
        np.abs(np.exp(1j * angles) - np.exp(1j * turned)).max() <= np.pi / ROBOT.motor.ticks_per_turn + 1e-9
    )


def test_the_address_opens_the_requested_view() -> None:
    assert url_for_view("http://robot:8080/?token=x", "3d") == "http://robot:8080/?token=x#3d"
    assert url_for_view("http://robot:8080/#3d", "3d") == "http://robot:8080/#3d"
    assert url_for_view("http://robot:8080/#3d", "2d") == "http://robot:8080/"


def layers_of(system: NodeContainer, layers: set[str]) -> dict[str, object]:
    """Run a launch until its web UI has sent the given layers, and return all its layers."""
    page = system.nodes["page"]
    assert isinstance(page, WebUiDevice)
    with WebUiClient(page.url) as remote:
        for _ in range(50):
            system.loop.run(until_ns=system.loop.now_ns + SECOND // 10)
            while remote.receive(0.1):
                pass
            if layers <= set(remote.latest):
                return dict(remote.latest)
    raise AssertionError(f"not received: {layers - set(remote.latest)}")


@pytest.mark.slow
def test_model_robot_shows_every_frame_and_free_wheels() -> None:
    launch = load_launch("model_robot", {"port": "18720"})
    with session(load_robot("chefbot"), 1, launch.clock, 0.0, None) as system:
        start(system, launch)
        shown = layers_of(system, {"description", "frames", "fixed_frames"})
        assert "#3d" in getattr(system.nodes["page"], "announcement", "")
    frames = {frame["name"]: frame["parent"] for frame in (*shown["frames"], *shown["fixed_frames"])}  # type: ignore[misc]
    assert frames["odom"] == "map"
    assert frames["base_footprint"] == "odom"
    assert frames["base_link"] == "base_footprint"
    links = {link.get("name") for link in ET.fromstring(str(shown["description"])).iter("link")}
    assert set(frames) <= links | {"map", "odom"}
    assert "joints" not in shown, "the wheels are turned by the sliders only"


@pytest.mark.slow
def test_a_running_robot_shows_its_wheels_and_depth() -> None:
    launch = load_launch("chefbot_empty_world", {"port": "18740", "world": "room"})
    with session(load_robot("chefbot"), 1, launch.clock, 0.0, None) as system:
        start(system, launch)
        shown = layers_of(system, {"joints", "depth", "frames", "fixed_frames", "description"})
    assert set(shown["joints"]) == {"wheel_left_joint", "wheel_right_joint"}  # type: ignore[call-overload]


def test_view_robot_opens_the_running_robot_in_3d(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    with serve(None) as url:
        run_launch("view_robot", [f"page:={url}"])
        assert opened == [f"{url}#3d"]


@pytest.mark.parametrize("name", ["model_robot", pytest.param("chefbot_empty_world", marks=pytest.mark.slow)])
@pytest.mark.slow
def test_no_cad_library_is_imported_before_the_3d_view(name: str) -> None:
    script = (
        "import sys; from chefbot.launcher.launch import run_launch; "
        f"run_launch({name!r}, ['duration:=0.3', 'speed:=0', 'port:=18760']); "
        "sys.exit(bool({'trimesh', 'manifold3d', 'shapely'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
