"""`chefbot deliver` and `chefbot map_saver` against a served page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from chefbot.cli.remote import order_delivery, press_round, save_running_map
from tests.support.fake_robot import PLACES, fake_robot
from tests.support.waiting import PATIENCE

from chefbot.cli import remote
from chefbot.errors import UserError
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.map_files import load_map
from chefbot.storage.places import load_places
from chefbot.ui.commands import Deliver, Loaded


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "RESPONSE_TIMEOUT", 0.5)


@pytest.mark.parametrize(
    ("fate", "code", "said"),
    [
        ("home", 0, "At home, waiting for an order."),
        ("failed", 1, "table_1 was not reached."),
        ("cancelled", 1, "not delivered: table_2"),
        ("behind", 0, "Behind other orders: table_9 was not reached."),
    ],
)
def test_deliver_waits_and_tells_how_it_ended(
    fate: str, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with fake_robot(fate) as robot:
        robot.know_places()
        robot.wait_for_orders()
        assert order_delivery(["1", "table 2"], robot.url, wait=True) == code
        assert robot.heard.get(timeout=PATIENCE) == Deliver(["table_1", "table_2"])
    assert said in capsys.readouterr().out


def test_deliver_need_not_wait(capsys: pytest.CaptureFixture[str]) -> None:
    with fake_robot() as robot:
        robot.know_places()
        robot.wait_for_orders()
        assert order_delivery(["2"], robot.url, wait=False) == 0
        assert robot.heard.get(timeout=PATIENCE) == Deliver(["table_2"])
    assert capsys.readouterr().out == "ordered: table_2\n"


def test_a_refused_order_is_told() -> None:
    with fake_robot("refused") as robot:
        robot.know_places()
        robot.wait_for_orders()
        for wait in (True, False):
            with pytest.raises(UserError, match="not today"):
                order_delivery(["2"], robot.url, wait)


def test_an_unknown_table_is_answered_with_the_nearest_and_nothing_is_sent() -> None:
    with fake_robot() as robot:
        robot.know_places()
        robot.wait_for_orders()
        with pytest.raises(UserError, match=r"'kitchn'.*did you mean 'kitchen'"):
            order_delivery(["1", "kitchn"], robot.url, wait=True)
        assert robot.heard.empty()


def test_round_says_what_is_waited_for_presses_it_and_says_what_follows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with fake_robot() as robot:
        robot.wait_for_food()
        assert press_round("", robot.url) == 0
        assert f"In the kitchen.\n  chefbot round loaded --page '{robot.url}'" in capsys.readouterr().out
        with pytest.raises(UserError, match="does not wait for that"):
            press_round("go-on", robot.url)
        assert press_round("loaded", robot.url) == 0
        assert robot.heard.get(timeout=PATIENCE) == Loaded()
    assert capsys.readouterr().out == "On the way to table_1.\n"


def test_a_press_that_changes_nothing_is_a_failure() -> None:
    with fake_robot() as robot:
        robot.wait_for_food()
        assert press_round("taken", robot.url) == 1


def test_a_robot_that_does_not_deliver_says_which_launch_does() -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="amcl_demo"):
            order_delivery(["1"], robot.url, wait=True)
        robot.know_places()
        with pytest.raises(UserError, match="amcl_demo"):
            order_delivery(["1"], robot.url, wait=True)


def test_map_saver_saves_what_the_robot_shows(tmp_path: Path) -> None:
    with fake_robot() as robot:
        robot.know_places()
        grid = robot.map_a_room()
        save_running_map(tmp_path / "room", robot.url)
    saved = load_map(tmp_path / "room.yaml")
    assert np.array_equal(saved.cells, grid.cells)
    assert (saved.resolution, saved.origin_x, saved.origin_y) == (0.05, -1.0, -0.5)
    assert load_places(tmp_path / "room.places.yaml")["kitchen"] == pytest.approx(PLACES["kitchen"], abs=1e-3)


def test_map_saver_keeps_places_that_somebody_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "room.places.yaml"
    mine.write_text("places: {bar: {x: 1 m, y: 1 m}}\n")
    with fake_robot() as robot:
        robot.know_places()
        robot.map_a_room()
        save_running_map(tmp_path / "room", robot.url)
    assert list(load_places(mine)) == ["bar"]
    assert "kept" in capsys.readouterr().out


def test_map_saver_without_a_map_or_a_folder(tmp_path: Path) -> None:
    with fake_robot() as robot:
        with pytest.raises(UserError, match="no map yet"):
            save_running_map(tmp_path / "room", robot.url)
        robot.map_a_room()
        with pytest.raises(StorageError, match="cannot be written"):
            save_running_map(tmp_path / "none" / "room", robot.url)
    assert list(tmp_path.iterdir()) == []
