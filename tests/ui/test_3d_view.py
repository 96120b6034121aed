"""Tests the 3-D view of the web UI in Chromium with software rendering."""

from __future__ import annotations

import base64
import io
import queue
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image
from tests.support.waiting import PATIENCE
from tests.ui.box_model import boxes_glb
from tests.ui.chromium import SOFTWARE_GL, Tab, needs_chromium, open_tab

from chefbot.design.export.links import links
from chefbot.design.export.urdf import urdf
from chefbot.maths.grid import Grid
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.load import load_robot
from chefbot.ui.commands import Goal, OperatorCommand
from chefbot.ui.display.views import DepthView, FrameView, ScanView
from chefbot.ui.server import WebUiServer

pytestmark = [pytest.mark.slow, needs_chromium]
ROBOT = load_robot("chefbot")
SIZES = {
    "base_link": (0.3, 0.3, 0.02),
    "wheel_left_link": (0.09, 0.01, 0.09),
    "wheel_right_link": (0.09, 0.01, 0.09),
    "payload_link": (0.2, 0.2, 0.3),
}
COMMANDS: queue.Queue[OperatorCommand] = queue.Queue()
IDENTITY_ROTATION = (0.0, 0.0, 0.0, 1.0)
QUARTER_TURN = (0.0, 0.0, 0.5**0.5, 0.5**0.5)
LOADED = "globalThis.modelView && modelView.body.links.size === 4 && modelView.frames.has('imu_link')"
MATRIX = "modelView.frames.settle(), modelView.frames.group({!r}).matrixWorld.toArray()"


@pytest.fixture(scope="module")
def server() -> Iterator[WebUiServer]:
    web_ui = WebUiServer(0, "127.0.0.1", lambda command, _: COMMANDS.put(command), lambda: boxes_glb(SIZES))
    web_ui.set_layer("description", urdf(ROBOT))
    web_ui.set_layer(
        "fixed_frames",
        [FrameView(name="base_link", parent="base_footprint", at=(0, 0, 0.01), turn=IDENTITY_ROTATION)],
    )
    yield web_ui
    web_ui.stop()


@pytest.fixture(scope="module")
def tab(server: WebUiServer) -> Iterator[Tab]:
    url = server.start()
    with open_tab(f"{url}#3d", SOFTWARE_GL) as opened:
        opened.url = url  # type: ignore[attr-defined]
        opened.wait_for(LOADED)
        yield opened


def place_robot(
    server: WebUiServer, at: tuple[float, float, float], turn: tuple[float, float, float, float]
) -> None:
    """Publish the robot's pose in odom, which is displaced by a metre in the map."""
    odom = FrameView(name="odom", parent="map", at=(1, 0, 0), turn=IDENTITY_ROTATION)
    server.set_layer("frames", [odom, FrameView(name="base_footprint", parent="odom", at=at, turn=turn)])


def pose(tab: Tab, frame: str) -> np.ndarray:
    """Return the transform (4, 4) of a frame in the drawn scene."""
    tab.wait_for("modelView.frames.glides.done")
    return np.array(tab.evaluate(MATRIX.format(frame))).reshape(4, 4).T


def pixels(tab: Tab) -> np.ndarray:
    """Return the pixels of the 3-D view on the screen, shape (h, w, 3)."""
    box = tab.evaluate("JSON.parse(JSON.stringify(model.getBoundingClientRect()))")
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    clip = {key: box[key] for key in ("x", "y", "width", "height")} | {"scale": 1}
    shot = base64.b64decode(tab.call("Page.captureScreenshot", clip=clip)["data"])
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)


@pytest.mark.rotated("3-D view")
def test_links_are_drawn_at_their_poses_in_the_description(tab: Tab) -> None:
    tab.evaluate("document.getElementById('fixed-frame').value = 'base_link', modelView.prepare()")
    for link in links(ROBOT):
        assert np.allclose(pose(tab, link.name)[:3, 3], link.at, atol=1e-9)
        parent = tab.evaluate(f"modelView.body.links.get({link.name!r}).parent.name")
        assert parent == link.name
    assert pose(tab, "camera_depth_optical_frame")[:3, :3] == pytest.approx(
        np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), abs=1e-8
    )
    names = tab.evaluate("[...document.querySelectorAll('#links button')].map((row) => row.textContent)")
    assert "wheel_left_link60 g" in names
    assert (
        tab.evaluate("document.getElementById('links-total').textContent")
        == f"4 with mass, {total_mass(ROBOT):.2f} kg"
    )


def test_the_model_is_drawn_and_orbiting_changes_the_view(tab: Tab) -> None:
    before = pixels(tab)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 100
    x, y = tab.centre("#model")
    tab.mouse("mousePressed", x, y)
    tab.mouse("mouseMoved", x + 120, y)
    tab.mouse("mouseReleased", x + 120, y)
    assert (np.abs(pixels(tab) - before).max(axis=2) > 20).mean() > 0.02


