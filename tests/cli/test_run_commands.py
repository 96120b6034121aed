"""`chefbot replay`, `chefbot launch --supervised` and `chefbot robot service`: what they run, print and return."""

from __future__ import annotations

import getpass
import sys
from pathlib import Path

import pytest
from tests.runtime.test_replay import record

from chefbot.cli.robot import service
from chefbot.cli.run import replay, show_log, supervised
from chefbot.errors import UserError
from chefbot.incidents.files import Incident, save_incident
from chefbot.robot.load import load_robot
from chefbot.runtime.recorded_log import read_log
from chefbot.storage.atomic_files import StorageError

INCIDENT = Incident(robot="chefbot", time="2026-01-31T09:05:00Z", sentence="A box.", by="anna")


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log of five seconds of toy nodes, which need no kernels."""
    monkeypatch.setattr(replay, "compile_kernels", lambda _: None)
    record(tmp_path / "run.mcap")
    return tmp_path / "run.mcap"


@pytest.mark.parametrize("check", [False, True])
def test_a_replay_without_a_difference_is_a_success(
    log: Path, check: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay.run_replay(log, check=check) == 0
    nodes = sum(not one.from_device for one in read_log(log).messages)
    assert f"{nodes} messages of nodes, all bit-identical" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(("check", "code"), [(False, 0), (True, 1)])
def test_a_difference_is_a_failure_when_it_is_checked(
    log: Path, check: bool, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = read_log(log)
    index = next(i for i, one in enumerate(recorded.messages) if one.topic == "double" and i > 20)
    del recorded.messages[index]
    monkeypatch.setattr(replay, "read_log", lambda _: recorded)
    assert replay.run_replay(log, check=check) == code
    output = " ".join(capsys.readouterr().out.split())
    assert "equal messages the log contains" in output and "double" in output


def test_a_replay_of_nothing_is_reported_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.mcap"):
        replay.run_replay(tmp_path / "none.mcap", check=True)


def test_an_incident_is_shown_and_never_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = save_incident(tmp_path, INCIDENT, [], load_robot("chefbot"), 7)
    with pytest.raises(UserError, match=r"begins in the middle of a run.*leave --check out"):
        replay.run_replay(path, check=True)
    shown: list[tuple[Path, Incident | None, int]] = []
    monkeypatch.setattr(show_log, "show_log", lambda _, *rest: shown.append(rest) or 0)
    assert replay.run_replay(path, check=False, port=9000) == 0
    assert shown == [(path, INCIDENT, 9000)]


def test_a_log_is_shown_on_request(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Incident | None] = []
    monkeypatch.setattr(show_log, "show_log", lambda _, __, incident, ___: shown.append(incident) or 0)
    assert replay.run_replay(log, check=False, show=True) == 0 and shown == [None]


def test_an_empty_log_shows_nothing(tmp_path: Path) -> None:
    path = save_incident(tmp_path, INCIDENT, [], load_robot("chefbot"), 7)
    with pytest.raises(UserError, match="no messages to show"):
        show_log.show_log(read_log(path), path, INCIDENT, 8080)


def test_the_title_of_an_incident_has_time_person_and_reason() -> None:
    assert show_log.title_of(Path("x"), INCIDENT) == (
        "Incident of chefbot, 2026-01-31 09:05:00 UTC, saved by anna: A box."
    )
    assert show_log.title_of(Path("runs/run.mcap"), None) == "run.mcap"


def test_a_supervised_launch_runs_the_command_without_option(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []
    monkeypatch.setattr(sys, "argv", ["chefbot", "launch", "robot", "--supervised", "a:=--x", "--host", "b"])
    monkeypatch.setattr(supervised, "run_supervised", lambda arguments, _: started.append(arguments) or 7)
    assert supervised.run_again_after_crashes() == 7
    assert started == [["launch", "robot", "a:=--x", "--host", "b"]]


def test_sentences_of_a_supervised_launch_are_not_markup(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        supervised, "run_supervised", lambda _, log: log("It ended ([red]signal 9[/red]).") or 0
    )
    assert supervised.run_again_after_crashes() == 0
    assert capsys.readouterr().out == "It ended ([red]signal 9[/red]).\n"


@pytest.mark.parametrize("user", ["", "cook"])
def test_a_service_is_a_unit_file_and_its_installation(
    user: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "waiter.service"
    service.run_service("robot_standalone", ["board_port:=/dev/ttyUSB0"], user, out)
    unit, printed = out.read_text(), capsys.readouterr().out
    assert f"User={user or getpass.getuser()}\n" in unit and "board_port:=/dev/ttyUSB0" in unit
    assert f"wrote {out}" in printed and f"cp {out} /etc/systemd/system/" in printed
    assert "systemctl enable --now waiter\n" in printed


def test_a_service_that_cannot_be_is_not_written(tmp_path: Path) -> None:
    out = tmp_path / "waiter.service"
    with pytest.raises(UserError, match="simulates a robot"):
        service.run_service("explore", [], "cook", out)
    assert not out.exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="file"):
        service.run_service("robot_standalone", [], "cook", tmp_path / "file" / "waiter.service")
