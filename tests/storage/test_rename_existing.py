"""A file in the way of a new one is kept under another name."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.storage.atomic_files import StorageError, rename_existing


def test_an_existing_file_is_kept_under_the_first_free_number(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    assert rename_existing(path) is None
    for number in (1, 2):
        path.write_text(f"recording {number}")
        assert rename_existing(path) == tmp_path / f"run.{number}.mcap"
        assert not path.exists()
    assert (tmp_path / "run.1.mcap").read_text() == "recording 1"


def test_what_is_not_a_file_stays(tmp_path: Path) -> None:
    assert rename_existing(tmp_path) is None
    assert rename_existing(Path("/dev/full")) is None


def test_a_folder_that_forbids_renaming_has_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("recording")

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(StorageError, match="exists and cannot be renamed: Permission denied"):
        rename_existing(path)
