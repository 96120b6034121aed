"""`chefbot doctor`: what it finds out about this computer, and what it calls a problem."""

from __future__ import annotations

import http.server
import os
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer

from chefbot.cli.doctor import computer, report
from chefbot.cli.doctor.commands import doctor
from chefbot.cli.doctor.computer import camera_lines, clock_lines, disk_lines, map_lines, web_ui_lines
from chefbot.devices.state_files import maps_folder
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places
from chefbot.ui.server import WebUiServer

GRID = Grid(np.zeros((40, 60), np.int8), 0.05, 0.0, 0.0)


@contextmanager
def listening(answer: bytes | None) -> Iterator[str]:
    """A server of another program that gives this answer to everything, or none."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.wfile.write(answer or b"")

        def log_message(self, *_: Any) -> None:
            """Print nothing."""

    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


def test_a_web_ui_is_found_on_loopback_and_on_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(computer, "has_screen", lambda: True)
    for host in ("127.0.0.1", "0.0.0.0"):
        server = WebUiServer(0, host, print)
        server.start()
        address = f"http://127.0.0.1:{server.port}"
        assert web_ui_lines(address, 1) == [f"web UI: {address}"]
        server.stop()
    assert web_ui_lines(address, 1) == [f"web UI: none is served at {address}"]


def test_a_web_ui_at_one_of_the_next_ports_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """A launch takes the next free port where another program has the first."""
    monkeypatch.setattr(computer, "has_screen", lambda: True)
    with listening(b"HTTP/1.0 200 OK\r\n\r\nHello") as address:
        port = int(address.rpartition(":")[2])
        server = WebUiServer(port, "127.0.0.1", print)
        server.start()
        try:
            assert f"web UI: http://127.0.0.1:{server.port}" in web_ui_lines(address)
        finally:
            server.stop()


@pytest.mark.parametrize("answer", [b"HTTP/1.0 200 OK\r\n\r\nHello", b"SSH-2.0-OpenSSH\r\n", None])
def test_another_program_at_the_port_is_a_problem(answer: bytes | None) -> None:
    with listening(answer) as address:
        (line,) = web_ui_lines(address, 1)
    assert line.startswith("! web UI: another program uses port ") and "port:=8090" in line


def test_a_program_that_never_answers_causes_no_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(computer, "TIMEOUT", 0.05)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        (line,) = web_ui_lines(f"http://127.0.0.1:{silent.getsockname()[1]}", 1)
    assert line.startswith("! web UI: another program")


def test_without_a_screen_other_devices_can_open_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(computer, "has_screen", lambda: False)
    assert "--lan" in web_ui_lines("http://127.0.0.1:9", 1)[0]


def test_scarce_space_is_a_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "new" / "state"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(computer.shutil, "disk_usage", lambda _: SimpleNamespace(free=5_300_000_000))
    assert disk_lines() == ["disk: 5.3 GB free here"]
    monkeypatch.setattr(computer.shutil, "disk_usage", lambda _: SimpleNamespace(free=200_000_000))
    assert disk_lines() == ["! disk: 0.2 GB free here"]


def test_a_state_that_cannot_be_kept_is_a_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "file"))
    assert any(line.startswith(f"! {tmp_path / 'file'}, where the state") for line in disk_lines())


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """State without the maps that other tests save."""
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "state"))


def test_a_map_that_was_saved_in_the_web_ui_is_listed(tmp_path: Path) -> None:
    maps_folder().mkdir(parents=True)
    save_map(maps_folder() / "home", GRID)
    _, line = map_lines(tmp_path / "elsewhere")
    assert line.startswith(f"  {maps_folder() / 'home.yaml'}: 3 x 2 m")


def test_maps_are_listed_with_their_places(tmp_path: Path) -> None:
    assert map_lines(tmp_path) == ["maps: none here; make one: chefbot demo"]
    for number, name in enumerate(["map", "runs/demo/map", "maps/office"]):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        save_map(tmp_path / name, GRID)
        os.utime((tmp_path / name).with_suffix(".yaml"), (number, number))
    save_places(places_path(tmp_path / "runs/demo/map.yaml"), {"kitchen": SE2(1.0, 1.0, 0.0)})
    (tmp_path / "robot.yaml").write_text("name: mine\n")
    assert map_lines(tmp_path) == [
        "maps:",
        "  maps/office.yaml: 3 x 2 m, no named places, so nothing can be delivered on it",
        "  runs/demo/map.yaml: 3 x 2 m, 1 place",
        "  map.yaml: 3 x 2 m, no named places, so nothing can be delivered on it",
    ]


def test_a_damaged_map_is_a_problem(tmp_path: Path) -> None:
    save_map(tmp_path / "map", GRID)
    (tmp_path / "map.pgm").write_bytes(b"P5")
    _, line = map_lines(tmp_path)
    assert line.startswith("! map.yaml: ")
    save_map(tmp_path / "map", GRID)
    for damage in (b"image: [", b"\xff\x00", b""):
        (tmp_path / "map.yaml").write_bytes(damage)
        _, line = map_lines(tmp_path)
        assert line.startswith("! map.yaml: ")


def test_zones_that_stop_a_launch_are_a_problem(tmp_path: Path) -> None:
    save_map(tmp_path / "map", GRID)
    (tmp_path / "map.zones.yaml").write_text("version: 1\nzones: {a: {kind: nope}}\n")
    _, line = map_lines(tmp_path)
    assert line.startswith("! map.yaml: ") and "zones" in line


def test_of_many_maps_the_newest_are_listed(tmp_path: Path) -> None:
    for number in range(8):
        save_map(tmp_path / f"map{number}", GRID)
    head, *maps = map_lines(tmp_path)
    assert head == "maps (and 3 older):" and len(maps) == 5


def test_cameras_are_listed_by_name(tmp_path: Path) -> None:
    assert camera_lines(tmp_path) == ["cameras: none is plugged in"]
    (tmp_path / "video7").mkdir()
    (tmp_path / "video7" / "name").write_text("UVC Camera\n")
    (tmp_path / "video8").mkdir()
    assert camera_lines(tmp_path) == [
        "cameras:",
        "  /dev/video7: UVC Camera",
        "  /dev/video8: without a name",
    ]


def test_a_camera_that_may_not_be_opened_is_a_problem(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "video7").mkdir()
    monkeypatch.setattr(Path, "exists", lambda _: True)
    monkeypatch.setattr(computer.os, "access", lambda *_: False)
    assert "usermod -aG video" in camera_lines(tmp_path)[1] and camera_lines(tmp_path)[1].startswith("! ")


@pytest.mark.parametrize(("answer", "problems"), [("yes", 0), ("no", 1), ("", 0), (None, 0)])
def test_a_clock_without_synchronization_is_a_problem(
    answer: str | None, problems: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answering(*_: Any, **__: Any) -> Any:
        if answer is None:
            raise FileNotFoundError("timedatectl")
        return subprocess.CompletedProcess([], 0, f"{answer}\n", "")

    monkeypatch.setattr(computer.subprocess, "run", answering)
    assert len(clock_lines()) == problems


def test_a_clock_before_the_installation_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    class Clock(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> Clock:
            return cls(1970, 1, 2, tzinfo=tz)

    monkeypatch.setattr(computer, "datetime", Clock)
    (line,) = clock_lines()
    assert line.startswith("! clock: it shows 1970-01-02")


def test_the_number_of_problems_comes_last(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(report, "graph_lines", lambda: ["! 2 nodes are called /a"])
    monkeypatch.setattr(report, "map_lines", lambda _: ["! map.yaml: damaged"])
    for name in ("web_ui_lines", "disk_lines", "camera_lines", "clock_lines"):
        monkeypatch.setattr(report, name, list)
    with pytest.raises(typer.Exit) as ended:
        doctor(SimpleNamespace(invoked_subcommand=None), everything=False)  # type: ignore[arg-type]
    assert ended.value.exit_code == 1
    assert capsys.readouterr().out.splitlines()[-1] == "2 problems, marked by !"
