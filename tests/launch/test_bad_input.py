"""What people get wrong on the command line is answered in one sentence, without a traceback, exit code 2."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from chefbot.cli import main
from chefbot.commands.launch import run_launch
from chefbot.commands.session import session, start
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.ui.page import PageDevice
from chefbot.ui.remote import RemotePage

QUICK = ["headless:=true", "speed:=0", "duration:=0.1"]


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (["gmaping_demo"], "did you mean 'gmapping_demo'?"),
        (["gmapping_demo.lanch"], "no launch is called"),
        (["none/such.yaml"], "does not exist"),
        (["gmapping_demo", "wrld:=room"], "did you mean 'world'?"),
        (["gmapping_demo", "world=room"], "write key:=value"),
        (["gmapping_demo", ":=room"], "write key:=value"),
        (["gmapping_demo", "port:=many"], "must be a whole number"),
        (["gmapping_demo", "headless:=perhaps"], "must be true or false"),
        (["gmapping_demo", "port:=99999", "headless:=false"], "port"),
        (["gmapping_demo", "seed:=-1"], "must not be below 0"),
        (["gmapping_demo", "speed:=-1"], "speed:=-1.0 must lie between"),
        (["gmapping_demo", "speed:=nan"], "must lie between"),
        (["gmapping_demo", "duration:=nan"], "must be seconds"),
        (["gmapping_demo", "duration:=-3"], "must be seconds"),
        (["gmapping_demo", "world:=moon"], "no world is called 'moon'"),
        (["gmapping_demo", "world:=./moon.yaml"], "moon.yaml does not exist"),
        (["gmapping_demo", "profile:=ideal"], "profile"),
        (["gmapping_demo", "robot:=chefbt"], "did you mean 'chefbot'?"),
        (["gmapping_demo", "record:=/proc/none/run.mcap"], "cannot record to"),
        (["amcl_demo", "map:=none.yaml", "world:=room"], "map file none.yaml does not exist"),
        (["amcl_demo", "map:=none.yaml", "initial_pose_a:=9", "world:=room"], "yaw"),
        (["keyboard_teleop", "page:=http://127.0.0.1:1"], "no robot runs at"),
        (["robot_standalone", "port:=/no/board"], "/no/board does not exist"),
    ],
)
def test_it_is_one_sentence_and_exit_code_2(
    line: list[str], sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = {text.partition(":=")[0] for text in line}
    quick = [text for text in QUICK if text.partition(":=")[0] not in keys]
    monkeypatch.setattr(sys, "argv", ["chefbot", "launch", *line, *quick])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("chefbot: ")
    assert sentence in error
    assert error.count("\n") == 1


def test_without_a_name_it_lists_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["chefbot", "launch"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    out = capsys.readouterr().out
    assert all(name in out for name in ("gmapping_demo", "amcl_demo", "robot_standalone", "map:=", "seed:=1"))
    assert "simulator" not in out.split()


def test_a_failed_start_leaves_the_port_free(tmp_path: Path) -> None:
    """The page was up when the map turned out to be missing."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    arguments = [f"port:={port}", f"map:={tmp_path}/none.yaml", "world:=room", "duration:=0.1"]
    with pytest.raises(Exception, match="does not exist"):
        run_launch("amcl_demo", arguments)
    with socket.create_server(("127.0.0.1", port)):
        pass


def test_a_taken_port_gives_the_next_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        run_launch("chefbot_empty_world", [f"port:={port}", "duration:=0.2", "speed:=0"])
    shown = next(line for line in capsys.readouterr().out.splitlines() if "operator's page" in line)
    address = urlsplit(shown.split()[-1])
    assert address.port is not None and port < address.port < port + 20


def test_a_program_sees_the_simulated_robot_on_its_page() -> None:
    launch = load_launch("chefbot_empty_world", {"port": "18700"})
    with session(load_robot("chefbot"), 1, launch.clock, 0.0, None) as system:
        start(system, launch)
        page = system.nodes["page"]
        assert isinstance(page, PageDevice)
        with RemotePage(page.url) as remote:
            system.loop.run(until_ns=2_000_000_000)
            assert remote.wait_for("robot", 20)["radius"] == system.robot.footprint_radius
            assert remote.wait_for("status", 20)["simulation"] is True