def test_a_slider_turns_its_wheel_until_the_robot_moves_it(tab: Tab, server: WebUiServer) -> None:
    tab.evaluate(
        "(() => { const slider = document.querySelector('[name=wheel_left_joint]'); slider.value = 0.5;"
        " slider.dispatchEvent(new Event('input')); })()"
    )
    base, wheel, other = (pose(tab, name) for name in ("base_link", "wheel_left_link", "wheel_right_link"))
    top = np.linalg.inv(base) @ wheel @ [0, 0, 1, 0]
    assert top[:3] == pytest.approx([np.sin(0.5), 0, np.cos(0.5)], abs=1e-6)
    assert np.allclose((np.linalg.inv(base) @ other)[:3, :3], np.eye(3), atol=1e-9)
    assert "29°" in tab.evaluate("document.getElementById('joints').textContent")
    server.set_layer("joints", {"wheel_left_joint": 1.0, "wheel_right_joint": 6.0})
    tab.wait_for("document.querySelector('[name=wheel_left_joint]').disabled")
    turned = np.linalg.inv(pose(tab, "base_link")) @ pose(tab, "wheel_right_link") @ [0, 0, 1, 0]
    assert turned[:3] == pytest.approx([np.sin(6.0), 0, np.cos(6.0)], abs=1e-6)


def test_the_fixed_frame_stands_still_and_others_move(tab: Tab, server: WebUiServer) -> None:
    place_robot(server, (2.0, 1.0, 0.0), QUARTER_TURN)
    tab.wait_for("modelView.frames.received.has('odom')")
    expected = {"map": (3.0, 1.0, 0.01), "odom": (2.0, 1.0, 0.01), "base_link": (0.0, 0.0, 0.0)}
    for frame, place in expected.items():
        tab.evaluate(f"document.getElementById('fixed-frame').value = {frame!r}, modelView.prepare()")
        assert np.allclose(pose(tab, frame), np.eye(4), atol=1e-9)
        assert pose(tab, "base_link")[:3, 3] == pytest.approx(place, abs=1e-9)
    assert pose(tab, "odom")[:3, 3] == pytest.approx((-1.0, 2.0, -0.01), abs=1e-9)


