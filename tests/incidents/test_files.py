"""Files of incidents: whole or not at all, listed with what was noted, and the automatic ones limited."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.incidents.test_buffer import published

from chefbot.incidents import files
from chefbot.incidents.files import (
    MAX_AUTOMATIC,
    NAME,
    Incident,
    read_incident,
    remove_old,
    save_incident,
    saved_incidents,
)
from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.storage.atomic_files import StorageError

ROBOT = load_robot("chefbot")
BOX = Incident(robot="chefbot", time="2026-01-31T09:05:00Z", sentence="A box is in the way.", by="anna")


def saved_at(folder: Path, minute: int, *, by: str = "") -> Path:
    incident = msgspec.structs.replace(BOX, time=f"2026-01-31T09:{minute:02}:00Z", by=by)
    return save_incident(folder, incident, [published("a", 1)], ROBOT, 7)


def test_an_incident_is_read_as_it_was_saved(tmp_path: Path) -> None:
    content = [published("a", 1), published("picture", 2, Image()), published("a", 3)]
    path = save_incident(tmp_path / "new", BOX, content, ROBOT, 7)
    assert path.name == "chefbot-20260131T090500Z.mcap" and list(path.parent.iterdir()) == [path]
    assert read_incident(path) == BOX
    assert path.stat().st_mode & 0o077 == 0, "it may contain pictures of people"
    log = read_log(path)
    assert log.robot == ROBOT and log.seed == 7
    assert [(one.topic, one.time_ns) for one in log.messages] == [("a", 1), ("picture", 2), ("a", 3)]
    assert String.from_cdr(log.messages[2].data).data == "3"


def test_two_incidents_of_one_second_are_both_kept(tmp_path: Path) -> None:
    first, second = saved_at(tmp_path, 1, by="anna"), saved_at(tmp_path, 1, by="anna")
    assert first == second and len(saved_incidents(tmp_path, "chefbot")) == 2


@given(robot=st.text(max_size=60), by=st.sampled_from(["", "anna"]))
def test_every_robot_gives_a_file_name(robot: str, by: str) -> None:
    assert NAME.match(msgspec.structs.replace(BOX, robot=robot, by=by).file_name)


def test_a_full_disk_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Recorder, _: object) -> None:
        self._on_end("recording stopped: No space left on device")
        self.close()

    monkeypatch.setattr(Recorder, "__call__", full)
    with pytest.raises(StorageError, match="No space left"):
        save_incident(tmp_path, BOX, [published("a", 1)], ROBOT, 7)
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_place_of_the_folder_is_reported_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "incidents").write_text("")
    with pytest.raises(StorageError, match="incidents"):
        save_incident(tmp_path / "incidents", BOX, [], ROBOT, 7)


def test_the_newest_come_first_and_nothing_else_is_listed(tmp_path: Path) -> None:
    paths = [saved_at(tmp_path, minute, by="anna") for minute in (3, 1, 2)]
    saved_other = msgspec.structs.replace(BOX, robot="another")
    save_incident(tmp_path, saved_other, [], ROBOT, 7)
    (tmp_path / "note.mcap").write_bytes(b"\x89MCAP0\r\n nothing")
    (tmp_path / "cut.mcap").write_bytes(paths[0].read_bytes()[:200])
    (tmp_path / "note.txt").write_text("")
    Recorder(tmp_path / "run.mcap", ROBOT, 7).close()
    listed = saved_incidents(tmp_path, "chefbot")
    assert [one.name for one in listed] == [paths[i].name for i in (0, 2, 1)]
    assert listed[0].size == paths[0].stat().st_size
    assert len(saved_incidents(tmp_path, "chefbot", 2)) == 2
    assert saved_incidents(tmp_path / "none", "chefbot") == []


def test_only_the_oldest_automatic_ones_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MAX_AUTOMATIC", 3)
    assert MAX_AUTOMATIC > 3
    by_hand = [saved_at(tmp_path, minute, by="anna") for minute in (0, 1)]
    automatic = [saved_at(tmp_path, minute) for minute in range(2, 8)]
    remove_old(tmp_path, "chefbot")
    assert {*tmp_path.iterdir()} == {*by_hand, *automatic[-3:]}


@pytest.mark.parametrize("notes", [{}, {"robot": "chefbot"}, {"robot": "a", "time": "b", "who": "c"}])
def test_notes_of_another_program_are_not_an_incident(tmp_path: Path, notes: dict[str, str]) -> None:
    path = tmp_path / "a.mcap"
    Recorder(path, ROBOT, 7, notes={files.INCIDENT_METADATA: notes}).close()
    assert read_incident(path) is None
