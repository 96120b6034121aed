"""Tests access control of the web UI and the helpers of its server."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import httpx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.ui import real_time_factor
from chefbot.ui.access.identification import Identification
from chefbot.ui.access.visitors import ENGINEER, TokenKey
from chefbot.ui.browser import url_for_view
from chefbot.ui.display.message_conversion import cost_image, path_points
from chefbot.ui.remote.viewer import ViewerDevice, ViewerParams
from chefbot.ui.request_guard import COOKIE, RequestGuard
from chefbot.ui.solids import GLB, SolidsEndpoint
from chefbot.ui.web_ui_params import WebUiParams

KEY = TokenKey("a secret of this test")
TOKEN = KEY.token(ENGINEER)


def get(path: str, host: str, key: TokenKey | None = None, cookie: str = "") -> httpx.Response:
    app = Starlette(routes=[Route("/", lambda _: PlainTextResponse("page"))])
    guard = RequestGuard(app, ["robot.local"], ["robot.example.org"], Identification(key) if key else None)

    async def send() -> httpx.Response:
        transport = httpx.ASGITransport(app=guard)  # type: ignore[arg-type]
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            headers = {"host": host} | ({"cookie": f"{COOKIE}={cookie}"} if cookie else {})
            return await client.get(path, headers=headers)

    return asyncio.run(send())


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1", "[::1]:80", "192.168.0.7", "robot.local"])
def test_addresses_and_the_own_name_are_allowed_hosts(host: str) -> None:
    assert get("/", host).text == "page"


@pytest.mark.parametrize("host", ["evil.example", "localhost.evil.example", "", "[", "127.0.0.1.evil"])
def test_other_host_names_are_rejected(host: str) -> None:
    assert get("/", host).status_code == 403


def test_the_token_of_the_address_becomes_a_cookie() -> None:
    first = get(f"/?token={TOKEN}", "localhost", KEY)
    assert first.status_code == 303 and first.headers["location"] == "/"
    assert "httponly" in first.headers["set-cookie"].lower()
    assert "samesite=strict" in first.headers["set-cookie"].lower()
    assert get("/", "localhost", KEY, cookie=TOKEN).text == "page"
    for path, cookie in (("/", ""), ("/?token=wrong", ""), ("/", "wrong")):
        assert get(path, "localhost", KEY, cookie).status_code == 403


@pytest.mark.parametrize(
    ("host", "origin", "passes"),
    [
        (b"localhost", None, True),
        (b"localhost", b"http://localhost", True),
        (b"localhost", b"http://evil", False),
        (b"localhost", b"https://localhost", False),
        (b"robot.example.org", b"https://robot.example.org", True),
        (b"robot.example.org", b"https://evil", False),
    ],
)
def test_a_websocket_of_another_origin_is_closed(host: bytes, origin: bytes | None, passes: bool) -> None:
    events: list[Any] = []

    async def app(*_: Any) -> None:
        events.append("app")

    async def send(message: Any) -> None:
        events.append(message)

    async def receive() -> Any:
        raise AssertionError("nothing is read")

    headers = [(b"host", host)] + ([(b"origin", origin)] if origin else [])
    guard = RequestGuard(app, [], ["robot.example.org"])
    asyncio.run(guard({"type": "websocket", "headers": headers}, receive, send))
    assert events == (["app"] if passes else [{"type": "websocket.close", "code": 1008}])


def test_the_solids_are_generated_once_off_the_event_loop() -> None:
    calls: list[str] = []

    def make() -> bytes:
        calls.append(threading.current_thread().name)
        return b"glTF"

    async def both() -> list[Any]:
        endpoint = SolidsEndpoint(make)
        request = Request({"type": "http", "headers": []})
        return await asyncio.gather(endpoint.serve(request), endpoint.serve(request))

    answers = asyncio.run(both())
    assert [(answer.body, answer.media_type) for answer in answers] == [(b"glTF", GLB)] * 2
    assert len(calls) == 1 and calls[0] != threading.main_thread().name


def test_missing_and_invalid_solids_are_errors() -> None:
    def invalid() -> bytes:
        raise UserError("the wheel is too small")

    request: Any = None
    assert asyncio.run(SolidsEndpoint(None).serve(request)).status_code == 404
    answer = asyncio.run(SolidsEndpoint(invalid).serve(request))
    assert (answer.status_code, answer.body) == (500, b"the wheel is too small")


@given(st.integers(-1, 100))
def test_costs_are_scaled_in_order_with_unknown_apart(cost: int) -> None:
    image = cost_image(Grid(np.array([[cost, 0]], np.int8), 0.05, 1.0, 2.0))
    assert image.cells[0, 0] == (255 if cost < 0 else cost * 254 // 100) and image.cells[0, 1] == 0
    assert (image.resolution, image.origin_x, image.origin_y) == (0.05, 1.0, 2.0)


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), max_size=5), st.floats(-3, 3))
def test_path_points_are_transformed_to_the_map(points: list[tuple[float, float]], yaw: float) -> None:
    frame = SE2(1.0, -2.0, yaw)
    path = Path(Header(), tuple(PoseStamped(Header(), Pose.of(SE2(x, y, 0.0))) for x, y in points))
    expected = [[*(frame @ SE2(x, y, 0.0))[:2]] for x, y in points]
    assert path_points(path, frame) == pytest.approx(np.array(expected).reshape(-1, 2))


def test_the_real_time_factor_is_measured_over_half_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = [0]
    monkeypatch.setattr(real_time_factor, "wall_ns", lambda: wall[0])
    meter = real_time_factor.RealTimeFactor(0)
    wall[0] = 400_000_000
    assert meter.factor(800_000_000) is None
    wall[0] = 1_000_000_000
    assert meter.factor(3_000_000_000) == 3.0
    wall[0] = 1_100_000_000
    assert meter.factor(3_000_000_000) == 3.0, "the next period is not over"
    wall[0] = 2_000_000_000
    assert meter.factor(3_500_000_000) == 0.5


@given(st.sampled_from(["http://robot:80/", "http://robot/?token=x", "http://robot/#2d"]))
def test_the_view_is_a_fragment_of_the_address(url: str) -> None:
    plain = url_for_view(url, "2d")
    assert "#" not in plain and url_for_view(url, "3d") == f"{plain}#3d"
    assert url_for_view(url_for_view(url, "3d"), "2d") == plain


def test_the_viewer_needs_a_running_robot() -> None:
    from chefbot.robot.load import load_robot
    from chefbot.runtime.clock import StepClock
    from chefbot.runtime.loop import Loop
    from chefbot.runtime.node import Context
    from chefbot.runtime.transform_buffer import TransformBuffer

    context = Context("viewer", Loop(StepClock()), load_robot("chefbot"), TransformBuffer())
    with pytest.raises(UserError, match="no robot runs at"):
        ViewerDevice(context, ViewerParams(page="http://127.0.0.1:1/")).start()
    assert WebUiParams().host == "127.0.0.1", "the network is opened on request only"