def test_scan_points_are_at_the_height_of_their_sensor(tab: Tab, server: WebUiServer) -> None:
    server.set_layer("map", Grid(np.zeros((40, 60), np.int8), 0.05, -1.0, -1.0))
    server.set_layer("path", [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    server.set_layer(
        "scan", ScanView((1.0, 0.0, 0.0), np.array([0.0, np.pi / 2]), np.array([2.0, 1.0]), "camera_link")
    )
    tab.wait_for("['map', 'path', 'scan'].every((layer) => modelView.live.objects.has(layer))")
    points = tab.evaluate("[...modelView.live.objects.get('scan').geometry.attributes.position.array]")
    height = 0.01 + ROBOT.sensors.depth_camera.mount.z  # type: ignore[union-attr]
    assert np.array(points).reshape(-1, 3) == pytest.approx(
        np.array([[3, 0, height], [1, 1, height]]), abs=1e-6
    )
    assert tab.evaluate("modelView.live.objects.get('map').position.toArray()") == pytest.approx(
        [0.5, 0.0, 0.0]
    )


def test_the_depth_points_lie_ahead_of_the_camera(tab: Tab, server: WebUiServer) -> None:
    depth = np.full((3, 5), np.nan, np.float32)
    depth[2, 4] = 2.0
    server.set_layer("depth", DepthView(depth, 100.0, 2.0, 1.0, "camera_depth_optical_frame"))
    tab.wait_for("modelView.live.objects.has('depth')")
    parent = tab.evaluate("modelView.live.objects.get('depth').parent.name")
    points = tab.evaluate("[...modelView.live.objects.get('depth').geometry.attributes.position.array]")
    assert parent == "camera_depth_optical_frame"
    assert points == pytest.approx([0.04, 0.02, 2.0], abs=1e-6)


def test_updates_do_not_leak_memory_or_shaders(tab: Tab) -> None:
    updates = """(() => {
      const rows = new Float32Array([0, 0, 1, 0, 1, 1]), points = { rows, count: 3, frame: "camera_link" };
      const grid = { width: 2, height: 2, resolution: 1, x: 0, y: 0, cells: new Int8Array([0, 100, -1, 50]) };
      for (let i = 0; i < 20; i++) {
        for (const layer of ["scan", "path"]) modelView.take(layer, points);
        modelView.take("map", grid);
        modelView.stage.draw();
      }
      const { memory, programs } = modelView.stage.renderer.info;
      return JSON.stringify([memory, programs.map((program) => program.id)]);
    })()"""
    before = tab.evaluate(updates)
    assert tab.evaluate(updates) == before


def test_a_standing_robot_is_not_redrawn(tab: Tab) -> None:
    drawn = """(() => {
      const frames = [{ name: "base_footprint", parent: "odom", at: [2, 1, 0], turn: [0, 0, 0, 1] }];
      modelView.take("frames", frames);
      modelView.stage.draw();
      modelView.stage.pending = false;
      modelView.take("frames", structuredClone(frames));
      modelView.take("status", { clock: Math.random() });
      const still = !modelView.stage.pending;
      frames[0].at[0] += 0.01;
      modelView.take("frames", frames);
      return [still, modelView.stage.pending];
    })()"""
    tab.wait_for("modelView.frames.glides.done")
    assert tab.evaluate(f"{drawn}") == [True, True]


def test_a_click_selects_a_link_in_view_and_list(tab: Tab) -> None:
    tab.evaluate("modelView.home(), modelView.choose('payload_link')")
    assert tab.evaluate("document.querySelector('[data-link=payload_link]').ariaPressed") == "true"
    tab.evaluate("modelView.choose('payload_link')")
    tab.click("#model")
    chosen = tab.evaluate("modelView.body.chosen")
    assert chosen in SIZES
    assert tab.evaluate(f"document.querySelector('[data-link={chosen}]').ariaPressed") == "true"


def screen_position(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Return the position in the window of a point of the floor in the map frame."""
    left, top, width, height = tab.evaluate(
        "(() => { const box = model.getBoundingClientRect(); return [box.left, box.top, box.width, box.height]; })()"
    )
    across, down = tab.evaluate(
        "(() => { modelView.frames.settle(); modelView.stage.camera.updateMatrixWorld();"
        f" const place = modelView.frames.home.localToWorld(modelView.stage.controls.target.clone().set({x}, {y}, 0))"
        ".project(modelView.stage.camera); return [place.x, place.y]; })()"
    )
    return left + width * (1 + across) / 2, top + height * (1 - down) / 2


@pytest.mark.rotated("3-D view")
def test_dragging_on_the_floor_sends_a_goal_without_orbiting(tab: Tab) -> None:
    tab.resize(1280, 800)  # the place on the floor lies under no button
    tab.evaluate("document.getElementById('fixed-frame').value = 'odom', modelView.home()")
    tab.wait_for("modelView.frames.glides.done && !modelView.stage.pending")
    before = tab.evaluate("modelView.stage.camera.position.toArray()")
    base = tab.evaluate(
        "modelView.frames.home.worldToLocal(modelView.stage.controls.target.clone()).toArray()"
    )
    x, y = base[0] + 0.2, base[1] - 0.1
    start, end = screen_position(tab, x, y), screen_position(tab, x - 0.1, y + 0.15)
    tab.click("[data-tool=goal]")
    tab.mouse("mousePressed", *start)
    tab.mouse("mouseMoved", *end)
    tab.wait_for("modelView.live.objects.has('aim')")
    tab.mouse("mouseReleased", *end)
    goal = COMMANDS.get(timeout=PATIENCE)
    assert isinstance(goal, Goal)
    assert (goal.x, goal.y) == pytest.approx((x, y), abs=0.01)
    assert goal.yaw == pytest.approx(np.arctan2(0.15, -0.1), abs=0.1)
    assert not tab.evaluate("modelView.live.objects.has('aim')")
    assert tab.evaluate("modelView.stage.camera.position.toArray()") == pytest.approx(before)
    assert tab.evaluate("modelView.stage.controls.enabled")


def test_frame_labels_do_not_overlap(tab: Tab) -> None:
    tab.evaluate(
        "document.getElementById('fixed-frame').value = 'base_link', modelView.prepare(), modelView.home()"
    )
    tab.click("[name=names]")
    names = "[...document.querySelectorAll('#model-names span')].map((span) => span.textContent)"
    tab.wait_for(f"{names}.includes('camera_depth_optical_frame')")
    pixels(tab)
    boxes = tab.evaluate(
        "[...document.querySelectorAll('#model-names span')].map((span) => {"
        " const box = span.getBoundingClientRect();"
        " return [span.textContent, box.left, box.top, box.right, box.bottom]; })"
    )
    assert {"base_link", "imu_link", "camera_depth_optical_frame"} <= {box[0] for box in boxes}
    for i, (_, left, top, right, bottom) in enumerate(boxes):
        for _, left2, top2, right2, bottom2 in boxes[:i]:
            apart = right <= left2 or right2 <= left or bottom <= top2 + 0.6 or bottom2 <= top + 0.6
            assert apart


def test_switching_between_map_and_model_works(tab: Tab, server: WebUiServer) -> None:
    tab.click("#solid")
    assert (
        tab.evaluate("location.hash + getComputedStyle(document.getElementById('tools')).display") == "flex"
    )
    assert tab.evaluate("document.getElementById('canvas').clientWidth") > 100
    place_robot(server, (0.0, 0.0, 0.0), IDENTITY_ROTATION)
    tab.evaluate("location.hash = '#3d'")
    tab.wait_for("document.body.classList.contains('solid')")
    tab.wait_for("modelView.frames.group('base_footprint').position.x === 0")


WRITE_BEFORE_EVENT = """(async () => {
    const { ViewAddress } = await import("./address.js"), wanted = [];
    const shown = () => Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    const address = new ViewAddress(shown, (parameters) => wanted.push(parameters.has("3d")));
    const before = location.hash;
    location.hash = "#3d";
    address.read = () => ({});           // still the view from above
    address.write();
    address.read = shown;
    return [before, location.hash, wanted.at(-1)];
})()"""


def test_an_address_is_followed_before_its_event_arrives(tab: Tab) -> None:
    tab.evaluate("document.body.classList.contains('solid') && document.getElementById('solid').click()")
    tab.wait_for("location.hash === ''")
    assert tab.evaluate(WRITE_BEFORE_EVENT) == ["", "#3d", True]
    tab.wait_for("document.body.classList.contains('solid')")


def test_poses_are_interpolated_between_updates(tab: Tab, server: WebUiServer) -> None:
    place_robot(server, (0.0, 0.0, 0.0), IDENTITY_ROTATION)
    tab.wait_for("modelView.frames.received.has('base_footprint')")
    tab.wait_for("modelView.frames.group('base_footprint').position.x === 0")
    places = tab.evaluate(
        "(() => { const frames = modelView.frames, group = frames.group('base_footprint'), seen = [];"
        " frames.glides.updated.set('base_footprint', performance.now() - 100);"
        " frames.update([{ name: 'base_footprint', parent: 'odom', at: [0.1, 0, 0], turn: [0, 0, 0, 1] }]);"
        " const { start } = frames.glides.active.get('base_footprint');"
        " for (const later of [0, 50, 1000]) { frames.glides.advance(start + later); seen.push(group.position.x); }"
        " return seen; })()"
    )
    assert places == pytest.approx([0.0, 0.05, 0.1], abs=0.002)


@pytest.mark.rotated("3-D view")
def test_a_broken_description_is_explained_and_retried() -> None:
    web_ui = WebUiServer(0, "127.0.0.1", print)
    web_ui.set_layer("description", "<robot><link name='bro")
    url = web_ui.start()
    with open_tab(f"{url}#3d", SOFTWARE_GL) as tab:
        tab.wait_for("document.getElementById('model-note').textContent.includes('not XML')")
        web_ui.set_layer("description", urdf(ROBOT))
        tab.wait_for("modelView.axes.get('imu_link')?.visible")
        base = FrameView(name="base_footprint", parent="odom", at=(0, 0, 0), turn=IDENTITY_ROTATION)
        web_ui.set_layer("frames", [base])
        tab.wait_for("modelView.known.has('frames')")
        web_ui.stop()
        assert "no robot" in tab.evaluate("document.getElementById('model-note').textContent")
        robot = WebUiServer(urlsplit(url).port or 0, "127.0.0.1", print, lambda: boxes_glb(SIZES))
        assert robot.start() == url
        tab.wait_for(LOADED)
        assert tab.evaluate("document.getElementById('model-note').hidden")
        assert not [event for event in tab.errors() if event.get("method") == "Runtime.exceptionThrown"]
        robot.stop()


@pytest.mark.rotated("3-D view")
def test_a_browser_without_3d_still_shows_the_map() -> None:
    web_ui = WebUiServer(0, "127.0.0.1", print)
    flags = ["--disable-gpu", "--disable-3d-apis"]
    with open_tab(f"{web_ui.start()}#3d", flags) as tab:
        tab.wait_for("document.getElementById('notice').textContent.includes('cannot show the robot in 3-D')")
        assert tab.evaluate("document.getElementById('canvas').clientWidth") > 100
    web_ui.stop()


def test_no_request_to_another_host_and_no_console_error(tab: Tab) -> None:
    """This test has to be the last, as it checks the requests and messages of all others."""
    url: Any = tab.url  # type: ignore[attr-defined]
    own = (url, url.replace("http", "ws"), "blob:", "data:", "about:")
    requested = tab.requested_urls()
    assert requested.count(f"{url}robot.glb") == 1
    assert f"{url}vendor/three/three.module.min.js" in requested
    assert [address for address in requested if not address.startswith(own)] == []
    assert tab.errors() == []
