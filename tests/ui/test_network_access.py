"""Tests the web UI on a network: its address, token and QR code."""

from __future__ import annotations

import httpx
import pytest
import segno

from chefbot.errors import UserError
from chefbot.launcher.lan_access import ALL_ADDRESSES, with_ui_address
from chefbot.runtime.launch import load_launch
from chefbot.ui.qr import qr_code
from chefbot.ui.server import WebUiServer


@pytest.mark.parametrize(
    "name", ["amcl_demo", "explore", "waiter", "robot_standalone", "remote_page", "model_robot"]
)
def test_every_launch_with_a_web_ui_can_serve_the_network(name: str) -> None:
    launch = with_ui_address(load_launch(name), ALL_ADDRESSES)
    hosts = [
        entry.params.get("host") for entry in launch.nodes.values() if entry.kind.endswith(":WebUiDevice")
    ]
    assert hosts == [ALL_ADDRESSES]
    assert len(launch.nodes) == len(load_launch(name).nodes)


def test_a_launch_without_a_web_ui_is_rejected() -> None:
    with pytest.raises(UserError, match="has no web UI: headless:=true leaves it out"):
        with_ui_address(load_launch("amcl_demo", {"headless": "true"}), ALL_ADDRESSES)
    with pytest.raises(UserError, match="keyboard_teleop has no web UI"):
        with_ui_address(load_launch("keyboard_teleop"), ALL_ADDRESSES)


def test_the_token_works_for_any_address_of_this_machine() -> None:
    server = WebUiServer(0, ALL_ADDRESSES, print)
    url = server.start()
    try:
        port, token = httpx.URL(url).port, httpx.URL(url).params["token"]
        assert server.requires_token
        here = f"http://127.0.0.1:{port}/"
        headers = {"host": f"192.168.7.23:{port}"}
        assert httpx.get(here, headers=headers).status_code == 403
        assert (
            httpx.get(here, headers={"host": f"robot.example:{port}"}, params={"token": token}).status_code
            == 403
        )
        with httpx.Client(headers=headers) as phone:
            assert phone.get(here, params={"token": token}).status_code == 303
            cookies = phone.get(here, params={"token": token}).headers["set-cookie"]
            page = httpx.get(here, headers={**headers, "cookie": cookies.partition(";")[0]})
            assert page.status_code == 200 and "STOP" in page.text
    finally:
        server.stop()


def test_the_qr_code_is_the_address_and_fits_a_terminal() -> None:
    address = "http://192.168.7.23:8080/?token=abcdefghijklmnopqrstuv"
    lines = qr_code(address).split("\n")
    assert len({len(line) for line in lines}) == 1 and len(lines) <= 24
    light = [row for line in lines for row in ([c in "█▀" for c in line], [c in "█▄" for c in line])]
    matrix = segno.make(address, error="l", micro=False, boost_error=False).matrix
    drawn = [row[2:-2] for row in light[2 : 2 + len(matrix)]]
    assert drawn == [[not module for module in row] for row in matrix]
