"""`chefbot why --history` prints the causes of all runs that the web UI has recorded."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.cli.why.recorded import print_recorded
from chefbot.errors import UserError
from chefbot.storage.cause_records import CauseRecords, Moment
from chefbot.ui.missions.history_device import history_path


@pytest.fixture
def records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CauseRecords:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    return CauseRecords(history_path("waiter"))


def test_the_newest_causes_are_lines_the_newest_last(
    records: CauseRecords, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in range(3):
        records.add(Moment(effect="Stopped", sentence=f"Cause {number}."), simulated=number == 2)
    records.end(2, 2.5)
    print_recorded("", 2)
    first, second = capsys.readouterr().out.splitlines()
    assert first.endswith("Stopped 2.5 s     Cause 1.")
    assert second.endswith("Stopped           Cause 2. [simulated]")


def test_all_are_printed_without_a_number(records: CauseRecords, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(30):
        records.add(Moment(effect="Failed", sentence=f"Cause {number}."), simulated=False)
    print_recorded("waiter", None)
    assert len(capsys.readouterr().out.splitlines()) == 30


def test_an_empty_history_has_no_causes(records: CauseRecords, capsys: pytest.CaptureFixture[str]) -> None:
    print_recorded(records.path.stem, 5)
    assert capsys.readouterr().out == "No causes yet.\n"


def test_another_robot_is_refused_by_name(records: CauseRecords) -> None:
    with pytest.raises(UserError, match=f"of robot 'waitre'.*did you mean.*{records.path.stem}"):
        print_recorded("waitre", 5)
