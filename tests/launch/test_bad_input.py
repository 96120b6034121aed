"""What people get wrong on the command line is answered in one sentence, without a traceback, exit code 2."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from tests.support.waiting import PATIENCE

from chefbot.cli.app import main
from chefbot.config import ConfigError
from chefbot.errors import UserError
from chefbot.launcher.launch import run_launch
from chefbot.launcher.session import session, start
from chefbot.mapping.image_format import MapFormatError
from chefbot.maths.grid import Grid
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import built_in_launches, load_launch
from chefbot.storage.map_files import save_map
from chefbot.ui.remote.web_ui_client import WebUiClient
from chefbot.ui.web_ui import WebUiDevice

QUICK = ["headless:=true", "speed:=0", "duration:=0.1"]


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (["gmaping_demo"], "did you mean 'gmapping_demo'?"),
        (["gmapping_demo.lanch"], "no launch is called"),
        (["none/such.yaml"], "does not exist"),
        (["gmapping_demo", "wrld:=room"], "did you mean 'world'?"),
        (["amcl_demo", "map:=room.yaml"], "did you mean 'map_file'?"),
        (["robot_standalone", "board:=/dev/ttyACM0"], "did you mean 'board_port'?"),
        (["gmapping_demo", "world:=~nobody.at.all/moon.yaml"], "there is no home folder ~nobody.at.all"),
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
        (["amcl_demo", "map_file:=none.yaml", "world:=room"], "map file none.yaml does not exist"),
        (["amcl_demo", "initial_pose_a:=9", "world:=room"], "yaw"),
        (["keyboard_teleop", "page:=http://127.0.0.1:1"], "no robot runs at"),
        (["robot_standalone", "board_port:=/no/board"], "/no/board does not exist"),
    ],
)
def test_bad_input_is_reported_in_one_sentence_with_exit_code_2(
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


@pytest.mark.parametrize(
    ("argument", "sentence"),
    [
        ("world:=hotl", "did you mean 'hotel'"),
        ("world:=", "no world is called ''"),
        ("start:=[100, 0, 0]", "lies outside"),
    ],
)
def test_a_wrong_world_is_refused_before_kernels_are_compiled(
    argument: str, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chefbot.launcher.launch.compile_kernels", lambda _: pytest.fail("compiled first"))
    with pytest.raises(UserError, match=sentence):
        run_launch("explore", [argument, *QUICK])


def test_a_missing_map_is_refused_before_kernels_are_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chefbot.launcher.launch.compile_kernels", lambda _: pytest.fail("compiled first"))
    with pytest.raises(ConfigError, match=r"map file none.* does not exist"):
        run_launch("amcl_demo", ["map_file:=none.yaml", "world:=room", *QUICK])


def test_no_map_at_all_is_noticed_before_kernels_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chefbot.launcher.launch.compile_kernels", lambda _: pytest.fail("compiled first"))
    monkeypatch.chdir(tmp_path)
    for name in ("amcl_demo", "waiter"):
        with pytest.raises(UserError, match=r"no map yet: `chefbot demo` makes"):
            run_launch(name, ["world:=room", *QUICK])
        with pytest.raises(UserError, match=r"no map is given: map_file:=MAP.yaml"):
            run_launch(name, ["built:=true", *QUICK[:1]])


def test_a_map_without_walls_ends_the_start(tmp_path: Path) -> None:
    save_map(tmp_path / "floor", Grid(np.zeros((40, 40), np.int8), 0.05, 0.0, 0.0))
    with pytest.raises(MapFormatError, match=r"floor\.yaml has no occupied cell"):
        run_launch("amcl_demo", [f"world:={tmp_path}/floor.yaml", *QUICK])


def test_a_recording_in_the_way_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"an older recording")
    assert run_launch("chefbot_empty_world", [f"record:={path}", *QUICK]) == 0
    assert (tmp_path / "run.1.mcap").read_bytes() == b"an older recording"
    assert path.stat().st_size > 1000 and "it is kept as" in capsys.readouterr().out


def test_home_paths_are_expanded_after_an_equals_sign(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shells expand `~` neither there nor within quotes, whichever argument is a path."""
    monkeypatch.setenv("HOME", str(tmp_path))
    given = {
        "map_file": "~/maps/office.yaml",
        "world": "~/world.yaml",
        "record": "~/run.mcap",
        "robot": "~/r.yaml",
    }
    launch = load_launch("amcl_demo", given)
    assert {key: launch.args[key] for key in given} == {
        key: value.replace("~", str(tmp_path)) for key, value in given.items()
    }
    assert launch.nodes["map_server"].params["map"] == f"{tmp_path}/maps/office.yaml"
    assert load_launch("amcl_demo", {"record": "a~b"}).args["record"] == "a~b"


def test_port_page_and_board_port_keep_one_meaning_each() -> None:
    """port:= is where the web UI is served, page:= the address of one that runs, board_port:= the motor board."""
    for name in built_in_launches():
        args, nodes = load_launch(name).args, load_launch(name).nodes
        assert isinstance(args.get("port", 0), int), name
        assert str(args.get("page", "http://")).startswith("http://"), name
        boards = [
            entry.params["port"] for entry in nodes.values() if entry.kind.endswith(":MotorBoardDevice")
        ]
        assert boards == [args.get("board_port")] * len(boards), name


def test_launch_without_a_name_lists_the_launches(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["chefbot", "launch"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    out = capsys.readouterr().out
    assert all(
        name in out for name in ("gmapping_demo", "amcl_demo", "robot_standalone", "map_file:=", "seed:=1")
    )
    assert "simulator" not in out.split()


def test_a_failed_start_leaves_the_port_free(tmp_path: Path) -> None:
    """The web UI was up when the map turned out to be missing."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    arguments = [f"port:={port}", f"map_file:={tmp_path}/none.yaml", "world:=room", "duration:=0.1"]
    with pytest.raises(Exception, match="does not exist"):
        run_launch("amcl_demo", arguments)
    with socket.create_server(("127.0.0.1", port)):
        pass


def test_a_used_port_gives_the_next_one_with_a_notice(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        run_launch("chefbot_empty_world", [f"port:={port}", "duration:=0.2", "speed:=0"])
    out = capsys.readouterr().out
    shown = next(line for line in out.splitlines() if "Web UI: " in line)
    assert f"Port {port} is in use by another program." in out
    address = urlsplit(shown.split()[-1])
    assert address.port is not None and port < address.port < port + 20


@pytest.mark.slow
def test_a_program_sees_the_simulated_robot_in_its_web_ui() -> None:
    launch = load_launch("chefbot_empty_world", {"port": "18700"})
    with session(load_robot("chefbot"), 1, launch.clock, 0.0, None) as system:
        start(system, launch)
        page = system.nodes["page"]
        assert isinstance(page, WebUiDevice)
        with WebUiClient(page.url) as remote:
            system.loop.run(until_ns=2_000_000_000)
            assert remote.wait_for("shape", PATIENCE)["radius"] == system.robot.circumscribed_radius
            assert remote.wait_for("status", PATIENCE)["simulation"] is True
