"""Tests the audit log: bounded in size and rate, whole after crashes and full disks, written by several processes."""

from __future__ import annotations

import errno
import json
import multiprocessing
import os
import stat
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.support.waiting import wait_for

from chefbot.cli.drive.history import print_history
from chefbot.errors import UserError
from chefbot.ui.access import audit_log
from chefbot.ui.access.audit_log import MAX_FILES, AuditLog, Kind, append_line, audit_path, read_entries

ANNA = ("anna", "waiter", "192.168.1.7")


def record(log: AuditLog, kind: Kind, action: str, **details: Any) -> None:
    log.record(kind, ANNA, action, details)


def test_an_entry_names_who_did_what_and_when(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "new" / "robot.jsonl", print, print)
    record(log, Kind.COMMAND, "go_place", name="kitchen")
    log.record(Kind.COMMAND, ANNA, "deliver", {"tables": ["x" * 64] * 32}, "no such place")
    log.close()
    first, second = read_entries(log.path)
    assert (first.name, first.role, first.address) == ANNA and first.details == {"name": "kitchen"}
    assert second.refused == "no such place" and len(second.details["cut"]) == audit_log.MAX_DETAILS
    assert first.time.tzinfo is not None and first.time <= second.time
    assert stat.S_IMODE(log.path.stat().st_mode) == 0o600
    assert [json.loads(line)["action"] for line in log.path.read_text().splitlines()] == [
        "go_place",
        "deliver",
    ]


def test_files_are_rotated_and_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit_log, "MAX_BYTES", 1000)
    path = tmp_path / "robot.jsonl"
    for number in range(1000):
        append_line(path, json.dumps({"time": "2026-01-01T00:00:00Z", "action": f"{number}"}).encode())
    files = [file for file in tmp_path.iterdir() if not file.name.startswith(".")]
    assert len(files) == MAX_FILES and all(file.stat().st_size < 1100 for file in files)
    actions = [int(entry.action) for entry in read_entries(path)]
    assert actions == list(range(actions[0], 1000)) and len(actions) > 80


def _append(path: Path, name: str) -> None:
    for number in range(200):
        append_line(
            path, json.dumps({"time": "2026-01-01T00:00:00Z", "name": name, "action": f"{number}"}).encode()
        )


def test_several_processes_lose_no_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit_log, "MAX_BYTES", 12_000)
    context = multiprocessing.get_context("fork")
    writers = [context.Process(target=_append, args=(tmp_path / "robot.jsonl", name)) for name in "abc"]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    entries = list(read_entries(tmp_path / "robot.jsonl"))
    for name in "abc":
        assert [entry.action for entry in entries if entry.name == name] == [f"{n}" for n in range(200)]


def test_a_flood_hides_no_stop_and_is_counted(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "robot.jsonl", print, print)
    for number in range(5000):
        record(log, Kind.COMMAND, "cancel", number=number)
    record(log, Kind.SAFETY, "stop", id="a")
    wait_for(lambda: log._buckets[Kind.COMMAND].take(audit_log.time.monotonic() + 1.0) is not None)
    log.close()
    entries = list(read_entries(log.path))
    assert entries[-1].action == "stop" and len(entries) < 300


def test_lines_that_a_crash_has_cut_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "robot.jsonl"
    path.write_bytes(b'{"time":"2026-01-01T00:00:00Z","action":"a"}\n{"time":"2026-01-01T0')
    append_line(path, b'{"time":"2026-01-01T00:00:01Z","action":"b"}')
    append_line(path, b'{"time":"2026-01-01T00:00:02Z","action":"c"}')
    with path.open("ab") as file:
        file.write(b"\xff\x00\n[]\n7\n")
    assert [entry.action for entry in read_entries(path)] == ["a", "b", "c"]


@pytest.mark.parametrize("partial", [False, True])
def test_a_full_disk_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, partial: bool) -> None:
    written, sentences, ended, full = os.write, list[str](), list[str](), [True]

    def write(handle: int, data: bytes) -> int:
        if not full[0] or b"action" not in data:
            return written(handle, data)
        if partial:
            return written(handle, data[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(audit_log.os, "write", write)
    log = AuditLog(tmp_path / "robot.jsonl", sentences.append, ended.append)
    for _ in range(3):
        record(log, Kind.SAFETY, "stop")
    wait_for(lambda: log._queue.empty() and sentences)
    full[0] = False
    record(log, Kind.SAFETY, "release_stop")
    log.close()
    assert len(sentences) == 1 and "cannot be written" in sentences[0]
    assert ended == sentences, "the warning is taken back"
    assert [entry.action for entry in read_entries(log.path)][-1] == "release_stop"
    assert log.path.read_bytes().count(b"\n") == len(list(read_entries(log.path)))


def test_the_history_prints_local_time_and_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    with pytest.raises(UserError, match=r"^there are no logs in [^;]*$"):
        print_history("", 5)
    for robot in ("chefbot", "other"):
        log = AuditLog(audit_path(robot), print, print)
        for number in range(9):
            record(log, Kind.COMMAND, f"go {number}")
        record(log, Kind.COMMAND, "put_zone", corners=[(1.23456789, -0.1 - 0.2)], speed=0.3)
        record(log, Kind.CONNECTION, "disconnected")
        log.close()
    with pytest.raises(UserError, match="there are logs of chefbot, other; name a robot"):
        print_history("", 5)
    with pytest.raises(UserError, match="did you mean"):
        print_history("chefbt", 5)
    print_history("chefbot", 3)
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition("  ")[2] for line in lines] == [
        "anna at 192.168.1.7: go 7",
        "anna at 192.168.1.7: go 8",
        'anna at 192.168.1.7: put_zone {"corners":[[1.235,-0.3]],"speed":0.3}',
    ]
    print_history("chefbot", 1, connections=True)
    assert capsys.readouterr().out.rstrip().endswith("anna at 192.168.1.7: disconnected")
    assert sys.platform != "win32"
