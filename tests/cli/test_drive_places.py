"""`chefbot drive place` against a served web UI."""

from __future__ import annotations

import math

import pytest
from tests.support.fake_robot import fake_robot
from tests.support.waiting import PATIENCE
from typer.testing import CliRunner

from chefbot.cli import running_robot
from chefbot.cli.drive.commands import drive_app
from chefbot.cli.drive.places import print_places, put_place, remove_place
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs.maps import MapEditResult
from chefbot.ui.commands import DeletePlace, PutPlace
from chefbot.ui.display.views import RobotView


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running_robot, "RESPONSE_TIMEOUT", 0.5)


@pytest.mark.slow
def test_a_place_is_where_the_robot_is(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.server.set_layer("robot", RobotView(x=2.0, y=1.1, yaw=math.pi / 2, v=0.0))
        put_place("3", [], robot.url)
        sent = robot.commands.get(timeout=PATIENCE)
    assert isinstance(sent, PutPlace) and sent.id
    assert (sent.name, sent.x, sent.y, sent.yaw, sent.label) == ("table_3", 2.0, 1.1, math.pi / 2, "")
    assert capsys.readouterr().out == "table 3 is a new place at (2.00, 1.10) m, 90 degrees.\n"


@pytest.mark.slow
def test_a_place_that_exists_moves_and_keeps_its_label(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.show_places()
        robot.server.set_layer("edits", (MapEditResult("an older one", False, "Another change."),))
        put_place("2", ["1", "-2", "-0.3"], robot.url)
        sent = robot.commands.get(timeout=PATIENCE)
    assert isinstance(sent, PutPlace) and sent.label == "窗边 2"
    assert capsys.readouterr().out == "table 2 is now at (1.00, -2.00) m, 0 degrees.\n"


@pytest.mark.slow
def test_a_place_that_is_refused_has_its_reason() -> None:
    with fake_robot() as robot, pytest.raises(UserError, match="not stored: table_9 lies in a wall"):
        put_place("9", ["1", "2"], robot.url)


@pytest.mark.slow
def test_an_unknown_or_invalid_pose_is_reported_in_one_sentence() -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="does not know where it is"):
            put_place("bar", [], robot.url)
        with pytest.raises(UserError, match="got 1 number"):
            put_place("bar", ["4"], robot.url)
        with pytest.raises(UserError, match="finite numbers"):
            put_place("bar", ["here", "2"], robot.url)


@pytest.mark.slow
def test_a_place_is_removed_and_the_others_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        print_places(robot.url)
        assert "no named places" in capsys.readouterr().out
        robot.show_places()
        remove_place("1", robot.url)
        sent = robot.commands.get(timeout=PATIENCE)
        assert isinstance(sent, DeletePlace) and sent.name == "table_1"
        print_places(robot.url)
    assert "table_2          (3.00, 0.00) m, 0 degrees  窗边 2\n" in capsys.readouterr().out


@pytest.mark.parametrize("arguments", [["--remove"], ["bar", "1", "2", "--remove"]])
def test_remove_needs_a_name_and_no_pose(arguments: list[str]) -> None:
    result = CliRunner().invoke(drive_app, ["place", *arguments])
    assert isinstance(result.exception, UserError) and "--remove needs" in str(result.exception)
