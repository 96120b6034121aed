"""`chefbot page` prints links for persons that the robot accepts, lists the persons, and revokes links."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from chefbot.cli.page.commands import page_app
from chefbot.cli.page.users import invite_person, print_users, revoke_person
from chefbot.devices.state_files import VARIABLE
from chefbot.errors import ChefbotError, UserError
from chefbot.ui.access.audit_log import AuditLog, Kind, audit_path
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.served_address import write_address
from chefbot.ui.access.visitors import Visitor
from chefbot.ui.qr import qr_code

ROBOT = "chefbot_lidar"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))


def test_the_group_has_a_command_for_each_step() -> None:
    assert {command.name for command in page_app.registered_commands} == {"invite", "users", "revoke"}


def test_invite_prints_a_link_that_the_robot_accepts(capsys: pytest.CaptureFixture[str]) -> None:
    write_address(ROBOT, "https://192.168.1.7:8081/")
    invite_person("anna", "waiter", "", "")
    first, link, *code = capsys.readouterr().out.splitlines()
    address, _, token = link.partition("?token=")
    assert first == f"anna: waiter at {ROBOT}" and address == "https://192.168.1.7:8081/"
    assert Invitations(ROBOT).visitor(token) == Visitor("anna", "waiter")
    assert "\n".join(code) == qr_code(link)


def test_a_second_link_of_a_name_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    write_address(ROBOT, "http://192.168.1.7:8080/")
    for _ in range(2):
        invite_person("anna", "guest", "", "https://robot.example.org/ui")
    out = capsys.readouterr().out
    assert out.count("https://robot.example.org/ui/?token=") == 2
    assert "the older link is not valid any more" in out


def test_people_shows_who_was_here(capsys: pytest.CaptureFixture[str]) -> None:
    print_users(ROBOT)
    assert "chefbot page invite NAME" in capsys.readouterr().out
    for name in ("anna", "李"):
        invite_person(name, "waiter", ROBOT, "")
    log = AuditLog(audit_path(ROBOT), print, print)
    log.record(Kind.COMMAND, ("anna", "waiter", "192.168.1.9"), "cancel", {})
    log.close()
    capsys.readouterr()
    print_users("")
    anna, other = capsys.readouterr().out.splitlines()
    assert anna.startswith("anna  waiter    invited ") and f"last here {datetime.now(UTC).year}" in anna
    assert other.startswith("李    waiter    invited ") and other.endswith("not here yet")


def test_revoke_ends_a_link(capsys: pytest.CaptureFixture[str]) -> None:
    token = Invitations(ROBOT).invite("anna", "waiter")
    revoke_person("anna", "")
    assert Invitations(ROBOT).visitor(token) is None
    assert capsys.readouterr().out == f"The link of anna to {ROBOT} is not valid any more.\n"


@pytest.mark.parametrize(
    ("role", "robot", "address", "sentence"),
    [
        ("chef", ROBOT, "", "unknown role 'chef'"),
        ("waiter", "no_such_robot", "", "no_such_robot"),
        ("waiter", ROBOT, "192.168.1.7", "must be like https://robot.example.org"),
        ("waiter", ROBOT, "ftp://robot", "must be like https://robot.example.org"),
        ("waiter", ROBOT, "http://robot:8080/?token=a", "must be like https://robot.example.org"),
        ("waiter", "", "", "name the robot or its file with --robot"),
    ],
)
def test_invalid_arguments_are_reported_in_one_sentence(
    role: str, robot: str, address: str, sentence: str
) -> None:
    with pytest.raises(ChefbotError, match=sentence):
        invite_person("anna", role, robot, address)


def test_a_robot_is_named_where_there_are_several() -> None:
    for robot in (ROBOT, "desk"):
        write_address(robot, "http://192.168.1.7:8080/")
    with pytest.raises(UserError, match="name a robot"):
        print_users("")
