"""`chefbot drive deliveries`: the rounds as lines and as CSV."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from chefbot.cli.drive.deliveries import COLUMNS, print_deliveries
from chefbot.errors import UserError
from chefbot.storage.delivery_history import DeliveryHistory
from chefbot.ui.missions.history_device import history_path


@pytest.fixture
def history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DeliveryHistory:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    return DeliveryHistory(history_path("waiter"))


def test_rounds_are_printed_with_what_became_of_each_table(
    history: DeliveryHistory, capsys: pytest.CaptureFixture[str]
) -> None:
    number = history.begin("a", "anna", ("table_1", "table_2"), simulated=True)
    history.note_stop(number, "table_1", "taken")
    history.end(number, "At home.")
    history.begin("b", "", ("bar",), simulated=False)
    print_deliveries("", 5, None)
    first, second = capsys.readouterr().out.splitlines()
    assert "  anna: table 1 (taken), table 2 (open); until " in first and first.endswith(
        "; At home. [simulated]"
    )
    assert second.endswith("  bar (open); unfinished")
    print_deliveries("waiter", 1, None)
    assert capsys.readouterr().out.count("\n") == 1


def test_a_table_of_any_name_is_a_line_of_the_csv_file(history: DeliveryHistory, tmp_path: Path) -> None:
    names = ('the "big", round one', "Küche\nunten", "=1+1")
    number = history.begin("a", "anna", names, {"=1+1": "Bar"}, simulated=False)
    for name in names:
        history.note_stop(number, name, f"{name}; taken")
    target = tmp_path / "out" / "rounds.csv"
    print_deliveries("", 5, target)
    with target.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert tuple(head) == COLUMNS
    assert [row[5] for row in rows] == list(names) and [row[6] for row in rows] == ["", "", "Bar"]
    assert [row[7] for row in rows] == [f"{name}; taken" for name in names]


def test_a_robot_without_history_is_reported_in_one_sentence(
    history: DeliveryHistory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(
        UserError, match=r"no deliveries of robot 'waitr' \(did you mean 'waiter'\?\); there are deliveries"
    ):
        print_deliveries("waitr", 5, None)
    DeliveryHistory(history_path("other"))
    with pytest.raises(UserError, match="deliveries of other, waiter"):
        print_deliveries("", 5, None)
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "new"))
    with pytest.raises(UserError, match=r"^there are no deliveries in [^;]*$"):
        print_deliveries("", 5, None)
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "file"))
    with pytest.raises(UserError, match=r"is not a folder$"):
        print_deliveries("", 5, None)


def test_an_empty_history_has_no_rounds(history: DeliveryHistory, capsys: pytest.CaptureFixture[str]) -> None:
    history.close()
    print_deliveries("waiter", 5, None)
    assert capsys.readouterr().out == "No rounds yet.\n"
