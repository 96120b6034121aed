"""Mapping and deliveries follow each other in one program, by the web UI of a running robot."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from tests.chaos.launch_process import LaunchProcess, free_port, wait_for
from tests.support.waiting import PATIENCE

from chefbot.errors import UserError
from chefbot.mapping.map_format import FREE_THRESH
from chefbot.ui import commands as do
from chefbot.ui.remote.web_ui_client import WebUiClient


def page_of(url: str, *, mapping: bool) -> WebUiClient:
    """Connect to the web UI of the launch that maps, or of the one that does not, as soon as it serves."""
    found: list[WebUiClient] = []

    def is_there() -> bool:
        with contextlib.suppress(UserError):  # nothing serves yet, or the launch before ends
            page = WebUiClient(url)
            view = page.wait_for("launch", 5.0)
            if view is not None and view["mapping"] == mapping:
                found.append(page)
                return True
            page.close()
        return False

    wait_for(is_there)
    return found[0]


def has_free_floor(page: WebUiClient) -> bool:
    """Return whether the web UI shows a map with free cells: one scan alone shows that of no cell."""
    cells = page.latest["map"].cells if "map" in page.latest else np.zeros(0)
    return bool(((cells >= 0) & (cells < 100.0 * FREE_THRESH)).any())


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_robot_maps_then_delivers_then_maps_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    port = free_port()
    url = f"http://127.0.0.1:{port}/"
    arguments = ("launch", "gmapping_demo", "world:=room", "robot:=chefbot_lidar", f"port:={port}")
    launch = LaunchProcess(arguments, free_port())
    try:
        with page_of(url, mapping=True) as page:
            page.send(do.Explore(True))
            assert page.wait_until(lambda: has_free_floor(page), PATIENCE)
            page.send(do.SaveMap("hall"))
            assert page.wait_until(lambda: page.latest.get("mapping", {}).get("saved") == "hall", PATIENCE)
            page.send(do.DriveOnMap("hall"))
        with page_of(url, mapping=False) as page:
            places = page.wait_for("places", PATIENCE)  # saved beside the map
            assert {place["name"] for place in places} >= {"kitchen", "table_1"}
            page.send(do.MapBuilding())
        with page_of(url, mapping=True):
            pass
    finally:
        output = launch.stop()
    assert launch.process.returncode == 0, output
    assert "waiter runs in place of gmapping_demo" in output
    assert "gmapping_demo runs in place of waiter" in output
